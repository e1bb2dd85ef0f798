//! Journals that another process has locked. In: a path. Out: whose project it is, whether that process is just ending,
//! and what it has left behind once it is gone.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::entry::lines;
use super::left_behind::{Begin, LeftBehind, Look};

/// Longest first line that is read of a journal: it names a file and what was left out of it.
const MOST_BYTES_OF_A_LINE: u64 = 16 << 20;
/// In the flags of `/proc/PID/stat`: the process is being taken down.
const EXITING: u64 = 4;
/// In the pending signals of `/proc/PID/status`: it was killed, and has not noticed yet.
const KILLED: u64 = 1 << 8;

/// A journal that another process has locked: its project is being edited, or that process is just ending. One that was
/// killed keeps its locks until the system has taken back its memory and its device, which may take seconds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeldJournal {
    path: PathBuf,
    project: Option<PathBuf>,
}

impl HeldJournal {
    pub(super) fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), project: project_of(path) }
    }

    /// The project file that is open; `None`: the scene was never saved, or nothing can be read.
    pub fn project(&self) -> Option<&Path> {
        self.project.as_deref()
    }

    /// Whether the process that made it has been ended and is only being taken down. Known where there is `/proc`.
    pub fn is_ending(&self) -> bool {
        let name = self.path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        name.rsplit_once('-').and_then(|(_, process)| process.parse().ok()).is_some_and(is_ending)
    }

    /// Looks at these again: gives what processes have left behind that have died since, and keeps those that are held still.
    pub fn look_again(held: &mut Vec<Self>) -> Vec<LeftBehind> {
        let mut found = Vec::new();
        held.retain(|journal| match LeftBehind::look(&journal.path) {
            Ok(Look::Held) => true,
            Ok(Look::Nothing) => false,
            Ok(Look::Left(left)) => {
                found.push(left);
                false
            }
            Err(problem) => {
                // One that was saved meanwhile is gone.
                if journal.path.exists() {
                    tracing::warn!(
                        "{}: unsaved changes that cannot be read: {problem}",
                        journal.path.display()
                    );
                }
                false
            }
        });
        found
    }
}

fn project_of(path: &Path) -> Option<PathBuf> {
    let mut line = Vec::new();
    let file = BufReader::new(File::open(path).ok()?);
    file.take(MOST_BYTES_OF_A_LINE).read_until(b'\n', &mut line).ok()?;
    let (json, _) = lines(&line).next()?;
    Begin::parse(json).ok()?.project
}

fn is_ending(process: u32) -> bool {
    let read = |what: &str| fs::read_to_string(format!("/proc/{process}/{what}")).unwrap_or_default();
    let (stat, status) = (read("stat"), read("status"));
    // The name before it stands in brackets and may hold anything.
    let mut after_name = stat.rsplit(") ").next().unwrap_or_default().split(' ');
    let is_dead = matches!(after_name.next(), Some("Z" | "X"));
    let flags: u64 = after_name.nth(5).and_then(|flags| flags.parse().ok()).unwrap_or(0);
    let mut pending = status.lines().filter_map(|line| line.split_once("Pnd:"));
    let killed =
        |(_, signals): (&str, &str)| u64::from_str_radix(signals.trim(), 16).unwrap_or(0) & KILLED != 0;
    is_dead || flags & EXITING != 0 || pending.any(killed)
}
