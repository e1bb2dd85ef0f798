// Point sets that cover the unit square evenly, each randomised so that a point by itself is uniform. In: index of the point and
// seeds. Out: points in [0, 1). Knows not whose points they are. Host twin of what a jitter needs: renderer/src/sampling.rs.
#ifndef LIB_LOW_DISCREPANCY
#define LIB_LOW_DISCREPANCY

#include "lib/hash.glsl"

// The largest float below 1.
const float BELOW_ONE = 0.999999940395355224609375;

// Laine-Karras permutation with the constants of Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, section 3:
// every bit depends on the seed and on the bits below it only, which on reversed numbers is an Owen scramble.
uint owen_permute_reversed(uint reversed, uint seed) {
    uint x = reversed + seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// Second Sobol dimension: its generator matrix is Pascal's triangle modulo 2, and C(j, i) is odd exactly when the bits of i
// are among those of j, so the product is a sum over supersets, five steps long. The result is bit-reversed (digit i in bit i).
uint sobol_second_reversed(uint index) {
    uint v = index;
    v ^= v >> 16u;
    v ^= (v >> 8u) & 0x00ff00ffu;
    v ^= (v >> 4u) & 0x0f0f0f0fu;
    v ^= (v >> 2u) & 0x33333333u;
    v ^= (v >> 1u) & 0x55555555u;
    return v;
}

// A point of the first two Sobol dimensions as 32 binary digits each: order shuffled by seeds.x, digits scrambled by y and z.
uvec2 sobol_digits(uint index, uvec3 seeds) {
    uint shuffled = bitfieldReverse(owen_permute_reversed(bitfieldReverse(index), seeds.x));
    uint x = owen_permute_reversed(shuffled, seeds.y);
    uint y = owen_permute_reversed(sobol_second_reversed(shuffled), seeds.z);
    return uvec2(bitfieldReverse(x), bitfieldReverse(y));
}

vec2 digits_to_point(uvec2 digits) {
    return vec2(unit_float(digits.x), unit_float(digits.y));
}

// Of a random word, a number below `count`; by parts of 16 bits, so that one word serves twice.
uint below(uint half_word, uint count) {
    return (half_word * count) >> 16u;
}

// The next node of a tree of digits: one random word a node.
uint digit_node(uint node, uint digit) {
    return hash_pcg(node ^ ((digit + 1u) * 0x9e3779b9u));
}

// Radical inverse of an index below 2^24 in a prime base below 256, scrambled as Owen (1995) does: the permutation of a digit is
// drawn anew for every value of the digits before it. a * digit + c modulo a prime maps two different digits to a uniform pair of
// different digits, which is all that the variance of Owen's scrambling depends on.
float radical_inverse_scrambled(uint base, uint index, uint seed) {
    if (base == 2u) {
        return unit_float(bitfieldReverse(owen_permute_reversed(index, seed)));
    }
    uint node = seed;
    uint value = 0u;
    uint scale = 1u;
    while (scale < 0x1000000u) {
        uint digit = index % base;
        index /= base;
        uint a = 1u + below(node & 0xffffu, base - 1u);
        uint c = below(node >> 16u, base);
        value = value * base + (a * digit + c) % base;
        scale *= base;
        node = digit_node(node, digit);
    }
    return min(float(value) / float(scale), BELOW_ONE);
}

// Bases of the Halton pairs that do not share theirs.
const uint HALTON_PAIRS = 8u;
const uvec2 HALTON_BASES[HALTON_PAIRS] = uvec2[HALTON_PAIRS](uvec2(2u, 3u), uvec2(5u, 7u), uvec2(11u, 13u), uvec2(17u, 19u),
    uvec2(23u, 29u), uvec2(31u, 37u), uvec2(41u, 43u), uvec2(47u, 53u));

// A point of a Halton (1960) pair. `index` is below 2^24.
vec2 halton_point(uint index, uvec2 bases, uvec2 seeds) {
    return vec2(radical_inverse_scrambled(bases.x, index, seeds.x), radical_inverse_scrambled(bases.y, index, seeds.y));
}

// Length of the runs that are shuffled: 6^6.
const uint SHUFFLE_RUN = 46656u;

// Permutes 0..6^6-1 so that every aligned run of 6^k numbers becomes another one: Owen's shuffling of the order (Burley 2020, section
// 5) for bases 2 and 3 at once. d -> (((d + c) mod 6) + 1) * a mod 7 - 1 permutes a digit, as 1..6 is a group modulo 7.
uint shuffle_base_6(uint index, uint seed) {
    uint node = seed;
    uint shuffled = 0u;
    for (uint place = SHUFFLE_RUN / 6u; place > 0u; place /= 6u) {
        uint digit = index / place % 6u;
        uint a = 1u + below(node & 0xffffu, 6u);
        uint c = below(node >> 16u, 6u);
        shuffled += place * (((digit + c) % 6u + 1u) * a % 7u - 1u);
        node = digit_node(node, digit);
    }
    return shuffled;
}

// A random permutation of 0..size-1: rounds that permute the next power of two, again until the result lies inside
// (cycle walking: Black and Rogaway, "Ciphers with Arbitrary Finite Domains", 2002).
uint shuffle_below(uint index, uint size, uint seed) {
    uint bits = uint(findMSB(size - 1u) + 1);
    uint mask = (1u << bits) - 1u;
    uint x = index;
    do {
        uint key = seed;
        for (uint i = 0u; i < 4u; ++i) {
            key = hash_pcg(key);
            x = (x * (key | 1u) + (key >> 16u)) & mask;
            x ^= x >> ((bits + 1u) / 2u);
        }
    } while (x >= size);
    return x;
}

// A point of a Hammersley (1960) set of `size` points (at most 2^30), in random order: somewhere in the strip number i along x,
// the scrambled radical inverse of i in base 2 along y. index < size.
vec2 hammersley_point(uint index, uint size, uvec4 seeds) {
    uint i = shuffle_below(index, size, seeds.x);
    float x = (float(i) + unit_float(hash_combine(seeds.y, i))) / float(size);
    return vec2(min(x, BELOW_ONE), unit_float(bitfieldReverse(owen_permute_reversed(i, seeds.z))));
}

// The bits of x and y in turn: pixels near on this curve are near in the image (Morton 1966). Sides below 65536.
uint z_order(uvec2 pixel) {
    uvec2 v = pixel & 0xffffu;
    v = (v | (v << 8u)) & 0x00ff00ffu;
    v = (v | (v << 4u)) & 0x0f0f0f0fu;
    v = (v | (v << 2u)) & 0x33333333u;
    v = (v | (v << 1u)) & 0x55555555u;
    return v.x | (v.y << 1u);
}

#endif
