//! JSON that is nested deeper than a reader should follow, as `extras` of other programs may be. In: bytes. Out: a value
//! in which what is too deep is a text of its own, and the text of such a value as it was. Nothing here recurses.

use serde::de::IgnoredAny;
use serde_json::Value;

/// How deep values are read; serde_json ends at 128.
const MAX_DEPTH: usize = 100;
/// What a text begins with that stands for a value.
const MARK: &str = "\u{0}deep JSON\u{0}";
/// The same in JSON, with its quotation mark.
const WRITTEN_MARK: &str = "\"\\u0000deep JSON\\u0000";

/// Reads JSON of any depth.
///
/// # Errors
/// When it is not valid, with line and column in these bytes.
pub(crate) fn parse(bytes: &[u8]) -> serde_json::Result<Value> {
    let error = match serde_json::from_slice(bytes) {
        Ok(value) => return Ok(value),
        Err(error) => error,
    };
    // What is skipped may be of any depth.
    serde_json::from_slice::<IgnoredAny>(bytes)?;
    let text = std::str::from_utf8(bytes).map_err(|_| error)?;
    serde_json::from_str(&shallow(text))
}

/// Valid JSON with a text in the place of each value that is too deep.
fn shallow(text: &str) -> String {
    let mut out = String::new();
    let (mut depth, mut done, mut within) = (0, 0, false);
    let mut bytes = text.bytes().enumerate();
    while let Some((at, byte)) = bytes.next() {
        match byte {
            b'"' => within = !within,
            b'\\' if within => drop(bytes.next()),
            b'[' | b'{' if !within => {
                depth += 1;
                if depth == MAX_DEPTH {
                    out.push_str(text.get(done..at).unwrap_or_default());
                    done = at;
                }
            }
            b']' | b'}' if !within => {
                if depth == MAX_DEPTH {
                    let deep = text.get(done..=at).unwrap_or_default();
                    out.push_str(&Value::from(format!("{MARK}{deep}")).to_string());
                    done = at + 1;
                }
                depth -= 1;
            }
            _ => {}
        }
    }
    out + text.get(done..).unwrap_or_default()
}

/// JSON as it is written, with the values that texts stand for in their place.
pub(crate) fn written(text: String) -> String {
    let mut out = String::new();
    let mut rest = text.as_str();
    while let Some((before, mark)) = rest.find(WRITTEN_MARK).map(|at| rest.split_at(at)) {
        let mut texts = serde_json::Deserializer::from_str(mark).into_iter::<String>();
        let read = texts.next().and_then(Result::ok).unwrap_or_default();
        let (whole, after) = mark.split_at(texts.byte_offset().clamp(1, mark.len()));
        // Within a text a quotation mark follows a backslash.
        let deep = read.strip_prefix(MARK).filter(|_| !before.ends_with('\\'));
        let deep = deep.filter(|deep| serde_json::from_str::<IgnoredAny>(deep).is_ok());
        out.push_str(before);
        out.push_str(deep.unwrap_or(whole));
        rest = after;
    }
    if out.is_empty() { text } else { out + rest }
}

/// What a value takes in memory beside itself, bytes: lists and objects are made with room for more.
pub(crate) fn heap_bytes(value: &Value) -> usize {
    // What an allocator gives at least.
    const LEAST_BLOCK: usize = 32;
    match value {
        Value::Null | Value::Bool(_) | Value::Number(_) => 0,
        Value::String(text) => text.capacity(),
        Value::Array(list) => {
            list.capacity() * size_of::<Value>() + list.iter().map(heap_bytes).sum::<usize>()
        }
        Value::Object(members) if members.is_empty() => 0,
        Value::Object(members) => {
            let places = (members.len() + 1).next_power_of_two().max(4);
            let each = members.iter().map(|(key, inner)| key.capacity().max(LEAST_BLOCK) + heap_bytes(inner));
            places * 7 / 8 * (size_of::<(String, Value)>() + 2 * size_of::<usize>()) + each.sum::<usize>()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nested(depth: usize) -> String {
        let inner = r#"{"a\"]":"x \\"}"#;
        format!(r#"{{"extras":{}{inner}{},"b":[1]}}"#, "[".repeat(depth), "]".repeat(depth))
    }

    #[test]
    fn values_of_any_depth_come_back_as_they_were() {
        for depth in [1, 97, 98, 99, 130, 100_000] {
            let text = nested(depth);
            let value = parse(text.as_bytes()).unwrap_or_default();
            assert_eq!(value["b"][0], 1, "depth {depth}");
            assert_eq!(written(value.to_string()), text, "depth {depth}");
        }
    }

    #[test]
    fn what_is_not_json_is_refused_at_any_depth() {
        let text = nested(200).replace("\"x", "x");
        assert!(parse(text.as_bytes()).is_err_and(|error| error.column() > 200));
    }

    #[test]
    fn a_text_that_only_looks_like_a_deep_value_stays_a_text() {
        for begin in [MARK, "\"\u{0}deep JSON\u{0}[]\""] {
            let text = Value::from(format!("{begin}[")).to_string();
            assert_eq!(written(text.clone()), text);
        }
    }
}
