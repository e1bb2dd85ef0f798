// Pass denoise, one of its a-trous steps. In: the signals with their variance in a, their guide; push.argument0: pixels between taps. Out: the same,
// smoother.
// A 5x5 B3 spline whose taps count as far as they show the same surface, and differ no more than the noise does (Dammertz et al., "Edge-Avoiding
// A-Trous Wavelet Transform", HPG 2010; weights of Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, section 4.4).
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/denoise/signals.glsl"

layout(set = 1, binding = 11) uniform texture2D in_guide;

// Taps differ by the noise when their guide differs by this many standard deviations of single pixels, which vary 3.7 times as much as a mean over
// 5x5. The first step smooths the pixels more than the guide, which is smooth already.
const float DEVIATIONS = 1.5;
const float DEVIATIONS_FIRST = 0.7;
// And by this share of the luminance: where no noise is left, rounding is.
const float LEAST_SHARE = 1e-3;

struct Sum {
    vec4 value;
    float guide;
    float weight;
};

// Blurred over 3x3: that of one pixel is too uncertain to be compared by.
vec3 variance_around(Frame frame, ivec2 at, Place place, Signals centre) {
    vec3 variance = 0.25 * vec3(centre.diffuse.a, centre.specular.a, centre.reflected.a);
    float total = 0.25;
    for (int i = 0; i < 9; ++i) {
        ivec2 offset = ivec2(i % 3, i / 3) - 1;
        ivec2 p = at + offset;
        if (i == 4 || !inside(frame, p) || texelFetch(gbuffer_id, p, 0).xw != place.id) {
            continue;
        }
        Signals signals = signals_at(frame, p);
        float weight = offset.x == 0 || offset.y == 0 ? 0.125 : 0.0625;
        variance += weight * vec3(signals.diffuse.a, signals.specular.a, signals.reflected.a);
        total += weight;
    }
    return variance / total;
}

// By the noise of both, alike from either side: a bright, rare sample knows of its own, those around it may not.
void add_tap(inout Sum sum, vec4 value, float guide, float expected, float variance, float deviations, float weight) {
    float deviation = sqrt(0.5 * (variance + value.a));
    weight *= exp(-abs(guide - expected) / (deviations * deviation + LEAST_SHARE * expected + 1e-30));
    sum.value += vec4(weight * value.rgb, weight * weight * value.a);
    sum.guide += weight * guide;
    sum.weight += weight;
}

vec4 result(Sum sum, vec4 centre) {
    return sum.weight > 0.0 ? vec4(sum.value.rgb / sum.weight, sum.value.a / (sum.weight * sum.weight)) : centre;
}

float guide_of(Sum sum, float centre) {
    return sum.weight > 0.0 ? sum.guide / sum.weight : centre;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    Signals centre = signals_at(frame, at);
    Place place = place_at(frame, at);
    if (place.id.x == 0u) {
        imageStore(out_guide, at, vec4(0.0));
        store(frame, at, centre);
        return;
    }
    vec3 variance = variance_around(frame, at, place, centre);
    vec3 expected = texelFetch(in_guide, at, 0).rgb;
    const Sum nothing = Sum(vec4(0.0), 0.0, 0.0);
    Sum diffuse = nothing;
    Sum specular = nothing;
    Sum brought = nothing;
    int apart_px = int(push.argument0);
    float deviations = apart_px == 1 ? DEVIATIONS_FIRST : DEVIATIONS;
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            ivec2 offset = ivec2(x, y) * apart_px;
            if (!inside(frame, at + offset)) {
                continue;
            }
            vec2 same = edge_weights(place, at + offset, offset) * (SPLINE[abs(x)] * SPLINE[abs(y)]);
            if (same.x <= 0.0) {
                continue;
            }
            Signals tap = signals_at(frame, at + offset);
            vec3 guide = texelFetch(in_guide, at + offset, 0).rgb;
            add_tap(diffuse, tap.diffuse, guide.x, expected.x, variance.x, deviations, same.x);
            add_tap(specular, tap.specular, guide.y, expected.y, variance.y, deviations, same.x);
            add_tap(brought, tap.reflected, guide.z, expected.z, variance.z, deviations, same.y);
        }
    }
    vec3 guide = vec3(guide_of(diffuse, expected.x), guide_of(specular, expected.y), guide_of(brought, expected.z));
    imageStore(out_guide, at, vec4(guide, 0.0));
    store(frame, at, Signals(result(diffuse, centre.diffuse), result(specular, centre.specular), result(brought, centre.reflected)));
}
