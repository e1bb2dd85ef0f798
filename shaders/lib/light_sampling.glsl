// Points on lights. In: a light, the receiving point, random numbers in [0, 1)^2. Out: a direction, a distance, and the irradiance that a
// surface facing it would get from this one sample (radiance / pdf), with the density per solid angle beside it. Knows no visibility and no material.
#ifndef LIB_LIGHT_SAMPLING
#define LIB_LIGHT_SAMPLING

#include "shared/scene.glsl"
#include "lib/basis.glsl"
#include "lib/brdf.glsl"
#include "lib/vector.glsl"

struct LightSample {
    vec3 direction;     // unit, towards the light
    float distance_m;   // to the sampled point; FLOAT_MAX for lights at infinity
    vec3 irradiance;    // radiance / pdf; 0: nothing arrives
    float pdf;          // 1/sr; 0 for lights without size
};

// The cone under which a light is seen.
struct LightCone {
    vec3 axis;                  // unit
    float distance_m;           // to the centre
    float one_minus_cos;        // of the half angle, with all its digits; 0: no size; 2: the whole sphere (the point is inside)
    vec3 perpendicular;         // irradiance of a surface facing the axis, were the light a point
};

// KHR_lights_punctual: window of the range (no 1/d^2 in it).
float light_range_window(float distance_m, float range_m) {
    if (range_m <= 0.0) {
        return 1.0;
    }
    float r = distance_m / range_m;
    return clamp(1.0 - r * r * r * r, 0.0, 1.0);
}

// KHR_lights_punctual: square of the clamped ramp between the cosines; a step where they are equal.
float light_spot_window(Light light, float cosine) {
    float ramp = light.cos_inner - light.cos_outer;
    float t = ramp > 0.0 ? clamp((cosine - light.cos_outer) / ramp, 0.0, 1.0) : (cosine >= light.cos_outer ? 1.0 : 0.0);
    return t * t;
}

LightCone light_cone(Light light, vec3 position) {
    LightCone cone;
    if (light.kind == LIGHT_DIRECTIONAL) {
        float half_sine = sin(0.5 * light.angular_radius_rad);
        cone.axis = -light.direction;
        cone.distance_m = FLOAT_MAX;
        cone.one_minus_cos = 2.0 * half_sine * half_sine;
        cone.perpendicular = light.intensity;
        return cone;
    }
    vec3 to_light = light.position - position;
    float distance_m = safe_length(to_light);
    cone.axis = normalize_or(to_light, vec3(0.0, 1.0, 0.0));
    cone.distance_m = distance_m;
    float window = light_range_window(distance_m, light.range_m);
    if (light.kind == LIGHT_SPOT) {
        window *= light_spot_window(light, dot(light.direction, -cone.axis));
    }
    float sine = light.radius_m / distance_m; // infinite in the centre: inside
    if (light.radius_m > 0.0 && !(sine < 1.0)) {
        // Inside the sphere its radiance I / (pi r^2) comes from everywhere: continuous with the outside.
        cone.one_minus_cos = 2.0;
        cone.perpendicular = light.intensity * window / light.radius_m / light.radius_m;
        return cone;
    }
    float sine2 = light.radius_m > 0.0 ? sine * sine : 0.0;
    cone.one_minus_cos = sine2 / (1.0 + sqrt(1.0 - sine2)); // 1 - cos = sin^2 / (1 + cos): exact for far and small lights
    cone.perpendicular = distance_m > 0.0 ? light.intensity * window / distance_m / distance_m : vec3(0.0);
    return cone;
}

// Density of light_sample in any direction within the cone, 1/sr; 0 for lights without size.
float light_cone_pdf(LightCone cone) {
    return cone.one_minus_cos > 0.0 ? 1.0 / (TAU * cone.one_minus_cos) : 0.0;
}

