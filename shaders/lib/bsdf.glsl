// The whole scattering function of a glTF material, for the path tracer: Lambertian base, GGX coat, GGX transmission through a sheet or into a
// volume (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007). Frame: local, z is the shading normal, v.z > 0.
// Out: values with the cosine in them, densities per solid angle of the mixture that bsdf_sample draws from. A coat that is a mirror is left out
// of both: bsdf_sample follows it with density 0. Radiance is not scaled by the squared index of the medium: what enters glass leaves it again.
#ifndef LIB_BSDF
#define LIB_BSDF

#include "lib/scatter.glsl"

struct Bsdf {
    Brdf brdf;
    Sides sides;
    vec3 diffuse;           // albedo below the coat
    vec3 transmitted;       // likewise of what passes
    bool front;
    bool sharp_reflection;  // a mirror, or rays that pass straight or bend as one
    bool sharp_transmission;
    float chance_reflect;   // of bsdf_sample to choose each lobe; the rest is diffuse
    float chance_transmit;
};

struct BsdfValue {
    vec3 value;
    float pdf;
};

const BsdfValue BSDF_NOTHING = BsdfValue(vec3(0.0), 0.0);

// Share of its largest value by which a coat that looks black head-on is drawn all the same: it may not be black elsewhere.
const float LEAST_COAT = 0.05;

Bsdf bsdf_begin(Surface surface, Sides sides, float v_z) {
    Bsdf bsdf;
    bsdf.brdf = surface_brdf(surface);
    bsdf.sides = sides;
    bsdf.diffuse = surface_diffuse_albedo(surface);
    bsdf.transmitted = surface_transmits(surface) ? surface.base_color * ((1.0 - surface.metallic) * surface.transmission) : vec3(0.0);
    bsdf.front = surface.front;
    bsdf.sharp_reflection = ggx_is_delta(bsdf.brdf.alpha);
    bsdf.sharp_transmission = bsdf.sharp_reflection || (!sides.thin && sides.eta == 1.0);
    CoatShares shares = coat_shares(bsdf.brdf, sides, surface.front, v_z);
    float reflect = max(max_component(shares.reflected), LEAST_COAT * max_component(bsdf.brdf.f90));
    float transmit = max_component(bsdf.transmitted) * shares.base;
    float diffuse = max_component(bsdf.diffuse) * shares.base;
    float sum = reflect + transmit + diffuse;
    bsdf.chance_reflect = sum > 0.0 ? reflect / sum : 0.0;
    bsdf.chance_transmit = sum > 0.0 ? transmit / sum : 0.0;
    return bsdf;
}

float bsdf_chance_diffuse(Bsdf bsdf) {
    return max_component(bsdf.diffuse) > 0.0 ? max(1.0 - bsdf.chance_reflect - bsdf.chance_transmit, 0.0) : 0.0;
}

// Whether light from chosen directions can be reflected at all: not by mirrors and clear glass alone.
bool bsdf_spreads(Bsdf bsdf) {
    bool transmits = max_component(bsdf.transmitted) > 0.0;
    return max_component(bsdf.diffuse) > 0.0 || !bsdf.sharp_reflection || (transmits && !bsdf.sharp_transmission);
}

// l on the viewer's side, h the half vector.
BsdfValue bsdf_reflected(Bsdf bsdf, vec3 v, vec3 l, vec3 h) {
    CoatShares shares = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, clamp(dot(v, h), 0.0, 1.0));
    BsdfValue result;
    result.value = bsdf.diffuse * (shares.base * l.z / PI);
    result.pdf = bsdf_chance_diffuse(bsdf) * cosine_pdf(l.z);
    if (!bsdf.sharp_reflection) {
        float alpha = bsdf.brdf.alpha;
        result.value += shares.reflected * (ggx_distribution(h, alpha) * ggx_visibility_cosine(v.z, l.z, alpha));
        result.pdf += bsdf.chance_reflect * ggx_pdf_reflected(v, h, alpha);
    }
    return result;
}

// l on the other side, h the microfacet normal that sends v there; h.z > 0.
BsdfValue bsdf_transmitted(Bsdf bsdf, vec3 v, vec3 l, vec3 h) {
    float v_dot_h = clamp(dot(v, h), 0.0, 1.0);
    float alpha = bsdf.brdf.alpha;
    CoatShares shares = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, v_dot_h);
    if (shares.cos_t <= 0.0) {
        return BSDF_NOTHING; // total reflection
    }
    float pdf = ggx_pdf_reflected(v, h, alpha);
    if (!bsdf.sides.thin) {
        float l_dot_h = dot(l, h);
        float denominator = bsdf.sides.eta * v_dot_h + l_dot_h;
        // From the density of h to that of l: Walter et al., equation 17, with eta = n(v) / n(l).
        pdf *= l_dot_h < 0.0 ? 4.0 * v_dot_h * -l_dot_h / (denominator * denominator) : 0.0;
    }
    float weight = shares.base * ggx_sample_weight(v.z, -l.z, alpha);
    return BsdfValue(bsdf.transmitted * (weight * pdf), bsdf.chance_transmit * pdf);
}

