//! The lines of an OBJ file, checked and put in order before tobj reads them: tobj's errors name no line, and it takes
//! polylines for faces and files for broken whose corners or colours are uneven.
//! In: the text. Out: the text in the form that tobj reads without doubt, or the first bad line and what is wrong with it.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt::Write;

use crate::import::short;

/// What tobj is given, and what the lines tell besides.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Tidy {
    /// No remarks, no lines that are cut in two, absolute indices. Where any corner has texture coordinates (a normal),
    /// all have: the others name the first entry of the list, which is zero.
    pub text: String,
    /// A smoothing group is switched on somewhere.
    pub smooth: bool,
    /// Names after `usemtl`.
    pub materials: BTreeSet<String>,
    /// Faces with fewer than three corners.
    pub short_faces: usize,
    /// Points, lines, curves and surfaces.
    pub other_elements: usize,
    /// Calls of other files and of programs.
    pub calls: usize,
}

/// A line number, from 1, and what is wrong there.
pub(super) type LineFault = (usize, String);

/// The text of a file, without a byte order mark; line ends of old Macs become those of today. What is not UTF-8 is taken for
/// Latin-1, in which every byte is a letter, so that two names stay two.
pub(super) fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().copied().map(char::from).collect()),
    };
    if text.contains('\n') { text } else { Cow::Owned(text.replace('\r', "\n")) }
}

/// The first line with a position that is not finite in single precision.
pub(super) fn not_finite(text: &str) -> Option<usize> {
    let is_finite = |word: &str| word.parse().is_ok_and(f32::is_finite);
    let found = logical_lines(text).find(|(_, line)| {
        let mut words = words(line);
        words.next() == Some("v") && !words.all(is_finite)
    });
    found.map(|(number, _)| number)
}

/// Checks and rewrites the lines.
pub(super) fn tidy(text: &str) -> Result<Tidy, LineFault> {
    let mut writer = Writer { uses: uses(text), ..Writer::default() };
    // Zeros that stand in where a corner names none.
    if writer.uses.tex_coords {
        writer.tidy.text.push_str("vt 0 0\n");
    }
    if writer.uses.normals {
        writer.tidy.text.push_str("vn 0 0 0\n");
    }
    for (number, line) in logical_lines(text) {
        writer.line(&line).map_err(|reason| (number, reason))?;
    }
    Ok(writer.tidy)
}

/// Lines with their numbers; one that ends in a backslash goes on in the next.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = (1..).zip(text.lines());
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let Some(start) = first.strip_suffix('\\') else {
            return Some((number, Cow::Borrowed(first)));
        };
        let mut whole = start.to_owned();
        for (_, next) in lines.by_ref() {
            whole.push(' ');
            match next.strip_suffix('\\') {
                Some(part) => whole.push_str(part),
                None => {
                    whole.push_str(next);
                    break;
                }
            }
        }
        Some((number, Cow::Owned(whole)))
    })
}

/// What occurs anywhere in the file.
#[derive(Clone, Copy, Default)]
struct Uses {
    tex_coords: bool,
    normals: bool,
    colors: bool,
    objects: bool,
}

fn uses(text: &str) -> Uses {
    let mut uses = Uses::default();
    for (_, line) in logical_lines(text) {
        let mut words = words(&line);
        match words.next() {
            Some("o") => uses.objects = true,
            Some("v") => uses.colors |= words.count() >= 6,
            Some("f") => {
                for corner in words {
                    let mut parts = corner.split('/').skip(1);
                    uses.tex_coords |= parts.next().is_some_and(|part| !part.is_empty());
                    uses.normals |= parts.next().is_some_and(|part| !part.is_empty());
                }
            }
            _ => {}
        }
    }
    uses
}

/// The words before a remark.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace().take_while(|word| !word.starts_with('#'))
}

#[derive(Default)]
struct Writer {
    tidy: Tidy,
    uses: Uses,
    positions: usize,
    tex_coords: usize,
    normals: usize,
    object: Option<String>,
}

