// The picture as a display shows it, shared by post and non_finite. In: the accumulator, or `shaded` while moving. Out: linear Rec.709, 0..1.
#ifndef PASS_POST_RADIANCE
#define PASS_POST_RADIANCE

#include "shared/frame.glsl"
#include "lib/accumulator.glsl"
#include "lib/tone_map.glsl"
#include "lib/vector.glsl"

layout(set = 1, binding = 0) uniform texture2D shaded;

// What is shown is this frame's sample, not the mean.
bool shows_sample(Frame frame) {
    return (frame.flags & FRAME_MOVING) != 0u || frame.accumulator == 0ul;
}

vec3 display_color(Frame frame, uvec2 pixel) {
    vec3 radiance = shows_sample(frame) ? texelFetch(shaded, ivec2(pixel), 0).rgb : mean_of(streams_of(frame, pixel));
    vec3 exposed = max(radiance * frame.exposure, vec3(0.0));
    return is_finite(exposed) ? tone_map(exposed, frame.tone_map) : vec3(0.0);
}

#endif
