//! The renderer: apply a delta, render a view, read it back. Owns the scene on the device and the views.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_gpu::{Buffer, BufferUse, Device, Frames, Location, MemoryUse, Recorder};
use glam::Vec3;

use crate::accel::{Accel, AccelPolicy};
use crate::delta::{Camera, InstanceId, Invalidation, SceneDelta};
use crate::error::{RendererError, Result};
use crate::frame;
use crate::inventory::{self, Inventory};
use crate::measure::Statistics;
use crate::needs::Needs;
use crate::passes::{Builder, PassSet, ScenePasses};
use crate::sampling::Sampling;
use crate::settings::{Pipeline, Primary, ViewSettings};
use crate::shader::{
    HeldShader, Reloader, ShaderFiles, ShaderLibrary, ShaderSources, ShaderStatus, SpirvCache, TakenOver,
    Wake,
};
use crate::summary::Summary;
use crate::tables::{Changed, Tables, changes_image};
use crate::view::{CameraMatrices, View, ViewId};

mod read_back;

/// How to make a renderer.
#[derive(Clone, Debug, Default)]
pub struct RendererOptions {
    /// Read shaders from this folder instead of the copy in the binary.
    pub shaders: Option<PathBuf>,
    /// Shaders of that folder are edited: pipelines are made anew when a file changes, and this is called, on another thread, when
    /// the next frame will show it.
    pub watch_shaders: Option<WakeFn>,
    /// Shaders of that folder that did not finish: others are used in their place.
    pub held_shaders: Vec<HeldShader>,
    /// When acceleration structures are built, refitted and compacted.
    pub acceleration: AccelPolicy,
    /// Rays find the first surfaces faster than the rasteriser does: what [`Primary::Auto`] means.
    pub primary_rays_pay: bool,
}

/// See [`RendererOptions::watch_shaders`].
#[derive(Clone)]
pub struct WakeFn(pub Wake);

impl std::fmt::Debug for WakeFn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("WakeFn")
    }
}

/// What is seen through a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickHit {
    /// Which instance.
    pub instance: InstanceId,
    /// Which geometry of its mesh.
    pub geometry: u32,
    /// Distance from the camera along its axis, metres; `None` in an orthographic view.
    pub distance_m: Option<f32>,
}

/// The accumulated image of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Accumulated {
    /// Columns and rows.
    pub extent: [u32; 2],
    /// Samples in every pixel, dropped ones included.
    pub samples: u64,
    /// Mean radiance a pixel, linear RGB, first row at the top.
    pub mean: Vec<[f32; 3]>,
    /// Half the difference of the means of streams A and B: an estimate of the error of the mean.
    pub half_difference: Vec<[f32; 3]>,
}

/// Scene, views and pipelines on one device.
pub struct Renderer {
    device: Arc<Device>,
    library: Arc<ShaderLibrary>,
    reloader: Option<Reloader>,
    tables: Tables,
    accel: Accel,
    primary_rays_pay: bool,
    scene_passes: ScenePasses,
    views: BTreeMap<ViewId, View>,
    next_view: u32,
    passes: HashMap<(Pipeline, Needs, Sampling), PassSet>,
    summary: Summary,
    changed: Changed,
    picked: Buffer,
    /// Cameras and sizes of all views when the scene was brought up to date last.
    last_views: Vec<(Camera, [u32; 2])>,
}

