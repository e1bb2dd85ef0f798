//! Prefabs and meshes as JSON: named by their sources and ids, with what was edited, never written out.
//! What is read of that is a placeholder of the same ids until the source is imported.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DAffine3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{MaterialRecord, MeshRecord};
use crate::assets::{Mesh, MeshData, Primitive, ShapeSource, Texture};
use crate::ids::{MaterialId, MeshId, PrefabId, TextureId};
use crate::import::placeholder_texture;
use crate::package::{AssetNames, MaterialEntry, PrefabPackage};
use crate::prefab::Prefab;
use crate::{Material, project::paths};

/// A prefab: its file and the ids of what it brings, in the order of the file.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct PrefabRecord {
    pub id: PrefabId,
    pub name: String,
    /// Relative to the project, with forward slashes; in a journal absolute.
    pub source: String,
    #[serde(default)]
    pub meshes: Vec<MeshId>,
    #[serde(default)]
    pub materials: Vec<MaterialId>,
    #[serde(default)]
    pub textures: Vec<TextureId>,
    #[serde(default, skip_serializing_if = "AssetNames::is_empty")]
    pub asset_names: AssetNames,
}

impl PrefabRecord {
    pub fn of(id: PrefabId, prefab: &Prefab, source: String) -> Self {
        Self {
            id,
            name: prefab.name.clone(),
            source,
            meshes: prefab.meshes.clone(),
            materials: prefab.materials.clone(),
            textures: prefab.textures.clone(),
            asset_names: AssetNames::clone(&prefab.asset_names),
        }
    }
}

/// A prefab with its edits.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct PackageRecord {
    prefab: PrefabRecord,
    /// Its file could not be read: it is not tried again.
    #[serde(default)]
    missing: bool,
    /// Materials that differ from what the file says.
    #[serde(default)]
    edited: Vec<MaterialRecord>,
    #[serde(default)]
    moved: Vec<MeshRecord>,
    /// Materials that stand by themselves.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    beside: Vec<MaterialRecord>,
}

impl From<PrefabPackage> for PackageRecord {
    fn from(package: PrefabPackage) -> Self {
        let PrefabPackage { id, prefab, meshes, materials, beside, .. } = package;
        let edited = materials.into_iter().filter(|(_, entry)| entry.is_edited());
        let record = |(id, entry): (MaterialId, MaterialEntry)| MaterialRecord {
            id,
            value: Arc::unwrap_or_clone(entry.value),
        };
        Self {
            missing: prefab.missing,
            edited: edited.map(record).collect(),
            beside: beside.into_iter().map(record).collect(),
            moved: meshes.iter().filter_map(|(id, mesh)| MeshRecord::of(*id, mesh)).collect(),
            prefab: PrefabRecord::of(id, &prefab, paths::absolute_text(&prefab.source)),
        }
    }
}

impl From<PackageRecord> for PrefabPackage {
    fn from(record: PackageRecord) -> Self {
        let mut package = placeholder(&record.prefab, PathBuf::from(&record.prefab.source));
        package.prefab.missing = record.missing;
        for MaterialRecord { id, value } in record.edited {
            let place = package.materials.iter_mut().find(|(known, _)| *known == id);
            if let Some((_, entry)) = place {
                entry.value = Arc::new(value);
            }
        }
        let beside = record.beside.into_iter();
        package.beside =
            beside.map(|MaterialRecord { id, value }| (id, MaterialEntry::made_here(value))).collect();
        for MeshRecord { id, primitives } in record.moved {
            let place = package.meshes.iter_mut().find(|(known, _)| *known == id);
            if let (Some((_, mesh)), Some((&last, _))) = (place, primitives.last_key_value()) {
                // Of the primitives only their places are known.
                let at = |index| primitives.get(&index).map_or(DAffine3::IDENTITY, DAffine3::from_cols_array);
                mesh.primitives = (0..=last).map(|index| unread_primitive(at(index))).collect();
            }
        }
        package
    }
}

fn unread_primitive(mesh_from_primitive: DAffine3) -> Primitive {
    Primitive { first_index: 0, index_count: 0, material: MaterialId::default(), mesh_from_primitive }
}

impl MeshRecord {
    /// The primitives of a mesh that were moved, if any were.
    pub fn of(id: MeshId, mesh: &Mesh) -> Option<Self> {
        let moved = mesh.primitives.iter().zip(0..);
        let moved = moved.filter(|(primitive, _)| primitive.mesh_from_primitive != DAffine3::IDENTITY);
        let primitives: BTreeMap<u32, [f64; 12]> =
            moved.map(|(primitive, index)| (index, primitive.mesh_from_primitive.to_cols_array())).collect();
        (!primitives.is_empty()).then_some(Self { id, primitives })
    }
}

/// Spheres and boxes: how they are made, never the shapes themselves.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct ShapeMeshRecord {
    pub name: String,
    /// The path of a file is relative to the project, with forward slashes; in a journal absolute.
    pub source: ShapeSource,
    /// One a primitive.
    #[serde(default)]
    pub materials: Vec<MaterialId>,
}

impl ShapeMeshRecord {
    /// `None` for a mesh of triangles.
    pub fn of(mesh: &Mesh, write_path: impl FnOnce(&Path) -> String) -> Option<Self> {
        let mut source = mesh.shapes()?.source().clone();
        if let ShapeSource::File(file) = &mut source {
            file.path = write_path(&file.path).into();
        }
        let materials = mesh.primitives.iter().map(|primitive| primitive.material).collect();
        Some(Self { name: mesh.name.clone(), source, materials })
    }
}

impl Serialize for Mesh {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let record = ShapeMeshRecord::of(self, paths::absolute_text);
        let still =
            self.primitives.iter().all(|primitive| primitive.mesh_from_primitive == DAffine3::IDENTITY);
        match record.filter(|_| still) {
            Some(record) => record.serialize(serializer),
            None => Err(serde::ser::Error::custom(
                "only spheres and boxes that stand where they were made are written",
            )),
        }
    }
}

impl<'de> Deserialize<'de> for Mesh {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let ShapeMeshRecord { name, source, materials } = ShapeMeshRecord::deserialize(deserializer)?;
        Self::of_shapes(name, source, &materials).map_err(serde::de::Error::custom)
    }
}

/// A mesh of nothing that stands for one which is not there.
pub(crate) fn missing_mesh(id: MeshId) -> Mesh {
    Mesh::new(format!("missing {}", id.0), Arc::new(MeshData::default()), Vec::new())
}

/// A prefab without parts, with an empty asset behind every id that is known.
pub(crate) fn placeholder(record: &PrefabRecord, source: PathBuf) -> PrefabPackage {
    let mut prefab = Prefab::new(record.name.clone(), source);
    prefab.missing = true;
    prefab.meshes.clone_from(&record.meshes);
    prefab.materials.clone_from(&record.materials);
    prefab.textures.clone_from(&record.textures);
    prefab.asset_names = Arc::new(record.asset_names.clone());
    let named = |id: u64| format!("missing {id}");
    let material = |id: u64| MaterialEntry::imported(Material { name: named(id), ..Material::default() });
    let texture = placeholder_texture(String::new());
    let texture = |id: u64| Texture { name: named(id), ..texture.clone() };
    PrefabPackage {
        id: record.id,
        meshes: record.meshes.iter().map(|&id| (id, missing_mesh(id))).collect(),
        materials: record.materials.iter().map(|&id| (id, material(id.0))).collect(),
        textures: record.textures.iter().map(|&id| (id, texture(id.0))).collect(),
        beside: Vec::new(),
        prefab,
    }
}
