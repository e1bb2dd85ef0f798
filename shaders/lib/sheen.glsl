// Cloth (KHR_materials_sheen): fibres that stand up, by Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017 ("Charlie").
// Frame: z is the shading normal; v, l unit, v.z > 0, l.z > 0. In: a Sheen. Out: brdf x cosine, the share that is left for the layers below.
// Sampled by the cosine lobe (lib/brdf.glsl: cosine_sample, cosine_pdf), which the diffuse base needs anyway.
// Where it leaves the extension's text: roughness below SHEEN_ROUGHNESS_MIN and cosines below SHEEN_COSINE_MIN are held there; and where the
// lobe alone would reflect more than arrives (roughness below 0.25, near grazing) it is divided by that sum, so that it reflects all, no more.
#ifndef LIB_SHEEN
#define LIB_SHEEN

#include "shared/scene.glsl"
#include "lib/vector.glsl"

const float SHEEN_ROUGHNESS_MIN = 0.05;
const float SHEEN_COSINE_MIN = 1e-3;

struct Sheen {
    vec3 color;         // 0..1
    float roughness;    // perceptual, SHEEN_ROUGHNESS_MIN..1
    uint64_t albedo;    // SheenAlbedoTable
};

// The fit of the Smith function, with two sets of numbers that (1 - alpha)^2 leads between.
float sheen_lambda_exponent(float x, float share) {
    float a = mix(21.5473, 25.3245, share);
    float b = mix(3.82987, 3.32435, share);
    float c = mix(0.19823, 0.16801, share);
    float d = mix(-1.97760, -1.27393, share);
    float e = mix(-4.32054, -4.85967, share);
    return a / (1.0 + b * pow(x, c)) + d * x + e;
}

float sheen_lambda(float cosine, float alpha) {
    float share = (1.0 - alpha) * (1.0 - alpha);
    return exp(cosine < 0.5 ? sheen_lambda_exponent(cosine, share)
        : 2.0 * sheen_lambda_exponent(0.5, share) - sheen_lambda_exponent(max(1.0 - cosine, 0.0), share)); // rounding may pass 1
}

// Density of fibre normals, 1/sr. sin2: squared sine of the half vector's angle.
float sheen_distribution(float sin2, float alpha) {
    return (2.0 + 1.0 / alpha) * pow(sin2, 0.5 / alpha) / TAU;
}

// The extension's brdf x cosine for a white sheen.
float sheen_lobe(float alpha, vec3 v, vec3 l) {
    vec3 half_sum = v + l;
    float across = dot(half_sum.xy, half_sum.xy);
    float sin2 = across / max(across + half_sum.z * half_sum.z, 1e-30);
    float v_z = max(v.z, SHEEN_COSINE_MIN);
    float l_z = max(l.z, SHEEN_COSINE_MIN);
    float smith = 1.0 + sheen_lambda(v_z, alpha) + sheen_lambda(l_z, alpha);
    return l.z * sheen_distribution(sin2, alpha) / (4.0 * v_z * l_z * smith);
}

// Share of evenly arriving light that a white sheen reflects: bilinear in the table of renderer/src/tables/sheen.rs.
float sheen_albedo(Sheen sheen, float cosine) {
    float last = float(SHEEN_ALBEDO_SIDE - 1u);
    float x = sqrt(clamp((cosine - SHEEN_COSINE_MIN) / (1.0 - SHEEN_COSINE_MIN), 0.0, 1.0)) * last;
    float y = clamp((sheen.roughness - SHEEN_ROUGHNESS_MIN) / (1.0 - SHEEN_ROUGHNESS_MIN), 0.0, 1.0) * last;
    uvec2 cell = min(uvec2(x, y), uvec2(SHEEN_ALBEDO_SIDE - 2u));
    vec2 within = vec2(x, y) - vec2(cell);
    SheenAlbedoTable table = SheenAlbedoTable(sheen.albedo);
    uint at = cell.y * SHEEN_ALBEDO_SIDE + cell.x;
    vec2 row = mix(vec2(table.at[at], table.at[at + SHEEN_ALBEDO_SIDE]), vec2(table.at[at + 1u], table.at[at + SHEEN_ALBEDO_SIDE + 1u]), within.x);
    return mix(row.x, row.y, within.y);
}

// The larger of both directions' shares: keeps lobe and base reciprocal.
float sheen_albedo(Sheen sheen, float v_z, float l_z) {
    return max(sheen_albedo(sheen, v_z), sheen_albedo(sheen, l_z));
}

// brdf x cosine.
vec3 sheen_evaluate(Sheen sheen, vec3 v, vec3 l) {
    float excess = max(sheen_albedo(sheen, v.z, l.z), 1.0);
    return sheen.color * (sheen_lobe(sheen.roughness * sheen.roughness, v, l) / excess);
}

// What is left for the layers below (the extension's albedo scaling).
float sheen_base_share(Sheen sheen, float v_z, float l_z) {
    return 1.0 - max_component(sheen.color) * min(sheen_albedo(sheen, v_z, l_z), 1.0);
}

#endif
