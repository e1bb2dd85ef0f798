//! Twins of `shaders/shared/scene.glsl`, and the instance masks of `rays.glsl`.

use super::Rows;

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
        /// Device address of `vec3[]`, 12 bytes each, primitive space in metres.
        0 positions: u64,
        /// The same of the last frame; equal to `positions` unless the mesh deforms.
        8 previous_positions: u64,
        /// Device address of [`VertexAttributes`], same order.
        16 attributes: u64,
        /// Device address of `u32[]`, already moved to the first index of this geometry.
        24 indices: u64,
        /// Number of triangles.
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

    /// A texture as a material uses it.
    struct TextureUse, size 32 {
        /// Index into the bindless array, or [`NO_TEXTURE`].
        0 texture: u32,
        /// Texture coordinate set, 0 or 1.
        4 tex_coord: u32,
        /// `KHR_texture_transform`: `uv' = linear * uv + offset`.
        8 offset: [f32; 2],
        /// 2x2 matrix by rows: m00, m01, m10, m11.
        16 linear: [f32; 4],
    }

    /// A material: glTF metallic-roughness with its extensions and a shading mode.
    struct Material, size 256 {
        /// Linear RGB and alpha.
        0 base_color: [f32; 4],
        /// Emitted radiance.
        16 emissive: [f32; 3],
        /// 0..1.
        28 metallic: f32,
        /// `KHR_materials_specular` colour factor.
        32 specular_color: [f32; 3],
        /// `KHR_materials_specular` strength.
        44 specular: f32,
        /// Absorption coefficient of the volume, 1/m.
        48 attenuation_per_m: [f32; 3],
        /// Perceptual roughness; GGX alpha is its square.
        60 roughness: f32,
        /// Scale of the normal map's x and y.
        64 normal_scale: f32,
        /// Strength of the occlusion texture.
        68 occlusion_strength: f32,
        /// Index of refraction.
        72 ior: f32,
        /// `KHR_materials_transmission` factor.
        76 transmission: f32,
        /// `alphaCutoff` of the MASK mode.
        80 alpha_cutoff: f32,
        /// `MODE_*`.
        84 mode: u32,
        /// `MATERIAL_*` bits.
        88 flags: u32,
        /// Where volumes overlap, the higher one counts; equal: the one entered last.
        92 medium_priority: u32,
        /// sRGB colour, alpha in a.
        96 base_color_texture: TextureUse,
        /// Roughness in g, metallic in b, linear.
        128 metallic_roughness_texture: TextureUse,
        /// Tangent-space normal, linear.
        160 normal_texture: TextureUse,
        /// Occlusion in r, linear.
        192 occlusion_texture: TextureUse,
        /// sRGB colour.
        224 emissive_texture: TextureUse,
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
    struct Scene, size 104 {
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
        /// Number of punctual lights.
        72 light_count: u32,
        /// Number of emissive triangles.
        76 emissive_count: u32,
        /// Columns of the environment's grid; 0: constant environment.
        80 environment_width: u32,
        /// Rows of the environment's grid.
        84 environment_height: u32,
        /// The constant radiance, or the factor on the map.
        88 environment_radiance: [f32; 3],
        /// Turn of the map around +Y, radians.
        100 environment_rotation_rad: f32,
    }
}

/// [`TextureUse::texture`] of a slot without a texture.
pub const NO_TEXTURE: u32 = 0xffff_ffff;

/// [`Material::mode`]: glTF metallic-roughness.
pub const MODE_PBR: u32 = 0;
/// [`Material::mode`]: perfect mirror.
pub const MODE_REFLECTIVE: u32 = 1;
/// [`Material::mode`]: smooth glass.
pub const MODE_REFRACTIVE: u32 = 2;
/// [`Material::mode`]: base colour without light.
pub const MODE_UNLIT: u32 = 3;

/// [`Material::flags`]: both sides are seen and emit.
pub const MATERIAL_DOUBLE_SIDED: u32 = 1;
/// [`Material::flags`]: the surface encloses a volume, light bends at it.
pub const MATERIAL_HAS_VOLUME: u32 = 2;
/// [`Material::flags`]: alpha below the cut-off is a hole.
pub const MATERIAL_ALPHA_MASK: u32 = 4;
/// [`Material::flags`]: alpha is coverage.
pub const MATERIAL_ALPHA_BLEND: u32 = 8;

/// [`Instance::flags`]: the determinant of `render_from_mesh` is below 0.
pub const INSTANCE_MIRRORED: u32 = 1;

/// Bit of y in the id target: the back side of the triangle was seen.
pub const GBUFFER_BACK: u32 = 0x8000_0000;

/// [`Geometry::flags`]: `mesh_from_primitive` is not the identity, now or in the last frame.
pub const GEOMETRY_MOVED: u32 = 1;
/// [`Geometry::flags`]: the previous vertices or matrix differ from the present ones.
pub const GEOMETRY_MOVING: u32 = 2;

/// Bit of an instance mask: met by camera rays.
pub const MASK_CAMERA: u32 = 1;
/// Bit of an instance mask: met by shadow rays.
pub const MASK_SHADOWS: u32 = 2;
/// Bit of an instance mask: met by reflections and refractions.
pub const MASK_INDIRECT: u32 = 4;

/// [`Light::kind`].
pub const LIGHT_POINT: u32 = 0;
/// [`Light::kind`].
pub const LIGHT_SPOT: u32 = 1;
/// [`Light::kind`].
pub const LIGHT_DIRECTIONAL: u32 = 2;
