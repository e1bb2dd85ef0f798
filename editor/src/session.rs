//! One open document with its renderer and one view. The window and the command line share it: edits go in,
//! `begin_frame` syncs and renders. It knows no widget.

mod camera;
mod files;
mod frame;
mod host_times;
mod inventory;
mod room;
mod tally;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_renderer::delta::LightId;
use caustica_renderer::gpu::{Device, Frames};
use caustica_renderer::{
    AccelPolicy, DeviceProfile, ProfileInForce, Renderer, RendererOptions, ViewId, ViewSettings,
};
use caustica_scene::{Document, Edit, EditError, Local, NodeId, PrefabId, ProjectMeta, ShapeSource, Target};
use glam::DVec3;

pub use camera::ViewCamera;
pub use files::{Loaded, environment_argument, load};
pub use host_times::{HostTimes, Lap};
pub use tally::Tally;

use crate::history::History;
use crate::sync::{Sync, instance_id};

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
    /// When acceleration structures are built, refitted and compacted; `None`: as suits the device.
    pub acceleration: Option<AccelPolicy>,
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
    /// Shared while a worker reads it: an edit in that time copies it first.
    document: Arc<Document>,
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
    profile: ProfileInForce,
    tally: Tally,
    host_times: HostTimes,
    device: Arc<Device>,
}

impl Session {
    /// An empty document on a device.
    ///
    /// # Errors
    /// When memory runs out or the driver refuses.
    pub fn new(device: &Arc<Device>, options: SessionOptions) -> anyhow::Result<Self> {
        let mut frames = Frames::new(device)?;
        let profile = DeviceProfile::in_force(device.name(), device.driver(), device.kind());
        let acceleration =
            options.acceleration.unwrap_or_else(|| AccelPolicy::of(&profile.profile, options.window));
        let renderer_options = RendererOptions {
            shaders: options.shaders,
            acceleration,
            primary_rays_pay: profile.profile.primary_rays_pay(),
        };
        let mut renderer = Renderer::new(device, &mut frames, &renderer_options)?;
        let view = renderer.create_view(options.extent, options.settings, options.window)?;
        if options.window {
            renderer.view_mut(view)?.set_submit_budget(Some(SUBMIT_BUDGET_MS));
        }
        Ok(Self {
            document: Arc::default(),
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
            profile,
            tally: Tally::default(),
            host_times: HostTimes::default(),
            device: Arc::clone(device),
        })
    }

    /// The device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// What was measured of the device, which decides when structures are refitted, compacted and left for later.
    pub fn device_profile(&self) -> &ProfileInForce {
        &self.profile
    }

    /// The document.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// The document for a worker to read. What changes it meanwhile copies it first, and so does the next frame while it has
    /// changes that wait for that frame.
    pub fn shared_document(&self) -> Arc<Document> {
        Arc::clone(&self.document)
    }

    /// Names of the lights, in order, with their ids in the renderer.
    pub fn light_names(&self) -> Vec<(LightId, String)> {
        let named = |target| (instance_id(target), self.document.display_name(target));
        self.document.lights().map(|light| named(light.target)).collect()
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
    /// When the edit does not fit the document or touches what is locked; the document stays as it was.
    pub fn push(&mut self, edit: Edit) -> Result<(), EditError> {
        if let Some(lock) = self.document.locked_against(&edit) {
            return Err(EditError::Locked(self.document.display_name(lock.into())));
        }
        let label = edit.describe(&self.document);
        self.note_picture(&edit);
        let inverse = Arc::make_mut(&mut self.document).apply(edit.clone())?;
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
        let (value, edit) = make(Arc::make_mut(&mut self.document));
        self.push(edit)?;
        Ok(value)
    }

    /// Adds spheres and boxes with materials of their own, as one step; gives the new node.
    ///
    /// # Errors
    /// When the description makes no shapes.
    pub fn add_shapes(&mut self, name: &str, source: ShapeSource, local: Local) -> Result<NodeId, EditError> {
        let (node, edit) = files::shapes_edit(Arc::make_mut(&mut self.document), name, source, local)?;
        self.push(edit)?;
        Ok(node)
    }

    /// Ends a gesture: the next edit starts a step of its own.
    pub fn end_gesture(&mut self) {
        self.history.end_gesture();
    }

    /// Takes the open gesture back, as Esc does in a drag.
    pub fn cancel_gesture(&mut self) {
        if let Some(step) = self.history.cancel_gesture() {
            self.note_picture(&step.edit);
            if let Err(error) = Arc::make_mut(&mut self.document).apply_back(step.edit) {
                tracing::error!("taking a gesture back failed: {error}");
            }
        }
    }

    /// Undoes the newest step; says what was undone.
    pub fn undo(&mut self) -> Option<String> {
        let step = self.history.take_undo()?;
        self.note_picture(&step.edit);
        match Arc::make_mut(&mut self.document).apply_back(step.edit.clone()) {
            Ok(redo) => self.history.put_redo(&step, redo),
            Err(error) => tracing::error!("undo of '{}' failed: {error}", step.label),
        }
        Some(step.label)
    }

    /// Does the step undone last again; says what was done.
    pub fn redo(&mut self) -> Option<String> {
        let step = self.history.take_redo()?;
        self.note_picture(&step.edit);
        match Arc::make_mut(&mut self.document).apply_back(step.edit.clone()) {
            Ok(undo) => self.history.put_undo(&step, undo),
            Err(error) => tracing::error!("redo of '{}' failed: {error}", step.label),
        }
        Some(step.label)
    }

    /// Replaces the document with what was loaded. The history starts anew.
    ///
    /// # Errors
    /// When the scene does not fit on the device, or contradicts itself; the open document stays as it was.
    pub fn open(&mut self, path: &Path, loaded: Loaded) -> anyhow::Result<()> {
        self.open_at(path, loaded, None)
    }

    /// Like [`Self::open`], in the pose of a time, seconds. A camera of the document is taken where it is then; without
    /// one the view frames the scene at rest, so that it is the same at all times.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_at(&mut self, path: &Path, loaded: Loaded, time_s: Option<f64>) -> anyhow::Result<()> {
        let opened = files::open(path, loaded)?;
        room::check(&opened.document, self.device.memory_budget())?;
        self.meta = opened.meta;
        self.path = opened.path;
        self.replace_scene(opened.document, "opened a file")?;
        if let Some(settings) = opened.settings {
            self.set_settings(settings);
        }
        self.camera =
            opened.camera.unwrap_or_else(|| ViewCamera::of_document(&self.document, None, self.aspect()));
        self.set_time(time_s);
        if opened.camera.is_none()
            && let Some(camera) = self.document.main_camera()
        {
            self.camera = ViewCamera::of_placed(&camera);
        }
        Ok(())
    }

