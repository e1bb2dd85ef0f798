//! Texts of shaders that were typed and not saved, kept for the next start like unsaved edits of a scene. Enters: the texts, after
//! every frame. Leaves: a file beside the journals while there are any, and what processes that have died left there.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use crate::whole_file;

/// Ending of a file with texts, and of the one beside it that is locked while its process lives.
const ENDING: &str = "typed";
const LOCK_ENDING: &str = "typed-lock";

/// Texts by file, and the folder of the shaders that they belong to.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Typed {
    /// Absolute.
    pub folder: PathBuf,
    /// By path in the folder.
    pub texts: BTreeMap<String, String>,
}

/// Keeps the texts of this process. Dropping it leaves them behind, as dying does.
pub struct Keeper {
    last: Typed,
    messages: Option<Sender<Message>>,
    thread: Option<JoinHandle<()>>,
}

enum Message {
    Keep(Typed),
    /// Their texts are among those that are kept now.
    Remove(LeftTyped),
}

/// Texts that a process has left behind. While this lives no other process sees them.
#[derive(Debug)]
pub struct LeftTyped {
    path: PathBuf,
    _lock: File,
    /// What they are.
    pub typed: Typed,
}

impl Keeper {
    /// Keeps texts in a folder that is made when it is needed.
    ///
    /// # Errors
    /// When there can be no thread that writes.
    pub fn start(folder: &Path) -> std::io::Result<Self> {
        let (messages, inbox) = channel();
        let folder = folder.to_owned();
        let thread = std::thread::Builder::new().name("typed texts".to_owned());
        let thread = thread.spawn(move || write(&folder, &inbox))?;
        Ok(Self { last: Typed::default(), messages: Some(messages), thread: Some(thread) })
    }

    /// Keeps these texts from now on; without any nothing is kept. Costs a comparison where nothing has changed; the disk is
    /// written by another thread.
    pub fn keep(&mut self, typed: Typed) {
        if typed.texts != self.last.texts || typed.folder != self.last.folder {
            self.last = typed.clone();
            self.send(Message::Keep(typed));
        }
    }

    /// Removes what was left behind, once what is kept has reached the disk.
    pub fn remove(&self, left: LeftTyped) {
        self.send(Message::Remove(left));
    }

    fn send(&self, message: Message) {
        if let Some(messages) = &self.messages {
            // The thread lives as long as this does.
            let _ = messages.send(message);
        }
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            // It never panics, and nothing could be done about it.
            let _ = thread.join();
        }
    }
}

/// Writes what is to be kept, of several the newest alone.
fn write(folder: &Path, inbox: &Receiver<Message>) {
    let mut own: Option<(PathBuf, File)> = None;
    let mut is_kept = true;
    while let Ok(first) = inbox.recv() {
        let (mut newest, mut removed) = (None, Vec::new());
        for message in std::iter::once(first).chain(inbox.try_iter()) {
            match message {
                Message::Keep(typed) => newest = Some(typed),
                Message::Remove(left) => removed.push(left),
            }
        }
        if let Some(typed) = newest {
            let kept = keep(folder, &mut own, &typed);
            is_kept = kept.is_ok();
            if let Err(error) = kept {
                tracing::warn!(
                    "{}: texts of shaders that are not saved are not kept: {error}",
                    folder.display()
                );
            }
        }
        if is_kept {
            removed.iter().for_each(|left| remove(&left.path));
        }
    }
}

fn keep(folder: &Path, own: &mut Option<(PathBuf, File)>, typed: &Typed) -> std::io::Result<()> {
    if typed.texts.is_empty() {
        if let Some((path, _)) = own.take() {
            remove(&path);
        }
        return Ok(());
    }
    let path = match own {
        Some((path, _)) => path,
        None => &own.insert(locked(folder)?).0,
    };
    whole_file::replace(path, |new| {
        let mut file = File::create(new)?;
        file.write_all(serde_json::to_string(typed).map_err(std::io::Error::other)?.as_bytes())?;
        file.sync_data()
    })
}

/// A name for a file of this process, and the lock of it.
fn locked(folder: &Path) -> std::io::Result<(PathBuf, File)> {
    std::fs::create_dir_all(folder)?;
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let path = folder.join(format!("{}-{}.{ENDING}", now.as_nanos(), std::process::id()));
    let lock = File::create_new(path.with_extension(LOCK_ENDING))?;
    lock.try_lock()?;
    Ok((path, lock))
}

fn remove(path: &Path) {
    for path in [path.to_owned(), path.with_extension(LOCK_ENDING)] {
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                tracing::warn!("{}: cannot be removed: {error}", path.display());
            }
            _ => {}
        }
    }
}

/// What processes that have died have left in a folder, newest first, and whether there are files of others that are alive or just
/// ending. What cannot be read is left alone and told of in the log.
pub fn survey(folder: &Path) -> (Vec<LeftTyped>, bool) {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut paths: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|ending| ending == ENDING)).collect();
    paths.sort();
    let (mut found, mut any_held) = (Vec::new(), false);
    for path in paths.into_iter().rev() {
        match look(&path) {
            Ok(Some(left)) => found.push(left),
            Ok(None) => any_held = true,
            Err(error) => {
                tracing::warn!("{}: texts that were left behind cannot be read: {error}", path.display())
            }
        }
    }
    (found, any_held)
}

/// `None`: its process is alive.
fn look(path: &Path) -> std::io::Result<Option<LeftTyped>> {
    let lock = path.with_extension(LOCK_ENDING);
    let lock = OpenOptions::new().write(true).create(true).truncate(false).open(lock)?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Ok(None),
        Err(TryLockError::Error(error)) => return Err(error),
    }
    let typed = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    Ok(Some(LeftTyped { path: path.to_owned(), _lock: lock, typed }))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn texts_outlive_their_process_and_are_removed_once_they_are_kept_again() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("typed");
        let typed = |text: &str| Typed {
            folder: PathBuf::from("/shaders"),
            texts: BTreeMap::from([("a.comp".to_owned(), text.to_owned())]),
        };
        let mut keeper = Keeper::start(&folder).unwrap();
        keeper.keep(Typed::default());
        for text in ["a", "ab", "abc"] {
            keeper.keep(typed(text));
        }
        let is_alive = || match survey(&folder) {
            (left, any_held) if left.is_empty() => any_held,
            (left, _) => panic!("its process is alive: {left:?}"),
        };
        while !is_alive() {
            std::thread::yield_now();
        }
        drop(keeper);

        let mut again = Keeper::start(&folder).unwrap();
        let (mut left, any_held) = survey(&folder);
        assert!(!any_held && left.len() == 1);
        let left = left.remove(0);
        assert_eq!(left.typed, typed("abc"));
        assert!(survey(&folder).1, "nobody else sees them");
        again.keep(left.typed.clone());
        again.remove(left);
        drop(again);
        let (left, _) = survey(&folder);
        assert_eq!(left.iter().map(|left| &left.typed).collect::<Vec<_>>(), [&typed("abc")]);
        drop(left);

        // Saved: nothing is left.
        let mut last = Keeper::start(&folder).unwrap();
        survey(&folder).0.into_iter().for_each(|left| last.remove(left));
        last.keep(typed("d"));
        last.keep(Typed { texts: BTreeMap::new(), ..typed("") });
        drop(last);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
    }
}
