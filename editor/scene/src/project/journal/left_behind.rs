//! Journals of processes that have died. In: a folder. Out: what each holds, and the document as it was.
//! A file is removed here only when there is nothing in it, or when its owner says so.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::entry::{Base, Entry, VERSION, lines};
use super::held::HeldJournal;
use super::{ENDING, Journal, remove};
use crate::assets::{Environment, EnvironmentFile, Mesh, ShapeSource};
use crate::edit::Edit;
use crate::import::{ImportOptions, plain};
use crate::project::read::{Loader, parse, read_file};
use crate::project::unknown::ProjectFile;
use crate::project::{Fingerprint, Project, ProjectProblem, SCHEMA_VERSION, atomic};

/// The unsaved changes of a process that has died. While this lives no other process sees them.
#[derive(Debug)]
pub struct LeftBehind {
    path: PathBuf,
    file: File,
    project: Option<PathBuf>,
    refused: bool,
    /// When the last edit was kept.
    pub modified: Option<SystemTime>,
    /// How many edits it holds; a scene without a file counts as one.
    pub edits: usize,
}

/// A document as it was before its process died. Its journal goes on.
#[derive(Debug)]
pub struct Recovered {
    /// The document, with warnings.
    pub project: Project,
    /// The project file; `None`: the scene has none, or that file is another one by now.
    pub path: Option<PathBuf>,
    /// Before the first step it is what that file holds.
    pub base_is_saved: bool,
    /// What was done since the last save, oldest first.
    pub steps: Vec<RecoveredStep>,
    /// Keeps what is done next.
    pub journal: Journal,
}

/// An edit that was done again.
#[derive(Debug)]
pub struct RecoveredStep {
    /// What it did, in words.
    pub label: String,
    /// The edit.
    pub edit: Edit,
    /// What undoes it.
    pub inverse: Edit,
}

/// Why unsaved changes cannot be recovered. Their file stays.
#[derive(Debug, thiserror::Error)]
#[error("{}", plain(&format!("{}: {problem}", file.display())))]
pub struct JournalError {
    /// The journal, or the project that it follows.
    pub file: PathBuf,
    /// What is wrong.
    pub problem: ProjectProblem,
}

/// What is seen of a journal.
pub(super) enum Look {
    /// Another process has locked it.
    Held,
    /// There is nothing in it.
    Nothing,
    /// Its process has died.
    Left(LeftBehind),
}

/// What a journal says, up to its last whole line.
struct Contents {
    base: Option<Base>,
    scene: Option<(Box<ProjectFile>, Vec<Edit>)>,
    edits: Vec<Edit>,
    next_id: u64,
    /// Bytes of whole lines.
    len: u64,
}

impl LeftBehind {
    /// What dead processes have left in a folder, newest first. Empty journals are removed; what cannot be read is left alone
    /// and told of in the log.
    pub fn find(folder: &Path) -> Vec<Self> {
        Self::survey(folder).0
    }

    /// The same, and the journals that processes hold which are alive or just ending.
    pub fn survey(folder: &Path) -> (Vec<Self>, Vec<HeldJournal>) {
        let files = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let journals = files.filter(|path| path.extension().is_some_and(|ending| ending == ENDING));
        let (mut found, mut held) = (Vec::new(), Vec::new());
        for path in journals {
            match Self::look(&path) {
                Ok(Look::Left(left)) => found.push(left),
                Ok(Look::Held) => held.push(HeldJournal::new(&path)),
                Ok(Look::Nothing) => {}
                Err(error) => {
                    tracing::warn!("{}: unsaved changes that cannot be read: {error}", path.display());
                }
            }
        }
        found.sort_by(|a, b| b.modified.cmp(&a.modified).then_with(|| b.path.cmp(&a.path)));
        (found, held)
    }

    pub(super) fn look(path: &Path) -> Result<Look, ProjectProblem> {
        let mut file = OpenOptions::new().read(true).write(true).open(path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(Look::Held),
            Err(TryLockError::Error(error)) => return Err(error.into()),
        }
        let bytes = read_all(&mut file)?;
        let mut lines = lines(&bytes);
        let begin = lines.next().map(|(json, _)| json).unwrap_or_default();
        let begin = Begin::parse(begin)?;
        let edits = lines.count();
        if edits == 0 {
            remove(path);
            return Ok(Look::Nothing);
        }
        let modified = file.metadata().and_then(|metadata| metadata.modified()).ok();
        let Begin { project, refused, .. } = begin;
        Ok(Look::Left(Self { path: path.to_owned(), file, project, refused, modified, edits }))
    }

