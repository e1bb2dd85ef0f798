// Pass error: sums of what the accumulated picture and a reference differ by, one ErrorBlock a block of 8 x 8 pixels. In: the accumulator,
// Frame.reference (0: none, and what needs one is 0). Out: Frame.error_blocks, row by row.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/accumulator.glsl"
#include "lib/relative_error.glsl"

const uint PIXELS = ERROR_BLOCK_SIDE * ERROR_BLOCK_SIDE;

shared ErrorBlock partial[PIXELS];

ErrorBlock add(ErrorBlock a, ErrorBlock b) {
    return ErrorBlock(a.sum + b.sum, a.reference_sum + b.reference_sum, a.noise + b.noise, a.noise_squares + b.noise_squares,
                      a.squared + b.squared, a.relative + b.relative, a.total + b.total, a.variance + b.variance, a.bias + b.bias,
                      a.of_means + b.of_means, max(a.largest_squared, b.largest_squared), max(a.largest_relative, b.largest_relative));
}

ErrorBlock of_pixel(Frame frame, uvec2 pixel) {
    Streams streams = streams_of(frame, pixel);
    vec3 x = mean_of(streams);
    vec3 d = half_difference_of(streams);
    float noise = relative_variance(x, d);
    ErrorBlock found = ErrorBlock(x, vec3(0.0), noise, noise * noise, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    if (frame.reference != 0ul) {
        ReferencePixel known = ReferenceTable(frame.reference).at[pixel.y * frame.extent_px.x + pixel.x];
        vec3 r = known.mean;
        vec3 e = known.half_difference;
        vec3 w = reference_weight(r);
        vec3 difference = x - r;
        found.reference_sum = r;
        found.squared = mean_of_channels(difference * difference);
        found.relative = mean_of_channels(difference * difference * w);
        found.largest_squared = found.squared;
        found.largest_relative = found.relative;
        found.total = mean_of_channels((difference * difference - e * e) * w);
        found.variance = mean_of_channels(d * d * w);
        found.bias = mean_of_channels((difference + (d - e)) * (difference - (d - e)) * w);
    }
    return found;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    uint lane = gl_LocalInvocationIndex;
    const ErrorBlock nothing = ErrorBlock(vec3(0.0), vec3(0.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    partial[lane] = nothing;
    if (all(lessThan(pixel, frame.extent_px))) {
        partial[lane] = of_pixel(frame, pixel);
    }
    for (uint half_count = PIXELS / 2u; half_count > 0u; half_count /= 2u) {
        barrier();
        if (lane < half_count) {
            partial[lane] = add(partial[lane], partial[lane + half_count]);
        }
    }
    if (lane == 0u) {
        ErrorBlock block = partial[0];
        bool whole = all(lessThanEqual((gl_WorkGroupID.xy + 1u) * ERROR_BLOCK_SIDE, frame.extent_px));
        if (whole && frame.reference != 0ul) {
            vec3 r = block.reference_sum / float(PIXELS);
            vec3 difference = block.sum / float(PIXELS) - r;
            block.of_means = mean_of_channels(difference * difference * reference_weight(r));
        }
        ErrorBlockTable(frame.error_blocks).at[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = block;
    }
}
