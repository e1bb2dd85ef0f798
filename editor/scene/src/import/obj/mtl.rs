//! MTL libraries: their lines by material. In: the text. Out: a [`Source`] for each `newmtl`, whose values are asked for
//! by type; what is none becomes a warning with its line. Knows no meaning of a key. Read here and not by tobj, which panics on a colour
//! of two numbers and drops all materials for one bad line.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use glam::Vec3;

use super::{Warnings, short};

/// One material as it stands in the file.
#[derive(Clone, Debug)]
pub(super) struct Source {
    pub name: String,
    pub file: Rc<Path>,
    /// What follows a key, with its line; keys in small letters. The last of several lines counts.
    lines: HashMap<String, (usize, String)>,
}

/// Reads a library; `file` is named in warnings.
pub(super) fn parse(text: &str, file: &Path, warnings: &Warnings) -> Vec<Source> {
    let file: Rc<Path> = file.into();
    let mut sources: Vec<Source> = Vec::new();
    for (number, line) in (1..).zip(text.lines().map(str::trim)) {
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim().to_owned();
        match key {
            "newmtl" => sources.push(Source { name: rest, file: Rc::clone(&file), lines: HashMap::new() }),
            "" => {}
            key if key.starts_with('#') => {}
            key => match sources.last_mut() {
                Some(source) => {
                    source.lines.insert(key.to_ascii_lowercase(), (number, rest));
                }
                None => warnings.add(
                    &file,
                    format!("line {number}"),
                    format!("{} before any newmtl is left out", short(key)),
                ),
            },
        }
    }
    sources
}

impl Source {
    /// What follows one of the keys, and a warning about it.
    pub fn rest(&self, keys: &[&str]) -> Option<Rest<'_>> {
        let (number, text) = keys.iter().find_map(|&key| self.lines.get(key))?;
        Some(Rest { source: self, number: *number, text })
    }

    /// A finite number.
    pub fn number(&self, key: &str, warnings: &Warnings) -> Option<f32> {
        let rest = self.rest(&[key])?;
        // `d -halo 0.5`: the share in the middle of a surface that fades to its edges.
        let word = rest.words().find(|&word| word != "-halo").unwrap_or_default();
        let number = word.parse().ok().filter(|number: &f32| number.is_finite());
        rest.or_warn(number, "expected a number", warnings)
    }

    /// A linear colour of one or three numbers, none negative.
    pub fn color(&self, key: &str, warnings: &Warnings) -> Option<Vec3> {
        let rest = self.rest(&[key])?;
        let numbers: Option<Vec<f32>> = rest.words().map(|word| word.parse().ok()).collect();
        let color = match numbers.as_deref() {
            Some(&[grey]) => Some(Vec3::splat(grey)),
            Some(&[red, green, blue, ..]) => Some(Vec3::new(red, green, blue)),
            _ => None,
        };
        let color = color.filter(|color| color.is_finite()).map(|color| color.max(Vec3::ZERO));
        rest.or_warn(color, "expected one or three numbers", warnings)
    }
}

/// What follows a key.
#[derive(Clone, Copy)]
pub(super) struct Rest<'a> {
    source: &'a Source,
    number: usize,
    pub text: &'a str,
}

impl<'a> Rest<'a> {
    fn words(&self) -> impl Iterator<Item = &'a str> {
        self.text.split_whitespace().take_while(|word| !word.starts_with('#'))
    }

    /// Where the materials of a library look for their images first.
    pub fn folder(&self) -> PathBuf {
        self.source.file.parent().unwrap_or(Path::new("")).to_owned()
    }

    /// Adds a warning about this line.
    pub fn warn(&self, message: String, warnings: &Warnings) {
        warnings.add(&self.source.file, format!("line {}", self.number), message);
    }

    fn or_warn<T>(&self, value: Option<T>, expected: &str, warnings: &Warnings) -> Option<T> {
        if value.is_none() {
            self.warn(format!("{expected}, found \"{}\"; the line is left out", short(self.text)), warnings);
        }
        value
    }
}
