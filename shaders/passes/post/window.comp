// Pass window: what the user interface shows. In: `display` (linear), the selection as a bit set by instance slot, gbuffer_id.
// Out: `window`, encoded for the UI's shader (lib/color.glsl), with a line around what is selected.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "lib/color.glsl"

layout(set = 1, binding = 0) uniform texture2D display;
layout(set = 1, binding = 1) uniform utexture2D gbuffer_id;
layout(set = 1, binding = 2, rgba16f) uniform writeonly image2D window;

const float OUTLINE_PX = 2.0;
const int REACH_PX = 3;
const vec3 OUTLINE_SRGB = vec3(1.0, 0.55, 0.1);

bool is_selected(Frame frame, uint instance_id) {
    uint slot = instance_id - 1u;
    if (instance_id == 0u || slot >= frame.selection_count) {
        return false;
    }
    return (UintTable(frame.selection).at[slot >> 5u] >> (slot & 31u) & 1u) != 0u;
}

// How much of the line covers a pixel. The ids were sampled beside the pixel centres, by the jitter: distances to where they were sampled keep the
// line still while the jitter changes.
float outline_coverage(Frame frame, ivec2 at) {
    if (frame.selection == 0ul || is_selected(frame, texelFetch(gbuffer_id, at, 0).x)) {
        return 0.0;
    }
    float nearest = OUTLINE_PX + 1.0;
    for (int y = -REACH_PX; y <= REACH_PX; ++y) {
        for (int x = -REACH_PX; x <= REACH_PX; ++x) {
            ivec2 p = at + ivec2(x, y);
            if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.extent_px)))) {
                continue;
            }
            float distance_px = length(vec2(x, y) + frame.jitter_px);
            if (distance_px < nearest && is_selected(frame, texelFetch(gbuffer_id, p, 0).x)) {
                nearest = distance_px;
            }
        }
    }
    return clamp(OUTLINE_PX + 0.5 - nearest, 0.0, 1.0);
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    vec3 shown = mix(texelFetch(display, at, 0).rgb, srgb_decode(OUTLINE_SRGB), outline_coverage(frame, at));
    imageStore(window, at, vec4(window_encode(shown), 1.0));
}
