//! Carries out edits of meshes of spheres and boxes, which are made here and belong to no prefab.

use super::Document;
use crate::assets::{MOST_SHAPES_IN_ALL, Material, Mesh, ShapeFault, ShapeSource, Shapes};
use crate::edit::{Edit, EditError, shown};
use crate::ids::{MaterialId, MeshId, NodeId};
use crate::node::{Node, NodeKind};
use crate::package::MaterialEntry;
use crate::transform::Local;

impl Document {
    /// The edit that adds a node with spheres and boxes, their mesh and a material for each of its primitives, and the new
    /// node's id. Materials that are missing are as the last one.
    ///
    /// # Errors
    /// When the description makes no shapes.
    pub fn add_shapes_edit(
        &mut self,
        name: &str,
        source: ShapeSource,
        materials: &[Material],
        local: impl Into<Local>,
    ) -> Result<(NodeId, Edit), ShapeFault> {
        let last = materials.last().cloned().unwrap_or_default();
        let count = source.primitive_count();
        let values = materials.iter().cloned().chain(std::iter::repeat(last)).take(count);
        let (mut ids, mut edits) = (Vec::new(), Vec::new());
        for value in values {
            let material = MaterialId(self.allocate_id());
            ids.push(material);
            edits.push(Edit::AddMaterial { material, entry: Box::new(MaterialEntry::made_here(value)) });
        }
        let value = Box::new(Mesh::of_shapes(name.to_owned(), source, &ids)?);
        let mesh = MeshId(self.allocate_id());
        edits.push(Edit::AddMesh { mesh, value });
        let kind = NodeKind::Mesh { mesh, materials: ids, weights: Vec::new() };
        let (node, add) = self.add_edit(Node::new(name, kind).with_local(local), None);
        edits.push(add);
        Ok((node, Edit::batch(format!("added {name}"), edits)))
    }

    pub(super) fn add_mesh(&mut self, id: MeshId, value: Mesh) -> Result<Edit, EditError> {
        if self.meshes.contains_key(&id) {
            return Err(EditError::Taken(format!("mesh {}", id.0)));
        }
        for primitive in &value.primitives {
            self.require_material(primitive.material)?;
        }
        self.require_shapes(value.shape_count(), 0)?;
        self.reserve_ids_up_to(id.0);
        self.shape_count += value.shape_count();
        self.meshes.insert(id, value);
        self.changes.removed_meshes.remove(&id);
        self.changes.meshes.insert(id);
        Ok(Edit::RemoveMesh { mesh: id })
    }

    pub(super) fn remove_mesh(&mut self, id: MeshId) -> Result<Edit, EditError> {
        let mesh = self.meshes.get(&id).ok_or_else(|| EditError::NoAsset(format!("mesh {}", id.0)))?;
        if let Some(by) = self.user_of_mesh(id) {
            return Err(EditError::InUse { what: shown(&mesh.name, "mesh", id.0), by });
        }
        let value = Box::new(mesh.clone());
        self.meshes.remove(&id);
        self.shape_count -= value.shape_count();
        self.changes.meshes.remove(&id);
        self.changes.removed_meshes.insert(id);
        Ok(Edit::AddMesh { mesh: id, value })
    }

    /// Whether so many spheres and boxes may be added once `fewer` are gone.
    fn require_shapes(&self, more: usize, fewer: usize) -> Result<(), EditError> {
        let count = (self.shape_count + more).saturating_sub(fewer);
        match count > MOST_SHAPES_IN_ALL && !self.restoring {
            true => Err(EditError::TooManyShapes { count }),
            false => Ok(()),
        }
    }

    fn user_of_mesh(&self, id: MeshId) -> Option<String> {
        if let Some(prefab) = self.prefabs.values().find(|prefab| prefab.meshes.contains(&id)) {
            return Some(format!("prefab {}", prefab.name));
        }
        let places = |node: &Node| matches!(node.kind, NodeKind::Mesh { mesh, .. } if mesh == id);
        self.nodes().find(|(_, node)| places(node)).map(|(node, value)| shown(&value.name, "node", node.0))
    }

    pub(super) fn set_shapes(&mut self, id: MeshId, source: ShapeSource) -> Result<Edit, EditError> {
        let shapes = Shapes::new(source)?;
        let none = || EditError::NoAsset(format!("mesh {}", id.0));
        let (more, fewer) = (shapes.list().len(), self.meshes.get(&id).ok_or_else(none)?.shape_count());
        self.require_shapes(more, fewer)?;
        let mesh = self.meshes.get_mut(&id).ok_or_else(none)?;
        let old = mesh.replace_shapes(shapes).ok_or(EditError::OtherShapes)?;
        self.shape_count = self.shape_count + more - fewer;
        self.changes.meshes.insert(id);
        Ok(Edit::SetShapes { mesh: id, source: Box::new(old) })
    }
}
