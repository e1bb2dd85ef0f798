// Random numbers as a function of (seed, stream, pixel, sample, dimension): nothing is carried from call to call.
// In: integers. Out: points of the chosen sampler in [0, 1). Knows not what a dimension is used for.
#ifndef LIB_RANDOM
#define LIB_RANDOM

#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

#include "shared/sampler.glsl"
#include "lib/low_discrepancy.glsl"

// What the numbers of one surface along a path are for. A purpose has room for 4096 pairs.
const uint PURPOSE_LOBE = 0u;           // direction of the next ray (pair 0), which lobe (1), Russian roulette (2)
const uint PURPOSE_LIGHT_CHOICE = 1u;   // which light, pair = number of the draw
const uint PURPOSE_LIGHT_POINT = 2u;    // where on the light, pair = number of the light or draw
const uint PURPOSE_EMISSIVE = 3u;       // which triangle (0), where on it (1)
const uint PURPOSE_ENVIRONMENT = 4u;    // which strategy (0), which cell (1), where in it (2)
const uint PURPOSE_JITTER = 15u;        // where in the pixel, the same in all of them: drawn on the host, renderer/src/sampling.rs
const uint PURPOSE_PAIRS = 4096u;

// vertex: 0 for the surface seen by the camera, 1 for the next one along the path; branch: 1 on the second path of a glass surface.
uint sample_dimension(uint vertex, uint branch, uint purpose, uint pair) {
    return ((vertex * 2u + branch) * 16u + purpose) * PURPOSE_PAIRS + pair;
}

// One pixel's place in the sample set.
struct Sequence {
    uvec2 pixel;
    uint scramble;  // of seed, stream and the part of the index above 32 bits
    uint index;     // within the stream
    uint set_size;  // points of a Hammersley set
};

// Stream = sample & 1, index within it = sample >> 1. The streams are scrambled independently.
Sequence sequence_begin(uint seed, uvec2 pixel, uint64_t sample_index) {
    uint stream = uint(sample_index & 1ul);
    uint64_t index = sample_index >> 1;
    uint scramble = hash_combine(hash_combine(seed, stream), uint(index >> 32));
    return Sequence(pixel, scramble, uint(index & 0xfffffffful), HAMMERSLEY_SIZE);
}

// Scramble of run number `run` of a sequence: runs know nothing of each other.
uint run_scramble(uint scramble, uint run) {
    return run == 0u ? scramble : hash_combine(scramble, run);
}

// The `which`-th of `count` points that one sample takes from the same dimensions (several shadow rays a pixel): together
// with those of the other samples they still form one set.
Sequence sequence_split(Sequence sequence, uint count, uint which) {
    uint64_t index = uint64_t(sequence.index) * uint64_t(count) + uint64_t(which);
    uint scramble = run_scramble(sequence.scramble, uint(index >> 32));
    return Sequence(sequence.pixel, scramble, uint(index & 0xfffffffful), sequence.set_size * count);
}

// Owen-scrambled Sobol. Pairs are padded: shuffled and scrambled independently (Burley 2020, section 5).
vec2 sample_sobol(Sequence sequence, uint dimension) {
    uvec4 seeds = hash_pcg4d(uvec4(sequence.pixel, dimension, sequence.scramble));
    return digits_to_point(sobol_digits(sequence.index, seeds.xyz));
}

// Dimensions of the first surface that have bases of their own, the most wanted first.
const uint HALTON_DIMENSIONS[HALTON_PAIRS] = uint[HALTON_PAIRS](PURPOSE_JITTER * PURPOSE_PAIRS, PURPOSE_LIGHT_POINT * PURPOSE_PAIRS,
    PURPOSE_EMISSIVE * PURPOSE_PAIRS + 1u, PURPOSE_EMISSIVE * PURPOSE_PAIRS, PURPOSE_ENVIRONMENT * PURPOSE_PAIRS + 2u,
    PURPOSE_ENVIRONMENT * PURPOSE_PAIRS + 1u, PURPOSE_LOBE * PURPOSE_PAIRS, PURPOSE_LOBE * PURPOSE_PAIRS + 1u);

// Halton, scrambled a pixel. A dimension without bases of its own takes 2 and 3 with its order shuffled: a larger base than the
// samples of a pixel would be no better than independent numbers.
vec2 sample_halton(Sequence sequence, uint dimension) {
    for (uint i = 0u; i < HALTON_PAIRS; ++i) {
        if (HALTON_DIMENSIONS[i] == dimension) {
            uint scramble = run_scramble(sequence.scramble, sequence.index >> 24u);
            uvec4 seeds = hash_pcg4d(uvec4(sequence.pixel, dimension, scramble));
            return halton_point(sequence.index & 0xffffffu, HALTON_BASES[i], seeds.yz);
        }
    }
    uint scramble = run_scramble(sequence.scramble, sequence.index / SHUFFLE_RUN);
    uvec4 seeds = hash_pcg4d(uvec4(sequence.pixel, dimension, scramble));
    return halton_point(shuffle_base_6(sequence.index % SHUFFLE_RUN, seeds.x), uvec2(2u, 3u), seeds.yz);
}

// One Hammersley set after the other, in an order of its own for every pair.
vec2 sample_hammersley(Sequence sequence, uint dimension) {
    uint scramble = run_scramble(sequence.scramble, sequence.index / sequence.set_size);
    uvec4 seeds = hash_pcg4d(uvec4(sequence.pixel, dimension, scramble));
    return hammersley_point(sequence.index % sequence.set_size, sequence.set_size, seeds);
}

vec2 sample_independent(Sequence sequence, uint dimension) {
    uint scramble = hash_combine(sequence.scramble, sequence.index);
    return digits_to_point(hash_pcg4d(uvec4(sequence.pixel, dimension, scramble)).xy);
}

// Sobol with blue-noise offsets: all pixels share one scrambled sequence, and each adds (modulo 2, digit by digit) the point of another
// whose index is its place on the shuffled Z curve. The offsets of every aligned block of 2^k x 2^k pixels are a net, so that errors
// of neighbours cancel (Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error", 2020); and a net
// stays a net under such an offset, which it would not when turned around the unit square.
vec2 sample_blue_noise(Sequence sequence, uint dimension) {
    uvec4 seeds = hash_pcg4d(uvec4(0u, 0u, dimension, sequence.scramble));
    uvec4 offset_seeds = hash_pcg4d(uvec4(1u, 0u, dimension, sequence.scramble));
    uvec2 offset = sobol_digits(z_order(sequence.pixel), offset_seeds.xyz);
    return digits_to_point(sobol_digits(sequence.index, seeds.xyz) ^ offset);
}

// A 2D point of pair number `dimension`.
vec2 sample_2d(Sequence sequence, uint dimension) {
    if (SAMPLER == SAMPLER_HALTON) {
        return sample_halton(sequence, dimension);
    }
    if (SAMPLER == SAMPLER_HAMMERSLEY) {
        return sample_hammersley(sequence, dimension);
    }
    if (SAMPLER == SAMPLER_INDEPENDENT) {
        return sample_independent(sequence, dimension);
    }
    if (SAMPLER == SAMPLER_BLUE_NOISE) {
        return sample_blue_noise(sequence, dimension);
    }
    return sample_sobol(sequence, dimension);
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

#endif
