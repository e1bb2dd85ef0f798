//! What enters the renderer: ids, a flat `SceneDelta`, the ordered `Invalidation`.
//! The ground floor of this package: everything imports it, it imports nothing of ours.
//! It knows no hierarchy and no file format. Lengths are metres in render space
//! (world space less the render origin, which the caller subtracts in double precision).

use std::sync::Arc;

use glam::{Affine3A, Vec2, Vec3, Vec4};

/// Persistent id of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(pub u64);

/// Persistent id of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MaterialId(pub u64);

/// Persistent id of a texture: one image with one sampler and one colour space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureId(pub u64);

/// Persistent id of an instance: the scene node that owns it and the part inside that node
/// (a prefab instance holds many parts).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct InstanceId {
    /// The 64-bit id of the owning scene node.
    pub node: u64,
    /// Index of the node inside the owner's prefab; 0 for a plain node.
    pub part: u32,
}

/// Persistent id of a light, built like [`InstanceId`].
pub type LightId = InstanceId;

/// Everything that changed in the scene since the last delta.
#[derive(Clone, Debug, Default)]
pub struct SceneDelta {
    /// New meshes, and meshes whose content changed.
    pub meshes: Vec<(MeshId, Arc<Mesh>)>,
    /// Meshes that no instance uses any more.
    pub removed_meshes: Vec<MeshId>,
    /// New or changed textures.
    pub textures: Vec<(TextureId, Arc<Texture>)>,
    /// Textures that no material uses any more.
    pub removed_textures: Vec<TextureId>,
    /// New or changed materials.
    pub materials: Vec<(MaterialId, Material)>,
    /// Materials that no instance uses any more.
    pub removed_materials: Vec<MaterialId>,
    /// New instances, and instances of which more than the transform changed.
    pub instances: Vec<(InstanceId, Instance)>,
    /// Instances of which the transform alone changed.
    pub transforms: Vec<(InstanceId, Affine3A)>,
    /// Instances of which only who sees them changed.
    pub visibility: Vec<(InstanceId, Visibility)>,
    /// Primitives that moved inside their mesh: mesh, geometry, `mesh_from_primitive`.
    pub primitive_transforms: Vec<(MeshId, u32, Affine3A)>,
    /// New poses of instances whose mesh deforms.
    pub poses: Vec<(InstanceId, Pose)>,
    /// Deleted instances.
    pub removed_instances: Vec<InstanceId>,
    /// New or changed lights.
    pub lights: Vec<(LightId, Light)>,
    /// Deleted lights.
    pub removed_lights: Vec<LightId>,
    /// The new environment, if it changed.
    pub environment: Option<Environment>,
    /// The render origin moved: every transform of the scene is in this delta and every view resets.
    pub render_origin_changed: bool,
    /// Why the image changes, in words for the status bar, such as "moved Chair". Empty: nothing changed.
    pub reason: String,
}

impl SceneDelta {
    /// Whether applying this delta would do nothing.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty()
            && self.removed_meshes.is_empty()
            && self.textures.is_empty()
            && self.removed_textures.is_empty()
            && self.materials.is_empty()
            && self.removed_materials.is_empty()
            && self.instances.is_empty()
            && self.transforms.is_empty()
            && self.visibility.is_empty()
            && self.primitive_transforms.is_empty()
            && self.poses.is_empty()
            && self.removed_instances.is_empty()
            && self.lights.is_empty()
            && self.removed_lights.is_empty()
            && self.environment.is_none()
            && !self.render_origin_changed
    }
}

/// Triangles with their attributes. All arrays but `tex_coords1` and `colors` hold one entry a vertex;
/// those two may be empty. Every index of every geometry is below `positions.len()`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Shown in messages.
    pub name: String,
    /// Positions, mesh space, finite.
    pub positions: Vec<Vec3>,
    /// Unit normals, mesh space.
    pub normals: Vec<Vec3>,
    /// Unit tangents, mesh space; w is the handedness, 1 or -1 (glTF 2.0, section 3.7.2.1).
    pub tangents: Vec<Vec4>,
    /// First set of texture coordinates.
    pub tex_coords0: Vec<Vec2>,
    /// Second set of texture coordinates, or empty.
    pub tex_coords1: Vec<Vec2>,
    /// Linear vertex colours with alpha, or empty.
    pub colors: Vec<Vec4>,
    /// Three indices a triangle, for all geometries one after the other.
    pub indices: Vec<u32>,
    /// The primitives of the mesh; each becomes one geometry of the BLAS.
    pub geometries: Vec<Geometry>,
    /// How its vertices follow a pose; `None`: rigid. Each instance of a mesh that deforms has vertices and a BLAS of its own.
    pub deformation: Option<Deformation>,
}

