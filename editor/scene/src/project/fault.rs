//! Where in a project file something is wrong, and what, in words.
//! In: the file as JSON. Out: the place as a JSON pointer with the id and the name of the element, and a reason without terms of the reader.

use serde_json::Value;
use serde_path_to_error::Segment;

use super::ProjectProblem;
use super::record::ProjectRecord;
use crate::import::short;

/// What the elements of the lists of a project are.
const KINDS: [(&str, &str); 5] = [
    ("prefabs", "prefab"),
    ("materials", "material"),
    ("shapes", "shapes"),
    ("meshes", "mesh"),
    ("nodes", "node"),
];

/// What readers of JSON call a kind of value, and its plain name.
const EXPECTED: [(&str, &str); 12] = [
    ("u8", "a whole number from 0 to 255"),
    ("u32", "a whole number from 0 to 4294967295"),
    ("u64", "a whole number from 0 to 18446744073709551615"),
    ("f32", "a number"),
    ("f64", "a number"),
    ("a boolean", "true or false"),
    ("a sequence", "a list"),
    ("a map", "an object"),
    ("path string", "a path as text"),
    ("string or map", "a name or an object"),
    ("fewer elements in array", "fewer"),
    ("fewer elements in map", "fewer"),
];

/// The place of an element of a list, such as `/nodes/12 (node 7 "Chair")`.
pub(super) fn element(list: &str, index: usize, id: u64, name: &str) -> String {
    format!("/{list}/{index}{}", of_whom(list, Some(id), Some(name)))
}

fn of_whom(list: &str, id: Option<u64>, name: Option<&str>) -> String {
    let Some((_, kind)) = KINDS.iter().find(|(known, _)| *known == list) else { return String::new() };
    let id = id.map(|id| format!(" {id}")).unwrap_or_default();
    let name =
        name.filter(|name| !name.is_empty()).map(|name| format!(" \"{}\"", short(name))).unwrap_or_default();
    format!(" ({kind}{id}{name})")
}

/// Why JSON is no project. `text`: what it was read from, before it was brought to this version; `error`: what reading it said.
pub(super) fn of_field(file: &Value, text: &[u8], error: serde_json::Error) -> ProjectProblem {
    // Of JSON serde says more than of text: there "expected value" is all. But only in text a field stands twice.
    let of_value = serde_path_to_error::deserialize::<_, ProjectRecord>(file).err();
    let mut reader = serde_json::Deserializer::from_slice(text);
    let of_text = serde_path_to_error::deserialize::<_, ProjectRecord>(&mut reader).err();
    let at = |error: &serde_json::Error| format!(" at line {} column {}", error.line(), error.column());
    let line = of_text.as_ref().map(|error| at(error.inner())).unwrap_or_default();
    let Some(found) = of_value.or(of_text) else { return error.into() };
    let place = place_of(file, found.path().iter());
    let colon = if place.is_empty() { "" } else { ": " };
    let reason = in_words(&found.inner().to_string().replace(&line, ""));
    ProjectProblem::Broken(format!("not a valid project: {place}{colon}{reason}{line}"))
}

/// As far as the path leads to something that is in the file.
fn place_of<'a>(file: &Value, path: impl Iterator<Item = &'a Segment>) -> String {
    let (mut at, mut pointer, mut keys) = (file, String::new(), Vec::new());
    for segment in path {
        let key = match segment {
            Segment::Seq { index } => index.to_string(),
            Segment::Map { key } | Segment::Enum { variant: key } => key.clone(),
            Segment::Unknown => break,
        };
        let escaped = key.replace('~', "~0").replace('/', "~1");
        let Some(inside) = at.pointer(&format!("/{escaped}")) else { break };
        at = inside;
        pointer.push('/');
        pointer.push_str(&short(&escaped));
        keys.push(key);
    }
    let element = keys.first().zip(keys.get(1)).and_then(|(list, index)| {
        let of = file.get(list)?.get(index.parse::<usize>().ok()?)?;
        let name = of.get("name").or_else(|| of.get("value")?.get("name")).and_then(Value::as_str);
        Some(of_whom(list, of.get("id").and_then(Value::as_u64), name))
    });
    pointer + &element.unwrap_or_default()
}

/// A reason of serde without the names of Rust.
fn in_words(reason: &str) -> String {
    let reason = reason.replace('`', "\"");
    let parted = |begin: &str| reason.strip_prefix(begin)?.rsplit_once(", expected ");
    let (found, expected) =
        match (parted("invalid type: ").or(parted("invalid value: ")), parted("invalid length ")) {
            (Some((found, expected)), _) => (format!("it is {}", short(found)), expected),
            (None, Some((count, expected))) => (format!("it has {count} values"), expected),
            (None, None) => return reason.replace("unknown variant", "there is no"),
        };
    let named = expected.starts_with("struct ") || expected.starts_with("internally tagged enum ");
    let plain = EXPECTED.iter().find(|(term, _)| *term == expected).map(|(_, plain)| *plain);
    let expected = plain.unwrap_or(if named { "an object" } else { expected });
    format!("{found}, expected {}", expected.replace("an array of length ", ""))
}