// Radiance of the light's surface. Only for lights with a size. Outside: E / (pi sin^2 a) with sin^2 = (1 - cos) (1 + cos).
vec3 light_cone_radiance(LightCone cone) {
    float sine2 = cone.one_minus_cos >= 2.0 ? 1.0 : cone.one_minus_cos * (2.0 - cone.one_minus_cos);
    return cone.perpendicular / (PI * sine2);
}

// Radiance x 2 pi (1 - cos): what one sample of the solid angle stands for. The radius cancels, so its limit is the point light.
vec3 light_cone_irradiance(LightCone cone) {
    return cone.one_minus_cos >= 2.0 ? 4.0 * cone.perpendicular : cone.perpendicular * (2.0 / (2.0 - cone.one_minus_cos));
}

// Distance to the light's sphere along a direction within the cone, whose sine to the axis is given squared.
float light_cone_distance(Light light, LightCone cone, float cosine, float sine2) {
    if (light.kind == LIGHT_DIRECTIONAL || cone.one_minus_cos <= 0.0) {
        return cone.distance_m;
    }
    float chord2 = light.radius_m * light.radius_m - cone.distance_m * cone.distance_m * sine2;
    float half_chord = sqrt(max(chord2, 0.0));
    if (cone.one_minus_cos >= 2.0) {
        return max(cone.distance_m * cosine + half_chord, 0.0);
    }
    return max(cone.distance_m * cosine - half_chord, 0.0);
}

// Uniform in the solid angle under which the light is seen (pbrt, 4th ed., section 6.2.4, with 1 - cos kept instead of cos).
LightSample light_sample(Light light, vec3 position, vec2 xi) {
    LightCone cone = light_cone(light, position);
    vec2 disc = concentric_disc(xi);
    float area = min(dot(disc, disc), 1.0);
    float rise = area * cone.one_minus_cos;             // 1 - cos of the sampled direction
    float sine2 = max(rise * (2.0 - rise), 0.0);
    // disc / |disc| * sine = disc * sqrt(one_minus_cos (2 - rise))
    vec2 across = disc * sqrt(max(cone.one_minus_cos * (2.0 - rise), 0.0));
    LightSample s;
    s.direction = normalize_or(basis_around(cone.axis) * vec3(across, 1.0 - rise), cone.axis);
    s.distance_m = light_cone_distance(light, cone, 1.0 - rise, sine2);
    s.irradiance = light_cone_irradiance(cone);
    s.pdf = light_cone_pdf(cone);
    return s;
}

// A light that a ray meets.
struct LightMet {
    float distance_m;   // FLOAT_MAX for lights at infinity
    vec3 radiance;
    float pdf;          // of light_sample, 1/sr
};

// True where a ray from `position` meets the light no later than t_max_m (FLOAT_MAX: it hit nothing).
bool light_intersect(Light light, vec3 position, vec3 direction, float t_max_m, out LightMet met) {
    LightCone cone = light_cone(light, position);
    met = LightMet(FLOAT_MAX, vec3(0.0), 0.0);
    if (cone.one_minus_cos <= 0.0) {
        return false;
    }
    vec3 chord = direction - cone.axis;
    float rise = 0.5 * dot(chord, chord); // 1 - cos of the angle between two unit vectors
    if (rise > cone.one_minus_cos) {
        return false;
    }
    met = LightMet(light_cone_distance(light, cone, 1.0 - rise, rise * (2.0 - rise)), light_cone_radiance(cone), light_cone_pdf(cone));
    return met.distance_m <= t_max_m;
}

// Draws an entry of an alias table with two random numbers.
uint alias_draw(uint64_t table, uint count, vec2 xi) {
    uint column = min(uint(xi.x * float(count)), count - 1u);
    AliasEntry entry = AliasTable(table).at[column];
    return xi.y < entry.threshold ? column : entry.alias;
}

// Uniform on a triangle: barycentrics (weights of v1, v2); density 1 / area. Square root map (Turk 1990).
vec2 triangle_sample(vec2 xi) {
    float root = sqrt(xi.x);
    return vec2((1.0 - xi.y) * root, xi.y * root);
}

#endif
