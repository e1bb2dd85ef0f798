//! Scene changes to renderer deltas: the only file that names both sides. Enters: a document and the camera's place.
//! Leaves: a `SceneDelta` in render space. Its work is that of the change, not of the scene.

mod assets;
mod convert;
mod deform;
mod least_bytes;
mod material;
mod origin;

use std::collections::{BTreeMap, BTreeSet};

use caustica_renderer::delta::{self, SceneDelta};
use caustica_scene::{ChangeSet, Document, Environment, MeshId, Renderable, Target};
use glam::{DAffine3, DVec3};

use assets::{Assets, InUse};
use convert::{Maps, light_of, visibility_of};
pub use convert::{camera_of, instance_id};
pub use least_bytes::least_bytes;
use origin::Extents;

/// What the renderer holds of the document so far.
#[derive(Default)]
pub struct Sync {
    /// World position of the origin of render space, metres.
    origin: DVec3,
    extents: Extents,
    instances: BTreeMap<Target, InUse>,
    lights: BTreeSet<Target>,
    assets: Assets,
    environment: Option<Environment>,
    maps: Maps,
}

impl Sync {
    /// A renderer that holds nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// World position of the origin of render space, metres.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// What all meshes that the renderer holds take at least, bytes.
    pub fn mesh_bytes(&self) -> u64 {
        self.assets.mesh_bytes()
    }

    /// The same of one mesh; 0 when the renderer does not hold it.
    pub fn mesh_bytes_of(&self, mesh: MeshId) -> u64 {
        self.assets.mesh_bytes_of(mesh)
    }

    /// The delta that takes everything out again, before another document is synced.
    pub fn clear(self) -> SceneDelta {
        let mut delta = SceneDelta {
            removed_instances: self.instances.keys().map(|target| instance_id(*target)).collect(),
            removed_lights: self.lights.iter().map(|target| instance_id(*target)).collect(),
            reason: String::from("closed the scene"),
            ..SceneDelta::default()
        };
        self.assets.clear(&mut delta);
        delta
    }

    /// Drains the document's changes into a delta; `eye` is the world position of the active view's camera.
    pub fn delta(&mut self, document: &mut Document, eye: DVec3) -> SceneDelta {
        let changes = document.drain_changes();
        self.delta_of(document, &changes, eye)
    }

    /// The same of changes that were drained.
    pub fn delta_of(&mut self, document: &Document, changes: &ChangeSet, eye: DVec3) -> SceneDelta {
        if changes.is_empty() && self.environment.is_some() && self.extents.render_origin(eye) == self.origin
        {
            return SceneDelta::default();
        }
        let mut delta = SceneDelta { reason: changes.reason(), ..SceneDelta::default() };
        self.note_extents(document, changes);
        let origin = self.extents.render_origin(eye);
        if origin != self.origin {
            self.origin = origin;
            delta.render_origin_changed = true;
        }
        let reshaped = self.assets.reshape(document, changes);
        self.remove(document, changes, &mut delta);
        self.add(document, changes, &mut delta);
        let whole: BTreeSet<Target> = changes.added.keys().chain(changes.instances.keys()).copied().collect();
        self.move_instances(document, changes, &whole, &mut delta);
        self.show(document, changes, &whole, &mut delta);
        let posed: BTreeSet<Target> = changes.poses.iter().copied().chain(reshaped).collect();
        self.pose(document, posed.difference(&whole), &mut delta);
        self.send_lights(document, changes, &mut delta);
        self.assets.send(document, changes, &mut delta);
        self.send_environment(document, changes, &mut delta);
        if delta.render_origin_changed && delta.reason.is_empty() {
            delta.reason = String::from("render origin");
        }
        delta
    }

    /// Only the targets themselves count, never what hangs below them. Meshes that change count for all their rigid
    /// instances at once; those that deform are looked at one by one, as they are built one by one.
    fn note_extents(&mut self, document: &Document, changes: &ChangeSet) {
        for target in changes.removed.keys() {
            self.extents.remove(*target);
        }
        let meshes: BTreeSet<MeshId> = changes
            .primitive_transforms
            .iter()
            .map(|(mesh, _)| *mesh)
            .chain(changes.meshes.iter().copied())
            .collect();
        let mut resized: BTreeSet<Target> = changes.poses.clone();
        for id in meshes {
            self.extents.resize(document, id);
            resized.extend(self.assets.users_if_deforming(id));
        }
        for changed in [&changes.added, &changes.transforms, &changes.instances] {
            resized.extend(changed.keys());
        }
        for target in resized.into_iter().filter(|target| !changes.removed.contains_key(target)) {
            self.extents.note(document, target);
        }
    }

    fn remove(&mut self, document: &Document, changes: &ChangeSet, delta: &mut SceneDelta) {
        for target in changes.removed.keys() {
            self.remove_instance(document, *target, delta);
            if self.lights.remove(target) {
                delta.removed_lights.push(instance_id(*target));
            }
        }
    }

