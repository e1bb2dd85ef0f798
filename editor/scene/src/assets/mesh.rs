//! Meshes: shared vertices, or spheres and boxes, cut into primitives.
//! Plain data with bounds; knows no file format and no device.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

use super::deform::{Bounds, DeformPose, MorphTarget, Reach, SkinData, join, moved};
use super::shapes::{ShapeFault, ShapeSource, Shapes};
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

/// A mesh: shared vertices, or spheres and boxes, cut into primitives.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Shown in the outliner.
    pub name: String,
    /// Vertices and indices; none in a mesh of shapes.
    pub data: Arc<MeshData>,
    /// Spheres and boxes; `None`: a mesh of triangles.
    shapes: Option<Shapes>,
    /// Ranges of the indices, or of the shapes.
    pub primitives: Vec<Primitive>,
    /// Smallest and largest corner in mesh space, primitive transforms included; `None` without triangles or shapes. They are those of
    /// the boxes of the primitives: never too small, and too large where one is turned.
    pub bounds: Option<(DVec3, DVec3)>,
    /// Weights of the morph targets unless a node, part or clip says otherwise, one a target.
    pub default_weights: Vec<f32>,
    /// One a primitive, primitive space.
    own_bounds: Vec<Option<Bounds>>,
    /// One a primitive; empty for a mesh that nothing bends.
    reach: Arc<[Reach]>,
}

/// A range of a mesh's indices, or of its shapes, with one material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primitive {
    /// First index, a multiple of 3; or first shape.
    pub first_index: u32,
    /// Number of indices, a multiple of 3; or of shapes.
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
        let (own_bounds, reach) = (Vec::new(), Arc::default());
        let shapes = None;
        let mut mesh =
            Self { name, data, shapes, primitives, bounds: None, default_weights, own_bounds, reach };
        mesh.measure();
        mesh.update_bounds();
        if mesh.data.skin.is_some() || !mesh.data.morph.is_empty() {
            let reach = |primitive| Reach::of(&mesh.data, mesh.indices_of(primitive));
            mesh.reach = mesh.primitives.iter().map(reach).collect();
        }
        mesh
    }

    /// A mesh of spheres and boxes. Its primitives take the materials in turn; the last goes on for the rest.
    ///
    /// # Errors
    /// When the description makes no shapes.
    pub fn of_shapes(
        name: String,
        source: ShapeSource,
        materials: &[MaterialId],
    ) -> Result<Self, ShapeFault> {
        let shapes = Shapes::new(source)?;
        let last = materials.last().copied().unwrap_or_default();
        let chosen = materials.iter().copied().chain(std::iter::repeat(last));
        let primitive = |((first_index, index_count), material)| Primitive {
            first_index,
            index_count,
            material,
            mesh_from_primitive: DAffine3::IDENTITY,
        };
        let primitives = shapes.ranges().into_iter().zip(chosen).map(primitive).collect();
        let mut mesh = Self::new(name, Arc::default(), primitives);
        mesh.shapes = Some(shapes);
        mesh.measure();
        Ok(mesh)
    }

    /// Its spheres and boxes; `None`: a mesh of triangles.
    pub fn shapes(&self) -> Option<&Shapes> {
        self.shapes.as_ref()
    }

    /// Puts other shapes in the place of those that are there and gives back their description. Materials and places of
    /// the primitives stay. `None`, and nothing happens, without shapes and for another number of primitives.
    pub(crate) fn replace_shapes(&mut self, shapes: Shapes) -> Option<ShapeSource> {
        let old = self.shapes.as_mut()?;
        let ranges = shapes.ranges();
        if ranges.len() != self.primitives.len() {
            return None;
        }
        let old = std::mem::replace(old, shapes);
        for (primitive, (first, count)) in self.primitives.iter_mut().zip(ranges) {
            (primitive.first_index, primitive.index_count) = (first, count);
        }
        self.measure();
        Some(old.source().clone())
    }

    fn measure(&mut self) {
        self.own_bounds = self.primitives.iter().map(|primitive| self.corners_of(primitive)).collect();
        self.update_bounds();
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

    /// Smallest and largest corner of one primitive, primitive space; `None` without triangles or shapes.
    pub fn primitive_bounds(&self, primitive: usize) -> Option<(DVec3, DVec3)> {
        self.own_bounds.get(primitive).copied().flatten()
    }

    fn corners_of(&self, primitive: &Primitive) -> Option<Bounds> {
        if let Some(shapes) = &self.shapes {
            return shapes.bounds((primitive.first_index, primitive.index_count));
        }
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
        self.primitives.iter().map(|primitive| self.indices_of(primitive).len() / 3).sum()
    }

    /// Number of spheres and boxes of all primitives.
    pub fn shape_count(&self) -> usize {
        self.shapes.as_ref().map_or(0, |shapes| shapes.list().len())
    }
}
