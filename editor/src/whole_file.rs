//! Puts a file in the place of another in one step: who reads it, or ends the program, never has half of it.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};

/// Has a file written beside the one of this name and renames it into place. What a link leads to is replaced, not the link.
///
/// # Errors
/// Those of `write`, which gets the path to write to, and of renaming; the old file stays.
pub(crate) fn replace<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let temporary = beside(&real, &format!(".{}.new", std::process::id()));
    let written = write(&temporary).and_then(|()| Ok(std::fs::rename(&temporary, &real)?));
    if written.is_err() {
        // It may not be there at all.
        let _ = std::fs::remove_file(&temporary);
    }
    written
}

/// A path in the same folder, with a longer name.
pub(crate) fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, ToOwned::to_owned);
    name.push(suffix);
    path.with_file_name(name)
}
