//! A document as the text of a project file.
//! In: document and meta. Out: JSON with a fixed order of keys: the same scene gives the same bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DAffine3;

use super::paths::to_relative;
use super::record::{
    CameraRecord, EnvironmentRecord, MaterialRecord, MeshRecord, NodeRecord, PrefabRecord, ProjectRecord,
    ShapeMeshRecord, ShapesRecord,
};
use super::unknown::ProjectFile;
use super::{ProjectMeta, ProjectProblem, SCHEMA_VERSION};
use crate::assets::{Environment, Material, Mesh, ShapeSource};
use crate::document::Document;
use crate::edit::Edit;
use crate::ids::{MaterialId, MeshId};
use crate::package::MaterialEntry;

/// The text of a project that will stand at `path`.
pub(super) fn to_text(
    path: &Path,
    document: &Document,
    meta: &ProjectMeta,
) -> Result<String, ProjectProblem> {
    if let Some(file) = files(document).find(|file| file.to_str().is_none()) {
        let shown = file.display();
        return Err(ProjectProblem::Broken(format!(
            "the name of {shown}, which is in the scene, is not UTF-8 and cannot be written; rename the file and replace the source"
        )));
    }
    let relative = |file: &Path| to_relative(path, file);
    Ok(serde_json::to_string_pretty(&file_of(relative, document, meta))? + "\n")
}

/// The files that a document names.
fn files(document: &Document) -> impl Iterator<Item = &Path> {
    let prefabs = document.prefabs().map(|(_, prefab)| prefab.source.as_path());
    let shapes = document.meshes().filter_map(|(_, mesh)| match mesh.shapes()?.source() {
        ShapeSource::File(file) => Some(file.path.as_path()),
        _ => None,
    });
    let environment = match document.environment() {
        Environment::File(file) => Some(file.path.as_path()),
        _ => None,
    };
    prefabs.chain(shapes).chain(environment)
}

/// What a project says, with what was in its file besides; `name` writes the paths of files.
pub(super) fn file_of(
    name: impl Fn(&Path) -> String,
    document: &Document,
    meta: &ProjectMeta,
) -> ProjectFile {
    let name = |file: &Path| meta.kept.paths.get(file).cloned().unwrap_or_else(|| name(file));
    ProjectFile { record: record_of(name, document, meta), unknown: meta.kept.unknown.clone() }
}

fn record_of(name: impl Fn(&Path) -> String, document: &Document, meta: &ProjectMeta) -> ProjectRecord {
    ProjectRecord {
        caustica: SCHEMA_VERSION,
        next_id: document.next_id(),
        prefabs: prefabs(&name, document),
        materials: materials(document, meta),
        shapes: shapes(&name, document),
        meshes: meshes(document, meta),
        nodes: nodes(document),
        environment: environment(&name, document),
        camera: camera(document, meta),
        view: meta.view.clone(),
        render: meta.render.clone(),
    }
}

/// Edits that add what is in a document, but not in its record, because nothing uses it: undo may bring it back.
pub(super) fn left_out(document: &Document) -> Vec<Edit> {
    let is_written = written_meshes(document);
    let left = document.meshes().filter(|(id, mesh)| !is_written(*id, mesh));
    left.flat_map(|(mesh, value)| {
        let mut value = value.clone();
        let mut edits = Vec::new();
        for (primitive, slot) in (0..).zip(&mut value.primitives) {
            let mesh_from_primitive = std::mem::take(&mut slot.mesh_from_primitive);
            if mesh_from_primitive != DAffine3::IDENTITY {
                edits.push(Edit::SetPrimitiveTransform { mesh, primitive, mesh_from_primitive });
            }
        }
        value.update_bounds();
        std::iter::once(Edit::AddMesh { mesh, value: Box::new(value) }).chain(edits)
    })
    .collect()
}

/// Whether a mesh is in the record: those of prefabs are, and spheres and boxes that are placed. A mesh of them whose nodes are
/// gone is there for undo alone.
fn written_meshes(document: &Document) -> impl Fn(MeshId, &Mesh) -> bool {
    let placed: BTreeSet<_> = document.nodes().filter_map(|(id, _)| document.mesh_of(id.into())).collect();
    move |id, mesh| mesh.shapes().is_none() || placed.contains(&id)
}

fn prefabs(name: impl Fn(&Path) -> String, document: &Document) -> Vec<PrefabRecord> {
    document.prefabs().map(|(id, prefab)| PrefabRecord::of(id, prefab, name(&prefab.source))).collect()
}

/// Only materials that differ from their source, or have none.
fn materials(document: &Document, meta: &ProjectMeta) -> Vec<MaterialRecord> {
    let is_edited = |id| document.material_entry(id).is_some_and(MaterialEntry::is_edited);
    let record = |(id, value): (MaterialId, &Material)| {
        let mut value = value.clone();
        let kept = meta.kept.textures.get(&id);
        for (slot, place) in value.texture_slots_mut().enumerate() {
            *place = place.or_else(|| kept?.get(&slot).copied());
        }
        MaterialRecord { id, value }
    };
    document.materials().filter(|(id, _)| is_edited(*id)).map(record).collect()
}

fn shapes(name: impl Fn(&Path) -> String, document: &Document) -> Vec<ShapesRecord> {
    let is_written = written_meshes(document);
    let record = |(id, mesh)| Some(ShapesRecord { id, mesh: ShapeMeshRecord::of(mesh, &name)? });
    document.meshes().filter(|(id, mesh)| is_written(*id, mesh)).filter_map(record).collect()
}

fn meshes(document: &Document, meta: &ProjectMeta) -> Vec<MeshRecord> {
    let brought: BTreeSet<MeshId> = document.prefabs().flat_map(|(_, prefab)| prefab.all_meshes()).collect();
    let mut records = meta.kept.meshes.clone();
    records.retain(|id, _| brought.contains(id));
    let is_written = written_meshes(document);
    let written = document.meshes().filter(|(id, mesh)| is_written(*id, mesh));
    let moved = written.filter_map(|(id, mesh)| MeshRecord::of(id, mesh));
    for MeshRecord { id, primitives } in moved {
        let empty = || MeshRecord { id, primitives: BTreeMap::new() };
        records.entry(id).or_insert_with(empty).primitives.extend(primitives);
    }
    records.into_values().collect()
}

fn nodes(document: &Document) -> Vec<NodeRecord> {
    let ids = document.roots().iter().flat_map(|&root| document.subtree_ids(root));
    ids.filter_map(|id| Some(NodeRecord::of(id, document.node(id)?))).collect()
}

fn environment(name: impl Fn(&Path) -> String, document: &Document) -> EnvironmentRecord {
    match document.environment() {
        Environment::File(file) => EnvironmentRecord::File {
            path: name(&file.path),
            rotation_rad: file.rotation_rad,
            scale: file.scale,
        },
        other => other.clone().into(),
    }
}

fn camera(document: &Document, meta: &ProjectMeta) -> Option<CameraRecord> {
    let Some(target) = document.chosen_camera() else {
        return meta.kept.camera.clone();
    };
    let part = match target.part {
        None => None,
        Some(part) => {
            let prefab = document.prefab(document.node(target.node)?.prefab()?)?;
            Some(prefab.path_of(part)?)
        }
    };
    Some(CameraRecord { node: target.node, part })
}
