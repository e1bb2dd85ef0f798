//! Meshes: vertices, primitives, and how they deform.

use glam::{Affine3A, Vec2, Vec3, Vec4};

/// Triangles with their attributes, or shapes and no triangles. All arrays but `tex_coords1` and `colors` hold one entry a vertex;
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
    /// Spheres and boxes; then there are no vertices, no indices and no deformation.
    pub shapes: Vec<Shape>,
    /// The primitives of the mesh; each becomes one geometry of the BLAS.
    pub geometries: Vec<Geometry>,
    /// How its vertices follow a pose; `None`: rigid. Each instance of a mesh that deforms has vertices and a BLAS of its own.
    pub deformation: Option<Deformation>,
}

/// What a [`Shape`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShapeKind {
    /// A sphere; `mesh_from_primitive` and the instance make an ellipsoid of it.
    Sphere,
    /// A box with faces along the axes.
    Box,
}

/// An analytic shape. Texture coordinates of a sphere are its longitude (from +Z over +X) and its angle from +Y, both as
/// shares; those of a box run from 0 to 1 on each face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Sphere or box.
    pub kind: ShapeKind,
    /// Its centre, primitive space.
    pub centre: Vec3,
    /// Half of its size, metres, not negative; of a sphere x is the radius and the rest is ignored. 0: nothing is seen of it.
    pub half_extent: Vec3,
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

/// One primitive of a mesh: a range of its indices, or of its shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// First index, a multiple of 3; or first shape.
    pub first_index: u32,
    /// Number of indices, a multiple of 3; or of shapes.
    pub index_count: u32,
    /// Places the primitive inside its mesh; identity on import.
    pub mesh_from_primitive: Affine3A,
}
