// One view's constants for one frame and the push constant that all passes share.
// Host twins: renderer/src/gpu_types.rs (Frame, Push).
#ifndef SHARED_FRAME
#define SHARED_FRAME

#include "shared/scene.glsl"

// Frame.flags
const uint FRAME_ORTHOGRAPHIC = 1u;
const uint FRAME_MOVING = 2u;           // show this frame, not the accumulated mean
const uint FRAME_HISTORY = 4u;          // the temporal history belongs to the last frame and may be reprojected
const uint FRAME_OPAQUE_GLASS = 8u;     // shadow rays stop at refractive surfaces (setting)
const uint FRAME_PATHS_BEND = 16u;      // shadow rays stop where paths bend or spread, which find the light by themselves (path tracer)
const uint FRAME_STEADY = 32u;          // nothing has moved since the last frame: the history is exact, and not clamped
const uint FRAME_DENOISED = 64u;        // light is kept apart, to be denoised
const uint FRAME_HALF_REFLECTIONS = 128u; // one pixel of each 2x2 traces its reflected light
const uint FRAME_SHADOWS_KNOWN = 256u;  // what shadow rays met in the frames before holds for this one

// Frame.tone_map, in the order of renderer::ToneMap.
const uint TONE_MAP_LINEAR = 0u;
const uint TONE_MAP_ACES = 1u;
const uint TONE_MAP_AGX = 2u;
const uint TONE_MAP_NEUTRAL = 3u;

// Push.argument0 of post/show.comp: the debug views. The image to bind stands behind each.
const uint SHOW_BASE_COLOR = 0u;        // source: gbuffer_base_color
const uint SHOW_NORMAL = 1u;            // source_uint: gbuffer_normal
const uint SHOW_GEOMETRIC_NORMAL = 2u;  // source_uint: gbuffer_normal
const uint SHOW_DEPTH = 3u;             // source: gbuffer_depth
const uint SHOW_METALLIC = 4u;          // source: gbuffer_material
const uint SHOW_ROUGHNESS = 5u;         // source: gbuffer_material
const uint SHOW_MOTION = 6u;            // source: gbuffer_motion
const uint SHOW_EMISSIVE = 7u;          // source: gbuffer_emissive
const uint SHOW_INSTANCE = 8u;          // source_uint: gbuffer_id
const uint SHOW_LIGHT = 9u;             // source: direct_diffuse, direct_specular or a history of them
const uint SHOW_HISTORY = 10u;          // source: history_diffuse or history_specular
const uint SHOW_OCCLUSION = 11u;        // source: gbuffer_base_color
const uint SHOW_MATERIAL = 12u;         // source_uint: gbuffer_id
const uint SHOW_TRIANGLE = 13u;         // source_uint: gbuffer_id
const uint SHOW_PRIMITIVE = 14u;        // source_uint: gbuffer_id
const uint SHOW_FACING = 15u;           // source_uint: gbuffer_id
const uint SHOW_RAY_DEPTH = 16u;        // source_uint: ray_depth
const uint SHOW_SHADOW = 17u;           // source: light_shadow
// Push.argument0 of post/show_surface.comp.
const uint SHOW_WIREFRAME = 18u;
const uint SHOW_BARYCENTRIC = 19u;

// Bit of Push.argument0 of pass light_shadow, beside the number of the light: what the image holds is forgotten.
const uint LIGHT_SHADOW_FRESH = 0x80000000u;

struct Frame {
    mat4 clip_from_render;              // jittered; reverse depth, far plane at infinity (1 at near, 0 at infinity)
    mat4 clip_from_render_unjittered;
    mat4 previous_clip_from_render;     // unjittered, of the last frame
    vec4 render_from_camera[3];         // rows
    vec2 half_extent;                   // tan of half the angles of view (x, y), or half width and height in metres
    vec2 jitter_px;                     // offset of the sample from the pixel's centre, -0.5..0.5
    uvec2 extent_px;
    float near_m;
    float exposure;                     // linear factor
    uint64_t scene;                     // SceneTable
    uint64_t counters;                  // FrameCounters
    uint64_t accumulator;               // AccumulatorTable; 0 in pipelines without one
    uint64_t sample_index;              // of this frame within the whole sample set, from --sample-offset on
    uint64_t selection;                 // UintTable: bit set by instance slot, outlined by post/window.comp; 0: nothing
    uint64_t reference;                 // ReferenceTable of the size of the picture; 0: none
    uint64_t error_blocks;              // ErrorBlockTable; 0 unless pass error runs
    uint64_t ggx_albedo;                // float[GGX_ALBEDO_SIDE squared]; 0: light is reflected once by rough surfaces (glTF to the letter)
    uint seed;
    uint flags;
    uint light_samples;                 // K: lights a pixel; all of them when there are at most K
    uint shadow_rays;                   // rays a light and pixel
    uint max_depth;                     // reflections and refractions after the first surface
    uint tone_map;
    float reflection_roughness_max;     // surfaces up to this roughness trace their specular lobe
    float temporal_max_history;         // upper bound on the history length while moving, frames
    uint block_index;                   // which block of its stream this sample belongs to (accumulator, fold order)
    uint block_start;                   // 1 when this sample is the first of its block
    uint block_end;                     // 1 when this sample is the last of its block
    uint accumulated;                   // samples in the accumulator before this frame (0: the accumulator is overwritten)
    uint selection_count;               // instance slots that the bit set covers
    uint pad0;
};

struct FrameCounters {
    uint non_finite;                    // samples dropped because a channel was not finite
    uint shadow_rays;                   // traced by pass shadow in this frame, where it leaves some out
};

// One pixel of the accumulator (ARCHITECTURE, decision 6): for each stream the float sum of the open block and the
// compensated sum of the folded blocks. w counts the samples that were finite.
struct StreamSum {
    vec4 block;
    vec4 high;
    vec4 low;
};
struct AccumulatorPixel {
    StreamSum stream[2];
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer FrameTable { Frame frame; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer CounterTable { FrameCounters counters; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer AccumulatorTable { AccumulatorPixel at[]; };

layout(push_constant, scalar) uniform Push {
    uint64_t frame_address;             // FrameTable
    uint argument0;                     // pass-specific
    uint argument1;                     // first row of a ray generation shader: a sample may be cut into bands
} push;

#endif
