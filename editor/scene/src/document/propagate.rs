//! World transforms and effective visibility, kept with dirty flags.
//! In: nodes marked dirty by edits. Out: cached `world_from_node`, and which targets really changed.
//! Moving a node costs its subtree; nothing here recurses, so depth is no limit.

use std::collections::BTreeSet;
use std::ops::Range;

use glam::DAffine3;

use super::{Document, Slot, node_content, part_content, prefab_of};
use crate::changes::{ChangeSet, Content};
use crate::ids::{NodeId, Target};
use crate::prefab::Prefab;

impl Document {
    /// World transform of a node or part, in the pose of the time that is shown; `None` when it is not in the
    /// document. Right also before [`Self::update_transforms`], then at the cost of the way up to a node that is
    /// up to date.
    pub fn world_from(&self, target: Target) -> Option<DAffine3> {
        let slot = self.slots.get(&target.node)?;
        let Some(part) = target.part else {
            return self.world_from_node(target.node);
        };
        if !slot.dirty && !self.has_dirty_parts(target.node) {
            return slot.parts.worlds.get(part as usize).copied();
        }
        let mut chain = Vec::new();
        let mut at = Some(part);
        while let Some(index) = at {
            let here = Target::part(target.node, index);
            chain.push(self.posed_local(here)?.to_affine());
            at = self.part(here)?.parent;
        }
        let world = self.world_from_node(target.node)?;
        Some(chain.into_iter().rev().fold(world, |world, local| world * local))
    }

    /// World transform of the mesh that a target places: that of the target, but a skinned mesh stands in the
    /// space of its instance, where its joints bend it.
    pub fn world_from_mesh(&self, target: Target) -> Option<DAffine3> {
        match self.is_skinned(target) {
            true => self.world_from(Target::node(target.node)),
            false => self.world_from(target),
        }
    }

    /// Whether a skin bends the mesh of a target.
    pub(super) fn is_skinned(&self, target: Target) -> bool {
        let prefab = self.slots.get(&target.node).and_then(|slot| prefab_of(&self.prefabs, slot));
        prefab.zip(target.part).is_some_and(|(prefab, part)| prefab.skin_of(part).is_some())
    }

    /// World transform of what a target hangs below; identity for roots.
    pub fn world_from_parent(&self, target: Target) -> Option<DAffine3> {
        if !self.contains(target) {
            return None;
        }
        match self.parent_of(target) {
            Some(parent) => self.world_from(parent),
            None => Some(DAffine3::IDENTITY),
        }
    }

    /// Whether a target and everything above it is visible in the pose of the time that is shown.
    pub fn effectively_visible(&self, target: Target) -> bool {
        self.contains(target)
            && std::iter::successors(Some(target), |&t| self.parent_of(t))
                .all(|t| self.posed_visible(t) == Some(true))
    }

    fn world_from_node(&self, node: NodeId) -> Option<DAffine3> {
        let mut chain = Vec::new();
        let mut at = Some(node);
        let mut world = DAffine3::IDENTITY;
        while let Some(id) = at {
            let slot = self.slots.get(&id)?;
            if !slot.dirty {
                world = slot.world;
                break;
            }
            chain.push(slot.node.local.to_affine());
            at = slot.node.parent;
        }
        Some(chain.into_iter().rev().fold(world, |world, local| world * local))
    }

    pub(super) fn has_dirty_parts(&self, node: NodeId) -> bool {
        let span = Target::node(node)..=Target::part(node, u32::MAX);
        self.dirty_parts.range(span).next().is_some()
    }

    /// Marks a node and everything below it as stale. Subtrees that are stale already are not walked again.
    pub(super) fn mark_dirty(&mut self, node: NodeId) {
        let mut stack = vec![node];
        while let Some(id) = stack.pop() {
            if let Some(slot) = self.slots.get_mut(&id)
                && !slot.dirty
            {
                slot.dirty = true;
                stack.extend_from_slice(&slot.node.children);
            }
        }
        self.dirty.push(node);
    }

    /// Marks a target: a part goes with its subtree inside the instance.
    pub(super) fn mark_target_dirty(&mut self, target: Target) {
        match target.part {
            None => self.mark_dirty(target.node),
            Some(_) => {
                self.dirty_parts.insert(target);
            }
        }
    }

    /// Forgets which parts of a node are stale.
    pub(super) fn forget_dirty_parts(&mut self, node: NodeId) {
        let span = Target::node(node)..=Target::part(node, u32::MAX);
        let stale: Vec<Target> = self.dirty_parts.range(span).copied().collect();
        for target in stale {
            self.dirty_parts.remove(&target);
        }
    }

    /// Computes every stale world transform again and returns how many nodes and parts that were.
    pub fn update_transforms(&mut self) -> usize {
        let mut computed = 0;
        for node in std::mem::take(&mut self.dirty) {
            if self.slots.get(&node).is_some_and(|slot| slot.dirty) {
                let top = self.topmost_dirty(node);
                computed += self.update_subtree(top);
            }
        }
        // In order, so that what lies below a part that was just computed comes right after it.
        let mut fresh = (None, 0..0);
        for target in std::mem::take(&mut self.dirty_parts) {
            let covered = target.part.is_some_and(|part| fresh.1.contains(&part));
            if fresh.0 != Some(target.node) || !covered {
                let run = self.update_part_subtree(target);
                computed += run.len();
                fresh = (Some(target.node), run);
            }
        }
        computed
    }

