//! Carries out edits of prefabs: add, remove, and put a new reading of the source in place.
//! A prefab goes with its meshes, materials and textures.

use std::collections::BTreeSet;

use super::Document;
use crate::assets::Material;
use crate::edit::{Edit, EditError, shown};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId, Target, TextureId};
use crate::node::{MAX_NODES, NodeKind};
use crate::package::PrefabPackage;
use crate::prefab::Prefab;

/// Assets that came, went or changed with a prefab.
#[derive(Default)]
struct Brought {
    meshes: BTreeSet<MeshId>,
    materials: BTreeSet<MaterialId>,
    textures: BTreeSet<TextureId>,
}

impl Brought {
    fn of(package: &PrefabPackage) -> Self {
        Self {
            meshes: package.meshes.iter().map(|(id, _)| *id).collect(),
            materials: package.materials.iter().chain(&package.beside).map(|(id, _)| *id).collect(),
            textures: package.textures.iter().map(|(id, _)| *id).collect(),
        }
    }

    /// What changes when `other` takes its place: all meshes, but of materials and textures only those that are in one of
    /// them alone, since the others are told of as changed themselves.
    fn or_else_of(self, other: Self) -> Self {
        Self {
            meshes: self.meshes.union(&other.meshes).copied().collect(),
            materials: self.materials.symmetric_difference(&other.materials).copied().collect(),
            textures: self.textures.symmetric_difference(&other.textures).copied().collect(),
        }
    }

    fn any_material<'a>(&self, materials: impl IntoIterator<Item = &'a MaterialId>) -> bool {
        materials.into_iter().any(|id| self.materials.contains(id))
    }
}

impl Document {
    pub(super) fn add_prefab(&mut self, package: PrefabPackage) -> Result<Edit, EditError> {
        let id = package.id;
        if self.prefabs.contains_key(&id) {
            return Err(EditError::Taken(format!("prefab {}", id.0)));
        }
        let taken = package
            .meshes
            .iter()
            .find(|(id, _)| self.meshes.contains_key(id))
            .map(|(id, _)| format!("mesh {}", id.0))
            .or_else(|| {
                let mut materials = package.materials.iter();
                materials
                    .find(|(id, _)| self.materials.contains_key(id))
                    .map(|(id, _)| format!("material {}", id.0))
            })
            .or_else(|| {
                let mut textures = package.textures.iter();
                textures
                    .find(|(id, _)| self.textures.contains_key(id))
                    .map(|(id, _)| format!("texture {}", id.0))
            });
        if let Some(taken) = taken {
            return Err(EditError::Taken(taken));
        }
        let parts = self.prefabs.values().chain([&package.prefab]).map(|prefab| prefab.nodes().len());
        let count = parts.sum();
        if count > MAX_NODES && !self.restoring {
            return Err(EditError::TooManyNodes { count });
        }
        let brought = Brought::of(&package);
        self.insert_package(package);
        self.report_users(&brought);
        Ok(Edit::RemovePrefab { prefab: id })
    }

    pub(super) fn remove_prefab(&mut self, id: PrefabId) -> Result<Edit, EditError> {
        let package = self.package_of(id).ok_or_else(|| EditError::NoAsset(format!("prefab {}", id.0)))?;
        if let Some(by) = self.user_of_prefab(id, &package.prefab) {
            let what = format!("prefab {}", package.prefab.name);
            return Err(EditError::InUse { what, by });
        }
        self.take_package(&package);
        self.report_users(&Brought::of(&package));
        Ok(Edit::AddPrefab(Box::new(package)))
    }

    pub(super) fn replace_prefab(&mut self, package: PrefabPackage) -> Result<Edit, EditError> {
        let id = package.id;
        let mut old = self.package_of(id).ok_or_else(|| EditError::NoAsset(format!("prefab {}", id.0)))?;
        let instances: Vec<NodeId> =
            self.slots.iter().filter(|(_, slot)| slot.node.prefab() == Some(id)).map(|(id, _)| *id).collect();
        let parts = |count: usize| count.saturating_mul(instances.len());
        self.require_room(0, parts(package.prefab.nodes().len()), parts(old.prefab.nodes().len()))?;
        for &node in &instances {
            self.report_removed(node);
        }
        let changed = Brought::of(&old).or_else_of(Brought::of(&package));
        // What was edited while the source did not have it stood by itself, and goes back into the package.
        let ids = package.materials.iter().map(|(id, _)| *id);
        let absorbed = ids.filter(|id| !old.prefab.materials.contains(id));
        old.beside = absorbed.filter_map(|id| Some((id, self.material_entry(id)?.clone()))).collect();
        self.take_package(&old);
        self.insert_package(package);
        for node in instances {
            self.state_parts(node);
        }
        self.report_users(&changed);
        Ok(Edit::ReplacePrefab(Box::new(old)))
    }

