// The GGX microfacet distribution (Walter et al. 2007; Trowbridge and Reitz 1975) with height-correlated Smith masking (Heitz 2014).
// Frame: z is the shading normal; v, l, h are unit vectors with v.z > 0 and l.z > 0. alpha = roughness^2. Measures: solid angle.
// No denominator is clamped: each is positive for the domain above.
#ifndef LIB_GGX
#define LIB_GGX

#include "lib/vector.glsl"

// A lobe narrower than the spacing of float directions is a mirror: its density is not evaluated, its half vector is the normal.
const float GGX_DELTA_ALPHA = 1e-7;

bool ggx_is_delta(float alpha) {
    return alpha < GGX_DELTA_ALPHA;
}

// Lambda's root: sqrt(alpha^2 + (1 - alpha^2) c^2).
float ggx_root(float alpha, float cosine) {
    float a2 = alpha * alpha;
    return sqrt(a2 * max((1.0 - cosine) * (1.0 + cosine), 0.0) + cosine * cosine);
}

// Density of microfacet normals, 1/sr. Uses sin^2 = x^2 + y^2, which keeps its digits where 1 - z^2 has none.
float ggx_distribution(vec3 h, float alpha) {
    float d = h.x * h.x + h.y * h.y + alpha * alpha * h.z * h.z;
    float t = alpha / d;
    return t * t / PI;
}

// G2 / (4 v.z l.z), times l.z: the factor beside D and F in brdf x cosine.
float ggx_visibility_cosine(float v_z, float l_z, float alpha) {
    return 0.5 * l_z / (l_z * ggx_root(alpha, v_z) + v_z * ggx_root(alpha, l_z));
}

// G2 / G1(v): the weight of a direction drawn from visible normals, beside F. 1 for a mirror, never above 1.
float ggx_sample_weight(float v_z, float l_z, float alpha) {
    float root_v = ggx_root(alpha, v_z);
    float denominator = l_z * root_v + v_z * ggx_root(alpha, l_z);
    return denominator > 0.0 ? l_z * (v_z + root_v) / denominator : 0.0;
}

// Half vector drawn from the normals visible from v: Heitz, JCGT 7(4), 2018, in the form of Dupuy and Benyoub, "Sampling Visible GGX
// Normals with Spherical Caps", HPG 2023. xi in [0, 1)^2. pdf: G1(v) D(h) max(dot(v, h), 0) / v.z, per solid angle of h.
vec3 ggx_sample_half(vec3 v, float alpha, vec2 xi) {
    if (ggx_is_delta(alpha)) {
        return vec3(0.0, 0.0, 1.0);
    }
    vec3 stretched = normalize(vec3(alpha * v.xy, v.z));
    float z = (1.0 - xi.y) * (1.0 + stretched.z) - stretched.z;
    float radius = sqrt(max((1.0 - z) * (1.0 + z), 0.0));
    float phi = TAU * xi.x;
    vec3 cap = vec3(radius * cos(phi), radius * sin(phi), z);
    vec3 h = cap + stretched; // h.z = (1 - xi.y) (1 + stretched.z) > 0
    return normalize_or(vec3(alpha * h.xy, h.z), vec3(0.0, 0.0, 1.0));
}

// Solid-angle density of the reflected direction whose half vector ggx_sample_half draws: G1(v) D(h) / (4 v.z). 0 for a mirror.
float ggx_pdf_reflected(vec3 v, vec3 h, float alpha) {
    if (ggx_is_delta(alpha)) {
        return 0.0;
    }
    return 0.5 * ggx_distribution(h, alpha) / (v.z + ggx_root(alpha, v.z));
}

#endif