// The microfacet normal, towards v, that refracts v to l.
vec3 half_refracted(vec3 v, vec3 l, float eta) {
    vec3 h = normalize_or(eta * v + l, vec3(0.0, 0.0, 1.0));
    return h.z < 0.0 ? -h : h;
}

// Value x cosine for light from l, and the density with which bsdf_sample would have drawn it.
BsdfValue bsdf_evaluate(Bsdf bsdf, vec3 v, vec3 l) {
    if (v.z <= 0.0 || l.z == 0.0) {
        return BSDF_NOTHING;
    }
    if (l.z > 0.0) {
        return bsdf_reflected(bsdf, v, l, normalize_or(v + l, vec3(0.0, 0.0, 1.0)));
    }
    if (bsdf.sharp_transmission || !(max_component(bsdf.transmitted) > 0.0)) {
        return BSDF_NOTHING;
    }
    vec3 h = bsdf.sides.thin ? normalize_or(v + vec3(l.xy, -l.z), vec3(0.0, 0.0, 1.0)) : half_refracted(v, l, bsdf.sides.eta);
    return dot(v, h) > 0.0 ? bsdf_transmitted(bsdf, v, l, h) : BSDF_NOTHING;
}

// The same for a direction in render space: light that arrives from beyond the triangle passes, other light is reflected.
BsdfValue bsdf_evaluate_render(Bsdf bsdf, Surface surface, mat3 render_from_local, vec3 direction) {
    vec3 l = direction * render_from_local;
    if (l.z * dot(direction, surface.geometric_normal) <= 0.0) {
        return BSDF_NOTHING;
    }
    return bsdf_evaluate(bsdf, surface.view * render_from_local, l);
}

Scatter scatter_of(BsdfValue drawn, vec3 direction, bool transmitted, vec3 geometric_normal) {
    float side = transmitted ? -1.0 : 1.0;
    bool valid = drawn.pdf > 0.0 && side * dot(direction, geometric_normal) > 0.0;
    return Scatter(valid, transmitted, direction, valid ? drawn.value / drawn.pdf : vec3(0.0), drawn.pdf);
}

// The mirror or the clear glass in a coat: shares about the shading normal.
Scatter bsdf_sample_sharp(Bsdf bsdf, Surface surface, float v_z, bool transmitted) {
    CoatShares shares = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, v_z);
    vec3 travel = -surface.view;
    if (!transmitted) {
        vec3 direction = reflect_travel(travel, surface.shading_normal, surface.geometric_normal);
        return Scatter(true, false, direction, shares.reflected / bsdf.chance_reflect, 0.0);
    }
    vec3 direction = bsdf.sides.thin ? travel : refract_travel(travel, surface.shading_normal, bsdf.sides.eta, v_z, shares.cos_t);
    vec3 weight = bsdf.transmitted * (shares.base / bsdf.chance_transmit);
    return Scatter(shares.base > 0.0, true, keep_below(direction, surface.geometric_normal), weight, 0.0);
}

// Draws a lobe (xi.x) by what it is about to send on, then a direction of it (xi.yz).
Scatter bsdf_sample(Bsdf bsdf, Surface surface, mat3 render_from_local, vec3 xi) {
    vec3 v = surface.view * render_from_local;
    bool reflects = xi.x < bsdf.chance_reflect;
    bool transmits = !reflects && xi.x < bsdf.chance_reflect + bsdf.chance_transmit;
    if (v.z <= 0.0 || (!reflects && !transmits && bsdf_chance_diffuse(bsdf) == 0.0)) {
        return SCATTER_NOTHING;
    }
    if ((reflects && bsdf.sharp_reflection) || (transmits && bsdf.sharp_transmission)) {
        return bsdf_sample_sharp(bsdf, surface, v.z, transmits);
    }
    if (!reflects && !transmits) {
        vec3 l = cosine_sample(xi.yz);
        vec3 h = normalize_or(v + l, vec3(0.0, 0.0, 1.0));
        BsdfValue drawn = l.z > 0.0 ? bsdf_reflected(bsdf, v, l, h) : BSDF_NOTHING;
        return scatter_of(drawn, render_from_local * l, false, surface.geometric_normal);
    }
    vec3 h = ggx_sample_half(v, bsdf.brdf.alpha, xi.yz);
    float v_dot_h = clamp(dot(v, h), 0.0, 1.0);
    vec3 l = 2.0 * v_dot_h * h - v;
    if (reflects) {
        BsdfValue drawn = l.z > 0.0 ? bsdf_reflected(bsdf, v, l, h) : BSDF_NOTHING;
        return scatter_of(drawn, normalize_or(render_from_local * l, surface.geometric_normal), false, surface.geometric_normal);
    }
    float cos_t = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, v_dot_h).cos_t;
    l = bsdf.sides.thin ? vec3(l.xy, -l.z) : refract_travel(-v, h, bsdf.sides.eta, v_dot_h, cos_t);
    BsdfValue drawn = l.z < 0.0 ? bsdf_transmitted(bsdf, v, l, h) : BSDF_NOTHING;
    return scatter_of(drawn, normalize_or(render_from_local * l, -surface.geometric_normal), true, surface.geometric_normal);
}

#endif
