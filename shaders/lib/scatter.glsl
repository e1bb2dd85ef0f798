// The next ray at a surface: mirror, GGX coat, smooth or rough transmission. In: Surface, the lobes allowed, random numbers in [0, 1).
// Out: Scatter: direction, weight (brdf x cosine / pdf, and / probability of the choice), density. Energy: reflected + transmitted <= 1.
#ifndef LIB_SCATTER
#define LIB_SCATTER

#include "lib/fresnel.glsl"
#include "lib/media.glsl"
#include "lib/refraction.glsl"
#include "lib/surface.glsl"

struct Scatter {
    bool valid;
    bool transmitted;
    vec3 direction;     // unit, render space
    vec3 weight;
    float pdf;          // solid angle; 0 for perfect mirrors and all transmission
};

// The two sides of the surface for refraction: eta = n(viewer's side) / n(other side).
struct Sides {
    float eta;
    bool thin;      // both interfaces of a sheet at once, or opaque
    bool nothing;   // no change of medium: passed unseen
};

// The surface bounds a volume that light enters.
bool surface_encloses(Surface surface) {
    bool enters = surface_transmits(surface) || (NEEDS_REFRACTION && surface.mode == MODE_PBR && surface.lobes.diffuse_transmission > 0.0);
    return enters && (surface.flags & MATERIAL_HAS_VOLUME) != 0u;
}

// What lies on both sides; the same medium for sheets and opaque surfaces.
Interface surface_interface(Scene scene, Surface surface, uint material, Media media) {
    if (surface_encloses(surface)) {
        return media_interface(scene, media, material, surface.front);
    }
    uint medium = NEEDS_REFRACTION ? media_current(scene, media) : MEDIUM_AIR;
    return Interface(medium, medium, media, false);
}

// channel: of a path that carries one colour only (lib/dispersion.glsl).
Sides interface_sides(Scene scene, Interface crossing, uint channel) {
    if (!crossing.bounds_volume) {
        return Sides(1.0, true, false);
    }
    float eta = medium_ior(scene, crossing.before, channel) / medium_ior(scene, crossing.after, channel);
    return Sides(eta, false, crossing.before == crossing.after);
}

const Scatter SCATTER_NOTHING = Scatter(false, false, vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0);

// A transmitted direction must leave on the far side of the triangle, whatever the shading normal says.
vec3 keep_below(vec3 direction, vec3 geometric_normal) {
    float above = max(dot(direction, geometric_normal), 0.0);
    return normalize_or(direction - 2.0 * above * geometric_normal, -geometric_normal);
}

Scatter scatter_pass_through(Surface surface) {
    return Scatter(true, true, -surface.view, vec3(1.0), 0.0);
}

Scatter scatter_mirror(Surface surface) {
    vec3 direction = reflect_travel(-surface.view, surface.shading_normal, surface.geometric_normal);
    return Scatter(true, false, direction, surface.base_color, 0.0);
}

// Chooses between reflection and transmission when both are allowed; `probability` is that of what was chosen.
bool choose_reflection(bool may_reflect, bool may_transmit, float reflected, float transmitted, float xi, out float probability) {
    if (may_reflect != may_transmit) {
        probability = 1.0;
        return may_reflect;
    }
    float sum = reflected + transmitted;
    float chance = sum > 0.0 ? reflected / sum : 1.0;
    bool reflects = xi < chance;
    probability = reflects ? chance : 1.0 - chance;
    return reflects;
}

// Smooth glass: exact Fresnel and Snell. Every crossing of the surface is tinted by the base colour.
Scatter scatter_glass(Surface surface, Sides sides, bool may_reflect, bool may_transmit, float choice_xi) {
    vec3 travel = -surface.view;
    float cos_i = clamp(dot(surface.view, surface.shading_normal), 0.0, 1.0);
    float cos_t = cos_i;
    float reflectance = sides.thin ? fresnel_thin_sheet(cos_i, surface.ior) : fresnel_dielectric(cos_i, sides.eta, cos_t);
    float probability;
    if (choose_reflection(may_reflect, may_transmit, reflectance, 1.0 - reflectance, choice_xi, probability)) {
        vec3 direction = reflect_travel(travel, surface.shading_normal, surface.geometric_normal);
        return Scatter(reflectance > 0.0, false, direction, vec3(reflectance / probability), 0.0);
    }
    vec3 direction = sides.thin ? travel : refract_travel(travel, surface.shading_normal, sides.eta, cos_i, cos_t);
    vec3 weight = surface.base_color * ((1.0 - reflectance) / probability);
    return Scatter(reflectance < 1.0, true, keep_below(direction, surface.geometric_normal), weight, 0.0);
}

