// The whole scattering function of a glTF material, for the path tracer: Lambertian base that reflects and transmits, GGX interface
// (anisotropic, under a film), GGX transmission through a sheet or into a volume (Walter et al., "Microfacet Models for Refraction through Rough
// Surfaces", EGSR 2007), sheen and clear coat over all that (lib/layers.glsl). Frame: that of surface_frame, z is the shading normal, v.z > 0.
// Out: values with the cosine in them, densities per solid angle of the mixture that bsdf_sample draws from. A coat that is a mirror is left out
// of both: bsdf_sample follows it with density 0. Radiance is not scaled by the squared index of the medium: what enters glass leaves it again.
#ifndef LIB_BSDF
#define LIB_BSDF

#include "lib/anisotropic_ggx.glsl"
#include "lib/layers.glsl"
#include "lib/scatter.glsl"

struct Bsdf {
    Brdf brdf;
    bool anisotropic;
    vec2 alpha;             // along x and y of the frame, where anisotropic
    Sides sides;
    vec3 diffuse;           // albedo below the coat
    vec3 transmitted;       // likewise of what passes
    vec3 beyond;            // likewise of what passes scattered
    Layers layers;
    vec3 compensation;      // share that light reflected more than once adds to the interface (lib/ggx_albedo.glsl); 0: glTF to the letter
    bool front;
    bool inside;            // of a volume: nothing lies over the base, which shares the surface with the interface instead
    float interface_share;  // of the surface: from inside as much as lets light pass, else all
    bool sharp_reflection;  // a mirror, or rays that pass straight or bend as one
    bool sharp_transmission;
    float chance_reflect;   // of bsdf_sample to choose each lobe; the rest is diffuse
    float chance_transmit;
    float chance_coat;
    float chance_beyond;
};

struct BsdfValue {
    vec3 value;
    float pdf;
};

const BsdfValue BSDF_NOTHING = BsdfValue(vec3(0.0), 0.0);

// Share of its largest value by which a coat that looks black head-on is drawn all the same: it may not be black elsewhere.
const float LEAST_COAT = 0.05;

// Share that a rough interface passes, to be drawn by: beyond the angle of total reflection some of its microfacets still let light through.
float expected_passage(Bsdf bsdf, CoatShares shares) {
    return bsdf.sharp_transmission ? shares.base : max(shares.base, clamp(2.0 * bsdf.brdf.alpha, 0.05, 0.5));
}

// Interface between the layers and the base: isotropic unless the material says otherwise.
float interface_pdf(Bsdf bsdf, vec3 v, vec3 h) {
    return bsdf.anisotropic ? anisotropic_pdf_reflected(v, h, bsdf.alpha) : ggx_pdf_reflected(v, h, bsdf.brdf.alpha);
}

// D G2 / (4 v.z l.z), times l.z.
float interface_value(Bsdf bsdf, vec3 v, vec3 l, vec3 h) {
    float alpha = bsdf.brdf.alpha;
    return bsdf.anisotropic ? anisotropic_distribution(h, bsdf.alpha) * anisotropic_visibility_cosine(v, l, bsdf.alpha)
        : ggx_distribution(h, alpha) * ggx_visibility_cosine(v.z, l.z, alpha);
}

// G2 / G1(v); l.z > 0.
float interface_weight(Bsdf bsdf, vec3 v, vec3 l) {
    return bsdf.anisotropic ? anisotropic_sample_weight(v, l, bsdf.alpha) : ggx_sample_weight(v.z, l.z, bsdf.brdf.alpha);
}

vec3 interface_half(Bsdf bsdf, vec3 v, vec2 xi) {
    return bsdf.anisotropic ? anisotropic_sample_half(v, bsdf.alpha, xi) : ggx_sample_half(v, bsdf.brdf.alpha, xi);
}

// Share of light that reaches the base.
float base_share(Bsdf bsdf, CoatShares shares) {
    return bsdf.inside ? 1.0 : shares.base;
}

