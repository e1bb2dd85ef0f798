// Reflectance of a base under a thin film (KHR_materials_iridescence): Belcour and Barla, "A Practical Extension to Microfacet Theory for the
// Modeling of Varying Iridescence", 2017, in the form of the extension's appendix (Schlick's Fresnel terms, no polarisation, two orders).
// In: indices of refraction, F0 of the base in air, thickness, cosine at the microfacet. Out: reflectance in linear Rec.709, 0..1: the
// extension cuts it at 0 alone; colours out of gamut are cut at 1 too, so that nothing reflects more than arrives.
#ifndef LIB_THIN_FILM
#define LIB_THIN_FILM

#include "lib/fresnel.glsl"
#include "lib/vector.glsl"

// Rec.709 from the sensitivities of CIE XYZ to a path difference, in Fourier space (section 4 of the article). shift: phase, radians.
vec3 thin_film_sensitivity(float path_nm, vec3 shift) {
    const vec3 AMPLITUDE = vec3(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const vec3 POSITION = vec3(1.6810e+06, 1.7953e+06, 2.2084e+06);
    const vec3 VARIANCE = vec3(4.3278e+09, 9.3046e+09, 6.6121e+09);
    // X has a second peak.
    const float AMPLITUDE_2 = 9.7470e-14;
    const float POSITION_2 = 2.2399e+06;
    const float VARIANCE_2 = 4.5282e+09;
    const float NORM = 1.0685e-7;
    const mat3 REC709_FROM_XYZ = mat3(
        3.2404542, -0.9692660, 0.0556434,
        -1.5371385, 1.8760108, -0.2040259,
        -0.4985314, 0.0415560, 1.0572252);
    float phase = TAU * path_nm * 1e-9;
    vec3 xyz = AMPLITUDE * sqrt(TAU * VARIANCE) * cos(POSITION * phase + shift) * exp(-(phase * phase) * VARIANCE);
    xyz.x += AMPLITUDE_2 * sqrt(TAU * VARIANCE_2) * cos(POSITION_2 * phase + shift.x) * exp(-VARIANCE_2 * (phase * phase));
    return REC709_FROM_XYZ * (xyz / NORM);
}

float interface_f0(float inner, float outer) {
    float r = (inner - outer) / (inner + outer);
    return r * r;
}

vec3 fresnel_thin_film(float outside_ior, float film_ior, vec3 base_f0, float thickness_nm, float cosine) {
    float ratio = outside_ior / film_ior;
    float cos2_film = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    if (cos2_film < 0.0) {
        return vec3(1.0); // total reflection at the film
    }
    float cos_film = sqrt(cos2_film);
    float r12 = fresnel_schlick(vec3(interface_f0(film_ior, outside_ior)), vec3(1.0), cosine).x;
    float t121 = 1.0 - r12;
    vec3 root = sqrt(clamp(base_f0 + 1e-4, 0.0, 0.9999)); // an F0 of 1 would be an infinite index
    vec3 base_ior = (1.0 + root) / (1.0 - root);
    vec3 r1 = vec3(interface_f0(base_ior.x, film_ior), interface_f0(base_ior.y, film_ior), interface_f0(base_ior.z, film_ior));
    vec3 r23 = fresnel_schlick(r1, vec3(1.0), cos_film);
    // A reflection at the denser side turns the phase by pi.
    float phi21 = film_ior < outside_ior ? 0.0 : PI;
    vec3 shift = phi21 + mix(vec3(0.0), vec3(PI), lessThan(base_ior, vec3(film_ior)));
    float path_nm = 2.0 * film_ior * thickness_nm * cos_film;
    vec3 r123 = clamp(r12 * r23, 1e-5, 0.9999);
    vec3 amplitude = t121 * t121 * r23 / (1.0 - r123);
    vec3 sum = r12 + amplitude;
    vec3 order_amplitude = amplitude - t121;
    for (int order = 1; order <= 2; ++order) {
        order_amplitude *= sqrt(r123);
        sum += order_amplitude * 2.0 * thin_film_sensitivity(float(order) * path_nm, float(order) * shift);
    }
    return clamp(sum, 0.0, 1.0);
}

#endif
