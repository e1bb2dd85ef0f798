//! Questions about files that are there: unsaved changes of another run, files outside of the project's folder, and files that a
//! name that was completed would replace.
//! Enters: what was found. Leaves: a recovered scene, read on a worker, or files that stay as they are.

use std::path::Path;
use std::time::{Duration, Instant};

use caustica_scene::import::ImportOptions;
use caustica_scene::{HeldJournal, JournalError, LeftBehind, Recovered};
use egui::{Align, Context, Id, Layout, Modal, Ui};

use super::editor::Editor;
use super::files::{Purpose, short};
use crate::recovery::{describe, survey};
use crate::worker::{Answer, Job, Progress};

/// Most files that a question lists.
const MOST_LISTED: usize = 6;

/// How often, and how many times, journals are looked at again that another process held.
const LOOK_EVERY: Duration = Duration::from_millis(500);
const LOOKS: u32 = 20;

/// Journals that other processes held. One that was killed keeps its own for a while: an editor that is started again at once
/// must not miss what it leaves.
#[derive(Default)]
pub(super) struct Watch {
    held: Vec<HeldJournal>,
    looks_left: u32,
    next: Option<Instant>,
}

impl Watch {
    fn begin(held: Vec<HeldJournal>) -> Self {
        Self { held, looks_left: LOOKS, next: Instant::now().checked_add(LOOK_EVERY) }
    }

    /// What was left behind since the last look, and how long until the next one; `None`: there is none.
    fn look(&mut self, now: Instant) -> (Vec<LeftBehind>, Option<Duration>) {
        let mut found = Vec::new();
        if self.next.is_some_and(|next| next <= now) {
            found = HeldJournal::look_again(&mut self.held);
            self.looks_left = self.looks_left.saturating_sub(1);
            self.next = now.checked_add(LOOK_EVERY);
        }
        if self.held.is_empty() || self.looks_left == 0 {
            self.next = None;
        }
        (found, self.next.map(|next| next.saturating_duration_since(now)))
    }
}

/// Unsaved changes that are being read.
pub(super) struct Recovering {
    job: Job<Result<Recovered, JournalError>>,
}

impl Recovering {
    /// What is going on and how far, for the progress bar.
    pub(super) fn progress(&self) -> (String, Progress) {
        (self.job.label().to_owned(), self.job.progress())
    }
}

impl Editor {
    /// Looks for unsaved changes that other runs have left behind, and asks about them; for some seconds also about those of
    /// runs that are still ending.
    pub fn ask_about_left_behind(&mut self) {
        self.later.clear();
        self.left_behind.clear();
        let (left_behind, held) = survey();
        self.watch = Watch::begin(held);
        self.ask_about(left_behind);
    }

    /// Asks about unsaved changes of a project that was just opened, unless the user wants to hear of them later.
    pub(super) fn ask_about_left_behind_of(&mut self, project: &Path) {
        if !self.left_behind.is_empty() {
            return;
        }
        let project = std::path::absolute(project).unwrap_or_else(|_| project.to_owned());
        let (mut left_behind, mut held) = survey();
        left_behind.retain(|left| left.project() == Some(&project) && !self.later.contains(left.path()));
        held.retain(|held| held.project() == Some(&project) && !self.watch.held.contains(held));
        if !held.is_empty() {
            held.append(&mut self.watch.held);
            self.watch = Watch::begin(held);
        }
        self.ask_about(left_behind);
    }

    /// Asks about what processes have left behind that were still ending at the last look.
    pub(super) fn look_again(&mut self, context: &Context) {
        let (left_behind, next) = self.watch.look(Instant::now());
        self.ask_about(left_behind);
        if let Some(delay) = next {
            context.request_repaint_after(delay);
        }
    }

    fn ask_about(&mut self, left_behind: Vec<LeftBehind>) {
        for left in &left_behind {
            tracing::info!("left behind: {}", describe(left));
        }
        self.left_behind.extend(left_behind);
    }

    pub(super) fn ask_to_recover(&mut self, context: &Context) {
        let Some(first) = self.left_behind.first() else { return };
        let (what, others) = (describe(first), self.left_behind.len() - 1);
        let [recover, discard, later] = ["Recover", "Discard", "Later"];
        let heading = "Recover unsaved changes?";
        // What was left behind may turn up when something was changed here already.
        let is_modified = self.session.is_modified();
        let default = if is_modified { later } else { recover };
        let answer = ask(context, heading, [recover, discard, later], default, |ui| {
            ui.label("The program ended before these changes were saved:");
            ui.add_space(4.0);
            ui.strong(what);
            if others > 0 {
                ui.weak(format!("and {others} more, which are asked about next"));
            }
            if is_modified {
                ui.add_space(4.0);
                let text = "The scene that is open has unsaved changes, too. Recovering puts the other one in its place: save first, \
                            and recover by File > Recover unsaved changes.";
                ui.colored_label(ui.visuals().warn_fg_color, text);
            }
        });
        if answer == Some(recover) {
            let left = self.left_behind.remove(0);
            self.postpone_left_behind();
            self.start_recovering(left);
        } else if answer == Some(discard) {
            self.left_behind.remove(0).discard();
        } else if answer == Some(later) {
            self.postpone_left_behind();
        }
    }

