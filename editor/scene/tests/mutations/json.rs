//! Damage to JSON: values of other kinds and sizes, keys that go or come twice, nesting without end.
//! In: the bytes of a document. Out: those of another, which is JSON more often than not.

use serde_json::{Map, Value, json};

use crate::numbers::Numbers;

/// Deeper than any reader should follow.
const DEPTHS: [usize; 4] = [30, 127, 1000, 20_000];
/// Numbers that counts and offsets overflow with, and no f32 holds.
const NUMBERS: [&str; 20] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "7",
    "255",
    "65535",
    "65536",
    "16777217",
    "2147483647",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551615",
    "-9223372036854775808",
    "0.5",
    "1e39",
    "-1e308",
    "1e-320",
];

/// Changes a value, a key or the text; the word says which.
pub fn damage(bytes: &[u8], numbers: &mut Numbers) -> (Vec<u8>, &'static str) {
    let Ok(mut root) = serde_json::from_slice::<Value>(bytes) else {
        return (bytes.to_vec(), "nothing");
    };
    let kind = match numbers.below(10) {
        0 => {
            remove(&mut root, numbers);
            "key removed"
        }
        1 => {
            rename(&mut root, numbers);
            "key renamed"
        }
        2 => {
            repeat(&mut root, numbers);
            "array repeated"
        }
        3 => return (twice(&root, numbers), "key twice"),
        4 => return (nested(&root, numbers), "nested deeply"),
        5 => {
            let copy = place(&mut root, numbers).clone();
            *place(&mut root, numbers) = copy;
            "value from elsewhere"
        }
        6 => {
            *place(&mut root, numbers) = other_kind(numbers);
            "value of another kind"
        }
        _ => {
            *number(&mut root, numbers) =
                serde_json::from_str(NUMBERS[numbers.below(NUMBERS.len())]).unwrap();
            "number"
        }
    };
    (serde_json::to_vec(&root).unwrap(), kind)
}

fn other_kind(numbers: &mut Numbers) -> Value {
    let values = [
        Value::Null,
        json!(true),
        json!({}),
        json!([]),
        json!("NaN"),
        json!("../../../etc/passwd"),
        json!("data:;base64,AAAA"),
        json!("http://host/a.bin"),
        json!("\u{0}"),
        json!("a".repeat(10_000)),
        json!([0, 0, 0, 0]),
        json!(-1.5),
        json!({ "index": 0 }),
    ];
    numbers.pick(&values).clone()
}

/// A value anywhere, deeper ones more often than the few at the top.
fn place<'a>(root: &'a mut Value, numbers: &mut Numbers) -> &'a mut Value {
    let mut at = root;
    for _ in 0..16 {
        let count = match &*at {
            Value::Array(list) => list.len(),
            Value::Object(map) => map.len(),
            _ => 0,
        };
        if count == 0 || numbers.one_in(6) {
            break;
        }
        let index = numbers.below(count);
        at = match at {
            Value::Array(list) => &mut list[index],
            Value::Object(map) => map.values_mut().nth(index).unwrap(),
            _ => break,
        };
    }
    at
}

/// A number anywhere, or what is found after some tries.
fn number<'a>(root: &'a mut Value, numbers: &mut Numbers) -> &'a mut Value {
    let mut seed = numbers.next();
    for _ in 0..20 {
        if place(root, &mut Numbers::new(seed)).is_number() {
            break;
        }
        seed = numbers.next();
    }
    place(root, &mut Numbers::new(seed))
}

/// An object anywhere that is not empty, or the root.
fn object<'a>(root: &'a mut Value, numbers: &mut Numbers) -> Option<&'a mut Map<String, Value>> {
    let mut seed = numbers.next();
    for _ in 0..20 {
        if place(root, &mut Numbers::new(seed)).as_object().is_some_and(|map| !map.is_empty()) {
            break;
        }
        seed = numbers.next();
    }
    place(root, &mut Numbers::new(seed)).as_object_mut().filter(|map| !map.is_empty())
}

fn remove(root: &mut Value, numbers: &mut Numbers) {
    if let Some(map) = object(root, numbers) {
        let key = map.keys().nth(numbers.below(map.len())).unwrap().clone();
        map.shift_remove(&key);
    }
}

fn rename(root: &mut Value, numbers: &mut Numbers) {
    const NAMES: [&str; 8] =
        ["extensions", "extras", "bufferView", "sparse", "matrix", "uri", "targets", "~1/"];
    if let Some(map) = object(root, numbers) {
        let key = map.keys().nth(numbers.below(map.len())).unwrap().clone();
        let value = map.shift_remove(&key).unwrap();
        map.insert((*numbers.pick(&NAMES)).to_owned(), value);
    }
}

/// An array with its elements many times over, or cut short.
fn repeat(root: &mut Value, numbers: &mut Numbers) {
    for _ in 0..20 {
        if let Value::Array(list) = place(root, numbers) {
            let copy = list.clone();
            match numbers.below(3) {
                0 => list.truncate(numbers.below(copy.len().max(1))),
                1 => list.extend(copy),
                _ => (0..100).for_each(|_| list.extend(copy.iter().cloned())),
            }
            return;
        }
    }
}

/// One key of an object a second time, with another value, before or behind the first.
fn twice(root: &Value, numbers: &mut Numbers) -> Vec<u8> {
    let text = serde_json::to_string(root).unwrap();
    let keys: Vec<&str> = text.split('"').skip(1).step_by(2).collect();
    if keys.is_empty() || !text.contains('{') {
        return text.into_bytes();
    }
    let key = numbers.pick(&keys);
    let opened: Vec<usize> = text.match_indices('{').map(|(at, _)| at + 1).collect();
    let at = *numbers.pick(&opened);
    let value = other_kind(numbers);
    format!("{}\"{key}\":{value},{}", &text[..at], &text[at..]).into_bytes()
}

fn nested(root: &Value, numbers: &mut Numbers) -> Vec<u8> {
    let mark = "\u{1F4A3}";
    let mut root = root.clone();
    *place(&mut root, numbers) = json!(mark);
    let depth = *numbers.pick(&DEPTHS);
    let (open, close) = *numbers.pick(&[("[", "]"), ("{\"extras\":", "}"), ("{\"children\":[", "]}")]);
    // A quarter is never closed.
    let closing = if numbers.one_in(4) { String::new() } else { close.repeat(depth) };
    let deep = format!("{}0{closing}", open.repeat(depth));
    serde_json::to_string(&root).unwrap().replace(&format!("\"{mark}\""), &deep).into_bytes()
}
