// What the accumulator holds of a pixel. Domain: linear Rec.709 radiance. Source: ARCHITECTURE, decision 6.
#ifndef LIB_ACCUMULATOR
#define LIB_ACCUMULATOR

#include "shared/frame.glsl"

// Of both streams: a sample's sum; w: samples that were finite.
struct Streams {
    vec4 a;
    vec4 b;
};

Streams streams_of(Frame frame, uvec2 pixel) {
    AccumulatorPixel sums = AccumulatorTable(frame.accumulator).at[pixel.y * frame.extent_px.x + pixel.x];
    return Streams(sums.stream[0].high + (sums.stream[0].low + sums.stream[0].block),
                   sums.stream[1].high + (sums.stream[1].low + sums.stream[1].block));
}

// (A + B) / n; black where no sample was finite.
vec3 mean_of(Streams streams) {
    vec4 sum = streams.a + streams.b;
    return sum.w > 0.0 ? sum.rgb / sum.w : vec3(0.0);
}

// Half of the difference of the means of the streams; 0 where one has no sample.
vec3 half_difference_of(Streams streams) {
    bool both = streams.a.w > 0.0 && streams.b.w > 0.0;
    return both ? 0.5 * (streams.a.rgb / streams.a.w - streams.b.rgb / streams.b.w) : vec3(0.0);
}

#endif