// Chances of the lobes by what they are about to send on.
void bsdf_set_chances(inout Bsdf bsdf, float v_z) {
    CoatShares shares = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, v_z);
    float below = layers_base_share(bsdf.layers, v_z, v_z);
    float reflect = below * bsdf.interface_share * max(max_component(shares.reflected), LEAST_COAT * max_component(bsdf.brdf.f90));
    float transmit = below * max_component(bsdf.transmitted) * expected_passage(bsdf, shares);
    float diffuse = below * max_component(bsdf.diffuse) * base_share(bsdf, shares) + layers_sheen_share(bsdf.layers, v_z);
    float beyond = below * max_component(bsdf.beyond) * base_share(bsdf, shares);
    float coat = bsdf.layers.coat_weight;
    float sum = reflect + transmit + diffuse + beyond + coat;
    float scale = sum > 0.0 ? 1.0 / sum : 0.0;
    bsdf.chance_reflect = scale * reflect;
    bsdf.chance_transmit = scale * transmit;
    bsdf.chance_beyond = scale * beyond;
    bsdf.chance_coat = scale * coat;
}

// v: towards the viewer, in the frame of surface_frame.
Bsdf bsdf_begin(Surface surface, Sides sides, mat3 render_from_local, vec3 v) {
    Bsdf bsdf;
    bsdf.brdf = surface_brdf(surface);
    bsdf.anisotropic = has_lobe(surface.lobes, LOBE_ANISOTROPY) && surface.lobes.anisotropy > 0.0;
    bsdf.alpha = anisotropic_alpha(bsdf.brdf.alpha, surface.lobes.anisotropy);
    bsdf.sides = sides;
    bsdf.inside = !sides.thin && !surface.front;
    bsdf.interface_share = bsdf.inside ? (1.0 - surface.metallic) * surface.transmission : 1.0;
    bsdf.layers = layers_begin(bsdf.inside ? LOBES_NONE : surface.lobes, render_from_local, v);
    float through = has_lobe(surface.lobes, LOBE_DIFFUSE_TRANSMISSION) ? surface.lobes.diffuse_transmission : 0.0;
    bsdf.diffuse = surface_diffuse_albedo(surface) * (1.0 - through);
    bsdf.beyond = surface.lobes.diffuse_transmission_color * ((1.0 - surface.metallic) * (1.0 - surface.transmission) * through);
    bsdf.transmitted = surface_transmits(surface) ? surface.base_color * ((1.0 - surface.metallic) * surface.transmission) : vec3(0.0);
    bsdf.compensation = vec3(0.0);
    bsdf.front = surface.front;
    bsdf.sharp_reflection = !bsdf.anisotropic && ggx_is_delta(bsdf.brdf.alpha);
    bsdf.sharp_transmission = bsdf.sharp_reflection || (!sides.thin && sides.eta == 1.0);
    bsdf_set_chances(bsdf, v.z);
    return bsdf;
}

// Whether the coat is a mirror.
bool bsdf_sharp_coat(Bsdf bsdf) {
    return ggx_is_delta(bsdf.layers.coat.alpha);
}

// Whether the cosine lobe on the viewer's side has anything to draw.
bool bsdf_has_diffuse(Bsdf bsdf) {
    return max_component(bsdf.diffuse) > 0.0 || (has_layer(bsdf.layers, LOBE_SHEEN) && max_component(bsdf.layers.sheen.color) > 0.0);
}

float bsdf_chance_diffuse(Bsdf bsdf) {
    float others = bsdf.chance_reflect + bsdf.chance_transmit + bsdf.chance_beyond + bsdf.chance_coat;
    return bsdf_has_diffuse(bsdf) ? max(1.0 - others, 0.0) : 0.0;
}

// Whether light from chosen directions can be reflected at all: not by mirrors and clear glass alone.
bool bsdf_spreads(Bsdf bsdf) {
    bool transmits = max_component(bsdf.transmitted) > 0.0;
    bool coat_spreads = bsdf.layers.coat_weight > 0.0 && !bsdf_sharp_coat(bsdf);
    return bsdf_has_diffuse(bsdf) || max_component(bsdf.beyond) > 0.0 || coat_spreads || !bsdf.sharp_reflection
        || (transmits && !bsdf.sharp_transmission);
}

// l on the viewer's side, h the half vector.
BsdfValue bsdf_reflected(Bsdf bsdf, vec3 v, vec3 l, vec3 h) {
    CoatShares shares = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, clamp(dot(v, h), 0.0, 1.0));
    BsdfValue result;
    result.value = bsdf.diffuse * (base_share(bsdf, shares) * l.z / PI);
    result.pdf = bsdf_chance_diffuse(bsdf) * cosine_pdf(l.z);
    if (!bsdf.sharp_reflection) {
        vec3 reflected = bsdf.interface_share * shares.reflected;
        result.value += reflected * (1.0 + bsdf.compensation) * interface_value(bsdf, v, l, h);
        result.pdf += bsdf.chance_reflect * interface_pdf(bsdf, v, h);
    }
    if (NEEDS_LOBES && bsdf.layers.flags != 0u) {
        result.value = layers_evaluate(bsdf.layers, v, l) + layers_base_share(bsdf.layers, v.z, l.z) * result.value;
        result.pdf += bsdf.chance_coat > 0.0 ? bsdf.chance_coat * clearcoat_pdf(bsdf.layers.coat, v, l) : 0.0;
    }
    return result;
}

