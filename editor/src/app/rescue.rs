//! When the device does not come back: the program starts again in the place of its own process, with everything as it was and
//! without the shader that is to blame. Enters: what to keep, after every frame. Leaves: a file for the next process, which
//! `app/after_hang.rs` makes use of.

use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use anyhow::{anyhow, bail};
use caustica_renderer::gpu::{Device, GpuError};
use caustica_renderer::shader::ShaderLibrary;

use super::after_hang::AfterHang;
use crate::cli::EXIT_DEVICE;
use crate::device_watch::{DeviceWatch, end};

/// Option of the command line that names the file for the next process.
pub const OPTION: &str = "--after-hang";
/// A device that is lost again so soon after a start, with no shader to blame, would be lost for ever.
const NOT_AGAIN_WITHIN: Duration = Duration::from_secs(60);

/// See the head of the file.
pub(super) struct Rescue {
    shared: Arc<Shared>,
    _watch: Option<DeviceWatch>,
}

struct Shared {
    device: Arc<Device>,
    shaders: Arc<ShaderLibrary>,
    /// What the next process is told.
    kept: Mutex<Option<AfterHang>>,
    /// When this process was started, where a device that did not come back was why.
    started_again: Option<Instant>,
    /// The user has left.
    ends: AtomicBool,
}

impl Rescue {
    /// Watches the device. `started_again`: this process takes the place of one whose device did not come back.
    pub(super) fn new(device: &Arc<Device>, shaders: &Arc<ShaderLibrary>, started_again: bool) -> Self {
        let shared = Arc::new(Shared {
            device: Arc::clone(device),
            shaders: Arc::clone(shaders),
            kept: Mutex::default(),
            started_again: started_again.then(Instant::now),
            ends: AtomicBool::new(false),
        });
        let (suspect, rescued) = (Arc::clone(&shared), Arc::clone(&shared));
        let watch = DeviceWatch::start(
            device,
            move |waited| is_suspect(&suspect, waited),
            move |waited| rescue(&rescued, waited),
        );
        let watch = watch.inspect_err(|error| tracing::warn!("a device that hangs is not noticed: {error}"));
        Self { shared, _watch: watch.ok() }
    }

    /// Keeps what the program looks like now.
    pub(super) fn keep(&self, state: AfterHang) {
        if let Ok(mut kept) = self.shared.kept.lock() {
            *kept = Some(state);
        }
    }

    /// Whether a shader came into use that has not proven itself.
    pub(super) fn has_suspects(&self) -> bool {
        self.shared.shaders.has_suspects()
    }

    /// Starts the program again; comes back only when that cannot be, with the reason.
    pub(super) fn start_again(&self, error: &GpuError) -> anyhow::Error {
        self.shared.start_again(error)
    }

    /// From now on a device that does not come back ends the program.
    pub(super) fn leave(&self) {
        self.shared.ends.store(true, Ordering::Release);
    }
}

impl Shared {
    fn start_again(&self, error: &GpuError) -> anyhow::Error {
        // Held until the process is another one: whoever comes second waits here.
        let Ok(mut kept) = self.kept.lock() else { return anyhow!("nothing is known of the window") };
        let Some(kept) = kept.as_mut() else { return anyhow!("there was no frame yet") };
        match self.hand_over(kept, error) {
            Ok(file) => {
                let failed = run_again(&file);
                let _ = std::fs::remove_file(&file);
                anyhow!(failed).context("the program cannot be started again")
            }
            Err(error) => error,
        }
    }

    /// Writes what the next process needs; gives the file.
    fn hand_over(&self, kept: &mut AfterHang, error: &GpuError) -> anyhow::Result<PathBuf> {
        let unknown = || GpuError::DeviceLost { last_pass: "unknown".into(), next_pass: "unknown".into() };
        let named = self.device.name_the_pass(unknown());
        let pass = named.unfinished_pass().filter(|pass| *pass != "unknown").or(error.unfinished_pass());
        let waited = match error {
            GpuError::Timeout { seconds, .. } => Duration::from_secs(*seconds),
            _ => Duration::ZERO,
        };
        let blamed = self.shaders.blamed(pass.unwrap_or("unknown"), waited);
        let again = NOT_AGAIN_WITHIN + Duration::from_secs(self.device.hung_after_s());
        if blamed.is_empty() && self.started_again.is_some_and(|start| start.elapsed() < again) {
            bail!("the program was just started again for the same reason");
        }
        kept.held = self.shaders.held();
        kept.held.retain(|held| blamed.iter().all(|blamed| blamed.file != held.file));
        let files: Vec<String> = blamed.iter().map(|blamed| blamed.file.clone()).collect();
        kept.told = match files.is_empty() {
            true => format!("{error}. The program was started again, with everything as it was."),
            false => format!(
                "{} did not finish (pass {}): the shader before is shown. Edit and save the file to try again.",
                files.join(", "),
                pass.unwrap_or("unknown")
            ),
        };
        kept.held.extend(blamed);
        tracing::error!("{error}; the program is started again");
        flush(kept);
        kept.write()
    }
}

fn is_suspect(shared: &Shared, waited: Duration) -> bool {
    let error = shared.device.overdue(waited.as_secs());
    !shared.shaders.blamed(error.unfinished_pass().unwrap_or_default(), waited).is_empty()
}

/// The device will not come back.
fn rescue(shared: &Shared, waited: Duration) {
    if shared.ends.load(Ordering::Acquire) {
        end(0);
    }
    let error = shared.device.overdue(waited.as_secs());
    let why = shared.start_again(&error);
    // The thread of the window may never come back from the driver: it ends here.
    eprintln!("error: {error}: {why:#}; unsaved changes are kept: start the editor again to recover them");
    end(EXIT_DEVICE);
}

/// Brings the journal to the disk. The kernel has it already, which outlives the process.
fn flush(kept: &AfterHang) {
    let Some(journal) = &kept.journal else { return };
    if let Err(error) = std::fs::File::open(journal).and_then(|file| file.sync_all()) {
        tracing::warn!("{}: {error}", journal.display());
    }
}

/// Puts the program, with the arguments of this process, in its place. Comes back only when that fails.
fn run_again(file: &Path) -> io::Error {
    let program = match std::env::current_exe() {
        // Where it was replaced meanwhile, the one that runs is still to be had here.
        Ok(program) if program.exists() || !cfg!(target_os = "linux") => program,
        Ok(_) | Err(_) => PathBuf::from("/proc/self/exe"),
    };
    let mut command = Command::new(program);
    command.args(without_option(std::env::args_os().skip(1))).arg(OPTION).arg(file);
    replace_process(command)
}

/// The arguments without the file of an earlier start.
fn without_option(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut arguments = arguments;
    while let Some(argument) = arguments.next() {
        if argument == OPTION {
            arguments.next();
        } else {
            kept.push(argument);
        }
    }
    kept
}

#[cfg(unix)]
fn replace_process(mut command: Command) -> io::Error {
    use std::os::unix::process::CommandExt as _;
    command.exec()
}

#[cfg(not(unix))]
fn replace_process(mut command: Command) -> io::Error {
    match command.spawn() {
        Ok(_) => end(0),
        Err(error) => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_is_given_once() {
        let arguments = ["--shaders", "a", OPTION, "old.json", "room.caustica.json"].map(OsString::from);
        let kept = without_option(arguments.into_iter());
        assert_eq!(kept, ["--shaders", "a", "room.caustica.json"].map(OsString::from));
    }
}
