//! Paths in a project file: relative to it wherever there is a way, with forward slashes.
//! Works on the text of paths; nothing is opened.

use std::path::{Component, Path, PathBuf, absolute};

/// `path` as seen from the folder of the project; absolute when they have no common root.
pub(super) fn to_relative(project: &Path, path: &Path) -> String {
    let target = normalized(path);
    let project = normalized(project);
    let base = project.parent().unwrap_or(Path::new(""));
    let target_parts: Vec<Component<'_>> = target.components().collect();
    let base_parts: Vec<Component<'_>> = base.components().collect();
    let common = target_parts.iter().zip(&base_parts).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return with_slashes(&target);
    }
    let ups = base_parts.iter().skip(common).map(|_| Component::ParentDir);
    let rest = target_parts.into_iter().skip(common);
    with_slashes(&ups.chain(rest).collect::<PathBuf>())
}

/// The other way round.
pub(super) fn from_relative(project: &Path, text: &str) -> PathBuf {
    let project = normalized(project);
    let folder = project.parent().unwrap_or(Path::new(""));
    normalized(&folder.join(text))
}

/// Absolute, without `.` and `..`.
fn normalized(path: &Path) -> PathBuf {
    let path = absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut clean = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                clean.pop();
            }
            other => clean.push(other),
        }
    }
    clean
}

fn with_slashes(path: &Path) -> String {
    let text = path.to_string_lossy();
    if std::path::MAIN_SEPARATOR == '/' {
        text.into_owned()
    } else {
        text.replace(std::path::MAIN_SEPARATOR, "/")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let project = Path::new("/a/b/scene.caustica");
        for (path, text) in [
            ("/a/b/x.glb", "x.glb"),
            ("/a/b/c/x.glb", "c/x.glb"),
            ("/a/x.glb", "../x.glb"),
            ("/z/x.glb", "../../z/x.glb"),
        ] {
            assert_eq!(to_relative(project, Path::new(path)), text);
            assert_eq!(from_relative(project, text), Path::new(path));
        }
        assert_eq!(from_relative(project, "/q/x.glb"), Path::new("/q/x.glb"));
    }
}
