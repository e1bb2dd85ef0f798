// Directions after an interface. In: unit direction of travel, unit normal on the incident side. Out: unit directions.
#ifndef LIB_REFRACTION
#define LIB_REFRACTION

#include "lib/vector.glsl"

// Snell's law. eta = n(incident) / n(other); cos_i = -dot(travel, normal) >= 0 and cos_t > 0 as fresnel_dielectric gave them.
vec3 refract_travel(vec3 travel, vec3 normal, float eta, float cos_i, float cos_t) {
    return normalize_or(eta * travel + (eta * cos_i - cos_t) * normal, -normal);
}

// Mirror direction; where an interpolated or mapped normal would send it below the surface, the part below is turned up.
vec3 reflect_travel(vec3 travel, vec3 normal, vec3 geometric_normal) {
    vec3 direction = travel - 2.0 * dot(travel, normal) * normal;
    float below = min(dot(direction, geometric_normal), 0.0);
    return normalize_or(direction - 2.0 * below * geometric_normal, geometric_normal);
}

#endif
