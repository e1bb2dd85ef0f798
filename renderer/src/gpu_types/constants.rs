//! Host twins of the constants in `shaders/shared/`: same names, same values.

/// [`super::TextureUse::texture`] of a slot without a texture.
pub const NO_TEXTURE: u32 = 0xffff_ffff;

/// [`super::Material::mode`]: glTF metallic-roughness.
pub const MODE_PBR: u32 = 0;
/// [`super::Material::mode`]: perfect mirror.
pub const MODE_REFLECTIVE: u32 = 1;
/// [`super::Material::mode`]: smooth glass.
pub const MODE_REFRACTIVE: u32 = 2;
/// [`super::Material::mode`]: base colour without light.
pub const MODE_UNLIT: u32 = 3;

/// [`super::Material::flags`]: both sides are seen and emit.
pub const MATERIAL_DOUBLE_SIDED: u32 = 1;
/// [`super::Material::flags`]: the surface encloses a volume, light bends at it.
pub const MATERIAL_HAS_VOLUME: u32 = 2;
/// [`super::Material::flags`]: alpha below the cut-off is a hole.
pub const MATERIAL_ALPHA_MASK: u32 = 4;
/// [`super::Material::flags`]: alpha is coverage.
pub const MATERIAL_ALPHA_BLEND: u32 = 8;

/// [`super::MaterialLobes::flags`]: anisotropy.
pub const LOBE_ANISOTROPY: u32 = 1;
/// [`super::MaterialLobes::flags`]: clear coat.
pub const LOBE_CLEARCOAT: u32 = 2;
/// [`super::MaterialLobes::flags`]: dispersion.
pub const LOBE_DISPERSION: u32 = 4;
/// [`super::MaterialLobes::flags`]: thin film.
pub const LOBE_IRIDESCENCE: u32 = 8;
/// [`super::MaterialLobes::flags`]: sheen.
pub const LOBE_SHEEN: u32 = 16;
/// [`super::MaterialLobes::flags`]: diffuse transmission.
pub const LOBE_DIFFUSE_TRANSMISSION: u32 = 32;
/// [`super::MaterialLobes::flags`]: reflectance and glossiness instead of metalness and roughness.
pub const LOBE_SPECULAR_GLOSSINESS: u32 = 64;

/// Cosines and roughnesses of the table behind [`super::Scene::sheen_albedo`].
pub const SHEEN_ALBEDO_SIDE: u32 = 32;

/// [`super::Instance::flags`]: the determinant of `render_from_mesh` is below 0.
pub const INSTANCE_MIRRORED: u32 = 1;

/// Bit of y in the id target: the back side of the triangle was seen, or the inside of a shape.
pub const GBUFFER_BACK: u32 = 0x8000_0000;

/// [`super::Geometry::flags`]: `mesh_from_primitive` is not the identity, now or in the last frame.
pub const GEOMETRY_MOVED: u32 = 1;
/// [`super::Geometry::flags`]: the previous vertices or matrix differ from the present ones.
pub const GEOMETRY_MOVING: u32 = 2;
/// [`super::Geometry::flags`]: `positions` is the address of [`super::Shape`], there are no attributes and no indices.
pub const GEOMETRY_SHAPES: u32 = 4;

/// [`super::Shape::kind`].
pub const SHAPE_SPHERE: u32 = 0;
/// [`super::Shape::kind`].
pub const SHAPE_BOX: u32 = 1;

/// Vertices that raster draws for a shape: the box around it.
pub const SHAPE_VERTICES: u32 = 36;

/// Bit of an instance mask: met by camera rays.
pub const MASK_CAMERA: u32 = 1;
/// Bit of an instance mask: met by shadow rays.
pub const MASK_SHADOWS: u32 = 2;
/// Bit of an instance mask: met by reflections and refractions.
pub const MASK_INDIRECT: u32 = 4;

/// [`super::Light::kind`].
pub const LIGHT_POINT: u32 = 0;
/// [`super::Light::kind`].
pub const LIGHT_SPOT: u32 = 1;
/// [`super::Light::kind`].
pub const LIGHT_DIRECTIONAL: u32 = 2;

/// Cosines, and roughnesses, of the table behind [`super::Frame::ggx_albedo`].
pub const GGX_ALBEDO_SIDE: u32 = 32;

