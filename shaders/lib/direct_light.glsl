// Direct light at a surface: punctual lights, emissive triangles, the environment, each with its shadow rays.
// In: a Receiver. Out: DirectLight, the diffuse part without the base colour's factor. The includer defines light_visibility(): a shadow ray,
// or 1 in pipelines without rays (with LIGHT_WITHOUT_RAYS: then the sampled lobe meets the environment only, dimmed by occlusion here).
// How the specular lobe is shared with the rays that the shading pass traces along it (Receiver.lobe_traced):
//   punctual lights with a size: both see them, weighted by the balance heuristic (Veach 1997, section 9.2), when every light is visited;
//   punctual lights without a size, or drawn ones: here only. Emissive triangles and environment: the traced lobe only.
#ifndef LIB_DIRECT_LIGHT
#define LIB_DIRECT_LIGHT

#include "shared/frame.glsl"
#include "shared/needs.glsl"
#include "lib/layers.glsl"
#include "lib/light_rays.glsl"
#include "lib/random.glsl"

#ifdef LIGHT_WITHOUT_RAYS
const bool LOBE_MEETS_LIGHTS = false;
#else
const bool LOBE_MEETS_LIGHTS = true;
#endif

// Share of light, per channel, that comes from `origin + direction * t_max_m` to `origin`, which lies in `medium`. seed: for stochastic alpha.
vec3 light_visibility(Scene scene, vec3 origin, vec3 direction, float t_max_m, uint medium, uint seed);
#ifdef SHADOWS_ARE_REMEMBERED
// The same from punctual light number `light`, or LIGHT_UNNUMBERED, where the includer may know it without a ray.
vec3 numbered_visibility(uint light, Scene scene, vec3 origin, vec3 direction, float t_max_m, uint medium, uint seed);
#endif

struct DirectLight {
    vec3 diffuse;   // to be multiplied by surface_diffuse_albedo
    vec3 specular;
};

struct Receiver {
    Surface surface;
    uint medium;                // on the viewer's side
    mat3 render_from_local;     // z: shading normal
    vec3 v;                     // local, towards the viewer
    Brdf brdf;
    Layers layers;
    bool has_diffuse;
    bool lobe_traced;
    Sequence sequence;
    uint vertex;
    uint branch;
};

// Whether rays follow the specular reflection of this surface (to the depth that the frame allows).
bool surface_reflects(Frame frame, Surface surface) {
    switch (surface.mode) {
        case MODE_PBR: return NEEDS_REFLECTION && surface.roughness <= frame.reflection_roughness_max;
        case MODE_REFLECTIVE: return NEEDS_REFLECTION;
        case MODE_REFRACTIVE: return NEEDS_REFRACTION;
        default: return false;
    }
}

// Coats below this roughness are left to the path tracer: no ray follows them here, and drawn directions seldom meet their lobe.
const float LEAST_COAT_ROUGHNESS = 0.2;

Receiver receiver_begin(Surface surface, uint medium, bool lobe_traced, Sequence sequence, uint vertex, uint branch) {
    Receiver receiver;
    receiver.surface = surface;
    receiver.medium = medium;
    receiver.render_from_local = basis_around(surface.shading_normal);
    receiver.v = surface.view * receiver.render_from_local;
    receiver.brdf = surface_brdf(surface);
    Lobes lobes = surface.lobes;
    lobes.clearcoat *= lobes.clearcoat_roughness >= LEAST_COAT_ROUGHNESS ? 1.0 : 0.0;
    receiver.layers = layers_begin(lobes, receiver.render_from_local, receiver.v);
    receiver.has_diffuse = max_component(surface_diffuse_albedo(surface)) > 0.0;
    receiver.lobe_traced = lobe_traced;
    receiver.sequence = sequence;
    receiver.vertex = vertex;
    receiver.branch = branch;
    return receiver;
}

uint receiver_dimension(Receiver receiver, uint purpose, uint pair) {
    return sample_dimension(receiver.vertex, receiver.branch, purpose, pair);
}

// Light from one direction, before visibility. irradiance: radiance / pdf. Zero below the surface.
DirectLight receiver_reflect(Receiver receiver, vec3 direction, vec3 irradiance, float specular_share) {
    DirectLight light = DirectLight(vec3(0.0), vec3(0.0));
    if (dot(direction, receiver.surface.geometric_normal) <= 0.0) {
        return light;
    }
    vec3 l = direction * receiver.render_from_local;
    BrdfValue value = brdf_evaluate(receiver.brdf, receiver.v, l);
    light.diffuse = receiver.has_diffuse ? irradiance * value.diffuse : vec3(0.0);
    light.specular = irradiance * value.specular * specular_share;
    if (NEEDS_LOBES && receiver.layers.flags != 0u && receiver.v.z > 0.0 && l.z > 0.0) {
        float share = layers_base_share(receiver.layers, receiver.v.z, l.z);
        light.diffuse *= share;
        light.specular = share * light.specular + irradiance * layers_evaluate(receiver.layers, receiver.v, l);
    }
    return light;
}

bool is_dark(DirectLight light) {
    return !(max_component(light.diffuse) > 0.0 || max_component(light.specular) > 0.0);
}

// Adds the light when something of it arrives; without it, no ray is traced. `number`: as for numbered_visibility.
void add_light(inout DirectLight sum, DirectLight light, Scene scene, uint medium, uint number, LightRay ray, uint seed) {
    if (is_dark(light)) {
        return;
    }
#ifdef SHADOWS_ARE_REMEMBERED
    vec3 share = numbered_visibility(number, scene, ray.origin, ray.along, ray.t_max_m, medium, seed);
#else
    vec3 share = light_visibility(scene, ray.origin, ray.along, ray.t_max_m, medium, seed);
#endif
    sum.diffuse += share * light.diffuse;
    sum.specular += share * light.specular;
}