    fn remove_instance(&mut self, document: &Document, target: Target, delta: &mut SceneDelta) {
        if let Some(old) = self.instances.remove(&target) {
            delta.removed_instances.push(instance_id(target));
            self.assets.replace(document, target, Some(&old), None);
        }
    }

    /// Sends what is new, or of which more than place, pose or visibility changed.
    fn add(&mut self, document: &Document, changes: &ChangeSet, delta: &mut SceneDelta) {
        for target in changes.added.keys().chain(changes.instances.keys()) {
            match document.renderable(*target) {
                Some(renderable) => {
                    let used = InUse { mesh: renderable.mesh, materials: renderable.materials.clone() };
                    let old = self.instances.get(target);
                    self.assets.replace(document, *target, old, Some(&used));
                    self.instances.insert(*target, used);
                    delta.instances.push((instance_id(*target), self.instance_of(document, &renderable)));
                }
                None => self.remove_instance(document, *target, delta),
            }
        }
    }

    fn instance_of(&self, document: &Document, renderable: &Renderable) -> delta::Instance {
        let shape = self.assets.shape_of(renderable.mesh);
        let pose = || shape.pose_of(document.deform_pose(renderable.target));
        delta::Instance {
            mesh: delta::MeshId(renderable.mesh.0),
            render_from_mesh: self.drawn_from(&renderable.world_from_mesh),
            materials: renderable.materials.iter().map(|id| delta::MaterialId(id.0)).collect(),
            visibility: visibility_of(renderable),
            pose: shape.deforms().then(pose).flatten(),
        }
    }

    fn send_lights(&mut self, document: &Document, changes: &ChangeSet, delta: &mut SceneDelta) {
        let in_detail = changes.transforms.iter().chain(&changes.visibility);
        let mut changed: BTreeSet<Target> =
            in_detail.filter(|(_, content)| content.light).map(|(target, _)| *target).collect();
        changed.extend(changes.added.keys().chain(&changes.lights));
        if delta.render_origin_changed {
            changed.extend(&self.lights);
        }
        for target in changed {
            match document.light(target).filter(|light| light.visible) {
                Some(light) => {
                    self.lights.insert(target);
                    delta.lights.push((instance_id(target), light_of(&light, self.origin)));
                }
                None if self.lights.remove(&target) => delta.removed_lights.push(instance_id(target)),
                None => {}
            }
        }
    }

    /// `whole`: sent with their transforms already. Under another render origin everything moves.
    fn move_instances(
        &self,
        document: &Document,
        changes: &ChangeSet,
        whole: &BTreeSet<Target>,
        delta: &mut SceneDelta,
    ) {
        let moved: Vec<Target> = if delta.render_origin_changed {
            self.instances.keys().copied().collect()
        } else {
            let meshes = changes.transforms.iter().filter(|(_, content)| content.mesh);
            meshes.map(|(target, _)| *target).filter(|target| self.instances.contains_key(target)).collect()
        };
        for target in moved.into_iter().filter(|target| !whole.contains(target)) {
            if let Some(world) = document.world_from_mesh(target) {
                delta.transforms.push((instance_id(target), self.drawn_from(&world)));
            }
        }
    }

    fn show(
        &self,
        document: &Document,
        changes: &ChangeSet,
        whole: &BTreeSet<Target>,
        delta: &mut SceneDelta,
    ) {
        let meshes = changes.visibility.iter().filter(|(_, content)| content.mesh).map(|(target, _)| *target);
        for target in meshes.filter(|target| self.instances.contains_key(target) && !whole.contains(target)) {
            if let Some(renderable) = document.renderable(target) {
                delta.visibility.push((instance_id(target), visibility_of(&renderable)));
            }
        }
    }

    fn pose<'a>(&self, document: &Document, posed: impl Iterator<Item = &'a Target>, delta: &mut SceneDelta) {
        for target in posed {
            let Some(used) = self.instances.get(target) else { continue };
            if let Some(pose) = self.assets.shape_of(used.mesh).pose_of(document.deform_pose(*target)) {
                delta.poses.push((instance_id(*target), pose));
            }
        }
    }

    fn send_environment(&mut self, document: &Document, changes: &ChangeSet, delta: &mut SceneDelta) {
        if !changes.environment && self.environment.is_some() {
            return;
        }
        let environment = document.effective_environment();
        if self.environment.as_ref() != Some(&environment) {
            delta.environment = Some(self.maps.environment_of(&environment));
            self.environment = Some(environment);
        }
    }

    fn drawn_from(&self, world: &DAffine3) -> glam::Affine3A {
        convert::drawn_from(world, self.origin)
    }
}

#[cfg(test)]
mod tests;
