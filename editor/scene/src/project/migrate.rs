//! Old project files to new ones: one function a version, from JSON to JSON. A file of any age passes all that are later.
//! Each is written once and stays as it is, whatever becomes of the records; the files in `tests/projects` hold it to that.

use serde_json::Value;

use super::SCHEMA_VERSION;

/// The step from version `n + 1` stands at `n`.
const MIGRATIONS: [fn(Value) -> Value; SCHEMA_VERSION as usize - 1] = [from_1_to_2];

/// Brings what a file of version `found` says to [`SCHEMA_VERSION`].
pub(super) fn to_newest(found: u64, value: Value) -> Value {
    let done = usize::try_from(found.saturating_sub(1)).unwrap_or(usize::MAX);
    MIGRATIONS.iter().skip(done).fold(value, |value, migrate| migrate(value))
}

/// 2 added spheres and boxes in `shapes`. A field of that name in an older file was none of ours: it is kept under another.
fn from_1_to_2(mut value: Value) -> Value {
    if let Value::Object(map) = &mut value {
        map.insert("caustica".to_owned(), 2.into());
        if let Some(foreign) = map.remove("shapes") {
            let longer = |name: &String| Some(format!("{name}_"));
            let mut names = std::iter::successors(Some("shapesOfVersion1".to_owned()), longer);
            let free = names.find(|name| !map.contains_key(name)).unwrap_or_default();
            map.insert(free, foreign);
        }
    }
    value
}
