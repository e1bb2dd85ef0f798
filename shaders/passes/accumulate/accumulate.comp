// Pass accumulate: the true mean of a still view. In: `shaded`. Out: one AccumulatorPixel a pixel, Frame.counters.
// The sample joins the open block of its stream; a full block is folded into a compensated pair, in order (ARCHITECTURE, decision 6).
// Samples with a channel that is not finite are dropped and counted: w holds the number of those that were.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "lib/vector.glsl"

layout(set = 1, binding = 0) uniform texture2D shaded;

// (high, low) + x: the sum's rounding error is exact by TwoSum (Knuth, TAOCP 2, section 4.2.2); `precise` keeps the compiler from
// simplifying it away.
void fold(inout vec4 high, inout vec4 low, vec4 x) {
    precise vec4 sum = high + x;
    precise vec4 x_part = sum - high;
    precise vec4 high_part = sum - x_part;
    precise vec4 error = (high - high_part) + (x - x_part);
    precise vec4 rest = low + error;
    precise vec4 folded = sum + rest; // fast TwoSum: |sum| >= |rest|
    precise vec4 folded_error = rest - (folded - sum);
    high = folded;
    low = folded_error;
}

StreamSum add_sample(StreamSum stream, vec4 value, Frame frame) {
    stream.block = frame.block_start != 0u ? value : stream.block + value;
    if (frame.block_end != 0u) {
        fold(stream.high, stream.low, stream.block);
        stream.block = vec4(0.0);
    }
    return stream;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    AccumulatorTable accumulator = AccumulatorTable(frame.accumulator);
    uint at = pixel.y * frame.extent_px.x + pixel.x;
    const StreamSum nothing = StreamSum(vec4(0.0), vec4(0.0), vec4(0.0));
    uint stream = uint(frame.sample_index & 1ul);
    if (frame.accumulated == 0u) {
        accumulator.at[at].stream[1u - stream] = nothing;
    }
    StreamSum sum = nothing;
    if (frame.accumulated != 0u) {
        sum = accumulator.at[at].stream[stream];
    }
    vec4 value = vec4(texelFetch(shaded, ivec2(pixel), 0).rgb, 1.0);
    if (!is_finite(value)) {
        value = vec4(0.0);
        atomicAdd(CounterTable(frame.counters).counters.non_finite, 1u);
    }
    accumulator.at[at].stream[stream] = add_sample(sum, value, frame);
}
