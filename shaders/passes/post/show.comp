// Pass show, in place of post: one target of the frame made visible. In: `source` or `source_uint`, which one says argument0 (SHOW_*).
// Out: `display`, linear, 0..1.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "lib/color.glsl"
#include "lib/octahedral.glsl"
#include "lib/random.glsl"
#include "lib/tone_map.glsl"
#include "lib/vector.glsl"

layout(set = 1, binding = 0) uniform texture2D source;
layout(set = 1, binding = 1) uniform utexture2D source_uint;
layout(set = 1, binding = 2, rgba16f) uniform writeonly image2D display;

// A colour per number: any hue, never dark.
vec3 id_color(uint id) {
    uvec4 h = hash_pcg4d(uvec4(id, 0u, 0u, 0u));
    return srgb_decode(0.25 + 0.75 * vec3(unit_float(h.x), unit_float(h.y), unit_float(h.z)));
}

// Directions as colours, in the usual way: (n + 1) / 2, not encoded again.
vec3 normal_color(uint encoded) {
    return encoded == OCTAHEDRAL_NONE ? vec3(0.0) : srgb_decode(0.5 * octahedral_decode(encoded) + 0.5);
}

// Grey at rest; right and down are brighter red and green; 8 pixels a frame reach full colour.
vec3 motion_color(vec2 motion_px) {
    return srgb_decode(vec3(clamp(0.5 + motion_px / 16.0, 0.0, 1.0), 0.5));
}

vec3 show_float(Frame frame, vec4 value) {
    switch (push.argument0) {
        case SHOW_DEPTH: return vec3(pow(clamp(value.r, 0.0, 1.0), 0.3)); // near / distance spans decades
        case SHOW_METALLIC: return vec3(value.r);
        case SHOW_ROUGHNESS: return vec3(value.g);
        case SHOW_MOTION: return motion_color(value.rg);
        case SHOW_EMISSIVE:
        case SHOW_LIGHT: return tone_map(max(value.rgb * frame.exposure, vec3(0.0)), frame.tone_map);
        case SHOW_HISTORY: return vec3(value.a / max(frame.temporal_max_history, 1.0));
        case SHOW_OCCLUSION: return vec3(value.a);
        default: return value.rgb;
    }
}

// Blue in front, red behind.
vec3 facing_color(bool front) {
    return front ? vec3(0.05, 0.2, 0.7) : vec3(0.7, 0.08, 0.05);
}

// One ray is the beginning of the ramp, the greatest depth its end.
vec3 depth_color(uint rays, uint max_depth) {
    return rays == 0u ? vec3(0.0) : ramp_color(float(rays - 1u) / float(max(max_depth, 2u) - 1u));
}

vec3 show_uint(Frame frame, uvec4 value) {
    switch (push.argument0) {
        case SHOW_NORMAL:
        case SHOW_GEOMETRIC_NORMAL:
            return normal_color(push.argument0 == SHOW_NORMAL ? value.x : value.y);
        case SHOW_RAY_DEPTH: return depth_color(value.x, frame.max_depth);
        default: break;
    }
    if (value.x == 0u) {
        return vec3(0.0); // background
    }
    uint primitive = hash_combine(value.x, value.y & ~GBUFFER_BACK);
    switch (push.argument0) {
        case SHOW_INSTANCE: return id_color(value.x);
        case SHOW_PRIMITIVE: return id_color(primitive);
        case SHOW_MATERIAL: return id_color(value.w);
        case SHOW_FACING: return facing_color((value.y & GBUFFER_BACK) == 0u);
        default: return id_color(hash_combine(primitive, value.z));
    }
}

bool reads_uint() {
    switch (push.argument0) {
        case SHOW_NORMAL:
        case SHOW_GEOMETRIC_NORMAL:
        case SHOW_INSTANCE:
        case SHOW_PRIMITIVE:
        case SHOW_MATERIAL:
        case SHOW_TRIANGLE:
        case SHOW_FACING:
        case SHOW_RAY_DEPTH: return true;
        default: return false;
    }
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    vec3 color = vec3(0.0);
    // A target that was left out is stood in for by one texel: what does not exist is black.
    if ((reads_uint() ? textureSize(source_uint, 0) : textureSize(source, 0)) == ivec2(frame.extent_px)) {
        color = reads_uint() ? show_uint(frame, texelFetch(source_uint, at, 0)) : show_float(frame, texelFetch(source, at, 0));
    }
    imageStore(display, at, vec4(is_finite(color) ? clamp(color, 0.0, 1.0) : vec3(1.0, 0.0, 1.0), 1.0));
}
