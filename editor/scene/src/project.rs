//! Projects: a versioned JSON file that names its prefabs by path and holds what was edited.
//! In: a path, or a document to save. Out: a document, what the program keeps beside it, and warnings.
//! It refuses newer versions in words, keeps what it does not know, and never leaves half a file.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::assets::TextureUse;
use crate::document::Document;
use crate::ids::{MaterialId, MeshId, TextureId};
use crate::import::{ImportOptions, Warning, plain};

pub(crate) mod atomic;
mod fault;
mod held;
mod journal;
mod lists;
mod migrate;
mod paths;
mod read;
mod record;
mod sound;
mod unknown;
mod write;

pub use journal::{HeldJournal, Journal, JournalError, LeftBehind, Recovered, RecoveredStep};
pub(crate) use record::{EnvironmentRecord, LocalRecord, NodeRecord, PackageRecord};

/// Version of the format that is written, and the newest that is read. 2: meshes of spheres and boxes.
pub const SCHEMA_VERSION: u64 = 2;

/// A project that was read.
#[derive(Clone, Debug, Default)]
pub struct Project {
    /// The scene.
    pub document: Document,
    /// What else is in the file.
    pub meta: ProjectMeta,
    /// What is missing or was repaired.
    pub warnings: Vec<Warning>,
    /// Files outside of its folder that it names and that were not read ([`ImportOptions::outside_project`]).
    pub outside: Vec<PathBuf>,
    /// What the file was when it was read.
    pub file: Fingerprint,
}

/// Tells the states of a file apart: its length and the CRC-32 of its bytes (ISO 3309).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    bytes: u64,
    crc32: u32,
}

impl Fingerprint {
    fn of(bytes: &[u8]) -> Self {
        Self { bytes: bytes.len() as u64, crc32: crc32fast::hash(bytes) }
    }
}

/// Keeps a project file that is another one by now under a name of its own, which is returned, so that a save does not take away
/// what somebody else has saved. `known`: the file as it was read or written last.
///
/// # Errors
/// When it cannot be copied.
pub fn keep_if_changed(path: &Path, known: Fingerprint) -> Result<Option<PathBuf>, ProjectError> {
    let Ok(bytes) = read::read_file(path) else { return Ok(None) };
    let found = Fingerprint::of(&bytes);
    if found == known {
        return Ok(None);
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".other-{:08x}", found.crc32));
    let kept = path.with_file_name(name);
    let copied = atomic::write(&kept, &bytes);
    copied
        .map(|()| Some(kept))
        .map_err(|problem| ProjectError { file: path.to_owned(), problem: problem.into() })
}

/// What a project file holds beside the document. Hand the same one back when saving.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectMeta {
    /// Settings of the views; the editor's own.
    pub view: Map<String, Value>,
    /// Settings of the renderer; the editor's own.
    pub render: Map<String, Value>,
    kept: Kept,
}

/// What this version does not know or cannot place, kept for the next save.
#[derive(Clone, Debug, Default, PartialEq)]
struct Kept {
    /// Fields that it does not know.
    unknown: unknown::Unknown,
    /// Textures of materials whose source does not have them now, by their slot.
    textures: BTreeMap<MaterialId, BTreeMap<usize, TextureUse>>,
    /// Moved primitives of meshes that are missing now, as they were in the file.
    meshes: BTreeMap<MeshId, record::MeshRecord>,
    /// Paths that may mean something on another machine, as they stood in the file, by what they lead to here.
    paths: BTreeMap<PathBuf, String>,
    /// The chosen camera when the part that it names is missing now.
    camera: Option<record::CameraRecord>,
}

