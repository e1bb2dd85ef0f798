// Pass denoise, one of its a-trous steps. In: the signals with their variance in a; push.argument0: pixels between taps. Out: the same, smoother.
// A 5x5 B3 spline whose taps count as far as they show the same surface, and differ no more than the noise does (Dammertz et al., "Edge-Avoiding
// A-Trous Wavelet Transform", HPG 2010; weights of Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, section 4.4).
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/denoise/signals.glsl"

// Taps differ by the noise when their luminance differs by this many standard deviations.
const float DEVIATIONS = 4.0;
// And by this share of the luminance: where no noise is left, rounding is.
const float LEAST_SHARE = 1e-3;
const float SPLINE[3] = float[3](3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0);

struct Sum {
    vec4 value;
    float weight;
};

// What the pixels around say, of diffuse, specular and reflected light.
struct Around {
    vec3 variance;      // blurred over 3x3: that of one pixel is too uncertain to be compared by
    vec3 luminance;     // of the pixel, no further out than its neighbours: a lone bright pixel is not what others are compared with
};

vec3 luminances(Signals signals) {
    return vec3(luminance(signals.diffuse.rgb), luminance(signals.specular.rgb), luminance(signals.reflected.rgb));
}

Around look_around(Frame frame, ivec2 at, Place place, Signals centre) {
    vec3 variance = 0.25 * vec3(centre.diffuse.a, centre.specular.a, centre.reflected.a);
    float total = 0.25;
    vec3 least = vec3(FLOAT_MAX);
    vec3 most = vec3(0.0);
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
        least = min(least, luminances(signals));
        most = max(most, luminances(signals));
    }
    vec3 own = luminances(centre);
    return Around(variance / total, total > 0.25 ? clamp(own, least, most) : own);
}

void add_tap(inout Sum sum, vec4 value, float expected, float deviation, float weight) {
    float off = abs(luminance(value.rgb) - expected);
    weight *= exp(-off / (DEVIATIONS * deviation + LEAST_SHARE * expected + 1e-30));
    sum.value += vec4(weight * value.rgb, weight * weight * value.a);
    sum.weight += weight;
}

vec4 result(Sum sum, vec4 centre) {
    return sum.weight > 0.0 ? vec4(sum.value.rgb / sum.weight, sum.value.a / (sum.weight * sum.weight)) : centre;
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
        store(frame, at, centre);
        return;
    }
    Around around = look_around(frame, at, place, centre);
    vec3 deviation = sqrt(around.variance);
    const Sum nothing = Sum(vec4(0.0), 0.0);
    Sum diffuse = nothing;
    Sum specular = nothing;
    Sum brought = nothing;
    int apart_px = int(push.argument0);
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
            add_tap(diffuse, tap.diffuse, around.luminance.x, deviation.x, same.x);
            add_tap(specular, tap.specular, around.luminance.y, deviation.y, same.x);
            add_tap(brought, tap.reflected, around.luminance.z, deviation.z, same.y);
        }
    }
    store(frame, at, Signals(result(diffuse, centre.diffuse), result(specular, centre.specular), result(brought, centre.reflected)));
}
