//! What stands in a project file, field by field; what else stands there is kept by `unknown.rs`.
//! Knows JSON and the values of the document, not the document. Prefabs and meshes are in `record/assets.rs`.

use std::collections::BTreeMap;

use glam::{DAffine3, DQuat, DVec3, Vec3};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::paths::absolute_text;
use crate::animation::ClipChoice;
use crate::assets::{Camera, Environment, EnvironmentFile, Light, Material};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId};
use crate::node::{Node, NodeKind, RayVisibility, Subtree};
use crate::prefab::{PartOverride, PartPath};
use crate::transform::{Local, Trs};

mod assets;

pub(crate) use assets::PackageRecord;
pub(super) use assets::{PrefabRecord, ShapeMeshRecord, missing_mesh, placeholder};

/// The whole file.
#[derive(Default, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct ProjectRecord {
    /// Version of the format.
    pub caustica: u64,
    #[serde(default)]
    pub next_id: u64,
    #[serde(default)]
    pub prefabs: Vec<PrefabRecord>,
    /// Edited materials of prefabs, and materials made in the program.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<MaterialRecord>,
    /// Meshes of spheres and boxes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<ShapesRecord>,
    /// Meshes with moved primitives.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<MeshRecord>,
    /// Parents before children, siblings in order.
    #[serde(default)]
    pub nodes: Vec<NodeRecord>,
    #[serde(default)]
    pub environment: EnvironmentRecord,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraRecord>,
    #[serde(default)]
    pub view: Map<String, Value>,
    #[serde(default)]
    pub render: Map<String, Value>,
}

impl ProjectRecord {
    /// The largest id that anything in the file has, or leaves as the last, and where.
    pub fn largest_id(&self) -> (u64, String) {
        let of = |list: &'static str, ids: Vec<u64>| {
            let largest = (0..).zip(ids).max_by_key(|(_, id)| *id);
            largest.map(|(index, id): (usize, u64)| (id, format!("/{list}/{index}")))
        };
        let prefabs = self.prefabs.iter().map(|prefab| {
            let meshes = prefab.meshes.iter().map(|id| id.0);
            let materials = prefab.materials.iter().map(|id| id.0);
            let textures = prefab.textures.iter().map(|id| id.0);
            let all = meshes.chain(materials).chain(textures).chain(prefab.asset_names.gone());
            all.max().unwrap_or(0).max(prefab.id.0)
        });
        let lists = [
            of("prefabs", prefabs.collect()),
            of("materials", self.materials.iter().map(|material| material.id.0).collect()),
            of("shapes", self.shapes.iter().map(|shapes| shapes.id.0).collect()),
            of("nodes", self.nodes.iter().map(|node| node.id.0).collect()),
        ];
        let next = (self.next_id.saturating_sub(1), "/nextId".to_owned());
        lists.into_iter().flatten().fold(next, |most, other| if other.0 > most.0 { other } else { most })
    }
}

#[derive(Serialize, Deserialize)]
pub(crate) struct MaterialRecord {
    pub id: MaterialId,
    pub value: Material,
}

/// A mesh of spheres and boxes: how they are made, never the shapes themselves.
#[derive(Serialize, Deserialize)]
pub(crate) struct ShapesRecord {
    pub id: MeshId,
    #[serde(flatten)]
    pub mesh: ShapeMeshRecord,
}

/// The primitives of a mesh that were moved: index to `mesh_from_primitive`, column by column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct MeshRecord {
    pub id: MeshId,
    pub primitives: BTreeMap<u32, [f64; 12]>,
}

/// The chosen camera: a node, or a part of the instance by its path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CameraRecord {
    pub node: NodeId,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<PartPath>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "camelCase")]
pub(crate) enum EnvironmentRecord {
    #[default]
    Auto,
    Sky,
    Constant {
        radiance: Vec3,
    },
    #[serde(rename_all = "camelCase")]
    File {
        path: String,
        #[serde(default)]
        rotation_rad: f32,
        #[serde(default = "one")]
        scale: f32,
    },
}

impl From<Environment> for EnvironmentRecord {
    fn from(environment: Environment) -> Self {
        match environment {
            Environment::Auto => Self::Auto,
            Environment::DefaultSky => Self::Sky,
            Environment::Constant(radiance) => Self::Constant { radiance },
            Environment::File(EnvironmentFile { path, rotation_rad, scale, .. }) => {
                Self::File { path: absolute_text(&path), rotation_rad, scale }
            }
        }
    }
}

/// Without the map of a file, which is still to be read.
impl From<EnvironmentRecord> for Environment {
    fn from(record: EnvironmentRecord) -> Self {
        match record {
            EnvironmentRecord::Auto => Self::Auto,
            EnvironmentRecord::Sky => Self::DefaultSky,
            EnvironmentRecord::Constant { radiance } => Self::Constant(radiance),
            EnvironmentRecord::File { path, rotation_rad, scale } => {
                Self::File(EnvironmentFile { path: path.into(), rotation_rad, scale, map: None })
            }
        }
    }
}

fn one() -> f32 {
    1.0
}

fn yes() -> bool {
    true
}

fn is_true(value: &bool) -> bool {
    *value
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// A node; which of `prefab`, `mesh`, `light` and `camera` is there says what it is, none: a group.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct NodeRecord {
    pub id: NodeId,
    pub name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<NodeId>,
    #[serde(default, skip_serializing_if = "LocalRecord::is_identity")]
    pub local: LocalRecord,
    #[serde(default = "yes", skip_serializing_if = "is_true")]
    pub visible: bool,
    #[serde(default, skip_serializing_if = "is_default")]
    pub locked: bool,
    #[serde(default, skip_serializing_if = "is_default")]
    pub ray_visibility: RayVisibility,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prefab: Option<PrefabId>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub overrides: BTreeMap<PartPath, OverrideRecord>,
    /// `"none"`, `"all"` or `{"clip": 2}`; absent: the first.
    #[serde(default, skip_serializing_if = "is_default")]
    pub clip: ClipChoice,
    /// Name of the variant of materials; absent: those of the meshes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Name of the scene of the source; absent: the one that it shows by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshId>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<MaterialId>,
    /// Of the morph targets; absent: those of the mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<f32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Light>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
}

