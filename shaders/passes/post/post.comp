// Pass post: from radiance to what a display shows. In: the accumulator, or `shaded` while moving. Out: `display`, linear Rec.709, 0..1.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/post/radiance.glsl"

layout(set = 1, binding = 1, rgba16f) uniform writeonly image2D display;

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    imageStore(display, ivec2(pixel), vec4(display_color(frame, pixel), 1.0));
}