// What a microfacet does with light.
struct CoatShares {
    vec3 reflected;
    float base;     // left for what lies below the coat
    float cos_t;    // of the refracted direction to the microfacet
};

// Inside a volume the Fresnel term is exact, as Schlick knows no total reflection.
CoatShares coat_shares(Brdf brdf, Sides sides, bool front, float v_dot_h) {
    CoatShares shares = CoatShares(brdf_reflectance(brdf, v_dot_h), brdf_base_share(brdf, v_dot_h), v_dot_h);
    if (!sides.thin) {
        float exact = fresnel_dielectric(v_dot_h, sides.eta, shares.cos_t);
        if (!front || exact >= 1.0) {
            shares.reflected = vec3(exact);
            shares.base = 1.0 - exact;
        }
    }
    return shares;
}

// Share that KHR_materials_transmission sends on through the coat.
vec3 coat_transmittance(Surface surface, CoatShares shares) {
    return surface.base_color * (shares.base * surface.transmission * (1.0 - surface.metallic));
}

// glTF material: the GGX coat, and through it KHR_materials_transmission, both about one visible normal. A thin sheet sends light on as if
// mirrored and turned over; a volume bends it.
Scatter scatter_pbr(Surface surface, Sides sides, bool may_reflect, bool may_transmit, float choice_xi, vec2 xi) {
    mat3 render_from_local = basis_around(surface.shading_normal);
    vec3 v = surface.view * render_from_local;
    if (v.z <= 0.0) {
        return SCATTER_NOTHING;
    }
    Brdf brdf = surface_brdf(surface);
    vec3 h = ggx_sample_half(v, brdf.alpha, xi);
    float v_dot_h = clamp(dot(v, h), 0.0, 1.0);
    CoatShares shares = coat_shares(brdf, sides, surface.front, v_dot_h);
    vec3 reflectance = shares.reflected;
    float cos_t = shares.cos_t;
    vec3 transmittance = coat_transmittance(surface, shares);
    float probability;
    bool reflects = choose_reflection(may_reflect, may_transmit, max_component(reflectance), max_component(transmittance), choice_xi,
        probability);
    vec3 l = 2.0 * v_dot_h * h - v;
    if (reflects) {
        vec3 direction = render_from_local * l;
        bool valid = l.z > 0.0;
        if (ggx_is_delta(brdf.alpha)) {
            direction = reflect_travel(-surface.view, surface.shading_normal, surface.geometric_normal);
        } else {
            valid = valid && dot(direction, surface.geometric_normal) > 0.0;
        }
        float weight = ggx_sample_weight(v.z, max(l.z, 0.0), brdf.alpha) / probability;
        return Scatter(valid, false, normalize_or(direction, surface.geometric_normal), reflectance * weight,
            ggx_pdf_reflected(v, h, brdf.alpha));
    }
    if (!sides.thin && sides.eta == 1.0) {
        // Nothing bends, so no microfacet stands in the way: as at a smooth surface (lib/bsdf.glsl).
        transmittance = coat_transmittance(surface, coat_shares(brdf, sides, surface.front, v.z));
        return Scatter(max_component(transmittance) > 0.0, true, -surface.view, transmittance / probability, 0.0);
    }
    l = sides.thin ? vec3(l.xy, -l.z) : refract_travel(-v, h, sides.eta, v_dot_h, cos_t);
    float weight = ggx_sample_weight(v.z, max(-l.z, 0.0), brdf.alpha) / probability;
    vec3 direction = keep_below(render_from_local * l, surface.geometric_normal);
    return Scatter(l.z < 0.0 && max_component(transmittance) > 0.0, true, direction, transmittance * weight, 0.0);
}

// xi.x: choice of the lobe; xi.yz: direction.
Scatter scatter_surface(Surface surface, Sides sides, bool may_reflect, bool may_transmit, vec3 xi) {
    if (sides.nothing) {
        return scatter_pass_through(surface);
    }
    switch (surface.mode) {
        case MODE_REFLECTIVE: return scatter_mirror(surface);
        case MODE_REFRACTIVE: return scatter_glass(surface, sides, may_reflect, may_transmit, xi.x);
        case MODE_PBR: return scatter_pbr(surface, sides, may_reflect, may_transmit, xi.x, xi.yz);
        default: return SCATTER_NOTHING;
    }
}

#endif
