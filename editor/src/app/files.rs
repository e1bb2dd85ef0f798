//! Opening, importing and saving. Enters: file names. Leaves: a changed session; reading happens on a worker.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_scene::PrefabId;

use super::editor::{Editor, Then};
use crate::dialogs::{
    ENVIRONMENT_ENDINGS, EXPORT_ENDINGS, MODEL_ENDINGS, PROJECT_ENDING, SHAPE_ENDINGS, Wish,
};
use crate::session::{self, Arrived, Loaded};
use crate::worker::{Answer, Job, Progress};

/// What a file is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// As a new scene.
    Open,
    /// As a part of the scene.
    Import,
    /// In the place of a prefab's source.
    Source(PrefabId),
}

/// A file that is being read.
pub(super) struct Loading {
    purpose: Purpose,
    path: PathBuf,
    job: Job<anyhow::Result<Loaded>>,
}

impl Loading {
    /// What is going on, for the progress bar.
    pub(super) fn label(&self) -> String {
        self.job.label().to_owned()
    }

    /// How far it is.
    pub(super) fn progress(&self) -> Progress {
        self.job.progress()
    }
}

impl Editor {
    /// Asks for a file name.
    pub(super) fn ask(&mut self, wish: Wish) {
        let folder = match self.session.path().or(self.state.config.recent.first().map(PathBuf::as_path)) {
            Some(path) => path.parent().map(Path::to_path_buf),
            None => None,
        };
        let mut name = self.file_name();
        if wish == Wish::Export {
            let stem = [".caustica.json", ".json"].iter().find_map(|ending| name.strip_suffix(ending));
            name = format!("{}.{}", stem.unwrap_or(&name), EXPORT_ENDINGS[0]);
        }
        self.dialogs.ask(wish, folder.as_deref(), &name, &self.wake);
    }

    /// The project's file name; before it has one, the name of the first model in it.
    fn file_name(&self) -> String {
        if let Some(name) = self.session.path().and_then(Path::file_name) {
            return name.to_string_lossy().into_owned();
        }
        let model = self
            .session
            .document()
            .prefabs()
            .map(|(_, prefab)| prefab.name.as_str())
            .find(|name| !name.is_empty());
        format!("{}.{PROJECT_ENDING}", model.unwrap_or("scene"))
    }

    /// A dialog gave a file name.
    pub(super) fn chosen(&mut self, wish: Wish, path: PathBuf) {
        match wish {
            Wish::Open => self.load(Purpose::Open, path),
            Wish::Import | Wish::Environment => self.load(Purpose::Import, path),
            Wish::Reference => self.open_reference(&path),
            Wish::Source(prefab) => self.load(Purpose::Source(prefab), path),
            Wish::SaveAs => self.save_to(&path),
            Wish::Export => self.export_to(path),
        }
    }

    /// Compares the picture with one of a file.
    fn open_reference(&mut self, path: &Path) {
        match crate::reference::read_exr(path, self.session.picture_extent()) {
            Ok(picture) => self.state.error.set_reference(&mut self.session, Some(Arc::new(picture))),
            Err(error) => self.state.toasts.error(format!("{error:#}.")),
        }
    }

    /// A file was dropped on the window.
    pub(super) fn drop_file(&mut self, path: PathBuf) {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        if [&MODEL_ENDINGS[..], &SHAPE_ENDINGS, &ENVIRONMENT_ENDINGS].concat().contains(&ending.as_str()) {
            self.load(Purpose::Import, path);
        } else if ending == "json" {
            self.guarded(Then::Open(path));
        } else {
            self.state.toasts.error(format!("{}: this kind of file cannot be opened here.", path.display()));
        }
    }

    /// Starts to read a file.
    pub(super) fn load(&mut self, purpose: Purpose, path: PathBuf) {
        if self.loading.is_some() && purpose == Purpose::Import {
            self.waiting.push_back(path);
            return;
        }
        if self.loading.is_some() {
            self.state.toasts.warning("Another file is still being read; cancel it or wait.");
            return;
        }
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let label = match purpose {
            Purpose::Open => format!("Opening {name}"),
            Purpose::Import => format!("Importing {name}"),
            Purpose::Source(_) => format!("Reading {name}"),
        };
        let (file, outside) = (path.clone(), self.state.config.trusts(&path));
        match Job::start(label, self.wake.clone(), move |progress| session::load(&file, outside, progress)) {
            Ok(job) => self.loading = Some(Loading { purpose, path, job }),
            Err(error) => self.state.toasts.error(format!("{} cannot be read: {error}.", path.display())),
        }
    }

