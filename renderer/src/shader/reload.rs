//! Makes pipelines anew when their shaders were edited, on a thread of its own, while frames go on with the old ones.
//! Enters: a hint that files may have changed. Leaves: either every pipeline that is concerned, or what is wrong.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::fault::ShaderFault;
use super::library::{Compiled, ShaderLibrary, lock};
use super::live::{Replaceable, Swap};
use super::watch::{Watch, Watching};
use crate::error::Result;

/// Called, on another thread, when there is something to take over.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// A program may save a file in several steps: so long must it have been quiet.
const QUIET: Duration = Duration::from_millis(4);
/// But no longer than this is waited.
const MOST_WAIT: Duration = Duration::from_millis(200);

/// One edit that was taken over.
#[derive(Clone, Debug, PartialEq)]
pub struct Reload {
    /// The files that had changed.
    pub files: Vec<String>,
    /// How many stages were compiled, and pipelines made.
    pub counts: [usize; 2],
    /// From the notice of the change to the last file read, all stages compiled, and all pipelines made, milliseconds.
    pub read_ms: f64,
    /// See `read_ms`.
    pub compile_ms: f64,
    /// See `read_ms`; what the driver takes.
    pub driver_ms: f64,
    /// From the notice of the change to the frame that shows it, milliseconds.
    pub total_ms: f64,
}

/// How it stands with the shaders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShaderStatus {
    /// How changes are noticed; `None`: the shaders are those of the binary.
    pub watching: Option<Watching>,
    /// Something is being compiled.
    pub compiling: bool,
    /// What is wrong in the files as they are; the picture is that of the files before.
    pub faults: Vec<ShaderFault>,
    /// Edits that were taken over, since the start.
    pub reloads: u64,
    /// Edits that were refused, since the start.
    pub refused: u64,
    /// The newest one.
    pub last: Option<Reload>,
}

/// What came of one change.
struct Outcome {
    reload: Reload,
    noticed: Instant,
    made: std::result::Result<Made, Vec<ShaderFault>>,
}

/// Stages and pipelines that are ready to be taken over.
#[derive(Default)]
struct Made {
    stages: Vec<Arc<Compiled>>,
    swaps: Vec<Swap>,
    fills_tables: bool,
}

/// What was taken over in a frame.
pub(crate) struct TakenOver {
    pub(crate) files: Vec<String>,
    /// What the tables hold was made by a shader that has changed.
    pub(crate) fills_tables: bool,
}

enum Hint {
    /// These files may have changed; none: any.
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

/// Watches the folder of a library.
pub(crate) struct Reloader {
    library: Arc<ShaderLibrary>,
    hints: Sender<Hint>,
    outcomes: Mutex<Receiver<Outcome>>,
    compiling: Arc<AtomicBool>,
    /// Outcomes that were not taken over yet.
    waiting: Arc<AtomicUsize>,
    status: ShaderStatus,
    worker: Option<JoinHandle<()>>,
    _watch: Watch,
}

impl Reloader {
    pub(crate) fn new(library: &Arc<ShaderLibrary>, wake: Wake) -> Option<Self> {
        let folder = library.folder()?;
        let (hints, inbox) = channel();
        let (outbox, outcomes) = channel();
        let (compiling, waiting): (Arc<AtomicBool>, Arc<AtomicUsize>) = Default::default();
        let done = {
            let waiting = Arc::clone(&waiting);
            move |outcome| {
                waiting.fetch_add(1, Ordering::Release);
                let sent = outbox.send(outcome).is_ok();
                wake();
                sent
            }
        };
        let worker = {
            let (library, compiling) = (Arc::clone(library), Arc::clone(&compiling));
            let work = move || work(&library, &inbox, &compiling, done);
            std::thread::Builder::new().name("shaders".to_owned()).spawn(work)
        };
        let worker = worker.inspect_err(|error| tracing::warn!("shaders are not reloaded: {error}")).ok()?;
        // What is there may differ from what is in use.
        let _ = hints.send(Hint::Look(Vec::new()));
        let look = hints.clone();
        let watch = Watch::start(&folder, move |files| {
            // Nobody looks any more at the end of the program.
            let _ = look.send(Hint::Look(files));
        });
        let status = ShaderStatus { watching: Some(watch.how().clone()), ..ShaderStatus::default() };
        let outcomes = Mutex::new(outcomes);
        Some(Self {
            library: Arc::clone(library),
            hints,
            outcomes,
            compiling,
            waiting,
            status,
            worker: Some(worker),
            _watch: watch,
        })
    }

    pub(crate) fn status(&self) -> ShaderStatus {
        let mut status =
            ShaderStatus { compiling: self.compiling.load(Ordering::Relaxed), ..self.status.clone() };
        status.faults.extend(self.library.held_faults());
        status
    }

    /// Whether something is being compiled.
    pub(crate) fn is_compiling(&self) -> bool {
        self.compiling.load(Ordering::Relaxed)
    }

    /// Whether there is something to take over.
    pub(crate) fn is_waiting(&self) -> bool {
        self.waiting.load(Ordering::Acquire) > 0
    }

