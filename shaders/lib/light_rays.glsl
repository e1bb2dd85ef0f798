// Rays towards lights that have an area: emissive triangles and the environment. In: a Surface, random numbers in [0, 1). Out: LightRay:
// direction, irradiance of a surface facing it (radiance / pdf), end of the shadow ray. Knows neither visibility nor what the surface does with it.
#ifndef LIB_LIGHT_RAYS
#define LIB_LIGHT_RAYS

#include "lib/environment.glsl"
#include "lib/light_sampling.glsl"
#include "lib/surface.glsl"

struct LightRay {
    vec3 direction;     // unit, towards the light
    vec3 irradiance;    // radiance / pdf; 0: nothing arrives
    float pdf;          // 1/sr; what weights it beside other techniques
    vec3 origin;        // of the shadow ray
    vec3 along;         // unit, of the shadow ray: from spawn point to spawn point, not quite `direction`
    float t_max_m;
};

const LightRay LIGHT_RAY_NOTHING = LightRay(vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0, vec3(0.0), vec3(0.0, 0.0, 1.0), 0.0);

// Share of a technique with density `pdf` beside another: the balance heuristic (Veach 1997, section 9.2). Densities may be infinite.
float technique_share(float pdf, float other_pdf) {
    return pdf > 0.0 ? 1.0 / (1.0 + other_pdf / pdf) : 0.0;
}

#ifndef SURFACE_GRADIENTS
// Density, 1/sr, with which emissive_ray is said to choose a point `distance_m` away on a triangle of this material, seen under `cosine`. The
// table goes by area x luminance, so the area cancels. Only a weight: where vertices have moved since the table was made it is not exact, and need not be.
float emissive_pdf(Scene scene, Material material, float distance_m, float cosine) {
    float share = luminance(material.emissive) / scene.emissive_power;
    return share > 0.0 ? share * distance_m / abs(cosine) * distance_m : 0.0;
}

// Radiance that a point of a triangle sends along a direction, as far as the triangle is there: the shadow ray ends in front of it and does not
// meet its alpha. Textures at the base level.
vec3 triangle_emission(Scene scene, EmissiveTriangle emitter, Material material, Triangle triangle, vec2 barycentric, SurfacePoint point,
    vec3 leaving) {
    bool front = dot(leaving, point.normal) > 0.0;
    if (!front && !material_emits_behind(material)) {
        return vec3(0.0);
    }
    Attributes attributes = triangle_attributes(scene, emitter.instance, triangle, barycentric);
    TexturePoint textures_at = base_level_point(attributes);
    float coverage = 1.0;
    if (material_has_alpha(material)) {
        coverage = material_coverage(material, material_base_color(material, textures_at, attributes.color).a);
    }
    if (material_has_lobes(material)) {
        return coverage * surface_shade(scene, material, point, front, attributes, textures_at, leaving).emissive;
    }
    return coverage * material_emissive(material, textures_at);
}

// One emissive triangle drawn by area x luminance (choice), one point on it, uniform per area (xi). Only where emissive_count > 0.
LightRay emissive_ray(Scene scene, Surface surface, vec2 choice, vec2 xi) {
    uint drawn = alias_draw(scene.emissive_alias, scene.emissive_count, choice);
    float pdf = AliasTable(scene.emissive_alias).at[drawn].pdf;
    EmissiveTriangle emitter = EmissiveTable(scene.emissive_triangles).at[drawn];
    Triangle triangle = triangle_fetch(scene, emitter.instance, emitter.geometry, emitter.primitive);
    vec2 barycentric = triangle_sample(xi);
    SurfacePoint point = triangle_point(triangle, barycentric);
    vec3 to_light = point.position - surface.position;
    float distance_m = safe_length(to_light);
    if (!(distance_m > 0.0) || !(pdf > 0.0)) {
        return LIGHT_RAY_NOTHING;
    }
    Material material = MaterialTable(scene.materials).at[material_index(scene, emitter.instance, emitter.geometry)];
    vec3 towards = to_light / distance_m;
    float cosine = -dot(towards, point.normal);
    vec3 radiance = triangle_emission(scene, emitter, material, triangle, barycentric, point, -towards);
    float area = 0.5 * triangle_double_area(triangle);
    LightRay ray;
    ray.direction = towards;
    ray.irradiance = radiance * (abs(cosine) * (area / distance_m / distance_m) / pdf);
    ray.pdf = emissive_pdf(scene, material, distance_m, cosine);
    // From spawn point to spawn point: the ray ends in front of the emitter by its own offset.
    ray.origin = surface_spawn(surface, towards);
    vec3 end = spawn_position(point.position, point.normal, point.offset_m, -towards);
    ray.along = normalize_or(end - ray.origin, towards);
    ray.t_max_m = safe_length(end - ray.origin) * SEGMENT_END;
    return ray;
}

#endif

// Whether environment_ray draws from the map's table too.
bool environment_by_map(Scene scene) {
    return NEEDS_ENVIRONMENT_MAP && scene.environment_width > 0u;
}

// Share of the directions of environment_ray that the map's table draws. Where something else draws the surface's lobes as well and is weighted
// against it, all of them.
const float MAP_SHARE_ALONE = 0.5;
const float MAP_SHARE_WITH_LOBES = 1.0;

// Density of environment_ray, 1/sr.
float environment_ray_pdf(Scene scene, vec3 normal, vec3 direction, float map_share) {
    float pdf = cosine_pdf(dot(direction, normal));
    return environment_by_map(scene) ? mix(pdf, environment_pdf(scene, direction), map_share) : pdf;
}

// One direction: from the cosine lobe about the shading normal (the third column), or for a map by turns from that and the map's alias table,
// weighted by the balance heuristic over both (one-sample model: Veach 1997, section 9.2.4). strategy_xi and cell_xi are for maps only.
LightRay environment_ray(Scene scene, Surface surface, mat3 render_from_local, float map_share, float strategy_xi, vec2 cell_xi, vec2 point_xi) {
    LightRay ray;
    if (environment_by_map(scene) && strategy_xi < map_share) {
        ray.direction = environment_sample(scene, cell_xi, point_xi);
    } else {
        ray.direction = render_from_local * cosine_sample(point_xi);
    }
    ray.pdf = environment_ray_pdf(scene, surface.shading_normal, ray.direction, map_share);
    ray.irradiance = ray.pdf > 0.0 ? environment_radiance(scene, ray.direction) / ray.pdf : vec3(0.0);
    ray.origin = surface_spawn(surface, ray.direction);
    ray.along = ray.direction;
    ray.t_max_m = FLOAT_MAX;
    return ray;
}

#endif
