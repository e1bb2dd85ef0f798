//! Persistent ids: what a project file, the undo history and the renderer's instances agree on.
//! Every id of one document comes from one counter and is never given out twice, also after a delete. A file that somebody else
//! wrote may use a number once for each kind: nothing may ask for an id without its kind.
//! A [`Target`] names what can be selected: a node, or one part inside a prefab instance.

use serde::{Deserialize, Serialize};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(
            Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
        )]
        #[serde(transparent)]
        pub struct $name(pub u64);
    };
}

id!(
    /// Persistent id of a document node.
    NodeId
);
id!(
    /// Persistent id of a prefab: one imported file.
    PrefabId
);
id!(
    /// Persistent id of a mesh.
    MeshId
);
id!(
    /// Persistent id of a material.
    MaterialId
);
id!(
    /// Persistent id of a texture: one image with one sampler and one colour space.
    TextureId
);

/// What a selection or an edit points at: a document node, or a part inside a prefab instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Target {
    /// The document node; for a part, the node that instances the prefab.
    pub node: NodeId,
    /// Index into the prefab's `nodes`; `None` is the document node itself.
    pub part: Option<u32>,
}

impl Target {
    /// The document node itself.
    pub const fn node(node: NodeId) -> Self {
        Self { node, part: None }
    }

    /// A part inside the prefab that `node` instances.
    pub const fn part(node: NodeId, part: u32) -> Self {
        Self { node, part: Some(part) }
    }
}

impl From<NodeId> for Target {
    fn from(node: NodeId) -> Self {
        Self::node(node)
    }
}
