//! The journal: what was done since the last save, so that a process that dies loses at most its last edit.
//! In: every edit that was applied. Out: a file of the program's own folder, one line an edit, locked while the process
//! lives. What becomes of a file that was left behind is in `journal/left_behind.rs`, of one that is held in `journal/held.rs`.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use super::paths::absolute_text;
use super::{Fingerprint, ProjectMeta, write};
use crate::document::Document;
use crate::edit::Edit;

mod entry;
mod held;
mod left_behind;

use entry::{Base, Entry, line_of};
pub use held::HeldJournal;
pub use left_behind::{JournalError, LeftBehind, Recovered, RecoveredStep};

/// Ending of a journal's name.
const ENDING: &str = "journal";
/// Ending while a file has no first line and no lock yet.
const NEW_ENDING: &str = "journal-new";
/// A journal of this size begins anew with the whole scene.
const MOST_BYTES: u64 = 256 << 20;
/// How long an edit may stay in the kernel, which outlives the process, but no loss of power.
const SYNC_AFTER: Duration = Duration::from_secs(1);

/// Keeps the edits of one open document. There is a file only while something is not saved; dropping the journal leaves it
/// behind, as dying does.
#[derive(Debug)]
pub struct Journal {
    folder: PathBuf,
    project: Option<PathBuf>,
    /// The project names files outside of its folder that were not read.
    refused: bool,
    /// What the edits to come follow; `None`: only the scene itself says it.
    base: Option<Base>,
    open: Option<OpenFile>,
    /// Something is missing in the file: only the whole scene can go on with it.
    is_torn: bool,
}

#[derive(Debug)]
struct OpenFile {
    path: PathBuf,
    file: File,
    /// Bytes that are whole lines.
    len: u64,
    sync: Sync,
}

