// The material model of glTF 2.0, appendix B, with KHR_materials_specular, KHR_materials_ior and KHR_materials_iridescence: a diffuse base
// under a GGX coat, which a thin film may colour.
// Frame: local, z is the shading normal. In: a Brdf and unit directions. Out: brdf x cosine (no epsilon in it) and densities per solid angle.
// The diffuse part is given without base colour x (1 - metallic) x (1 - transmission): the caller multiplies, so filters see light only.
#ifndef LIB_BRDF
#define LIB_BRDF

#include "shared/needs.glsl"
#include "lib/fresnel.glsl"
#include "lib/ggx.glsl"
#include "lib/thin_film.glsl"

// A film over the base (KHR_materials_iridescence).
struct Film {
    float strength;         // 0: none
    float ior;
    float thickness_nm;
    vec3 dielectric_f0;     // of the base in air, with its strength
    vec3 metal_f0;
    float metallic;
};

struct Brdf {
    vec3 f0;
    vec3 f90;
    float dielectric_f0;    // largest channel; what the coat takes from the diffuse base
    float dielectric_f90;
    float alpha;
    Film film;
};

struct BrdfValue {
    float diffuse;
    vec3 specular;
};

Brdf brdf_from_material(vec3 base_color, float metallic, float roughness, float ior, float specular, vec3 specular_color) {
    vec3 dielectric = min(f0_from_ior(ior) * specular_color, vec3(1.0)) * specular;
    Brdf brdf;
    brdf.f0 = mix(dielectric, clamp(base_color, 0.0, 1.0), metallic);
    brdf.f90 = vec3(mix(specular, 1.0, metallic));
    brdf.dielectric_f0 = max_component(dielectric);
    brdf.dielectric_f90 = specular;
    brdf.alpha = roughness * roughness;
    brdf.film = Film(0.0, 1.0, 0.0, dielectric, clamp(base_color, 0.0, 1.0), metallic);
    return brdf;
}

bool has_film(Brdf brdf) {
    return NEEDS_LOBES && brdf.film.strength > 0.0;
}

// Reflectance of the dielectric part with its film.
vec3 film_dielectric(Brdf brdf, float v_dot_h) {
    Film film = brdf.film;
    vec3 bare = fresnel_schlick(film.dielectric_f0, vec3(brdf.dielectric_f90), v_dot_h);
    return mix(bare, fresnel_thin_film(1.0, film.ior, film.dielectric_f0, film.thickness_nm, v_dot_h), film.strength);
}

// Share of the light that a microfacet reflects.
vec3 brdf_reflectance(Brdf brdf, float v_dot_h) {
    if (!has_film(brdf)) {
        return fresnel_schlick(brdf.f0, brdf.f90, v_dot_h);
    }
    Film film = brdf.film;
    vec3 metal = mix(fresnel_schlick(film.metal_f0, vec3(1.0), v_dot_h),
        fresnel_thin_film(1.0, film.ior, film.metal_f0, film.thickness_nm, v_dot_h), film.strength);
    return mix(film_dielectric(brdf, v_dot_h), metal, film.metallic);
}

// What the coat lets through to the base: 1 - max(F) (glTF 2.0 appendix B.3.4; KHR_materials_specular, KHR_materials_iridescence).
float brdf_base_share(Brdf brdf, float v_dot_h) {
    if (has_film(brdf)) {
        return 1.0 - max_component(film_dielectric(brdf, v_dot_h));
    }
    return 1.0 - fresnel_schlick(vec3(brdf.dielectric_f0), vec3(brdf.dielectric_f90), v_dot_h).x;
}

BrdfValue brdf_evaluate(Brdf brdf, vec3 v, vec3 l) {
    BrdfValue value = BrdfValue(0.0, vec3(0.0));
    if (v.z <= 0.0 || l.z <= 0.0) {
        return value;
    }
    vec3 h = normalize_or(v + l, vec3(0.0, 0.0, 1.0));
    float v_dot_h = max(dot(v, h), 0.0);
    value.diffuse = brdf_base_share(brdf, v_dot_h) * l.z / PI;
    if (!ggx_is_delta(brdf.alpha)) {
        value.specular = brdf_reflectance(brdf, v_dot_h)
            * (ggx_distribution(h, brdf.alpha) * ggx_visibility_cosine(v.z, l.z, brdf.alpha));
    }
    return value;
}

// Specular lobe: l, and F G2 / G1 as its weight (brdf x cosine / pdf). False where l falls below the surface.
bool brdf_sample_specular(Brdf brdf, vec3 v, vec2 xi, out vec3 l, out vec3 weight) {
    vec3 h = ggx_sample_half(v, brdf.alpha, xi);
    float v_dot_h = dot(v, h);
    l = 2.0 * v_dot_h * h - v;
    if (l.z <= 0.0 || v_dot_h <= 0.0) {
        weight = vec3(0.0);
        return false;
    }
    weight = brdf_reflectance(brdf, v_dot_h) * ggx_sample_weight(v.z, l.z, brdf.alpha);
    return true;
}

float brdf_pdf_specular(Brdf brdf, vec3 v, vec3 l) {
    return ggx_pdf_reflected(v, normalize_or(v + l, vec3(0.0, 0.0, 1.0)), brdf.alpha);
}

// Uniform disc to disc without tearing strata: Shirley and Chiu, JGT 2(3), 1997. xi in [0, 1)^2; radius below or at 1.
vec2 concentric_disc(vec2 xi) {
    vec2 p = 2.0 * xi - 1.0;
    if (p.x == 0.0 && p.y == 0.0) {
        return vec2(0.0);
    }
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    float phi = wide ? (PI / 4.0) * (p.y / p.x) : PI / 2.0 - (PI / 4.0) * (p.x / p.y);
    return radius * vec2(cos(phi), sin(phi));
}

// Malley's method: pdf l.z / pi.
vec3 cosine_sample(vec2 xi) {
    vec2 p = concentric_disc(xi);
    return vec3(p, sqrt(max(1.0 - dot(p, p), 0.0)));
}

float cosine_pdf(float l_z) {
    return max(l_z, 0.0) / PI;
}

// About how much the specular coat reflects seen from v: divides direct specular light before filtering, multiplies it after, so its
// exact value does not matter. Only 0 where f0 = f90 = 0, and there the coat reflects nothing.
vec3 brdf_specular_albedo(Brdf brdf, float v_z) {
    float m = clamp(1.0 - v_z, 0.0, 1.0);
    float m2 = m * m;
    float smoothness = 1.0 - sqrt(brdf.alpha);
    return mix(brdf.f0, brdf.f90, max(smoothness * m2 * m2 * m, 1.0 / 64.0));
}

// Quotient that is 0 where the divisor is: the light there is 0 too.
vec3 demodulate(vec3 light, vec3 albedo) {
    return mix(vec3(0.0), light / albedo, greaterThan(albedo, vec3(0.0)));
}

#endif
