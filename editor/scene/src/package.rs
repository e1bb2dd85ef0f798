//! A prefab together with the assets it brings, as one value: what importing adds and undo takes away.
//! Also turns an [`Imported`] file, whose ids are places in its own lists, into one with document ids.

use std::collections::BTreeSet;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::assets::{Material, Mesh, Texture};
use crate::document::Document;
use crate::edit::{Edit, EditError};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId, TextureId};
use crate::import::Imported;
use crate::node::{Node, NodeKind, Subtree};
use crate::prefab::Prefab;
use crate::project::PackageRecord;
use crate::transform::Local;

mod names;

pub(crate) use names::AssetNames;
use names::Names;

/// A material with what its source says; the same one while it is not edited.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "EntryRecord", into = "EntryRecord")]
pub struct MaterialEntry {
    /// What it is now.
    pub value: Arc<Material>,
    /// What the imported file says; `None` for a material made here.
    pub original: Option<Arc<Material>>,
}

/// How a journal says a [`MaterialEntry`].
#[derive(Serialize, Deserialize)]
struct EntryRecord {
    value: Material,
    original: Option<Material>,
}

impl From<EntryRecord> for MaterialEntry {
    fn from(record: EntryRecord) -> Self {
        Self { value: Arc::new(record.value), original: record.original.map(Arc::new) }
    }
}

impl From<MaterialEntry> for EntryRecord {
    fn from(MaterialEntry { value, original }: MaterialEntry) -> Self {
        Self { value: Arc::unwrap_or_clone(value), original: original.map(Arc::unwrap_or_clone) }
    }
}

impl MaterialEntry {
    /// One that was made here.
    pub fn made_here(value: Material) -> Self {
        Self { value: Arc::new(value), original: None }
    }

    /// One as its source says it.
    pub(crate) fn imported(value: Material) -> Self {
        let value = Arc::new(value);
        Self { original: Some(Arc::clone(&value)), value }
    }

    /// Whether it differs from its source, or has none.
    pub fn is_edited(&self) -> bool {
        self.original.as_ref() != Some(&self.value)
    }
}

/// A prefab with its assets. Written as JSON it is named by its source, with ids and edits; what is read of that is a
/// placeholder until the source is imported.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "PackageRecord", into = "PackageRecord")]
pub struct PrefabPackage {
    /// Id of the prefab.
    pub id: PrefabId,
    /// The prefab; its lists name the assets below.
    pub prefab: Prefab,
    /// Its meshes.
    pub meshes: Vec<(MeshId, Mesh)>,
    /// Its materials.
    pub materials: Vec<(MaterialId, MaterialEntry)>,
    /// Its textures.
    pub textures: Vec<(TextureId, Texture)>,
    /// Materials that stand by themselves once it takes the place of another reading: edited ones that the source has no more.
    pub beside: Vec<(MaterialId, MaterialEntry)>,
}

fn lookup<T: Copy>(ids: &[T], index: u64) -> Option<T> {
    usize::try_from(index).ok().and_then(|i| ids.get(i)).copied()
}

/// Gives an imported file ids: to what is in `old` by the same name those that it has there, to the rest new ones.
pub(crate) fn package_with_ids(
    document: &mut Document,
    id: PrefabId,
    imported: Imported,
    old: Option<&Prefab>,
) -> PrefabPackage {
    let Imported { prefab, meshes, materials, textures, .. } = put_ids(document, imported, old);
    let materials = materials.into_iter().map(MaterialEntry::imported);
    PrefabPackage {
        id,
        meshes: prefab.meshes.iter().copied().zip(meshes).collect(),
        materials: prefab.materials.iter().copied().zip(materials).collect(),
        textures: prefab.textures.iter().copied().zip(textures).collect(),
        beside: Vec::new(),
        prefab,
    }
}