    /// Puts what was made in the place of what was there. To be called between two frames.
    pub(crate) fn take_over(&mut self) -> Option<TakenOver> {
        let replaced = self.library.take_replaced();
        if !replaced.is_empty() {
            self.refuse(replaced);
        }
        let mut taken: Option<TakenOver> = None;
        let outcomes: Vec<Outcome> = lock(&self.outcomes).try_iter().collect();
        self.waiting.fetch_sub(outcomes.len(), Ordering::Release);
        for Outcome { mut reload, noticed, made } in outcomes {
            let Made { stages, swaps, fills_tables } = match made {
                Ok(made) => made,
                Err(faults) => {
                    self.refuse(faults);
                    continue;
                }
            };
            if !self.status.faults.is_empty() {
                self.status.faults.clear();
                tracing::info!("shaders: no errors any more");
            }
            if stages.is_empty() {
                continue;
            }
            swaps.into_iter().for_each(|swap| swap());
            self.library.put(stages);
            reload.total_ms = noticed.elapsed().as_secs_f64() * 1e3;
            tracing::info!(
                "shaders: {} taken over ({} stages in {:.0} ms, {} pipelines in {:.0} ms)",
                reload.files.join(", "),
                reload.counts[0],
                reload.compile_ms,
                reload.counts[1],
                reload.driver_ms
            );
            self.status.reloads += 1;
            let before = taken.take();
            let (mut files, filled) =
                before.map_or((Vec::new(), false), |taken| (taken.files, taken.fills_tables));
            files.extend(
                reload.files.iter().filter(|file| !files.contains(file)).cloned().collect::<Vec<_>>(),
            );
            taken = Some(TakenOver { files, fills_tables: fills_tables || filled });
            self.status.last = Some(reload);
        }
        taken
    }

    fn refuse(&mut self, faults: Vec<ShaderFault>) {
        if self.status.faults != faults {
            faults.iter().for_each(|fault| tracing::error!("shader: {fault}"));
        }
        self.status.refused += 1;
        self.status.faults = faults;
    }
}

impl Drop for Reloader {
    fn drop(&mut self) {
        let _ = self.hints.send(Hint::Stop);
        if let Some(worker) = self.worker.take() {
            let _ = worker.join();
        }
    }
}

fn work(
    library: &ShaderLibrary,
    hints: &Receiver<Hint>,
    compiling: &AtomicBool,
    done: impl Fn(Outcome) -> bool,
) {
    let mut memory = Memory::default();
    while let Ok(Hint::Look(files)) = hints.recv() {
        let noticed = Instant::now();
        let mut hinted = vec![files];
        loop {
            match hints.recv_timeout(QUIET) {
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
        compiling.store(true, Ordering::Relaxed);
        let outcome = make_anew(library, noticed, changed.as_ref(), &mut memory);
        compiling.store(false, Ordering::Relaxed);
        if !done(outcome) {
            return;
        }
    }
}

fn is_empty(file: &Path) -> bool {
    std::fs::metadata(file).is_ok_and(|about| about.is_file() && about.len() == 0)
}

/// The paths of files inside the folder; `None`: any may have changed.
fn names_of(library: &ShaderLibrary, hinted: &[Vec<PathBuf>]) -> Option<BTreeSet<String>> {
    let folder = library.folder()?;
    let name = |path: &PathBuf| {
        let inside = path.strip_prefix(&folder).ok()?;
        let parts: Option<Vec<&str>> = inside.components().map(|part| part.as_os_str().to_str()).collect();
        parts.map(|parts| parts.join("/"))
    };
    let all_named = hinted.iter().all(|files| !files.is_empty());
    all_named.then(|| hinted.iter().flatten().map(name).collect()).flatten()
}

/// Compiles every stage whose text is another one, and makes the pipelines in use that have one of them.
fn make_anew(
    library: &ShaderLibrary,
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
        Some(files) => texts.retain(|file, _| !files.contains(file)),
        None => texts.clear(),
    }
    let (mut changed_files, mut unread) = (BTreeSet::new(), BTreeSet::new());
    let mut changed = Vec::new();
    let sources = library.sources();
    let is_concerned = |stage: &Arc<Compiled>| {
        let holds = |files: &BTreeSet<String>| stage.source.texts.keys().any(|file| files.contains(file));
        refused.contains(stage.file()) || hinted.is_none_or(holds)
    };
    for stage in library.all_stages().into_iter().filter(is_concerned) {
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
    let compiled = in_parallel(changed, |source| Compiled::new(&library.device, source, &library.cache));
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
        for result in in_parallel(live, |live| live.prepare(&stage)) {
            match result {
                Ok(swap) => made.swaps.push(swap),
                Err(error) => faults.extend(ShaderFault::of_error(error)),
            }
        }
        reload.counts[1] = made.swaps.len();
    }
    reload.driver_ms = since(start);
    made.stages = stages.into_values().collect();
    faults.sort_by(|a, b| {
        (&a.file, a.line, a.column, &a.message).cmp(&(&b.file, b.line, b.column, &b.message))
    });
    faults.dedup();
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
