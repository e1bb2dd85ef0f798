// Pass error_map, in place of post: how far each pixel is from the truth, in logarithms. In: the accumulator, Frame.reference. Out: `display`.
// argument0: 0 noise, which the streams tell, 1 the difference from the reference; without one that is black.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/accumulator.glsl"
#include "lib/color.glsl"
#include "lib/relative_error.glsl"
#include "lib/vector.glsl"

layout(set = 1, binding = 0, rgba16f) uniform writeonly image2D display;

// The ramp goes from 0.1 % to 100 %.
const float DECADES = 3.0;

vec3 error_color(float relative_mse) {
    return ramp_color(0.5 * log2(max(relative_mse, 1e-20)) / log2(10.0) / DECADES + 1.0);
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    vec3 color = vec3(0.0);
    bool against_reference = push.argument0 != 0u;
    if (frame.accumulator != 0ul && (!against_reference || frame.reference != 0ul)) {
        Streams streams = streams_of(frame, pixel);
        vec3 mean = mean_of(streams);
        float relative_mse = relative_variance(mean, half_difference_of(streams));
        if (against_reference) {
            vec3 r = ReferenceTable(frame.reference).at[pixel.y * frame.extent_px.x + pixel.x].mean;
            relative_mse = mean_of_channels((mean - r) * (mean - r) * reference_weight(r));
        }
        color = is_finite(vec3(relative_mse)) ? error_color(relative_mse) : vec3(1.0, 0.0, 1.0);
    }
    imageStore(display, ivec2(pixel), vec4(color, 1.0));
}
