//! Twins of `shaders/shared/frame.glsl`, ray kinds of `rays.glsl`, bindings of set 0.

use super::Rows;

twins! {
    /// One view's constants for one frame.
    struct Frame, size 368 {
        /// Jittered, by columns; reverse depth: 1 at the near plane, 0 at infinity.
        0 clip_from_render: [f32; 16],
        /// The same without jitter.
        64 clip_from_render_unjittered: [f32; 16],
        /// Of the last frame, without jitter.
        128 previous_clip_from_render: [f32; 16],
        /// Camera space (x right, y up, looking along -z) to render space.
        192 render_from_camera: Rows,
        /// Tangents of half the angles of view (x, y); half width and height in metres when orthographic.
        240 half_extent: [f32; 2],
        /// Offset of the sample from the pixel's centre, -0.5..0.5 (x right, y down).
        248 jitter_px: [f32; 2],
        /// Size of the targets.
        256 extent_px: [u32; 2],
        /// Distance of the near plane, metres.
        264 near_m: f32,
        /// Linear factor before tone mapping.
        268 exposure: f32,
        /// Device address of [`Scene`].
        272 scene: u64,
        /// Device address of [`FrameCounters`].
        280 counters: u64,
        /// Device address of [`AccumulatorPixel`] by row; 0 in pipelines without one.
        288 accumulator: u64,
        /// Of this frame within the whole sample set.
        296 sample_index: u64,
        /// Device address of a bit set by instance slot: the outlined ones; 0: nothing is selected.
        304 selection: u64,
        /// Seed of all random numbers.
        312 seed: u32,
        /// `FRAME_*` bits.
        316 flags: u32,
        /// Lights a pixel; all of them when there are at most this many.
        320 light_samples: u32,
        /// Shadow rays a light and pixel, at least 1.
        324 shadow_rays: u32,
        /// Reflections and refractions after the first surface.
        328 max_depth: u32,
        /// `TONE_MAP_*`.
        332 tone_map: u32,
        /// Surfaces up to this roughness trace their specular lobe.
        336 reflection_roughness_max: f32,
        /// Upper bound on the history length while moving, frames.
        340 temporal_max_history: f32,
        /// Which block of its stream this sample belongs to.
        344 block_index: u32,
        /// 1 when this sample is the first of its block.
        348 block_start: u32,
        /// 1 when this sample is the last of its block.
        352 block_end: u32,
        /// Samples in the accumulator before this frame; 0: it is overwritten.
        356 accumulated: u32,
        /// Instance slots that the bit set of `selection` covers.
        360 selection_count: u32,
        /// Zero.
        364 pad0: u32,
    }

    /// What the device counts in a frame.
    struct FrameCounters, size 4 {
        /// Samples dropped because a channel was not finite.
        0 non_finite: u32,
    }

    /// One stream of one accumulated pixel; w counts the finite samples.
    struct StreamSum, size 48 {
        /// Sum of the open block.
        0 block: [f32; 4],
        /// High part of the folded blocks.
        16 high: [f32; 4],
        /// Low part of the folded blocks.
        32 low: [f32; 4],
    }

    /// One pixel of the accumulator.
    struct AccumulatorPixel, size 96 {
        /// Streams A (even samples) and B (odd samples).
        0 stream: [StreamSum; 2],
    }

    /// The push constants that all passes share.
    struct Push, size 16 {
        /// Device address of [`Frame`].
        0 frame_address: u64,
        /// Pass-specific.
        8 argument0: u32,
        /// Pass-specific.
        12 argument1: u32,
    }
}

/// [`Frame::flags`]: parallel projection.
pub const FRAME_ORTHOGRAPHIC: u32 = 1;
/// [`Frame::flags`]: post shows the denoised signals of this frame, not the accumulated mean.
pub const FRAME_MOVING: u32 = 2;
/// [`Frame::flags`]: the history belongs to the last frame and may be reprojected.
pub const FRAME_HISTORY: u32 = 4;
/// [`Frame::flags`]: shadow rays stop at refractive surfaces.
pub const FRAME_OPAQUE_GLASS: u32 = 8;

/// [`Frame::tone_map`]: clamp.
pub const TONE_MAP_LINEAR: u32 = 0;
/// [`Frame::tone_map`]: fit to the ACES reference transform.
pub const TONE_MAP_ACES: u32 = 1;
/// [`Frame::tone_map`]: approximation of AgX.
pub const TONE_MAP_AGX: u32 = 2;
/// [`Frame::tone_map`]: Khronos PBR neutral.
pub const TONE_MAP_NEUTRAL: u32 = 3;

/// Debug view ([`Push::argument0`] of the pass `show`): source = base colour target.
pub const SHOW_BASE_COLOR: u32 = 0;
/// Debug view: source_uint = normal target.
pub const SHOW_NORMAL: u32 = 1;
/// Debug view: source_uint = normal target.
pub const SHOW_GEOMETRIC_NORMAL: u32 = 2;
/// Debug view: source = depth.
pub const SHOW_DEPTH: u32 = 3;
/// Debug view: source = material target.
pub const SHOW_METALLIC: u32 = 4;
/// Debug view: source = material target.
pub const SHOW_ROUGHNESS: u32 = 5;
/// Debug view: source = motion target.
pub const SHOW_MOTION: u32 = 6;
/// Debug view: source = emissive target.
pub const SHOW_EMISSIVE: u32 = 7;
/// Debug view: source_uint = id target.
pub const SHOW_INSTANCE: u32 = 8;
/// Debug view: source = a light signal, exposed and tone mapped.
pub const SHOW_LIGHT: u32 = 9;
/// Debug view: source = a temporal history, its length is shown.
pub const SHOW_HISTORY: u32 = 10;
/// Debug view: source = base colour target.
pub const SHOW_OCCLUSION: u32 = 11;
/// Debug view: source_uint = id target.
pub const SHOW_MATERIAL: u32 = 12;
/// Debug view: source_uint = id target.
pub const SHOW_TRIANGLE: u32 = 13;

/// Hit group and miss shader of rays that look for a surface (`RAY_SURFACE`).
pub const RAY_SURFACE: u32 = 0;
/// Hit group and miss shader of rays that ask for visibility (`RAY_SHADOW`).
pub const RAY_SHADOW: u32 = 1;

/// Set 0: the TLAS.
pub const BINDING_TLAS: u32 = 0;
/// Set 0: the bindless textures.
pub const BINDING_TEXTURES: u32 = 1;
/// Set 0: the environment map.
pub const BINDING_ENVIRONMENT_MAP: u32 = 2;
