//! Locks: which edits touch what the user has locked. Whoever takes edits from the user asks before it applies them;
//! undo and redo never ask, because what they restore was there before.

use super::Document;
use crate::edit::{Edit, EditError};
use crate::ids::{NodeId, Target};

impl Document {
    /// The node whose lock keeps a target from being changed: its own, or one above it.
    pub fn locked_by(&self, target: Target) -> Option<NodeId> {
        let nodes = std::iter::successors(Some(target.node), |&id| self.node(id)?.parent);
        nodes.into_iter().find(|&id| self.node(id).is_some_and(|node| node.locked))
    }

    /// The node whose lock an edit would touch. What is locked can still be hidden and shown, and it follows when what is
    /// above it moves; materials and what lies inside of a mesh are locked with no node, since others may share them.
    pub fn locked_against(&self, edit: &Edit) -> Option<NodeId> {
        match edit {
            Edit::SetTransform { target, .. }
            | Edit::Rename { target, .. }
            | Edit::SetRayVisibility { target, .. }
            | Edit::SetMorphWeights { target, .. }
            | Edit::ResetOverride { target, .. }
            | Edit::AssignMaterial { target, .. }
            | Edit::SetLight { target, .. }
            | Edit::SetCamera { target, .. } => self.locked_by(*target),
            Edit::SetClip { node, .. }
            | Edit::SetVariant { node, .. }
            | Edit::SetScene { node, .. }
            | Edit::SetPrefab { node, .. } => self.locked_by((*node).into()),
            Edit::AddNode { parent, .. } => parent.and_then(|parent| self.locked_by(parent.into())),
            Edit::Reparent { node, parent, .. } => {
                let above = parent.and_then(|parent| self.locked_by(parent.into()));
                self.locked_by((*node).into()).or(above)
            }
            Edit::RemoveNode { node } => {
                let locked = |id: &NodeId| self.node(*id).is_some_and(|node| node.locked);
                self.locked_by((*node).into()).or_else(|| self.subtree_ids(*node).into_iter().find(locked))
            }
            Edit::Batch { edits, .. } => edits.iter().find_map(|edit| self.locked_against(edit)),
            Edit::SetLocked { .. }
            | Edit::SetVisible { .. }
            | Edit::SetMaterial { .. }
            | Edit::AddMaterial { .. }
            | Edit::RemoveMaterial { .. }
            | Edit::SetEnvironment(_)
            | Edit::SetDefaultCamera(_)
            | Edit::SetPrimitiveTransform { .. }
            | Edit::AddMesh { .. }
            | Edit::RemoveMesh { .. }
            | Edit::SetShapes { .. }
            | Edit::AddPrefab(_)
            | Edit::RemovePrefab { .. }
            | Edit::ReplacePrefab(_) => None,
        }
    }

    pub(super) fn set_locked(&mut self, node: NodeId, locked: bool) -> Result<Edit, EditError> {
        let old = std::mem::replace(&mut self.node_mut(Target::node(node))?.locked, locked);
        self.changes.structure = true;
        Ok(Edit::SetLocked { node, locked: old })
    }
}
