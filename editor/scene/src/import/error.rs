//! What can go wrong with a file, in words that name file, place and reason.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::alike::{self, kind_of};

/// Characters that turn the direction of what follows, so that a name reads as another.
fn turns_text(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Text that may come from a file: control characters in it, which a terminal would obey, as escapes; likewise those that
/// turn the direction of text, and those that end a line.
pub(crate) fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c.is_control() || turns_text(c) || matches!(c, '\u{2028}' | '\u{2029}') {
            true => plain.extend(c.escape_default()),
            false => plain.push(c),
        }
    }
    plain
}

/// Most characters of a name that a message shows.
const MAX_SHOWN: usize = 80;
/// How many of them are its last.
const SHOWN_AT_END: usize = 30;

/// A name or address of a file for a message: of a long one the beginning and the end.
pub(crate) fn short(text: &str) -> String {
    if text.chars().nth(MAX_SHOWN).is_none() {
        return text.to_owned();
    }
    let end: Vec<char> = text.chars().rev().take(SHOWN_AT_END).collect();
    let begin = text.chars().take(MAX_SHOWN - SHOWN_AT_END - 1);
    begin.chain(['\u{2026}']).chain(end.into_iter().rev()).collect()
}

/// A count with its word, in the singular for one.
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// What is said of files in the other encoding of Unicode.
pub(crate) const UTF16: &str = "is text in UTF-16, which is not read; save it as UTF-8";

/// Whether a text begins as UTF-16 does: with its mark, or with letters of which each has a zero beside it.
pub(crate) fn is_utf16(bytes: &[u8]) -> bool {
    let Some([a, b, c, d, e, f]) = bytes.first_chunk::<6>() else { return false };
    let is_marked = [[*a, *b], [*b, *a]].contains(&[0xff, 0xfe]);
    let (even, odd) = ([a, c, e], [b, d, f]);
    let zero = |bytes: &[&u8; 3]| bytes.iter().all(|byte| **byte == 0);
    let letters = |bytes: &[&u8; 3]| bytes.iter().all(|byte| **byte != 0);
    is_marked || (zero(&even) && letters(&odd)) || (letters(&even) && zero(&odd))
}

/// Why a file that Git LFS has not fetched is not read; `None`: it is none.
pub(crate) fn refuse_lfs_pointer(bytes: &[u8]) -> Option<&'static str> {
    let is_pointer = bytes.starts_with(b"version https://git-lfs.github.com/spec/");
    is_pointer.then_some("is a Git LFS pointer and not the file itself; run `git lfs pull`")
}

/// Why a file cannot be imported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportError {
    /// The file that was asked for.
    pub file: PathBuf,
    /// Where in it: a JSON pointer such as `/accessors/3/bufferView`, or `line 12`; may be empty.
    pub place: String,
    /// What is wrong, in words.
    pub reason: String,
}

impl ImportError {
    /// An error about a file as a whole.
    pub fn new(file: &Path, reason: impl Into<String>) -> Self {
        Self { file: file.to_owned(), place: String::new(), reason: reason.into() }
    }

    /// The same error at a place in the file.
    pub fn at(mut self, place: impl Into<String>) -> Self {
        self.place = place.into();
        self
    }
}

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        told(f, &self.file, &self.place, &self.reason)
    }
}

impl std::error::Error for ImportError {}

/// Something that was left out or repaired; the rest of the file was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file it is about.
    pub file: PathBuf,
    /// Where in it; may be empty.
    pub place: String,
    /// What was done, in words.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        told(f, &self.file, &self.place, &self.message)
    }
}

/// The first warnings of each kind, and how many more there are.
pub(crate) fn summed(warnings: Vec<Warning>) -> Vec<Warning> {
    let kind = |warning: &Warning| {
        // A JSON pointer; else a line, or a kind of thing and its name.
        let place = warning.place.split(' ').next().unwrap_or_default();
        (warning.file.clone(), kind_of(place), kind_of(&warning.message))
    };
    let more = |listed: &Warning, last: &Warning, count: usize| {
        let message = format!("and {count} more like it, the last at {}", short(&last.place));
        Warning { message, ..listed.clone() }
    };
    alike::summed(warnings, kind, more)
}

fn told(f: &mut fmt::Formatter<'_>, file: &Path, place: &str, what: &str) -> fmt::Result {
    let colon = if place.is_empty() { "" } else { ": " };
    f.write_str(&plain(&format!("{}: {place}{colon}{what}", file.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_are_cut_in_the_middle() {
        let exact = "\u{e9}".repeat(MAX_SHOWN);
        assert_eq!(short(&exact), exact);
        let long = format!("{exact}.png");
        let cut = short(&long);
        assert!(
            cut.chars().count() == MAX_SHOWN && cut.contains("\u{e9}\u{2026}\u{e9}") && cut.ends_with(".png")
        );
    }

    #[test]
    fn text_that_turns_around_is_shown_as_escapes() {
        assert_eq!(
            plain("a\u{202e}gpj.exe\u{2066}\u{200f}\u{2028}"),
            "a\\u{202e}gpj.exe\\u{2066}\\u{200f}\\u{2028}"
        );
        // What joins letters of some scripts stays.
        assert_eq!(plain("\u{200d}\u{5d0}"), "\u{200d}\u{5d0}");
    }

    #[test]
    fn one_is_singular() {
        assert_eq!([counted(1, "node", "nodes"), counted(0, "node", "nodes")], ["1 node", "0 nodes"]);
    }

    #[test]
    fn no_control_character_of_a_file_is_shown() {
        let place = "/nodes/\u{1b}]0;x\u{7}".to_owned();
        let error =
            ImportError::new(Path::new("a\u{9b}.obj"), "\u{1b}[2J\r\n\u{7f} \u{e9}").at(place.clone());
        let shown = "a\\u{9b}.obj: /nodes/\\u{1b}]0;x\\u{7}: \\u{1b}[2J\\r\\n\\u{7f} \u{e9}";
        assert_eq!(error.to_string(), shown);
        let warning = Warning { file: error.file, place, message: error.reason };
        assert_eq!(warning.to_string(), shown);
    }
}
