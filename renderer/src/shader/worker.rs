//! The thread that makes pipelines anew when their shaders were edited, while frames go on with the old ones. Enters: hints that files
//! may have changed. Leaves: every pipeline that is concerned, or what is wrong; and what takes long.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::fault::ShaderFault;
use super::library::{Compiled, ShaderLibrary, lock};
use super::live::{Replaceable, Swap};
use super::reload::{Reload, Wake};
use super::sources::Source;
use crate::error::Result;

/// A program may save a file in several steps: so long must it have been quiet.
const QUIET: Duration = Duration::from_millis(4);
/// But no longer than this is waited.
const MOST_WAIT: Duration = Duration::from_millis(200);

/// From here on it is told that something is still being compiled.
const SLOW: Duration = Duration::from_secs(5);

/// What came of one change.
pub(super) struct Outcome {
    pub(super) reload: Reload,
    pub(super) noticed: Instant,
    pub(super) made: std::result::Result<Made, Vec<ShaderFault>>,
}

/// Stages and pipelines that are ready to be taken over.
#[derive(Default)]
pub(super) struct Made {
    pub(super) stages: Vec<Arc<Compiled>>,
    pub(super) swaps: Vec<Swap>,
    pub(super) fills_tables: bool,
}

/// What the thread is told.
pub(super) enum Hint {
    /// These files and folders may have changed; none: any.
    Look(Vec<PathBuf>),
    Stop,
}

/// What the thread remembers from one change to the next.
#[derive(Default)]
struct Memory {
    /// Texts as they were read last, by their path in the folder.
    texts: BTreeMap<String, String>,
    /// Main files that are not in use as they are: they are looked at again whatever has changed.
    refused: BTreeSet<String>,
}

/// The thread.
pub(super) struct Worker {
    pub(super) library: Arc<ShaderLibrary>,
    pub(super) hints: Receiver<Hint>,
    pub(super) outcomes: Sender<Outcome>,
    /// Outcomes that were not taken over yet.
    pub(super) waiting: Arc<AtomicUsize>,
    pub(super) running: Arc<Running>,
    pub(super) wake: Wake,
}

/// What is being compiled.
#[derive(Default)]
pub(super) struct Running {
    is_any: AtomicBool,
    /// Main files, and since when.
    items: Mutex<Vec<(String, Instant)>>,
}

impl Running {
    pub(super) fn is_any(&self) -> bool {
        self.is_any.load(Ordering::Relaxed)
    }

    /// What has been compiled for long, with seconds.
    pub(super) fn slow(&self) -> Vec<(String, u64)> {
        let items = lock(&self.items);
        let slow = items.iter().filter(|(_, since)| since.elapsed() >= SLOW);
        slow.map(|(name, since)| (name.clone(), since.elapsed().as_secs())).collect()
    }

    /// Does something that may take long.
    fn during<R>(&self, name: String, work: impl FnOnce() -> R) -> R {
        let item = (name, Instant::now());
        lock(&self.items).push(item.clone());
        let result = work();
        lock(&self.items).retain(|other| *other != item);
        result
    }

    /// Says in the log, and to who waits for an outcome, what takes long, until the other end of the channel is dropped.
    fn tell(&self, over: &Receiver<()>, wake: &Wake) {
        let mut wait = SLOW;
        while over.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
            for (name, seconds) in self.slow() {
                tracing::warn!(
                    "{name} has been compiled for {seconds} s and is not ready; what is saved meanwhile waits"
                );
            }
            wake();
            wait *= 2;
        }
    }
}

