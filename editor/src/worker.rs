//! Work off the UI thread. Enters: a closure. Leaves: its progress and, once, its result.
//! A worker touches neither the window nor the session; the event loop is woken when there is something to see.

use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Wakes the event loop from any thread.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Shortest time between two wakes for progress.
const PROGRESS_EVERY: Duration = Duration::from_millis(50);

/// What a job is doing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Step, in words.
    pub step: String,
    /// Share done, 0..1.
    pub share: f32,
}

/// A closure that runs on its own thread. Dropping the job is cancelling it: the thread ends its step unheard.
pub struct Job<T> {
    label: String,
    receiver: Receiver<T>,
    progress: Arc<Mutex<Progress>>,
}

/// What a job has to say.
#[derive(Debug, PartialEq)]
pub enum Answer<T> {
    /// Not yet.
    Running,
    /// The result; it comes once.
    Done(T),
    /// The thread ended without a result: it panicked.
    Died,
}

impl<T: Send + 'static> Job<T> {
    /// Starts `work`; it tells how far it is through the function it is given.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn start(
        label: impl Into<String>,
        wake: Wake,
        work: impl FnOnce(&dyn Fn(&str, f32)) -> T + Send + 'static,
    ) -> std::io::Result<Self> {
        let label = label.into();
        let (sender, receiver) = channel();
        let progress = Arc::new(Mutex::new(Progress::default()));
        let shared = Arc::clone(&progress);
        std::thread::Builder::new().name(label.clone()).spawn(move || {
            // Wakes the window also when the work panics, so that it notices.
            let _at_the_end = WakeOnDrop(Arc::clone(&wake));
            let last_wake = Mutex::new(Instant::now());
            let report = move |step: &str, share: f32| {
                if let Ok(mut progress) = shared.lock() {
                    *progress = Progress { step: step.to_owned(), share: share.clamp(0.0, 1.0) };
                }
                if let Ok(mut last) = last_wake.lock()
                    && last.elapsed() >= PROGRESS_EVERY
                {
                    *last = Instant::now();
                    wake();
                }
            };
            let result = work(&report);
            // Nobody listens any more when the job was cancelled.
            let _ = sender.send(result);
        })?;
        Ok(Self { label, receiver, progress })
    }

    /// What it is, such as "Opening chair.glb".
    pub fn label(&self) -> &str {
        &self.label
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        self.progress.lock().map(|progress| progress.clone()).unwrap_or_default()
    }

    /// Asks without waiting.
    pub fn poll(&self) -> Answer<T> {
        match self.receiver.try_recv() {
            Ok(result) => Answer::Done(result),
            Err(TryRecvError::Empty) => Answer::Running,
            Err(TryRecvError::Disconnected) => Answer::Died,
        }
    }
}

impl<T> std::fmt::Debug for Job<T> {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.debug_struct("Job").field("label", &self.label).finish_non_exhaustive()
    }
}

struct WakeOnDrop(Wake);

impl Drop for WakeOnDrop {
    fn drop(&mut self) {
        (self.0)();
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn wait_for<T: Send + 'static>(job: &Job<T>) -> Answer<T> {
        for _ in 0..500 {
            match job.poll() {
                Answer::Running => std::thread::sleep(Duration::from_millis(10)),
                answer => return answer,
            }
        }
        Answer::Running
    }

    #[test]
    fn a_job_gives_progress_and_its_result_once() {
        let wakes = Arc::new(AtomicUsize::new(0));
        let count = Arc::clone(&wakes);
        let wake: Wake = Arc::new(move || {
            count.fetch_add(1, Ordering::SeqCst);
        });
        let job = Job::start("adding", wake, |report| {
            report("adding", 0.5);
            20 + 22
        })
        .unwrap();
        assert!(matches!(wait_for(&job), Answer::Done(42)));
        assert_eq!(job.progress(), Progress { step: "adding".into(), share: 0.5 });
        assert!(matches!(wait_for(&job), Answer::Died), "a result comes once");
        for _ in 0..100 {
            if wakes.load(Ordering::SeqCst) > 0 {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("the event loop was never woken");
    }

    #[test]
    fn a_job_that_panics_is_noticed() {
        let job = Job::<()>::start("failing", Arc::new(|| {}), |_| panic!("on purpose")).unwrap();
        assert!(matches!(wait_for(&job), Answer::Died));
    }
}
