//! Carries out edits of the tree: add, remove, regroup, duplicate.
//! Nothing here recurses, so depth is no limit.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;

use super::{Document, PartStates, Slot};
use crate::edit::{Edit, EditError};
use crate::ids::{NodeId, PrefabId, Target};
use crate::node::{MAX_NODES, Node, NodeKind, Subtree};
use crate::prefab::PartOverride;
use crate::transform::Local;

impl Document {
    pub(super) fn add_node(
        &mut self,
        parent: Option<NodeId>,
        index: usize,
        subtree: Subtree,
    ) -> Result<Edit, EditError> {
        let Some(top) = subtree.top() else {
            return Err(EditError::NoTree("it is empty".to_owned()));
        };
        if let Some(parent) = parent {
            self.require_node(parent)?;
        }
        self.check_subtree(&subtree)?;
        let parts = subtree.nodes.iter().map(|(_, node)| self.parts_of(node.prefab()));
        self.require_room(subtree.nodes.len(), parts.fold(0, usize::saturating_add), 0)?;
        let mut ids = Vec::with_capacity(subtree.nodes.len());
        for (id, mut node) in subtree.nodes {
            node.children.clear();
            if id == top {
                node.parent = parent;
            } else if let Some(above) = node.parent.and_then(|p| self.slots.get_mut(&p)) {
                above.node.children.push(id);
            }
            self.reserve_ids_up_to(id.0);
            let parts = self.part_states(&node);
            self.part_count += parts.worlds.len();
            self.slots.insert(id, Slot { node, world: DAffine3::IDENTITY, shown: true, dirty: false, parts });
            ids.push(id);
        }
        let siblings = self.siblings_mut(parent)?;
        siblings.insert(index.min(siblings.len()), top);
        self.mark_dirty(top);
        for id in ids {
            self.report_added(id);
        }
        self.changes.structure = true;
        Ok(Edit::RemoveNode { node: top })
    }

    pub(super) fn remove_node(&mut self, top: NodeId) -> Result<Edit, EditError> {
        let parent = self.node(top).map(|node| node.parent).ok_or(EditError::NoNode(top))?;
        let siblings = self.siblings_mut(parent)?;
        let index = take_out(siblings, top);
        let mut subtree = Subtree::default();
        for id in self.subtree_ids(top) {
            self.report_removed(id);
            self.forget_dirty_parts(id);
            if let Some(slot) = self.slots.remove(&id) {
                self.part_count -= slot.parts.worlds.len();
                subtree.nodes.push((id, slot.node));
            }
        }
        self.changes.structure = true;
        Ok(Edit::AddNode { parent, index, subtree })
    }

    pub(super) fn reparent(
        &mut self,
        node: NodeId,
        parent: Option<NodeId>,
        index: usize,
        local: Local,
    ) -> Result<Edit, EditError> {
        if !local.is_finite() {
            return Err(EditError::NotFinite);
        }
        self.require_node(node)?;
        if let Some(parent) = parent {
            self.require_node(parent)?;
            if self.is_within(Target::node(parent), Target::node(node)) {
                return Err(EditError::Cycle);
            }
        }
        let moved = self.node_mut(Target::node(node))?;
        let old_parent = std::mem::replace(&mut moved.parent, parent);
        let old_local = std::mem::replace(&mut moved.local, local);
        let siblings = self.siblings_mut(old_parent)?;
        let old_index = take_out(siblings, node);
        let siblings = self.siblings_mut(parent)?;
        siblings.insert(index.min(siblings.len()), node);
        // Dirty again from here even if it was: what is above it is another now.
        self.mark_dirty(node);
        self.changes.structure = true;
        Ok(Edit::Reparent { node, parent: old_parent, index: old_index, local: old_local })
    }

    /// The edit that hangs a node elsewhere and keeps it where it is in the world. Below a flattened parent
    /// that is impossible: the node then keeps its local transform.
    ///
    /// # Errors
    /// When node or parent are not in the document.
    pub fn reparent_edit(
        &self,
        node: NodeId,
        parent: Option<NodeId>,
        index: usize,
    ) -> Result<Edit, EditError> {
        let world_from_node = self.world_from(Target::node(node)).ok_or(EditError::NoNode(node))?;
        let world_from_parent = match parent {
            Some(parent) => self.world_from(Target::node(parent)).ok_or(EditError::NoNode(parent))?,
            None => DAffine3::IDENTITY,
        };
        let kept = world_from_parent.inverse() * world_from_node;
        let local = match self.node(node) {
            _ if kept.is_finite() => Local::from_affine(kept),
            Some(node) => node.local,
            None => Local::default(),
        };
        Ok(Edit::Reparent { node, parent, index, local })
    }

