// The picture as a display shows it, shared by post and non_finite. In: the accumulator, or `shaded` while moving. Out: linear Rec.709, 0..1.
#ifndef PASS_POST_RADIANCE
#define PASS_POST_RADIANCE

#include "shared/frame.glsl"
#include "lib/tone_map.glsl"
#include "lib/vector.glsl"

layout(set = 1, binding = 0) uniform texture2D shaded;

// What is shown is this frame's sample, not the mean.
bool shows_sample(Frame frame) {
    return (frame.flags & FRAME_MOVING) != 0u || frame.accumulator == 0ul;
}

// A + B; w: samples that were finite.
vec4 accumulated_sum(Frame frame, uvec2 pixel) {
    AccumulatorPixel sums = AccumulatorTable(frame.accumulator).at[pixel.y * frame.extent_px.x + pixel.x];
    vec4 a = sums.stream[0].high + (sums.stream[0].low + sums.stream[0].block);
    vec4 b = sums.stream[1].high + (sums.stream[1].low + sums.stream[1].block);
    return a + b;
}

// (A + B) / n; black where no sample was finite.
vec3 accumulated_mean(Frame frame, uvec2 pixel) {
    vec4 sum = accumulated_sum(frame, pixel);
    return sum.w > 0.0 ? sum.rgb / sum.w : vec3(0.0);
}

vec3 display_color(Frame frame, uvec2 pixel) {
    vec3 radiance = shows_sample(frame) ? texelFetch(shaded, ivec2(pixel), 0).rgb : accumulated_mean(frame, pixel);
    vec3 exposed = max(radiance * frame.exposure, vec3(0.0));
    return is_finite(exposed) ? tone_map(exposed, frame.tone_map) : vec3(0.0);
}

#endif
