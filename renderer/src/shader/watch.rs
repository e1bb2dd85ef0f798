//! Notices that something below a folder was saved. Enters: a folder. Leaves: calls, from another thread, with the files and folders
//! that may have changed; none: any may have.
//! Where the system's watcher cannot start, the folder is looked at again and again. The system tells of the folder that was there at
//! the start, not of another one in its place, nor where a link leads to: that is looked at here.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use notify::event::{AccessKind, AccessMode, ModifyKind};
use notify::{Config, EventKind, PollWatcher, RecommendedWatcher, RecursiveMode, Watcher};

use super::library::lock;

/// How often a folder is looked at where the system does not tell of changes, and whether it is still the same one.
const POLL: Duration = Duration::from_millis(500);

/// How changes are noticed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Watching {
    /// The system tells of them.
    Told,
    /// The files are looked at twice a second, for this reason.
    Polled(String),
    /// Not at all, for this reason.
    Off(String),
}

/// Watches until it is dropped.
pub(super) struct Watch {
    how: Arc<Mutex<Watching>>,
    signals: Sender<Signal>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread is told that looks whether the folder is still the same.
enum Signal {
    /// Something came, went or was renamed; whether it was the folder itself.
    Renamed {
        folder: bool,
    },
    /// The system does not tell of everything any more, for this reason.
    Failed(String),
    End,
}

type Watched = Option<Box<dyn Watcher + Send + Sync>>;

/// The thread that looks whether the folder is still the same.
struct Guard<F> {
    folder: PathBuf,
    changed: F,
    how: Arc<Mutex<Watching>>,
    signals: Sender<Signal>,
    places: Places,
    /// Links to files, and what they lead to.
    files: Files,
    watcher: Watched,
}

impl Watch {
    pub(super) fn start(
        folder: &Path,
        changed: impl Fn(Vec<PathBuf>) + Clone + Send + Sync + 'static,
    ) -> Self {
        let (signals, inbox) = channel();
        let (places, files) = places(folder);
        let (how, watcher) = watched(folder, &changed, &signals);
        let how = Arc::new(Mutex::new(how));
        let (folder, shared) = (folder.to_owned(), Arc::clone(&how));
        let guard = Guard { folder, changed, how: shared, signals: signals.clone(), places, files, watcher };
        let thread = std::thread::Builder::new().name("shader folder".to_owned());
        let thread = thread.spawn(move || guard.run(&inbox));
        let thread = thread.inspect_err(|error| tracing::warn!("shaders are not watched: {error}")).ok();
        Self { how, signals, thread }
    }

