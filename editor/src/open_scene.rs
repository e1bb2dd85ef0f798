//! The open document without its picture: edits, undo and redo, saving, and the journal that outlives the process.
//! In: edits, and documents that were read. Out: a changed document. It knows no renderer and no window.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_scene::{
    Document, Edit, EditError, Fingerprint, Journal, Project, ProjectError, ProjectMeta, Recovered,
    keep_if_changed,
};

use crate::history::History;

/// A document with its history, its file and its journal.
#[derive(Default)]
pub struct OpenScene {
    /// Shared while a worker reads it: an edit in that time copies it first.
    pub(crate) document: Arc<Document>,
    pub(crate) history: History,
    pub(crate) meta: ProjectMeta,
    pub(crate) path: Option<PathBuf>,
    /// The file as it was read or written last.
    known_file: Fingerprint,
    /// Where a file that somebody else had saved was kept, until the user was told.
    set_aside: Option<PathBuf>,
    /// The project names files outside of its folder that were not read.
    refused: bool,
    /// Grows with everything that may change the picture.
    pub(crate) picture_revision: u64,
    journal: Option<Journal>,
    /// Why edits are not kept, until somebody was told.
    journal_fault: Option<String>,
    journal_fails: bool,
}

impl OpenScene {
    /// An empty document whose edits are not kept.
    pub fn new() -> Self {
        Self { history: History::new(), ..Self::default() }
    }

    /// Keeps the edits to come in files of this folder until they are saved. Call it before the first edit.
    pub fn keep_journal(&mut self, folder: &Path) {
        self.journal = Some(Journal::new(folder));
    }

    /// The document.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Undo and redo stacks.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// The project file, once there is one.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Whether there is anything that was not saved.
    pub fn is_modified(&self) -> bool {
        !self.history.is_saved()
    }

    /// Whether there are unsaved changes that the next run can recover.
    pub fn keeps_changes(&self) -> bool {
        let journal = self.journal.as_ref().filter(|_| self.is_modified() && !self.journal_fails);
        journal.is_some_and(|journal| journal.path().is_some())
    }

    /// Where unsaved changes are kept, once there are any.
    pub fn journal_path(&self) -> Option<&Path> {
        self.journal.as_ref().and_then(Journal::path)
    }

    /// Why edits are not kept, in words; once for each time that it begins.
    pub fn take_journal_fault(&mut self) -> Option<String> {
        self.journal_fault.take()
    }

    /// Applies an edit and notes how to undo it. Edits of one gesture become one step.
    ///
    /// # Errors
    /// When the edit does not fit the document or touches what is locked; the document stays as it was.
    pub fn push(&mut self, edit: Edit) -> Result<(), EditError> {
        if let Some(lock) = self.document.locked_against(&edit) {
            return Err(EditError::Locked(self.document.display_name(lock.into())));
        }
        let label = edit.describe(&self.document);
        let inverse = Arc::make_mut(&mut self.document).apply(edit.clone())?;
        self.was_applied(&edit);
        self.history.record(label, edit, inverse);
        Ok(())
    }

