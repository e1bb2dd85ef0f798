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
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Path of the main file, such as `passes/shadow/shadow.rgen`.
    pub file: String,
    /// Text of the main file and of every included file, by path.
    pub texts: BTreeMap<String, String>,
    /// Why an included file cannot be read, by path. An error only where the compiler asks for it.
    pub missing: BTreeMap<String, String>,
}

/// No shader is so large, bytes: what is was not meant to be one.
const MOST_BYTES: u64 = 4 << 20;

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
        if file.split('/').any(|part| matches!(part, "" | "." | "..")) {
            let reason = "a path leads from the folder of the shaders down, without '.', '..' or empty parts";
            return Err(refuse(reason.to_owned()));
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
    /// [`RendererError::Source`] when the main file cannot be read.
    pub fn load(&self, file: &str) -> Result<Source> {
        self.load_with(file, &mut BTreeMap::new())
    }

    /// The same; `known` holds files that were read before and gets those that are read now.
    pub(super) fn load_with(&self, file: &str, known: &mut BTreeMap<String, String>) -> Result<Source> {
        let (mut texts, mut missing) = (BTreeMap::new(), BTreeMap::new());
        let mut waiting = vec![file.to_owned()];
        while let Some(next) = waiting.pop() {
            if texts.contains_key(&next) || missing.contains_key(&next) {
                continue;
            }
            let read = known.get(&next).map_or_else(|| self.read(&next), |text| Ok(text.clone()));
            let text = match read {
                Ok(text) => text,
                Err(RendererError::Source { file: other, reason }) if other != file => {
                    missing.insert(other, reason);
                    continue;
                }
                Err(error) => return Err(error),
            };
            waiting.extend(includes_of(&text));
            known.entry(next.clone()).or_insert_with(|| text.clone());
            texts.insert(next, text);
        }
        Ok(Source { file: file.to_owned(), texts, missing })
    }
}

/// Reads a file. What is none, such as a pipe, is not opened: reading it might never end.
fn read_file(path: &Path) -> std::result::Result<String, String> {
    let told = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
        _ => error.to_string(),
    };
    let about = std::fs::metadata(path).map_err(told)?;
    if !about.is_file() {
        let what = if about.is_dir() { "a folder" } else { "a pipe, a socket or a device" };
        return Err(format!("this is {what}, and no file"));
    }
    if about.len() > MOST_BYTES {
        return Err(format!("a shader has at most {MOST_BYTES} bytes, this file has {}", about.len()));
    }
    text_of(std::fs::read(path).map_err(told)?)
}

/// The text of a file's bytes.
fn text_of(bytes: Vec<u8>) -> std::result::Result<String, String> {
    let line = |at: usize| bytes[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
    let zero = bytes.iter().position(|byte| *byte == 0);
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) || zero.is_some_and(|at| at < 2) {
        return Err("this file is UTF-16: save it as UTF-8".to_owned());
    }
    if let Some(at) = zero {
        return Err(format!("line {} holds a zero byte, as no text does", line(at)));
    }
    let valid = std::str::from_utf8(&bytes).map_err(|error| error.valid_up_to());
    match valid {
        Ok(_) => {}
        Err(at) => return Err(format!("line {} is not UTF-8", line(at))),
    }
    String::from_utf8(bytes).map_err(|error| error.to_string())
}

/// Paths named by `#include "..."` lines that are no comments. Whether the preprocessor comes to them is not known here.
fn includes_of(text: &str) -> Vec<String> {
    let path = |line: &str| {
        let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?.trim_start();
        Some(rest.strip_prefix('"')?.split('"').next()?.to_owned())
    };
    without_comments(text).lines().filter_map(path).collect()
}

/// A text without comments, and with lines that are continued as one (GLSL 4.60, 3.2 and 3.4).
fn without_comments(text: &str) -> String {
    let joined = text.replace("\\\r\n", "").replace("\\\n", "");
    let (mut kept, mut rest) = (String::new(), joined.as_str());
    while let Some(at) = rest.find(['/', '"']) {
        let (before, from) = rest.split_at(at);
        kept.push_str(before);
        let line = from.find('\n').unwrap_or(from.len());
        let taken = if from.starts_with("//") {
            line
        } else if let Some(comment) = from.strip_prefix("/*") {
            kept.push(' ');
            comment.find("*/").map_or(from.len(), |end| end + 4)
        } else {
            let quoted = from[1..line].find('"').filter(|_| from.starts_with('"')).map_or(1, |end| end + 2);
            kept.push_str(&from[..quoted]);
            quoted
        };
        rest = &from[taken..];
    }
    kept + rest
}

#[cfg(test)]
#[expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]
mod tests {
    use super::*;

    #[test]
    fn includes_are_found_whatever_the_spacing() {
        let text = "#include \"a.glsl\"\n  #  include  \"b/c.glsl\" // why\n// #include \"no.glsl\"\n#define X\n\
                    /* a\n#include \"no.glsl\"\n*/ #include /**/ \"d//e.glsl\"\n// \\\n#include \"no.glsl\"\n1 / 2\n\"//\" x\n\
                    #include \\\n\"f.glsl\"\n/* #include \"no.glsl\"\n#include \"no.glsl\"\n";
        assert_eq!(includes_of(text), ["a.glsl", "b/c.glsl", "d//e.glsl", "f.glsl"]);
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

    #[test]
    fn what_is_no_text_is_named_and_never_waited_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let sources = ShaderSources::new(Some(folder.path().to_owned()));
        let at = |name: &str| folder.path().join(name);
        let utf16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        std::fs::write(at("marked"), utf16("\u{feff}void")).expect("a file");
        std::fs::write(at("unmarked"), utf16("void")).expect("a file");
        std::fs::write(at("zero"), b"a\nb\0").expect("a file");
        std::fs::write(at("latin"), b"a\n\n// \xe4").expect("a file");
        std::fs::create_dir(at("folder")).expect("a folder");
        std::fs::File::create(at("large")).and_then(|file| file.set_len(MOST_BYTES + 1)).expect("a file");
        let mkfifo = std::process::Command::new("mkfifo").arg(at("pipe")).status();
        assert!(mkfifo.is_ok_and(|status| status.success()));
        for (file, words) in [
            ("marked", "this file is UTF-16: save it as UTF-8"),
            ("unmarked", "this file is UTF-16: save it as UTF-8"),
            ("zero", "line 2 holds a zero byte, as no text does"),
            ("latin", "line 3 is not UTF-8"),
            ("folder", "this is a folder, and no file"),
            ("pipe", "this is a pipe, a socket or a device, and no file"),
            ("none", "there is no such file"),
            ("large", "a shader has at most 4194304 bytes, this file has 4194305"),
        ] {
            let error = sources.read(file).expect_err("no text").to_string();
            assert_eq!(error, format!("{file}: {words}"));
        }
    }
}