    /// Takes over what a worker has read.
    pub(super) fn poll_loading(&mut self) {
        let Some(loading) = self.loading.take() else {
            if let Some(next) = self.waiting.pop_front() {
                self.load(Purpose::Import, next);
            }
            return;
        };
        match loading.job.poll() {
            Answer::Running => self.loading = Some(loading),
            Answer::Died => {
                let path = loading.path.display();
                self.state.toasts.error(format!(
                    "{path}: reading the file failed in a way that was not foreseen; see the log."
                ));
            }
            Answer::Done(Err(error)) => self.state.toasts.error(format!("{error:#}")),
            Answer::Done(Ok(loaded)) => {
                let result = match (loading.purpose, &loaded) {
                    (Purpose::Source(prefab), _) => self.replace_source(prefab, &loading.path, loaded),
                    (_, Loaded::Environment(..)) | (Purpose::Import, _) => self.import(&loading.path, loaded),
                    (Purpose::Open, _) => self.open(&loading.path, loaded),
                };
                if let Err(error) = result {
                    self.state.toasts.error(format!("{}: {error:#}", loading.path.display()));
                }
            }
        }
    }

    fn open(&mut self, path: &Path, loaded: Loaded) -> anyhow::Result<()> {
        let warnings = warning_count(&loaded);
        let outside = match &loaded {
            Loaded::Project(project) => project.outside.clone(),
            _ => Vec::new(),
        };
        self.session.open(path, loaded)?;
        self.opened = Some(path.to_owned());
        self.state.config.remember(path);
        self.new_scene_shown();
        if self.restore() {
            return Ok(());
        }
        self.tell(format!("Opened {}", short(path)), warnings);
        self.ask_about_left_behind_of(path);
        self.outside = (!outside.is_empty()).then(|| (path.to_owned(), outside));
        Ok(())
    }

    fn import(&mut self, path: &Path, loaded: Loaded) -> anyhow::Result<()> {
        let warnings = warning_count(&loaded);
        let was_empty = self.session.document().node_count() == 0;
        let left_out = matches!(&loaded, Loaded::Project(project) if !project.outside.is_empty());
        let Arrived { node, changed } = self.session.import(path, loaded)?;
        self.session.end_gesture();
        if left_out {
            self.session.scene_mut().note_refused();
            self.state.toasts.warning(format!(
                "{} names files outside of its folder, which were not read. Open it by itself to be asked about them.",
                short(path)
            ));
        }
        if let Some(node) = node {
            self.state.selection.set(node.into());
            self.state.outliner.reveal(self.session.document(), node.into());
        }
        if was_empty {
            self.measure_scene();
        }
        self.tell(format!("Imported {}", short(path)), warnings);
        if changed {
            self.state.toasts.warning(format!(
                "{} has changed since it was imported before: instances from then stay as they are until their source is \
                 reloaded.",
                short(path)
            ));
        }
        Ok(())
    }

    fn replace_source(&mut self, prefab: PrefabId, path: &Path, loaded: Loaded) -> anyhow::Result<()> {
        let warnings = warning_count(&loaded);
        let lost = self.session.replace_source(prefab, loaded)?;
        self.session.end_gesture();
        self.tell(format!("The source is {} now", short(path)), warnings + lost);
        Ok(())
    }

    /// Reads the source of a prefab again.
    pub(super) fn reload_source(&mut self, prefab: PrefabId) {
        if let Some(source) = self.session.document().prefab(prefab).map(|prefab| prefab.source.clone()) {
            self.load(Purpose::Source(prefab), source);
        }
    }

    pub(super) fn tell(&mut self, done: String, warnings: usize) {
        match warnings {
            0 => self.state.toasts.info(format!("{done}.")),
            1 => self.state.toasts.warning(format!("{done}, with one warning: see the log.")),
            n => self.state.toasts.warning(format!("{done}, with {n} warnings: see the log.")),
        }
    }

    /// Another document is shown, at rest: selection, open rows and distances of the old one mean nothing any more.
    pub(super) fn new_scene_shown(&mut self) {
        self.state.selection.clear();
        self.state.outliner.reset();
        self.state.health = None;
        self.state.view.drag = None;
        self.state.playback.playing = false;
        let roots: Vec<_> = self.session.document().roots().to_vec();
        if let [only] = roots.as_slice() {
            self.state.outliner.set_open((*only).into(), true);
        }
        self.measure_scene();
    }