/// Puts document ids in the place of list indices.
fn put_ids(document: &mut Document, mut imported: Imported, old: Option<&Prefab>) -> Imported {
    let now = AssetNames::of(&imported);
    let before = old.cloned().unwrap_or_default();
    let mut names = AssetNames::clone(&before.asset_names);
    let mut ids = |names: &mut Names, before: Vec<u64>, now: Names| {
        names.keep_ids(&before, now.now, || document.allocate_id()).into_iter()
    };
    let before_meshes = before.meshes.iter().map(|id| id.0).collect();
    let before_materials = before.materials.iter().map(|id| id.0).collect();
    let before_textures = before.textures.iter().map(|id| id.0).collect();
    let meshes: Vec<_> = ids(&mut names.meshes, before_meshes, now.meshes).map(MeshId).collect();
    let materials: Vec<_> =
        ids(&mut names.materials, before_materials, now.materials).map(MaterialId).collect();
    let textures: Vec<_> = ids(&mut names.textures, before_textures, now.textures).map(TextureId).collect();
    let material = |index: MaterialId| lookup(&materials, index.0).unwrap_or(index);
    imported.prefab.map_animated_materials(material);
    imported.prefab.map_meshes(|index| lookup(&meshes, index.0).unwrap_or(index));
    for primitive in imported.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        primitive.material = material(primitive.material);
    }
    for used in imported.materials.iter_mut().flat_map(Material::texture_slots_mut).flatten() {
        used.texture = lookup(&textures, used.texture.0).unwrap_or(used.texture);
    }
    let prefab = &mut imported.prefab;
    (prefab.meshes, prefab.materials, prefab.textures) = (meshes, materials, textures);
    prefab.asset_names = Arc::new(names);
    imported
}

impl PrefabPackage {
    /// Whether the assets are those of another reading, but for edits.
    fn has_source_of(&self, now: &Self) -> bool {
        let original = |(id, entry): &(MaterialId, MaterialEntry)| (*id, entry.original.clone());
        let mesh = |((a, old), (b, new)): (&(MeshId, Mesh), &(MeshId, Mesh))| {
            let parts = |mesh: &Mesh| -> Vec<_> {
                mesh.primitives.iter().map(|p| (p.first_index, p.index_count, p.material)).collect()
            };
            a == b && old.name == new.name && parts(old) == parts(new) && old.data == new.data
        };
        self.meshes.len() == now.meshes.len()
            && self.meshes.iter().zip(&now.meshes).all(mesh)
            && self.materials.iter().map(original).eq(now.materials.iter().map(original))
            && self.textures == now.textures
    }

    /// Materials that were edited stay as they were edited, primitives that were moved stay moved, of another file where the
    /// mesh has as many.
    pub(crate) fn keep_edits<'a>(
        &mut self,
        same_file: bool,
        old_material: impl Fn(MaterialId) -> Option<&'a MaterialEntry>,
        old_mesh: impl Fn(MeshId) -> Option<&'a Mesh>,
    ) {
        for (id, entry) in &mut self.materials {
            if let Some(old) = old_material(*id).filter(|old| old.is_edited()) {
                entry.value = old.value.clone();
            }
        }
        for (id, mesh) in &mut self.meshes {
            let old = old_mesh(*id).map_or(&[][..], |old| &old.primitives);
            if !same_file && old.len() != mesh.primitives.len() {
                continue;
            }
            for (primitive, old) in mesh.primitives.iter_mut().zip(old) {
                primitive.mesh_from_primitive = old.mesh_from_primitive;
            }
            mesh.update_bounds();
        }
    }
}

impl Document {
    /// Gives an imported file ids and returns the edit that adds it as a prefab, without an instance.
    pub fn import_edit(&mut self, imported: Imported) -> (PrefabId, Edit) {
        let id = PrefabId(self.allocate_id());
        let package = package_with_ids(self, id, imported, None);
        (id, Edit::AddPrefab(Box::new(package)))
    }

