// Share of light that a white GGX interface reflects at once, and what is made of the rest. In: the table of renderer/src/tables/ggx_albedo.rs.
// Out: factors per roughness and cosine. Light that is reflected more than once leaves in proportion to what is reflected once
// (Turquin, "Practical Multiple Scattering Compensation for Microfacet Models", 2019): a white metal reflects everything.
#ifndef LIB_GGX_ALBEDO
#define LIB_GGX_ALBEDO

#include "shared/scene.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer GgxAlbedoTable { float at[]; };

// Bilinear in (square root of the cosine, roughness).
float ggx_albedo(uint64_t address, float cosine, float roughness) {
    float last = float(GGX_ALBEDO_SIDE - 1u);
    vec2 at = vec2(sqrt(clamp(cosine, 0.0, 1.0)), clamp(roughness, 0.0, 1.0)) * last;
    uvec2 cell = min(uvec2(at), uvec2(GGX_ALBEDO_SIDE - 2u));
    vec2 within = at - vec2(cell);
    GgxAlbedoTable table = GgxAlbedoTable(address);
    uint first = cell.y * GGX_ALBEDO_SIDE + cell.x;
    float low = mix(table.at[first], table.at[first + 1u], within.x);
    float high = mix(table.at[first + GGX_ALBEDO_SIDE], table.at[first + GGX_ALBEDO_SIDE + 1u], within.x);
    return mix(low, high, within.y);
}

// What is added to the interface's reflection, as a share of it; alpha = roughness^2.
vec3 ggx_compensation(uint64_t address, vec3 f0, float cosine, float alpha) {
    return f0 * (1.0 / ggx_albedo(address, cosine, sqrt(alpha)) - 1.0);
}

#endif
