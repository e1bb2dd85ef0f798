//! Which meshes, materials and textures the renderer holds, and who uses them. Enters: instances that come, change and
//! go. Leaves: assets in the delta when they are used for the first time or have changed, ids when nobody uses them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use caustica_renderer::delta::{self, SceneDelta};
use caustica_scene::{ChangeSet, Document, MaterialId, Mesh, MeshId, Target, TextureId};

use super::convert::{drawn_from, mesh_of, texture_of};
use super::deform::Shape;
use super::least_bytes::least_bytes;
use super::material::material_of;

/// Assets that one instance uses.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InUse {
    pub(super) mesh: MeshId,
    pub(super) materials: Vec<MaterialId>,
}

/// Everything in use.
#[derive(Debug, Default)]
pub(super) struct Assets {
    meshes: BTreeMap<MeshId, MeshInUse>,
    /// What all of them take at least.
    mesh_bytes: u64,
    materials: BTreeMap<MaterialId, (usize, Vec<TextureId>)>,
    textures: BTreeMap<TextureId, usize>,
    touched: Touched,
}

#[derive(Debug, Default)]
struct MeshInUse {
    users: BTreeSet<Target>,
    shape: Shape,
    /// What it takes at least.
    bytes: u64,
}

impl MeshInUse {
    /// Takes in what a mesh is now; `sum` follows.
    fn look_at(&mut self, mesh: Option<&Mesh>, sum: &mut u64) {
        self.shape = mesh.map(Shape::of).unwrap_or_default();
        let bytes = mesh.map_or(0, least_bytes);
        *sum = sum.saturating_sub(self.bytes).saturating_add(bytes);
        self.bytes = bytes;
    }
}

/// Assets whose use has begun or ended since the last delta.
#[derive(Debug, Default)]
struct Touched {
    new_meshes: BTreeSet<MeshId>,
    new_materials: BTreeSet<MaterialId>,
    released_meshes: BTreeSet<MeshId>,
    released_materials: BTreeSet<MaterialId>,
    released_textures: BTreeSet<TextureId>,
}

impl Assets {
    /// What all meshes in use take at least, bytes.
    pub(super) fn mesh_bytes(&self) -> u64 {
        self.mesh_bytes
    }

    /// The same of one.
    pub(super) fn mesh_bytes_of(&self, mesh: MeshId) -> u64 {
        self.meshes.get(&mesh).map_or(0, |known| known.bytes)
    }

    /// Takes everything out.
    pub(super) fn clear(self, delta: &mut SceneDelta) {
        delta.removed_meshes.extend(self.meshes.keys().map(|id| delta::MeshId(id.0)));
        delta.removed_materials.extend(self.materials.keys().map(|id| delta::MaterialId(id.0)));
        delta.removed_textures.extend(self.textures.keys().map(|id| delta::TextureId(id.0)));
    }

    /// An instance uses other assets from now on: none at all when it goes.
    pub(super) fn replace(
        &mut self,
        document: &Document,
        target: Target,
        old: Option<&InUse>,
        new: Option<&InUse>,
    ) {
        let (old_mesh, new_mesh) = (old.map(|used| used.mesh), new.map(|used| used.mesh));
        if old_mesh != new_mesh {
            if let Some(id) = new_mesh {
                let known = self.meshes.entry(id).or_default();
                if known.users.is_empty() {
                    known.look_at(document.mesh(id), &mut self.mesh_bytes);
                    self.touched.new_meshes.insert(id);
                }
                known.users.insert(target);
            }
            if let Some((id, mesh)) = old_mesh.and_then(|id| Some((id, self.meshes.get_mut(&id)?))) {
                mesh.users.remove(&target);
                self.touched.released_meshes.insert(id);
            }
        }
        for id in new.iter().flat_map(|used| &used.materials) {
            let (count, _) = self.materials.entry(*id).or_default();
            *count += 1;
            if *count == 1 && document.material(*id).is_some() {
                self.touched.new_materials.insert(*id);
            }
        }
        for id in old.iter().flat_map(|used| &used.materials) {
            if let Some((count, _)) = self.materials.get_mut(id) {
                *count = count.saturating_sub(1);
                self.touched.released_materials.insert(*id);
            }
        }
    }