impl ProjectMeta {
    /// Takes over what another project keeps of things that came from there and have other ids here. `id`: theirs; `None`: not
    /// brought along.
    pub fn keep_of(&mut self, other: &Self, id: impl Fn(u64) -> Option<u64>) {
        let Kept { unknown, textures, meshes, paths, camera: _ } = &other.kept;
        let copy = |from: &MaterialId, slots: &BTreeMap<usize, TextureUse>| {
            let slots = slots.iter().filter_map(|(&slot, used)| {
                Some((slot, TextureUse { texture: TextureId(id(used.texture.0)?), ..*used }))
            });
            Some((MaterialId(id(from.0)?), slots.collect()))
        };
        let textures: Vec<_> = textures.iter().filter_map(|(from, slots)| copy(from, slots)).collect();
        let meshes: Vec<_> = meshes
            .values()
            .filter_map(|record| Some(record::MeshRecord { id: MeshId(id(record.id.0)?), ..record.clone() }))
            .collect();
        self.kept.unknown.copy_elements(unknown, id);
        self.kept.textures.extend(textures);
        self.kept.meshes.extend(meshes.into_iter().map(|record| (record.id, record)));
        self.kept.paths.extend(paths.clone());
    }
}

/// Why a project cannot be read or saved.
#[derive(Debug)]
pub struct ProjectError {
    /// The project file.
    pub file: PathBuf,
    /// What is wrong.
    pub problem: ProjectProblem,
}

impl fmt::Display for ProjectError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&plain(&format!("{}: {}", self.file.display(), self.problem)))
    }
}

impl std::error::Error for ProjectError {}

/// What is wrong with a project.
#[derive(Debug, thiserror::Error)]
pub enum ProjectProblem {
    /// The file system said no.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not JSON.
    #[error("not a valid project: {0}")]
    Json(#[from] serde_json::Error),
    /// There is no version in it.
    #[error("not a Caustica project: the field \"caustica\" with the version is missing")]
    NotAProject,
    /// What stands in its place is none.
    #[error("not a Caustica project: the field \"caustica\" is {0}, which is no version number")]
    NoVersion(String),
    /// A later version of the program wrote it.
    #[error(
        "written by a newer version of Caustica (format {found}, this program reads up to {SCHEMA_VERSION}); \
         please update the program"
    )]
    Newer {
        /// Version in the file.
        found: u64,
    },
    /// The contents contradict each other.
    #[error("{0}")]
    Broken(String),
}

impl Project {
    /// Whether a path is named like a project: `.caustica` or `.json`.
    pub fn is_project_path(path: &Path) -> bool {
        path.extension().is_some_and(|extension| {
            extension.eq_ignore_ascii_case("caustica") || extension.eq_ignore_ascii_case("json")
        })
    }

    /// Reads a project and imports its prefabs. One whose file is missing or bad becomes a placeholder, with
    /// a warning, and is kept on save.
    ///
    /// # Errors
    /// When the project file itself cannot be read, is no project or is too new.
    pub fn load(path: &Path) -> Result<Self, ProjectError> {
        Self::load_with_progress(path, &ImportOptions::default(), &|_, _| {})
    }

    /// Like [`Self::load`]; `progress` is called with the name of what is read and the share done, 0..1.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_with_progress(
        path: &Path,
        options: &ImportOptions,
        progress: &dyn Fn(&str, f32),
    ) -> Result<Self, ProjectError> {
        read::load(path, options, progress).map_err(|problem| ProjectError { file: path.to_owned(), problem })
    }

    /// Writes a project: whole or not at all; the file that was there before goes on as `<name>.bak`.
    /// The same document and meta give the same bytes. Returns what the file is now.
    ///
    /// # Errors
    /// When the file cannot be written, or is a link that leads out of its folder.
    pub fn save(path: &Path, document: &Document, meta: &ProjectMeta) -> Result<Fingerprint, ProjectError> {
        let written = || {
            let text = write::to_text(path, document, meta)?;
            atomic::write(path, text.as_bytes())?;
            Ok(Fingerprint::of(text.as_bytes()))
        };
        written().map_err(|problem| ProjectError { file: path.to_owned(), problem })
    }

    /// What [`Self::save`] would write.
    ///
    /// # Errors
    /// When the document cannot be written as a project.
    pub fn text_of(path: &Path, document: &Document, meta: &ProjectMeta) -> Result<String, ProjectError> {
        write::to_text(path, document, meta)
            .map_err(|problem| ProjectError { file: path.to_owned(), problem })
    }
}