    /// The project file that was open; `None`: the scene was never saved.
    pub fn project(&self) -> Option<&Path> {
        self.project.as_deref()
    }

    /// The file that holds the changes.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes it: its owner does not want it.
    pub fn discard(self) {
        remove(&self.path);
    }

    /// Reads what the edits follow and applies them. `progress` as in [`Project::load_with_progress`].
    ///
    /// # Errors
    /// When the journal or the project that it follows cannot be read. The journal stays.
    pub fn recover(
        mut self,
        options: &ImportOptions,
        progress: &dyn Fn(&str, f32),
    ) -> Result<Recovered, JournalError> {
        let own = self.path.clone();
        let fail = |problem| JournalError { file: own.clone(), problem };
        let bytes = read_all(&mut self.file).map_err(|error| fail(error.into()))?;
        let contents = Contents::parse(&bytes).map_err(fail)?;
        let len = contents.len;
        if bytes.get(len as usize..).is_some_and(|rest| rest.contains(&b'\n')) {
            // More than a line that was cut off: what follows the damage may be wanted one day.
            let copy = self.path.with_extension("damaged");
            fs::write(&copy, &bytes).map_err(|error| fail(error.into()))?;
            tracing::warn!("{}: damaged; a copy is in {}", self.path.display(), copy.display());
        }
        let (project, is_scene) = (self.project.take(), contents.scene.is_some());
        // What the process that died was allowed to read; the paths in a scene are the program's own.
        let outside_project = !self.refused || is_scene || options.outside_project;
        let options = &ImportOptions { outside_project, ..options.clone() };
        let (loader_path, record, left_out, base) = match contents.scene {
            Some((record, left_out)) => {
                let file = Fingerprint::default();
                (self.path.as_path(), *record, left_out, Found { file, is_as_it_was: true })
            }
            None => {
                let (Some(path), Some(base)) = (project.as_deref(), contents.base) else {
                    return Err(fail(ProjectProblem::Broken("there is no scene in it".to_owned())));
                };
                let wrong = |problem| JournalError { file: path.to_owned(), problem };
                let (record, found) = find_base(path, base.file).map_err(wrong)?;
                (path, record, base.left_out, found)
            }
        };
        let mut loader = Loader::of_file(loader_path, record, is_scene, options, progress).map_err(fail)?;
        loader.document.reserve_ids_up_to(contents.next_id.saturating_sub(1));
        if !base.is_as_it_was {
            let message = "the file has changed since; the unsaved changes were applied as far as they fit";
            loader.warn(String::new(), message.to_owned());
        }
        let steps = replay(&mut loader, left_out, contents.edits);
        let recovered = loader.finish("recovered", base.file);
        let journal = Journal::resume(self.file, &self.path, len, project.clone(), self.refused);
        let mut journal = journal.map_err(|error| fail(error.into()))?;
        if !base.is_as_it_was {
            // The next save replaces what the edits follow: from now on they need nothing but themselves.
            let kept = journal.keep_scene(&recovered.document, &recovered.meta);
            kept.map_err(|error| fail(error.into()))?;
        }
        let path = project.filter(|_| base.is_as_it_was);
        let base_is_saved = path.is_some() && !is_scene;
        Ok(Recovered { project: recovered, path, base_is_saved, steps, journal })
    }
}