/// The thread that brings edits to the disk. It holds the file, and so its lock, too: dropping this waits for its end.
#[derive(Debug)]
struct Sync {
    edits: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Sync {
    fn start(file: File, folder: Option<PathBuf>) -> io::Result<Self> {
        let (edits, received) = channel();
        let thread = std::thread::Builder::new()
            .name("journal".to_owned())
            .spawn(move || keep_durable(&file, folder.as_deref(), &received))?;
        Ok(Self { edits: Some(edits), thread: Some(thread) })
    }

    fn soon(&self) {
        if let Some(edits) = &self.edits {
            // The thread lives as long as this does.
            let _ = edits.send(());
        }
    }
}

impl Drop for Sync {
    fn drop(&mut self) {
        self.edits = None;
        if let Some(thread) = self.thread.take() {
            // It never panics, and nothing could be done about it.
            let _ = thread.join();
        }
    }
}

impl Journal {
    /// A journal of a document without a file, in a folder that is made when it is needed.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            project: None,
            refused: false,
            base: None,
            open: None,
            is_torn: false,
        }
    }

    /// The document is what this project file says; `refused`: without what it names outside of its folder. What was kept is
    /// removed.
    pub fn opened(&mut self, project: &Path, file: Fingerprint, refused: bool) {
        self.refused = refused;
        self.begin_anew(Some(project), Some(Base { file, left_out: Vec::new() }));
    }

    /// The document was saved as this project file. What was kept is removed.
    pub fn saved(&mut self, project: &Path, file: Fingerprint, document: &Document) {
        let left_out = write::left_out(document);
        self.begin_anew(Some(project), Some(Base { file, left_out }));
    }

    /// The document is another one, without a file. What was kept is removed.
    pub fn unsaved(&mut self) {
        self.refused = false;
        self.begin_anew(None, None);
    }

    fn begin_anew(&mut self, project: Option<&Path>, base: Option<Base>) {
        if let Some(open) = self.open.take() {
            remove(&open.path);
        }
        self.project = project.map(|path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned()));
        self.base = base;
        self.is_torn = false;
    }

    /// Where the edits since the last save are kept, once there is one.
    pub fn path(&self) -> Option<&Path> {
        self.open.as_ref().map(|open| open.path.as_path())
    }

    /// Keeps an edit that was applied. When this returns, the kernel has it. Costs as much as the edit is large; the first
    /// edit of a scene without a file, and what no edit can say, cost as much as the scene.
    ///
    /// # Errors
    /// When it cannot be written. The next edit then writes the whole scene, so that nothing but time is lost.
    pub fn append(&mut self, edit: &Edit, document: &Document, meta: &ProjectMeta) -> io::Result<()> {
        let kept = self.keep(edit, document, meta);
        self.is_torn = kept.is_err();
        kept
    }

    fn keep(&mut self, edit: &Edit, document: &Document, meta: &ProjectMeta) -> io::Result<()> {
        let entry = Entry::Edit { next_id: document.next_id(), edit: std::borrow::Cow::Borrowed(edit) };
        let has_base = self.open.is_some() || self.base.is_some();
        let line = if has_base && !self.is_torn { line_of(&entry).ok() } else { None };
        match line {
            Some(line) if self.open.as_ref().is_none_or(|open| open.len < MOST_BYTES) => {
                if self.open.is_none() {
                    self.open = Some(self.create()?);
                }
                self.open.as_mut().map_or(Ok(()), |open| open.write(&line))
            }
            _ => self.keep_scene(document, meta),
        }
    }

    /// Puts the whole scene into a new file, and only then removes the old one.
    fn keep_scene(&mut self, document: &Document, meta: &ProjectMeta) -> io::Result<()> {
        let mut open = self.create()?;
        let project = write::file_of(absolute_text, document, meta);
        let entry = Entry::Scene { project: Box::new(project), left_out: write::left_out(document) };
        let written = line_of(&entry).map_err(io::Error::other).and_then(|line| open.write(&line));
        if written.is_err() {
            remove(&open.path);
        } else if let Some(old) = self.open.replace(open) {
            remove(&old.path);
        }
        written
    }

    /// Keeps the whole scene, for a change that no edit says.
    ///
    /// # Errors
    /// As [`Self::append`].
    pub fn append_scene(&mut self, document: &Document, meta: &ProjectMeta) -> io::Result<()> {
        let kept = self.keep_scene(document, meta);
        self.is_torn = kept.is_err();
        kept
    }

    /// Removes what was kept: it is saved, or not wanted any more.
    pub fn discard(&mut self) {
        if let Some(open) = self.open.take() {
            remove(&open.path);
            self.is_torn = true;
        }
    }

    /// Goes on with a file that was left behind, after its last whole line.
    fn resume(
        file: File,
        path: &Path,
        len: u64,
        project: Option<PathBuf>,
        refused: bool,
    ) -> io::Result<Self> {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let open = OpenFile::resume(file, path, len)?;
        Ok(Self { folder, project, refused, base: None, open: Some(open), is_torn: false })
    }

    /// Makes the file. It gets its name once it has a lock and a first line: nobody takes it for one that was left behind.
    fn create(&self) -> io::Result<OpenFile> {
        fs::create_dir_all(&self.folder)?;
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let path = self.folder.join(format!("{}-{}.{ENDING}", now.as_nanos(), std::process::id()));
        let temporary = path.with_extension(NEW_ENDING);
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(&temporary)?;
        let begin = Entry::Begin {
            journal: entry::VERSION,
            schema: super::SCHEMA_VERSION,
            project: self.project.clone(),
            refused: self.refused,
            base: self.base.clone(),
        };
        let made = (|| {
            file.try_lock()?;
            let mut open = OpenFile::resume(file, &temporary, 0)?;
            open.write(&line_of(&begin).map_err(io::Error::other)?)?;
            fs::rename(&temporary, &path)?;
            Ok(OpenFile { path, ..open })
        })();
        if made.is_err() {
            remove(&temporary);
        }
        made
    }
}

impl OpenFile {
    fn resume(mut file: File, path: &Path, len: u64) -> io::Result<Self> {
        file.set_len(len)?;
        file.seek(SeekFrom::Start(len))?;
        let sync = Sync::start(file.try_clone()?, path.parent().map(Path::to_owned))?;
        Ok(Self { path: path.to_owned(), file, len, sync })
    }

    /// One call to the kernel; what it has taken of a line that failed is taken back.
    fn write(&mut self, line: &[u8]) -> io::Result<()> {
        if let Err(error) = self.file.write_all(line) {
            self.file.set_len(self.len)?;
            self.file.seek(SeekFrom::Start(self.len))?;
            return Err(error);
        }
        self.len += line.len() as u64;
        self.sync.soon();
        Ok(())
    }
}

/// Brings edits to the disk a little later, off the thread that edits. Ends with the journal: what the kernel has
/// outlives the process.
fn keep_durable(file: &File, folder: Option<&Path>, edits: &Receiver<()>) {
    let mut folder = folder.and_then(|folder| File::open(folder).ok());
    while edits.recv().is_ok() {
        let due = Instant::now() + SYNC_AFTER;
        loop {
            match edits.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Ok(()) => {}
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
        let synced = file.sync_data().and_then(|()| folder.take().map_or(Ok(()), |folder| folder.sync_all()));
        if let Err(error) = synced {
            tracing::warn!("the journal of edits does not reach the disk: {error}");
        }
    }
}

fn remove(path: &Path) {
    if let Err(error) = fs::remove_file(path) {
        tracing::warn!("{}: cannot be removed: {error}", path.display());
    }
}
