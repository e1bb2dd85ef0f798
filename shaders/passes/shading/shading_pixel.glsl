// What the two shading passes share: the G-buffer bindings, the first surface and its direct light.
#ifndef PASS_SHADING_PIXEL
#define PASS_SHADING_PIXEL

#extension GL_EXT_samplerless_texture_functions : require

#include "lib/gbuffer.glsl"
#include "lib/direct_light.glsl"
#include "lib/scatter.glsl"

layout(set = 1, binding = 0) uniform utexture2D gbuffer_id;
layout(set = 1, binding = 1) uniform utexture2D gbuffer_normal;
layout(set = 1, binding = 2) uniform texture2D gbuffer_base_color;
layout(set = 1, binding = 3) uniform texture2D gbuffer_material;
layout(set = 1, binding = 4) uniform texture2D gbuffer_emissive;
layout(set = 1, binding = 5) uniform texture2D direct_diffuse;
layout(set = 1, binding = 6) uniform texture2D direct_specular;
layout(set = 1, binding = 7, rgba32f) uniform image2D shaded;

Surface first_surface(Frame frame, Scene scene, uvec2 pixel, uvec4 id) {
    ivec2 at = ivec2(pixel);
    Surface surface = surface_from_gbuffer(frame, scene, pixel, id, texelFetch(gbuffer_normal, at, 0).xy,
        texelFetch(gbuffer_base_color, at, 0), texelFetch(gbuffer_material, at, 0).xy);
    if (NEEDS_EMISSION) {
        surface.emissive = texelFetch(gbuffer_emissive, at, 0).rgb;
    }
    return surface;
}

// Emission and the direct light of the shadow pass, put back onto the material.
vec3 first_light(Surface surface, uvec2 pixel) {
    vec3 radiance = surface.emissive;
    if (push.argument0 != 0u && surface.mode == MODE_PBR) {
        ivec2 at = ivec2(pixel);
        float v_z = dot(surface.view, surface.shading_normal);
        radiance += surface_diffuse_albedo(surface) * texelFetch(direct_diffuse, at, 0).rgb;
        radiance += brdf_specular_albedo(surface_brdf(surface), v_z) * texelFetch(direct_specular, at, 0).rgb;
    }
    return radiance;
}

// Absorption on the camera's own segment, when it ends at the back of a volume: the camera is inside.
vec3 seen_through(Scene scene, Surface surface, uint material, float distance_m) {
    bool inside = surface_encloses(surface) && !surface.front;
    return inside ? medium_transmittance(scene, material, distance_m) : vec3(1.0);
}

float camera_distance(Frame frame, uvec2 pixel, Surface surface) {
    return length(surface.position - camera_ray(frame, camera_sample_position(frame, pixel)).origin);
}

vec3 background(Frame frame, Scene scene, uvec2 pixel) {
    return environment_radiance(scene, camera_ray(frame, camera_sample_position(frame, pixel)).direction);
}

#endif
