// Pass temporal: light over time while the view moves. In: this frame's signals, the last frame's history, both G-buffers' depth and normal.
// Out: the new history, its length in frames in a; of each signal the mean and mean square of its luminance, for pass denoise. Old light is taken
// from where the surface was, what mirrors and glass show from where its image was, from taps that saw the same, and clamped to what the neighbours
// receive now. What is not finite never enters. Knows of materials whether they mirror.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "lib/camera.glsl"
#include "lib/element.glsl"
#include "lib/light_signals.glsl"
#include "lib/material.glsl"
#include "lib/octahedral.glsl"
#include "lib/reprojection.glsl"

layout(set = 1, binding = 0) uniform utexture2D gbuffer_id;
layout(set = 1, binding = 1) uniform utexture2D gbuffer_normal;
layout(set = 1, binding = 2) uniform texture2D gbuffer_motion;
layout(set = 1, binding = 3) uniform texture2D direct_diffuse;
layout(set = 1, binding = 4) uniform texture2D direct_specular;
layout(set = 1, binding = 5) uniform texture2D reflected;           // a: how far behind the surface its image is, metres; below 0: no ray
layout(set = 1, binding = 6) uniform texture2D previous_depth;
layout(set = 1, binding = 7) uniform utexture2D previous_normal;
layout(set = 1, binding = 8) uniform texture2D previous_diffuse;
layout(set = 1, binding = 9) uniform texture2D previous_specular;
layout(set = 1, binding = 10) uniform texture2D previous_reflected;
layout(set = 1, binding = 11) uniform texture2D previous_moments;
layout(set = 1, binding = 12) uniform texture2D previous_image;
layout(set = 1, binding = 13, rgba32f) uniform writeonly image2D history_diffuse;
layout(set = 1, binding = 14, rgba32f) uniform writeonly image2D history_specular;
layout(set = 1, binding = 15, rgba32f) uniform writeonly image2D history_reflected;
layout(set = 1, binding = 16, rgba32f) uniform writeonly image2D history_moments;   // of diffuse and of specular light
layout(set = 1, binding = 17, rgba32f) uniform writeonly image2D history_image;     // moments of the reflected light, reverse depth of its image

// The history may differ from the neighbours' mean by this many of their standard deviations.
const float CLAMP_DEVIATIONS = 2.0;
// Reverse depths of images agree up to this share of the larger one.
const float IMAGE_DEPTH_SHARE = 0.2;
// Images are no further away than this many times the distance of their surface: far enough for the sky.
const float IMAGE_FAR = 1e5;
// Below this length the history is helped by the neighbours' mean.
const float SHORT_HISTORY = 4.0;

// One signal of a neighbourhood.
struct Moments {
    vec3 sum;
    vec3 sum_of_squares;
};

struct Neighbourhood {
    Moments diffuse;
    Moments specular;
    Moments reflected;
    float count;
    float reflected_count;  // of pixels that traced rays
    float image_m;          // sum over those
};

// What one pixel holds of its past or present.
struct Signals {
    vec4 diffuse;       // a: history length, 0 for none
    vec4 specular;
    vec4 reflected;
    vec4 moments;       // of luminance: mean and mean square of diffuse, of specular light
    vec2 image_moments; // of reflected light
};

const Signals NO_SIGNALS = Signals(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec2(0.0));

void add_moment(inout Moments moments, vec3 value) {
    moments.sum += value;
    moments.sum_of_squares += value * value;
}

vec3 mean(Moments moments, float count) {
    return moments.sum / count;
}

vec3 deviation(Moments moments, float count) {
    vec3 average = moments.sum / count;
    return sqrt(max(moments.sum_of_squares / count - average * average, vec3(0.0)));
}

vec3 direct_specular_at(Frame frame, ivec2 at) {
    return has_specular(frame) ? texelFetch(direct_specular, at, 0).rgb : vec3(0.0);
}

