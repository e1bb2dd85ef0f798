//! What the reader of the changes is told: everything at first, then what differs since the last drain.

use super::{Document, Slot, node_content, part_content, prefab_of};
use crate::changes::{ChangeSet, Content};
use crate::ids::{NodeId, Target};
use crate::prefab::Prefab;

impl Document {
    /// Whether [`Self::drain_changes`] would tell of anything.
    pub fn has_changes(&self) -> bool {
        self.material_pose_stale
            || !self.dirty.is_empty()
            || !self.dirty_parts.is_empty()
            || self.changes != ChangeSet::default()
    }

    /// Brings transforms up to date and hands out what changed since the last call. The first call tells of
    /// everything as added. Work is proportional to the change.
    pub fn drain_changes(&mut self) -> ChangeSet {
        self.update_transforms();
        self.update_material_pose();
        let mut changes = std::mem::take(&mut self.changes);
        let known_whole = |target: &Target| !changes.added.contains_key(target);
        changes.lights.retain(known_whole);
        changes.cameras.retain(known_whole);
        let meshes = &changes.meshes;
        changes.primitive_transforms.retain(|(mesh, _)| !meshes.contains(mesh));
        let may_differ = changes.environment
            || changes.structure
            || !changes.added.is_empty()
            || !changes.removed.is_empty()
            || !changes.instances.is_empty()
            || !changes.visibility.is_empty();
        changes.environment |= self.environment_differs(may_differ);
        for target in changes.removed.keys() {
            self.reported.remove(target);
        }
        self.reported.extend(changes.added.keys().copied());
        changes
    }

    /// Makes the next drain tell of everything as added, as for a renderer that starts afresh.
    pub fn mark_all_added(&mut self, reason: &str) {
        // Whoever asks for places before the next drain would walk up to the root each time.
        self.update_transforms();
        self.changes = ChangeSet {
            environment: true,
            structure: true,
            meshes: self.meshes.keys().copied().collect(),
            materials: self.materials.keys().copied().collect(),
            textures: self.textures.keys().copied().collect(),
            ..ChangeSet::default()
        };
        self.changes.add_reason(reason.to_owned());
        self.reported.clear();
        for (&id, slot) in &self.slots {
            for (target, content) in contents(id, slot, prefab_of(&self.prefabs, slot)) {
                self.changes.target_added(target, content);
            }
        }
    }

    /// Takes in a node with the parts of its instance that is new in the document.
    pub(super) fn report_added(&mut self, id: NodeId) {
        let Some(slot) = self.slots.get(&id) else {
            return;
        };
        let prefab = prefab_of(&self.prefabs, slot);
        if prefab.is_some_and(Prefab::is_animated) {
            self.animated.insert(id);
            self.material_pose_stale |= self.time_s.is_some();
        }
        for (target, content) in contents(id, slot, prefab) {
            self.changes.target_added(target, content);
        }
        self.note_surroundings(id);
    }

    /// Takes leave of a node with the parts of its instance, which is still in the document.
    pub(super) fn report_removed(&mut self, id: NodeId) {
        let Some(slot) = self.slots.get(&id) else {
            return;
        };
        for (target, content) in contents(id, slot, prefab_of(&self.prefabs, slot)) {
            let known = self.reported.contains(&target);
            self.changes.target_removed(target, content, known);
        }
        self.material_pose_stale |= self.animated.remove(&id) && self.time_s.is_some();
        self.surroundings.remove(id);
    }
}

/// A node and the parts of its instance, with what they bring.
fn contents<'a>(
    id: NodeId,
    slot: &'a Slot,
    prefab: Option<&'a Prefab>,
) -> impl Iterator<Item = (Target, Content)> + 'a {
    let own = (Target::node(id), node_content(&slot.node.kind));
    let parts = prefab
        .into_iter()
        .flat_map(|prefab| (0..).zip(prefab.nodes()))
        .filter(|(part, _)| !slot.parts.is_absent(*part));
    std::iter::once(own).chain(parts.map(move |(part, node)| (Target::part(id, part), part_content(node))))
}
