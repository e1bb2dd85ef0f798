//! World transforms and effective visibility, kept with dirty flags.
//! In: nodes marked dirty by edits. Out: cached `world_from_node`, and which targets really changed.
//! Moving a node costs its subtree; nothing here recurses, so depth is no limit.

use glam::DAffine3;

use super::{Document, PartStates, Slot, node_content, part_content};
use crate::changes::ChangeSet;
use crate::ids::{NodeId, Target};
use crate::prefab::{PartOverride, Prefab};

impl Document {
    /// World transform of a node or part; `None` when it is not in the document. Right also before
    /// [`Self::update_transforms`], then at the cost of the way up to a node that is up to date.
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
            chain.push(self.local(here)?.to_affine());
            at = self.part(here)?.parent;
        }
        let world = self.world_from_node(target.node)?;
        Some(chain.into_iter().rev().fold(world, |world, local| world * local))
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

    /// Whether a target and everything above it is visible.
    pub fn effectively_visible(&self, target: Target) -> bool {
        self.contains(target)
            && std::iter::successors(Some(target), |&t| self.parent_of(t))
                .all(|t| self.visible(t) == Some(true))
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

    fn has_dirty_parts(&self, node: NodeId) -> bool {
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

    /// Computes every stale world transform again and returns how many nodes and parts that were.
    pub fn update_transforms(&mut self) -> usize {
        let mut computed = 0;
        for node in std::mem::take(&mut self.dirty) {
            if self.slots.get(&node).is_some_and(|slot| slot.dirty) {
                let top = self.topmost_dirty(node);
                computed += self.update_subtree(top);
            }
        }
        for target in std::mem::take(&mut self.dirty_parts) {
            computed += self.update_part_subtree(target);
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
            if world != slot.world {
                self.changes.target_moved(Target::node(id), content);
            }
            if shown != slot.shown {
                self.changes.target_changed(Target::node(id), content);
            }
            (slot.world, slot.shown, slot.dirty) = (world, shown, false);
            computed += 1;
            if let Some(prefab) = slot.node.prefab().and_then(|p| self.prefabs.get(&p)) {
                computed += update_parts(id, slot, prefab, 0..u32::MAX, &mut self.changes);
            }
            stack.extend(slot.node.children.iter().map(|&child| (child, world, shown)));
        }
        computed
    }

    fn update_part_subtree(&mut self, target: Target) -> usize {
        let (Some(part), Some(slot)) = (target.part, self.slots.get_mut(&target.node)) else {
            return 0;
        };
        let Some(prefab) = slot.node.prefab().and_then(|p| self.prefabs.get(&p)) else {
            return 0;
        };
        let range = part..prefab.subtree_end(part);
        update_parts(target.node, slot, prefab, range, &mut self.changes)
    }
}

/// Computes a run of parts again; those above the run, and the instance itself, are up to date.
fn update_parts(
    id: NodeId,
    slot: &mut Slot,
    prefab: &Prefab,
    range: std::ops::Range<u32>,
    changes: &mut ChangeSet,
) -> usize {
    let PartStates { worlds, shown, overrides } = &mut slot.parts;
    worlds.resize(prefab.nodes().len(), DAffine3::IDENTITY);
    shown.resize(prefab.nodes().len(), true);
    let run = range.start as usize..(range.end as usize).min(prefab.nodes().len());
    let computed = run.len();
    for index in run {
        let Some(part) = prefab.nodes().get(index) else {
            continue;
        };
        let change: Option<&PartOverride> = overrides.get(&(index as u32));
        let local = change.and_then(|o| o.local).unwrap_or(part.local);
        let visible = change.and_then(|o| o.visible).unwrap_or(part.visible);
        let parent = part.parent.map(|p| p as usize);
        let above_world = parent.and_then(|p| worlds.get(p).copied()).unwrap_or(slot.world);
        let above_shown = parent.and_then(|p| shown.get(p).copied()).unwrap_or(slot.shown);
        let now = (above_world * local.to_affine(), above_shown && visible);
        let target = Target::part(id, index as u32);
        let content = part_content(part);
        if let Some(world) = worlds.get_mut(index)
            && *world != now.0
        {
            *world = now.0;
            changes.target_moved(target, content);
        }
        if let Some(old) = shown.get_mut(index)
            && *old != now.1
        {
            *old = now.1;
            changes.target_changed(target, content);
        }
    }
    computed
}
