// Random numbers as a function of (seed, stream, pixel, sample, dimension): nothing is carried from call to call.
// In: integers. Out: points of Owen-scrambled Sobol sets in [0, 1). Knows not what a dimension is used for.
#ifndef LIB_RANDOM
#define LIB_RANDOM

#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

// PCG-RXS-M-XS as a hash: O'Neill 2014; Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
uint hash_pcg(uint v) {
    uint state = v * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

uint hash_combine(uint a, uint b) {
    return hash_pcg(b ^ (hash_pcg(a) * 0x9e3779b9u + 0x7f4a7c15u));
}

// pcg4d of the same article: four words in, four well mixed words out.
uvec4 hash_pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The upper 24 bits as a float: exact, and below 1.
float unit_float(uint x) {
    return float(x >> 8u) * 5.9604644775390625e-8;
}

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

// One pixel's place in the sample set.
struct Sequence {
    uvec2 pixel;
    uint scramble;  // of seed, stream and the part of the index above 32 bits
    uint index;     // within the stream
};

// Stream = sample & 1, index within it = sample >> 1. The streams are scrambled independently.
Sequence sequence_begin(uint seed, uvec2 pixel, uint64_t sample_index) {
    uint stream = uint(sample_index & 1ul);
    uint64_t index = sample_index >> 1;
    uint scramble = hash_combine(hash_combine(seed, stream), uint(index >> 32));
    return Sequence(pixel, scramble, uint(index & 0xfffffffful));
}

// The `which`-th of `count` points that one sample takes from the same dimensions (several shadow rays a pixel): together
// with those of the other samples they still form one Sobol set.
Sequence sequence_split(Sequence sequence, uint count, uint which) {
    uint64_t index = uint64_t(sequence.index) * uint64_t(count) + uint64_t(which);
    uint high = uint(index >> 32);
    uint scramble = high == 0u ? sequence.scramble : hash_combine(sequence.scramble, high);
    return Sequence(sequence.pixel, scramble, uint(index & 0xfffffffful));
}

// A 2D point of pair number `dimension`; pairs are padded: shuffled and scrambled independently (Burley 2020, section 5).
vec2 sample_2d(Sequence sequence, uint dimension) {
    uvec4 seeds = hash_pcg4d(uvec4(sequence.pixel, dimension, sequence.scramble));
    uint index = bitfieldReverse(owen_permute_reversed(bitfieldReverse(sequence.index), seeds.x));
    uint x = bitfieldReverse(owen_permute_reversed(index, seeds.y));
    uint y = bitfieldReverse(owen_permute_reversed(sobol_second_reversed(index), seeds.z));
    return vec2(unit_float(x), unit_float(y));
}

float sample_1d(Sequence sequence, uint dimension) {
    return sample_2d(sequence, dimension).x;
}

// Two padded pairs: takes `dimension` and `dimension + 1`.
vec4 sample_4d(Sequence sequence, uint dimension) {
    return vec4(sample_2d(sequence, dimension), sample_2d(sequence, dimension + 1u));
}

// One word that belongs to this pixel and sample: where a decision is made per triangle (coverage), not per dimension.
uint sequence_seed(Sequence sequence) {
    return hash_pcg4d(uvec4(sequence.pixel, sequence.index, sequence.scramble)).x;
}

// What the numbers of one surface along a path are for. A purpose has room for 4096 pairs.
const uint PURPOSE_LOBE = 0u;           // direction of the next ray (pair 0), which lobe (1), Russian roulette (2)
const uint PURPOSE_LIGHT_CHOICE = 1u;   // which light, pair = number of the draw
const uint PURPOSE_LIGHT_POINT = 2u;    // where on the light, pair = number of the light or draw
const uint PURPOSE_EMISSIVE = 3u;       // which triangle (0), where on it (1)
const uint PURPOSE_ENVIRONMENT = 4u;    // which strategy (0), which cell (1), where in it (2)

// vertex: 0 for the surface seen by the camera, 1 for the next one along the path; branch: 1 on the second path of a glass surface.
uint sample_dimension(uint vertex, uint branch, uint purpose, uint pair) {
    return ((vertex * 2u + branch) * 16u + purpose) * 4096u + pair;
}

#endif
