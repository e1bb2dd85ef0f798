//! Carries out edits of what deforms and plays: weights of morph targets, and clips of instances.

use super::Document;
use super::apply::reset;
use crate::animation::ClipChoice;
use crate::edit::{Edit, EditError, OverrideField};
use crate::ids::{NodeId, Target};
use crate::node::NodeKind;

impl Document {
    pub(super) fn set_morph_weights(&mut self, target: Target, weights: Vec<f32>) -> Result<Edit, EditError> {
        let wrong_kind = EditError::WrongKind { target, wanted: "mesh with morph targets" };
        let before = self.shown_weights(target);
        if !self.restoring {
            let wanted = before.as_ref().ok_or(wrong_kind.clone())?.len();
            let found = weights.len();
            let follows_mesh = found == 0 && target.part.is_none();
            if wanted != found && !follows_mesh {
                return Err(EditError::WeightCount { wanted, found });
            }
        }
        if !weights.iter().all(|weight| weight.is_finite()) {
            return Err(EditError::NotFinite);
        }
        let inverse = match target.part {
            None => match &mut self.node_mut(target)?.kind {
                NodeKind::Mesh { weights: own, .. } => {
                    Edit::SetMorphWeights { target, weights: std::mem::replace(own, weights) }
                }
                _ => return Err(wrong_kind),
            },
            Some(_) => match self.change_override(target, |o| o.weights = Some(weights))?.weights {
                Some(weights) => Edit::SetMorphWeights { target, weights },
                None => reset(target, OverrideField::Weights),
            },
        };
        self.report_weights(target, before);
        Ok(inverse)
    }

    /// Marks a placed mesh whose weights are shown differently than before.
    pub(super) fn report_weights(&mut self, target: Target, before: Option<Vec<f32>>) {
        if self.shown_weights(target) != before {
            self.changes.target_bent(target);
        }
    }

    pub(super) fn set_clip(&mut self, node: NodeId, choice: ClipChoice) -> Result<Edit, EditError> {
        let target = Target::node(node);
        let NodeKind::Prefab { clip, .. } = &mut self.node_mut(target)?.kind else {
            return Err(EditError::WrongKind { target, wanted: "instance" });
        };
        let old = std::mem::replace(clip, choice);
        if let Some(pose) = self.node(node).map(|node| self.pose_of(node)) {
            self.lay_pose(node, pose);
        }
        Ok(Edit::SetClip { node, clip: old })
    }
}
