// Pass post: from radiance to what a display shows. In: the accumulator, or `shaded` while moving. Out: `display`, linear Rec.709, 0..1.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "lib/tone_map.glsl"
#include "lib/vector.glsl"

layout(set = 1, binding = 0) uniform texture2D shaded;
layout(set = 1, binding = 1, rgba16f) uniform writeonly image2D display;

// (A + B) / n; black where no sample was finite.
vec3 accumulated_mean(Frame frame, uvec2 pixel) {
    AccumulatorPixel sums = AccumulatorTable(frame.accumulator).at[pixel.y * frame.extent_px.x + pixel.x];
    vec4 a = sums.stream[0].high + (sums.stream[0].low + sums.stream[0].block);
    vec4 b = sums.stream[1].high + (sums.stream[1].low + sums.stream[1].block);
    vec4 sum = a + b;
    return sum.w > 0.0 ? sum.rgb / sum.w : vec3(0.0);
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    bool from_sample = (frame.flags & FRAME_MOVING) != 0u || frame.accumulator == 0ul;
    vec3 radiance = from_sample ? texelFetch(shaded, ivec2(pixel), 0).rgb : accumulated_mean(frame, pixel);
    vec3 exposed = max(radiance * frame.exposure, vec3(0.0));
    vec3 shown = is_finite(exposed) ? tone_map(exposed, frame.tone_map) : vec3(0.0);
    imageStore(display, ivec2(pixel), vec4(shown, 1.0));
}