// The pixels of 3x3 that show the same instance under a similar normal and whose light is finite.
Neighbourhood gather(Frame frame, ivec2 at, uint instance, vec3 normal) {
    const Moments nothing = Moments(vec3(0.0), vec3(0.0));
    Neighbourhood n = Neighbourhood(nothing, nothing, nothing, 0.0, 0.0, 0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 p = at + ivec2(x, y);
            if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.extent_px)))) {
                continue;
            }
            bool same = texelFetch(gbuffer_id, p, 0).x == instance
                && dot(octahedral_decode(texelFetch(gbuffer_normal, p, 0).x), normal) > SAME_NORMAL;
            vec3 diffuse = texelFetch(direct_diffuse, p, 0).rgb;
            vec3 specular = direct_specular_at(frame, p);
            vec4 brought = HAS_REFLECTED ? texelFetch(reflected, p, 0) : vec4(0.0);
            if (same && is_finite(diffuse) && is_finite(specular) && is_finite(brought.rgb)) {
                add_moment(n.diffuse, diffuse);
                add_moment(n.specular, specular);
                n.count += 1.0;
                if (brought.a >= 0.0) {
                    add_moment(n.reflected, brought.rgb);
                    n.image_m += brought.a;
                    n.reflected_count += 1.0;
                }
            }
        }
    }
    return n;
}

// Of the last frame, which may have had another size.
ivec2 previous_extent() {
    return textureSize(previous_normal, 0);
}

// The surface of a pixel, now and in the last frame.
struct Seen {
    vec3 position;
    vec3 previous;
    vec3 direction;     // of the camera's ray
    float distance_m;
    vec3 normal;
    vec3 geometric_normal;
};

Seen seen_at(Frame frame, Scene scene, uvec2 pixel, uvec4 id) {
    CameraRay ray = camera_ray(frame, camera_sample_position(frame, pixel));
    Element element = element_on_line(scene, id.x - 1u, id.y, id.z, ray.origin, ray.direction);
    uvec2 normals = texelFetch(gbuffer_normal, ivec2(pixel), 0).xy;
    Seen seen;
    seen.position = element_point(element).position;
    seen.previous = element_previous_position(scene, id.x - 1u, id.y, element);
    seen.direction = ray.direction;
    seen.distance_m = length(seen.position - ray.origin);
    seen.normal = octahedral_decode(normals.x);
    seen.geometric_normal = octahedral_decode(normals.y);
    return seen;
}

// Four taps around a position in the last frame; share: bilinear weights of the right and lower ones.
struct Taps {
    ivec2 corner;
    vec2 share;
    bool inside;
};

// `position`: in pixels of this frame.
Taps taps_at(Frame frame, vec2 position) {
    vec2 extent = vec2(previous_extent());
    position *= extent / vec2(frame.extent_px);
    vec2 corner = floor(position - 0.5);
    bool inside = all(greaterThanEqual(position, vec2(0.0))) && all(lessThanEqual(position, extent));
    return Taps(ivec2(corner), position - 0.5 - corner, inside);
}

// The tap's weight, 0 outside of the image and where another direction was seen.
float tap_weight(Frame frame, Taps taps, int i, vec3 normal, out ivec2 p) {
    ivec2 step_px = ivec2(i & 1, i >> 1);
    p = taps.corner + step_px;
    if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, previous_extent()))) {
        return 0.0;
    }
    vec2 along = mix(1.0 - taps.share, taps.share, vec2(step_px));
    return dot(octahedral_decode(texelFetch(previous_normal, p, 0).x), normal) > SAME_NORMAL ? along.x * along.y : 0.0;
}

// A sum of weights too small to divide by belongs to taps that are nearly a whole pixel away.
const float LEAST_WEIGHT = 1.0 / 64.0;