impl Writer {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let mut words = words(line);
        match words.next() {
            Some("v") => self.position(words)?,
            Some("vt") => {
                let given = numbers(words, 1)?;
                self.tex_coords += 1;
                self.put("vt", &[given.first().unwrap_or(&"0"), given.get(1).unwrap_or(&"0")]);
            }
            Some("vn") => {
                let given = numbers(words, 3)?;
                self.normals += 1;
                self.put("vn", given.get(..3).unwrap_or_default());
            }
            Some("f") => self.face(words)?,
            Some("s") => self.tidy.smooth |= !matches!(words.next(), None | Some("off" | "0")),
            Some("o") => {
                self.put("o", &[rest(line)]);
                self.object = Some(rest(line).to_owned());
            }
            Some("g") => match &self.object {
                // A group inside an object is a primitive of its mesh: a new run under the same name.
                Some(object) if self.uses.objects => {
                    let object = object.clone();
                    self.put("o", &[&object]);
                }
                _ => self.put("g", &[rest(line)]),
            },
            Some("usemtl") if !rest(line).is_empty() => {
                self.put("usemtl", &[rest(line)]);
                self.tidy.materials.insert(rest(line).to_owned());
            }
            Some("mtllib") => self.put("mtllib", &[rest(line)]),
            Some("p" | "l" | "curv" | "curv2" | "surf") => self.tidy.other_elements += 1,
            Some("call" | "csh") => self.tidy.calls += 1,
            _ => {}
        }
        Ok(())
    }

    fn put(&mut self, key: &str, words: &[&str]) {
        self.tidy.text.push_str(key);
        for word in words {
            self.tidy.text.push(' ');
            self.tidy.text.push_str(word);
        }
        self.tidy.text.push('\n');
    }

    /// `x y z`, `x y z w` or `x y z r g b`.
    fn position<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let given = numbers(words, 3)?;
        self.positions += 1;
        match &given[..] {
            [.., w] if given.len() == 4 && w.parse() == Ok(0.0_f32) => {
                return Err("its weight, the fourth number, is 0".to_owned());
            }
            [x, y, z, _] if self.uses.colors => self.put("v", &[x, y, z, "1", "1", "1"]),
            [x, y, z] if self.uses.colors => self.put("v", &[x, y, z, "1", "1", "1"]),
            [_, _, _] | [_, _, _, _] => self.put("v", &given),
            [_, _, _, _, _] => {
                return Err("five numbers are neither a position nor one with a colour".to_owned());
            }
            _ => self.put("v", given.get(..6).unwrap_or_default()),
        }
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let corners: Vec<[Option<usize>; 3]> =
            words.map(|corner| self.corner(corner)).collect::<Result<_, _>>()?;
        if corners.len() < 3 {
            self.tidy.short_faces += 1;
            return Ok(());
        }
        self.tidy.text.push('f');
        for [position, tex_coord, normal] in corners {
            // From 1; the lists that begin with a zero count from there.
            let _ = write!(self.tidy.text, " {}", position.unwrap_or(0) + 1);
            if self.uses.tex_coords || self.uses.normals {
                self.tidy.text.push('/');
            }
            if self.uses.tex_coords {
                let _ = write!(self.tidy.text, "{}", tex_coord.map_or(1, |index| index + 2));
            }
            if self.uses.normals {
                let _ = write!(self.tidy.text, "/{}", normal.map_or(1, |index| index + 2));
            }
        }
        self.tidy.text.push('\n');
        Ok(())
    }

    /// Indices from 0 of position, texture coordinates and normal.
    fn corner(&self, corner: &str) -> Result<[Option<usize>; 3], String> {
        let lists = [
            (self.positions, "vertices"),
            (self.tex_coords, "texture coordinates"),
            (self.normals, "normals"),
        ];
        let mut indices = [None; 3];
        let mut parts = corner.split('/');
        for (place, ((count, what), part)) in lists.into_iter().zip(parts.by_ref()).enumerate() {
            if part.is_empty() && place > 0 {
                continue;
            }
            let number: i64 =
                part.parse().map_err(|_| format!("\"{}\" is no corner of a face", short(corner)))?;
            let from_start =
                if number < 0 { (count as i64).saturating_add(number) } else { number.saturating_sub(1) };
            if !(0..count as i64).contains(&from_start) {
                return Err(format!("index {number} is out of range, there are {count} {what} so far"));
            }
            if let Some(index) = indices.get_mut(place) {
                *index = Some(from_start as usize);
            }
        }
        match parts.next() {
            Some(_) => Err(format!("\"{}\" is no corner of a face", short(corner))),
            None => Ok(indices),
        }
    }
}

/// What follows the first word.
fn rest(line: &str) -> &str {
    line.trim().split_once(char::is_whitespace).unwrap_or_default().1.trim()
}

fn numbers<'a>(words: impl Iterator<Item = &'a str>, least: usize) -> Result<Vec<&'a str>, String> {
    let words: Vec<&str> = words.collect();
    if let Some(bad) = words.iter().find(|word| word.parse::<f32>().is_err()) {
        return Err(format!("\"{}\" is not a number", short(bad)));
    }
    match words.len() < least {
        true => Err(format!("expected {least} numbers, found {}", words.len())),
        false => Ok(words),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_the_line() {
        let good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf -3//  -2 -1 # back\n";
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3\n";
        assert_eq!(tidy(good), Ok(Tidy { text: text.to_owned(), ..Tidy::default() }));
        assert!(tidy("s 1\n").is_ok_and(|tidy| tidy.smooth));
        let line = |text| tidy(text).err().map(|(line, _)| line);
        assert_eq!(line("v 0 0 0\nf 1 2 3"), Some(2));
        assert_eq!(line("v 0 0 x"), Some(1));
        assert_eq!(line("\nv 0 0"), Some(2));
        assert_eq!(line("v 0 0 0\nf 1 0 1"), Some(2));
        assert_eq!(line("v 0 0 0\nvt 0 0\nf 1/1//1 1 1"), Some(3));
        assert_eq!(line("v 0 0 \\\n0\nv 1 1 1 0"), Some(3));
        assert_eq!(line("v 0 0 0 1 1"), Some(1));
    }

    #[test]
    fn marks_and_letters_of_other_systems_are_read() {
        assert_eq!(text_of("\u{feff}v 0 0 0\n".as_bytes()), "v 0 0 0\n");
        assert_eq!(text_of(b"usemtl \xe4\r\n"), "usemtl \u{e4}\r\n");
        assert_eq!(text_of(b"v 0 0 0\rv 1 0 0"), "v 0 0 0\nv 1 0 0");
        assert_eq!(text_of("usemtl \u{e4}\n".as_bytes()), "usemtl \u{e4}\n");
    }

    #[test]
    fn corners_and_colours_are_made_even() {
        let text = "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 1\nvt .5\nf 1/1 2 3\nl 1 2 3\nf 1 2\ng\ncall a.obj\n";
        let expected = "vt 0 0\nv 0 0 0 1 0 0\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nvt .5 0\nf 1/2 2/1 3/1\ng \n";
        let tidy = tidy(text).unwrap_or_default();
        let left_out = (tidy.short_faces, tidy.other_elements, tidy.calls);
        assert_eq!((tidy.text.as_str(), left_out), (expected, (1, 1, 1)));
    }
}
