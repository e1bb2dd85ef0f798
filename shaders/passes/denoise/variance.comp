// Pass denoise, first step: how noisy each signal is. In: the history of pass temporal and the moments of its luminance. Out: the signals, the variance
// of their luminance in a: that of single samples over the number of frames, or, while those are few, the spread among neighbours
// (Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, section 4.2).
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/denoise/signals.glsl"

layout(set = 1, binding = 10) uniform texture2D moments; // of diffuse and of specular light; those of reflected light are in image_of_surface.xy

// Below this many frames the neighbours tell more.
const float FEW_FRAMES = 4.0;
const int REACH = 3;

struct Spread {
    vec3 weight;    // of diffuse, specular, reflected
    vec3 mean;
    vec3 mean_of_squares;
};

vec3 luminances(Signals signals) {
    return vec3(luminance(signals.diffuse.rgb), luminance(signals.specular.rgb), luminance(signals.reflected.rgb));
}

vec3 spread_among_neighbours(Frame frame, ivec2 at) {
    Place place = place_at(frame, at);
    Spread spread = Spread(vec3(0.0), vec3(0.0), vec3(0.0));
    for (int y = -REACH; y <= REACH; ++y) {
        for (int x = -REACH; x <= REACH; ++x) {
            ivec2 p = at + ivec2(x, y);
            if (!inside(frame, p)) {
                continue;
            }
            vec3 weight = edge_weights(place, p, ivec2(x, y)).xxy;
            vec3 l = luminances(signals_at(frame, p));
            spread.weight += weight;
            spread.mean += weight * l;
            spread.mean_of_squares += weight * l * l;
        }
    }
    vec3 total = max(spread.weight, vec3(1e-6));
    vec3 mean = spread.mean / total;
    return max(spread.mean_of_squares / total - mean * mean, vec3(0.0));
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    if (texelFetch(gbuffer_id, at, 0).x == 0u) {
        store(frame, at, Signals(vec4(0.0), vec4(0.0), vec4(0.0)));
        return;
    }
    Signals signals = signals_at(frame, at);
    vec3 frames = vec3(signals.diffuse.a, signals.specular.a, signals.reflected.a);
    vec4 direct = texelFetch(moments, at, 0);
    vec2 brought = HAS_REFLECTED ? texelFetch(image_of_surface, at, 0).xy : vec2(0.0);
    vec3 mean = vec3(direct.xz, brought.x);
    vec3 variance = max(vec3(direct.yw, brought.y) - mean * mean, vec3(0.0)) / max(frames, vec3(1.0));
    if (any(lessThan(frames, vec3(FEW_FRAMES)))) {
        variance = mix(variance, spread_among_neighbours(frame, at), lessThan(frames, vec3(FEW_FRAMES)));
    }
    signals.diffuse.a = variance.x;
    signals.specular.a = variance.y;
    signals.reflected.a = variance.z;
    store(frame, at, signals);
}