fn read_all(file: &mut File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The first line of a journal that this version reads.
pub(super) struct Begin {
    pub(super) project: Option<PathBuf>,
    refused: bool,
    base: Option<Base>,
}

impl Begin {
    pub(super) fn parse(json: &[u8]) -> Result<Self, ProjectProblem> {
        match serde_json::from_slice(json)? {
            Entry::Begin { journal, schema, .. } if journal > VERSION || schema > SCHEMA_VERSION => {
                Err(ProjectProblem::Newer { found: schema.max(journal) })
            }
            Entry::Begin { project, refused, base, .. } => Ok(Self { project, refused, base }),
            _ => Err(ProjectProblem::Broken("the first line is missing".to_owned())),
        }
    }
}

impl Contents {
    fn parse(bytes: &[u8]) -> Result<Self, ProjectProblem> {
        let mut lines = lines(bytes);
        let (begin, end) = lines.next().unwrap_or_default();
        let Begin { base, .. } = Begin::parse(begin)?;
        let mut contents = Self { base, scene: None, edits: Vec::new(), next_id: 0, len: end as u64 };
        for (json, end) in lines {
            contents.len = end as u64;
            match serde_json::from_slice(json)? {
                Entry::Begin { .. } => {}
                Entry::Edit { next_id, edit } => {
                    contents.next_id = contents.next_id.max(next_id);
                    contents.edits.push(edit.into_owned());
                }
                Entry::Scene { project, left_out } => {
                    contents.edits.clear();
                    contents.next_id = contents.next_id.max(project.record.next_id);
                    contents.scene = Some((project, left_out));
                }
            }
        }
        Ok(contents)
    }
}

/// What stands for the file that the edits follow.
struct Found {
    file: Fingerprint,
    is_as_it_was: bool,
}

/// The project as it was when the journal began: the file itself, or its backup when the process died after a save or when another
/// one has saved since; else the file as it is now.
fn find_base(path: &Path, wanted: Fingerprint) -> Result<(ProjectFile, Found), ProjectProblem> {
    let now = read_file(path);
    if let Ok(bytes) = &now
        && Fingerprint::of(bytes) == wanted
    {
        return Ok((parse(bytes)?, Found { file: wanted, is_as_it_was: true }));
    }
    let before = read_file(&atomic::backup_of(path)).ok().filter(|bytes| Fingerprint::of(bytes) == wanted);
    let bytes = before.map_or(now, Ok)?;
    Ok((parse(&bytes)?, Found { file: Fingerprint::of(&bytes), is_as_it_was: false }))
}

/// Applies the edits. One that does not fit, because a file is another one by now, is left out with a warning.
fn replay(loader: &mut Loader<'_>, left_out: Vec<Edit>, edits: Vec<Edit>) -> Vec<RecoveredStep> {
    for edit in left_out {
        let edit = with_files(loader, edit);
        if let Err(error) = loader.document.apply_back(edit) {
            loader.warn(String::new(), format!("what could be undone is lost: {error}"));
        }
    }
    let mut steps = Vec::new();
    for edit in edits {
        let edit = with_files(loader, edit);
        let label = edit.describe(&loader.document);
        match loader.document.apply_back(edit.clone()) {
            Ok(inverse) => steps.push(RecoveredStep { label, edit, inverse }),
            Err(error) => loader.warn(String::new(), format!("\"{label}\" does not fit any more: {error}")),
        }
    }
    steps
}

/// Reads the files that an edit only names.
fn with_files(loader: &mut Loader<'_>, edit: Edit) -> Edit {
    let imported = |loader: &mut Loader<'_>, named: crate::PrefabPackage| {
        if named.prefab.missing {
            return named;
        }
        let mut package = loader.import(named.clone());
        package.beside.clone_from(&named.beside);
        package.keep_edits(
            true,
            |id| named.materials.iter().find(|(known, _)| *known == id).map(|(_, entry)| entry),
            |id| named.meshes.iter().find(|(known, _)| *known == id).map(|(_, mesh)| mesh),
        );
        package
    };
    match edit {
        Edit::AddPrefab(named) => Edit::AddPrefab(Box::new(imported(loader, *named))),
        Edit::ReplacePrefab(named) => Edit::ReplacePrefab(Box::new(imported(loader, *named))),
        Edit::SetEnvironment(Environment::File(file)) => {
            // A drag turns the same map many times.
            let known = match loader.document.environment() {
                Environment::File(now) if now.path == file.path => now.map.clone(),
                _ => None,
            };
            Edit::SetEnvironment(Environment::File(match known {
                Some(map) => EnvironmentFile { map: Some(map), ..file },
                None => loader.read_map(file, Ok(())),
            }))
        }
        Edit::SetShapes { mesh, source } => {
            Edit::SetShapes { mesh, source: Box::new(read_source(loader, *source)) }
        }
        Edit::AddMesh { mesh, value } => Edit::AddMesh { mesh, value: Box::new(with_shapes(loader, *value)) },
        Edit::Batch { label, edits } => {
            Edit::Batch { label, edits: edits.into_iter().map(|edit| with_files(loader, edit)).collect() }
        }
        other => other,
    }
}

fn read_source(loader: &mut Loader<'_>, source: ShapeSource) -> ShapeSource {
    match source {
        ShapeSource::File(file) => ShapeSource::File(loader.read_shapes("", file.path, Ok(()))),
        other => other,
    }
}

fn with_shapes(loader: &mut Loader<'_>, mesh: Mesh) -> Mesh {
    let Some(ShapeSource::File(file)) = mesh.shapes().map(|shapes| shapes.source().clone()) else {
        return mesh;
    };
    let source = ShapeSource::File(loader.read_shapes("", file.path, Ok(())));
    let materials: Vec<_> = mesh.primitives.iter().map(|primitive| primitive.material).collect();
    Mesh::of_shapes(mesh.name.clone(), source, &materials).unwrap_or(mesh)
}