    fn topmost_dirty(&self, node: NodeId) -> NodeId {
        let dirty_parent = |&id: &NodeId| {
            let parent = self.slots.get(&id)?.node.parent?;
            self.slots.get(&parent)?.dirty.then_some(parent)
        };
        std::iter::successors(Some(node), dirty_parent).last().unwrap_or(node)
    }

    fn update_subtree(&mut self, top: NodeId) -> usize {
        let parent = self.slots.get(&top).and_then(|slot| slot.node.parent);
        let above = parent.and_then(|id| self.slots.get(&id));
        let (world, shown) = above.map_or((DAffine3::IDENTITY, true), |s| (s.world, s.shown));
        let mut computed = 0;
        let mut stack = vec![(top, world, shown)];
        while let Some((id, parent_world, parent_shown)) = stack.pop() {
            let Some(slot) = self.slots.get_mut(&id) else {
                continue;
            };
            let world = parent_world * slot.node.local.to_affine();
            let shown = parent_shown && slot.node.visible;
            let content = node_content(&slot.node.kind);
            let moved = world != slot.world;
            if moved {
                self.changes.target_moved(Target::node(id), content);
            }
            if shown != slot.shown {
                self.changes.target_shown(Target::node(id), content);
            }
            (slot.world, slot.shown, slot.dirty) = (world, shown, false);
            computed += 1;
            stack.extend(slot.node.children.iter().map(|&child| (child, world, shown)));
            if let Some(prefab) = prefab_of(&self.prefabs, slot) {
                computed += update_parts(id, slot, prefab, 0..u32::MAX, moved, &mut self.changes).len();
                if !self.dirty_parts.is_empty() {
                    self.forget_dirty_parts(id);
                }
            }
        }
        computed
    }

    /// Returns the run of parts that was computed.
    fn update_part_subtree(&mut self, target: Target) -> Range<u32> {
        let (Some(part), Some(slot)) = (target.part, self.slots.get_mut(&target.node)) else {
            return 0..0;
        };
        let Some(prefab) = prefab_of(&self.prefabs, slot) else {
            return 0..0;
        };
        let range = part..prefab.subtree_end(part);
        update_parts(target.node, slot, prefab, range, false, &mut self.changes)
    }
}

/// Computes a run of parts again; those above the run, and the instance itself, are up to date. `moved` says
/// that the instance has another place now. Returns the run, cut to the parts that there are.
fn update_parts(
    id: NodeId,
    slot: &mut Slot,
    prefab: &Prefab,
    range: Range<u32>,
    moved: bool,
    changes: &mut ChangeSet,
) -> Range<u32> {
    let count = prefab.nodes().len();
    slot.parts.worlds.resize(count, DAffine3::IDENTITY);
    slot.parts.shown.resize(count, true);
    slot.parts.in_instance.resize(if prefab.skins().is_empty() { 0 } else { count }, DAffine3::IDENTITY);
    let run = range.start..range.end.min(count as u32);
    let mut bent = BTreeSet::new();
    for index in run.clone() {
        let Some(part) = prefab.node(index) else {
            continue;
        };
        let target = Target::part(id, index);
        let absent = slot.parts.is_absent(index);
        let content = if absent { Content::default() } else { part_content(part) };
        let local = slot.parts.posed_local(index, part).to_affine();
        let parts = &mut slot.parts;
        let visible = !absent && parts.posed_visible(index, part);
        let above = part.parent.map(|parent| parent as usize);
        let world = above.and_then(|p| parts.worlds.get(p).copied()).unwrap_or(slot.world) * local;
        let shown = above.and_then(|p| parts.shown.get(p).copied()).unwrap_or(slot.shown) && visible;
        let part_moved = replace_at(&mut parts.worlds, index, world);
        let moved_content = match prefab.skin_of(index) {
            // A skinned mesh goes with its instance, not with its part.
            Some(_) => Content {
                mesh: moved && !absent,
                light: content.light && part_moved,
                camera: content.camera && part_moved,
            },
            None if part_moved => content,
            None => Content::default(),
        };
        changes.target_moved(target, moved_content);
        if replace_at(&mut parts.shown, index, shown) {
            changes.target_shown(target, content);
        }
        if parts.in_instance.is_empty() {
            continue;
        }
        let in_parent = above.and_then(|p| parts.in_instance.get(p).copied()).unwrap_or(DAffine3::IDENTITY);
        if replace_at(&mut parts.in_instance, index, in_parent * local) {
            bent.extend(prefab.bent_by(index));
        }
    }
    for part in bent.into_iter().filter(|part| !slot.parts.is_absent(*part)) {
        changes.target_bent(Target::part(id, part));
    }
    run
}

/// Puts a value in its place and says whether it is another than before; nothing happens past the end.
fn replace_at<T: PartialEq>(list: &mut [T], index: u32, value: T) -> bool {
    match list.get_mut(index as usize) {
        Some(old) if *old != value => {
            *old = value;
            true
        }
        _ => false,
    }
}
