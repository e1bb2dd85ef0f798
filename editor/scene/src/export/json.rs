//! Small helpers for JSON objects in the making: numbers with as few digits as bring them back, members that are left
//! out where they say what is read without them, lists without doubles, and the extensions in use.

use std::collections::{BTreeSet, HashMap};

use serde_json::{Map, Value};

/// A JSON object; members keep the order in which they are put.
pub(super) type Object = Map<String, Value>;

/// The shortest number that is read back as the same single-precision number. What is too large is the largest: JSON has no
/// word for more, and `null` is no number.
pub(super) fn number(value: f32) -> Value {
    let value = value.clamp(f32::MIN, f32::MAX);
    let short = value.to_string().parse::<f64>().ok().filter(|&short| short as f32 == value);
    Value::from(short.unwrap_or_else(|| f64::from(value)))
}

/// A number of double precision, likewise.
pub(super) fn wide(value: f64) -> Value {
    Value::from(value.clamp(f64::MIN, f64::MAX))
}

/// An array of single-precision numbers.
pub(super) fn numbers(values: &[f32]) -> Value {
    values.iter().copied().map(number).collect()
}

/// Putting members.
pub(super) trait Put {
    /// Sets a member.
    fn put(&mut self, key: &str, value: impl Into<Value>);

    /// Sets a number unless it is what is read where it is absent.
    fn put_number(&mut self, key: &str, value: f32, absent: f32);

    /// Sets an array of numbers likewise.
    fn put_numbers<const N: usize>(&mut self, key: &str, values: impl Into<[f32; N]>, absent: [f32; N]);

    /// Sets an object or array unless it is empty.
    fn put_filled(&mut self, key: &str, value: impl Into<Value>);

    /// Sets a text unless it is empty.
    fn put_text(&mut self, key: &str, text: &str);
}

impl Put for Object {
    fn put(&mut self, key: &str, value: impl Into<Value>) {
        self.insert(key.to_owned(), value.into());
    }

    fn put_number(&mut self, key: &str, value: f32, absent: f32) {
        if value != absent {
            self.put(key, number(value));
        }
    }

    fn put_numbers<const N: usize>(&mut self, key: &str, values: impl Into<[f32; N]>, absent: [f32; N]) {
        let values = values.into();
        if values != absent {
            self.put(key, numbers(&values));
        }
    }

    fn put_filled(&mut self, key: &str, value: impl Into<Value>) {
        let value = value.into();
        let is_empty = match &value {
            Value::Array(list) => list.is_empty(),
            Value::Object(members) => members.is_empty(),
            _ => false,
        };
        if !is_empty {
            self.put(key, value);
        }
    }

    fn put_text(&mut self, key: &str, text: &str) {
        if !text.is_empty() {
            self.put(key, text);
        }
    }
}

/// A list in which every value stands once.
#[derive(Default)]
pub(super) struct Pool {
    list: Vec<Value>,
    places: HashMap<String, usize>,
}

impl Pool {
    /// The place of a value, which is added where it is new.
    pub fn place(&mut self, value: Object) -> usize {
        self.place_of(value, "")
    }

    /// The same of the value of somebody: values of others are not taken for it, as they may come to differ.
    pub fn place_of(&mut self, value: Object, owner: &str) -> usize {
        let value = Value::Object(value);
        let next = self.list.len();
        *self.places.entry(format!("{owner}{value}")).or_insert_with(|| {
            self.list.push(value);
            next
        })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// The values in order.
    pub fn into_list(self) -> Vec<Value> {
        self.list
    }
}

/// Names of the extensions that the file uses.
#[derive(Default)]
pub(super) struct Extensions {
    names: BTreeSet<String>,
    /// How many `extras` and unknown extensions belong to objects that are not written.
    pub homeless: usize,
}

impl Extensions {
    /// Gives an object an extension.
    pub fn put(&mut self, object: &mut Object, name: &str, value: impl Into<Value>) {
        self.note(name);
        let members = object.entry("extensions").or_insert_with(|| Value::Object(Object::new()));
        if let Some(members) = members.as_object_mut() {
            members.put(name, value);
        }
    }

    /// Notes an extension that somebody else puts.
    pub fn note(&mut self, name: &str) {
        self.names.insert(name.to_owned());
    }

    /// The names in order.
    pub fn names(&self) -> Vec<Value> {
        self.names.iter().map(|name| Value::from(name.as_str())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_come_back() {
        assert_eq!(number(0.1).to_string(), "0.1");
        assert_eq!(number(1.0).to_string(), "1.0");
        for bits in (0..u32::MAX).step_by(99_991) {
            let value = f32::from_bits(bits);
            let back = number(value).as_f64().map(|number| number as f32);
            assert!(!value.is_finite() || back.map(f32::to_bits) == Some(bits), "{value} {back:?}");
        }
        assert_eq!(number(f32::INFINITY), number(f32::MAX));
        assert_eq!(wide(f64::NEG_INFINITY), Value::from(f64::MIN));
    }
}