    /// Looks at the meshes anew whose content has changed. Gives their users when they deform: their poses have to be
    /// sent again, because they may have another number of joints.
    pub(super) fn reshape(&mut self, document: &Document, changes: &ChangeSet) -> Vec<Target> {
        let mut users = Vec::new();
        for id in &changes.meshes {
            let (Some(known), Some(mesh)) = (self.meshes.get_mut(id), document.mesh(*id)) else { continue };
            known.look_at(Some(mesh), &mut self.mesh_bytes);
            if known.shape.deforms() {
                users.extend(&known.users);
            }
        }
        users
    }

    /// Who places a mesh that deforms, or did before it changed.
    pub(super) fn users_if_deforming(&self, mesh: MeshId) -> impl Iterator<Item = Target> {
        let known = self.meshes.get(&mesh).filter(|known| known.shape.deforms());
        known.into_iter().flat_map(|known| &known.users).copied()
    }

    /// How poses of a mesh look.
    pub(super) fn shape_of(&self, mesh: MeshId) -> Shape {
        self.meshes.get(&mesh).map(|known| known.shape).unwrap_or_default()
    }

    /// Sends what is new or has changed, now that every new use is counted, and takes out what nobody uses any more.
    pub(super) fn send(&mut self, document: &Document, changes: &ChangeSet, delta: &mut SceneDelta) {
        let touched = std::mem::take(&mut self.touched);
        self.send_meshes(document, changes, &touched, delta);
        let mut textures: BTreeSet<TextureId> = changes.textures.clone();
        let materials: BTreeSet<_> =
            touched.new_materials.iter().chain(&changes.materials).copied().collect();
        for id in materials {
            let Some(material) = document.posed_material(id) else { continue };
            let Some((_, old)) = self.materials.get_mut(&id) else { continue };
            // A texture that its prefab has taken along is shown as none.
            let sent = material_of(&material, |texture| document.texture(texture).is_some());
            let used: Vec<TextureId> = sent.textures().map(|used| TextureId(used.texture.0)).collect();
            let old = std::mem::replace(old, used.clone());
            for texture in &used {
                let count = self.textures.entry(*texture).or_insert(0);
                *count += 1;
                if *count == 1 {
                    textures.insert(*texture);
                }
            }
            self.release_textures(&old);
            delta.materials.push((delta::MaterialId(id.0), sent));
        }
        for id in textures.into_iter().filter(|id| self.textures.get(id).is_some_and(|count| *count > 0)) {
            if let Some(texture) = document.texture(id) {
                delta.textures.push((delta::TextureId(id.0), Arc::new(texture_of(texture))));
            }
        }
        self.forget_unused(&touched, delta);
    }

    fn send_meshes(
        &self,
        document: &Document,
        changes: &ChangeSet,
        touched: &Touched,
        delta: &mut SceneDelta,
    ) {
        let is_used = |id: &MeshId| self.meshes.get(id).is_some_and(|mesh| !mesh.users.is_empty());
        let meshes: BTreeSet<_> = touched.new_meshes.iter().chain(&changes.meshes).copied().collect();
        for id in meshes.iter().filter(|id| is_used(id)) {
            if let Some(mesh) = document.mesh(*id) {
                delta.meshes.push((delta::MeshId(id.0), Arc::new(mesh_of(mesh))));
            }
        }
        for (id, index) in changes.primitive_transforms.iter().filter(|(id, _)| !meshes.contains(id)) {
            let primitive = document.mesh(*id).and_then(|mesh| mesh.primitives.get(*index as usize));
            if let Some(primitive) = primitive.filter(|_| is_used(id)) {
                let map = drawn_from(&primitive.mesh_from_primitive, glam::DVec3::ZERO);
                delta.primitive_transforms.push((delta::MeshId(id.0), *index, map));
            }
        }
    }

    fn forget_unused(&mut self, touched: &Touched, delta: &mut SceneDelta) {
        for id in &touched.released_meshes {
            if self.meshes.get(id).is_some_and(|mesh| mesh.users.is_empty()) {
                let forgotten = self.meshes.remove(id).map_or(0, |mesh| mesh.bytes);
                self.mesh_bytes = self.mesh_bytes.saturating_sub(forgotten);
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
        for id in std::mem::take(&mut self.touched.released_textures) {
            if self.textures.get(&id) == Some(&0) {
                self.textures.remove(&id);
                delta.removed_textures.push(delta::TextureId(id.0));
            }
        }
    }

    fn release_textures(&mut self, textures: &[TextureId]) {
        for id in textures {
            if let Some(count) = self.textures.get_mut(id) {
                *count = count.saturating_sub(1);
                self.touched.released_textures.insert(*id);
            }
        }
    }
}