uint visibility_seed(Receiver receiver, uint salt) {
    return hash_pcg4d(uvec4(receiver.sequence.pixel, receiver.sequence.scramble ^ receiver.sequence.index,
        receiver_dimension(receiver, 15u, salt))).x;
}

// Every light is visited, rather than some drawn.
bool visits_all_lights(Scene scene, uint draws) {
    return scene.light_count <= draws;
}

// Share of a technique with density `pdf`, `count` samples, beside another one with one sample of density `other_pdf`.
float balance(float count, float pdf, float other_pdf) {
    float sum = count * pdf + other_pdf;
    return sum > 0.0 ? count * pdf / sum : 0.0;
}

// One drawn direction, before the surface does anything with it.
struct DrawnLight {
    LightRay ray;
    float specular_share;   // of the light that the traced lobe does not bring
    uint salt;              // names its random numbers
    uint number;            // of the punctual light, when every one is visited
};

const uint LIGHT_UNNUMBERED = 0xffffffffu;

// Shadow ray `which` of all those to punctual lights: `rays` to every light, or to each of `draws` lights drawn by power.
DrawnLight punctual_light(Scene scene, Receiver receiver, uint which, uint draws, uint rays) {
    bool visits_all = visits_all_lights(scene, draws);
    uint pair = which / rays;
    uint number = pair;
    float weight = 1.0;
    LightTable lights = LightTable(scene.lights);
    if (!visits_all) {
        number = alias_draw(scene.light_alias, scene.light_count, sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_LIGHT_CHOICE, pair)));
        float chance = lights.at[number].selection_pdf;
        weight = chance > 0.0 ? 1.0 / (chance * float(draws)) : 0.0;
    }
    Sequence sequence = sequence_split(receiver.sequence, rays, which % rays);
    vec2 xi = sample_2d(sequence, receiver_dimension(receiver, PURPOSE_LIGHT_POINT, pair));
    LightSample s = light_sample(lights.at[number], receiver.surface.position, xi);
    float specular_share = 1.0;
    if (visits_all && receiver.lobe_traced && LOBE_MEETS_LIGHTS && s.pdf > 0.0) {
        float lobe_pdf = brdf_pdf_specular(receiver.brdf, receiver.v, s.direction * receiver.render_from_local);
        specular_share = balance(float(rays), s.pdf, lobe_pdf);
    }
    LightRay ray = LightRay(s.direction, s.irradiance * (weight / float(rays)), s.pdf, surface_spawn(receiver.surface, s.direction), s.direction,
        s.distance_m);
    return DrawnLight(ray, specular_share, which, visits_all ? number : LIGHT_UNNUMBERED);
}

DrawnLight emissive_light(Scene scene, Receiver receiver) {
    vec2 choice = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_EMISSIVE, 0u));
    vec2 xi = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_EMISSIVE, 1u));
    return DrawnLight(emissive_ray(scene, receiver.surface, choice, xi), receiver.lobe_traced && LOBE_MEETS_LIGHTS ? 0.0 : 1.0, 4094u, LIGHT_UNNUMBERED);
}

DrawnLight environment_light(Scene scene, Receiver receiver) {
    bool by_map = environment_by_map(scene);
    vec2 point_xi = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_ENVIRONMENT, 2u));
    float strategy_xi = by_map ? sample_1d(receiver.sequence, receiver_dimension(receiver, PURPOSE_ENVIRONMENT, 0u)) : 1.0;
    vec2 cell_xi = by_map ? sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_ENVIRONMENT, 1u)) : vec2(0.0);
    LightRay ray = environment_ray(scene, receiver.surface, receiver.render_from_local, MAP_SHARE_ALONE, strategy_xi, cell_xi,
        point_xi);
#ifdef LIGHT_WITHOUT_RAYS
    ray.irradiance *= receiver.surface.occlusion;
#endif
    return DrawnLight(ray, receiver.lobe_traced ? 0.0 : 1.0, 4095u, LIGHT_UNNUMBERED);
}

// draws: lights visited; rays: shadow rays to each of them. One loop over all kinds of lamps: compilers copy what is called into every place that
// calls it, and the model of the surface is long.
DirectLight direct_light(Scene scene, Receiver receiver, uint draws, uint rays) {
    DirectLight sum = DirectLight(vec3(0.0), vec3(0.0));
    if (receiver.surface.mode != MODE_PBR || receiver.v.z <= 0.0) {
        return sum; // perfect mirrors and smooth glass: only the traced rays carry light
    }
    rays = max(rays, 1u);
    uint punctual = 0u;
    if (NEEDS_LIGHTS) {
        punctual = (visits_all_lights(scene, draws) ? scene.light_count : draws) * rays;
    }
    uint emissive = 0u;
    if (NEEDS_EMISSIVE_LIGHTS) {
        emissive = min(scene.emissive_count, 1u);
    }
    uint environment = 0u;
    if (NEEDS_ENVIRONMENT) {
        environment = 1u;
    }
    for (uint i = 0u; i < punctual + emissive + environment; ++i) {
        DrawnLight drawn;
        if (NEEDS_LIGHTS && i < punctual) {
            drawn = punctual_light(scene, receiver, i, draws, rays);
        } else if (NEEDS_EMISSIVE_LIGHTS && i < punctual + emissive) {
            drawn = emissive_light(scene, receiver);
        } else {
            drawn = environment_light(scene, receiver);
        }
        DirectLight reflected = receiver_reflect(receiver, drawn.ray.direction, drawn.ray.irradiance, drawn.specular_share);
        add_light(sum, reflected, scene, receiver.medium, drawn.number, drawn.ray, visibility_seed(receiver, drawn.salt));
    }
    return sum;
}

#endif
