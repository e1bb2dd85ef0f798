//! What enters the renderer: ids, a flat `SceneDelta`, the ordered `Invalidation`.
//! The ground floor of this package: everything imports it, it imports nothing of ours.
//! It knows no hierarchy and no file format. Lengths are metres in render space
//! (world space less the render origin, which the caller subtracts in double precision).

mod lobes;
mod material;
mod mesh;

use std::sync::Arc;

use glam::{Affine3A, Vec3};
use serde::{Deserialize, Serialize};

pub use lobes::Lobes;
pub use material::{AlphaMode, Material, Sampler, ShadingMode, Texture, TextureUse, Wrap};
pub use mesh::{Deformation, Geometry, Mesh, MorphTarget, Pose, Shape, ShapeKind};

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
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
        self.instances.is_empty()
            && self.removed_instances.is_empty()
            && self.transforms.is_empty()
            && self.visibility.is_empty()
            && self.poses.is_empty()
            && self.meshes.is_empty()
            && self.removed_meshes.is_empty()
            && self.textures.is_empty()
            && self.removed_textures.is_empty()
            && self.materials.is_empty()
            && self.removed_materials.is_empty()
            && self.primitive_transforms.is_empty()
            && self.lights.is_empty()
            && self.removed_lights.is_empty()
            && self.environment.is_none()
            && !self.render_origin_changed
    }
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
    /// Size of the view: starts again, history is resampled.
    Resize,
    /// The camera moved: this view starts again, history is reprojected by motion vectors.
    Camera,
    /// Materials, lights, environment, transforms: all views start again, history is reprojected.
    Scene,
    /// Pipeline, quality setting, shader or render origin: all starts again, history is dropped.
    Everything,
}
