//! What a time says about visibility, lights, cameras and materials, beside transforms and weights (`pose.rs`).
//! In: the poses of the instances. Out: the values that are shown; those of the document stay as they are.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::pose::{Numbers, differing};
use super::{Document, PartStates};
use crate::animation::Animated;
use crate::assets::{Camera, Light, Material, ShadingMode};
use crate::ids::{MaterialId, Target};
use crate::import::gltf::is_smooth_glass;
use crate::prefab::PartNode;

/// A thing with the numbers that a clip gives it.
fn with_numbers<T: Animated>(mut value: T, numbers: Option<&Numbers>) -> T {
    for (property, numbers) in numbers.into_iter().flatten() {
        property.set(&mut value, numbers);
    }
    value
}

impl PartStates {
    /// Own visibility of a part: the clip's word, else the override, else the source.
    pub(super) fn posed_visible(&self, index: u32, part: &PartNode) -> bool {
        let own = || self.overrides.get(&index).and_then(|o| o.visible).unwrap_or(part.visible);
        self.pose.visible.get(&index).copied().unwrap_or_else(own)
    }
}

impl Document {
    /// The own visibility of a node or part in the pose of the time that is shown; parents may still hide it.
    pub fn posed_visible(&self, target: Target) -> Option<bool> {
        match target.part {
            None => self.visible(target),
            Some(part) => Some(self.slots.get(&target.node)?.parts.posed_visible(part, self.part(target)?)),
        }
    }

    /// The light that a target is, as the time that is shown has it.
    pub fn posed_light(&self, target: Target) -> Option<Light> {
        let light = self.light_of(target)?;
        let pose = self.slots.get(&target.node).map(|slot| &slot.parts.pose);
        Some(with_numbers(light, pose.zip(target.part).and_then(|(pose, part)| pose.lights.get(&part))))
    }

    /// The camera that a target is, as the time that is shown has it.
    pub fn posed_camera(&self, target: Target) -> Option<Camera> {
        let camera = self.camera_of(target)?;
        let pose = self.slots.get(&target.node).map(|slot| &slot.parts.pose);
        Some(with_numbers(camera, pose.zip(target.part).and_then(|(pose, part)| pose.cameras.get(&part))))
    }

    /// Whether a clip sets something of a material at the time that is shown, up to date after [`Self::drain_changes`].
    pub fn is_material_driven(&self, id: MaterialId) -> bool {
        self.material_pose.contains_key(&id)
    }

    /// A material as the time that is shown has it, up to date after [`Self::drain_changes`]. Materials belong to no
    /// instance: where the clips of two change the same one, the instance with the lower id does.
    pub fn posed_material(&self, id: MaterialId) -> Option<Cow<'_, Material>> {
        let own = self.material(id)?;
        let Some(numbers) = self.material_pose.get(&id) else {
            return Some(Cow::Borrowed(own));
        };
        let mut posed = with_numbers(own.clone(), Some(numbers));
        // A mode that was chosen against the values stays.
        if posed.mode == ShadingMode::Refractive && is_smooth_glass(own) && !is_smooth_glass(&posed) {
            posed.mode = ShadingMode::Pbr;
        }
        Some(Cow::Owned(posed))
    }

    /// Makes anew what the poses say about materials, and marks those that differ.
    pub(super) fn update_material_pose(&mut self) {
        if !std::mem::take(&mut self.material_pose_stale) {
            return;
        }
        let mut made: BTreeMap<MaterialId, Numbers> = BTreeMap::new();
        let mut last = None;
        for slot in self.animated.iter().filter_map(|node| self.slots.get(node)) {
            let pose = &slot.parts.pose;
            // Instances in the same pose share it, and mostly follow each other.
            if last.replace(pose).is_some_and(|last| Arc::ptr_eq(last, pose)) {
                continue;
            }
            for (&id, numbers) in &pose.materials {
                let of_material = made.entry(id).or_default();
                for (&property, numbers) in numbers {
                    of_material.entry(property).or_insert_with(|| numbers.clone());
                }
            }
        }
        let changed = differing(&self.material_pose, &made);
        self.changes.materials.extend(changed.into_iter().filter(|id| self.materials.contains_key(id)));
        self.material_pose = made;
    }
}