    /// Lets the document make an edit (which may take new ids) and applies it.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn edit_with<T>(&mut self, make: impl FnOnce(&mut Document) -> (T, Edit)) -> Result<T, EditError> {
        let (value, edit) = make(Arc::make_mut(&mut self.document));
        self.push(edit)?;
        Ok(value)
    }

    /// Ends a gesture: the next edit starts a step of its own.
    pub fn end_gesture(&mut self) {
        self.history.end_gesture();
    }

    /// Takes the open gesture back.
    pub fn cancel_gesture(&mut self) {
        if let Some(step) = self.history.cancel_gesture()
            && let Err(error) = self.apply_back(step.edit)
        {
            tracing::error!("taking a gesture back failed: {error}");
        }
    }

    /// Undoes the newest step; says what was undone.
    pub fn undo(&mut self) -> Option<String> {
        let step = self.history.take_undo()?;
        match self.apply_back(step.edit.clone()) {
            Ok(redo) => self.history.put_redo(&step, redo),
            Err(error) => tracing::error!("undo of '{}' failed: {error}", step.label),
        }
        Some(step.label)
    }

    /// Does the step undone last again; says what was done.
    pub fn redo(&mut self) -> Option<String> {
        let step = self.history.take_redo()?;
        match self.apply_back(step.edit.clone()) {
            Ok(undo) => self.history.put_undo(&step, undo),
            Err(error) => tracing::error!("redo of '{}' failed: {error}", step.label),
        }
        Some(step.label)
    }

    fn apply_back(&mut self, edit: Edit) -> Result<Edit, EditError> {
        let inverse = Arc::make_mut(&mut self.document).apply_back(edit.clone())?;
        self.was_applied(&edit);
        Ok(inverse)
    }

    fn was_applied(&mut self, edit: &Edit) {
        self.picture_revision += u64::from(edit.changes_picture());
        let Some(journal) = &mut self.journal else { return };
        let kept = journal.append(edit, &self.document, &self.meta);
        self.note_kept(kept);
    }

    /// Takes over what another project keeps of things that came from there ([`ProjectMeta::keep_of`]). No edit says that: the
    /// journal gets the whole scene.
    pub(crate) fn keep_of(&mut self, other: &ProjectMeta, id: impl Fn(u64) -> Option<u64>) {
        let before = self.meta.clone();
        self.meta.keep_of(other, id);
        if let Some(journal) = self.journal.as_mut().filter(|_| self.meta != before) {
            let kept = journal.append_scene(&self.document, &self.meta);
            self.note_kept(kept);
        }
    }

    /// Tells of a journal that cannot be written, once.
    fn note_kept(&mut self, kept: std::io::Result<()>) {
        if let Err(error) = &kept
            && !self.journal_fails
        {
            let message =
                format!("Unsaved changes are not kept at the moment, should the program end: {error}");
            tracing::error!("{message}");
            self.journal_fault = Some(message);
        }
        self.journal_fails = kept.is_err();
    }

    /// Puts a project that was read in the place of this document. The history starts anew, and what the journal held is
    /// removed.
    pub fn open(&mut self, path: PathBuf, project: Project) {
        if let Some(journal) = &mut self.journal {
            journal.opened(&path, project.file, !project.outside.is_empty());
        }
        self.put(project, Some(path));
    }

    /// Puts a document without a file in the place of this one, as [`Self::open`].
    pub fn open_unsaved(&mut self, document: Document) {
        if let Some(journal) = &mut self.journal {
            journal.unsaved();
        }
        self.put(Project { document, ..Project::default() }, None);
    }

    /// Whether the project names files outside of its folder that were not read.
    pub fn has_refused(&self) -> bool {
        self.refused
    }

    fn put(&mut self, project: Project, path: Option<PathBuf>) {
        self.refused = !project.outside.is_empty();
        self.known_file = project.file;
        self.document = Arc::new(project.document);
        self.meta = project.meta;
        self.path = path;
        self.history.clear();
        self.picture_revision += 1;
    }

    /// Puts a recovered document in the place of this one, with the steps since its last save; its journal goes on, and what
    /// the one of this document held is removed.
    pub fn recover(&mut self, recovered: Recovered) {
        let Recovered { project, path, base_is_saved, steps, journal } = recovered;
        self.discard_journal();
        self.put(project, path);
        for step in steps {
            self.history.record(step.label, step.edit, step.inverse);
        }
        self.history.end_gesture();
        if !base_is_saved {
            self.history.mark_unsaved();
        }
        self.journal = Some(journal);
    }

    /// Removes what the journal holds, as when the owner of the changes does not want them.
    pub fn discard_journal(&mut self) {
        if let Some(journal) = &mut self.journal {
            journal.discard();
        }
    }

    /// Where the last save has put a file that somebody else had saved meanwhile; once.
    pub fn take_set_aside(&mut self) -> Option<PathBuf> {
        self.set_aside.take()
    }

    /// The project names files outside of its folder that were not read: it gets no permission by being saved.
    pub fn note_refused(&mut self) {
        self.refused = true;
    }

    /// Saves the project; what the journal held is removed. A file that is another one than was read or written last is kept
    /// under a name of its own.
    ///
    /// # Errors
    /// When the file cannot be written; the old one stays, and so does the journal.
    pub fn save(&mut self, path: &Path) -> Result<(), ProjectError> {
        if self.path.as_deref() == Some(path) {
            self.set_aside = keep_if_changed(path, self.known_file)?;
        }
        let file = Project::save(path, &self.document, &self.meta)?;
        self.known_file = file;
        self.path = Some(path.to_owned());
        self.history.mark_saved();
        if let Some(journal) = &mut self.journal {
            journal.saved(path, file, &self.document);
        }
        Ok(())
    }
}