// l on the other side, h the microfacet normal that sends v there; h.z > 0.
BsdfValue bsdf_transmitted(Bsdf bsdf, vec3 v, vec3 l, vec3 h) {
    float v_dot_h = clamp(dot(v, h), 0.0, 1.0);
    CoatShares shares = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, v_dot_h);
    if (shares.cos_t <= 0.0) {
        return BSDF_NOTHING; // total reflection
    }
    float pdf = interface_pdf(bsdf, v, h);
    if (!bsdf.sides.thin) {
        float l_dot_h = dot(l, h);
        float denominator = bsdf.sides.eta * v_dot_h + l_dot_h;
        // From the density of h to that of l: Walter et al., equation 17, with eta = n(v) / n(l).
        pdf *= l_dot_h < 0.0 ? 4.0 * v_dot_h * -l_dot_h / (denominator * denominator) : 0.0;
    }
    float weight = shares.base * interface_weight(bsdf, v, vec3(l.xy, -l.z)) * layers_base_share(bsdf.layers, v.z, -l.z);
    return BsdfValue(bsdf.transmitted * (weight * pdf), bsdf.chance_transmit * pdf);
}

// Scattered to the other side: the share below the interface is that of the direction mirrored to the viewer's side.
BsdfValue bsdf_beyond(Bsdf bsdf, vec3 v, vec3 l) {
    vec3 mirrored = vec3(l.xy, -l.z);
    vec3 h = normalize_or(v + mirrored, vec3(0.0, 0.0, 1.0));
    float share = base_share(bsdf, coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, clamp(dot(v, h), 0.0, 1.0)));
    float weight = share * layers_base_share(bsdf.layers, v.z, mirrored.z);
    return BsdfValue(bsdf.beyond * (weight * mirrored.z / PI), bsdf.chance_beyond * cosine_pdf(mirrored.z));
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
    BsdfValue beyond = NEEDS_LOBES && bsdf.chance_beyond > 0.0 ? bsdf_beyond(bsdf, v, l) : BSDF_NOTHING;
    if (bsdf.sharp_transmission || !(max_component(bsdf.transmitted) > 0.0)) {
        return beyond;
    }
    vec3 h = bsdf.sides.thin ? normalize_or(v + vec3(l.xy, -l.z), vec3(0.0, 0.0, 1.0)) : half_refracted(v, l, bsdf.sides.eta);
    BsdfValue through = dot(v, h) > 0.0 ? bsdf_transmitted(bsdf, v, l, h) : BSDF_NOTHING;
    return BsdfValue(through.value + beyond.value, through.pdf + beyond.pdf);
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

// The mirror or the clear glass below the layers: shares about the shading normal.
Scatter bsdf_sample_sharp(Bsdf bsdf, Surface surface, float v_z, bool transmitted) {
    CoatShares shares = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, v_z);
    vec3 travel = -surface.view;
    float below = layers_base_share(bsdf.layers, v_z, transmitted && !bsdf.sides.thin ? shares.cos_t : v_z);
    if (!transmitted) {
        vec3 direction = reflect_travel(travel, surface.shading_normal, surface.geometric_normal);
        return Scatter(true, false, direction, shares.reflected * (bsdf.interface_share * below / bsdf.chance_reflect), 0.0);
    }
    vec3 direction = bsdf.sides.thin ? travel : refract_travel(travel, surface.shading_normal, bsdf.sides.eta, v_z, shares.cos_t);
    vec3 weight = bsdf.transmitted * (below * shares.base / bsdf.chance_transmit);
    return Scatter(shares.base > 0.0, true, keep_below(direction, surface.geometric_normal), weight, 0.0);
}

