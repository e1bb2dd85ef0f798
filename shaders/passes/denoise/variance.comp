// Pass denoise, first step: how noisy each signal is. In: the history of pass temporal and the moments of its luminance. Out: the guide, the signals, the variance
// of their luminance in a: that of single samples over the number of frames; while those are few, of single samples around
// (after Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, section 4.2).
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/denoise/signals.glsl"

layout(set = 1, binding = 11) uniform texture2D moments; // of diffuse and of specular light; those of reflected light are in image_of_surface.xy

// Up to this many frames, single samples vary as they do among the neighbours: pixels that met no light yet do not know of their noise.
const float FEW_FRAMES = 16.0;
const int REACH = 3;
// Variance is raised where it is this many times the square of the mean, and by how much at the most.
const float SPIKY = 4.0;
const float MOST_SPIKY = 16.0;

// Mean and mean square of the luminance of single samples: diffuse, specular, reflected.
struct Spread {
    vec3 mean;
    vec3 mean_of_squares;
};

Spread spread_at(ivec2 p) {
    vec4 direct = texelFetch(moments, p, 0);
    vec2 brought = HAS_REFLECTED ? texelFetch(image_of_surface, p, 0).xy : vec2(0.0);
    return Spread(vec3(direct.xz, brought.x), vec3(direct.yw, brought.y));
}

Spread spread_among_neighbours(Frame frame, ivec2 at) {
    Place place = place_at(frame, at);
    Spread sum = Spread(vec3(0.0), vec3(0.0));
    vec3 total = vec3(0.0);
    for (int y = -REACH; y <= REACH; ++y) {
        for (int x = -REACH; x <= REACH; ++x) {
            ivec2 p = at + ivec2(x, y);
            if (!inside(frame, p)) {
                continue;
            }
            vec3 weight = edge_weights(place, p, ivec2(x, y)).xxy;
            Spread spread = spread_at(p);
            sum.mean += weight * spread.mean;
            sum.mean_of_squares += weight * spread.mean_of_squares;
            total += weight;
        }
    }
    total = max(total, vec3(1e-6));
    return Spread(sum.mean / total, sum.mean_of_squares / total);
}

// Luminances blurred over 5x5 pixels of the surface. Single samples would be no guide: the bright and rare ones differ from all around by more than
// the noise that those know of, and none would take their light.
vec3 guide_at(Frame frame, ivec2 at, uvec2 id) {
    vec3 sum = vec3(0.0);
    float total = 0.0;
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            ivec2 p = at + ivec2(x, y);
            if (inside(frame, p) && texelFetch(gbuffer_id, p, 0).xw == id) {
                float weight = SPLINE[abs(x)] * SPLINE[abs(y)];
                sum += weight * luminances(signals_at(frame, p));
                total += weight;
            }
        }
    }
    return sum / total;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    uvec4 id = texelFetch(gbuffer_id, at, 0);
    if (id.x == 0u) {
        imageStore(out_guide, at, vec4(0.0));
        store(frame, at, Signals(vec4(0.0), vec4(0.0), vec4(0.0)));
        return;
    }
    Signals signals = signals_at(frame, at);
    vec3 frames = vec3(signals.diffuse.a, signals.specular.a, signals.reflected.a);
    Spread spread = spread_at(at);
    bvec3 few = lessThan(frames, vec3(FEW_FRAMES));
    if (any(few)) {
        Spread around = spread_among_neighbours(frame, at);
        spread.mean = mix(spread.mean, around.mean, few);
        spread.mean_of_squares = mix(spread.mean_of_squares, around.mean_of_squares, few);
    }
    vec3 variance = max(spread.mean_of_squares - spread.mean * spread.mean, vec3(0.0)) / max(frames, vec3(1.0));
    // Where few samples bring most of the light, each differs from all others by more than deviations tell, and must not be left out for it.
    variance *= clamp(variance / max(SPIKY * spread.mean * spread.mean, vec3(1e-30)), vec3(1.0), vec3(MOST_SPIKY));
    signals.diffuse.a = variance.x;
    signals.specular.a = variance.y;
    signals.reflected.a = variance.z;
    store(frame, at, signals);
    imageStore(out_guide, at, vec4(guide_at(frame, at, id.xw), 0.0));
}
