//! Carries out edits of instances: the prefab that they show, its scene, and the variant of its materials.

use std::collections::{BTreeMap, BTreeSet};

use super::Document;
use crate::edit::{Edit, EditError};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId, Target};
use crate::node::{Node, NodeKind};

impl Document {
    /// The variant of materials that an instance shows.
    pub fn variant_of(&self, node: NodeId) -> Option<&str> {
        match &self.node(node)?.kind {
            NodeKind::Prefab { variant, .. } => variant.as_deref(),
            _ => None,
        }
    }

    /// The scene of its source that an instance is to show; `None`: the one that the source shows by itself.
    pub fn scene_of(&self, node: NodeId) -> Option<&str> {
        match &self.node(node)?.kind {
            NodeKind::Prefab { scene, .. } => scene.as_deref(),
            _ => None,
        }
    }

    /// Whether the scene that an instance shows does not have a part.
    pub(crate) fn is_absent(&self, target: Target) -> bool {
        self.slots.get(&target.node).zip(target.part).is_some_and(|(slot, part)| slot.parts.is_absent(part))
    }

    pub(super) fn set_scene(&mut self, node: NodeId, scene: Option<String>) -> Result<Edit, EditError> {
        let prefab = self.require_instance(node)?;
        let known = self.prefab(prefab).map(|prefab| prefab.scene_names()).unwrap_or_default();
        if let Some(name) = scene.as_ref().filter(|name| !known.contains(name) && !self.restoring) {
            return Err(EditError::NoScene(name.clone()));
        }
        self.report_removed(node);
        let mut old = None;
        if let NodeKind::Prefab { scene: shown, .. } = &mut self.node_mut(Target::node(node))?.kind {
            old = std::mem::replace(shown, scene);
        }
        self.state_parts(node);
        self.changes.structure = true;
        Ok(Edit::SetScene { node, scene: old })
    }

    pub(super) fn set_prefab(&mut self, node: NodeId, prefab: PrefabId) -> Result<Edit, EditError> {
        if !self.prefabs.contains_key(&prefab) {
            return Err(EditError::NoAsset(format!("prefab {}", prefab.0)));
        }
        let before = self.require_instance(node)?;
        self.require_room(0, self.parts_of(Some(prefab)), self.parts_of(Some(before)))?;
        self.report_removed(node);
        let mut old = prefab;
        if let NodeKind::Prefab { prefab: shown, .. } = &mut self.node_mut(Target::node(node))?.kind {
            old = std::mem::replace(shown, prefab);
        }
        self.state_parts(node);
        self.changes.structure = true;
        Ok(Edit::SetPrefab { node, prefab: old })
    }

    /// Derives anew what is known of the parts of an instance whose prefab is another now, and tells of them as added.
    pub(super) fn state_parts(&mut self, node: NodeId) {
        let parts = self.node(node).map(|node| self.part_states(node));
        if let (Some(parts), Some(slot)) = (parts, self.slots.get_mut(&node)) {
            self.part_count += parts.worlds.len();
            self.part_count -= slot.parts.worlds.len();
            slot.parts = parts;
        }
        self.mark_dirty(node);
        self.report_added(node);
    }

    pub(super) fn set_variant(&mut self, node: NodeId, variant: Option<String>) -> Result<Edit, EditError> {
        let prefab = self.require_instance(node)?;
        let known = self.prefab(prefab).map(|prefab| prefab.variants()).unwrap_or_default();
        if let Some(name) = variant.as_ref().filter(|name| !known.contains(name) && !self.restoring) {
            return Err(EditError::NoVariant(name.clone()));
        }
        let mut old = None;
        if let NodeKind::Prefab { variant: shown, .. } = &mut self.node_mut(Target::node(node))?.kind {
            old = std::mem::replace(shown, variant);
        }
        let varied = self.node(node).map(|node| self.varied_materials(node)).unwrap_or_default();
        let mut meshes: BTreeSet<MeshId> = varied.keys().map(|(mesh, _)| *mesh).collect();
        if let Some(slot) = self.slots.get_mut(&node) {
            meshes.extend(slot.parts.varied.keys().map(|(mesh, _)| *mesh));
            slot.parts.varied = varied;
        }
        let parts = self.prefab(prefab).map(|prefab| prefab.nodes()).unwrap_or_default();
        let touched =
            (0..).zip(parts).filter(|(_, part)| part.mesh.is_some_and(|mesh| meshes.contains(&mesh)));
        let targets: Vec<Target> = touched.map(|(part, _)| Target::part(node, part)).collect();
        targets.into_iter().for_each(|target| self.report_changed(target));
        Ok(Edit::SetVariant { node, variant: old })
    }

    /// The materials that the variant of an instance chooses, by mesh and primitive.
    pub(super) fn varied_materials(&self, node: &Node) -> BTreeMap<(MeshId, u32), MaterialId> {
        let NodeKind::Prefab { prefab, variant: Some(variant), .. } = &node.kind else {
            return BTreeMap::new();
        };
        self.prefab(*prefab).map(|prefab| prefab.variant_materials(variant)).unwrap_or_default()
    }

    /// The material that the variant of an instance chooses for a primitive of a part.
    pub(super) fn varied_material(&self, target: Target, primitive: u32) -> Option<&MaterialId> {
        let varied = &self.slots.get(&target.node)?.parts.varied;
        varied.get(&(self.part(target)?.mesh?, primitive))
    }

    fn require_instance(&self, node: NodeId) -> Result<PrefabId, EditError> {
        let wrong = EditError::WrongKind { target: Target::node(node), wanted: "instance" };
        self.node(node).ok_or(EditError::NoNode(node))?.prefab().ok_or(wrong)
    }
}
