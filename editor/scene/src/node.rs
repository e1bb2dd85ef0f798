//! A node of the document and what it may be.
//! Nodes are changed by edits only; the document owns them and hands out references.

use std::collections::BTreeMap;

use crate::assets::{Camera, Light};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId};
use crate::prefab::{PartOverride, PartPath};
use crate::transform::Local;

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
    /// What it is.
    pub kind: NodeKind,
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
    },
    /// Places a mesh.
    Mesh {
        /// Which mesh.
        mesh: MeshId,
        /// One material for each primitive of the mesh.
        materials: Vec<MaterialId>,
    },
    /// A light.
    Light(Light),
    /// A camera.
    Camera(Camera),
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
#[derive(Clone, Debug, Default, PartialEq)]
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
