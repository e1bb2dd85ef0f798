//! What changed in a document since it was last asked: ids only, drained once a frame.
//! Edits feed it; sync turns it into the renderer's delta. Its size is that of the change, not of the scene.

use std::collections::{BTreeMap, BTreeSet};

use crate::ids::{MaterialId, MeshId, Target, TextureId};

/// What a target brings into the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Content {
    /// It places a mesh.
    pub mesh: bool,
    /// It is a light.
    pub light: bool,
    /// It is a camera.
    pub camera: bool,
}

impl Content {
    /// Whether it brings nothing.
    pub fn is_empty(&self) -> bool {
        !(self.mesh || self.light || self.camera)
    }
}

/// What changed. A target is in `added`, in `removed` or in the others, never in several of these groups.
/// A target that the reader already knows can be in `added` again (removed and undone, or its source was
/// reloaded): its [`Content`] is then the whole truth, and what it no longer names is to be dropped.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangeSet {
    /// Targets with content that are new (or whose content is another: send them whole).
    pub added: BTreeMap<Target, Content>,
    /// Targets with content that are gone, with what they were.
    pub removed: BTreeMap<Target, Content>,
    /// Targets with content whose world transform changed; for a mesh, its `world_from_mesh`.
    pub transforms: BTreeMap<Target, Content>,
    /// Targets with content of which materials changed.
    pub instances: BTreeMap<Target, Content>,
    /// Targets with content of which only the visibility changed: their own, that of something above, or which
    /// rays meet them.
    pub visibility: BTreeMap<Target, Content>,
    /// Placed meshes whose [`crate::DeformPose`] changed.
    pub poses: BTreeSet<Target>,
    /// Lights whose own values changed.
    pub lights: BTreeSet<Target>,
    /// Cameras whose own values changed.
    pub cameras: BTreeSet<Target>,
    /// New meshes and meshes of which vertices changed.
    pub meshes: BTreeSet<MeshId>,
    /// Primitives that were moved inside their mesh, which is not in `meshes`.
    pub primitive_transforms: BTreeSet<(MeshId, u32)>,
    /// Meshes that left the document; one that came and went between two drains may be named too.
    pub removed_meshes: BTreeSet<MeshId>,
    /// New or changed materials.
    pub materials: BTreeSet<MaterialId>,
    /// Materials that left the document, likewise.
    pub removed_materials: BTreeSet<MaterialId>,
    /// New or changed textures.
    pub textures: BTreeSet<TextureId>,
    /// Textures that left the document, likewise.
    pub removed_textures: BTreeSet<TextureId>,
    /// The effective environment is another: ask the document for it.
    pub environment: bool,
    /// Names, order, parents or the default camera changed: lists on the screen are stale.
    pub structure: bool,
    /// What happened, in words such as "moved Chair", in order; the same one after the other counts once.
    pub reasons: Vec<String>,
}

impl ChangeSet {
    /// Whether the picture stays the same (lists on the screen may still be stale).
    pub fn is_empty(&self) -> bool {
        self.added.is_empty()
            && self.removed.is_empty()
            && self.transforms.is_empty()
            && self.instances.is_empty()
            && self.visibility.is_empty()
            && self.poses.is_empty()
            && self.lights.is_empty()
            && self.cameras.is_empty()
            && self.meshes.is_empty()
            && self.primitive_transforms.is_empty()
            && self.removed_meshes.is_empty()
            && self.materials.is_empty()
            && self.removed_materials.is_empty()
            && self.textures.is_empty()
            && self.removed_textures.is_empty()
            && !self.environment
    }

    /// The reasons in one line.
    pub fn reason(&self) -> String {
        match self.reasons.as_slice() {
            [] => String::new(),
            [one] => one.clone(),
            [first, rest @ ..] => format!("{first} and {} more", rest.len()),
        }
    }

    pub(crate) fn add_reason(&mut self, reason: String) {
        if !reason.is_empty() && self.reasons.last() != Some(&reason) {
            self.reasons.push(reason);
        }
    }

    pub(crate) fn target_added(&mut self, target: Target, content: Content) {
        if content.is_empty() {
            return;
        }
        self.removed.remove(&target);
        self.forget_details(target);
        self.added.insert(target, content);
    }

    /// `known` says whether an earlier drain has told of the target.
    pub(crate) fn target_removed(&mut self, target: Target, content: Content, known: bool) {
        if content.is_empty() {
            return;
        }
        self.added.remove(&target);
        self.forget_details(target);
        self.lights.remove(&target);
        self.cameras.remove(&target);
        if known {
            self.removed.insert(target, content);
        }
    }

    fn forget_details(&mut self, target: Target) {
        for details in [&mut self.transforms, &mut self.instances, &mut self.visibility] {
            details.remove(&target);
        }
        self.poses.remove(&target);
    }

    pub(crate) fn target_moved(&mut self, target: Target, content: Content) {
        note(&mut self.transforms, &self.added, target, content);
    }

    pub(crate) fn target_changed(&mut self, target: Target, content: Content) {
        note(&mut self.instances, &self.added, target, content);
    }

    pub(crate) fn target_shown(&mut self, target: Target, content: Content) {
        note(&mut self.visibility, &self.added, target, content);
    }

    pub(crate) fn target_bent(&mut self, target: Target) {
        if !self.added.contains_key(&target) {
            self.poses.insert(target);
        }
    }
}

/// A new target is sent whole, so that nothing else has to be said about it.
fn note(
    details: &mut BTreeMap<Target, Content>,
    added: &BTreeMap<Target, Content>,
    target: Target,
    content: Content,
) {
    if content.is_empty() || added.contains_key(&target) {
        return;
    }
    let noted = details.entry(target).or_default();
    noted.mesh |= content.mesh;
    noted.light |= content.light;
    noted.camera |= content.camera;
}