    pub(super) fn how(&self) -> Watching {
        lock(&self.how).clone()
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        // Without a thread nobody hears it.
        let _ = self.signals.send(Signal::End);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl<F: Fn(Vec<PathBuf>) + Clone + Send + Sync + 'static> Guard<F> {
    fn run(mut self, inbox: &Receiver<Signal>) {
        loop {
            let first = inbox.recv_timeout(POLL);
            let mut is_another = matches!(first, Err(RecvTimeoutError::Timeout))
                && self.places.iter().any(|(place, before)| identity(place) != *before);
            let mut is_due = false;
            for signal in first.into_iter().chain(inbox.try_iter()) {
                match signal {
                    Signal::Renamed { folder } => (is_another, is_due) = (is_another || folder, true),
                    Signal::Failed(reason) => self.poll(reason),
                    Signal::End => return,
                }
            }
            let (places, files) = match is_due {
                true => places(&self.folder),
                false => (self.places.clone(), self.files.keys().map(|l| (l.clone(), stamp(l))).collect()),
            };
            if is_another || self.places != places {
                self.watch_again();
            } else {
                self.look_behind_links(files);
            }
        }
    }

    /// Where a link leads to a file, the system tells of the link alone. `now`: all such links.
    fn look_behind_links(&mut self, now: Files) {
        let is_another =
            |(link, stamp): (&PathBuf, &Stamp)| self.files.get(link).is_some_and(|old| old != stamp);
        let changed: Vec<PathBuf> =
            now.iter().filter(|entry| is_another(*entry)).map(|(link, _)| link.clone()).collect();
        self.files = now;
        if !changed.is_empty() {
            (self.changed)(changed);
        }
    }

    /// Looks at the files again and again from now on.
    fn poll(&mut self, reason: String) {
        if *lock(&self.how) == Watching::Told {
            let handler = handler(self.folder.clone(), self.changed.clone(), self.signals.clone());
            (*lock(&self.how), self.watcher) = polled(&self.folder, handler, reason);
        }
    }

    /// Another folder is in the place of the one that was watched, or none, or a link leads elsewhere.
    fn watch_again(&mut self) {
        let folder = self.folder.display();
        (self.places, self.files) = places(&self.folder);
        if self.places.values().next().is_some_and(Option::is_some) {
            let (how, watcher) = watched(&self.folder, &self.changed, &self.signals);
            tracing::warn!("{folder}: another folder is there now, or below it; it is watched from now on");
            (*lock(&self.how), self.watcher) = (how, watcher);
        } else {
            tracing::warn!(
                "{folder}: the folder is not there any more; it is watched again as soon as it is"
            );
            (*lock(&self.how), self.watcher) = (Watching::Off(NOT_THERE.to_owned()), None);
        }
        (self.changed)(Vec::new());
    }
}

/// Why nothing is noticed while there is no folder.
const NOT_THERE: &str = "the folder is not there; it is watched again as soon as it is";

/// What tells a folder from another one of the same path: where it really is, when it was made, and its number in its file system.
type Identity = (PathBuf, Option<SystemTime>, u64);
/// The watched folder first, then every link to a folder below it, in order of their paths.
type Places = BTreeMap<PathBuf, Option<Identity>>;

fn identity(folder: &Path) -> Option<Identity> {
    let about = std::fs::metadata(folder).ok().filter(std::fs::Metadata::is_dir)?;
    Some((folder.canonicalize().ok()?, about.created().ok(), number_of(&about)))
}

#[cfg(unix)]
fn number_of(about: &std::fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(about)
}

#[cfg(not(unix))]
fn number_of(_: &std::fs::Metadata) -> u64 {
    0
}

/// What a link to a file leads to: where that is, when it was written, and its length.
type Stamp = Option<(PathBuf, SystemTime, u64)>;
type Files = BTreeMap<PathBuf, Stamp>;

fn stamp(link: &Path) -> Stamp {
    let about = std::fs::metadata(link).ok().filter(std::fs::Metadata::is_file)?;
    Some((link.canonicalize().ok()?, about.modified().ok()?, about.len()))
}

/// The folder and the links to folders below it, and the links to files in all of them.
fn places(folder: &Path) -> (Places, Files) {
    let mut places = Places::from([(folder.to_owned(), identity(folder))]);
    let mut files = Files::new();
    // By where they really are, as links may lead in a circle.
    let mut seen = BTreeSet::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(next) = waiting.pop() {
        if !next.canonicalize().is_ok_and(|real| seen.insert(real)) {
            continue;
        }
        for entry in std::fs::read_dir(&next).into_iter().flatten().flatten() {
            let (path, kind) = (entry.path(), entry.file_type().ok());
            let is_link = kind.is_some_and(|kind| kind.is_symlink());
            if is_link && path.is_dir() {
                places.insert(path.clone(), identity(&path));
            } else if is_link && path.is_file() {
                files.insert(path.clone(), stamp(&path));
            }
            if kind.is_some_and(|kind| kind.is_dir()) || places.contains_key(&path) {
                waiting.push(path);
            }
        }
    }
    (places, files)
}

/// Starts to watch; how, and what does.
fn watched(
    folder: &Path,
    changed: &(impl Fn(Vec<PathBuf>) + Clone + Send + 'static),
    signals: &Sender<Signal>,
) -> (Watching, Watched) {
    let handler = || handler(folder.to_owned(), changed.clone(), signals.clone());
    let told = || -> notify::Result<RecommendedWatcher> {
        let mut watcher = RecommendedWatcher::new(handler(), Config::default())?;
        watcher.watch(folder, RecursiveMode::Recursive)?;
        Ok(watcher)
    };
    match told() {
        Ok(watcher) => (Watching::Told, Some(Box::new(watcher))),
        Err(error) => polled(folder, handler(), error.to_string()),
    }
}

/// `reason`: why the system does not tell.
fn polled(folder: &Path, handler: impl notify::EventHandler, reason: String) -> (Watching, Watched) {
    let polled = || -> notify::Result<PollWatcher> {
        let config = Config::default().with_poll_interval(POLL).with_compare_contents(true);
        let mut watcher = PollWatcher::new(handler, config)?;
        watcher.watch(folder, RecursiveMode::Recursive)?;
        Ok(watcher)
    };
    match polled() {
        Ok(watcher) => {
            tracing::warn!("{}: looked at twice a second for changes: {reason}", folder.display());
            (Watching::Polled(reason), Some(Box::new(watcher)))
        }
        Err(error) => {
            tracing::warn!("{}: changes are not noticed: {error}", folder.display());
            (Watching::Off(error.to_string()), None)
        }
    }
}

/// Passes on what may have changed a file, that a file was read does not, and tells what was renamed.
fn handler(
    folder: PathBuf,
    changed: impl Fn(Vec<PathBuf>) + Send + 'static,
    signals: Sender<Signal>,
) -> impl Fn(notify::Result<notify::Event>) + Send + 'static {
    move |event| match event {
        Ok(event) if matches!(event.kind, EventKind::Access(kind) if !writes(kind)) => {}
        Ok(event) => {
            let is_name = EventKind::is_create(&event.kind)
                || EventKind::is_remove(&event.kind)
                || matches!(event.kind, EventKind::Modify(ModifyKind::Name(_)));
            if is_name {
                // Nobody listens any more at the end.
                let _ = signals.send(Signal::Renamed { folder: event.paths.contains(&folder) });
            }
            changed(event.paths);
        }
        Err(error) => {
            let _ = signals.send(Signal::Failed(error.to_string()));
            changed(Vec::new());
        }
    }
}

fn writes(kind: AccessKind) -> bool {
    matches!(kind, AccessKind::Close(AccessMode::Write))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use std::fs;

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(60);

    #[test]
    fn changes_are_noticed_told_or_polled_and_reading_is_none() {
        for is_polled in [false, true] {
            let folder = tempfile::tempdir().unwrap();
            let folder = folder.path();
            fs::create_dir_all(folder.join("lib")).unwrap();
            let file = folder.join("lib/a.glsl");
            fs::write(&file, "1").unwrap();
            let (sender, changes) = channel();
            let changed = move |_| {
                let _ = sender.send(());
            };
            let (signals, _inbox) = channel();
            let (how, _watcher) = match is_polled {
                true => {
                    let handler = handler(folder.to_owned(), changed, signals);
                    polled(folder, handler, "no more of them".to_owned())
                }
                false => watched(folder, &changed, &signals),
            };
            assert_eq!(matches!(how, Watching::Polled(_)), is_polled);
            fs::read(&file).unwrap();
            assert!(changes.recv_timeout(POLL * 2).is_err(), "nothing was written");
            fs::write(&file, "2").unwrap();
            changes.recv_timeout(PATIENCE).unwrap();
        }
    }

    /// Writes a file until that is noticed, as it may come before the folder is watched again.
    fn is_noticed(file: &Path, changes: &Receiver<Vec<PathBuf>>) -> bool {
        let start = std::time::Instant::now();
        while start.elapsed() < PATIENCE {
            fs::write(file, "1").unwrap();
            while let Ok(files) = changes.recv_timeout(Duration::from_millis(100)) {
                if files.iter().any(|changed| changed == file) {
                    return true;
                }
            }
        }
        false
    }

    #[cfg(unix)]
    #[test]
    fn what_a_link_leads_to_is_watched_and_a_watcher_that_fails_is_replaced() {
        let above = tempfile::tempdir().unwrap();
        let (folder, outside) = (above.path().join("shaders"), above.path().join("outside.glsl"));
        fs::create_dir(&folder).unwrap();
        fs::write(&outside, "1").unwrap();
        let link = folder.join("a.glsl");
        std::os::unix::fs::symlink(&outside, &link).unwrap();
        let (sender, changes) = channel();
        let watch = Watch::start(&folder, move |files| {
            let _ = sender.send(files);
        });
        fs::write(&outside, "22").unwrap();
        assert_eq!(changes.recv_timeout(PATIENCE).unwrap(), [link]);
        watch.signals.send(Signal::Failed("no more of them".to_owned())).unwrap();
        while watch.how() == Watching::Told {
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(is_noticed(&folder.join("b.glsl"), &changes), "{:?}", watch.how());
    }

    #[cfg(unix)]
    #[test]
    fn another_folder_in_the_place_of_the_watched_one_is_watched() {
        use std::os::unix::fs::symlink;
        let above = tempfile::tempdir().unwrap();
        let at = |name: &str| above.path().join(name);
        ["one", "two"].iter().for_each(|name| fs::create_dir_all(at(name)).unwrap());
        symlink(at("one"), at("shaders")).unwrap();
        let (sender, changes) = channel();
        let watch = Watch::start(&at("shaders"), move |files| {
            let _ = sender.send(files);
        });
        let file = at("shaders").join("a.glsl");
        let link = |to: &str, from: &str| {
            symlink(at(to), at("new")).unwrap();
            fs::rename(at("new"), at(from)).unwrap();
        };
        assert!(is_noticed(&file, &changes));
        link("two", "shaders");
        assert!(is_noticed(&file, &changes), "the link leads elsewhere");
        fs::remove_file(at("shaders")).unwrap();
        while watch.how() == Watching::Told {
            std::thread::sleep(Duration::from_millis(10));
        }
        fs::create_dir(at("shaders")).unwrap();
        assert!(is_noticed(&file, &changes), "it is there again");
        fs::rename(at("shaders"), at("old")).unwrap();
        fs::create_dir(at("shaders")).unwrap();
        assert!(is_noticed(&file, &changes), "it was renamed");
        fs::remove_dir_all(at("shaders")).unwrap();
        fs::create_dir(at("shaders")).unwrap();
        // Another name, as the old one was just removed.
        assert!(is_noticed(&at("shaders/c.glsl"), &changes), "it was removed and made again");
        assert_eq!(watch.how(), Watching::Told);
        for to in ["one", "two"] {
            link(to, "shaders/lib");
            assert!(is_noticed(&at("shaders/lib/b.glsl"), &changes), "a link below leads to {to}");
        }
    }
}
