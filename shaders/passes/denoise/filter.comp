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

// Variance blurred over 3x3: that of one pixel is too uncertain to be compared by.
vec3 variance_around(Frame frame, ivec2 at, Place place) {
    vec3 sum = vec3(0.0);
    vec3 total = vec3(0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 p = at + ivec2(x, y);
            if (inside(frame, p) && texelFetch(gbuffer_id, p, 0).xw == place.id) {
                float weight = (x == 0 ? 0.5 : 0.25) * (y == 0 ? 0.5 : 0.25);
                Signals signals = signals_at(frame, p);
                sum += weight * vec3(signals.diffuse.a, signals.specular.a, signals.reflected.a);
                total += weight;
            }
        }
    }
    return sum / max(total, vec3(1e-6));
}

void add_tap(inout Sum sum, vec4 value, vec4 centre, float deviation, float weight) {
    float l = luminance(centre.rgb);
    float off = abs(luminance(value.rgb) - l);
    weight *= exp(-off / (DEVIATIONS * deviation + LEAST_SHARE * l + 1e-30));
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
    vec3 deviation = sqrt(variance_around(frame, at, place));
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
            add_tap(diffuse, tap.diffuse, centre.diffuse, deviation.x, same.x);
            add_tap(specular, tap.specular, centre.specular, deviation.y, same.x);
            add_tap(brought, tap.reflected, centre.reflected, deviation.z, same.y);
        }
    }
    store(frame, at, Signals(result(diffuse, centre.diffuse), result(specular, centre.specular), result(brought, centre.reflected)));
}
