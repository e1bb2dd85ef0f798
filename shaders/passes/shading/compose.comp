// Puts denoised light back onto the first surfaces. In: the G-buffer, the denoised signals and their tint; in `shaded` the lamps that mirrors show.
// Out: `shaded`, linear HDR, where there is a surface. Direct light is put onto the material as pass shading does; a path's light is whole and
// has one tint (path_trace.rgen).
#version 460
#extension GL_GOOGLE_include_directive : require
#define LIGHT_WITHOUT_RAYS

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/shading/shading_pixel.glsl"
#include "lib/demodulation.glsl"

layout(set = 1, binding = 9) uniform texture2D reflected;
layout(set = 1, binding = 10) uniform texture2D reflected_tint;   // of a path the whole tint, else that of the image alone

vec3 light_visibility(Scene scene, vec3 origin, vec3 direction, float t_max_m, uint medium, uint seed) {
    return vec3(1.0);
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    uvec4 id = texelFetch(gbuffer_id, at, 0);
    if (id.x == 0u) {
        return; // the background is there already
    }
    Surface surface = first_surface(frame, scene, pixel, id);
    vec3 passed = seen_through(scene, surface, id.w, camera_distance(frame, pixel, surface));
    vec3 brought = texelFetch(reflected, at, 0).rgb;
    vec3 tint = texelFetch(reflected_tint, at, 0).rgb;
    vec3 direct;
    if ((frame.flags & FRAME_PATHS_BEND) != 0u) {
        brought += texelFetch(direct_diffuse, at, 0).rgb;
        direct = surface.emissive;
    } else {
        tint *= passed * surface_lobe_tint(surface);
        direct = first_light(surface, pixel);
    }
    vec3 mirrored = imageLoad(shaded, at).rgb;
    imageStore(shaded, at, vec4(passed * direct + tint * brought + mirrored, 1.0));
}
