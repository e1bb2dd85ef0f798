//! A prefab together with the assets it brings, as one value: what importing adds and undo takes away.
//! Also turns an [`Imported`] file, whose ids are places in its own lists, into one with document ids.

use std::collections::BTreeSet;

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

/// A material with what its source says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MaterialEntry {
    /// What it is now.
    pub value: Material,
    /// What the imported file says; `None` for a material made here.
    pub original: Option<Material>,
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
}

/// The ids that the assets of an imported file get, in the order of its lists.
#[derive(Clone, Debug, Default, PartialEq)]
struct AssetIds {
    meshes: Vec<MeshId>,
    materials: Vec<MaterialId>,
    textures: Vec<TextureId>,
}

impl AssetIds {
    /// Keeps the ids that are there and asks `fresh` for those that are missing.
    fn fill(&mut self, imported: &Imported, mut fresh: impl FnMut() -> u64) {
        let Self { meshes, materials, textures } = self;
        meshes.truncate(imported.meshes.len());
        materials.truncate(imported.materials.len());
        textures.truncate(imported.textures.len());
        meshes.resize_with(imported.meshes.len(), || MeshId(fresh()));
        materials.resize_with(imported.materials.len(), || MaterialId(fresh()));
        textures.resize_with(imported.textures.len(), || TextureId(fresh()));
    }

    fn material(&self, index: MaterialId) -> MaterialId {
        lookup(&self.materials, index.0).unwrap_or(index)
    }
}

fn lookup<T: Copy>(ids: &[T], index: u64) -> Option<T> {
    usize::try_from(index).ok().and_then(|i| ids.get(i)).copied()
}

/// Puts document ids in the place of list indices.
fn package(id: PrefabId, imported: Imported, ids: &AssetIds) -> PrefabPackage {
    let Imported { mut prefab, meshes, materials, textures, .. } = imported;
    prefab.meshes.clone_from(&ids.meshes);
    prefab.materials.clone_from(&ids.materials);
    prefab.textures.clone_from(&ids.textures);
    prefab.map_animated_materials(|index| ids.material(index));
    prefab.map_meshes(|index| lookup(&ids.meshes, index.0).unwrap_or(index));
    let meshes = meshes.into_iter().map(|mut mesh| {
        for primitive in &mut mesh.primitives {
            primitive.material = ids.material(primitive.material);
        }
        mesh
    });
    let materials = materials.into_iter().map(|mut value| {
        for texture_use in value.texture_slots_mut().flatten() {
            texture_use.texture = lookup(&ids.textures, texture_use.texture.0).unwrap_or(texture_use.texture);
        }
        MaterialEntry { original: Some(value.clone()), value }
    });
    PrefabPackage {
        id,
        meshes: ids.meshes.iter().copied().zip(meshes).collect(),
        materials: ids.materials.iter().copied().zip(materials).collect(),
        textures: ids.textures.iter().copied().zip(textures).collect(),
        prefab,
    }
}

/// Gives an imported file the ids that it had before, and new ones to what is new in it.
pub(crate) fn package_with_ids(
    document: &mut Document,
    id: PrefabId,
    imported: Imported,
    (meshes, materials, textures): (&[MeshId], &[MaterialId], &[TextureId]),
) -> PrefabPackage {
    let mut ids =
        AssetIds { meshes: meshes.to_vec(), materials: materials.to_vec(), textures: textures.to_vec() };
    ids.fill(&imported, || document.allocate_id());
    package(id, imported, &ids)
}

impl PrefabPackage {
    /// Materials that were edited stay as they were edited, primitives that were moved stay moved. Of another file, that holds
    /// for materials of the same name and meshes with as many primitives.
    pub(crate) fn keep_edits<'a>(
        &mut self,
        same_file: bool,
        old_material: impl Fn(MaterialId) -> Option<&'a MaterialEntry>,
        old_mesh: impl Fn(MeshId) -> Option<&'a Mesh>,
    ) {
        for (id, entry) in &mut self.materials {
            let Some(old) = old_material(*id).filter(|old| old.original.as_ref() != Some(&old.value)) else {
                continue;
            };
            if same_file || old.original.as_ref().is_some_and(|before| before.name == entry.value.name) {
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
        let package = package_with_ids(self, id, imported, (&[], &[], &[]));
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

    /// The edit that puts a new reading of the source in a prefab's place. Assets keep their ids by their
    /// place in the file; materials that were edited stay as they were edited, primitives that were moved stay moved. Of
    /// another file, that holds for materials of the same name and meshes with as many primitives.
    ///
    /// # Errors
    /// When the prefab is not in the document.
    pub fn reload_edit(&mut self, id: PrefabId, imported: Imported) -> Result<Edit, EditError> {
        let old = self.prefab(id).ok_or_else(|| EditError::NoAsset(format!("prefab {}", id.0)))?;
        let same_file = old.source == imported.prefab.source;
        let (meshes, materials, textures) = (old.meshes.clone(), old.materials.clone(), old.textures.clone());
        let ids = (&meshes[..], &materials[..], &textures[..]);
        let mut package = package_with_ids(self, id, imported, ids);
        package.keep_edits(same_file, |id| self.material_entry(id), |id| self.mesh(id));
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
