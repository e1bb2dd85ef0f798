//! What the device works at, for whoever asks while it does not answer. Enters: every submission of frames. Leaves: the oldest
//! one that is unfinished, and the pass that it stands in. Any thread may ask, also while another one waits in the driver.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::Result;
use crate::context::Device;
use crate::device_choice::DeviceKind;
use crate::error::GpuError;

/// A device that works at one submission for longer counts as hung, seconds. A processor compiles shaders when they are used
/// first, which takes long.
const HUNG_AFTER_S: u64 = 60;
const PROCESSOR_HUNG_AFTER_S: u64 = 300;
/// The same where a shader was edited just before.
const SUSPECT_AFTER_S: u64 = 10;
const PROCESSOR_SUSPECT_AFTER_S: u64 = 60;
/// Sets it, for tests.
const VARIABLE: &str = "CAUSTICA_HUNG_AFTER_S";

/// The passes of a submission.
pub(crate) struct Passes {
    pub(crate) value: u64,
    pub(crate) pool: vk::QueryPool,
    pub(crate) labels: Arc<Vec<String>>,
    /// One a label; set once the pass is through.
    pub(crate) events: Vec<vk::Event>,
}

impl Passes {
    /// Labels of the last pass that is known to be through, and of the one after it.
    fn last_finished(&self, device: &Device) -> (String, String) {
        let mut done = 0_usize;
        for event in &self.events {
            // SAFETY: whoever resets or destroys the events waits until they are not watched any more.
            match unsafe { device.raw.get_event_status(*event) } {
                Ok(true) => done += 1,
                Ok(false) => break,
                Err(_) => return (String::from("unknown"), self.labels.join(", or ")),
            }
        }
        let name = |index: Option<usize>| {
            index.and_then(|index| self.labels.get(index)).cloned().unwrap_or_else(|| String::from("none"))
        };
        (name(done.checked_sub(1)), name(Some(done)))
    }
}

/// Submissions of frames that were not seen to have finished, oldest first.
pub(crate) struct Watched {
    submitted: Mutex<Vec<Passes>>,
    hung_after_s: u64,
    suspect_after_s: u64,
    given_up: AtomicBool,
}

impl Watched {
    pub(crate) fn new(kind: DeviceKind) -> Self {
        let set = std::env::var(VARIABLE).ok().and_then(|text| text.parse().ok()).filter(|s| *s > 0);
        let [hung, suspect] = match kind {
            DeviceKind::Cpu => [PROCESSOR_HUNG_AFTER_S, PROCESSOR_SUSPECT_AFTER_S],
            _ => [HUNG_AFTER_S, SUSPECT_AFTER_S],
        };
        Self {
            submitted: Mutex::default(),
            hung_after_s: set.unwrap_or(hung),
            suspect_after_s: set.unwrap_or(suspect),
            given_up: AtomicBool::new(false),
        }
    }

    /// To be called before the submission: the driver may not come back from it.
    pub(crate) fn begin(&self, passes: Passes) {
        if let Ok(mut submitted) = self.submitted.lock() {
            submitted.push(passes);
        }
    }

    /// To be called before timestamps and events are reset or destroyed.
    pub(crate) fn end(&self, pool: vk::QueryPool) {
        if let Ok(mut submitted) = self.submitted.lock() {
            submitted.retain(|work| work.pool != pool);
        }
    }
}

/// Ends the process without what the driver would do at its end, which may wait for the device for ever.
pub fn leave_process(code: u8) -> ! {
    #[cfg(unix)]
    // SAFETY: it takes no memory of ours and never comes back.
    unsafe {
        libc::_exit(code.into())
    }
    #[cfg(not(unix))]
    std::process::exit(code.into())
}

impl Device {
    /// A device that works at one submission for longer counts as hung, seconds; `CAUSTICA_HUNG_AFTER_S` sets it.
    pub fn hung_after_s(&self) -> u64 {
        self.watched.hung_after_s
    }

    /// The same where a shader was edited just before, which is then likely to be the reason.
    pub fn suspect_after_s(&self) -> u64 {
        self.watched.suspect_after_s
    }

    /// Timeline value of the oldest submission of a frame that has not finished; `None`: nothing is left to do.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn works_at(&self) -> Result<Option<u64>> {
        let completed = self.completed()?;
        let Ok(submitted) = self.watched.submitted.lock() else { return Ok(None) };
        Ok(submitted.iter().map(|work| work.value).find(|value| *value > completed))
    }

    /// The error that the device has not finished within `seconds`, with the names of passes.
    pub fn overdue(&self, seconds: u64) -> GpuError {
        let unknown = || String::from("unknown");
        self.name_the_pass(GpuError::Timeout { seconds, last_pass: unknown(), next_pass: unknown() })
    }

    /// Puts names of passes into an error about a lost or hung device: those of the oldest submission that has not finished.
    pub fn name_the_pass(&self, error: GpuError) -> GpuError {
        if !matches!(error, GpuError::DeviceLost { .. } | GpuError::Timeout { .. }) {
            return error;
        }
        let Ok(submitted) = self.watched.submitted.lock() else { return error };
        let names: Vec<_> = submitted.iter().map(|passes| passes.last_finished(self)).collect();
        let unfinished = names.iter().find(|(_, next)| next != "none");
        let Some((last_pass, next_pass)) = unfinished.or(names.last()).cloned() else { return error };
        match error {
            GpuError::Timeout { seconds, .. } => GpuError::Timeout { seconds, last_pass, next_pass },
            _ => GpuError::DeviceLost { last_pass, next_pass },
        }
    }

    /// Nobody waits for the device any more: what it was given may never end. What it uses is not destroyed, as that would wait.
    pub fn give_up(&self) {
        self.watched.given_up.store(true, Ordering::Release);
    }

    /// Whether nobody waits for the device any more.
    pub fn is_given_up(&self) -> bool {
        self.watched.given_up.load(Ordering::Acquire)
    }
}
