//! Paths in a project file: relative to it wherever there is a way, with forward slashes. What leads out of the folder of
//! the project is read by permission only, what names another machine never.
//! Works on the text of paths; of files only links are looked at.

use std::path::{Component, Path, PathBuf, absolute};

use crate::import::{is_address, leads_out, short};

/// Why a path is not followed.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// It lies outside of the folder of the project.
    Outside(PathBuf),
    /// Never followed, with the reason.
    Never(String),
}

/// `path` as seen from the folder of the project; absolute when they have no common root.
pub(super) fn to_relative(project: &Path, path: &Path) -> String {
    let target = normalized(path);
    let base = folder_of(project);
    // Where one of them goes through a link, the way between what the links lead to may be the shorter one.
    let inside = || {
        let (target, base) = (target.canonicalize().ok()?, base.canonicalize().ok()?);
        target.starts_with(&base).then_some((target, base))
    };
    let (target, base) = match target.starts_with(&base) {
        true => (target, base),
        false => inside().unwrap_or((target, base)),
    };
    let target_parts: Vec<Component<'_>> = target.components().collect();
    let base_parts: Vec<Component<'_>> = base.components().collect();
    let common = target_parts.iter().zip(&base_parts).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return with_slashes(&target);
    }
    let ups = base_parts.iter().skip(common).map(|_| Component::ParentDir);
    let rest = target_parts.into_iter().skip(common);
    let text = with_slashes(&ups.chain(rest).collect::<PathBuf>());
    // A colon in the first name would read as a drive or an address (RFC 3986, section 4.2).
    if text.split('/').next().is_some_and(|name| name.contains(':')) { format!("./{text}") } else { text }
}

/// The other way round; nothing is refused, and the path may lead anywhere.
pub(super) fn from_relative(project: &Path, text: &str) -> PathBuf {
    if is_address(text) {
        // As it was written, with both of its slashes: it is only shown and kept.
        return folder_of(project).join(text);
    }
    normalized(&folder_of(project).join(text))
}

/// The other way round, within the folder of the project.
pub(super) fn resolve(project: &Path, text: &str) -> Result<PathBuf, Refusal> {
    if text.is_empty() || text.contains('\0') {
        return Err(Refusal::Never("the file name is empty or holds a zero byte".to_owned()));
    }
    if is_address(text) || text.starts_with("//") || text.starts_with("\\\\") {
        return Err(Refusal::Never(format!(
            "\"{}\" names another machine or an address; only files are read",
            short(text)
        )));
    }
    if is_foreign(text) {
        return Err(Refusal::Never(format!(
            "\"{}\" names a drive, which this machine does not have",
            short(text)
        )));
    }
    let folder = folder_of(project);
    let path = from_relative(project, text);
    if !path.starts_with(&folder) || leads_out(&path, &folder) {
        return Err(Refusal::Outside(path));
    }
    Ok(path)
}

/// Whether a path is of another machine: an address, a share, or a drive where there are none.
pub(super) fn is_foreign(text: &str) -> bool {
    let drive = text.as_bytes().get(1) == Some(&b':') && !Path::new(text).is_absolute();
    drive || is_address(text) || text.starts_with("//") || text.starts_with("\\\\")
}

/// A path whatever the working folder becomes, as text.
pub(super) fn absolute_text(path: &Path) -> String {
    with_slashes(&normalized(path))
}

fn folder_of(project: &Path) -> PathBuf {
    normalized(project).parent().unwrap_or(Path::new("")).to_owned()
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
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let project = Path::new("/a/b/scene.caustica");
        for (path, text) in [
            ("/a/b/x.glb", "x.glb"),
            ("/a/b/c/x.glb", "c/x.glb"),
            ("/a/b/c:x.glb", "./c:x.glb"),
            ("/a/b/http:x.glb", "./http:x.glb"),
            ("/a/x.glb", "../x.glb"),
            ("/z/x.glb", "../../z/x.glb"),
        ] {
            assert_eq!(to_relative(project, Path::new(path)), text);
            assert_eq!(from_relative(project, text), Path::new(path));
        }
        assert_eq!(from_relative(project, "/q/x.glb"), Path::new("/q/x.glb"));
    }

    #[test]
    fn what_leads_out_of_the_folder_is_told_from_what_stays_inside() {
        let project = Path::new("/a/b/scene.caustica");
        let inside = |path: &str| Ok(PathBuf::from(path));
        for (text, expected) in [
            ("x.glb", inside("/a/b/x.glb")),
            ("c/../x.glb", inside("/a/b/x.glb")),
            ("/a/b/c/x.glb", inside("/a/b/c/x.glb")),
            ("./c:x.glb", inside("/a/b/c:x.glb")),
            // Nothing is decoded: these are odd names.
            ("%2e%2e/x.glb", inside("/a/b/%2e%2e/x.glb")),
        ] {
            assert_eq!(resolve(project, text), expected, "{text}");
        }
        for text in ["../x.glb", "c/../../x.glb", "/etc/passwd", "/a/bc/x.glb"] {
            assert!(matches!(resolve(project, text), Err(Refusal::Outside(_))), "{text}");
        }
        for text in [
            "",
            "a\0b",
            "//host/x.glb",
            "\\\\host\\x.glb",
            "http://host/x.glb",
            "file:///etc/passwd",
            "smb:x",
        ] {
            assert!(matches!(resolve(project, text), Err(Refusal::Never(_))), "{text}");
        }
        for text in ["C:/x.glb", "c:x.glb", "C:\\x.glb"] {
            let refused = resolve(project, text).unwrap_err();
            assert_eq!(matches!(refused, Refusal::Never(_)), is_foreign(text), "{text}");
        }
    }

    #[cfg(windows)]
    #[test]
    fn backslashes_part_names_on_windows() {
        let project = Path::new("C:\\a\\b\\scene.caustica");
        assert!(matches!(resolve(project, "..\\x.glb"), Err(Refusal::Outside(_))));
    }
}
