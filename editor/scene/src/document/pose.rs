//! The pose of a time, laid over the document: what clips say, and how placed meshes are bent by it.
//! In: a time. Out: transforms and weights of parts, and marks on what really differs. It is never an edit: undo,
//! history and projects know nothing of it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};

use super::{Document, PartStates, prefab_of};
use crate::animation::{Animation, ChannelPath, ClipChoice, Property, Sample};
use crate::assets::{DeformPose, Mesh};
use crate::ids::{MaterialId, NodeId, PrefabId, Target};
use crate::node::{Node, NodeKind};
use crate::prefab::{PartNode, Prefab};
use crate::transform::Local;

/// What a time says about the parts of an instance, by index of the part.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pose {
    moved: BTreeMap<u32, Moved>,
    weights: BTreeMap<u32, Vec<f32>>,
    pub(super) visible: BTreeMap<u32, bool>,
    pub(super) lights: BTreeMap<u32, Numbers>,
    pub(super) cameras: BTreeMap<u32, Numbers>,
    pub(super) materials: BTreeMap<MaterialId, Numbers>,
}

/// The properties that a clip changes, with their numbers.
pub(super) type Numbers = BTreeMap<Property, Vec<f32>>;

/// What a time says about the transform of one part; the rest is as the document has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Moved {
    translation: Option<DVec3>,
    rotation: Option<DQuat>,
    scale: Option<DVec3>,
}

/// What of a target a clip sets at the time that is shown: there the document's own value waits for the rest pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Driven {
    /// Translation against the parent.
    pub translation: bool,
    /// Rotation against the parent.
    pub rotation: bool,
    /// Scale along the own axes.
    pub scale: bool,
    /// Weights of the morph targets.
    pub weights: bool,
    /// Whether it is there.
    pub visibility: bool,
    /// Something of the light that it is.
    pub light: bool,
    /// Something of the camera that it is.
    pub camera: bool,
}

impl Pose {
    /// The chosen clips at a time.
    fn at(prefab: &Prefab, choice: ClipChoice, time_s: f64) -> Self {
        let mut pose = Self::default();
        for clip in choice.of(&prefab.animations) {
            let local_s = clip.local_time(time_s);
            for channel in &clip.channels {
                let Some(sample) = channel.sample(local_s) else {
                    continue;
                };
                pose.lay(channel.part, channel.path, sample);
            }
        }
        pose
    }

    /// The first to move a thing has it.
    fn lay(&mut self, part: u32, path: ChannelPath, sample: Sample) {
        match sample {
            Sample::Weights(weights) => _ = self.weights.entry(part).or_insert(weights),
            Sample::Visibility(visible) => _ = self.visible.entry(part).or_insert(visible),
            Sample::Translation(value) => {
                _ = self.moved.entry(part).or_default().translation.get_or_insert(value)
            }
            Sample::Rotation(value) => _ = self.moved.entry(part).or_default().rotation.get_or_insert(value),
            Sample::Scale(value) => _ = self.moved.entry(part).or_default().scale.get_or_insert(value),
            Sample::Numbers(numbers) => {
                let (of_thing, property) = match path {
                    ChannelPath::Light(property) => (self.lights.entry(part).or_default(), property),
                    ChannelPath::Camera(property) => (self.cameras.entry(part).or_default(), property),
                    ChannelPath::Material(id, property) => (self.materials.entry(id).or_default(), property),
                    _ => return,
                };
                of_thing.entry(property).or_insert(numbers);
            }
        }
    }
}

impl PartStates {
    /// Transform of a part against its parent: the clip's word, else the override, else the source.
    pub(super) fn posed_local(&self, index: u32, part: &PartNode) -> Local {
        let own = self.overrides.get(&index).and_then(|o| o.local).unwrap_or(part.local);
        let Some(moved) = self.pose.moved.get(&index) else {
            return own;
        };
        let mut trs = own.nearest_trs();
        trs.translation = moved.translation.unwrap_or(trs.translation);
        trs.rotation = moved.rotation.unwrap_or(trs.rotation);
        trs.scale = moved.scale.unwrap_or(trs.scale);
        trs.into()
    }

    /// Weights of a part's morph targets in a pose, one a target of `mesh`.
    fn weights_in(&self, pose: &Pose, index: u32, part: &PartNode, mesh: &Mesh) -> Vec<f32> {
        let own = self.overrides.get(&index).and_then(|o| o.weights.as_ref()).or(part.weights.as_ref());
        fitted(pose.weights.get(&index).or(own).unwrap_or(&mesh.default_weights), mesh)
    }

    /// Transforms of all parts against the instance, from the locals.
    fn compute_in_instance(&self, prefab: &Prefab) -> Vec<DAffine3> {
        let mut in_instance: Vec<DAffine3> = Vec::with_capacity(prefab.nodes().len());
        for (index, part) in (0..).zip(prefab.nodes()) {
            let above = part.parent.and_then(|parent| in_instance.get(parent as usize).copied());
            let local = self.posed_local(index, part).to_affine();
            in_instance.push(above.unwrap_or(DAffine3::IDENTITY) * local);
        }
        in_instance
    }
}

