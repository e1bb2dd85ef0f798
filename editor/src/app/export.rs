//! Writing the scene as glTF. Enters: a file name. Leaves: a file, written on a worker; the scene is only read, so that
//! history and file name of the project stay.

use std::path::PathBuf;

use caustica_scene::{ExportError, Exported, export_with_progress};

use super::editor::Editor;
use super::files::short;
use crate::worker::{Answer, Job, Progress};

/// A file that is being written.
pub(super) struct Exporting {
    path: PathBuf,
    job: Job<Result<Exported, ExportError>>,
}

impl Exporting {
    /// What is going on and how far, for the progress bar.
    pub(super) fn progress(&self) -> (String, Progress) {
        (self.job.label().to_owned(), self.job.progress())
    }
}

impl Editor {
    /// Starts to write the scene as it is now.
    pub(super) fn export_to(&mut self, path: PathBuf) {
        if self.exporting.is_some() {
            self.state.toasts.warning("Another file is still being written; wait for it.");
            return;
        }
        let document = self.session.shared_document();
        let (label, file) = (format!("Exporting {}", short(&path)), path.clone());
        let work = move |progress: &dyn Fn(&str, f32)| export_with_progress(&document, &file, progress);
        match Job::start(label, self.wake.clone(), work) {
            Ok(job) => self.exporting = Some(Exporting { path, job }),
            Err(error) => self.state.toasts.error(format!("{} cannot be written: {error}.", path.display())),
        }
    }

    /// Says what became of it.
    pub(super) fn poll_exporting(&mut self) {
        let Some(exporting) = self.exporting.take() else { return };
        match exporting.job.poll() {
            Answer::Running => self.exporting = Some(exporting),
            Answer::Done(Ok(exported)) => {
                exported.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
                self.tell(format!("Exported {}", short(&exporting.path)), exported.warnings.len());
            }
            Answer::Done(Err(error)) => {
                self.state.toasts.error(format!("The scene is not exported: {error}."));
            }
            Answer::Died => {
                let path = exporting.path.display();
                self.state.toasts.error(format!(
                    "{path}: writing the file failed in a way that was not foreseen; see the log."
                ));
            }
        }
    }
}
