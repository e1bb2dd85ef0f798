// The clear layer of KHR_materials_clearcoat: a GGX coat of index 1.5 over everything, emission included, with a normal of its own.
// Frame: that of the base; the coat's normal is given in it. Measures: solid angle. The Fresnel term is that of the view and the coat's
// normal, as the extension says, so that coat and base are weighted by one number and conserve energy; they are not reciprocal.
#ifndef LIB_CLEARCOAT
#define LIB_CLEARCOAT

#include "lib/basis.glsl"
#include "lib/fresnel.glsl"
#include "lib/ggx.glsl"

const float CLEARCOAT_F0 = 0.04;

struct Clearcoat {
    float factor;   // strength, 0..1
    float alpha;    // roughness^2
    vec3 normal;    // unit
};

// Share of the light that the coat answers for; the base gets 1 less it.
float clearcoat_weight(Clearcoat coat, vec3 v) {
    return coat.factor * fresnel_schlick(vec3(CLEARCOAT_F0), vec3(1.0), abs(dot(v, coat.normal))).x;
}

// D G / (4 v.n l.n) times l.n about the coat's normal, without the weight. 0 where a direction is behind that normal, and for a mirror.
float clearcoat_evaluate(Clearcoat coat, vec3 v, vec3 l) {
    float v_n = dot(v, coat.normal);
    float l_n = dot(l, coat.normal);
    if (v_n <= 0.0 || l_n <= 0.0 || ggx_is_delta(coat.alpha)) {
        return 0.0;
    }
    vec3 h = normalize_or(v + l, coat.normal) * basis_around(coat.normal);
    return ggx_distribution(h, coat.alpha) * ggx_visibility_cosine(v_n, l_n, coat.alpha);
}

// l, and its weight (brdf x cosine / pdf, without clearcoat_weight). False where l falls behind the coat's normal.
bool clearcoat_sample(Clearcoat coat, vec3 v, vec2 xi, out vec3 l, out float weight) {
    mat3 frame = basis_around(coat.normal);
    vec3 local_v = v * frame;
    weight = 0.0;
    l = vec3(0.0, 0.0, 1.0);
    if (local_v.z <= 0.0) {
        return false;
    }
    vec3 h = ggx_sample_half(local_v, coat.alpha, xi);
    vec3 local_l = 2.0 * dot(local_v, h) * h - local_v;
    if (local_l.z <= 0.0) {
        return false;
    }
    l = frame * local_l;
    weight = ggx_sample_weight(local_v.z, local_l.z, coat.alpha);
    return true;
}

// Density of clearcoat_sample; 0 for a mirror.
float clearcoat_pdf(Clearcoat coat, vec3 v, vec3 l) {
    mat3 frame = basis_around(coat.normal);
    vec3 local_v = v * frame;
    if (local_v.z <= 0.0 || dot(l, coat.normal) <= 0.0) {
        return 0.0;
    }
    return ggx_pdf_reflected(local_v, normalize_or(v + l, coat.normal) * frame, coat.alpha);
}

#endif
