//! Scene changes to renderer deltas: the only file that names both sides. Enters: a document and the camera's place.
//! Leaves: a `SceneDelta` in render space. Its work is that of the change, not of the scene.

mod convert;
mod origin;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use caustica_renderer::delta::{self, SceneDelta};
use caustica_scene::{ChangeSet, Document, Environment, MaterialId, MeshId, Target, TextureId};
use glam::{DAffine3, DVec3};

use convert::{Maps, light_of, material_of, mesh_of, texture_of};
pub use convert::{camera_of, instance_id};
use origin::Extents;

/// What the renderer holds of the document so far.
#[derive(Default)]
pub struct Sync {
    /// World position of the origin of render space, metres.
    origin: DVec3,
    extents: Extents,
    instances: BTreeMap<Target, InUse>,
    lights: BTreeSet<Target>,
    meshes: BTreeMap<MeshId, usize>,
    materials: BTreeMap<MaterialId, (usize, Vec<TextureId>)>,
    textures: BTreeMap<TextureId, usize>,
    environment: Option<Environment>,
    maps: Maps,
}

/// Assets that one instance uses.
#[derive(Clone, Debug, PartialEq)]
struct InUse {
    mesh: MeshId,
    materials: Vec<MaterialId>,
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

    /// The delta that takes everything out again, before another document is synced.
    pub fn clear(self) -> SceneDelta {
        SceneDelta {
            removed_instances: self.instances.keys().map(|target| instance_id(*target)).collect(),
            removed_lights: self.lights.iter().map(|target| instance_id(*target)).collect(),
            removed_meshes: self.meshes.keys().map(|id| delta::MeshId(id.0)).collect(),
            removed_materials: self.materials.keys().map(|id| delta::MaterialId(id.0)).collect(),
            removed_textures: self.textures.keys().map(|id| delta::TextureId(id.0)).collect(),
            reason: String::from("closed the scene"),
            ..SceneDelta::default()
        }
    }

    /// Drains the document's changes into a delta; `eye` is the world position of the active view's camera.
    pub fn delta(&mut self, document: &mut Document, eye: DVec3) -> SceneDelta {
        let changes = document.drain_changes();
        if changes.is_empty() && self.environment.is_some() && self.extents.render_origin(eye) == self.origin
        {
            return SceneDelta::default();
        }
        let mut delta = SceneDelta { reason: changes.reason(), ..SceneDelta::default() };
        self.note_extents(document, &changes);
        let origin = self.extents.render_origin(eye);
        if origin != self.origin {
            self.origin = origin;
            delta.render_origin_changed = true;
        }
        let mut touched = Touched::default();
        self.remove(&changes, &mut delta, &mut touched);
        self.add(document, &changes, &mut delta, &mut touched);
        self.move_targets(document, &changes, &mut delta);
        self.send_assets(document, &changes, &touched, &mut delta);
        self.forget_unused(&touched, &mut delta);
        self.send_environment(document, &changes, &mut delta);
        if delta.render_origin_changed && delta.reason.is_empty() {
            delta.reason = String::from("render origin");
        }
        delta
    }

    fn note_extents(&mut self, document: &Document, changes: &ChangeSet) {
        for target in changes.removed.keys() {
            self.extents.remove(*target);
        }
        for target in changes.added.keys().chain(changes.transforms.keys()) {
            match document.own_bounds(*target) {
                Some((low, high)) => self.extents.set(*target, (high - low).length()),
                None => self.extents.remove(*target),
            }
        }
    }

    fn remove(&mut self, changes: &ChangeSet, delta: &mut SceneDelta, touched: &mut Touched) {
        for target in changes.removed.keys() {
            if let Some(old) = self.instances.remove(target) {
                delta.removed_instances.push(instance_id(*target));
                self.release(&old, touched);
            }
            if self.lights.remove(target) {
                delta.removed_lights.push(instance_id(*target));
            }
        }
    }

    fn add(
        &mut self,
        document: &Document,
        changes: &ChangeSet,
        delta: &mut SceneDelta,
        touched: &mut Touched,
    ) {
        let sent: BTreeSet<Target> = changes
            .added
            .keys()
            .chain(changes.instances.keys())
            .chain(changes.visibility.keys())
            .copied()
            .collect();
        for target in &sent {
            match document.renderable(*target) {
                Some(renderable) => {
                    let used = InUse { mesh: renderable.mesh, materials: renderable.materials.clone() };
                    self.acquire(&used, document, touched);
                    delta.instances.push((
                        instance_id(*target),
                        delta::Instance {
                            mesh: delta::MeshId(renderable.mesh.0),
                            render_from_mesh: self.render_from(&renderable.world_from_mesh),
                            materials: renderable
                                .materials
                                .iter()
                                .map(|id| delta::MaterialId(id.0))
                                .collect(),
                            visibility: delta::Visibility {
                                shown: renderable.visible,
                                ..delta::Visibility::default()
                            },
                            pose: None,
                        },
                    ));
                    if let Some(old) = self.instances.insert(*target, used) {
                        self.release(&old, touched);
                    }
                }
                None => {
                    if let Some(old) = self.instances.remove(target) {
                        delta.removed_instances.push(instance_id(*target));
                        self.release(&old, touched);
                    }
                }
            }
            self.send_light(document, *target, delta);
        }
        for target in &changes.lights {
            self.send_light(document, *target, delta);
        }
    }

