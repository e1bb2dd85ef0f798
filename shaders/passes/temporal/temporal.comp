// Pass temporal: direct light over time while the view moves. In: this frame's light, the last frame's history, both G-buffers' depth and normal.
// Out: the new history, its length in frames in a. The old light is taken from where the surface was, from taps that saw the same surface, and
// clamped to what its neighbours receive now. What is not finite never enters. Knows no material.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "lib/camera.glsl"
#include "lib/element.glsl"
#include "lib/octahedral.glsl"

layout(set = 1, binding = 0) uniform utexture2D gbuffer_id;
layout(set = 1, binding = 1) uniform utexture2D gbuffer_normal;
layout(set = 1, binding = 2) uniform texture2D gbuffer_motion;
layout(set = 1, binding = 3) uniform texture2D direct_diffuse;
layout(set = 1, binding = 4) uniform texture2D direct_specular;
layout(set = 1, binding = 5) uniform texture2D previous_depth;
layout(set = 1, binding = 6) uniform utexture2D previous_normal;
layout(set = 1, binding = 7) uniform texture2D previous_diffuse;
layout(set = 1, binding = 8) uniform texture2D previous_specular;
layout(set = 1, binding = 9, rgba32f) uniform writeonly image2D history_diffuse;
layout(set = 1, binding = 10, rgba32f) uniform writeonly image2D history_specular;

// Normals further apart than this belong to different surfaces (cosine of 25 degrees).
const float SAME_NORMAL = 0.906;
// The history may differ from the neighbours' mean by this many of their standard deviations.
const float CLAMP_DEVIATIONS = 2.0;
// Depths agree within the footprint of this many pixels, and of 1.5 more where the surface is seen at a slant.
const float DEPTH_PIXELS = 4.0;
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
    float count;
};

struct Reprojected {
    vec4 diffuse;       // a: history length
    vec4 specular;
    bool found;
};

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

// The pixels of 3x3 that show the same instance under a similar normal and whose light is finite.
Neighbourhood gather(Frame frame, ivec2 at, uint instance, vec3 normal) {
    Neighbourhood n = Neighbourhood(Moments(vec3(0.0), vec3(0.0)), Moments(vec3(0.0), vec3(0.0)), 0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 p = at + ivec2(x, y);
            if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.extent_px)))) {
                continue;
            }
            bool same = texelFetch(gbuffer_id, p, 0).x == instance
                && dot(octahedral_decode(texelFetch(gbuffer_normal, p, 0).x), normal) > SAME_NORMAL;
            vec3 diffuse = texelFetch(direct_diffuse, p, 0).rgb;
            vec3 specular = texelFetch(direct_specular, p, 0).rgb;
            if (same && is_finite(diffuse) && is_finite(specular)) {
                add_moment(n.diffuse, diffuse);
                add_moment(n.specular, specular);
                n.count += 1.0;
            }
        }
    }
    return n;
}

// Largest difference of reverse depth between the point seen now and a tap that shows the same surface. Perspective depth is near / distance, so
// a footprint is a share of it; orthographic depth is affine.
float depth_tolerance(Frame frame, float depth, float cosine) {
    float pixels = DEPTH_PIXELS + 1.5 / max(cosine, 0.05);
    float size = pixels * 2.0 * frame.half_extent.y / float(frame.extent_px.y);
    if ((frame.flags & FRAME_ORTHOGRAPHIC) == 0u) {
        return min(size, 0.5) * depth;
    }
    mat4 m = frame.previous_clip_from_render;
    return size * length(vec3(m[0].z, m[1].z, m[2].z));
}

// Reverse depth that the surface had in the last frame; below 0: behind the camera.
float expected_depth(Frame frame, Scene scene, uvec2 pixel, uvec4 id) {
    CameraRay ray = camera_ray(frame, camera_sample_position(frame, pixel));
    Element element = element_on_line(scene, id.x - 1u, id.y, id.z, ray.origin, ray.direction);
    vec3 position = element_previous_position(scene, id.x - 1u, id.y, element);
    vec4 clip = frame.previous_clip_from_render * vec4(position, 1.0);
    return clip.w > 0.0 ? clip.z / clip.w : -1.0;
}