Scatter bsdf_scatter_reflected(Bsdf bsdf, Surface surface, mat3 render_from_local, vec3 v, vec3 l) {
    BsdfValue drawn = l.z > 0.0 ? bsdf_reflected(bsdf, v, l, normalize_or(v + l, vec3(0.0, 0.0, 1.0))) : BSDF_NOTHING;
    return scatter_of(drawn, normalize_or(render_from_local * l, surface.geometric_normal), false, surface.geometric_normal);
}

Scatter bsdf_sample_coat(Bsdf bsdf, Surface surface, mat3 render_from_local, vec3 v, vec2 xi) {
    if (bsdf_sharp_coat(bsdf)) {
        vec3 direction = reflect_travel(-surface.view, render_from_local * bsdf.layers.coat.normal, surface.geometric_normal);
        return Scatter(true, false, direction, vec3(bsdf.layers.coat_weight / bsdf.chance_coat), 0.0);
    }
    vec3 l;
    float weight;
    if (!clearcoat_sample(bsdf.layers.coat, v, xi, l, weight)) {
        return SCATTER_NOTHING;
    }
    return bsdf_scatter_reflected(bsdf, surface, render_from_local, v, l);
}

Scatter bsdf_sample_beyond(Bsdf bsdf, Surface surface, mat3 render_from_local, vec3 v, vec2 xi) {
    vec3 mirrored = cosine_sample(xi);
    vec3 l = vec3(mirrored.xy, -mirrored.z);
    BsdfValue drawn = l.z < 0.0 ? bsdf_evaluate(bsdf, v, l) : BSDF_NOTHING;
    return scatter_of(drawn, render_from_local * l, true, surface.geometric_normal);
}

Scatter bsdf_sample_interface(Bsdf bsdf, Surface surface, mat3 render_from_local, vec3 v, vec2 xi, bool transmits) {
    vec3 h = interface_half(bsdf, v, xi);
    float v_dot_h = clamp(dot(v, h), 0.0, 1.0);
    vec3 l = 2.0 * v_dot_h * h - v;
    if (!transmits) {
        BsdfValue drawn = l.z > 0.0 ? bsdf_reflected(bsdf, v, l, h) : BSDF_NOTHING;
        return scatter_of(drawn, normalize_or(render_from_local * l, surface.geometric_normal), false, surface.geometric_normal);
    }
    float cos_t = coat_shares(bsdf.brdf, bsdf.sides, bsdf.front, v_dot_h).cos_t;
    l = bsdf.sides.thin ? vec3(l.xy, -l.z) : refract_travel(-v, h, bsdf.sides.eta, v_dot_h, cos_t);
    BsdfValue drawn = l.z < 0.0 ? bsdf_transmitted(bsdf, v, l, h) : BSDF_NOTHING;
    if (NEEDS_LOBES && bsdf.chance_beyond > 0.0 && l.z < 0.0) {
        BsdfValue beyond = bsdf_beyond(bsdf, v, l);
        drawn = BsdfValue(drawn.value + beyond.value, drawn.pdf + beyond.pdf);
    }
    return scatter_of(drawn, normalize_or(render_from_local * l, -surface.geometric_normal), true, surface.geometric_normal);
}

// Draws a lobe (xi.x) by what it is about to send on, then a direction of it (xi.yz).
Scatter bsdf_sample(Bsdf bsdf, Surface surface, mat3 render_from_local, vec3 xi) {
    vec3 v = surface.view * render_from_local;
    if (v.z <= 0.0) {
        return SCATTER_NOTHING;
    }
    float chosen = xi.x - bsdf.chance_reflect;
    bool reflects = chosen < 0.0;
    if (reflects || chosen < bsdf.chance_transmit) {
        return (reflects ? bsdf.sharp_reflection : bsdf.sharp_transmission) ? bsdf_sample_sharp(bsdf, surface, v.z, !reflects)
            : bsdf_sample_interface(bsdf, surface, render_from_local, v, xi.yz, !reflects);
    }
    chosen -= bsdf.chance_transmit;
    if (NEEDS_LOBES && chosen < bsdf.chance_coat) {
        return bsdf_sample_coat(bsdf, surface, render_from_local, v, xi.yz);
    }
    chosen -= bsdf.chance_coat;
    if (NEEDS_LOBES && chosen < bsdf.chance_beyond) {
        return bsdf_sample_beyond(bsdf, surface, render_from_local, v, xi.yz);
    }
    return bsdf_chance_diffuse(bsdf) > 0.0 ? bsdf_scatter_reflected(bsdf, surface, render_from_local, v, cosine_sample(xi.yz)) : SCATTER_NOTHING;
}

#endif