/// How vertices follow a [`Pose`]: first the morph targets are added, then the joints move the sum (glTF 2.0, 3.7.2.2 and 3.7.3.3).
#[derive(Clone, Debug, Default)]
pub struct Deformation {
    /// Four joints a vertex, or empty: no skin. Every joint is below `joint_count`.
    pub joints: Vec<[u16; 4]>,
    /// Their weights, in sum 1; all zero: the vertex follows no joint. As many as `joints`.
    pub weights: Vec<[f32; 4]>,
    /// Number of joint matrices in a pose.
    pub joint_count: u32,
    /// Morph targets.
    pub targets: Vec<MorphTarget>,
}

/// Offsets a vertex, each list with one entry a vertex or empty.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Offsets of the positions.
    pub positions: Vec<Vec3>,
    /// Offsets of the normals.
    pub normals: Vec<Vec3>,
    /// Offsets of the tangents; the handedness stays.
    pub tangents: Vec<Vec3>,
}

/// Where the joints of one instance stand, and how far it is morphed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// One a joint: mesh space at rest to mesh space as posed (inverse bind matrix included).
    pub joints: Vec<Affine3A>,
    /// One a morph target.
    pub weights: Vec<f32>,
}

/// One primitive of a mesh: a range of its indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// First index, a multiple of 3.
    pub first_index: u32,
    /// Number of indices, a multiple of 3.
    pub index_count: u32,
    /// Places the primitive inside its mesh; identity on import.
    pub mesh_from_primitive: Affine3A,
}

/// One placed mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The mesh that is placed.
    pub mesh: MeshId,
    /// Mesh space to render space.
    pub render_from_mesh: Affine3A,
    /// One material for each geometry of the mesh.
    pub materials: Vec<MaterialId>,
    /// Who sees it.
    pub visibility: Visibility,
    /// The pose of a mesh that deforms; ignored otherwise. `None`: at rest.
    pub pose: Option<Pose>,
}

/// Which rays meet an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visibility {
    /// False: hidden from everything (instance mask 0).
    pub shown: bool,
    /// Seen by the camera itself; mirrors and glass show it all the same.
    pub to_camera: bool,
    /// Stands in the way of light.
    pub to_shadows: bool,
}

impl Default for Visibility {
    fn default() -> Self {
        Self { shown: true, to_camera: true, to_shadows: true }
    }
}

/// How a texture is addressed outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second tile mirrored.
    MirroredRepeat,
    /// The border texel goes on.
    ClampToEdge,
}

/// How a texture is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Sampler {
    /// Addressing in u.
    pub wrap_u: Wrap,
    /// Addressing in v.
    pub wrap_v: Wrap,
    /// Linear (true) or nearest (false) filtering when magnified.
    pub mag_linear: bool,
    /// Linear (true) or nearest (false) filtering when minified.
    pub min_linear: bool,
    /// Linear (true) or nearest (false) choice between mip levels.
    pub mip_linear: bool,
    /// False: only the base level is sampled.
    pub mipmaps: bool,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            mag_linear: true,
            min_linear: true,
            mip_linear: true,
            mipmaps: true,
        }
    }
}

/// An 8-bit RGBA image, first row at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Shown in messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba8: Vec<u8>,
    /// True: colours are sRGB encoded (base colour, emissive). False: data.
    pub srgb: bool,
    /// How it is sampled.
    pub sampler: Sampler,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Which texture.
    pub texture: TextureId,
    /// 0 or 1: which texture coordinates.
    pub tex_coord: u32,
    /// KHR_texture_transform: offset, in texture units.
    pub offset: Vec2,
    /// KHR_texture_transform: counter-clockwise rotation, radians.
    pub rotation_rad: f32,
    /// KHR_texture_transform: scale.
    pub scale: Vec2,
}

/// How a surface answers light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ShadingMode {
    /// glTF 2.0, appendix B.
    #[default]
    Pbr,
    /// A perfect mirror tinted by the base colour.
    Reflective,
    /// Smooth glass: exact dielectric Fresnel, tinted by base colour and volume attenuation.
    Refractive,
    /// Base colour as emitted radiance, no lighting (KHR_materials_unlit).
    Unlit,
}

/// glTF alpha modes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Holes where alpha is below the cutoff.
    Mask {
        /// The cutoff.
        cutoff: f32,
    },
    /// Alpha is coverage.
    Blend,
}