/// As many weights as the mesh has targets.
fn fitted(weights: &[f32], mesh: &Mesh) -> Vec<f32> {
    let mut fitted = weights.to_vec();
    fitted.resize(mesh.data.morph.len(), 0.0);
    fitted
}

impl Document {
    /// Lays the pose of all animated instances at a time, seconds, over the document; `None` takes it off. Only
    /// what really differs is marked as changed, and the cost is that of the channels and of what hangs below the
    /// parts that they move. A time that is not finite counts as 0.
    ///
    /// While a time is shown, a clip outdoes the document and its overrides in what it moves; [`Self::local`]
    /// and the edits go on to mean the document's own values.
    pub fn set_time(&mut self, time_s: Option<f64>) {
        self.time_s = time_s.map(|time_s| if time_s.is_finite() { time_s } else { 0.0 });
        let mut poses = BTreeMap::new();
        let mut differs = false;
        for node in self.animated.clone() {
            let pose = self.slots.get(&node).map(|slot| self.shared_pose(&slot.node, &mut poses));
            differs |= pose.is_some_and(|pose| self.lay_pose(node, pose));
        }
        if differs {
            self.changes.add_reason("animation".to_owned());
        }
    }

    /// The time that is shown, seconds; `None`: everything is at rest.
    pub fn time(&self) -> Option<f64> {
        self.time_s
    }

    /// Duration of the longest clip that an instance plays, seconds; `None`: nothing is animated.
    pub fn animation_duration(&self) -> Option<f64> {
        let clips = self.animated.iter().flat_map(|&node| self.clip_of(node).of(self.clips_of(node)));
        clips.filter(|clip| !clip.channels.is_empty()).map(|clip| clip.duration_s).reduce(f64::max)
    }

    /// The clips that an instance can play, in the order of its source.
    pub fn clips_of(&self, node: NodeId) -> &[Arc<Animation>] {
        let prefab = self.slots.get(&node).and_then(|slot| prefab_of(&self.prefabs, slot));
        prefab.map_or(&[], |prefab| &prefab.animations)
    }

    /// Transform against the parent in the pose of the time that is shown.
    pub fn posed_local(&self, target: Target) -> Option<Local> {
        match target.part {
            None => self.node(target.node).map(|node| node.local),
            Some(part) => Some(self.slots.get(&target.node)?.parts.posed_local(part, self.part(target)?)),
        }
    }

    /// What of a target a clip sets at the time that is shown; nothing at rest.
    pub fn driven(&self, target: Target) -> Driven {
        let pose = self.slots.get(&target.node).map(|slot| &slot.parts.pose);
        let Some((pose, part)) = pose.zip(target.part) else { return Driven::default() };
        let moved = pose.moved.get(&part).copied().unwrap_or_default();
        Driven {
            translation: moved.translation.is_some(),
            rotation: moved.rotation.is_some(),
            scale: moved.scale.is_some(),
            weights: pose.weights.contains_key(&part),
            visibility: pose.visible.contains_key(&part),
            light: pose.lights.contains_key(&part),
            camera: pose.cameras.contains_key(&part),
        }
    }

    /// Weights of the morph targets of a placed mesh as the document says them, one a target; `None` for what has
    /// no morph targets. Those that are shown are in [`Self::deform_pose`].
    pub fn morph_weights(&self, target: Target) -> Option<Vec<f32>> {
        let mesh = self.mesh(self.mesh_of(target)?).filter(|mesh| !mesh.data.morph.is_empty())?;
        let own = match target.part {
            Some(_) => {
                let set = self.part_override(target).and_then(|o| o.weights.as_ref());
                set.or(self.part(target)?.weights.as_ref())
            }
            None => match &self.node(target.node)?.kind {
                NodeKind::Mesh { weights, .. } if !weights.is_empty() => Some(weights),
                _ => None,
            },
        };
        Some(fitted(own.unwrap_or(&mesh.default_weights), mesh))
    }

    /// How a placed mesh is bent in the pose of the time that is shown; `None` for one that nothing bends.
    pub fn deform_pose(&self, target: Target) -> Option<DeformPose> {
        let mesh = self.mesh(self.mesh_of(target)?)?;
        let weights = self.shown_weights(target);
        let joint_matrices = match mesh.data.skin {
            Some(_) => self.joint_matrices(target).unwrap_or_default(),
            None => Vec::new(),
        };
        let bends = weights.is_some() || !joint_matrices.is_empty();
        bends.then(|| DeformPose { joint_matrices, weights: weights.unwrap_or_default() })
    }

