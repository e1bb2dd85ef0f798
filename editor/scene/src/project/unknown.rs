//! What a project file says and this version does not know, at any depth, so that the next save says it again.
//! In: the file as JSON and as it was understood. Out: a tree of what is only in the first, laid over what is saved.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use super::record::ProjectRecord;

/// The lists of a project whose elements have an `id`.
const LISTS: [&str; 5] = ["prefabs", "materials", "shapes", "meshes", "nodes"];

/// The text of a project: what this version knows of it, and the rest.
#[derive(Default)]
pub(super) struct ProjectFile {
    pub record: ProjectRecord,
    pub unknown: Unknown,
}

/// Fields that are not in the records, by the element that has them. Empty for what the program wrote itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Unknown {
    top: Fields,
    elements: BTreeMap<(&'static str, u64), Fields>,
}

type Fields = Vec<(String, Extra)>;

#[derive(Clone, Debug, PartialEq)]
enum Extra {
    /// The field is not known.
    Field(Value),
    /// The field is known, but not all that is in it. Kept only while the field is there.
    Inside(Fields),
}

impl ProjectFile {
    /// `file`: the JSON that the record was read from.
    pub fn new(record: ProjectRecord, file: &Value) -> serde_json::Result<Self> {
        let mut unknown = Unknown::default();
        let understood = serde_json::to_value(&record)?;
        unknown.top = missing_in(&understood, file);
        unknown
            .top
            .retain(|(name, extra)| matches!(extra, Extra::Field(_)) || !LISTS.contains(&name.as_str()));
        for list in LISTS {
            let (Some(of_file), Some(known)) = (elements(file, list), elements(&understood, list)) else {
                continue;
            };
            for (of_file, known) in of_file.iter().zip(known) {
                let fields = missing_in(known, of_file);
                if let (Some(id), false) = (known.get("id").and_then(Value::as_u64), fields.is_empty()) {
                    unknown.elements.insert((list, id), fields);
                }
            }
        }
        Ok(Self { record, unknown })
    }
}

fn elements<'a>(value: &'a Value, list: &str) -> Option<&'a Vec<Value>> {
    value.get(list).and_then(Value::as_array)
}

/// What only the second says. Lists that are not of the same length say nothing that could be placed.
fn missing_in(known: &Value, file: &Value) -> Fields {
    let field = |(name, value): (&str, &Value), known: Option<&Value>| {
        let extra = match known {
            None => Extra::Field(value.clone()),
            Some(known) => match missing_in(known, value) {
                inside if inside.is_empty() => return None,
                inside => Extra::Inside(inside),
            },
        };
        Some((name.to_owned(), extra))
    };
    match (known, file) {
        (Value::Object(known), Value::Object(file)) => {
            file.iter().filter_map(|(name, value)| field((name, value), known.get(name))).collect()
        }
        (Value::Array(known), Value::Array(file)) if known.len() == file.len() => {
            let places = known.iter().zip(file).enumerate();
            places.filter_map(|(at, (known, value))| field((&at.to_string(), value), Some(known))).collect()
        }
        _ => Fields::new(),
    }
}

/// Adds fields to what stands in a file, where they are not there.
fn lay_over(value: &mut Value, fields: &Fields) {
    for (name, extra) in fields {
        match (extra, &mut *value) {
            (Extra::Field(field), Value::Object(map)) => {
                map.entry(name.as_str()).or_insert_with(|| field.clone());
            }
            (Extra::Inside(fields), Value::Object(map)) => {
                map.get_mut(name).into_iter().for_each(|inside| lay_over(inside, fields));
            }
            (Extra::Inside(fields), Value::Array(list)) => {
                let inside = name.parse::<usize>().ok().and_then(|at| list.get_mut(at));
                inside.into_iter().for_each(|inside| lay_over(inside, fields));
            }
            _ => {}
        }
    }
}

impl Unknown {
    fn is_empty(&self) -> bool {
        self.top.is_empty() && self.elements.is_empty()
    }

    /// Takes over what belongs to elements that have another id now; what `id` does not name is left out.
    pub fn copy_elements(&mut self, from: &Self, id: impl Fn(u64) -> Option<u64>) {
        let copies = from.elements.iter();
        let copies = copies.filter_map(|((list, old), fields)| Some(((*list, id(*old)?), fields.clone())));
        self.elements.extend(copies);
    }

    fn lay_over(&self, project: &mut Value) {
        lay_over(project, &self.top);
        for list in LISTS {
            let elements = project.get_mut(list).and_then(Value::as_array_mut);
            for element in elements.into_iter().flatten() {
                let id = element.get("id").and_then(Value::as_u64).unwrap_or_default();
                if let Some(fields) = self.elements.get(&(list, id)) {
                    lay_over(element, fields);
                }
            }
        }
    }
}

impl Serialize for ProjectFile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::Error;
        if self.unknown.is_empty() {
            return self.record.serialize(serializer);
        }
        // By way of text, so that single precision keeps its short form.
        let text = serde_json::to_string(&self.record).map_err(S::Error::custom)?;
        let mut value: Value = serde_json::from_str(&text).map_err(S::Error::custom)?;
        self.unknown.lay_over(&mut value);
        value.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ProjectFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let value = Value::deserialize(deserializer)?;
        let record = ProjectRecord::deserialize(&value).map_err(D::Error::custom)?;
        Self::new(record, &value).map_err(D::Error::custom)
    }
}
