// Fresnel reflectance. In: cosines and indices of refraction. Out: the share of light that is reflected, 0..1.
// The side is chosen by the caller, once: `eta` is always n(incident side) / n(other side).
#ifndef LIB_FRESNEL
#define LIB_FRESNEL

// Schlick 1994 as in glTF 2.0 appendix B.
vec3 fresnel_schlick(vec3 f0, vec3 f90, float cosine) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (f90 - f0) * (m2 * m2 * m);
}

float f0_from_ior(float ior) {
    float r = (ior - 1.0) / (ior + 1.0);
    return r * r;
}

// Exact, unpolarised, smooth dielectric. cos_i >= 0. Returns the reflectance; cos_t is 0 on total internal reflection, where it is 1.
float fresnel_dielectric(float cos_i, float eta, out float cos_t) {
    if (eta == 1.0) { // no interface
        cos_t = cos_i;
        return 0.0;
    }
    float sin2_t = eta * eta * max((1.0 - cos_i) * (1.0 + cos_i), 0.0);
    if (!(sin2_t < 1.0) || cos_i <= 0.0) { // total; also grazing, and an infinite index (KHR_materials_ior: ior = 0)
        cos_t = 0.0;
        return 1.0;
    }
    cos_t = sqrt(1.0 - sin2_t);
    float parallel = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    float perpendicular = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

// A sheet whose two interfaces are one surface in the scene: r + t r t + t r r r t + ... without absorption.
float fresnel_thin_sheet(float cos_i, float ior) {
    float cos_t;
    float r = fresnel_dielectric(cos_i, 1.0 / ior, cos_t);
    return 2.0 * r / (1.0 + r);
}

#endif
