//! One open document with its renderer and one view. The window and the command line share it: edits go in,
//! `begin_frame` syncs and renders. It knows no widget.

mod camera;
mod files;
mod inventory;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_renderer::gpu::{Acquired, Device, Frames, Image, Recorder};
use caustica_renderer::{Renderer, RendererOptions, Statistics, ViewId, ViewSettings};
use caustica_scene::{Document, Edit, EditError, NodeId, ProjectMeta, Target};
use glam::DVec3;

pub use camera::ViewCamera;
pub use files::{Loaded, environment_argument, load};

use crate::history::History;
use crate::sync::{Sync, camera_of};

/// A still view stops asking for frames at this many samples.
const CONVERGED_SAMPLES: u64 = 4096;

/// Device time of one submit while the window is open: input is answered in between.
const SUBMIT_BUDGET_MS: f64 = 30.0;

/// How to make a session.
#[derive(Clone, Debug, Default)]
pub struct SessionOptions {
    /// Read shaders from this folder instead of the copy in the binary.
    pub shaders: Option<PathBuf>,
    /// Settings of the view.
    pub settings: ViewSettings,
    /// Size of the view in pixels.
    pub extent: [u32; 2],
    /// The view is shown in a window.
    pub window: bool,
}

/// What is seen through a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Which target of the document.
    pub target: Target,
    /// Which primitive of its mesh.
    pub primitive: u32,
    /// Where, world space, metres; `None` where the pipeline does not tell.
    pub world_position: Option<DVec3>,
}

/// A document, its history, its renderer and one view.
pub struct Session {
    document: Document,
    history: History,
    meta: ProjectMeta,
    path: Option<PathBuf>,
    sync: Sync,
    renderer: Renderer,
    frames: Frames,
    view: ViewId,
    camera: ViewCamera,
    selection: BTreeSet<Target>,
    selection_changed: bool,
    /// The renderer may hold half of a change: it gets the whole scene again.
    resync: bool,
    picture_revision: u64,
    device: Arc<Device>,
}

impl Session {
    /// An empty document on a device.
    ///
    /// # Errors
    /// When memory runs out or the driver refuses.
    pub fn new(device: &Arc<Device>, options: SessionOptions) -> anyhow::Result<Self> {
        let mut frames = Frames::new(device)?;
        let renderer_options = RendererOptions { shaders: options.shaders, ..RendererOptions::default() };
        let mut renderer = Renderer::new(device, &mut frames, &renderer_options)?;
        let view = renderer.create_view(options.extent, options.settings, options.window)?;
        if options.window {
            renderer.view_mut(view)?.set_submit_budget(Some(SUBMIT_BUDGET_MS));
        }
        Ok(Self {
            document: Document::new(),
            history: History::new(),
            meta: ProjectMeta::default(),
            path: None,
            sync: Sync::new(),
            renderer,
            frames,
            view,
            camera: ViewCamera::default(),
            selection: BTreeSet::new(),
            selection_changed: false,
            resync: false,
            picture_revision: 0,
            device: Arc::clone(device),
        })
    }

    /// The device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// The document.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Undo and redo stacks.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Whether there is anything that was not saved.
    pub fn is_modified(&self) -> bool {
        !self.history.is_saved()
    }

    /// The project file, once there is one.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Applies an edit and notes how to undo it. Edits of one gesture become one step.
    ///
    /// # Errors
    /// When the edit does not fit the document, which stays as it was.
    pub fn push(&mut self, edit: Edit) -> Result<(), EditError> {
        let label = edit.describe(&self.document);
        self.note_picture(&edit);
        let inverse = self.document.apply(edit.clone())?;
        self.history.record(label, edit, inverse);
        Ok(())
    }

    fn note_picture(&mut self, edit: &Edit) {
        self.picture_revision += u64::from(edit.changes_picture());
    }

    /// Grows with every edit, undo and redo that may change the picture.
    pub fn picture_revision(&self) -> u64 {
        self.picture_revision
    }

    /// Lets the document make an edit (which may take new ids) and applies it.
    ///
    /// # Errors
    /// When the edit does not fit the document, which stays as it was.
    pub fn edit_with<T>(&mut self, make: impl FnOnce(&mut Document) -> (T, Edit)) -> Result<T, EditError> {
        let (value, edit) = make(&mut self.document);
        self.push(edit)?;
        Ok(value)
    }

    /// Ends a gesture: the next edit starts a step of its own.
    pub fn end_gesture(&mut self) {
        self.history.end_gesture();
    }

    /// Takes the open gesture back, as Esc does in a drag.
    pub fn cancel_gesture(&mut self) {
        if let Some(step) = self.history.cancel_gesture() {
            self.note_picture(&step.edit);
            if let Err(error) = self.document.apply_back(step.edit) {
                tracing::error!("taking a gesture back failed: {error}");
            }
        }
    }

    /// Undoes the newest step; says what was undone.
    pub fn undo(&mut self) -> Option<String> {
        let step = self.history.take_undo()?;
        self.note_picture(&step.edit);
        match self.document.apply_back(step.edit.clone()) {
            Ok(redo) => self.history.put_redo(&step, redo),
            Err(error) => tracing::error!("undo of '{}' failed: {error}", step.label),
        }
        Some(step.label)
    }