// Light where the surface was: bilinear over the taps that saw it. with_reflected: reflected light too, where its image has no place of its own.
void reproject_surface(Frame frame, uvec2 pixel, Seen seen, bool with_reflected, inout Signals old) {
    vec4 clip = frame.previous_clip_from_render * vec4(seen.previous, 1.0);
    Taps taps = taps_at(frame, vec2(pixel) + 0.5 - texelFetch(gbuffer_motion, ivec2(pixel), 0).xy);
    if (clip.w <= 0.0 || !taps.inside) {
        return;
    }
    float depth = clip.z / clip.w;
    float tolerance = depth_tolerance(frame, previous_extent(), depth, abs(dot(seen.geometric_normal, seen.direction)));
    Signals sum = NO_SIGNALS;
    float total = 0.0;
    float reflected_total = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 p;
        float weight = tap_weight(frame, taps, i, seen.normal, p);
        if (weight == 0.0 || abs(texelFetch(previous_depth, p, 0).x - depth) > tolerance) {
            continue;
        }
        vec4 diffuse = texelFetch(previous_diffuse, p, 0);
        vec4 specular = has_specular(frame) ? texelFetch(previous_specular, p, 0) : vec4(0.0);
        if (diffuse.a > 0.0 && is_finite(diffuse) && is_finite(specular)) {
            sum.diffuse += weight * diffuse;
            sum.specular += weight * specular;
            sum.moments += weight * texelFetch(previous_moments, p, 0);
            total += weight;
        }
        vec4 light = with_reflected ? texelFetch(previous_reflected, p, 0) : vec4(0.0);
        if (light.a > 0.0 && is_finite(light)) {
            sum.reflected += weight * light;
            sum.image_moments += weight * texelFetch(previous_image, p, 0).xy;
            reflected_total += weight;
        }
    }
    if (reflected_total > LEAST_WEIGHT) {
        old.reflected = sum.reflected / reflected_total;
        old.image_moments = sum.image_moments / reflected_total;
    }
    if (total > LEAST_WEIGHT) {
        old.diffuse = sum.diffuse / total;
        old.specular = sum.specular / total;
        old.moments = sum.moments / total;
    }
}

// The image behind the surface: a mirror's lies on the straight line behind it, and so does what a sheet of glass shows; what curved surfaces show is
// elsewhere, and found by its depth or taken to move with the surface.
vec3 image_position(Seen seen, float image_m) {
    return seen.position + seen.direction * min(image_m, IMAGE_FAR * seen.distance_m);
}

float image_depth(Frame frame, Seen seen, float image_m) {
    vec4 clip = frame.clip_from_render_unjittered * vec4(image_position(seen, image_m), 1.0);
    return clip.w > 0.0 ? clip.z / clip.w : 0.0;
}

// Reflected light where its image was, from taps whose image was as far away.
void reproject_image(Frame frame, uvec2 pixel, Seen seen, float image_m, inout Signals old) {
    vec3 now = image_position(seen, image_m);
    // An image moves with its surface only as far as the surface is all there is of it.
    vec3 moved = image_m > 0.0 ? vec3(0.0) : seen.previous - seen.position;
    vec4 clip = frame.previous_clip_from_render * vec4(now + moved, 1.0);
    vec2 motion = camera_motion(frame, frame.clip_from_render_unjittered * vec4(now, 1.0), clip);
    Taps taps = taps_at(frame, vec2(pixel) + 0.5 - motion);
    if (clip.w <= 0.0 || !taps.inside) {
        return;
    }
    float depth = clip.z / clip.w;
    vec4 sum = vec4(0.0);
    vec2 moments = vec2(0.0);
    float total = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 p;
        float weight = tap_weight(frame, taps, i, seen.normal, p);
        vec4 image = weight > 0.0 ? texelFetch(previous_image, p, 0) : vec4(0.0);
        vec4 light = weight > 0.0 ? texelFetch(previous_reflected, p, 0) : vec4(0.0);
        if (light.a > 0.0 && is_finite(light) && abs(image.z - depth) <= IMAGE_DEPTH_SHARE * max(image.z, depth)) {
            sum += weight * light;
            moments += weight * image.xy;
            total += weight;
        }
    }
    if (total > LEAST_WEIGHT) {
        old.reflected = sum / total;
        old.image_moments = moments / total;
    }
}

