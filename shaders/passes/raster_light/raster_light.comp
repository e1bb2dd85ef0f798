// Pass raster_light: the direct light of pass shadow without rays: every light is visible, the environment is dimmed by occlusion textures.
// In: the G-buffer, the light tables. Out: direct_diffuse, direct_specular.
#version 460
#extension GL_GOOGLE_include_directive : require
#define LIGHT_WITHOUT_RAYS

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/shadow/light_pixel.glsl"

vec3 light_visibility(Scene scene, vec3 origin, vec3 direction, float t_max_m, uint medium, uint seed) {
    return vec3(1.0);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (all(lessThan(pixel, FrameTable(push.frame_address).frame.extent_px))) {
        light_pixel(pixel);
    }
}
