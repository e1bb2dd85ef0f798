//! Names of what a prefab brings: by them it keeps its ids when its file has changed.
//! In: ids with their names, and the names in the file as it is now. Out: an id for each.

use std::collections::{HashMap, VecDeque};

use serde::{Deserialize, Serialize};

use crate::import::Imported;

/// Names in the file, in the order of the prefab's lists of ids.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct AssetNames {
    #[serde(skip_serializing_if = "Names::is_empty")]
    pub meshes: Names,
    #[serde(skip_serializing_if = "Names::is_empty")]
    pub materials: Names,
    #[serde(skip_serializing_if = "Names::is_empty")]
    pub textures: Names,
}

/// Names of one kind of asset. They need not be unique: the n-th of a name stays the n-th.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Names {
    /// Of what the file has now. Of another length than the ids: not known.
    pub now: Vec<String>,
    /// What the file had once, with its id: it may come back.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gone: Vec<(u64, String)>,
}

impl AssetNames {
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty() && self.materials.is_empty() && self.textures.is_empty()
    }

    /// The names in a file.
    pub fn of(imported: &Imported) -> Self {
        let names = |now: Vec<String>| Names { now, gone: Vec::new() };
        Self {
            meshes: names(imported.meshes.iter().map(|mesh| mesh.name.clone()).collect()),
            materials: names(imported.materials.iter().map(|material| material.name.clone()).collect()),
            textures: names(imported.textures.iter().map(|texture| texture.name.clone()).collect()),
        }
    }

    /// Puts other ids in the place of those of what is gone.
    pub fn map_gone(&mut self, map: impl Fn(u64) -> u64) {
        for names in [&mut self.meshes, &mut self.materials, &mut self.textures] {
            names.gone.iter_mut().for_each(|(id, _)| *id = map(*id));
        }
    }

    /// The ids of what is gone.
    pub fn gone(&self) -> impl Iterator<Item = u64> + '_ {
        let all = [&self.meshes, &self.materials, &self.textures];
        all.into_iter().flat_map(|names| &names.gone).map(|(id, _)| *id)
    }
}

impl Names {
    fn is_empty(&self) -> bool {
        self.now.is_empty() && self.gone.is_empty()
    }

    /// Ids for what a file has now: those that the names had before, by place when these are not known, and for the rest
    /// fresh ones. `self` becomes the names of the file, with those that are gone.
    pub fn keep_ids(&mut self, ids: &[u64], now: Vec<String>, mut fresh: impl FnMut() -> u64) -> Vec<u64> {
        let before = std::mem::replace(&mut self.now, now);
        if before.len() != ids.len() {
            let known = ids.iter().copied().map(Some).chain(std::iter::repeat(None));
            return self.now.iter().zip(known).map(|(_, id)| id.unwrap_or_else(&mut fresh)).collect();
        }
        let gone = std::mem::take(&mut self.gone);
        let known: Vec<(u64, String)> = ids.iter().copied().zip(before).chain(gone).collect();
        let mut by_name: HashMap<&str, VecDeque<u64>> = HashMap::new();
        for (id, name) in &known {
            by_name.entry(name).or_default().push_back(*id);
        }
        let mut id_of = |name: &String| by_name.get_mut(name.as_str()).and_then(VecDeque::pop_front);
        let kept = self.now.iter().map(|name| id_of(name).unwrap_or_else(&mut fresh)).collect();
        let is_left =
            |(id, name): &(u64, String)| by_name.get(name.as_str()).is_some_and(|ids| ids.contains(id));
        self.gone = known.iter().filter(|known| is_left(known)).cloned().collect();
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn names_keep_their_ids_and_come_back_to_them() {
        let mut known = Names { now: names(&["a", "b", "b"]), gone: Vec::new() };
        let mut next = 10;
        let mut fresh = || {
            next += 1;
            next
        };
        assert_eq!(known.keep_ids(&[1, 2, 3], names(&["b", "c", "a"]), &mut fresh), [2, 11, 1]);
        assert_eq!(known.gone, [(3, "b".to_owned())]);
        assert_eq!(known.keep_ids(&[2, 11, 1], names(&["d"]), &mut fresh), [12]);
        assert_eq!(known.keep_ids(&[12], names(&["b", "a", "b", "c"]), &mut fresh), [2, 1, 3, 11]);
        assert_eq!(known.gone, [(12, "d".to_owned())]);
        // Of a file that was written before names were noted.
        let mut unknown = Names::default();
        assert_eq!(unknown.keep_ids(&[1, 2], names(&["x", "y", "z"]), &mut fresh), [1, 2, 13]);
    }
}