impl NodeRecord {
    pub fn of(id: NodeId, node: &Node) -> Self {
        let mut record = Self {
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
            scene: None,
            mesh: None,
            materials: Vec::new(),
            weights: Vec::new(),
            light: None,
            camera: None,
        };
        match &node.kind {
            NodeKind::Group => {}
            NodeKind::Prefab { prefab, overrides, clip, variant, scene } => {
                record.prefab = Some(*prefab);
                record.variant.clone_from(variant);
                record.scene.clone_from(scene);
                record.clip = *clip;
                let overrides = overrides.iter();
                record.overrides = overrides
                    .map(|(path, value)| (path.clone(), OverrideRecord::from(value.clone())))
                    .collect();
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

    /// The node, without children.
    pub fn into_node(self) -> (NodeId, Node) {
        let kind = match self {
            Self { prefab: Some(prefab), overrides, clip, variant, scene, .. } => NodeKind::Prefab {
                prefab,
                clip,
                variant,
                scene,
                overrides: overrides.into_iter().map(|(path, value)| (path, value.into())).collect(),
            },
            Self { mesh: Some(mesh), materials, weights, .. } => NodeKind::Mesh { mesh, materials, weights },
            Self { light: Some(light), .. } => NodeKind::Light(light),
            Self { camera: Some(camera), .. } => NodeKind::Camera(camera),
            _ => NodeKind::Group,
        };
        let node = Node {
            parent: self.parent,
            visible: self.visible,
            locked: self.locked,
            ray_visibility: self.ray_visibility,
            local: self.local.into(),
            ..Node::new(self.name, kind)
        };
        (self.id, node)
    }
}

impl From<Subtree> for Vec<NodeRecord> {
    fn from(subtree: Subtree) -> Self {
        subtree.nodes.iter().map(|(id, node)| NodeRecord::of(*id, node)).collect()
    }
}

impl From<Vec<NodeRecord>> for Subtree {
    fn from(records: Vec<NodeRecord>) -> Self {
        Self { nodes: records.into_iter().map(NodeRecord::into_node).collect() }
    }
}

/// A matrix, column by column, or translation, rotation (x, y, z, w) and scale.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct LocalRecord {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[f64; 12]>,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub translation: DVec3,
    #[serde(default = "unturned", skip_serializing_if = "is_unturned")]
    pub rotation: DQuat,
    #[serde(default = "unscaled", skip_serializing_if = "is_unscaled")]
    pub scale: DVec3,
}

fn unturned() -> DQuat {
    DQuat::IDENTITY
}

fn unscaled() -> DVec3 {
    DVec3::ONE
}

// Negative zeros are written, so that what is read is the same to the bit.
fn is_zero(value: &DVec3) -> bool {
    value.to_array().map(f64::to_bits) == [0; 3]
}

fn is_unturned(value: &DQuat) -> bool {
    value.to_array().map(f64::to_bits) == DQuat::IDENTITY.to_array().map(f64::to_bits)
}

fn is_unscaled(value: &DVec3) -> bool {
    *value == DVec3::ONE
}

impl Default for LocalRecord {
    fn default() -> Self {
        Local::default().into()
    }
}

impl LocalRecord {
    fn is_identity(&self) -> bool {
        self.matrix.is_none() && !self.has_trs()
    }

    /// Whether a translation, rotation or scale is set.
    pub fn has_trs(&self) -> bool {
        !(is_zero(&self.translation) && is_unturned(&self.rotation) && is_unscaled(&self.scale))
    }
}

impl From<Local> for LocalRecord {
    fn from(local: Local) -> Self {
        let (trs, matrix) = match local {
            Local::Trs(trs) => (trs, None),
            Local::Matrix(matrix) => (Trs::IDENTITY, Some(matrix.to_cols_array())),
        };
        Self { matrix, translation: trs.translation, rotation: trs.rotation, scale: trs.scale }
    }
}

impl From<LocalRecord> for Local {
    fn from(record: LocalRecord) -> Self {
        match record.matrix {
            Some(columns) => Self::Matrix(DAffine3::from_cols_array(&columns)),
            None => Self::Trs(Trs {
                translation: record.translation,
                rotation: record.rotation,
                scale: record.scale,
            }),
        }
    }
}

/// What an instance says differently about a part.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct OverrideRecord {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local: Option<LocalRecord>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub visible: Option<bool>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<u32, MaterialId>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Light>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<Vec<f32>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ray_visibility: Option<RayVisibility>,
}

impl From<PartOverride> for OverrideRecord {
    fn from(value: PartOverride) -> Self {
        Self {
            name: value.name,
            local: value.local.map(LocalRecord::from),
            visible: value.visible,
            materials: value.materials,
            light: value.light,
            camera: value.camera,
            weights: value.weights,
            ray_visibility: value.ray_visibility,
        }
    }
}

impl From<OverrideRecord> for PartOverride {
    fn from(record: OverrideRecord) -> Self {
        Self {
            name: record.name,
            local: record.local.map(Local::from),
            visible: record.visible,
            materials: record.materials,
            light: record.light,
            camera: record.camera,
            weights: record.weights,
            ray_visibility: record.ray_visibility,
        }
    }
}
