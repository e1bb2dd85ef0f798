//! Lines of a journal: `crc32 length json`, so that a line that was cut off is told from a whole one.
//! In: entries. Out: bytes, and the other way round up to the first line that is not whole.

use std::borrow::Cow;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::super::Fingerprint;
use super::super::unknown::ProjectFile;
use crate::edit::Edit;

/// Version of the lines; the edits in them follow the version of the projects.
pub(super) const VERSION: u64 = 1;

/// One line.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase", rename_all_fields = "camelCase")]
pub(super) enum Entry<'a> {
    /// The first line.
    Begin {
        journal: u64,
        /// [`super::super::SCHEMA_VERSION`] of the program that wrote it.
        schema: u64,
        /// The project file, absolute; `None`: never saved.
        project: Option<PathBuf>,
        /// The project names files outside of its folder that were not read.
        refused: bool,
        /// `None`: a scene follows.
        base: Option<Base>,
    },
    /// An edit that was applied, also by undo or redo.
    Edit {
        /// Of the document, afterwards.
        next_id: u64,
        edit: Cow<'a, Edit>,
    },
    /// The whole scene: what stood before does not matter.
    Scene { project: Box<ProjectFile>, left_out: Vec<Edit> },
}

/// What the edits follow: a project file as it was, and what was in the document besides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Base {
    pub file: Fingerprint,
    pub left_out: Vec<Edit>,
}

pub(super) fn line_of(entry: &Entry<'_>) -> serde_json::Result<Vec<u8>> {
    let json = serde_json::to_vec(entry)?;
    let mut line = format!("{:08x} {} ", crc32fast::hash(&json), json.len()).into_bytes();
    line.extend(json);
    line.push(b'\n');
    Ok(line)
}

/// The JSON of each whole line with the place in `bytes` where the line ends.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (&[u8], usize)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let (json, length) = whole_line(bytes.get(at..)?)?;
        at += length;
        Some((json, at))
    })
}

/// The JSON of the first line and the length of that line, when it is whole.
fn whole_line(bytes: &[u8]) -> Option<(&[u8], usize)> {
    // Eight digits, a blank, at most twenty digits, a blank.
    let head = bytes.get(..30.min(bytes.len()))?;
    let end_of_length = 9 + head.get(9..)?.iter().position(|byte| *byte == b' ')?;
    let crc32 = u32::from_str_radix(std::str::from_utf8(head.get(..8)?).ok()?, 16).ok()?;
    let length: usize = std::str::from_utf8(head.get(9..end_of_length)?).ok()?.parse().ok()?;
    let end = (end_of_length + 1).checked_add(length)?;
    let json = bytes.get(end_of_length + 1..end)?;
    let is_whole =
        head.get(8) == Some(&b' ') && bytes.get(end) == Some(&b'\n') && crc32fast::hash(json) == crc32;
    is_whole.then_some((json, end + 1))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_is_cut_or_changed_anywhere_ends_the_journal_before_it() {
        let begin = || Entry::Begin {
            journal: VERSION,
            schema: 2,
            project: Some("/a".into()),
            refused: false,
            base: None,
        };
        let line = line_of(&begin()).unwrap();
        let both = [line.as_slice(), &line].concat();
        let ends = |bytes: &[u8]| lines(bytes).map(|(_, end)| end).collect::<Vec<_>>();
        assert_eq!(ends(&both), [line.len(), both.len()]);
        for cut in line.len()..both.len() {
            assert_eq!(ends(&both[..cut]), [line.len()], "cut at {cut}");
        }
        for place in 0..line.len() {
            let mut changed = both.clone();
            changed[line.len() + place] ^= 1;
            assert_eq!(ends(&changed), [line.len()], "changed at {place}");
        }
        assert!(ends(b"00000000 99999999999999999999 {}\n").is_empty());
        assert!(ends(b"").is_empty());
    }
}
