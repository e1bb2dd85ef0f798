//! What can go wrong with a file, in words that name file, place and reason.

use std::fmt;
use std::path::{Path, PathBuf};

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
        write!(f, "{}: ", self.file.display())?;
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        f.write_str(&self.reason)
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
        write!(f, "{}: ", self.file.display())?;
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        f.write_str(&self.message)
    }
}
