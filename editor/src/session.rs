//! One open document with its renderer and one view. The window and the command line share it: edits go in,
//! `begin_frame` syncs and renders. It knows no widget.

mod camera;
mod files;
mod frame;
mod host_times;
mod inventory;
mod measuring;
mod room;
mod tally;
mod view_size;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_renderer::delta::LightId;
use caustica_renderer::gpu::{Device, Frames};
use caustica_renderer::shader::{HeldShader, ShaderFiles, ShaderLibrary, ShaderStatus, Wake};
use caustica_renderer::{
    AccelPolicy, DeviceProfile, ProfileInForce, Renderer, RendererOptions, ViewId, ViewSettings, WakeFn,
};
use caustica_scene::{Document, Edit, EditError, Local, NodeId, PrefabId, Recovered, ShapeSource, Target};
use glam::DVec3;

pub use camera::ViewCamera;
pub use files::{Arrived, Loaded, environment_argument, load};
pub use host_times::{HostTimes, Lap};
pub use tally::Tally;

use self::files::Opened;
use self::view_size::ViewSize;
use crate::history::History;
use crate::open_scene::OpenScene;
use crate::sync::{Sync, instance_id};

/// Device time of one submit while the window is open: input is answered in between.
const SUBMIT_BUDGET_MS: f64 = 30.0;

/// How to make a session.
#[derive(Clone, Debug, Default)]
pub struct SessionOptions {
    /// Read shaders from this folder instead of the copy in the binary.
    pub shaders: Option<PathBuf>,
    /// Shaders of that folder are edited; this is called when there is something new to see.
    pub watch_shaders: Option<WakeFn>,
    /// Shaders of that folder that did not finish.
    pub held_shaders: Vec<HeldShader>,
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
    scene: OpenScene,
    sync: Sync,
    renderer: Renderer,
    frames: Frames,
    view: ViewId,
    camera: ViewCamera,
    selection: BTreeSet<Target>,
    selection_changed: bool,
    /// The renderer may hold half of a change: it gets the whole scene again.
    resync: bool,
    view_size: ViewSize,
    profile: ProfileInForce,
    tally: Tally,
    host_times: HostTimes,
    /// No more samples once the error is so small, as a share: 0.01 is 1 %.
    stop_at: Option<f64>,
    device: Arc<Device>,
}

impl Session {
    /// An empty document on a device.
    ///
    /// # Errors
    /// When memory runs out or the driver refuses.
    pub fn new(device: &Arc<Device>, options: SessionOptions) -> anyhow::Result<Self> {
        Self::make(device, options).map_err(|error| {
            let budget = device.memory_budget();
            if !view_size::is_out_of_memory(&error) {
                return error;
            }
            let words =
                format!("not even an empty scene has room in {:.0} MiB", room::mib(budget.budget_bytes));
            error.context(format!("{words}; {} would help", room::more_memory(budget)))
        })
    }

    fn make(device: &Arc<Device>, options: SessionOptions) -> anyhow::Result<Self> {
        let mut frames = Frames::new(device)?;
        let profile = DeviceProfile::in_force(device.name(), device.driver(), device.kind());
        let acceleration =
            options.acceleration.unwrap_or_else(|| AccelPolicy::of(&profile.profile, options.window));
        let renderer_options = RendererOptions {
            shaders: options.shaders,
            watch_shaders: options.watch_shaders,
            held_shaders: options.held_shaders,
            acceleration,
            primary_rays_pay: profile.profile.primary_rays_pay(),
        };
        let mut renderer = Renderer::new(device, &mut frames, &renderer_options)?;
        let view = renderer.create_view(options.extent, options.settings, options.window)?;
        if options.window {
            renderer.view_mut(view)?.set_submit_budget(Some(SUBMIT_BUDGET_MS));
        }
        Ok(Self {
            scene: OpenScene::new(),
            sync: Sync::new(),
            renderer,
            frames,
            view,
            camera: ViewCamera::default(),
            selection: BTreeSet::new(),
            selection_changed: false,
            resync: false,
            view_size: ViewSize::default(),
            profile,
            tally: Tally::default(),
            host_times: HostTimes::default(),
            stop_at: None,
            device: Arc::clone(device),
        })
    }

    /// How it stands with shaders that are edited.
    pub fn shader_status(&self) -> ShaderStatus {
        self.renderer.shader_status()
    }

    /// All shaders.
    pub fn shader_library(&self) -> &Arc<ShaderLibrary> {
        self.renderer.shader_library()
    }

    /// Where shaders are edited; `None`: they are those of the binary.
    pub fn shader_folder(&self) -> Option<PathBuf> {
        self.renderer.shader_folder()
    }

