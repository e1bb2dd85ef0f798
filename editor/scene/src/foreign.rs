//! What a source file says and the program does not know: `extras`, unknown extensions, and how it was written.
//! Kept as it was read, by place in the prefab, so that an export can say it again. Nothing here is looked into.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

/// What is kept of one file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Foreign {
    /// Who made it.
    pub copyright: Option<String>,
    /// Of the object `asset`.
    pub asset: Unknown,
    /// Of the file as a whole.
    pub file: Unknown,
    /// Of the scene that was read.
    pub scene: Unknown,
    /// By index of the part.
    pub parts: BTreeMap<u32, Unknown>,
    /// By place in the list of the prefab.
    pub meshes: BTreeMap<usize, Unknown>,
    /// By place in the list of the prefab.
    pub materials: BTreeMap<usize, Unknown>,
    /// How many of the parts that follow a part were GPU instances of its mesh.
    pub instanced: BTreeMap<u32, u32>,
    /// Variants of materials (KHR_materials_variants), as the file lists them.
    pub variants: Vec<Value>,
    /// By mesh and primitive: places of a material and of the variants that choose it.
    pub mappings: BTreeMap<(usize, usize), Vec<Mapping>>,
}

/// A material of a primitive, and the variants that choose it; places in the lists of the prefab.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mapping {
    pub material: usize,
    pub variants: Vec<usize>,
}

/// What is kept of one object.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Unknown {
    pub extras: Option<Value>,
    pub extensions: Map<String, Value>,
}

impl Unknown {
    pub fn is_empty(&self) -> bool {
        self.extras.is_none() && self.extensions.is_empty()
    }
}

impl Foreign {
    /// Every object of which something is kept.
    pub fn all(&self) -> impl Iterator<Item = &Unknown> {
        let lists = self.meshes.values().chain(self.materials.values()).chain(self.parts.values());
        [&self.asset, &self.file, &self.scene].into_iter().chain(lists)
    }
}
