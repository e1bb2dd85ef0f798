// Tone maps. In: linear Rec.709 radiance after exposure, finite and not negative. Out: linear Rec.709 for a display, 0..1.
#ifndef LIB_TONE_MAP
#define LIB_TONE_MAP

#include "shared/frame.glsl"

// Rational fit to the ACES reference rendering and output transform in one (Stephen Hill, 2015), with its two matrices.
vec3 tone_map_aces(vec3 color) {
    const mat3 input_rows = mat3(
        0.59719, 0.35458, 0.04823,
        0.07600, 0.90834, 0.01566,
        0.02840, 0.13383, 0.83777);
    const mat3 output_rows = mat3(
        1.60475, -0.53108, -0.07367,
        -0.10208, 1.10813, -0.00605,
        -0.00327, -0.07276, 1.07602);
    vec3 x = color * input_rows; // row by row
    x = min(x, vec3(1e6));       // the quotient below is at its limit long before, and the squares stay finite
    vec3 fitted = (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.4329510) + 0.238081);
    return clamp(fitted * output_rows, 0.0, 1.0);
}

// AgX (Troy Sobotka) in the approximation by a polynomial of degree 6 (Benjamin Wrensch, 2023): matrix, log2 range, sigmoid, matrix back.
vec3 tone_map_agx(vec3 color) {
    const mat3 inset = mat3(
        0.842479062253094, 0.0423282422610123, 0.0423756549057051,
        0.0784335999999992, 0.878468636469772, 0.0784336,
        0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const mat3 outset = mat3(
        1.19687900512017, -0.0528968517574562, -0.0529716355144438,
        -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
        -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
    const float minimum_ev = -12.47393;
    const float maximum_ev = 4.026069;
    vec3 x = log2(max(inset * color, vec3(1e-10)));
    x = (clamp(x, minimum_ev, maximum_ev) - minimum_ev) / (maximum_ev - minimum_ev);
    vec3 x2 = x * x;
    vec3 x4 = x2 * x2;
    x = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return clamp(pow(max(outset * x, vec3(0.0)), vec3(2.2)), 0.0, 1.0);
}

// Khronos PBR Neutral (specification 2024): base colours up to 0.8 - offset stay as they are, highlights are compressed and desaturated.
vec3 tone_map_neutral(vec3 color) {
    const float start = 0.8 - 0.04;
    const float desaturation = 0.15;
    float low = min(color.r, min(color.g, color.b));
    float offset = low < 0.08 ? low - 6.25 * low * low : 0.04;
    vec3 x = color - offset;
    float peak = max(x.r, max(x.g, x.b));
    if (peak < start) {
        return x;
    }
    float d = 1.0 - start;
    float compressed = 1.0 - d * d / (peak + d - start);
    float g = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0);
    return mix(x * (compressed / peak), vec3(compressed), g);
}

vec3 tone_map(vec3 color, uint kind) {
    vec3 x = min(color, vec3(1e30)); // products of two channels stay finite
    switch (kind) {
        case TONE_MAP_ACES: return tone_map_aces(x);
        case TONE_MAP_AGX: return tone_map_agx(x);
        case TONE_MAP_NEUTRAL: return clamp(tone_map_neutral(x), 0.0, 1.0);
        default: return clamp(x, 0.0, 1.0);
    }
}

#endif
