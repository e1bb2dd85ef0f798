// Pass non_finite, in place of post: where samples were dropped because a channel is no number, over the picture in grey. In: the targets of the frame,
// the accumulator, which counts the samples that were finite. Out: `display`. argument0: 1 when this frame's sample is in the accumulator.
// What is wrong in this frame has the colour of the first pass that wrote it; what an earlier sample lost since the last reset is red.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/post/radiance.glsl"

layout(set = 1, binding = 1, rgba16f) uniform writeonly image2D display;
layout(set = 1, binding = 2) uniform texture2D gbuffer_base_color;
layout(set = 1, binding = 3) uniform texture2D gbuffer_material;
layout(set = 1, binding = 4) uniform texture2D gbuffer_emissive;
layout(set = 1, binding = 5) uniform texture2D direct_diffuse;
layout(set = 1, binding = 6) uniform texture2D direct_specular;

const vec3 IN_SURFACE = vec3(0.9, 0.8, 0.0);
const vec3 IN_DIRECT_LIGHT = vec3(0.9, 0.25, 0.0);
const vec3 IN_SHADING = vec3(0.9, 0.0, 0.6);
const vec3 BEFORE = vec3(0.8, 0.0, 0.0);

// A target that was left out is stood in for by one texel. A macro: drivers lose bindings that are handed to functions.
#define IS_SPOILT(target) (textureSize(target, 0) == ivec2(frame.extent_px) && !is_finite(texelFetch(target, at, 0)))

float samples_kept(Frame frame, uvec2 pixel) {
    Streams streams = streams_of(frame, pixel);
    return streams.a.w + streams.b.w;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    vec3 color = vec3(luminance(display_color(frame, pixel)));
    if (IS_SPOILT(gbuffer_base_color) || IS_SPOILT(gbuffer_material) || IS_SPOILT(gbuffer_emissive)) {
        color = IN_SURFACE;
    } else if (IS_SPOILT(direct_diffuse) || IS_SPOILT(direct_specular)) {
        color = IN_DIRECT_LIGHT;
    } else if (IS_SPOILT(shaded)) {
        color = IN_SHADING;
    } else if (!shows_sample(frame) && samples_kept(frame, pixel) < float(frame.accumulated + push.argument0)) {
        color = BEFORE;
    }
    imageStore(display, at, vec4(color, 1.0));
}
