//! Shaders that are edited: what a thread of its own (`worker.rs`) has made of them is taken over between two frames.
//! Enters: outcomes. Leaves: either every pipeline that is concerned, or what is wrong.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::fault::ShaderFault;
use super::library::{ShaderLibrary, lock};
use super::watch::{Watch, Watching};
use super::worker::{Hint, Made, Outcome, Running, Worker};

/// Called, on another thread, when there is something to take over.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// So long the end waits for what is being compiled.
const MOST_PATIENCE: Duration = Duration::from_secs(5);

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
    /// What has been compiled for long, by the compiler or the driver, and for how many seconds; what is saved meanwhile waits.
    pub slow: Vec<(String, u64)>,
    /// What is wrong in the files as they are; the picture is that of the files before.
    pub faults: Vec<ShaderFault>,
    /// Edits that were taken over, since the start.
    pub reloads: u64,
    /// Edits that were refused, since the start.
    pub refused: u64,
    /// The newest one.
    pub last: Option<Reload>,
}

/// What was taken over in a frame.
pub(crate) struct TakenOver {
    pub(crate) files: Vec<String>,
    /// What the tables hold was made by a shader that has changed.
    pub(crate) fills_tables: bool,
}

/// Watches the folder of a library.
pub(crate) struct Reloader {
    library: Arc<ShaderLibrary>,
    hints: Sender<Hint>,
    outcomes: Mutex<Receiver<Outcome>>,
    running: Arc<Running>,
    /// Outcomes that were not taken over yet.
    waiting: Arc<AtomicUsize>,
    status: ShaderStatus,
    worker: Option<JoinHandle<()>>,
    watch: Watch,
}

impl Reloader {
    pub(crate) fn new(library: &Arc<ShaderLibrary>, wake: Wake) -> Option<Self> {
        let folder = library.folder()?;
        let (hints, inbox) = channel();
        let (outbox, outcomes) = channel();
        let (running, waiting): (Arc<Running>, Arc<AtomicUsize>) = Default::default();
        let worker = Worker {
            library: Arc::clone(library),
            hints: inbox,
            outcomes: outbox,
            waiting: Arc::clone(&waiting),
            running: Arc::clone(&running),
            wake,
        };
        let worker = std::thread::Builder::new().name("shaders".to_owned()).spawn(move || worker.run());
        let worker = worker.inspect_err(|error| tracing::warn!("shaders are not reloaded: {error}")).ok()?;
        // What is there may differ from what is in use.
        let _ = hints.send(Hint::Look(Vec::new()));
        let look = hints.clone();
        let watch = Watch::start(&folder, move |files| {
            // Nobody looks any more at the end of the program.
            let _ = look.send(Hint::Look(files));
        });
        let outcomes = Mutex::new(outcomes);
        Some(Self {
            library: Arc::clone(library),
            hints,
            outcomes,
            running,
            waiting,
            status: ShaderStatus::default(),
            worker: Some(worker),
            watch,
        })
    }

    pub(crate) fn status(&self) -> ShaderStatus {
        let mut status = ShaderStatus {
            watching: Some(self.watch.how()),
            compiling: self.running.is_any(),
            slow: self.running.slow(),
            ..self.status.clone()
        };
        status.faults.extend(self.library.held_faults());
        status
    }

    /// Whether something is being compiled.
    pub(crate) fn is_compiling(&self) -> bool {
        self.running.is_any()
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
        let Some(worker) = self.worker.take() else { return };
        let start = Instant::now();
        // A driver may never come back from a shader: the end of the program does not wait for it.
        while !worker.is_finished() && start.elapsed() < MOST_PATIENCE {
            std::thread::sleep(Duration::from_millis(1));
        }
        if worker.is_finished() {
            let _ = worker.join();
        } else {
            tracing::warn!("a shader is still being compiled; it is not waited for any longer");
        }
    }
}