    /// Shows the scene at a time, seconds; `None`: at rest. It is no edit: history and file know nothing of it.
    pub fn set_time(&mut self, time_s: Option<f64>) {
        if self.document.time() != time_s {
            Arc::make_mut(&mut self.document).set_time(time_s);
            self.picture_revision += 1;
        }
    }

    /// The time that is shown, seconds; `None`: everything is at rest.
    pub fn time(&self) -> Option<f64> {
        self.document.time()
    }

    /// How long the longest clip lasts that an instance plays, seconds; `None`: nothing is animated.
    pub fn duration(&self) -> Option<f64> {
        self.document.animation_duration()
    }

    /// Starts an empty document.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new_document(&mut self) -> anyhow::Result<()> {
        self.meta = ProjectMeta::default();
        self.path = None;
        self.replace_scene(Document::new(), "new scene")?;
        self.camera = ViewCamera::default();
        Ok(())
    }

    /// Empties the renderer's scene before another document is synced.
    fn replace_scene(&mut self, mut document: Document, reason: &str) -> anyhow::Result<()> {
        document.mark_all_added(reason);
        self.document = Arc::new(document);
        self.empty_renderer()?;
        self.picture_revision += 1;
        self.history.clear();
        self.selection.clear();
        self.selection_changed = true;
        Ok(())
    }

    /// Brings what was loaded into the scene as one undo step: a model or project becomes a new node, an environment
    /// replaces the present one. Returns the new node.
    ///
    /// # Errors
    /// When the edit does not fit, or the scene with it on the device; the document stays as it was.
    pub fn import(&mut self, path: &Path, loaded: Loaded) -> anyhow::Result<Option<NodeId>> {
        let was_empty = self.document.node_count() == 0;
        let node = files::import(Arc::make_mut(&mut self.document), path, loaded)?;
        let (edit, node) = (node.edit, node.node);
        let mut with_it = Document::clone(&self.document);
        with_it.apply(edit.clone())?;
        room::check(&with_it, self.device.memory_budget())?;
        self.push(edit)?;
        if was_empty {
            self.camera = ViewCamera::of_document(&self.document, None, self.aspect());
        }
        Ok(node)
    }

    /// Gives an instance a prefab of its own, a copy of that which it shares with others.
    ///
    /// # Errors
    /// When the node is no instance, or shares its prefab with none.
    pub fn make_unique(&mut self, node: NodeId) -> Result<(), EditError> {
        let edit = Arc::make_mut(&mut self.document).make_unique_edit(node)?;
        self.push(edit)
    }

    /// Puts what was loaded in the place of a prefab's source, as one undo step. Instances keep their overrides.
    ///
    /// # Errors
    /// When it is no model.
    pub fn replace_source(&mut self, prefab: PrefabId, loaded: Loaded) -> anyhow::Result<()> {
        let Loaded::Model(imported) = loaded else {
            anyhow::bail!("only a model (.gltf, .glb, .obj) can be the source of an instance")
        };
        let edit = Arc::make_mut(&mut self.document).reload_edit(prefab, *imported)?;
        Ok(self.push(edit)?)
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

    /// Says how many samples are going to be taken; `None`: nobody knows.
    ///
    /// # Errors
    /// When the view was removed.
    pub fn set_sample_target(&mut self, samples: Option<u64>) -> anyhow::Result<()> {
        self.renderer.view_mut(self.view)?.set_sample_target(samples);
        Ok(())
    }

    /// Outlines these targets.
    pub fn set_selection(&mut self, selection: &BTreeSet<Target>) {
        if self.selection != *selection {
            self.selection.clone_from(selection);
            self.selection_changed = true;
        }
    }
}
