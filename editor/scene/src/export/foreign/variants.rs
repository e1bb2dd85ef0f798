//! Variants of materials of all sources in one list. In: the sources. Out: one variant for each name, as an instance of the
//! scene is asked for it, and which of them those of a source became. Names that repeat within a source stay apart.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::ids::PrefabId;
use crate::import::short;
use crate::prefab::Prefab;
use crate::prefab::scenes::told_apart;

/// The variants in the making.
#[derive(Default)]
pub(super) struct Variants<'a> {
    /// What to call each, and how its first source gives it.
    list: Vec<(String, &'a Value)>,
    known: BTreeMap<String, usize>,
    /// By source: the places in the list of its variants.
    pub places: BTreeMap<PrefabId, Vec<usize>>,
}

impl<'a> Variants<'a> {
    /// Those of the sources, in order. `warnings`: what of them is lost.
    pub fn of(sources: &[(PrefabId, &'a Prefab)], warnings: &mut Vec<String>) -> Self {
        let mut variants = Self::default();
        for &(id, prefab) in sources {
            let named = prefab.variants().into_iter().zip(&prefab.foreign.variants);
            let places =
                named.map(|(name, value)| variants.place_of(prefab, name, value, warnings)).collect();
            variants.places.insert(id, places);
        }
        variants
    }

    fn place_of(
        &mut self,
        prefab: &Prefab,
        name: String,
        value: &'a Value,
        warnings: &mut Vec<String>,
    ) -> usize {
        let Some(&place) = self.known.get(&name) else {
            let place = self.list.len();
            self.known.insert(name.clone(), place);
            self.list.push((name, value));
            return place;
        };
        let says_more = |value: &Value| value.as_object().is_some_and(|o| o.keys().any(|key| key != "name"));
        if says_more(value) && self.list.get(place).is_some_and(|(_, first)| *first != value) {
            let what =
                format!("what it says of the variant \"{}\" beside its name is left out", short(&name));
            warnings.push(format!("{}: {what}, another source has it too", prefab.name));
        }
        place
    }

    /// Their JSON: named so that import tells them apart by the same names.
    pub fn list(&self) -> Vec<Value> {
        let said = |value: &Value| value.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
        let read_as: Vec<String> =
            told_apart("variant", self.list.iter().map(|(_, value)| said(value)).collect());
        let is_read_so = self.list.iter().zip(&read_as).all(|((name, _), read_as)| name == read_as);
        let one = |(name, value): &(String, &Value)| {
            let mut value = (*value).clone();
            if let Some(object) = value.as_object_mut().filter(|o| !is_read_so || !o.contains_key("name")) {
                object.insert("name".to_owned(), name.as_str().into());
            }
            value
        };
        self.list.iter().map(one).collect()
    }
}