/// [`super::Frame::flags`]: parallel projection.
pub const FRAME_ORTHOGRAPHIC: u32 = 1;
/// [`super::Frame::flags`]: post shows the denoised signals of this frame, not the accumulated mean.
pub const FRAME_MOVING: u32 = 2;
/// [`super::Frame::flags`]: the history belongs to the last frame and may be reprojected.
pub const FRAME_HISTORY: u32 = 4;
/// [`super::Frame::flags`]: shadow rays stop at refractive surfaces.
pub const FRAME_OPAQUE_GLASS: u32 = 8;
/// [`super::Frame::flags`]: shadow rays stop where paths bend or spread, which find the light by themselves.
pub const FRAME_PATHS_BEND: u32 = 16;
/// [`super::Frame::flags`]: nothing has moved since the last frame, so its history is exact and not clamped.
pub const FRAME_STEADY: u32 = 32;
/// [`super::Frame::flags`]: light is kept apart, to be denoised.
pub const FRAME_DENOISED: u32 = 64;
/// [`super::Frame::flags`]: one pixel of each 2 x 2 traces its reflected light.
pub const FRAME_HALF_REFLECTIONS: u32 = 128;
/// [`super::Frame::flags`]: what shadow rays met in the frames before holds for this one.
pub const FRAME_SHADOWS_KNOWN: u32 = 256;

/// [`super::Frame::tone_map`]: clamp.
pub const TONE_MAP_LINEAR: u32 = 0;
/// [`super::Frame::tone_map`]: fit to the ACES reference transform.
pub const TONE_MAP_ACES: u32 = 1;
/// [`super::Frame::tone_map`]: approximation of AgX.
pub const TONE_MAP_AGX: u32 = 2;
/// [`super::Frame::tone_map`]: Khronos PBR neutral.
pub const TONE_MAP_NEUTRAL: u32 = 3;

/// Debug view ([`super::Push::argument0`] of the pass `show`): source = base colour target.
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
/// Debug view: source_uint = id target.
pub const SHOW_PRIMITIVE: u32 = 14;
/// Debug view: source_uint = id target.
pub const SHOW_FACING: u32 = 15;
/// Debug view: source_uint = ray depth.
pub const SHOW_RAY_DEPTH: u32 = 16;
/// Debug view: source = shadow of one light.
pub const SHOW_SHADOW: u32 = 17;
/// Debug view of `show_surface`: edges.
pub const SHOW_WIREFRAME: u32 = 18;
/// Debug view of `show_surface`: barycentric coordinates.
pub const SHOW_BARYCENTRIC: u32 = 19;

/// Side of the blocks whose sums are in [`super::ErrorBlock`], pixels.
pub const ERROR_BLOCK_SIDE: u32 = 8;

/// Bit of [`super::Push::argument0`] of pass `light_shadow`, beside the number of the light: what its image holds is
/// forgotten.
pub const LIGHT_SHADOW_FRESH: u32 = 0x8000_0000;

/// Sampler: Owen-scrambled Sobol.
pub const SAMPLER_SOBOL: u32 = 0;
/// Sampler: Halton.
pub const SAMPLER_HALTON: u32 = 1;
/// Sampler: Hammersley.
pub const SAMPLER_HAMMERSLEY: u32 = 2;
/// Sampler: hashed PCG.
pub const SAMPLER_INDEPENDENT: u32 = 3;
/// Sampler: Sobol with blue-noise offsets.
pub const SAMPLER_BLUE_NOISE: u32 = 4;

/// Triangles of one cluster of pass `blas_surface`.
pub const CLUSTER_TRIANGLES: u32 = 32;

/// [`super::TlasSlot::blas`]: rays never meet the instance.
pub const TLAS_NO_BLAS: u32 = 0xffff_ffff;

/// Hit group and miss shader of rays that look for a surface (`RAY_SURFACE`).
pub const RAY_SURFACE: u32 = 0;
/// Hit group and miss shader of rays that ask for visibility (`RAY_SHADOW`).
pub const RAY_SHADOW: u32 = 1;
/// Hit groups of meshes of shapes stand so much further: the SBT offset of their instances.
pub const RAY_SHAPES: u32 = 2;

/// Hit kind: a sphere.
pub const HIT_SPHERE: u32 = 0;
/// Hit kind: a box.
pub const HIT_BOX: u32 = 1;
/// Hit kind: bit of a ray that leaves the shape.
pub const HIT_LEAVING: u32 = 2;
/// Hit kinds below this are of shapes.
pub const HIT_KINDS: u32 = 4;
/// Instance mask of what every ray sees.
pub const MASK_ALL: u32 = 0xff;

/// Set 0: the TLAS.
pub const BINDING_TLAS: u32 = 0;
/// Set 0: the bindless textures.
pub const BINDING_TEXTURES: u32 = 1;
/// Set 0: the environment map.
pub const BINDING_ENVIRONMENT_MAP: u32 = 2;