    /// Sets the orbit's distance and the flying speed by the size of the scene.
    pub(super) fn measure_scene(&mut self) {
        let camera = self.session.camera();
        let (eye, forward) = (camera.world_from_camera.translation, -camera.world_from_camera.matrix3.z_axis);
        let Some((low, high)) = self.session.document().bounds() else {
            self.state.view.distance_m = 5.0;
            return;
        };
        let (center, size) = ((low + high) * 0.5, (high - low).length());
        let ahead = (center - eye).dot(forward);
        self.state.view.distance_m = if ahead > size * 0.02 { ahead } else { size * 0.5 }.max(1e-4);
        self.state.view.fly_speed_m_s = (size * 0.25).clamp(1e-3, 1e4);
    }

    /// Saves where it was saved before, or asks where.
    pub(super) fn save(&mut self) {
        match self.session.path().map(Path::to_path_buf) {
            Some(path) if is_project(&path) => self.save_to(&path),
            _ => self.ask(Wish::SaveAs),
        }
    }

    fn save_to(&mut self, path: &Path) {
        match self.session.save(path) {
            Ok(()) => {
                self.state.config.remember(path);
                if !self.session.scene().has_refused() {
                    self.state.config.trust(path);
                    // At once: a run that is killed has saved it on this machine all the same.
                    if let Err(error) = self.config().save() {
                        tracing::warn!("that the project is one of this machine is not kept: {error:#}");
                    }
                }
                self.state.toasts.info(format!("Saved {}.", short(path)));
                self.tell_of_absent_sources();
                if let Some(kept) = self.session.scene_mut().take_set_aside() {
                    self.state.toasts.warning(format!(
                        "Another program had saved {} since it was opened here. What it saved is kept as {}.",
                        short(path),
                        short(&kept)
                    ));
                }
                if let Some(then) = self.after_save.take() {
                    self.go_on(then);
                }
            }
            Err(error) => {
                self.after_save = None;
                self.state.toasts.error(format!("The scene is not saved: {error:#}."));
            }
        }
    }

    /// Says which sources are not where the project that was just saved names them, as after their folder was moved.
    fn tell_of_absent_sources(&mut self) {
        let prefabs = self.session.document().prefabs().map(|(_, prefab)| prefab);
        // Those that were missing from the start were told of when the project was opened.
        let absent = prefabs.filter(|prefab| !prefab.missing && !prefab.source.exists());
        let absent: Vec<PathBuf> = absent.map(|prefab| prefab.source.clone()).collect();
        for source in &absent {
            tracing::warn!(
                "{}: is not there any more; put it back or choose another source",
                source.display()
            );
        }
        if let Some(first) = absent.first() {
            let more = match absent.len() {
                1 => String::new(),
                count => format!(" and {} more", count - 1),
            };
            let first = first.display();
            self.state
                .toasts
                .warning(format!("{first}{more}: not there any more, but named in the project."));
        }
    }

    /// Goes on after the question about unsaved changes.
    pub(super) fn go_on(&mut self, then: Then) {
        self.restoring = None;
        match then {
            Then::New => match self.session.new_document() {
                Ok(()) => {
                    self.opened = None;
                    self.new_scene_shown();
                }
                Err(error) => self.state.toasts.error(format!("No new scene: {error:#}.")),
            },
            Then::AskAndOpen => self.ask(Wish::Open),
            Then::Open(path) => self.load(Purpose::Open, path),
            Then::Recover => {
                self.ask_about_left_behind();
                if self.left_behind.is_empty() {
                    self.state.toasts.info("No unsaved changes were left behind.");
                }
            }
            Then::Quit => {
                // Saved, or its owner has just said that it is not wanted.
                self.session.scene_mut().discard_journal();
                self.quit = true;
            }
        }
    }
}

fn warning_count(loaded: &Loaded) -> usize {
    match loaded {
        Loaded::Project(project) => project.warnings.len(),
        Loaded::Model(model) => model.warnings.len(),
        Loaded::Shapes(..) | Loaded::Environment(..) => 0,
    }
}

fn is_project(path: &Path) -> bool {
    path.to_string_lossy().to_lowercase().ends_with(".json")
}

pub(super) fn short(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}