    fn send_light(&mut self, document: &Document, target: Target, delta: &mut SceneDelta) {
        match document.light(target).filter(|light| light.visible) {
            Some(light) => {
                self.lights.insert(target);
                delta.lights.push((instance_id(target), light_of(&light, self.origin)));
            }
            None if self.lights.remove(&target) => delta.removed_lights.push(instance_id(target)),
            None => {}
        }
    }

    fn move_targets(&mut self, document: &Document, changes: &ChangeSet, delta: &mut SceneDelta) {
        let all: Vec<Target>;
        let moved: Vec<Target> = if delta.render_origin_changed {
            all = self.instances.keys().chain(&self.lights).copied().collect();
            all
        } else {
            changes.transforms.keys().copied().collect()
        };
        let sent: BTreeSet<_> = delta.instances.iter().map(|(id, _)| *id).collect();
        for target in moved {
            if self.instances.contains_key(&target)
                && !sent.contains(&instance_id(target))
                && let Some(world) = document.world_from_mesh(target)
            {
                delta.transforms.push((instance_id(target), self.render_from(&world)));
            }
            if self.lights.contains(&target) || document.light_of(target).is_some() {
                self.send_light(document, target, delta);
            }
        }
    }

    fn send_assets(
        &mut self,
        document: &Document,
        changes: &ChangeSet,
        touched: &Touched,
        delta: &mut SceneDelta,
    ) {
        let moved = changes.primitive_transforms.iter().map(|(mesh, _)| mesh);
        let changed = changes.meshes.iter().chain(moved);
        let meshes: BTreeSet<_> = touched.new_meshes.iter().chain(changed).copied().collect();
        for id in meshes.into_iter().filter(|id| self.meshes.contains_key(id)) {
            if let Some(mesh) = document.mesh(id) {
                delta.meshes.push((delta::MeshId(id.0), Arc::new(mesh_of(mesh))));
            }
        }
        let mut textures: BTreeSet<TextureId> = changes.textures.clone();
        let materials: BTreeSet<_> =
            touched.new_materials.iter().chain(&changes.materials).copied().collect();
        for id in materials {
            let Some(material) = document.material(id) else { continue };
            let Some((_, old)) = self.materials.get_mut(&id) else { continue };
            let used: Vec<TextureId> = material.textures().map(|used| used.texture).collect();
            let old = std::mem::replace(old, used.clone());
            for texture in &used {
                let count = self.textures.entry(*texture).or_insert(0);
                *count += 1;
                if *count == 1 {
                    textures.insert(*texture);
                }
            }
            self.release_textures(&old);
            delta.materials.push((delta::MaterialId(id.0), material_of(material)));
        }
        for id in textures.into_iter().filter(|id| self.textures.get(id).is_some_and(|count| *count > 0)) {
            if let Some(texture) = document.texture(id) {
                delta.textures.push((delta::TextureId(id.0), Arc::new(texture_of(texture))));
            }
        }
    }

    /// Takes out what no instance uses any more, now that every new use is counted.
    fn forget_unused(&mut self, touched: &Touched, delta: &mut SceneDelta) {
        for id in &touched.released_meshes {
            if self.meshes.get(id) == Some(&0) {
                self.meshes.remove(id);
                delta.removed_meshes.push(delta::MeshId(id.0));
            }
        }
        for id in &touched.released_materials {
            if self.materials.get(id).is_some_and(|(count, _)| *count == 0)
                && let Some((_, textures)) = self.materials.remove(id)
            {
                delta.removed_materials.push(delta::MaterialId(id.0));
                self.release_textures(&textures);
            }
        }
        let unused: Vec<TextureId> =
            self.textures.iter().filter(|(_, count)| **count == 0).map(|(id, _)| *id).collect();
        for id in unused {
            self.textures.remove(&id);
            delta.removed_textures.push(delta::TextureId(id.0));
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

    fn acquire(&mut self, used: &InUse, document: &Document, touched: &mut Touched) {
        let count = self.meshes.entry(used.mesh).or_insert(0);
        *count += 1;
        if *count == 1 {
            touched.new_meshes.insert(used.mesh);
        }
        for id in &used.materials {
            let (count, _) = self.materials.entry(*id).or_default();
            *count += 1;
            if *count == 1 && document.material(*id).is_some() {
                touched.new_materials.insert(*id);
            }
        }
    }

    fn release(&mut self, used: &InUse, touched: &mut Touched) {
        if let Some(count) = self.meshes.get_mut(&used.mesh) {
            *count = count.saturating_sub(1);
            touched.released_meshes.insert(used.mesh);
        }
        for id in &used.materials {
            if let Some((count, _)) = self.materials.get_mut(id) {
                *count = count.saturating_sub(1);
                touched.released_materials.insert(*id);
            }
        }
    }

    fn release_textures(&mut self, textures: &[TextureId]) {
        for id in textures {
            if let Some(count) = self.textures.get_mut(id) {
                *count = count.saturating_sub(1);
            }
        }
    }

    fn render_from(&self, world: &DAffine3) -> glam::Affine3A {
        convert::render_from(world, self.origin)
    }
}

/// Assets whose use count went up from or down towards zero in one delta.
#[derive(Default)]
struct Touched {
    new_meshes: BTreeSet<MeshId>,
    new_materials: BTreeSet<MaterialId>,
    released_meshes: BTreeSet<MeshId>,
    released_materials: BTreeSet<MaterialId>,
}

#[cfg(test)]
mod tests;