    fn postpone_left_behind(&mut self) {
        self.later.extend(self.left_behind.drain(..).map(|left| left.path().to_owned()));
    }

    pub(super) fn start_recovering(&mut self, left: LeftBehind) {
        // What was about to be opened would take the place of what is recovered.
        self.loading = None;
        self.waiting.clear();
        self.outside = None;
        let path = left.path().to_owned();
        let work = move |progress: &dyn Fn(&str, f32)| left.recover(&ImportOptions::default(), progress);
        match Job::start("Recovering unsaved changes", self.wake.clone(), work) {
            Ok(job) => self.recovering = Some(Recovering { job }),
            Err(error) => self.state.toasts.error(format!("{} cannot be read: {error}.", path.display())),
        }
    }

    /// Takes over what was recovered.
    pub(super) fn poll_recovering(&mut self) {
        let Some(recovering) = self.recovering.take() else { return };
        match recovering.job.poll() {
            Answer::Running => self.recovering = Some(recovering),
            Answer::Done(Ok(recovered)) => {
                let warnings = recovered.project.warnings.len();
                recovered.project.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
                match self.session.recover(recovered) {
                    Ok(()) => {
                        self.new_scene_shown();
                        if !self.restore() {
                            let done = "Recovered the unsaved changes; save to keep them";
                            self.tell(done.to_owned(), warnings);
                        }
                    }
                    Err(error) => self.state.toasts.error(format!("Nothing was recovered: {error:#}.")),
                }
            }
            Answer::Done(Err(error)) => {
                self.state
                    .toasts
                    .error(format!("The unsaved changes cannot be read, and stay where they are: {error}."));
            }
            Answer::Died => {
                let message = "Reading the unsaved changes failed in a way that was not foreseen; they stay where they are.";
                self.state.toasts.error(message);
            }
        }
    }

    pub(super) fn ask_to_replace(&mut self, context: &Context) {
        let Some((_, path)) = &self.replacing else { return };
        let [replace, keep] = ["Replace it", "Choose another name"];
        let answer = ask(context, "Replace the file?", [replace, keep], keep, |ui| {
            ui.label(format!("{} is there already. Replace it?", path.display()));
        });
        let Some(answer) = answer else { return };
        let Some((wish, path)) = self.replacing.take() else { return };
        match answer == replace {
            true => self.chosen(wish, path),
            false => self.ask(wish),
        }
    }

    pub(super) fn ask_about_outside(&mut self, context: &Context) {
        let Some((project, files)) = &self.outside else { return };
        let [read, leave] = ["Read them", "Leave them out"];
        let heading = "Read files outside of the project's folder?";
        let answer = ask(context, heading, [read, leave], leave, |ui| {
            ui.label(format!("{} names these files. Read them if you trust who made it:", short(project)));
            ui.add_space(4.0);
            for file in files.iter().take(MOST_LISTED) {
                ui.strong(file.display().to_string());
            }
            if files.len() > MOST_LISTED {
                ui.weak(format!("and {} more", files.len() - MOST_LISTED));
            }
        });
        if answer.is_some()
            && let Some((project, _)) = self.outside.take()
            && answer == Some(read)
        {
            self.state.config.trust(&project);
            self.load(Purpose::Open, project);
        }
    }
}

/// A question in the middle of the window, the first answer at the right. The last one is also what Esc says, and Enter says
/// the `default`.
fn ask<const N: usize>(
    context: &Context,
    heading: &str,
    answers: [&'static str; N],
    default: &str,
    body: impl FnOnce(&mut Ui),
) -> Option<&'static str> {
    let mut answer = None;
    let modal = Modal::new(Id::new(heading)).show(context, |ui| {
        ui.set_width(420.0);
        ui.heading(heading);
        ui.add_space(8.0);
        body(ui);
        ui.add_space(16.0);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            for text in answers {
                let button = ui.button(text);
                if text == default && context.memory(|memory| memory.focused().is_none()) {
                    button.request_focus();
                }
                if button.clicked() {
                    answer = Some(text);
                }
            }
        });
    });
    answer.or_else(|| if modal.should_close() { answers.last().copied() } else { None })
}