// Bilinear over the taps that saw the surface.
Reprojected reproject(Frame frame, Scene scene, uvec2 pixel, uvec4 id, vec3 normal, vec3 geometric_normal) {
    Reprojected result = Reprojected(vec4(0.0), vec4(0.0), false);
    float depth = expected_depth(frame, scene, pixel, id);
    vec2 position = vec2(pixel) + 0.5 - texelFetch(gbuffer_motion, ivec2(pixel), 0).xy;
    if (depth < 0.0 || any(lessThan(position, vec2(0.0))) || any(greaterThan(position, vec2(frame.extent_px)))) {
        return result;
    }
    vec3 view = -camera_ray(frame, camera_sample_position(frame, pixel)).direction;
    float tolerance = depth_tolerance(frame, depth, abs(dot(geometric_normal, view)));
    vec2 corner = floor(position - 0.5);
    vec2 share = position - 0.5 - corner;
    float total = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 step_px = ivec2(i & 1, i >> 1);
        ivec2 p = ivec2(corner) + step_px;
        if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.extent_px)))) {
            continue;
        }
        vec2 along = mix(1.0 - share, share, vec2(step_px));
        vec4 diffuse = texelFetch(previous_diffuse, p, 0);
        vec4 specular = texelFetch(previous_specular, p, 0);
        bool same = diffuse.a > 0.0 && abs(texelFetch(previous_depth, p, 0).x - depth) <= tolerance
            && dot(octahedral_decode(texelFetch(previous_normal, p, 0).x), normal) > SAME_NORMAL;
        if (same && is_finite(diffuse) && is_finite(specular)) {
            float weight = along.x * along.y;
            result.diffuse += weight * diffuse;
            result.specular += weight * specular;
            total += weight;
        }
    }
    // A sum of weights too small to divide by belongs to taps that are nearly a whole pixel away.
    result.found = total > 1.0 / 64.0;
    if (result.found) {
        result.diffuse /= total;
        result.specular /= total;
    }
    return result;
}

// New history of one signal. `old.a`: its length, 0 for none.
vec4 blend(vec3 current, Moments neighbours, float count, vec4 old, float longest) {
    vec3 average = mean(neighbours, count);
    vec3 spread = CLAMP_DEVIATIONS * deviation(neighbours, count);
    float length_frames = min(old.a + 1.0, max(longest, 1.0));
    vec3 past = count > 1.0 ? clamp(old.rgb, average - spread, average + spread) : old.rgb;
    // A short history is mostly noise of single samples: neighbours stand in for the samples it lacks.
    float help = clamp(1.0 - (length_frames - 1.0) / SHORT_HISTORY, 0.0, 1.0);
    vec3 fresh = mix(current, average, help);
    return vec4(old.a > 0.0 ? mix(past, fresh, 1.0 / length_frames) : fresh, length_frames);
}

void store(ivec2 at, vec4 diffuse, vec4 specular) {
    imageStore(history_diffuse, at, diffuse);
    imageStore(history_specular, at, specular);
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
        store(at, vec4(0.0), vec4(0.0));
        return;
    }
    uvec2 normals = texelFetch(gbuffer_normal, at, 0).xy;
    vec3 normal = octahedral_decode(normals.x);
    Reprojected old = Reprojected(vec4(0.0), vec4(0.0), false);
    if ((frame.flags & FRAME_HISTORY) != 0u) {
        old = reproject(frame, scene, pixel, id, normal, octahedral_decode(normals.y));
    }
    Neighbourhood neighbours = gather(frame, at, id.x, normal);
    vec3 diffuse = texelFetch(direct_diffuse, at, 0).rgb;
    vec3 specular = texelFetch(direct_specular, at, 0).rgb;
    bool finite = is_finite(diffuse) && is_finite(specular);
    if (!finite) {
        atomicAdd(CounterTable(frame.counters).counters.non_finite, 1u);
    }
    if (neighbours.count == 0.0) {
        store(at, old.diffuse, old.specular); // not even this pixel is finite: keep what there was
        return;
    }
    if (!finite) {
        diffuse = mean(neighbours.diffuse, neighbours.count);
        specular = mean(neighbours.specular, neighbours.count);
    }
    store(at, blend(diffuse, neighbours.diffuse, neighbours.count, old.diffuse, frame.temporal_max_history),
        blend(specular, neighbours.specular, neighbours.count, old.specular, frame.temporal_max_history));
}
