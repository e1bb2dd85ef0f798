//! A document as the text of a project file.
//! In: document and meta. Out: JSON with a fixed order of keys: the same scene gives the same bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DAffine3;
use serde_json::{Map, Value};

use super::paths::to_relative;
use super::record::{
    CameraRecord, EnvironmentRecord, MaterialRecord, MeshRecord, NodeRecord, OverrideRecord, PrefabRecord,
    ProjectRecord, ShapesRecord,
};
use super::{ProjectMeta, SCHEMA_VERSION};
use crate::animation::ClipChoice;
use crate::assets::{Environment, Mesh, ShapeFile, ShapeSource};
use crate::document::Document;
use crate::ids::{MeshId, NodeId};
use crate::node::{Node, NodeKind};

/// The text of a project that will stand at `path`.
pub(super) fn to_text(
    path: &Path,
    document: &Document,
    meta: &ProjectMeta,
) -> Result<String, serde_json::Error> {
    let record = ProjectRecord {
        caustica: SCHEMA_VERSION,
        next_id: document.next_id(),
        prefabs: prefabs(path, document, meta),
        materials: materials(document, meta),
        shapes: shapes(path, document, meta),
        meshes: meshes(document, meta),
        nodes: nodes(document, meta),
        environment: environment(path, document),
        camera: camera(document, meta),
        view: meta.view.clone(),
        render: meta.render.clone(),
        other: meta.kept.top.clone(),
    };
    serde_json::to_string_pretty(&record).map(|text| text + "\n")
}

fn kept(map: &BTreeMap<u64, Map<String, Value>>, id: u64) -> Map<String, Value> {
    map.get(&id).cloned().unwrap_or_default()
}

fn prefabs(path: &Path, document: &Document, meta: &ProjectMeta) -> Vec<PrefabRecord> {
    let record = |(id, prefab): (_, &crate::prefab::Prefab)| PrefabRecord {
        id,
        name: prefab.name.clone(),
        source: to_relative(path, &prefab.source),
        meshes: prefab.meshes.clone(),
        materials: prefab.materials.clone(),
        textures: prefab.textures.clone(),
        other: kept(&meta.kept.prefabs, id.0),
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

/// Only those that are placed: a mesh whose nodes are gone is there for undo alone.
fn shapes(path: &Path, document: &Document, meta: &ProjectMeta) -> Vec<ShapesRecord> {
    let placed: BTreeSet<_> = document.nodes().filter_map(|(id, _)| document.mesh_of(id.into())).collect();
    let record = |(id, mesh): (MeshId, &Mesh)| {
        let source = match mesh.shapes()?.source().clone() {
            ShapeSource::File(file) => {
                ShapeSource::File(ShapeFile { path: to_relative(path, &file.path).into(), ..file })
            }
            other => other,
        };
        let materials = mesh.primitives.iter().map(|primitive| primitive.material).collect();
        Some(ShapesRecord {
            id,
            name: mesh.name.clone(),
            source,
            materials,
            other: kept(&meta.kept.shapes, id.0),
        })
    };
    document.meshes().filter(|(id, _)| placed.contains(id)).filter_map(record).collect()
}

fn meshes(document: &Document, meta: &ProjectMeta) -> Vec<MeshRecord> {
    let mut records: BTreeMap<_, _> =
        meta.kept.meshes.iter().map(|record| (record.id, record.clone())).collect();
    for (id, mesh) in document.meshes() {
        let moved: BTreeMap<u32, [f64; 12]> = mesh
            .primitives
            .iter()
            .enumerate()
            .filter(|(_, primitive)| primitive.mesh_from_primitive != DAffine3::IDENTITY)
            .map(|(index, p)| (index as u32, p.mesh_from_primitive.to_cols_array()))
            .collect();
        if !moved.is_empty() {
            let primitives = moved;
            records.insert(id, MeshRecord { id, primitives });
        }
    }
    records.into_values().collect()
}

fn nodes(document: &Document, meta: &ProjectMeta) -> Vec<NodeRecord> {
    let ids = document.roots().iter().flat_map(|&root| document.subtree_ids(root));
    ids.filter_map(|id| Some(node(id, document.node(id)?, meta))).collect()
}

fn node(id: NodeId, node: &Node, meta: &ProjectMeta) -> NodeRecord {
    let mut record = NodeRecord {
        id,
        name: node.name.clone(),
        parent: node.parent,
        local: node.local.into(),
        visible: node.visible,
        locked: node.locked,
        ray_visibility: node.ray_visibility,
        prefab: None,
        overrides: BTreeMap::new(),
        clip: ClipChoice::default(),
        variant: None,
        mesh: None,
        materials: Vec::new(),
        weights: Vec::new(),
        light: None,
        camera: None,
        other: kept(&meta.kept.nodes, id.0),
    };
    match &node.kind {
        NodeKind::Group => {}
        NodeKind::Prefab { prefab, overrides, clip, variant } => {
            record.prefab = Some(*prefab);
            record.variant.clone_from(variant);
            record.clip = *clip;
            let overrides = overrides.iter();
            record.overrides =
                overrides.map(|(path, value)| (path.clone(), OverrideRecord::from(value.clone()))).collect();
        }
        NodeKind::Mesh { mesh, materials, weights } => {
            record.mesh = Some(*mesh);
            record.weights.clone_from(weights);
            record.materials.clone_from(materials);
        }
        NodeKind::Light(light) => record.light = Some(*light),
        NodeKind::Camera(camera) => record.camera = Some(*camera),
    }
    record
}

fn environment(path: &Path, document: &Document) -> EnvironmentRecord {
    match document.environment() {
        Environment::Auto => EnvironmentRecord::Auto,
        Environment::DefaultSky => EnvironmentRecord::Sky,
        Environment::Constant(radiance) => EnvironmentRecord::Constant { radiance: *radiance },
        Environment::File(file) => EnvironmentRecord::File {
            path: to_relative(path, &file.path),
            rotation_rad: file.rotation_rad,
            scale: file.scale,
        },
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
