//! A place in a JSON document, read with checks: every value is asked for by type and an answer that does
//! not fit is a [`Fault`] with the JSON pointer of the place. Knows JSON, not glTF.

use std::ops::RangeInclusive;

use serde_json::{Map, Value};

/// What is wrong at which place of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    /// JSON pointer.
    pub place: String,
    /// In words.
    pub reason: String,
}

impl Fault {
    pub fn new(place: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { place: place.into(), reason: reason.into() }
    }
}

/// A value with its JSON pointer.
#[derive(Clone, Debug)]
pub(super) struct Item<'a> {
    value: &'a Value,
    place: String,
}

impl<'a> Item<'a> {
    pub fn root(value: &'a Value) -> Self {
        Self { value, place: String::new() }
    }

    pub fn place(&self) -> &str {
        &self.place
    }

    pub fn fault(&self, reason: impl Into<String>) -> Fault {
        Fault::new(self.place.clone(), reason)
    }

    fn fault_at(&self, key: &str, reason: impl Into<String>) -> Fault {
        Fault::new(format!("{}/{key}", self.place), reason)
    }

    /// The value as it stands in the file.
    pub fn value(&self) -> &'a Value {
        self.value
    }

    /// The members of this object.
    pub fn object(&self) -> Result<&'a Map<String, Value>, Fault> {
        self.value
            .as_object()
            .ok_or_else(|| self.fault(format!("expected an object, found {}", kind(self.value))))
    }

    /// A member; `None` when it is absent.
    pub fn get(&self, key: &str) -> Option<Item<'a>> {
        let value = self.value.as_object()?.get(key)?;
        Some(Item { value, place: format!("{}/{}", self.place, key.replace('~', "~0").replace('/', "~1")) })
    }

    /// A member as it stands in the file; `None` when it is absent.
    pub fn raw(&self, key: &str) -> Option<&'a Value> {
        self.value.as_object()?.get(key)
    }

    /// A member that has to be an object, if it is there.
    pub fn child(&self, key: &str) -> Result<Option<Item<'a>>, Fault> {
        let child = self.get(key);
        if let Some(child) = &child {
            child.object()?;
        }
        Ok(child)
    }

    /// The extension of this name on this object.
    pub fn extension(&self, name: &str) -> Result<Option<Item<'a>>, Fault> {
        match self.child("extensions")? {
            Some(extensions) => extensions.child(name),
            None => Ok(None),
        }
    }

    /// The elements of an array member; none when it is absent.
    pub fn items(&self, key: &str) -> Result<Vec<Item<'a>>, Fault> {
        match self.get(key) {
            Some(array) => array.elements(),
            None => Ok(Vec::new()),
        }
    }

    /// The elements of an array member, each of them an object.
    pub fn objects(&self, key: &str) -> Result<Vec<Item<'a>>, Fault> {
        let items = self.items(key)?;
        for item in &items {
            item.object()?;
        }
        Ok(items)
    }

    /// The elements of this array.
    pub fn elements(&self) -> Result<Vec<Item<'a>>, Fault> {
        let array = self
            .value
            .as_array()
            .ok_or_else(|| self.fault(format!("expected an array, found {}", kind(self.value))))?;
        let element = |(i, value)| Item { value, place: format!("{}/{i}", self.place) };
        Ok(array.iter().enumerate().map(element).collect())
    }

    /// A number in double precision.
    pub fn f64(&self, key: &str) -> Result<Option<f64>, Fault> {
        let Some(value) = self.value.get(key) else {
            return Ok(None);
        };
        match value.as_f64() {
            Some(number) => Ok(Some(number)),
            None => Err(self.fault_at(key, format!("expected a number, found {}", kind(value)))),
        }
    }

    /// A number that single precision can hold, or a default.
    pub fn f32_or(&self, key: &str, default: f32) -> Result<f32, Fault> {
        match self.f64(key)? {
            Some(number) => self.narrow(key, number),
            None => Ok(default),
        }
    }

    /// A fixed count of numbers in double precision.
    pub fn f64s<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, Fault> {
        let Some(value) = self.value.get(key) else {
            return Ok(None);
        };
        let numbers: Option<Vec<f64>> =
            value.as_array().and_then(|array| array.iter().map(Value::as_f64).collect());
        match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(self.fault_at(key, format!("expected an array of {N} numbers"))),
        }
    }

    /// A fixed count of numbers in single precision, or a default.
    pub fn f32s_or<const N: usize>(&self, key: &str, default: [f32; N]) -> Result<[f32; N], Fault> {
        let Some(numbers) = self.f64s::<N>(key)? else {
            return Ok(default);
        };
        let mut narrow = default;
        for (to, from) in narrow.iter_mut().zip(numbers) {
            *to = self.narrow(key, from)?;
        }
        Ok(narrow)
    }

    fn narrow(&self, key: &str, number: f64) -> Result<f32, Fault> {
        let narrow = number as f32;
        match narrow.is_finite() {
            true => Ok(narrow),
            false => Err(self.fault_at(key, format!("{number} is too large"))),
        }
    }

    /// A whole number that is not negative.
    pub fn size(&self, key: &str) -> Result<Option<usize>, Fault> {
        match self.get(key) {
            Some(item) => item.as_size().map(Some),
            None => Ok(None),
        }
    }

    /// A whole number that has to be there.
    pub fn required_size(&self, key: &str) -> Result<usize, Fault> {
        self.size(key)?.ok_or_else(|| self.fault(format!("\"{key}\" is missing")))
    }

    /// This value as a whole number that is not negative.
    pub fn as_size(&self) -> Result<usize, Fault> {
        // 1.0 is a whole number in JSON too.
        let whole = self.value.as_u64().or_else(|| {
            let number = self.value.as_f64()?;
            let whole = number >= 0.0 && number.fract() == 0.0 && number < 9e15;
            whole.then_some(number as u64)
        });
        whole.and_then(|number| usize::try_from(number).ok()).ok_or_else(|| {
            self.fault(format!("expected a whole number that is not negative, found {}", kind(self.value)))
        })
    }

    /// A member that is an index into a list of `count` things called `what`.
    pub fn index(&self, key: &str, count: usize, what: &str) -> Result<Option<usize>, Fault> {
        match self.get(key) {
            Some(item) => item.as_index(count, what).map(Some),
            None => Ok(None),
        }
    }

    /// An index that has to be there.
    pub fn required_index(&self, key: &str, count: usize, what: &str) -> Result<usize, Fault> {
        self.index(key, count, what)?.ok_or_else(|| self.fault(format!("\"{key}\" is missing")))
    }

    /// This value as an index into a list of `count` things called `what`.
    pub fn as_index(&self, count: usize, what: &str) -> Result<usize, Fault> {
        let index = self.as_size()?;
        match index < count {
            true => Ok(index),
            false => Err(self.fault(format!("there is no {what} {index}, the file has {count}"))),
        }
    }

    /// Indices in an array member, each below `count`; none when it is absent.
    pub fn indices(&self, key: &str, count: usize, what: &str) -> Result<Vec<usize>, Fault> {
        self.items(key)?.iter().map(|item| item.as_index(count, what)).collect()
    }

    /// A text.
    pub fn text(&self, key: &str) -> Result<Option<&'a str>, Fault> {
        let Some(value) = self.value.get(key) else {
            return Ok(None);
        };
        match value.as_str() {
            Some(text) => Ok(Some(text)),
            None => Err(self.fault_at(key, format!("expected a text, found {}", kind(value)))),
        }
    }

    /// The name of this object; empty without one.
    pub fn name(&self) -> Result<String, Fault> {
        Ok(self.text("name")?.unwrap_or_default().to_owned())
    }

    /// True or false, or a default.
    pub fn bool_or(&self, key: &str, default: bool) -> Result<bool, Fault> {
        let Some(value) = self.value.get(key) else {
            return Ok(default);
        };
        value
            .as_bool()
            .ok_or_else(|| self.fault_at(key, format!("expected true or false, found {}", kind(value))))
    }

    /// The numbers of an array member; `None` when it is absent.
    pub fn numbers(&self, key: &str) -> Result<Option<Vec<f64>>, Fault> {
        let Some(array) = self.get(key) else {
            return Ok(None);
        };
        let number = |item: Item<'_>| {
            let number = item.value.as_f64();
            number.ok_or_else(|| item.fault(format!("expected a number, found {}", kind(item.value))))
        };
        array.elements()?.into_iter().map(number).collect::<Result<_, _>>().map(Some)
    }

    /// The texts of an array member of `extras`, where any program may put anything: what is no text is empty.
    pub fn extra_texts(&self, key: &str) -> Vec<String> {
        let array =
            self.get("extras").and_then(|extras| extras.get(key)).and_then(|array| array.value.as_array());
        array.into_iter().flatten().map(|value| value.as_str().unwrap_or_default().to_owned()).collect()
    }

    /// The texts of an array member.
    pub fn texts(&self, key: &str) -> Result<Vec<&'a str>, Fault> {
        self.items(key)?
            .iter()
            .map(|item| {
                item.value
                    .as_str()
                    .ok_or_else(|| item.fault(format!("expected a text, found {}", kind(item.value))))
            })
            .collect()
    }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "another number",
        Value::String(_) => "a text",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

/// What is not negative.
pub(super) const POSITIVE: RangeInclusive<f32> = 0.0..=f32::MAX;

/// A number within bounds; one that is not is held to them, with a warning that names the field.
pub(super) fn held(
    item: &Item<'_>,
    key: &str,
    given: f32,
    range: &RangeInclusive<f32>,
    warnings: &mut Vec<Fault>,
) -> f32 {
    let held = given.clamp(*range.start(), *range.end());
    if held != given {
        let bounds = match *range.end() {
            f32::MAX => format!("at least {}", range.start()),
            end => format!("within {} and {end}", range.start()),
        };
        let reason = format!("{given} has to be {bounds}; {held} is taken");
        warnings.push(Fault::new(format!("{}/{key}", item.place()), reason));
    }
    held
}