    /// The shader files that the picture is made of: main files with what they include.
    pub fn shader_files(&self) -> Arc<ShaderFiles> {
        self.renderer.shader_files()
    }

    /// Takes shaders from a folder and follows what is saved there. `wake` is called, on another thread, when there is something new.
    pub fn edit_shaders(&mut self, folder: &Path, wake: Wake) {
        self.renderer.edit_shaders(folder, wake);
    }

    /// Takes over shaders that were edited, as the next frame would. True: the picture begins anew.
    pub fn take_over_shaders(&mut self) -> bool {
        self.renderer.take_over_shaders()
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
        &self.scene.document
    }

    /// The document for a worker to read. What changes it meanwhile copies it first, and so does the next frame while it has
    /// changes that wait for that frame.
    pub fn shared_document(&self) -> Arc<Document> {
        Arc::clone(&self.scene.document)
    }

    /// Names of the lights, in order, with their ids in the renderer.
    pub fn light_names(&self) -> Vec<(LightId, String)> {
        let named = |target| (instance_id(target), self.scene.document.display_name(target));
        self.scene.document.lights().map(|light| named(light.target)).collect()
    }

    /// Undo and redo stacks.
    pub fn history(&self) -> &History {
        &self.scene.history
    }

    /// Whether there is anything that was not saved.
    pub fn is_modified(&self) -> bool {
        !self.scene.history.is_saved()
    }

    /// The project file, once there is one.
    pub fn path(&self) -> Option<&Path> {
        self.scene.path.as_deref()
    }

    /// Applies an edit and notes how to undo it. Edits of one gesture become one step.
    ///
    /// # Errors
    /// When the edit does not fit the document or touches what is locked; the document stays as it was.
    pub fn push(&mut self, edit: Edit) -> Result<(), EditError> {
        self.scene.push(edit)
    }

    /// Grows with every edit, undo and redo that may change the picture.
    pub fn picture_revision(&self) -> u64 {
        self.scene.picture_revision
    }

    /// Lets the document make an edit (which may take new ids) and applies it.
    ///
    /// # Errors
    /// When the edit does not fit the document, which stays as it was.
    pub fn edit_with<T>(&mut self, make: impl FnOnce(&mut Document) -> (T, Edit)) -> Result<T, EditError> {
        self.scene.edit_with(make)
    }

    /// Adds spheres and boxes with materials of their own, as one step; gives the new node.
    ///
    /// # Errors
    /// When the description makes no shapes.
    pub fn add_shapes(&mut self, name: &str, source: ShapeSource, local: Local) -> Result<NodeId, EditError> {
        let (node, edit) = files::shapes_edit(Arc::make_mut(&mut self.scene.document), name, source, local)?;
        self.push(edit)?;
        Ok(node)
    }

    /// Ends a gesture: the next edit starts a step of its own.
    pub fn end_gesture(&mut self) {
        self.scene.end_gesture();
    }

    /// Takes the open gesture back, as Esc does in a drag.
    pub fn cancel_gesture(&mut self) {
        self.scene.cancel_gesture();
    }

    /// Undoes the newest step; says what was undone.
    pub fn undo(&mut self) -> Option<String> {
        self.scene.undo()
    }

    /// Does the step undone last again; says what was done.
    pub fn redo(&mut self) -> Option<String> {
        self.scene.redo()
    }

    /// The document with its history and its journal.
    pub fn scene(&self) -> &OpenScene {
        &self.scene
    }

    /// The document with its history and its journal.
    pub fn scene_mut(&mut self) -> &mut OpenScene {
        &mut self.scene
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
        let document = match &opened {
            Opened::Project(_, project) => &project.document,
            Opened::Unsaved(document) => document,
        };
        room::check(room::of_document(document), self.device.memory_budget())?;
        self.empty_renderer()?;
        match opened {
            Opened::Project(path, project) => self.scene.open(path, *project),
            Opened::Unsaved(document) => self.scene.open_unsaved(*document),
        }
        self.show_opened(time_s);
        Ok(())
    }

    /// Replaces the document with one that was recovered, in the view of its project. Its steps since the last save can be
    /// undone.
    ///
    /// # Errors
    /// When the driver refuses; the open document stays as it was.
    pub fn recover(&mut self, recovered: Recovered) -> anyhow::Result<()> {
        self.empty_renderer()?;
        self.scene.recover(recovered);
        self.show_opened(None);
        Ok(())
    }

