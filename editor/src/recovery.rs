//! Where unsaved changes are kept, and what processes that have died left there. Enters: the environment. Leaves: a
//! folder, and words about what is in it.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use caustica_scene::{HeldJournal, LeftBehind};

/// The folder of the journals: `$XDG_DATA_HOME/caustica/journals`, or the same below `~/.local/share`. Not beside the
/// project, which may lie where nothing can be written, and never where a project names it.
pub fn folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let data = set("XDG_DATA_HOME").or_else(|| set("HOME").map(|home| home.join(".local/share")))?;
    Some(data.join("caustica").join("journals"))
}

/// Unsaved changes of processes that have died, newest first, and journals of those that are alive or just ending.
pub fn survey() -> (Vec<LeftBehind>, Vec<HeldJournal>) {
    folder().map(|folder| LeftBehind::survey(&folder)).unwrap_or_default()
}

/// Says for every file that holds unsaved changes of this project what is in it, and whether the project is being edited.
pub fn unsaved_changes_of(project: &Path) -> Vec<String> {
    let project = std::path::absolute(project).unwrap_or_else(|_| project.to_owned());
    let (left_behind, held) = survey();
    let left_behind = left_behind.iter().filter(|left| left.project() == Some(&project));
    let recoverable = left_behind
        .map(|left| format!("{}; the editor asks whether to recover what is unsaved", describe(left)));
    let held = held.iter().filter(|held| held.project() == Some(&project));
    recoverable.chain(held.map(|held| describe_held(&project, held))).collect()
}

fn describe_held(project: &Path, held: &HeldJournal) -> String {
    let name = project.file_name().unwrap_or(project.as_os_str()).to_string_lossy();
    if held.is_ending() {
        format!(
            "{name}: has unsaved edits, and its editor is just ending; the next start of the editor asks whether to recover them"
        )
    } else {
        format!("{name}: is being edited; what is unsaved there is not in what was read here")
    }
}

/// Such as "room.caustica.json: 12 unsaved edits, 3 minutes ago".
pub fn describe(left: &LeftBehind) -> String {
    let name = left.project().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    let name = name.unwrap_or_else(|| "a scene that was never saved".to_owned());
    let edits =
        if left.edits == 1 { "one unsaved edit".to_owned() } else { format!("{} unsaved edits", left.edits) };
    let age = left.modified.and_then(|at| SystemTime::now().duration_since(at).ok()).map(|age| age.as_secs());
    match age {
        Some(seconds) => format!("{name}: {edits}, {}", ago(seconds)),
        None => format!("{name}: {edits}"),
    }
}

fn ago(seconds: u64) -> String {
    let counted = |count: u64, unit: &str| {
        let plural = if count == 1 { "" } else { "s" };
        format!("{count} {unit}{plural} ago")
    };
    match seconds {
        0..60 => "just now".to_owned(),
        60..3600 => counted(seconds / 60, "minute"),
        3600..86_400 => counted(seconds / 3600, "hour"),
        _ => counted(seconds / 86_400, "day"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_are_told_in_the_largest_unit() {
        let expected =
            [(0, "just now"), (60, "1 minute ago"), (7300, "2 hours ago"), (86_400 * 3, "3 days ago")];
        for (seconds, words) in expected {
            assert_eq!(ago(seconds), words);
        }
    }
}
