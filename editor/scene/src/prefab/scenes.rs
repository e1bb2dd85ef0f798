//! What of a source an instance chooses among by name: scenes, and variants of materials.
//! In: the parts, and what the file calls things. Out: names that differ from each other, and what a choice stands for.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use serde_json::Value;

use super::Prefab;
use crate::assets::Environment;
use crate::foreign::Mapping;
use crate::ids::{MaterialId, MeshId};

/// One of the scenes of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SourceScene {
    /// Name in the file; may be empty.
    pub name: String,
    /// Indices of the parts that it shows with all below them. A part may be in several scenes, or in none.
    pub roots: Vec<u32>,
    /// The environment that it asks for.
    pub environment: Option<Environment>,
}

impl Prefab {
    /// Names of its variants of materials (KHR_materials_variants) in the order of the file; the n-th without a name is
    /// `variant n`, the n-th of one name `NAME#n`.
    pub fn variants(&self) -> Vec<String> {
        let name = |value: &Value| value.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
        told_apart("variant", self.foreign.variants.iter().map(name).collect())
    }

    /// The materials that a variant chooses, by mesh and primitive; the others keep that of the mesh.
    pub(crate) fn variant_materials(&self, name: &str) -> BTreeMap<(MeshId, u32), MaterialId> {
        let Some(variant) = self.variants().iter().position(|known| known == name) else {
            return BTreeMap::new();
        };
        let chosen = |(&(mesh, primitive), mappings): (&(usize, usize), &Vec<Mapping>)| {
            let mapping = mappings.iter().find(|mapping| mapping.variants.contains(&variant))?;
            Some(((*self.meshes.get(mesh)?, primitive as u32), *self.materials.get(mapping.material)?))
        };
        self.foreign.mappings.iter().filter_map(chosen).collect()
    }

    /// The scenes of the file, in its order; none where the format knows no scenes.
    pub fn scenes(&self) -> &[SourceScene] {
        &self.scenes
    }

    /// Names of the scenes, told apart as [`Self::variants`] are: `scene n` and `NAME#n`.
    pub fn scene_names(&self) -> Vec<String> {
        told_apart("scene", self.scenes.iter().map(|scene| scene.name.clone()).collect())
    }

    /// Place of the scene that is shown where none is chosen.
    pub fn default_scene(&self) -> usize {
        self.default_scene
    }

    /// Replaces the scenes.
    pub fn set_scenes(&mut self, scenes: Vec<SourceScene>, default_scene: usize) {
        (self.scenes, self.default_scene) = (scenes, default_scene);
    }

    /// Place of the scene of a name; that of the default one for `None` and where there is no such scene.
    pub(crate) fn scene_place(&self, name: Option<&str>) -> usize {
        let named = name.and_then(|name| self.scene_names().iter().position(|known| known == name));
        named.unwrap_or(self.default_scene)
    }

    /// The environment that a scene asks for.
    pub(crate) fn environment_in(&self, scene: Option<&str>) -> Option<&Environment> {
        match self.scenes.get(self.scene_place(scene)) {
            Some(shown) => shown.environment.as_ref(),
            None => self.environment.as_ref(),
        }
    }

    /// Which parts a scene does not have, by index; empty where it has all.
    pub(crate) fn absent_in(&self, scene: Option<&str>) -> Vec<bool> {
        let Some(shown) = self.scenes.get(self.scene_place(scene)) else {
            return Vec::new();
        };
        let mut absent = vec![true; self.nodes.len()];
        for &root in &shown.roots {
            let run: Range<usize> = root as usize..self.subtree_end(root) as usize;
            absent.get_mut(run).into_iter().flatten().for_each(|absent| *absent = false);
        }
        if absent.contains(&true) { absent } else { Vec::new() }
    }
}

/// Names of which no two are the same: those without one are numbered, and the n-th of one name is `NAME#n`.
pub(crate) fn told_apart(kind: &str, names: Vec<String>) -> Vec<String> {
    let mut taken: BTreeSet<String> = names.iter().cloned().collect();
    let mut used: BTreeMap<String, usize> = BTreeMap::new();
    let own = |(place, name): (usize, String)| {
        let numbered = name.is_empty();
        let base = if numbered { kind.to_owned() } else { name.clone() };
        let (mark, mut number) = if numbered { (' ', place + 1) } else { ('#', 1) };
        let count = used.entry(name).or_default();
        *count += 1;
        if !numbered && *count == 1 {
            return base;
        }
        number = number.max(if numbered { 1 } else { *count });
        loop {
            let candidate = format!("{base}{mark}{number}");
            if taken.insert(candidate.clone()) {
                return candidate;
            }
            number += 1;
        }
    };
    names.into_iter().enumerate().map(own).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart() {
        let names = ["day", "", "day", "day#2", "variant 2", "day"].map(str::to_owned).to_vec();
        let apart = told_apart("variant", names);
        assert_eq!(apart, ["day", "variant 3", "day#3", "day#2", "variant 2", "day#4"]);
    }
}
