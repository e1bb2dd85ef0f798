//! What is selected: objects, one of which is active, and perhaps one primitive of its mesh. Enters: targets that were
//! clicked. Leaves: who is to be shown, moved and edited. It changes no document.

use std::collections::BTreeSet;

use caustica_scene::{Document, MeshId, Target};
use glam::{DAffine3, DVec3};

/// What is selected. The active target is the one the inspector shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    targets: BTreeSet<Target>,
    active: Option<Target>,
    /// Of the active target's mesh: which one, and its middle.
    primitive: Option<(u32, DVec3)>,
}

/// The primitive that is selected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelectedPrimitive {
    /// Who places its mesh.
    pub target: Target,
    /// Its mesh.
    pub mesh: MeshId,
    /// Its index there.
    pub index: u32,
    /// Where it is in its mesh.
    pub mesh_from_primitive: DAffine3,
    /// Middle of its box, primitive space.
    pub middle: DVec3,
}

impl Selection {
    /// Everything selected.
    pub fn targets(&self) -> &BTreeSet<Target> {
        &self.targets
    }

    /// The one selected last.
    pub fn active(&self) -> Option<Target> {
        self.active
    }

    /// Selects one primitive of the active target's mesh, or none. Whatever is selected next forgets it.
    pub fn set_primitive(&mut self, document: &Document, index: Option<u32>) {
        let middle = |index: u32| {
            let mesh = document.mesh(document.mesh_of(self.active?)?)?;
            let (low, high) = mesh.primitive_bounds(index as usize)?;
            Some((index, (low + high) * 0.5))
        };
        self.primitive = index.and_then(middle);
    }

    /// The selected primitive.
    pub fn primitive(&self, document: &Document) -> Option<SelectedPrimitive> {
        let (target, (index, middle)) = (self.active?, self.primitive?);
        let mesh = document.mesh_of(target)?;
        let mesh_from_primitive = document.mesh(mesh)?.primitives.get(index as usize)?.mesh_from_primitive;
        Some(SelectedPrimitive { target, mesh, index, mesh_from_primitive, middle })
    }

    /// Whether a target is selected.
    pub fn contains(&self, target: Target) -> bool {
        self.targets.contains(&target)
    }

    /// Whether nothing is selected.
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }

    /// Selects nothing.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Selects this alone.
    pub fn set(&mut self, target: Target) {
        self.clear();
        self.add(target);
    }

    /// Selects these; the last one becomes active.
    pub fn set_all(&mut self, targets: impl IntoIterator<Item = Target>) {
        self.clear();
        for target in targets {
            self.add(target);
        }
    }

    /// Selects this too.
    pub fn add(&mut self, target: Target) {
        self.targets.insert(target);
        self.activate(Some(target));
    }

    fn activate(&mut self, target: Option<Target>) {
        self.active = target;
        self.primitive = None;
    }

    /// Selects or deselects this and leaves the rest.
    pub fn toggle(&mut self, target: Target) {
        if self.targets.remove(&target) {
            self.activate(self.targets.last().copied());
        } else {
            self.add(target);
        }
    }

    /// Drops what is no longer in the document.
    pub fn retain_in(&mut self, document: &Document) {
        self.targets.retain(|target| document.contains(*target));
        if self.active.is_some_and(|target| !self.targets.contains(&target)) {
            self.activate(self.targets.last().copied());
        }
    }

    /// The selected targets that hang below no other selected one: what a move has to touch.
    pub fn tops(&self, document: &Document) -> Vec<Target> {
        let below_another = |target: Target| {
            std::iter::successors(document.parent_of(target), |&t| document.parent_of(t))
                .any(|t| self.targets.contains(&t))
        };
        self.targets.iter().copied().filter(|&target| !below_another(target)).collect()
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use std::sync::Arc;

    use caustica_scene::import::Imported;
    use caustica_scene::{
        Local, Material, MaterialId, Mesh, MeshData, Node, NodeKind, PartNode, Prefab, Primitive,
    };
    use glam::Vec3;

    use super::*;

    #[test]
    fn tops_leave_out_what_moves_with_its_parent() {
        let mut document = Document::new();
        let add = |document: &mut Document, parent| {
            let (id, edit) = document.add_edit(Node::new("n", NodeKind::Group), parent);
            document.apply(edit).unwrap();
            id
        };
        let root = add(&mut document, None);
        let child = add(&mut document, Some(root));
        let grandchild = add(&mut document, Some(child));
        let other = add(&mut document, None);
        let mut selection = Selection::default();
        selection.set_all([grandchild, root, other].map(Target::node));
        assert_eq!(selection.tops(&document), [root, other].map(Target::node));
        assert_eq!(selection.active(), Some(Target::node(other)));
    }

    #[test]
    fn toggling_moves_the_active_target_on() {
        let (a, b) = (Target::part(caustica_scene::NodeId(1), 0), Target::part(caustica_scene::NodeId(1), 1));
        let mut selection = Selection::default();
        selection.set(a);
        selection.toggle(b);
        assert_eq!(selection.active(), Some(b));
        selection.toggle(b);
        assert_eq!(selection.active(), Some(a));
        selection.retain_in(&Document::new());
        assert!(selection.is_empty() && selection.active().is_none());
    }

    #[test]
    fn a_primitive_is_selected_until_something_else_is() {
        let mut document = Document::new();
        let corners = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 4.0];
        let data = MeshData { positions: corners.to_vec(), indices: vec![0, 1, 2], ..MeshData::default() };
        let mesh_from_primitive = DAffine3::from_translation(DVec3::Z);
        let triangle =
            Primitive { first_index: 0, index_count: 3, material: MaterialId(0), mesh_from_primitive };
        let mut part = PartNode { mesh: Some(MeshId(0)), visible: true, ..PartNode::default() };
        part.name = String::from("part");
        let mut prefab = Prefab::new("model", "model.gltf");
        prefab.set_nodes(vec![part]).unwrap();
        let imported = Imported {
            prefab,
            meshes: vec![Mesh::new(String::from("mesh"), Arc::new(data), vec![triangle])],
            materials: vec![Material::default()],
            textures: Vec::new(),
            warnings: Vec::new(),
        };
        let prefab = document.add_imported(imported).unwrap();
        let (node, edit) = document.instantiate_edit(prefab, None, Local::default());
        document.apply(edit).unwrap();
        let part = Target::part(node, 0);
        let mut selection = Selection::default();
        selection.set_primitive(&document, Some(0));
        assert_eq!(selection.primitive(&document), None, "nothing is active");

        selection.set(part);
        selection.set_primitive(&document, Some(1));
        assert_eq!(selection.primitive(&document), None, "there is no such primitive");
        selection.set_primitive(&document, Some(0));
        let selected = selection.primitive(&document).unwrap();
        assert_eq!((selected.target, selected.index), (part, 0));
        assert_eq!(selected.middle, DVec3::new(1.0, 2.0, 0.0), "as if it had not been moved");
        assert_eq!(selected.mesh_from_primitive, mesh_from_primitive);
        selection.set(part);
        assert_eq!(selection.primitive(&document), None);
    }
}