    /// The edit that adds a copy of a node with everything below it, right after it; assets are shared.
    ///
    /// # Errors
    /// When the node is not in the document.
    pub fn duplicate_edit(&mut self, node: NodeId) -> Result<(NodeId, Edit), EditError> {
        self.require_node(node)?;
        let ids = self.subtree_ids(node);
        let fresh: BTreeMap<NodeId, NodeId> =
            ids.iter().map(|&id| (id, NodeId(self.allocate_id()))).collect();
        let mut subtree = Subtree::default();
        for id in &ids {
            if let (Some(&new), Some(node)) = (fresh.get(id), self.node(*id)) {
                let parent = node.parent.and_then(|p| fresh.get(&p).copied());
                let copy = Node { parent, ..node.clone() };
                subtree.nodes.push((new, copy));
            }
        }
        let top = subtree.top().ok_or(EditError::NoNode(node))?;
        let parent = self.node(node).and_then(|node| node.parent);
        let siblings = match parent.and_then(|p| self.node(p)) {
            Some(parent) => &parent.children,
            None => &self.roots,
        };
        let index = siblings.iter().position(|&id| id == node).unwrap_or(0) + 1;
        let label = format!("duplicated {}", self.display_name(Target::node(node)));
        let add = Edit::AddNode { parent, index, subtree };
        Ok((top, Edit::batch(label, vec![add])))
    }

    /// A node and everything below it, parents first, children in order.
    pub fn subtree_ids(&self, top: NodeId) -> Vec<NodeId> {
        let mut ids = Vec::new();
        let mut stack = vec![top];
        while let Some(id) = stack.pop() {
            if let Some(node) = self.node(id) {
                ids.push(id);
                stack.extend(node.children.iter().rev());
            }
        }
        ids
    }

    fn siblings_mut(&mut self, parent: Option<NodeId>) -> Result<&mut Vec<NodeId>, EditError> {
        match parent {
            None => Ok(&mut self.roots),
            Some(id) => Ok(&mut self.node_mut(Target::node(id))?.children),
        }
    }

    fn require_node(&self, id: NodeId) -> Result<(), EditError> {
        match self.slots.contains_key(&id) {
            true => Ok(()),
            false => Err(EditError::NoNode(id)),
        }
    }

    fn check_subtree(&self, subtree: &Subtree) -> Result<(), EditError> {
        let mut seen = BTreeSet::new();
        for (place, (id, node)) in subtree.nodes.iter().enumerate() {
            if place > 0 && !node.parent.is_some_and(|parent| seen.contains(&parent)) {
                let what = format!("node {} does not follow its parent", id.0);
                return Err(EditError::NoTree(what));
            }
            if self.slots.contains_key(id) || !seen.insert(*id) {
                return Err(EditError::Taken(format!("node {}", id.0)));
            }
            self.check_node(node)?;
        }
        Ok(())
    }

    fn check_node(&self, node: &Node) -> Result<(), EditError> {
        let finite = match &node.kind {
            NodeKind::Light(light) => light.is_finite(),
            NodeKind::Camera(camera) => camera.is_finite(),
            NodeKind::Mesh { weights, .. } => weights.iter().all(|weight| weight.is_finite()),
            NodeKind::Prefab { overrides, .. } => overrides.values().all(PartOverride::is_finite),
            NodeKind::Group => true,
        };
        if !finite || !node.local.is_finite() {
            return Err(EditError::NotFinite);
        }
        match &node.kind {
            NodeKind::Prefab { prefab, .. } if !self.prefabs.contains_key(prefab) => {
                Err(EditError::NoAsset(format!("prefab {}", prefab.0)))
            }
            NodeKind::Mesh { mesh, .. } if !self.meshes.contains_key(mesh) && !self.restoring => {
                Err(EditError::NoAsset(format!("mesh {}", mesh.0)))
            }
            _ => Ok(()),
        }
    }

    /// How many parts an instance of the prefab has.
    pub(crate) fn parts_of(&self, prefab: Option<PrefabId>) -> usize {
        prefab.and_then(|id| self.prefabs.get(&id)).map_or(0, |prefab| prefab.nodes().len())
    }

    /// Whether so many nodes and parts more, and `fewer` parts, leave the document within what it can have. What was there
    /// before is there again in any case.
    pub(crate) fn require_room(&self, nodes: usize, parts: usize, fewer: usize) -> Result<(), EditError> {
        let have = self.slots.len() + self.part_count;
        let count = have.saturating_add(nodes).saturating_add(parts).saturating_sub(fewer);
        match count > MAX_NODES && !self.restoring {
            true => Err(EditError::TooManyNodes { count }),
            false => Ok(()),
        }
    }

    /// The derived state of an instance, before its transforms are computed.
    pub(super) fn part_states(&self, node: &Node) -> PartStates {
        let NodeKind::Prefab { prefab, overrides, scene, .. } = &node.kind else {
            return PartStates::default();
        };
        let Some(prefab) = self.prefabs.get(prefab) else {
            return PartStates::default();
        };
        PartStates {
            worlds: vec![DAffine3::IDENTITY; prefab.nodes().len()],
            in_instance: Vec::new(),
            shown: vec![true; prefab.nodes().len()],
            overrides: overrides
                .iter()
                .filter_map(|(path, value)| Some((prefab.part_at(path)?, value.clone())))
                .collect(),
            varied: self.varied_materials(node),
            pose: self.pose_of(node),
            absent: prefab.absent_in(scene.as_deref()),
        }
    }
}

/// Takes a node out of the list of its siblings and returns where it was. Searched from the end: who removes many begins there.
fn take_out(siblings: &mut Vec<NodeId>, node: NodeId) -> usize {
    let index = siblings.iter().rposition(|&id| id == node);
    if let Some(index) = index {
        siblings.remove(index);
    }
    index.unwrap_or(0)
}
