//! What can go wrong with a file, in words that name file, place and reason.

use std::fmt;
use std::path::{Path, PathBuf};

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

/// A name or address of a file for a message: what is long is cut.
pub(crate) fn short(text: &str) -> String {
    match text.char_indices().nth(MAX_SHOWN) {
        Some(_) => text.chars().take(MAX_SHOWN - 1).chain(['\u{2026}']).collect(),
        None => text.to_owned(),
    }
}

/// A count with its word, in the singular for one.
pub(crate) fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
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

fn told(f: &mut fmt::Formatter<'_>, file: &Path, place: &str, what: &str) -> fmt::Result {
    let colon = if place.is_empty() { "" } else { ": " };
    f.write_str(&plain(&format!("{}: {place}{colon}{what}", file.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

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