    /// Does the step undone last again; says what was done.
    pub fn redo(&mut self) -> Option<String> {
        let step = self.history.take_redo()?;
        self.note_picture(&step.edit);
        match self.document.apply_back(step.edit.clone()) {
            Ok(undo) => self.history.put_undo(&step, undo),
            Err(error) => tracing::error!("redo of '{}' failed: {error}", step.label),
        }
        Some(step.label)
    }

    /// Replaces the document with what was loaded. The history starts anew.
    ///
    /// # Errors
    /// When the model does not fit; the open document stays as it was.
    pub fn open(&mut self, path: &Path, loaded: Loaded) -> anyhow::Result<()> {
        let opened = files::open(path, loaded)?;
        self.document = opened.document;
        self.meta = opened.meta;
        self.path = opened.path;
        self.document.mark_all_added("opened a file");
        self.replace_scene()?;
        if let Some(settings) = opened.settings {
            self.set_settings(settings);
        }
        self.camera =
            opened.camera.unwrap_or_else(|| ViewCamera::of_document(&self.document, None, self.aspect()));
        Ok(())
    }

    /// Starts an empty document.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new_document(&mut self) -> anyhow::Result<()> {
        self.document = Document::new();
        self.meta = ProjectMeta::default();
        self.path = None;
        self.document.mark_all_added("new scene");
        self.replace_scene()?;
        self.camera = ViewCamera::default();
        Ok(())
    }

    /// Empties the renderer's scene before another document is synced.
    fn replace_scene(&mut self) -> anyhow::Result<()> {
        self.empty_renderer()?;
        self.picture_revision += 1;
        self.history.clear();
        self.selection.clear();
        self.selection_changed = true;
        Ok(())
    }

    /// Brings what was loaded into the scene as one undo step: a model becomes a new node, an environment replaces
    /// the present one. Returns the new node.
    ///
    /// # Errors
    /// For a project, which can only be opened, and when the edit does not fit.
    pub fn import(&mut self, loaded: Loaded) -> anyhow::Result<Option<NodeId>> {
        let was_empty = self.document.node_count() == 0;
        let node = files::import(&mut self.document, loaded)?;
        let (edit, node) = (node.edit, node.node);
        self.push(edit)?;
        if was_empty {
            self.camera = ViewCamera::of_document(&self.document, None, self.aspect());
        }
        Ok(node)
    }

    /// Saves the project, with camera and settings of the view.
    ///
    /// # Errors
    /// When the file cannot be written; the old one stays.
    pub fn save(&mut self, path: &Path) -> anyhow::Result<()> {
        let settings = self.settings().clone();
        files::note_view(&mut self.meta, &self.camera, &settings);
        caustica_scene::Project::save(path, &self.document, &self.meta)?;
        self.path = Some(path.to_owned());
        self.history.mark_saved();
        Ok(())
    }

    /// Width / height of the view.
    fn aspect(&self) -> f64 {
        let [width, height] = self.renderer.view(self.view).map_or([1, 1], |view| view.extent());
        f64::from(width) / f64::from(height.max(1))
    }

    /// Camera of the view.
    pub fn camera(&self) -> &ViewCamera {
        &self.camera
    }

    /// Moves the view's camera.
    pub fn set_camera(&mut self, camera: ViewCamera) {
        self.camera = camera;
    }

    /// Settings of the view.
    pub fn settings(&self) -> &ViewSettings {
        static DEFAULT: std::sync::LazyLock<ViewSettings> = std::sync::LazyLock::new(ViewSettings::default);
        self.renderer.view(self.view).map_or(&DEFAULT, |view| view.settings())
    }

    /// Changes the settings of the view.
    pub fn set_settings(&mut self, settings: ViewSettings) {
        if let Ok(view) = self.renderer.view_mut(self.view)
            && *view.settings() != settings
        {
            view.set_settings(settings);
        }
    }

    /// Starts the sample set at `offset`.
    ///
    /// # Errors
    /// Never while the session lives; kept for the renderer's error type.
    pub fn set_sample_offset(&mut self, offset: u64) -> anyhow::Result<()> {
        self.renderer.view_mut(self.view)?.set_sample_offset(offset);
        Ok(())
    }

    /// Outlines these targets.
    pub fn set_selection(&mut self, selection: &BTreeSet<Target>) {
        if self.selection != *selection {
            self.selection.clone_from(selection);
            self.selection_changed = true;
        }
    }

    /// Syncs the document and records one frame of the view, `extent_px` large.
    ///
    /// # Errors
    /// When a shader does not compile or fit, memory runs out, or the device is lost.
    pub fn begin_frame(&mut self, extent_px: [u32; 2]) -> anyhow::Result<Recorder> {
        let mut recorder = self.frames.begin()?;
        self.renderer.note_times(self.view, &self.frames)?;
        match self.record(&mut recorder, extent_px) {
            Ok(()) => Ok(recorder),
            Err(error) => {
                // Uploads and builds recorded until then count as done: they must reach the device.
                self.frames.submit(recorder, None)?;
                Err(error)
            }
        }
    }

    fn record(&mut self, recorder: &mut Recorder, extent_px: [u32; 2]) -> anyhow::Result<()> {
        if std::mem::take(&mut self.resync) {
            // Marked first: should this fail too, the next frame still sends everything.
            self.document.mark_all_added("tried again");
            self.renderer.apply(recorder, &std::mem::take(&mut self.sync).clear())?;
        }
        let delta = self.sync.delta(&mut self.document, self.camera.world_from_camera.translation);
        let selection_stale = self.selection_changed || !delta.instances.is_empty();
        if let Err(error) = self.renderer.apply(recorder, &delta) {
            // Half of the change is in: the next frame sends the whole scene again.
            self.resync = true;
            return Err(error.into());
        }
        if selection_stale {
            self.renderer.select(self.view, outlined(&self.document, &self.selection).into_iter())?;
            self.selection_changed = false;
        }
        let camera = camera_of(
            &self.camera.world_from_camera,
            self.camera.projection,
            self.camera.near_m,
            self.sync.origin(),
        );
        let view = self.renderer.view_mut(self.view)?;
        view.resize(extent_px);
        view.set_camera(camera);
        self.renderer.render(recorder, self.view)?;
        Ok(())
    }

    /// Starts a frame that leaves the view's image as it was: the window repaints its panels alone.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn begin_ui_frame(&mut self) -> anyhow::Result<Recorder> {
        let recorder = self.frames.begin()?;
        self.renderer.note_times(self.view, &self.frames)?;
        Ok(recorder)
    }

    /// Submits a frame.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn submit(&mut self, recorder: Recorder, window: Option<&Acquired>) -> anyhow::Result<()> {
        self.frames.submit(recorder, window)?;
        Ok(())
    }

    /// Waits for everything submitted and takes the newest times over.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn finish(&mut self) -> anyhow::Result<()> {
        self.frames.finish()?;
        self.renderer.note_times(self.view, &self.frames)?;
        Ok(())
    }

    /// The image for the window, holding srgb(x)^2.2; `None` before the first frame.
    pub fn window_image(&self) -> Option<&Image> {
        self.renderer.view(self.view).ok().and_then(|view| view.window_image())
    }

    /// Samples accumulated.
    pub fn samples(&self) -> u64 {
        self.renderer.view(self.view).map_or(0, |view| view.samples())
    }

    /// Whether more frames would hardly change the image.
    pub fn is_converged(&self) -> bool {
        self.samples() >= CONVERGED_SAMPLES
    }

    /// What is seen through a pixel of the last frame. Waits for the device.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn pick(&mut self, pixel: [u32; 2]) -> anyhow::Result<Option<Pick>> {
        let Some(hit) = self.renderer.pick(&mut self.frames, self.view, pixel)? else { return Ok(None) };
        let node = NodeId(hit.instance.node);
        let is_prefab = self.document.node(node).is_some_and(|node| node.prefab().is_some());
        let target = if is_prefab { Target::part(node, hit.instance.part) } else { Target::node(node) };
        let centre = [pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5];
        let (origin, direction) = self.renderer.camera_ray(self.view, centre)?;
        let forward = -self.camera.world_from_camera.z_axis.normalize();
        let world_position = hit.distance_m.map(|distance_m| {
            let along = f64::from(distance_m) / direction.as_dvec3().dot(forward);
            self.sync.origin() + origin.as_dvec3() + direction.as_dvec3() * along
        });
        Ok(Some(Pick { target, primitive: hit.geometry, world_position }))
    }

    /// Figures of the last frame.
    pub fn statistics(&self) -> &Statistics {
        static NOTHING: std::sync::LazyLock<Statistics> = std::sync::LazyLock::new(Statistics::default);
        self.renderer.statistics(self.view).unwrap_or(&NOTHING)
    }

    /// The accumulated radiance. Waits for the device.
    ///
    /// # Errors
    /// When there is no frame yet or the device is lost.
    pub fn read_back(&mut self) -> anyhow::Result<caustica_renderer::Accumulated> {
        Ok(self.renderer.read_back(&mut self.frames, self.view)?)
    }

    /// The tone-mapped image, linear. Waits for the device.
    ///
    /// # Errors
    /// When there is no frame yet or the device is lost.
    pub fn read_display(&mut self) -> anyhow::Result<Vec<[f32; 4]>> {
        Ok(self.renderer.read_display(&mut self.frames, self.view)?)
    }
}

/// Instances of the selected targets and of everything below them.
fn outlined(document: &Document, selection: &BTreeSet<Target>) -> Vec<caustica_renderer::delta::InstanceId> {
    let mut waiting: Vec<Target> = selection.iter().copied().collect();
    let mut found = Vec::new();
    while let Some(target) = waiting.pop() {
        if document.mesh_of(target).is_some() {
            found.push(crate::sync::instance_id(target));
        }
        waiting.extend(document.children_of(target));
    }
    found
}