impl Renderer {
    /// Makes a renderer with an empty scene. Records and waits for a few uploads.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn new(device: &Arc<Device>, frames: &mut Frames, options: &RendererOptions) -> Result<Self> {
        let mut recorder = frames.begin()?;
        let tables = Tables::new(device, &mut recorder)?;
        frames.submit(recorder, None)?;
        let sources = ShaderSources::new(options.shaders.clone()).holding(options.held_shaders.clone());
        let edited = options.watch_shaders.is_some();
        let library = Arc::new(ShaderLibrary::new(device, sources, SpirvCache::of_user(), edited));
        let wake = options.watch_shaders.clone();
        let reloader = wake.and_then(|WakeFn(wake)| Reloader::new(&library, wake));
        let kind = MemoryUse::Staging;
        Ok(Self {
            device: Arc::clone(device),
            scene_passes: ScenePasses::new(device, &library)?,
            library,
            reloader,
            tables,
            accel: Accel::new(device, options.acceleration)?,
            primary_rays_pay: options.primary_rays_pay,
            views: BTreeMap::new(),
            next_view: 0,
            passes: HashMap::new(),
            summary: Summary::default(),
            changed: Changed { all: true, ..Changed::default() },
            picked: Buffer::new(device, "pick", 32, BufferUse::General, Location::ReadBack, kind)?,
            last_views: Vec::new(),
        })
    }

    /// Takes a change of the scene in, and brings tables and acceleration structures up to date. To be called once a
    /// frame, before the views are rendered, with an empty delta too: what moved in the last frame comes to rest.
    ///
    /// # Errors
    /// When the delta names what is not there, or memory runs out.
    pub fn apply(&mut self, recorder: &mut Recorder, delta: &SceneDelta) -> Result<()> {
        self.tables.settle();
        self.take_over_shaders();
        if !delta.is_empty() {
            let shows = changes_image(delta, &self.tables);
            let applied = self.tables.apply(recorder, delta, &mut self.changed);
            applied.inspect_err(|_| self.changed.all = true)?;
            let what =
                if delta.render_origin_changed { Invalidation::Everything } else { Invalidation::Scene };
            let reason = if delta.reason.is_empty() { "scene" } else { &delta.reason };
            if shows {
                self.invalidate(what, reason);
            }
        }
        if self.changed.all || !delta.is_empty() {
            self.summary.follow(delta, &mut self.tables, self.changed.all);
        }
        let views: Vec<(Camera, [u32; 2])> =
            self.views.values().map(|view| (*view.camera(), view.extent())).collect();
        let at_rest = delta.is_empty() && views == self.last_views;
        self.last_views = views;
        if self.tables.settle_textures(recorder, at_rest, &self.last_views)? {
            self.invalidate(Invalidation::Scene, "detail of textures");
        }
        let slot = recorder.slot();
        let mut changed = std::mem::take(&mut self.changed);
        if let Err(error) = self.tables.flush(recorder, &self.scene_passes, &mut changed) {
            self.changed = Changed { all: true, ..changed };
            return Err(error);
        }
        match self.accel.update(recorder, &self.tables, &changed, &self.scene_passes) {
            Ok(true) => self.invalidate(Invalidation::Scene, "built what was pending"),
            Ok(false) => {}
            Err(error) => {
                self.changed = Changed { all: true, ..changed };
                return Err(error);
            }
        }
        self.tables.textures.update_set(slot);
        let Tables { environment, textures, .. } = &mut self.tables;
        environment.update_set(slot, textures.set_of(slot));
        self.accel.update_set(slot, self.tables.textures.set_of(slot));
        Ok(())
    }

    /// Takes over pipelines that were made anew; [`Self::apply`] does it too. True: views begin anew.
    pub fn take_over_shaders(&mut self) -> bool {
        let Some(TakenOver { files, fills_tables }) = self.reloader.as_mut().and_then(Reloader::take_over)
        else {
            return false;
        };
        self.passes.retain(|_, passes| !passes.owner.is_outdated());
        self.changed.all |= fills_tables;
        self.invalidate(Invalidation::Everything, &format!("shader {}", files.join(", ")));
        true
    }

    /// Whether [`Self::take_over_shaders`] has something to take over, or to tell of.
    pub fn shaders_wait(&self) -> bool {
        self.reloader.as_ref().is_some_and(Reloader::is_waiting)
    }

    /// Where shaders are edited.
    pub fn shader_folder(&self) -> Option<PathBuf> {
        self.reloader.as_ref().and_then(|_| self.library.folder())
    }

    /// Takes shaders from a folder from now on and makes pipelines anew when a file in it changes; see
    /// [`RendererOptions::watch_shaders`].
    pub fn edit_shaders(&mut self, folder: &Path, wake: Wake) {
        self.library.edit(folder);
        // Made anew of groups that can be compiled one by one.
        self.passes.clear();
        self.reloader = Reloader::new(&self.library, wake);
    }

    /// The shader files that pipelines were made of so far: main files with what they include.
    pub fn shader_files(&self) -> Arc<ShaderFiles> {
        self.library.files()
    }

    /// All shaders; tells on any thread which ones are to blame for a pass that does not finish.
    pub fn shader_library(&self) -> &Arc<ShaderLibrary> {
        &self.library
    }

    /// How it stands with shaders that are edited.
    pub fn shader_status(&self) -> ShaderStatus {
        self.reloader.as_ref().map(Reloader::status).unwrap_or_default()
    }

    /// Whether edited shaders are being compiled, or are ready to be taken over.
    pub fn compiles_shaders(&self) -> bool {
        self.reloader.as_ref().is_some_and(|reloader| reloader.is_compiling() || reloader.is_waiting())
    }

    fn invalidate(&mut self, what: Invalidation, reason: &str) {
        for view in self.views.values_mut() {
            view.accumulation.invalidate(what, reason);
        }
    }

    /// Whether acceleration structures are left to be built or to be made better in later frames.
    pub fn is_busy(&self) -> bool {
        self.accel.is_busy()
    }

    /// Whether it is still open which levels of the textures have room; [`Self::apply`] goes on with it. At the end views begin anew.
    pub fn textures_settle(&self) -> bool {
        self.tables.textures.is_settling()
    }

    /// Makes room where memory has run out: textures get half of what they have once the whole scene was taken in anew. False: there is no
    /// more to be had from them.
    pub fn give_up_textures(&mut self) -> bool {
        self.tables.textures.give_up_half()
    }

    /// What is on the device, by id. Waits for the device.
    ///
    /// # Errors
    /// When tables contradict each other, or the device fails.
    pub fn inventory(&self, frames: &mut Frames) -> Result<Inventory> {
        inventory::take(&self.tables, &self.accel, frames)
    }

    /// Makes a view. `window`: its image is encoded for a window and carries the outline of the selection.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn create_view(&mut self, extent: [u32; 2], settings: ViewSettings, window: bool) -> Result<ViewId> {
        let id = ViewId(self.next_view);
        self.next_view += 1;
        self.views.insert(id, View::new(&self.device, extent, settings, window)?);
        Ok(id)
    }

    /// Drops a view.
    pub fn remove_view(&mut self, id: ViewId) {
        self.views.remove(&id);
    }

    /// A view.
    ///
    /// # Errors
    /// When it was removed.
    pub fn view(&self, id: ViewId) -> Result<&View> {
        self.views.get(&id).ok_or_else(|| RendererError::Unknown { what: "view", id: id.0.to_string() })
    }

    /// A view, to be changed.
    ///
    /// # Errors
    /// When it was removed.
    pub fn view_mut(&mut self, id: ViewId) -> Result<&mut View> {
        self.views.get_mut(&id).ok_or_else(|| RendererError::Unknown { what: "view", id: id.0.to_string() })
    }

    /// Outlines these instances in a view. Keeps the samples.
    ///
    /// # Errors
    /// When the view was removed, or memory runs out.
    pub fn select(&mut self, id: ViewId, instances: impl Iterator<Item = InstanceId>) -> Result<()> {
        let slots: Vec<u32> =
            instances.filter_map(|instance| self.tables.instances.slot_of(instance)).collect();
        let mut bits = vec![0_u32; slots.iter().max().map_or(0, |last| *last as usize / 32 + 1)];
        for slot in slots {
            bits[slot as usize / 32] |= 1 << (slot % 32);
        }
        self.view_mut(id)?.set_selection(&bits)
    }

    /// Records one frame of a view.
    ///
    /// # Errors
    /// When a shader does not compile or fit, or memory runs out.
    pub fn render(&mut self, recorder: &mut Recorder, id: ViewId) -> Result<()> {
        let view = self.view(id)?;
        let settings = view.settings().clone();
        let primary = match settings.primary {
            Primary::Auto if self.primary_rays_pay => Primary::Rays,
            primary => primary,
        };
        let needs = Needs::of(self.summary.scene(), &ViewSettings { primary, ..settings.clone() });
        let key = (settings.pipeline, needs, view.sampling());
        self.prepare_passes(key, id, recorder.slot())?;
        if settings.multiple_scattering {
            self.tables.provide_ggx_albedo(recorder)?;
        }
        let (Some(view), Some(passes)) = (self.views.get_mut(&id), self.passes.get(&key)) else {
            return Ok(());
        };
        frame::read_counters(view, recorder.slot());
        frame::record(recorder, view, &self.tables, &self.accel, passes, needs)?;
        view.statistics.left_out = needs.left_out(&settings);
        view.statistics.samples = view.accumulation.samples();
        view.accumulation.reason().clone_into(&mut view.statistics.reset_reason);
        view.statistics.resets = view.accumulation.resets();
        view.statistics.uploaded_bytes = recorder.uploaded_bytes();
        view.statistics.acceleration = self.accel.statistics().clone();
        view.statistics.memory =
            self.device.memory_by_use().into_iter().map(|(kind, n)| (kind.name().to_owned(), n)).collect();
        Ok(())
    }

    /// Takes over the times of the newest frame that has finished; to be called once after each `Frames::begin`.
    ///
    /// # Errors
    /// When the view was removed.
    pub fn note_times(&mut self, id: ViewId, frames: &Frames) -> Result<()> {
        let view = self.view_mut(id)?;
        if let Some(times) = view.bands.note(frames.finished()) {
            view.statistics.passes = times;
        }
        Ok(())
    }

    /// Takes over the error that a finished frame of this slot has measured, for frames that do not render.
    ///
    /// # Errors
    /// When the view was removed.
    pub fn note_error(&mut self, id: ViewId, slot: usize) -> Result<()> {
        self.view_mut(id)?.note_error(slot);
        Ok(())
    }

    /// Figures of a view's last frame, with the counters of all frames when `frames` has finished.
    ///
    /// # Errors
    /// When the view was removed.
    pub fn statistics(&self, id: ViewId) -> Result<&Statistics> {
        Ok(self.view(id)?.statistics())
    }

    fn prepare_passes(
        &mut self,
        key: (Pipeline, Needs, Sampling),
        id: ViewId,
        frame_slot: usize,
    ) -> Result<()> {
        let (_, needs, sampling) = key;
        let mut specialization = needs.specialization();
        specialization.values.extend(sampling.specialization().values);
        let owner = self.passes.get(&key).map(|passes| Arc::clone(&passes.owner)).unwrap_or_default();
        owner.set_used(self.device.recording());
        let builder = Builder {
            device: &self.device,
            library: &self.library,
            layout: self.tables.textures.set_of(frame_slot).layout(),
            needs,
            specialization,
            owner,
        };
        let passes = match self.passes.entry(key) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(PassSet::new(&builder)?),
        };
        let view = self
            .views
            .get(&id)
            .ok_or_else(|| RendererError::Unknown { what: "view", id: id.0.to_string() })?;
        passes.prepare(&builder, view)
    }

    /// Bytes that [`Self::read_back`] takes for a while.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet.
    pub fn read_back_bytes(&self, id: ViewId) -> Result<u64> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        Ok(self.view(id)?.accumulator.as_ref().ok_or_else(nothing)?.size())
    }

    /// Direction and origin, render space, of the ray through the centre of a pixel.
    ///
    /// # Errors
    /// When the view was removed.
    pub fn camera_ray(&self, id: ViewId, pixel: [f32; 2]) -> Result<(Vec3, Vec3)> {
        let view = self.view(id)?;
        let matrices = CameraMatrices::of(view.camera(), view.extent());
        let [width, height] = view.extent().map(|n| n as f32);
        let at = matrices.half_extent
            * glam::Vec2::new(2.0 * pixel[0] / width - 1.0, 1.0 - 2.0 * pixel[1] / height);
        let camera = view.camera().render_from_camera;
        Ok(if matrices.orthographic {
            (camera.transform_point3(at.extend(0.0)), camera.transform_vector3(Vec3::NEG_Z))
        } else {
            (camera.translation.into(), camera.transform_vector3(at.extend(-1.0)).normalize())
        })
    }
}
