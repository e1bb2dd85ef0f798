//! A document as the text of a project file.
//! In: document and meta. Out: JSON with a fixed order of keys: the same scene gives the same bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DAffine3;
use serde_json::{Map, Value};

use super::paths::to_relative;
use super::record::{
    CameraRecord, EnvironmentRecord, MaterialRecord, MeshRecord, NodeRecord, PrefabRecord, ProjectRecord,
    ShapeMeshRecord, ShapesRecord,
};
use super::{ProjectMeta, SCHEMA_VERSION};
use crate::assets::{Environment, Mesh};
use crate::document::Document;
use crate::edit::Edit;
use crate::ids::MeshId;

/// The text of a project that will stand at `path`.
pub(super) fn to_text(
    path: &Path,
    document: &Document,
    meta: &ProjectMeta,
) -> Result<String, serde_json::Error> {
    let relative = |file: &Path| to_relative(path, file);
    serde_json::to_string_pretty(&record_of(relative, document, meta)).map(|text| text + "\n")
}

/// What a project says; `name` writes the paths of files.
pub(super) fn record_of(
    name: impl Fn(&Path) -> String,
    document: &Document,
    meta: &ProjectMeta,
) -> ProjectRecord {
    ProjectRecord {
        caustica: SCHEMA_VERSION,
        next_id: document.next_id(),
        prefabs: prefabs(&name, document, meta),
        materials: materials(document, meta),
        shapes: shapes(&name, document, meta),
        meshes: meshes(document, meta),
        nodes: nodes(document, meta),
        environment: environment(&name, document),
        camera: camera(document, meta),
        view: meta.view.clone(),
        render: meta.render.clone(),
        other: meta.kept.top.clone(),
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

fn kept(map: &BTreeMap<u64, Map<String, Value>>, id: u64) -> Map<String, Value> {
    map.get(&id).cloned().unwrap_or_default()
}

fn prefabs(name: impl Fn(&Path) -> String, document: &Document, meta: &ProjectMeta) -> Vec<PrefabRecord> {
    let record = |(id, prefab): (crate::PrefabId, &crate::Prefab)| PrefabRecord {
        other: kept(&meta.kept.prefabs, id.0),
        ..PrefabRecord::of(id, prefab, name(&prefab.source))
    };
    document.prefabs().map(record).collect()
}

/// Only materials that differ from their source, or have none.
fn materials(document: &Document, meta: &ProjectMeta) -> Vec<MaterialRecord> {
    document
        .materials()
        .filter(|(id, value)| {
            let entry = document.material_entry(*id);
            entry.and_then(|entry| entry.original.as_ref()) != Some(value)
        })
        .map(|(id, value)| MaterialRecord {
            id,
            value: value.clone(),
            other: kept(&meta.kept.materials, id.0),
        })
        .collect()
}

fn shapes(name: impl Fn(&Path) -> String, document: &Document, meta: &ProjectMeta) -> Vec<ShapesRecord> {
    let is_written = written_meshes(document);
    let record = |(id, mesh): (MeshId, &Mesh)| {
        let mesh = ShapeMeshRecord::of(mesh, &name)?;
        Some(ShapesRecord { id, mesh, other: kept(&meta.kept.shapes, id.0) })
    };
    document.meshes().filter(|(id, mesh)| is_written(*id, mesh)).filter_map(record).collect()
}

fn meshes(document: &Document, meta: &ProjectMeta) -> Vec<MeshRecord> {
    let mut records: BTreeMap<_, _> =
        meta.kept.meshes.iter().map(|record| (record.id, record.clone())).collect();
    let is_written = written_meshes(document);
    let written = document.meshes().filter(|(id, mesh)| is_written(*id, mesh));
    let moved = written.filter_map(|(id, mesh)| MeshRecord::of(id, mesh));
    records.extend(moved.map(|record| (record.id, record)));
    records.into_values().collect()
}

fn nodes(document: &Document, meta: &ProjectMeta) -> Vec<NodeRecord> {
    let ids = document.roots().iter().flat_map(|&root| document.subtree_ids(root));
    ids.filter_map(|id| {
        let record = NodeRecord::of(id, document.node(id)?);
        Some(NodeRecord { other: kept(&meta.kept.nodes, id.0), ..record })
    })
    .collect()
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
