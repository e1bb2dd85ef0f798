//! GLSL files by their path inside `shaders/`. Enters: the embedded copy, or a folder. Leaves: text and the files that
//! a main file includes. Paths never leave the folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use include_dir::{Dir, include_dir};

use super::suspects::HeldShader;
use crate::error::{RendererError, Result};

/// The shaders as they were when this binary was built.
static EMBEDDED: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../shaders");

/// Where shaders are read from.
#[derive(Clone, Debug, Default)]
pub struct ShaderSources {
    folder: Option<PathBuf>,
    held: Arc<Vec<Hold>>,
}

/// A text that is not used.
#[derive(Debug)]
struct Hold {
    shader: HeldShader,
    /// Whether the file holds it, as far as is known.
    in_force: AtomicBool,
}

/// A main file with everything it includes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Path of the main file, such as `passes/shadow/shadow.rgen`.
    pub file: String,
    /// Text of the main file and of every included file, by path.
    pub texts: BTreeMap<String, String>,
}

impl ShaderSources {
    /// Reads from `folder`, or from the copy in the binary when it is `None`.
    pub fn new(folder: Option<PathBuf>) -> Self {
        // Absolute, as the paths are of files that were saved in it.
        let folder = folder.map(|folder| std::path::absolute(&folder).unwrap_or(folder));
        Self { folder, held: Arc::default() }
    }

    /// The same folder, with other texts in the place of those that did not finish.
    #[must_use]
    pub fn holding(self, held: Vec<HeldShader>) -> Self {
        let hold = |shader| Hold { shader, in_force: AtomicBool::new(true) };
        Self { held: Arc::new(held.into_iter().map(hold).collect()), ..self }
    }

    /// Shaders that did not finish and are in their files still.
    pub fn held(&self) -> impl Iterator<Item = &HeldShader> {
        self.held.iter().filter(|hold| hold.in_force.load(Ordering::Relaxed)).map(|hold| &hold.shader)
    }

    /// The folder, where it is not the copy in the binary.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Every file of the copy in the binary, in order of their paths.
    pub fn built_in_files() -> Vec<String> {
        let mut files = Vec::new();
        let mut folders = vec![&EMBEDDED];
        while let Some(folder) = folders.pop() {
            folders.extend(folder.dirs());
            files.extend(folder.files().filter_map(|file| file.path().to_str()).map(str::to_owned));
        }
        files.sort();
        files
    }

    /// Reads one file.
    ///
    /// # Errors
    /// [`RendererError::Source`] when it is missing, unreadable or outside of the folder.
    pub fn read(&self, file: &str) -> Result<String> {
        let refuse = |reason: String| RendererError::Source { file: file.to_owned(), reason };
        if file.split('/').any(|part| part == ".." || part.is_empty()) {
            return Err(refuse(String::from("a shader path must stay inside the shader folder")));
        }
        match &self.folder {
            Some(folder) => {
                read_file(&folder.join(file)).map(|text| self.without_held(file, text)).map_err(refuse)
            }
            None => EMBEDDED
                .get_file(file)
                .and_then(include_dir::File::contents_utf8)
                .map(str::to_owned)
                .ok_or_else(|| refuse(String::from("no such file in the built-in shaders"))),
        }
    }

    /// The text before, in the place of one that did not finish.
    fn without_held(&self, file: &str, text: String) -> String {
        let Some(hold) = self.held.iter().find(|hold| hold.shader.file == file) else { return text };
        let in_force = hold.shader.bad == text;
        hold.in_force.store(in_force, Ordering::Relaxed);
        if in_force { hold.shader.good.clone() } else { text }
    }

    /// Reads a main file and follows its includes.
    ///
    /// # Errors
    /// [`RendererError::Source`] naming the file that is missing.
    pub fn load(&self, file: &str) -> Result<Source> {
        self.load_with(file, &mut BTreeMap::new())
    }

    /// The same; `known` holds files that were read before and gets those that are read now.
    pub(super) fn load_with(&self, file: &str, known: &mut BTreeMap<String, String>) -> Result<Source> {
        let mut texts = BTreeMap::new();
        let mut waiting = vec![file.to_owned()];
        while let Some(next) = waiting.pop() {
            if texts.contains_key(&next) {
                continue;
            }
            let read = known.get(&next).map_or_else(|| self.read(&next), |text| Ok(text.clone()));
            let text = read.map_err(|error| match error {
                RendererError::Source { file: missing, reason } if missing != file => RendererError::Source {
                    file: file.to_owned(),
                    reason: format!("include \"{missing}\": {reason}"),
                },
                other => other,
            })?;
            waiting.extend(includes_of(&text).map(str::to_owned));
            known.entry(next.clone()).or_insert_with(|| text.clone());
            texts.insert(next, text);
        }
        Ok(Source { file: file.to_owned(), texts })
    }
}

/// Reads a file; the reason of a failure names its full path.
fn read_file(path: &std::path::Path) -> std::result::Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Paths named by `#include "..."` lines.
fn includes_of(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?.trim_start();
        rest.strip_prefix('"')?.split('"').next()
    })
}

#[cfg(test)]
#[expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]
mod tests {
    use super::*;

    #[test]
    fn includes_are_found_whatever_the_spacing() {
        let text =
            "#include \"a.glsl\"\n  #  include  \"b/c.glsl\" // why\n// #include \"no.glsl\"\n#define X\n";
        assert_eq!(includes_of(text).collect::<Vec<_>>(), ["a.glsl", "b/c.glsl"]);
    }

    #[test]
    fn a_text_that_did_not_finish_is_not_used_until_its_file_has_another_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let held =
            HeldShader { file: "a.comp".into(), bad: "bad".into(), good: "good".into(), pass: "a".into() };
        let sources = ShaderSources::new(Some(folder.path().to_owned())).holding(vec![held]);
        let read = |text: &str| {
            std::fs::write(folder.path().join("a.comp"), text).expect("a file");
            (sources.read("a.comp").expect("a text"), sources.held().count())
        };
        assert_eq!(read("bad"), ("good".to_owned(), 1));
        assert_eq!(read("better"), ("better".to_owned(), 0));
    }

    #[test]
    fn paths_stay_inside_the_folder() {
        assert!(ShaderSources::default().read("../Cargo.toml").is_err());
        assert!(ShaderSources::default().read("/etc/hostname").is_err());
    }
}
