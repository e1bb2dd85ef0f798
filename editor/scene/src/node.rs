//! A node of the document and what it may be.
//! Nodes are changed by edits only; the document owns them and hands out references.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::animation::ClipChoice;
use crate::assets::{Camera, Light};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId};
use crate::prefab::{PartOverride, PartPath};
use crate::project::NodeRecord;
use crate::transform::Local;

/// Most nodes that a file or a document may have; each part of each instance counts.
pub(crate) const MAX_NODES: usize = 4_000_000;

/// One node of the document.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Shown in the outliner.
    pub name: String,
    /// `None`: a root.
    pub parent: Option<NodeId>,
    /// In the order of the outliner.
    pub children: Vec<NodeId>,
    /// Transform against the parent.
    pub local: Local,
    /// False: it and everything below is hidden.
    pub visible: bool,
    /// True: it and everything below is kept from being changed.
    pub locked: bool,
    /// Which rays meet the mesh that it places; nothing below follows it.
    pub ray_visibility: RayVisibility,
    /// What it is.
    pub kind: NodeKind,
}

/// Which rays meet a placed mesh, as Blender's ray visibility.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct RayVisibility {
    /// The camera sees it. False: only mirrors, glass and shadows tell of it.
    pub camera_visible: bool,
    /// It stops light on its way.
    pub casts_shadows: bool,
}

impl Default for RayVisibility {
    fn default() -> Self {
        Self { camera_visible: true, casts_shadows: true }
    }
}

/// What a node is.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeKind {
    /// Only holds children.
    Group,
    /// An instance of a prefab.
    Prefab {
        /// Which prefab.
        prefab: PrefabId,
        /// What this instance says differently, by path in the source. Paths that the source no longer
        /// has are kept.
        overrides: BTreeMap<PartPath, PartOverride>,
        /// What it plays.
        clip: ClipChoice,
        /// The variant of materials that it shows, by name; `None`: those of the meshes. A name that the source no longer
        /// has is kept.
        variant: Option<String>,
        /// The scene of the source that it shows, by name; `None`: the one that the source shows by itself. A name that the
        /// source no longer has is kept.
        scene: Option<String>,
    },
    /// Places a mesh.
    Mesh {
        /// Which mesh.
        mesh: MeshId,
        /// One material for each primitive of the mesh.
        materials: Vec<MaterialId>,
        /// Weights of the mesh's morph targets; empty: those of the mesh.
        weights: Vec<f32>,
    },
    /// A light.
    Light(Light),
    /// A camera.
    Camera(Camera),
}

impl NodeKind {
    /// An instance of a prefab that follows it in everything.
    pub fn instance_of(prefab: PrefabId) -> Self {
        let (overrides, clip) = Default::default();
        Self::Prefab { prefab, overrides, clip, variant: None, scene: None }
    }
}

impl Node {
    /// A visible root at the origin.
    pub fn new(name: impl Into<String>, kind: NodeKind) -> Self {
        Self {
            name: name.into(),
            parent: None,
            children: Vec::new(),
            local: Local::default(),
            visible: true,
            locked: false,
            ray_visibility: RayVisibility::default(),
            kind,
        }
    }

    /// The same node at another place.
    pub fn with_local(mut self, local: impl Into<Local>) -> Self {
        self.local = local.into();
        self
    }

    /// The prefab that it instances, if it does.
    pub fn prefab(&self) -> Option<PrefabId> {
        match self.kind {
            NodeKind::Prefab { prefab, .. } => Some(prefab),
            _ => None,
        }
    }
}

/// A node with everything below it, as a value: what adding needs and removing gives back.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<NodeRecord>", into = "Vec<NodeRecord>")]
pub struct Subtree {
    /// The first entry is the top; parents come before their children.
    pub nodes: Vec<(NodeId, Node)>,
}

impl Subtree {
    /// A single node.
    pub fn single(id: NodeId, node: Node) -> Self {
        Self { nodes: vec![(id, node)] }
    }

    /// Id of the top node.
    pub fn top(&self) -> Option<NodeId> {
        self.nodes.first().map(|(id, _)| *id)
    }
}
