// GGX whose roughness differs along two axes (Heitz 2014, sections 5.3 and 5.4; Burley 2012): KHR_materials_anisotropy.
// Frame: z is the shading normal, x the direction of the larger roughness; v, l, h unit, v.z > 0, l.z > 0. Measures: solid angle.
// With equal alphas it is lib/ggx.glsl. The extension's sample clamps the visibility term to 1; here nothing is clamped.
#ifndef LIB_ANISOTROPIC_GGX
#define LIB_ANISOTROPIC_GGX

#include "lib/vector.glsl"

// A lobe stretched along x must keep a width along y that float directions resolve.
const float ANISOTROPIC_ALPHA_MIN = 1e-4;

// Alphas along x and y: strength^2 leads the first one from the material's alpha to 1.
vec2 anisotropic_alpha(float alpha, float strength) {
    return max(vec2(mix(alpha, 1.0, strength * strength), alpha), vec2(ANISOTROPIC_ALPHA_MIN));
}

// sqrt(alpha_x^2 w_x^2 + alpha_y^2 w_y^2 + w_z^2): (1 + 2 Lambda) w_z.
float anisotropic_root(vec2 alpha, vec3 w) {
    return length(vec3(alpha * w.xy, w.z));
}

// Density of microfacet normals, 1/sr.
float anisotropic_distribution(vec3 h, vec2 alpha) {
    vec2 slope = h.xy / alpha;
    float d = dot(slope, slope) + h.z * h.z;
    return 1.0 / (PI * alpha.x * alpha.y * d * d);
}

// G2 / (4 v.z l.z), times l.z.
float anisotropic_visibility_cosine(vec3 v, vec3 l, vec2 alpha) {
    return 0.5 * l.z / (l.z * anisotropic_root(alpha, v) + v.z * anisotropic_root(alpha, l));
}

// G2 / G1(v): the weight of a direction drawn from visible normals, beside F.
float anisotropic_sample_weight(vec3 v, vec3 l, vec2 alpha) {
    float root_v = anisotropic_root(alpha, v);
    float denominator = l.z * root_v + v.z * anisotropic_root(alpha, l);
    return denominator > 0.0 ? l.z * (v.z + root_v) / denominator : 0.0;
}

// Half vector drawn from the normals visible from v (Dupuy and Benyoub, HPG 2023). xi in [0, 1)^2.
// pdf: G1(v) D(h) max(dot(v, h), 0) / v.z, per solid angle of h.
vec3 anisotropic_sample_half(vec3 v, vec2 alpha, vec2 xi) {
    vec3 stretched = normalize(vec3(alpha * v.xy, v.z));
    float z = (1.0 - xi.y) * (1.0 + stretched.z) - stretched.z;
    float radius = sqrt(max((1.0 - z) * (1.0 + z), 0.0));
    float phi = TAU * xi.x;
    vec3 h = vec3(radius * cos(phi), radius * sin(phi), z) + stretched;
    return normalize_or(vec3(alpha * h.xy, h.z), vec3(0.0, 0.0, 1.0));
}

// Solid-angle density of the reflected direction whose half vector anisotropic_sample_half draws.
float anisotropic_pdf_reflected(vec3 v, vec3 h, vec2 alpha) {
    return 0.5 * anisotropic_distribution(h, alpha) / (v.z + anisotropic_root(alpha, v));
}

#endif