impl Worker {
    pub(super) fn run(self) {
        let library = &*self.library;
        let mut memory = Memory::default();
        while let Ok(Hint::Look(files)) = self.hints.recv() {
            let noticed = Instant::now();
            let mut hinted = vec![files];
            loop {
                match self.hints.recv_timeout(QUIET) {
                    Ok(Hint::Look(files)) => hinted.push(files),
                    // Opened to be written, and its text is still to come.
                    Err(RecvTimeoutError::Timeout) if hinted.iter().flatten().any(|file| is_empty(file)) => {}
                    Err(RecvTimeoutError::Timeout) => break,
                    Ok(Hint::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                }
                if noticed.elapsed() >= MOST_WAIT {
                    break;
                }
            }
            let changed = names_of(library, &hinted);
            self.running.is_any.store(true, Ordering::Relaxed);
            let (running, wake) = (&*self.running, &self.wake);
            let outcome = std::thread::scope(|scope| {
                let (_ends_with_this, over) = channel();
                scope.spawn(move || running.tell(&over, wake));
                make_anew(library, running, noticed, changed.as_ref(), &mut memory)
            });
            self.running.is_any.store(false, Ordering::Relaxed);
            self.waiting.fetch_add(1, Ordering::Release);
            let is_wanted = self.outcomes.send(outcome).is_ok();
            (self.wake)();
            if !is_wanted {
                return;
            }
        }
    }
}

fn is_empty(file: &Path) -> bool {
    std::fs::metadata(file).is_ok_and(|about| about.is_file() && about.len() == 0)
}

/// The paths inside the folder; `None`: any file may have changed.
fn names_of(library: &ShaderLibrary, hinted: &[Vec<PathBuf>]) -> Option<BTreeSet<String>> {
    let folder = library.folder()?;
    let name = |path: &PathBuf| {
        let inside = path.strip_prefix(&folder).ok()?;
        let parts: Option<Vec<&str>> = inside.components().map(|part| part.as_os_str().to_str()).collect();
        // The folder itself stands for all that is in it.
        parts.filter(|parts| !parts.is_empty()).map(|parts| parts.join("/"))
    };
    let all_named = hinted.iter().all(|files| !files.is_empty());
    all_named.then(|| hinted.iter().flatten().map(name).collect()).flatten()
}

/// Whether a file is one of these, or in a folder that is.
fn is_among(file: &str, changed: &BTreeSet<String>) -> bool {
    std::iter::successors(Some(file), |path| Some(path.rsplit_once('/')?.0))
        .any(|path| changed.contains(path))
}

/// Compiles every stage whose text is another one, and makes the pipelines in use that have one of them.
fn make_anew(
    library: &ShaderLibrary,
    running: &Running,
    noticed: Instant,
    hinted: Option<&BTreeSet<String>>,
    memory: &mut Memory,
) -> Outcome {
    let since = |start: Instant| start.elapsed().as_secs_f64() * 1e3;
    let mut reload = Reload {
        files: Vec::new(),
        counts: [0; 2],
        read_ms: 0.0,
        compile_ms: 0.0,
        driver_ms: 0.0,
        total_ms: 0.0,
    };
    let mut faults = Vec::new();
    let Memory { texts, refused } = memory;
    match hinted {
        Some(files) => texts.retain(|file, _| !is_among(file, files)),
        None => texts.clear(),
    }
    let (mut changed_files, mut unread) = (BTreeSet::new(), BTreeSet::new());
    let mut changed = Vec::new();
    let sources = library.sources();
    let gone = sources.folder().filter(|folder| !folder.is_dir());
    let is_concerned = |stage: &Arc<Compiled>| {
        let Source { texts, missing, .. } = &stage.source;
        let holds = |changed: &BTreeSet<String>| {
            texts.keys().chain(missing.keys()).any(|file| is_among(file, changed))
        };
        refused.contains(stage.file()) || hinted.is_none_or(holds)
    };
    faults.extend(gone.map(|gone| {
        ShaderFault::whole(&gone.display().to_string(), "the folder of the shaders is not there")
    }));
    for stage in library.all_stages().into_iter().filter(|stage| gone.is_none() && is_concerned(stage)) {
        match sources.load_with(stage.file(), texts) {
            Ok(source) if source == stage.source => {}
            Ok(source) => {
                let before = &stage.source.texts;
                let differs = |(file, text): &(&String, &String)| before.get(*file) != Some(*text);
                changed_files.extend(source.texts.iter().filter(differs).map(|(file, _)| file.clone()));
                changed_files.extend(before.keys().filter(|file| !source.texts.contains_key(*file)).cloned());
                changed.push(source);
            }
            Err(error) => {
                faults.extend(ShaderFault::of_error(error));
                unread.insert(stage.file().to_owned());
            }
        }
    }
    *refused = changed.iter().map(|source| source.file.clone()).chain(unread).collect();
    reload.files = changed_files.into_iter().collect();
    reload.read_ms = since(noticed);
    let start = Instant::now();
    let compiled = in_parallel(changed, |source| {
        let name = source.file.clone();
        running.during(name, || Compiled::new(&library.device, source, &library.cache))
    });
    let mut stages = HashMap::new();
    for result in compiled {
        match result {
            Ok(stage) => drop(stages.insert(stage.file().to_owned(), Arc::new(stage))),
            Err(error) => faults.extend(ShaderFault::of_error(error)),
        }
    }
    reload.compile_ms = since(start);
    reload.counts[0] = stages.len();
    let start = Instant::now();
    let mut made = Made::default();
    if faults.is_empty() {
        let frame = library.device.recording();
        let all = library.all_live();
        let concerned = |live: &Arc<dyn Replaceable>| {
            live.owner().is_fresh(frame) && live.files().iter().any(|file| stages.contains_key(*file))
        };
        let live: Vec<_> = all.into_iter().filter(concerned).collect();
        made.fills_tables = live.iter().any(|live| live.owner().fills_tables);
        let stage = |file: &str| stages.get(file).cloned().map_or_else(|| library.stage(file), Ok);
        let prepare = |live: Arc<dyn Replaceable>| {
            let changed: Vec<&str> =
                live.files().iter().copied().filter(|file| stages.contains_key(*file)).collect();
            running.during(format!("{} (driver)", changed.join(", ")), || live.prepare(&stage))
        };
        for result in in_parallel(live, prepare) {
            match result {
                Ok(swap) => made.swaps.push(swap),
                Err(error) => faults.extend(ShaderFault::of_error(error)),
            }
        }
        reload.counts[1] = made.swaps.len();
    }
    reload.driver_ms = since(start);
    made.stages = stages.into_values().collect();
    let faults = ShaderFault::in_order(faults);
    if faults.is_empty() {
        refused.clear();
    }
    Outcome { reload, noticed, made: if faults.is_empty() { Ok(made) } else { Err(faults) } }
}

/// Does the same to several things at once, on as many threads as the machine has cores.
fn in_parallel<T: Send, R: Send>(items: Vec<T>, work: impl Fn(T) -> Result<R> + Sync) -> Vec<Result<R>> {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get).min(items.len());
    let items: Vec<Mutex<Option<T>>> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    let next = AtomicUsize::new(0);
    let run = || {
        let mut done = Vec::new();
        while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
            done.extend(lock(item).take().map(&work));
        }
        done
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(run)).collect();
        let mut done = run();
        for other in others {
            done.extend(other.join().unwrap_or_default());
        }
        done
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_stands_for_the_files_in_it() {
        let changed = BTreeSet::from(["lib".to_owned(), "passes/post/post.comp".to_owned()]);
        let is_among = |file: &str| super::is_among(file, &changed);
        assert!(is_among("lib/a.glsl") && is_among("lib/b/c.glsl") && is_among("passes/post/post.comp"));
        assert!(!is_among("library/a.glsl") && !is_among("passes/post/show.comp"));
    }

    #[test]
    fn what_takes_long_is_named_until_it_is_ready() {
        let running = Running::default();
        let start = Instant::now().checked_sub(SLOW).unwrap_or_else(Instant::now);
        lock(&running.items).push(("a.comp".to_owned(), start));
        running.during("b.comp".to_owned(), || {
            assert_eq!(running.slow(), [("a.comp".to_owned(), SLOW.as_secs())]);
            assert_eq!(lock(&running.items).len(), 2);
        });
        assert_eq!(lock(&running.items).len(), 1);
    }
}
