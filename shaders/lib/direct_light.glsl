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
#include "lib/environment.glsl"
#include "lib/light_sampling.glsl"
#include "lib/random.glsl"
#include "lib/surface.glsl"

#ifdef LIGHT_WITHOUT_RAYS
const bool LOBE_MEETS_LIGHTS = false;
#else
const bool LOBE_MEETS_LIGHTS = true;
#endif

// Share of light, per channel, that comes from `origin + direction * t_max_m` to `origin`. seed: for stochastic alpha.
vec3 light_visibility(vec3 origin, vec3 direction, float t_max_m, uint seed);

struct DirectLight {
    vec3 diffuse;   // to be multiplied by surface_diffuse_albedo
    vec3 specular;
};

struct Receiver {
    Surface surface;
    mat3 render_from_local;     // z: shading normal
    vec3 v;                     // local, towards the viewer
    Brdf brdf;
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

Receiver receiver_begin(Surface surface, bool lobe_traced, Sequence sequence, uint vertex, uint branch) {
    Receiver receiver;
    receiver.surface = surface;
    receiver.render_from_local = basis_around(surface.shading_normal);
    receiver.v = surface.view * receiver.render_from_local;
    receiver.brdf = surface_brdf(surface);
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
    BrdfValue value = brdf_evaluate(receiver.brdf, receiver.v, direction * receiver.render_from_local);
    light.diffuse = receiver.has_diffuse ? irradiance * value.diffuse : vec3(0.0);
    light.specular = irradiance * value.specular * specular_share;
    return light;
}

bool is_dark(DirectLight light) {
    return !(max_component(light.diffuse) > 0.0 || max_component(light.specular) > 0.0);
}

// Adds the light when something of it arrives; without it, no ray is traced.
void add_light(inout DirectLight sum, DirectLight light, vec3 origin, vec3 direction, float t_max_m, uint seed) {
    if (is_dark(light)) {
        return;
    }
    vec3 share = light_visibility(origin, direction, t_max_m, seed);
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

void add_punctual_light(inout DirectLight sum, Receiver receiver, Light light, uint pair, uint rays, float weight, bool shares_lobe) {
    for (uint i = 0u; i < rays; ++i) {
        Sequence sequence = sequence_split(receiver.sequence, rays, i);
        vec2 xi = sample_2d(sequence, receiver_dimension(receiver, PURPOSE_LIGHT_POINT, pair));
        LightSample s = light_sample(light, receiver.surface.position, xi);
        float specular_share = 1.0;
        if (shares_lobe && s.pdf > 0.0) {
            float lobe_pdf = brdf_pdf_specular(receiver.brdf, receiver.v, s.direction * receiver.render_from_local);
            specular_share = balance(float(rays), s.pdf, lobe_pdf);
        }
        DirectLight reflected = receiver_reflect(receiver, s.direction, s.irradiance * (weight / float(rays)), specular_share);
        add_light(sum, reflected, surface_spawn(receiver.surface, s.direction), s.direction, s.distance_m,
            visibility_seed(receiver, pair * rays + i));
    }
}

// All lights when there are at most `draws`, else `draws` of them drawn by power.
void add_punctual_lights(inout DirectLight sum, Scene scene, Receiver receiver, uint draws, uint rays) {
    if (!NEEDS_LIGHTS) {
        return;
    }
    LightTable lights = LightTable(scene.lights);
    if (visits_all_lights(scene, draws)) {
        for (uint i = 0u; i < scene.light_count; ++i) {
            add_punctual_light(sum, receiver, lights.at[i], i, rays, 1.0, receiver.lobe_traced && LOBE_MEETS_LIGHTS);
        }
        return;
    }
    for (uint i = 0u; i < draws; ++i) {
        vec2 xi = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_LIGHT_CHOICE, i));
        Light light = lights.at[alias_draw(scene.light_alias, scene.light_count, xi)];
        if (light.selection_pdf > 0.0) {
            add_punctual_light(sum, receiver, light, i, rays, 1.0 / (light.selection_pdf * float(draws)), false);
        }
    }
}

#ifndef SURFACE_GRADIENTS
// Radiance that a point of a triangle sends to a side; textures at the base level.
vec3 triangle_emission(Scene scene, EmissiveTriangle emitter, Triangle triangle, vec2 barycentric, bool front) {
    Material material = MaterialTable(scene.materials).at[material_index(scene, emitter.instance, emitter.geometry)];
    if (!front && !material_emits_behind(material)) {
        return vec3(0.0);
    }
    Attributes attributes = triangle_attributes(scene, emitter.instance, triangle, barycentric);
    TexturePoint textures_at;
    textures_at.uv = attributes.uv;
    textures_at.uv_area = float[2](0.0, 0.0);
    return material_emissive(material, textures_at);
}

