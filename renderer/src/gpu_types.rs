//! Host twins of the structs and constants in `shaders/shared/`: same names, same order, scalar layout.
//! In: nothing. Out: plain-old-data types whose size and field offsets are asserted at compile time, and
//! [`twins`], the same numbers as data, for the test against SPIR-V reflection. Knows no table and no Vulkan.

use std::sync::LazyLock;

use bytemuck::{Pod, Zeroable};

/// Three rows of a 3x4 affine map: `p' = (dot(row.xyz, p) + row.w, ...)`.
pub type Rows = [[f32; 4]; 3];

/// One shared struct as data: what the layout test compares with SPIR-V reflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Twin {
    /// Name of the struct in GLSL and in Rust.
    pub name: &'static str,
    /// Size in bytes, which is also the array stride.
    pub size: usize,
    /// Fields in order: name and offset in bytes.
    pub fields: &'static [(&'static str, usize)],
}

/// Declares the twins: each field with the offset that GLSL's scalar layout gives it, asserted here.
macro_rules! twins {
    ($($(#[$meta:meta])* struct $name:ident, size $size:literal {
        $($(#[$field_meta:meta])* $offset:literal $field:ident: $type:ty,)*
    })*) => {
        $(
            $(#[$meta])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
            pub struct $name {
                $($(#[$field_meta])* pub $field: $type,)*
            }

            const _: () = {
                assert!(std::mem::size_of::<$name>() == $size);
                $(assert!(std::mem::offset_of!($name, $field) == $offset);)*
            };
        )*

        /// These structs as data.
        pub(super) const TWINS: &[Twin] = &[$(Twin {
            name: stringify!($name),
            size: $size,
            fields: &[$((stringify!($field), $offset)),*],
        }),*];
    };
}

mod constants;
mod error;
mod material;

pub use constants::*;
pub use error::{ErrorBlock, ReferencePixel};
pub use material::{Material, MaterialLobes, TextureUse};

/// Every struct shared with GLSL.
#[must_use]
pub fn twins() -> &'static [Twin] {
    static ALL: LazyLock<Vec<Twin>> = LazyLock::new(|| [TWINS, error::TWINS, material::TWINS].concat());
    &ALL
}

twins! {
    /// One instance slot: where its geometry is, and how it stands in render space (metres).
    struct Instance, size 168 {
        /// Mesh space to render space.
        0 render_from_mesh: Rows,
        /// The same in the last frame of this scene revision.
        48 previous_render_from_mesh: Rows,
        /// Rows of the cofactor matrix (xyz), scaled so that its largest entry is 1; w is unused.
        96 normal_from_mesh: Rows,
        /// Device address of `Geometry[geometry_count]`.
        144 geometries: u64,
        /// First of `geometry_count` entries of [`Scene::material_slots`].
        152 material_base: u32,
        /// Number of geometries of the mesh.
        156 geometry_count: u32,
        /// `INSTANCE_*` bits.
        160 flags: u32,
        /// Zero.
        164 pad0: u32,
    }

    /// One geometry of a mesh: a run of triangles with one material.
    struct Geometry, size 144 {
        /// Device address of `vec3[]`, 12 bytes each, primitive space in metres; or of [`Shape`] `[triangle_count]`.
        0 positions: u64,
        /// The same of the last frame; equal to `positions` unless the mesh deforms.
        8 previous_positions: u64,
        /// Device address of [`VertexAttributes`], same order.
        16 attributes: u64,
        /// Device address of `u32[]`, already moved to the first index of this geometry.
        24 indices: u64,
        /// Number of triangles, or of shapes.
        32 triangle_count: u32,
        /// `GEOMETRY_*` bits.
        36 flags: u32,
        /// Zero.
        40 pad0: u32,
        /// Zero.
        44 pad1: u32,
        /// Primitive space to mesh space.
        48 mesh_from_primitive: Rows,
        /// The same of the last frame.
        96 previous_mesh_from_primitive: Rows,
    }

    /// A sphere or a box, primitive space.
    struct Shape, size 28 {
        /// Metres.
        0 centre: [f32; 3],
        /// `SHAPE_*`.
        12 kind: u32,
        /// Metres; of a sphere the radius, three times. A size of 0: rays never meet it.
        16 half_extent: [f32; 3],
    }

    /// What a vertex carries beside its position.
    struct VertexAttributes, size 52 {
        /// Unit normal, primitive space.
        0 normal: [f32; 3],
        /// Unit tangent (xyz) and handedness (w = 1 or -1), primitive space.
        12 tangent: [f32; 4],
        /// First texture coordinate set.
        28 tex_coord0: [f32; 2],
        /// Second texture coordinate set.
        36 tex_coord1: [f32; 2],
        /// `packHalf2x16` of linear red (low) and green (high).
        44 color_rg: u32,
        /// `packHalf2x16` of linear blue (low) and alpha (high).
        48 color_ba: u32,
    }

    /// A punctual light with a size.
    struct Light, size 64 {
        /// Render space, metres (point, spot).
        0 position: [f32; 3],
        /// Radius of the emitting sphere, metres; 0: a hard shadow.
        12 radius_m: f32,
        /// Unit direction in which the light travels (spot axis, directional).
        16 direction: [f32; 3],
        /// `range` of KHR_lights_punctual, metres; 0: no limit.
        28 range_m: f32,
        /// Candela (point, spot) or lux (directional), linear RGB.
        32 intensity: [f32; 3],
        /// `LIGHT_*`.
        44 kind: u32,
        /// Cosine of the spot's inner cone angle.
        48 cos_inner: f32,
        /// Cosine of the spot's outer cone angle.
        52 cos_outer: f32,
        /// Half the angle under which a directional light is seen, radians, below pi/2.
        56 angular_radius_rad: f32,
        /// Probability of this light when one is drawn from the alias table.
        60 selection_pdf: f32,
    }

    /// One column of an alias table (Walker 1977; Vose 1991).
    struct AliasEntry, size 12 {
        /// The column itself is drawn when the second number is below this, else `alias`.
        0 threshold: f32,
        /// The other entry of the column.
        4 alias: u32,
        /// Probability of this entry in the whole table.
        8 pdf: f32,
    }

    /// A triangle whose material emits, found through the instance tables.
    struct EmissiveTriangle, size 16 {
        /// Instance slot.
        0 instance: u32,
        /// Geometry within the mesh.
        4 geometry: u32,
        /// Triangle within the geometry.
        8 primitive: u32,
        /// Zero.
        12 pad0: u32,
    }

    /// The scene's tables by device address.
    struct Scene, size 128 {
        /// [`Instance`] by slot.
        0 instances: u64,
        /// `u32[]`: material index, one per (instance, geometry).
        8 material_slots: u64,
        /// [`Material`] by index.
        16 materials: u64,
        /// [`Light`] `[light_count]`.
        24 lights: u64,
        /// [`AliasEntry`] `[light_count]`, by power.
        32 light_alias: u64,
        /// [`EmissiveTriangle`] `[emissive_count]`.
        40 emissive_triangles: u64,
        /// [`AliasEntry`] `[emissive_count]`, by area times luminance.
        48 emissive_alias: u64,
        /// [`AliasEntry`] of the environment's grid, row by row from the zenith, by radiance times solid angle.
        56 environment_alias: u64,
        /// `u32[]`: instance slots, indexed by `gl_InstanceIndex` of the raster draws.
        64 draw_instances: u64,
        /// [`MaterialLobes`] by index; 0: no material has any.
        72 material_lobes: u64,
        /// `f32[]`: share of light that sheen reflects (`tables/sheen.rs`); 0: no material has sheen.
        80 sheen_albedo: u64,
        /// Number of punctual lights.
        88 light_count: u32,
        /// Number of emissive triangles.
        92 emissive_count: u32,
        /// Columns of the environment's grid; 0: constant environment.
        96 environment_width: u32,
        /// Rows of the environment's grid.
        100 environment_height: u32,
        /// The constant radiance, or the factor on the map.
        104 environment_radiance: [f32; 3],
        /// Turn of the map around +Y, radians.
        116 environment_rotation_rad: f32,
        /// Sum of area times luminance over the emissive triangles.
        120 emissive_power: f32,
        /// Padding.
        124 pad0: u32,
    }

    /// One view's constants for one frame.
    struct Frame, size 392 {
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
        /// Device address of [`ReferencePixel`] by row, of the size of the picture; 0: there is none.
        312 reference: u64,
        /// Device address of [`ErrorBlock`] by row; 0 unless pass error runs.
        320 error_blocks: u64,
        /// Device address of the table of `lib/ggx_albedo.glsl`; 0: light is reflected once by rough surfaces.
        328 ggx_albedo: u64,
        /// Seed of all random numbers.
        336 seed: u32,
        /// `FRAME_*` bits.
        340 flags: u32,
        /// Lights a pixel; all of them when there are at most this many.
        344 light_samples: u32,
        /// Shadow rays a light and pixel, at least 1.
        348 shadow_rays: u32,
        /// Reflections and refractions after the first surface.
        352 max_depth: u32,
        /// `TONE_MAP_*`.
        356 tone_map: u32,
        /// Surfaces up to this roughness trace their specular lobe.
        360 reflection_roughness_max: f32,
        /// Upper bound on the history length while moving, frames.
        364 temporal_max_history: f32,
        /// Which block of its stream this sample belongs to.
        368 block_index: u32,
        /// 1 when this sample is the first of its block.
        372 block_start: u32,
        /// 1 when this sample is the last of its block.
        376 block_end: u32,
        /// Samples in the accumulator before this frame; 0: it is overwritten.
        380 accumulated: u32,
        /// Instance slots that the bit set of `selection` covers.
        384 selection_count: u32,
        /// Zero.
        388 pad0: u32,
    }

    /// What the device counts in a frame.
    struct FrameCounters, size 8 {
        /// Samples dropped because a channel was not finite.
        0 non_finite: u32,
        /// Rays that pass shadow traced in this frame, where it leaves some out.
        4 shadow_rays: u32,
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

    /// What pass `deform` makes of one instance.
    struct DeformJob, size 72 {
        /// Positions of the mesh at rest.
        0 rest_positions: u64,
        /// [`VertexAttributes`] of the mesh at rest.
        8 rest_attributes: u64,
        /// [`JointInfluences`] a vertex; 0: no joint moves it.
        16 influences: u64,
        /// [`Rows`] a joint, mesh space at rest to mesh space as posed.
        24 joints: u64,
        /// [`MorphUse`] `[target_count]`.
        32 targets: u64,
        /// Positions of the last evaluation, then of this one.
        40 positions: u64,
        /// Takes over what `positions` held; 0: not wanted.
        48 previous_positions: u64,
        /// [`VertexAttributes`] as posed.
        56 attributes: u64,
        /// Number of vertices.
        64 vertex_count: u32,
        /// Number of targets with a weight.
        68 target_count: u32,
    }

    /// A morph target with its weight; a list whose address is 0 holds no offsets.
    struct MorphUse, size 32 {
        /// `vec3` a vertex.
        0 positions: u64,
        /// `vec3` a vertex.
        8 normals: u64,
        /// `vec3` a vertex.
        16 tangents: u64,
        /// Multiplies the offsets.
        24 weight: f32,
        /// Zero.
        28 pad0: u32,
    }

    /// The joints that move a vertex, the heaviest first.
    struct JointInfluences, size 24 {
        /// Joints 0 (low half) and 1.
        0 joints_01: u32,
        /// Joints 2 (low half) and 3.
        4 joints_23: u32,
        /// Weights in sum 1; all 0: the vertex stays where it is.
        8 weights: [f32; 4],
    }

    /// One geometry of a BLAS whose surface is measured.
    struct SurfaceJob, size 24 {
        /// Its [`Geometry`].
        0 geometry: u64,
        /// `f32` a cluster: square metres, mesh space.
        8 surfaces: u64,
        /// Number of clusters of [`CLUSTER_TRIANGLES`].
        16 cluster_count: u32,
        /// Zero.
        20 pad0: u32,
    }

    /// One geometry of a mesh of shapes whose boxes are made.
    struct ShapeBoxJob, size 24 {
        /// Its [`Geometry`].
        0 geometry: u64,
        /// [`ShapeBox`] a shape.
        8 boxes: u64,
        /// Number of shapes.
        16 count: u32,
        /// Zero.
        20 pad0: u32,
    }

    /// VkAabbPositionsKHR, mesh space.
    struct ShapeBox, size 24 {
        /// Smallest coordinates.
        0 low: [f32; 3],
        /// Largest coordinates.
        12 high: [f32; 3],
    }

    /// Which instance descriptors are written.
    struct InstanceDescriptorJob, size 48 {
        /// [`Instance`] by slot.
        0 instances: u64,
        /// [`TlasSlot`] by slot.
        8 slots: u64,
        /// Device addresses by BLAS number; 0: not built.
        16 blases: u64,
        /// [`InstanceDescriptor`] by place.
        24 descriptors: u64,
        /// `count` slots; 0: the slots `0..count`.
        32 dirty: u64,
        /// Number of slots.
        40 count: u32,
        /// Zero.
        44 pad0: u32,
    }

    /// What the TLAS knows of a slot beside its transform.
    struct TlasSlot, size 12 {
        /// Number of its BLAS, or [`TLAS_NO_BLAS`].
        0 blas: u32,
        /// Bits 0..8: `MASK_*`; bits 8..16: VkGeometryInstanceFlagsKHR; bits 16..24: SBT offset.
        4 mask_flags: u32,
        /// Of its descriptor.
        8 place: u32,
    }

    /// VkAccelerationStructureInstanceKHR.
    struct InstanceDescriptor, size 64 {
        /// Mesh space to render space; the identity where nothing is to be met.
        0 render_from_mesh: Rows,
        /// Bits 0..24: slot; bits 24..32: mask.
        48 index_mask: u32,
        /// Bits 0..24: SBT offset; bits 24..32: flags.
        52 offset_flags: u32,
        /// Device address of the BLAS; 0: rays never meet it.
        56 blas: u64,
    }
}
