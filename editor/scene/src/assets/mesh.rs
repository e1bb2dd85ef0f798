//! Meshes: shared vertices, cut into primitives.
//! Plain data with bounds; knows no file format and no device.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

use super::deform::{Bounds, DeformPose, MorphTarget, Reach, SkinData, join, moved};
use crate::ids::MaterialId;

/// Vertices and indices. All arrays but `tex_coords1` and `colors` hold one entry a vertex; those two
/// may be empty. Every index is below `positions.len()`, every number is finite. What bends the vertices
/// (`skin`, `morph`) is shared by all primitives; those whose file has none of it are held by no joint and have
/// deltas of zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Positions, mesh space, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Unit tangents; w is the handedness, 1 or -1 (glTF 2.0, section 3.7.2.1).
    pub tangents: Vec<Vec4>,
    /// First set of texture coordinates; zeros when the file has none.
    pub tex_coords0: Vec<Vec2>,
    /// Second set of texture coordinates, or empty.
    pub tex_coords1: Vec<Vec2>,
    /// Linear vertex colours with alpha, or empty.
    pub colors: Vec<Vec4>,
    /// Three a triangle, the primitives one after the other.
    pub indices: Vec<u32>,
    /// Joints of the vertices, when a skin can bend them.
    pub skin: Option<SkinData>,
    /// Morph targets.
    pub morph: Vec<MorphTarget>,
}

/// A mesh: shared vertices, cut into primitives.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Shown in the outliner.
    pub name: String,
    /// Vertices and indices.
    pub data: Arc<MeshData>,
    /// Ranges of the indices.
    pub primitives: Vec<Primitive>,
    /// Smallest and largest corner in mesh space, primitive transforms included; `None` without triangles. They are those of
    /// the boxes of the primitives: never too small, and too large where one is turned.
    pub bounds: Option<(DVec3, DVec3)>,
    /// Weights of the morph targets unless a node, part or clip says otherwise, one a target.
    pub default_weights: Vec<f32>,
    /// One a primitive, primitive space.
    own_bounds: Vec<Option<Bounds>>,
    /// One a primitive; empty for a mesh that nothing bends.
    reach: Vec<Reach>,
}

/// A range of a mesh's indices with one material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primitive {
    /// First index, a multiple of 3.
    pub first_index: u32,
    /// Number of indices, a multiple of 3.
    pub index_count: u32,
    /// Material unless the node or part says otherwise.
    pub material: MaterialId,
    /// Places the primitive inside its mesh; identity on import.
    pub mesh_from_primitive: DAffine3,
}

impl Mesh {
    /// A mesh with its bounds computed; its morph targets have weight 0.
    pub fn new(name: String, data: Arc<MeshData>, primitives: Vec<Primitive>) -> Self {
        let default_weights = vec![0.0; data.morph.len()];
        let (own_bounds, reach) = (Vec::new(), Vec::new());
        let mut mesh = Self { name, data, primitives, bounds: None, default_weights, own_bounds, reach };
        mesh.own_bounds = mesh.primitives.iter().map(|primitive| mesh.corners_of(primitive)).collect();
        mesh.update_bounds();
        if mesh.data.skin.is_some() || !mesh.data.morph.is_empty() {
            let reach = |primitive| Reach::of(&mesh.data, mesh.indices_of(primitive));
            mesh.reach = mesh.primitives.iter().map(reach).collect();
        }
        mesh
    }

    /// Computes `bounds` again, as after a primitive moved. Costs the primitives, not the vertices.
    pub fn update_bounds(&mut self) {
        let placed = |(own, primitive): (&Option<Bounds>, &Primitive)| {
            own.map(|own| moved(&primitive.mesh_from_primitive, own))
        };
        self.bounds = self.own_bounds.iter().zip(&self.primitives).filter_map(placed).reduce(join);
    }

    /// Smallest and largest corner in a pose, mesh space: never too small, perhaps too large. Costs the joints
    /// and targets, not the vertices.
    pub fn posed_bounds(&self, pose: &DeformPose) -> Option<(DVec3, DVec3)> {
        let posed = |(reach, primitive): (&Reach, &Primitive)| reach.posed(pose, primitive);
        self.reach.iter().zip(&self.primitives).filter_map(posed).reduce(join)
    }

    /// Smallest and largest corner of one primitive, primitive space; `None` without triangles.
    pub fn primitive_bounds(&self, primitive: usize) -> Option<(DVec3, DVec3)> {
        self.own_bounds.get(primitive).copied().flatten()
    }

    fn corners_of(&self, primitive: &Primitive) -> Option<Bounds> {
        let corner = |&index: &u32| self.data.positions.get(index as usize).map(|p| p.as_dvec3());
        self.indices_of(primitive).iter().filter_map(corner).map(|p| (p, p)).reduce(join)
    }

    /// The indices of one primitive; empty when its range lies outside the mesh.
    pub fn indices_of(&self, primitive: &Primitive) -> &[u32] {
        let first = primitive.first_index as usize;
        let end = first.saturating_add(primitive.index_count as usize);
        self.data.indices.get(first..end).unwrap_or(&[])
    }

    /// Number of triangles of all primitives.
    pub fn triangle_count(&self) -> usize {
        self.primitives.iter().map(|p| p.index_count as usize / 3).sum()
    }
}