/// A material: factors times textures.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Shading mode.
    pub mode: ShadingMode,
    /// Linear base colour with alpha.
    pub base_color: Vec4,
    /// Base colour texture (sRGB) with alpha.
    pub base_color_texture: Option<TextureUse>,
    /// Metalness, 0..1.
    pub metallic: f32,
    /// Perceptual roughness, 0..1; alpha of GGX is its square.
    pub roughness: f32,
    /// Green: roughness, blue: metalness.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Tangent-space normal map.
    pub normal_texture: Option<TextureUse>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Red: ambient occlusion (acts on ambient light without occlusion rays only).
    pub occlusion_texture: Option<TextureUse>,
    /// Strength of the occlusion texture, 0..1.
    pub occlusion_strength: f32,
    /// Emitted radiance (factor times KHR strength), nits taken as radiance 1:1.
    pub emissive: Vec3,
    /// Emissive texture (sRGB).
    pub emissive_texture: Option<TextureUse>,
    /// Index of refraction, at least 1.
    pub ior: f32,
    /// Strength of the dielectric specular lobe, 0..1 (KHR_materials_specular).
    pub specular: f32,
    /// Tint of the dielectric F0 (KHR_materials_specular).
    pub specular_color: Vec3,
    /// Share of transmitted light, 0..1 (KHR_materials_transmission).
    pub transmission: f32,
    /// True when light crosses a volume (KHR_materials_volume, thickness above 0); false: a thin sheet that does not bend light.
    pub has_volume: bool,
    /// Where volumes overlap, the one with the higher number is there; equal: the one entered last.
    pub volume_priority: u8,
    /// Colour that white light has after `attenuation_distance_m`.
    pub attenuation_color: Vec3,
    /// Distance of the above in metres; infinity: no attenuation.
    pub attenuation_distance_m: f32,
    /// Alpha mode.
    pub alpha: AlphaMode,
    /// Whether the back of a triangle is drawn.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            mode: ShadingMode::Pbr,
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
            has_volume: false,
            volume_priority: 0,
            attenuation_color: Vec3::ONE,
            attenuation_distance_m: f32::INFINITY,
            alpha: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

/// A light without a mesh (KHR_lights_punctual, with a size from `extras`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Shines equally to all sides.
    Point {
        /// Centre, render space.
        position: Vec3,
        /// Radiant intensity a channel, candela taken 1:1.
        intensity: Vec3,
        /// Radius of the sphere that shines; 0: hard shadows.
        radius_m: f32,
        /// Distance past which nothing arrives; infinity: none.
        range_m: f32,
    },
    /// A point light in a cone.
    Spot {
        /// Centre, render space.
        position: Vec3,
        /// Unit vector from the light along its axis.
        direction: Vec3,
        /// Radiant intensity on the axis, candela taken 1:1.
        intensity: Vec3,
        /// Radius of the sphere that shines; 0: hard shadows.
        radius_m: f32,
        /// Distance past which nothing arrives; infinity: none.
        range_m: f32,
        /// Cosine of the angle where the fall-off begins.
        cos_inner: f32,
        /// Cosine of the angle where the light ends.
        cos_outer: f32,
    },
    /// Light from infinitely far.
    Directional {
        /// Unit vector in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface facing the light, lux taken 1:1.
        irradiance: Vec3,
        /// Half of the angle under which the source is seen, radians; 0: hard shadows.
        angular_radius_rad: f32,
    },
}

/// What surrounds the scene.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from everywhere; black: none.
    Constant(Vec3),
    /// Equirectangular map, +Y up, u = 0.5 looks along -Z.
    Equirectangular {
        /// Linear radiance.
        map: Arc<RadianceMap>,
        /// Turn around +Y, radians.
        rotation_rad: f32,
        /// Multiplies the map.
        scale: f32,
    },
}

impl Default for Environment {
    fn default() -> Self {
        Self::Constant(Vec3::ZERO)
    }
}

/// Linear radiance in an equirectangular layout, first row at the zenith.
#[derive(Clone, Debug, Default)]
pub struct RadianceMap {
    /// Shown in messages.
    pub name: String,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width * height` values, finite and not negative.
    pub rgb: Vec<[f32; 3]>,
}

/// How a camera maps directions to the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Full vertical angle of view, radians.
        yfov_rad: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half of the height of the image, metres.
        ymag_m: f32,
    },
}

/// A camera in render space; it looks along its -Z, +Y is up. Width follows from the view's aspect ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Camera space to render space; a rotation and a translation, no scale.
    pub render_from_camera: Affine3A,
    /// Projection.
    pub projection: Projection,
    /// Nothing nearer than this is drawn, metres, above 0.
    pub near_m: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            render_from_camera: Affine3A::from_translation(Vec3::new(0.0, 0.0, 4.0)),
            projection: Projection::Perspective { yfov_rad: 0.7 },
            near_m: 0.01,
        }
    }
}

/// What an event costs the accumulated image, from nothing to everything.
/// The order is the point: of several events in one frame the largest counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Invalidation {
    /// Exposure, tone map, overlay, selection, a swap between equal variants: samples are kept.
    #[default]
    Nothing,
    /// The camera moved: this view starts again, history is reprojected by motion vectors.
    Camera,
    /// Size of the view: starts again, history is resampled.
    Resize,
    /// Materials, lights, environment, transforms: all views start again, history is reprojected.
    Scene,
    /// Pipeline, quality setting, shader or render origin: all starts again, history is dropped.
    Everything,
}