// One emissive triangle drawn by area x luminance, one point on it, uniform per area.
void add_emissive_light(inout DirectLight sum, Scene scene, Receiver receiver) {
    if (!NEEDS_EMISSIVE_LIGHTS || scene.emissive_count == 0u) {
        return;
    }
    vec2 choice = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_EMISSIVE, 0u));
    vec2 xi = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_EMISSIVE, 1u));
    uint drawn = alias_draw(scene.emissive_alias, scene.emissive_count, choice);
    float pdf = AliasTable(scene.emissive_alias).at[drawn].pdf;
    EmissiveTriangle emitter = EmissiveTable(scene.emissive_triangles).at[drawn];
    Triangle triangle = triangle_fetch(scene, emitter.instance, emitter.geometry, emitter.primitive);
    vec2 barycentric = triangle_sample(xi);
    SurfacePoint point = triangle_point(triangle, barycentric);
    vec3 to_light = point.position - receiver.surface.position;
    float distance_m = safe_length(to_light);
    if (!(distance_m > 0.0) || !(pdf > 0.0)) {
        return;
    }
    vec3 direction = to_light / distance_m;
    float cosine = -dot(direction, point.normal);
    vec3 radiance = triangle_emission(scene, emitter, triangle, barycentric, cosine > 0.0);
    float area = 0.5 * triangle_double_area(triangle);
    vec3 irradiance = radiance * (abs(cosine) * (area / distance_m / distance_m) / pdf);
    float specular_share = receiver.lobe_traced && LOBE_MEETS_LIGHTS ? 0.0 : 1.0;
    DirectLight reflected = receiver_reflect(receiver, direction, irradiance, specular_share);
    if (is_dark(reflected)) {
        return;
    }
    // From spawn point to spawn point: the ray ends in front of the emitter by its own offset.
    vec3 start = surface_spawn(receiver.surface, direction);
    vec3 end = spawn_position(point.position, point.normal, point.offset_m, -direction);
    float length_m = safe_length(end - start);
    vec3 along = normalize_or(end - start, direction);
    add_light(sum, reflected, start, along, length_m * SEGMENT_END, visibility_seed(receiver, 4094u));
}
#endif

// One direction: from the cosine lobe, or for a map by turns from the cosine lobe and the map's alias table, weighted by the balance heuristic
// over both (one-sample model: Veach 1997, section 9.2.4).
void add_environment_light(inout DirectLight sum, Scene scene, Receiver receiver) {
    if (!NEEDS_ENVIRONMENT) {
        return;
    }
    bool by_map = NEEDS_ENVIRONMENT_MAP && scene.environment_width > 0u;
    vec2 point_xi = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_ENVIRONMENT, 2u));
    vec3 direction;
    if (by_map && sample_1d(receiver.sequence, receiver_dimension(receiver, PURPOSE_ENVIRONMENT, 0u)) < 0.5) {
        vec2 cell_xi = sample_2d(receiver.sequence, receiver_dimension(receiver, PURPOSE_ENVIRONMENT, 1u));
        direction = environment_sample(scene, cell_xi, point_xi);
    } else {
        direction = receiver.render_from_local * cosine_sample(point_xi);
    }
    float pdf = cosine_pdf(dot(direction, receiver.surface.shading_normal));
    if (by_map) {
        pdf = 0.5 * (pdf + environment_pdf(scene, direction));
    }
    if (!(pdf > 0.0)) {
        return;
    }
    vec3 irradiance = environment_radiance(scene, direction) / pdf;
    float specular_share = receiver.lobe_traced ? 0.0 : 1.0;
#ifdef LIGHT_WITHOUT_RAYS
    irradiance *= receiver.surface.occlusion;
#endif
    DirectLight reflected = receiver_reflect(receiver, direction, irradiance, specular_share);
    add_light(sum, reflected, surface_spawn(receiver.surface, direction), direction, FLOAT_MAX, visibility_seed(receiver, 4095u));
}

// draws: lights visited; rays: shadow rays to each of them.
DirectLight direct_light(Scene scene, Receiver receiver, uint draws, uint rays) {
    DirectLight sum = DirectLight(vec3(0.0), vec3(0.0));
    if (receiver.surface.mode != MODE_PBR || receiver.v.z <= 0.0) {
        return sum; // perfect mirrors and smooth glass: only the traced rays carry light
    }
    add_punctual_lights(sum, scene, receiver, draws, max(rays, 1u));
    add_emissive_light(sum, scene, receiver);
    add_environment_light(sum, scene, receiver);
    return sum;
}

#endif
