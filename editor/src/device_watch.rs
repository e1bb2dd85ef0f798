//! Notices when a device does not come back, on a thread of its own: the one that waits for the device may be held by the driver.
//! Enters: a device. Leaves: a call, once nothing was finished for so long that the device counts as hung.

use std::io::Write as _;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use caustica_renderer::gpu::{Device, leave_process};

/// So long whoever gave the device up may take to see to the rest: the driver may hold it.
const SEEN_TO_WITHIN: Duration = Duration::from_secs(3);

/// Watches until it is dropped.
pub(crate) struct DeviceWatch {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl DeviceWatch {
    /// `is_suspect`: whether there is a reason not to be patient, given how long nothing was finished. `hung`: what to do then;
    /// nobody waits for the device any more.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(crate) fn start(
        device: &Arc<Device>,
        is_suspect: impl Fn(Duration) -> bool + Send + 'static,
        hung: impl Fn(Duration) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (stop, stopped) = channel();
        let device = Arc::clone(device);
        let thread = std::thread::Builder::new()
            .name("device watch".to_owned())
            .spawn(move || watch(&device, &stopped, &is_suspect, &hung))?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for DeviceWatch {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // It never panics, and nothing could be done about it.
            let _ = thread.join();
        }
    }
}

fn watch(
    device: &Device,
    stopped: &Receiver<()>,
    is_suspect: &dyn Fn(Duration) -> bool,
    hung: &dyn Fn(Duration),
) {
    let [soon, late] = [device.suspect_after_s(), device.hung_after_s()].map(Duration::from_secs);
    let pause = (soon / 8).clamp(Duration::from_millis(50), Duration::from_secs(1));
    // Counted in looks, not by the clock: a process that was stopped meanwhile has not waited.
    let (mut stands_at, mut stood, mut given_up) = (None, Duration::ZERO, Duration::ZERO);
    while let Err(RecvTimeoutError::Timeout) = stopped.recv_timeout(pause) {
        if device.is_given_up() {
            given_up += pause;
            if given_up >= SEEN_TO_WITHIN {
                hung(late);
                return;
            }
            continue;
        }
        // A lost device is noticed by the next frame, unless that never comes.
        let at = device.works_at().unwrap_or(Some(u64::MAX));
        stood = if at.is_some() && at == stands_at { stood + pause } else { Duration::ZERO };
        stands_at = at;
        if stood >= late || stood >= soon && is_suspect(stood) {
            device.give_up();
            hung(stood);
            return;
        }
    }
}

/// Ends the process, also when the driver would not let it clean up.
pub(crate) fn end(code: u8) -> ! {
    // Nothing could be done about it.
    let _ = std::io::stdout().flush();
    leave_process(code)
}