    /// Adds an imported file as a prefab, without an instance and without an undo.
    ///
    /// # Errors
    /// Never for what [`crate::import::load`] returned.
    pub fn add_imported(&mut self, imported: Imported) -> Result<PrefabId, EditError> {
        let (id, edit) = self.import_edit(imported);
        self.apply(edit)?;
        Ok(id)
    }

    /// The edit that places a prefab, with the id of the new node.
    pub fn instantiate_edit(
        &mut self,
        prefab: PrefabId,
        parent: Option<NodeId>,
        local: Local,
    ) -> (NodeId, Edit) {
        let name = self.prefab(prefab).map_or_else(String::new, |p| p.name.clone());
        let kind = NodeKind::instance_of(prefab);
        self.add_edit(Node::new(name, kind).with_local(local), parent)
    }

    /// The edit that adds one node as the last child, with its new id.
    pub fn add_edit(&mut self, node: Node, parent: Option<NodeId>) -> (NodeId, Edit) {
        let id = NodeId(self.allocate_id());
        let edit = Edit::AddNode { parent, index: usize::MAX, subtree: Subtree::single(id, node) };
        (id, edit)
    }

    /// The prefabs of the file that was read, each with whether it is what the file says now, edits aside.
    pub fn prefabs_of(&mut self, imported: &Imported) -> Vec<(PrefabId, bool)> {
        let source = &imported.prefab.source;
        let known = self.prefabs().filter(|(_, prefab)| prefab.source == *source && !prefab.missing);
        let known: Vec<(PrefabId, Prefab)> = known.map(|(id, prefab)| (id, prefab.clone())).collect();
        let is_same = |(id, old): (PrefabId, Prefab)| {
            let mut now = package_with_ids(self, id, imported.clone(), Some(&old));
            now.prefab.name.clone_from(&old.name);
            (id, now.prefab == old && self.package_of(id).is_some_and(|old| old.has_source_of(&now)))
        };
        known.into_iter().map(is_same).collect()
    }

    /// The edit that puts a new reading of the source in a prefab's place. Assets keep their ids by their
    /// names; materials that were edited stay as they were edited, also when the file has them no more, and primitives
    /// that were moved stay moved, of another file where the mesh has as many.
    ///
    /// # Errors
    /// When the prefab is not in the document.
    pub fn reload_edit(&mut self, id: PrefabId, imported: Imported) -> Result<Edit, EditError> {
        let none = || EditError::NoAsset(format!("prefab {}", id.0));
        let old = self.prefab(id).ok_or_else(none)?.clone();
        let same_file = old.source == imported.prefab.source;
        let mut package = package_with_ids(self, id, imported, Some(&old));
        package.keep_edits(same_file, |id| self.material_entry(id), |id| self.mesh(id));
        let stays = |id: &MaterialId| package.prefab.materials.contains(id);
        let gone = old.materials.iter().filter(|id| !stays(id)).filter_map(|&material| {
            let entry = self.material_entry(material).filter(|entry| entry.is_edited())?;
            Some((material, MaterialEntry { original: None, ..entry.clone() }))
        });
        package.beside = gone.collect();
        Ok(Edit::ReplacePrefab(Box::new(package)))
    }

    /// Takes a prefab with its assets out as a value; the document keeps it.
    pub(crate) fn package_of(&self, id: PrefabId) -> Option<PrefabPackage> {
        let prefab = self.prefab(id)?.clone();
        Some(PrefabPackage {
            id,
            meshes: pick(&prefab.meshes, |id| self.mesh(id)),
            materials: pick(&prefab.materials, |id| self.material_entry(id)),
            textures: pick(&prefab.textures, |id| self.texture(id)),
            beside: Vec::new(),
            prefab,
        })
    }
}

fn pick<'a, I: Copy + Ord, T: Clone + 'a>(ids: &[I], find: impl Fn(I) -> Option<&'a T>) -> Vec<(I, T)> {
    let mut seen = BTreeSet::new();
    ids.iter()
        .filter(|id| seen.insert(**id))
        .filter_map(|&id| find(id).map(|value| (id, value.clone())))
        .collect()
}