    /// Whether a skin or morph targets bend the mesh that a target places.
    pub(super) fn deforms(&self, target: Target, mesh: &Mesh) -> bool {
        !mesh.data.morph.is_empty() || mesh.data.skin.is_some() && self.is_skinned(target)
    }

    /// Weights of the morph targets that are shown; `None` without targets.
    pub(super) fn shown_weights(&self, target: Target) -> Option<Vec<f32>> {
        let Some(part) = target.part else {
            return self.morph_weights(target);
        };
        let mesh = self.mesh(self.mesh_of(target)?).filter(|mesh| !mesh.data.morph.is_empty())?;
        let parts = &self.slots.get(&target.node)?.parts;
        Some(parts.weights_in(&parts.pose, part, self.part(target)?, mesh))
    }

    /// `instance_from_joint * joint_from_mesh` of each joint. What is not finite moves nothing.
    fn joint_matrices(&self, target: Target) -> Option<Vec<DAffine3>> {
        let slot = self.slots.get(&target.node)?;
        let prefab = prefab_of(&self.prefabs, slot)?;
        let skin = prefab.skin_of(target.part?)?;
        let computed;
        let in_instance = if slot.dirty || self.has_dirty_parts(target.node) {
            computed = slot.parts.compute_in_instance(prefab);
            &computed
        } else {
            &slot.parts.in_instance
        };
        let matrix = |(place, &joint): (usize, &u32)| {
            let instance_from_joint = in_instance.get(joint as usize).copied().unwrap_or_default();
            let joint_from_mesh = skin.inverse_bind.get(place).copied().unwrap_or_default();
            let matrix = instance_from_joint * joint_from_mesh;
            if matrix.is_finite() { matrix } else { DAffine3::IDENTITY }
        };
        Some(skin.joints.iter().enumerate().map(matrix).collect())
    }

    /// The pose of a node that is new, or whose source is.
    pub(super) fn pose_of(&self, node: &Node) -> Arc<Pose> {
        self.shared_pose(node, &mut BTreeMap::new())
    }

    /// Instances of one source that play the same have one pose, which is made once.
    fn shared_pose(&self, node: &Node, made: &mut BTreeMap<(PrefabId, ClipChoice), Arc<Pose>>) -> Arc<Pose> {
        let (NodeKind::Prefab { prefab, clip, .. }, Some(time_s)) = (&node.kind, self.time_s) else {
            return Arc::default();
        };
        let Some(source) = self.prefabs.get(prefab).filter(|source| source.is_animated()) else {
            return Arc::default();
        };
        let make = || Arc::new(Pose::at(source, *clip, time_s));
        Arc::clone(made.entry((*prefab, *clip)).or_insert_with(make))
    }

    /// Gives an instance another pose and marks what differs; says whether anything does.
    pub(super) fn lay_pose(&mut self, node: NodeId, pose: Arc<Pose>) -> bool {
        let Some(slot) = self.slots.get_mut(&node) else {
            return false;
        };
        let old = std::mem::replace(&mut slot.parts.pose, Arc::clone(&pose));
        if Arc::ptr_eq(&old, &pose) || old == pose {
            return false;
        }
        let Some(prefab) = prefab_of(&self.prefabs, slot) else {
            return false;
        };
        let mut differs = false;
        // Whole subtrees are computed again: of nested parts the topmost is enough.
        let mut covered = 0;
        let moved = differing(&old.moved, &pose.moved);
        for part in moved.union(&differing(&old.visible, &pose.visible)).copied() {
            if part >= covered {
                self.dirty_parts.insert(Target::part(node, part));
                covered = prefab.subtree_end(part);
                differs = true;
            }
        }
        let present = |part: &u32| !slot.parts.is_absent(*part);
        for part in differing(&old.lights, &pose.lights).into_iter().filter(present) {
            self.changes.lights.insert(Target::part(node, part));
            differs = true;
        }
        for part in differing(&old.cameras, &pose.cameras).into_iter().filter(present) {
            self.changes.cameras.insert(Target::part(node, part));
            differs = true;
        }
        if old.materials != pose.materials {
            self.material_pose_stale = true;
            differs = true;
        }
        let parts = &slot.parts;
        for index in differing(&old.weights, &pose.weights).into_iter().filter(present) {
            let part = prefab.node(index);
            let mesh = part.and_then(|part| self.meshes.get(&part.mesh?));
            let (Some(part), Some(mesh)) = (part, mesh) else {
                continue;
            };
            if parts.weights_in(&old, index, part, mesh) != parts.weights_in(&pose, index, part, mesh) {
                self.changes.target_bent(Target::part(node, index));
                differs = true;
            }
        }
        differs
    }
}

/// The keys at which two maps differ, in order.
pub(super) fn differing<K: Ord + Copy, T: PartialEq>(a: &BTreeMap<K, T>, b: &BTreeMap<K, T>) -> BTreeSet<K> {
    a.keys().chain(b.keys()).filter(|key| a.get(key) != b.get(key)).copied().collect()
}