    /// Looks at another document as its project says; else by its own camera, or at the whole of it.
    fn show_opened(&mut self, time_s: Option<f64>) {
        self.forget_selection();
        let (camera, settings) = files::noted_view(&self.scene.meta);
        if let Some(settings) = settings {
            self.set_settings(settings);
        }
        self.camera = camera.unwrap_or_else(|| ViewCamera::of_document(&self.scene.document, self.aspect()));
        self.set_time(time_s);
        if camera.is_none()
            && let Some(camera) = self.scene.document.main_camera()
        {
            self.camera = ViewCamera::of_placed(&camera);
        }
    }

    fn forget_selection(&mut self) {
        self.selection.clear();
        self.selection_changed = true;
    }

    /// Shows the scene at a time, seconds; `None`: at rest. It is no edit: history and file know nothing of it.
    pub fn set_time(&mut self, time_s: Option<f64>) {
        if self.scene.document.time() != time_s {
            Arc::make_mut(&mut self.scene.document).set_time(time_s);
            self.scene.picture_revision += 1;
        }
    }

    /// The time that is shown, seconds; `None`: everything is at rest.
    pub fn time(&self) -> Option<f64> {
        self.scene.document.time()
    }

    /// How long the longest clip lasts that an instance plays, seconds; `None`: nothing is animated.
    pub fn duration(&self) -> Option<f64> {
        self.scene.document.animation_duration()
    }

    /// Starts an empty document.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new_document(&mut self) -> anyhow::Result<()> {
        let mut document = Document::new();
        document.mark_all_added("new scene");
        self.empty_renderer()?;
        self.scene.open_unsaved(document);
        self.forget_selection();
        self.camera = ViewCamera::default();
        Ok(())
    }

    /// Brings what was loaded into the scene as one undo step: a model or project becomes a new node, an environment
    /// replaces the present one. A model that the scene has already becomes another instance of it.
    ///
    /// # Errors
    /// When the edit does not fit, or the scene with it on the device; the document stays as it was.
    pub fn import(&mut self, path: &Path, loaded: Loaded) -> anyhow::Result<Arrived> {
        let was_empty = self.scene.document.node_count() == 0;
        let brought = files::import(Arc::make_mut(&mut self.scene.document), path, loaded)?;
        self.push_with_room(brought.edit)?;
        self.scene.keep_of(&brought.kept, Some);
        if was_empty {
            self.camera = ViewCamera::of_document(&self.scene.document, self.aspect());
        }
        Ok(Arrived { node: brought.node, changed: brought.changed })
    }

    /// Applies an edit that brings meshes, when the device has room for the scene with them.
    fn push_with_room(&mut self, edit: Edit) -> anyhow::Result<()> {
        let needed = room::with_edit(&self.scene.document, &self.sync, &edit);
        room::check(needed, self.device.memory_budget())?;
        Ok(self.push(edit)?)
    }

    /// Gives an instance a prefab of its own, a copy of that which it shares with others.
    ///
    /// # Errors
    /// When the node is no instance, or shares its prefab with none, or the scene does not fit on the device with the copy.
    pub fn make_unique(&mut self, node: NodeId) -> anyhow::Result<()> {
        let copies = Arc::make_mut(&mut self.scene.document).make_unique_edit(node)?;
        self.push_with_room(copies.edit.clone())?;
        let kept = self.scene.meta.clone();
        self.scene.keep_of(&kept, |id| copies.id_of(id));
        Ok(())
    }

    /// Puts what was loaded in the place of a prefab's source, as one undo step. Instances keep their overrides.
    /// Returns how many edited materials the new source has no more; they stay in the project, and the log names them.
    ///
    /// # Errors
    /// When it is no model, or does not fit on the device; the document stays as it was.
    pub fn replace_source(&mut self, prefab: PrefabId, loaded: Loaded) -> anyhow::Result<usize> {
        let Loaded::Model(imported) = loaded else {
            anyhow::bail!("only a model (.gltf, .glb, .obj) can be the source of an instance")
        };
        let edit = Arc::make_mut(&mut self.scene.document).reload_edit(prefab, *imported)?;
        let lost = match &edit {
            Edit::ReplacePrefab(package) => {
                package.beside.iter().map(|(_, entry)| entry.value.name.clone()).collect()
            }
            _ => Vec::new(),
        };
        self.push_with_room(edit)?;
        for name in &lost {
            tracing::warn!(
                "the edited material \"{name}\" is not in the new source; it stays in the project, unused"
            );
        }
        Ok(lost.len())
    }

    /// Saves the project, with camera and settings of the view.
    ///
    /// # Errors
    /// When the file cannot be written; the old one stays.
    pub fn save(&mut self, path: &Path) -> anyhow::Result<()> {
        let settings = self.settings().clone();
        files::note_view(&mut self.scene.meta, &self.camera, &settings);
        Ok(self.scene.save(path)?)
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