    /// Marks what uses assets of a prefab without being an instance of it: it may have lost them or have them back.
    fn report_users(&mut self, brought: &Brought) {
        let mut targets = Vec::new();
        for (&id, slot) in &self.slots {
            match &slot.node.kind {
                NodeKind::Mesh { mesh, materials, .. } => {
                    let uses = brought.meshes.contains(mesh) || brought.any_material(materials);
                    targets.extend(uses.then_some(Target::node(id)));
                }
                NodeKind::Prefab { .. } => {
                    let parts = slot.parts.overrides.iter();
                    let using = parts.filter(|(_, o)| brought.any_material(o.materials.values()));
                    targets.extend(using.map(|(&part, _)| Target::part(id, part)));
                }
                NodeKind::Group | NodeKind::Light(_) | NodeKind::Camera(_) => {}
            }
        }
        for target in targets {
            self.report_changed(target);
        }
        let textured =
            |value: &Material| value.textures().any(|used| brought.textures.contains(&used.texture));
        let materials = self.materials.iter().filter(|(_, entry)| textured(&entry.value));
        self.changes.materials.extend(materials.map(|(&id, _)| id));
    }

    fn insert_package(&mut self, package: PrefabPackage) {
        self.reserve_ids_up_to(package.id.0);
        for (id, mesh) in package.meshes {
            self.reserve_ids_up_to(id.0);
            self.meshes.insert(id, mesh);
            self.changes.removed_meshes.remove(&id);
            self.changes.meshes.insert(id);
        }
        for (id, entry) in package.materials.into_iter().chain(package.beside) {
            self.reserve_ids_up_to(id.0);
            let before = self.materials.get(&id).map(|before| &*before.value);
            self.surroundings.note_material(before, Some(&entry.value));
            self.materials.insert(id, entry);
            self.changes.removed_materials.remove(&id);
            self.changes.materials.insert(id);
        }
        for (id, texture) in package.textures {
            self.reserve_ids_up_to(id.0);
            self.textures.insert(id, texture);
            self.changes.removed_textures.remove(&id);
            self.changes.textures.insert(id);
        }
        self.prefabs.insert(package.id, package.prefab);
        self.changes.structure = true;
    }

    fn take_package(&mut self, package: &PrefabPackage) {
        self.prefabs.remove(&package.id);
        for (id, _) in &package.meshes {
            self.meshes.remove(id);
            self.changes.meshes.remove(id);
            self.changes.removed_meshes.insert(*id);
        }
        let gone: Vec<MeshId> = package.meshes.iter().map(|(id, _)| *id).collect();
        self.changes.primitive_transforms.retain(|(id, _)| !gone.contains(id));
        for (id, _) in &package.materials {
            let old = self.materials.remove(id);
            self.surroundings.note_material(old.as_ref().map(|entry| &*entry.value), None);
            self.changes.materials.remove(id);
            self.changes.removed_materials.insert(*id);
        }
        for (id, _) in &package.textures {
            self.textures.remove(id);
            self.changes.textures.remove(id);
            self.changes.removed_textures.insert(*id);
        }
        self.changes.structure = true;
    }

    /// Who places the prefab, or uses one of its meshes or materials from outside of it.
    fn user_of_prefab(&self, id: PrefabId, prefab: &Prefab) -> Option<String> {
        self.slots.iter().find_map(|(node_id, slot)| {
            let uses = match &slot.node.kind {
                NodeKind::Prefab { prefab: other, overrides, .. } => {
                    *other == id
                        || overrides
                            .values()
                            .flat_map(|o| o.materials.values())
                            .any(|material| prefab.materials.contains(material))
                }
                NodeKind::Mesh { mesh, materials, .. } => {
                    prefab.meshes.contains(mesh) || materials.iter().any(|m| prefab.materials.contains(m))
                }
                NodeKind::Group | NodeKind::Light(_) | NodeKind::Camera(_) => false,
            };
            uses.then(|| shown(&slot.node.name, "node", node_id.0))
        })
    }

    /// Who uses a material: a mesh's primitive, a node, an override or the prefab that brought it.
    pub(super) fn user_of_material(&self, id: MaterialId) -> Option<String> {
        let prefab = self.prefabs.values().find(|p| p.materials.contains(&id));
        if let Some(prefab) = prefab {
            return Some(format!("prefab {}", prefab.name));
        }
        let mesh = |(mesh_id, mesh): (MeshId, &crate::assets::Mesh)| {
            let used = mesh.primitives.iter().any(|p| p.material == id);
            used.then(|| shown(&mesh.name, "mesh", mesh_id.0))
        };
        if let Some(user) = self.meshes().find_map(mesh) {
            return Some(user);
        }
        self.slots.iter().find_map(|(node_id, slot)| {
            let uses = match &slot.node.kind {
                NodeKind::Prefab { overrides, .. } => {
                    overrides.values().flat_map(|o| o.materials.values()).any(|m| *m == id)
                }
                NodeKind::Mesh { materials, .. } => materials.contains(&id),
                NodeKind::Group | NodeKind::Light(_) | NodeKind::Camera(_) => false,
            };
            uses.then(|| shown(&slot.node.name, "node", node_id.0))
        })
    }
}