// New history of one signal. `old.a`: its length, 0 for none.
vec4 blend(Frame frame, vec3 current, Moments neighbours, float count, vec4 old) {
    vec3 average = mean(neighbours, max(count, 1.0));
    vec3 spread = CLAMP_DEVIATIONS * deviation(neighbours, max(count, 1.0));
    float length_frames = min(old.a + 1.0, max(frame.temporal_max_history, 1.0));
    bool clamps = count > 1.0 && (frame.flags & FRAME_STEADY) == 0u;
    vec3 past = clamps ? clamp(old.rgb, average - spread, average + spread) : old.rgb;
    // A short history is mostly noise of single samples: neighbours stand in for the samples it lacks, unless the filter over space follows.
    float help = push.argument0 != 0u || count < 1.0 ? 0.0 : clamp(1.0 - (length_frames - 1.0) / SHORT_HISTORY, 0.0, 1.0);
    vec3 fresh = mix(current, average, help);
    return vec4(old.a > 0.0 ? mix(past, fresh, 1.0 / length_frames) : fresh, length_frames);
}

vec2 blend_moments(vec3 current, vec2 old, float length_frames) {
    float l = luminance(current);
    return mix(old, vec2(l, l * l), 1.0 / max(length_frames, 1.0));
}

void store(Frame frame, ivec2 at, Signals light, float depth) {
    imageStore(history_diffuse, at, light.diffuse);
    if (has_specular(frame)) {
        imageStore(history_specular, at, light.specular);
    }
    if (HAS_REFLECTED) {
        imageStore(history_reflected, at, light.reflected);
        imageStore(history_image, at, vec4(light.image_moments, depth, 0.0));
    }
    if (push.argument0 != 0u) {
        imageStore(history_moments, at, light.moments);
    }
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    uvec4 id = texelFetch(gbuffer_id, at, 0);
    if (id.x == 0u) {
        store(frame, at, NO_SIGNALS, 0.0);
        return;
    }
    Seen seen = seen_at(frame, scene, pixel, id);
    Neighbourhood neighbours = gather(frame, at, id.x, seen.normal);
    vec4 brought = HAS_REFLECTED ? texelFetch(reflected, at, 0) : vec4(0.0);
    bool traced = brought.a >= 0.0;
    if (!traced) {
        // Another pixel's turn: the neighbours that had theirs stand in.
        float count = max(neighbours.reflected_count, 1.0);
        brought = vec4(neighbours.reflected.sum, neighbours.image_m) / count;
    }
    Signals old = NO_SIGNALS;
    if ((frame.flags & FRAME_HISTORY) != 0u) {
        // What bends or spreads an image gives it no place that could be found again; a mirror's is exact while nothing moves.
        bool mirror = material_is_mirror(MaterialTable(scene.materials).at[id.w]);
        reproject_surface(frame, pixel, seen, HAS_REFLECTED && (!mirror || (frame.flags & FRAME_STEADY) != 0u), old);
        if (HAS_REFLECTED) {
            reproject_image(frame, pixel, seen, brought.a, old);
        }
    }
    float depth = image_depth(frame, seen, brought.a);
    vec3 diffuse = texelFetch(direct_diffuse, at, 0).rgb;
    vec3 specular = direct_specular_at(frame, at);
    bool finite = is_finite(diffuse) && is_finite(specular) && is_finite(brought.rgb);
    if (!finite) {
        atomicAdd(CounterTable(frame.counters).counters.non_finite, 1u);
    }
    if (neighbours.count == 0.0) {
        store(frame, at, old, depth); // not even this pixel is finite: keep what there was
        return;
    }
    if (!finite) {
        diffuse = mean(neighbours.diffuse, neighbours.count);
        specular = mean(neighbours.specular, neighbours.count);
        brought.rgb = mean(neighbours.reflected, max(neighbours.reflected_count, 1.0));
    }
    Signals light;
    light.diffuse = blend(frame, diffuse, neighbours.diffuse, neighbours.count, old.diffuse);
    light.specular = blend(frame, specular, neighbours.specular, neighbours.count, old.specular);
    light.reflected = blend(frame, brought.rgb, neighbours.reflected, neighbours.reflected_count, old.reflected);
    light.moments.xy = blend_moments(diffuse, old.moments.xy, light.diffuse.a);
    light.moments.zw = blend_moments(specular, old.moments.zw, light.specular.a);
    light.image_moments = blend_moments(brought.rgb, old.image_moments, light.reflected.a);
    if (!traced && old.reflected.a > 0.0) {
        light.reflected = old.reflected; // its own past is nearer than what stands in
        light.image_moments = old.image_moments;
    }
    store(frame, at, light, depth);
}
