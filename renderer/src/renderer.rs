//! The renderer: apply a delta, render a view, read it back. Owns the scene on the device and the views.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_gpu::{Buffer, BufferUse, Device, Frames, Image, Location, MemoryUse, Recorder};
use glam::Vec3;

use crate::accel::{Accel, AccelPolicy};
use crate::delta::{Camera, InstanceId, Invalidation, SceneDelta};
use crate::error::{RendererError, Result};
use crate::frame;
use crate::gpu_types::AccumulatorPixel;
use crate::inventory::{self, Inventory};
use crate::measure::Statistics;
use crate::needs::Needs;
use crate::passes::{Builder, PassSet, ScenePasses};
use crate::sampling::Sampling;
use crate::settings::{Pipeline, Primary, ViewSettings};
use crate::shader::{Reloader, ShaderLibrary, ShaderSources, ShaderStatus, SpirvCache, TakenOver, Wake};
use crate::summary::Summary;
use crate::tables::{Changed, Tables, changes_image};
use crate::view::{CameraMatrices, View, ViewId};

/// How to make a renderer.
#[derive(Clone, Debug, Default)]
pub struct RendererOptions {
    /// Read shaders from this folder instead of the copy in the binary.
    pub shaders: Option<PathBuf>,
    /// Shaders of that folder are edited: pipelines are made anew when a file changes, and this is called, on another thread, when
    /// the next frame will show it.
    pub watch_shaders: Option<WakeFn>,
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
        let sources = ShaderSources::new(options.shaders.clone());
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
        self.reloader = Reloader::new(&self.library, wake);
    }

    /// The shader files that pipelines were made of so far: main files with what they include.
    pub fn shader_files(&self) -> BTreeMap<String, Vec<String>> {
        self.library.files()
    }

    /// How it stands with shaders that are edited.
    pub fn shader_status(&self) -> ShaderStatus {
        self.reloader.as_ref().map(Reloader::status).unwrap_or_default()
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
        let view = self.view(id)?;
        let (show, window) = (view.settings().show, view.is_for_window());
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
        passes.prepare(&builder, show, window)
    }

    /// Bytes that [`Self::read_back`] takes for a while.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet.
    pub fn read_back_bytes(&self, id: ViewId) -> Result<u64> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        Ok(self.view(id)?.accumulator.as_ref().ok_or_else(nothing)?.size())
    }

    /// Reads the accumulated image of a view. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet, or the device fails.
    pub fn read_back(&mut self, frames: &mut Frames, id: ViewId) -> Result<Accumulated> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        let accumulator = self.view(id)?.accumulator.as_ref().ok_or_else(nothing)?;
        let size = accumulator.size();
        let kind = MemoryUse::Staging;
        let host =
            Buffer::new(&self.device, "read-back", size, BufferUse::General, Location::ReadBack, kind)?;
        let mut recorder = frames.begin()?;
        let slot = recorder.slot();
        recorder.copy_buffer(accumulator, &host, size)?;
        let counters = &self.view(id)?.counters;
        let copied = &counters.host[slot % counters.host.len()];
        recorder.copy_buffer(&counters.device, copied, counters.device.size())?;
        frames.submit(recorder, None)?;
        frames.finish()?;
        let view = self.view_mut(id)?;
        frame::read_counters(view, slot);
        Ok(mean_of(bytemuck::cast_slice(host.mapped()), view.extent()))
    }

    /// Reads the tone-mapped image of a view: linear RGBA half floats as floats. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet, or the device fails.
    pub fn read_display(&mut self, frames: &mut Frames, id: ViewId) -> Result<Vec<[f32; 4]>> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        let image = self.view(id)?.display_image().ok_or_else(nothing)?;
        let halves: Vec<u16> = words_of(&read_image(&self.device, frames, image)?);
        Ok(halves.chunks_exact(4).map(|p| [0, 1, 2, 3].map(|i| half_to_float(p[i]))).collect())
    }

    /// Reads the radiance of the last frame of a view, denoised where that frame was. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed or has no frame yet, or the device fails.
    pub fn read_frame(&mut self, frames: &mut Frames, id: ViewId) -> Result<Vec<[f32; 3]>> {
        let nothing = || RendererError::Unknown { what: "frame of view", id: id.0.to_string() };
        let (_, targets) = self.view(id)?.targets.as_ref().ok_or_else(nothing)?;
        let floats: Vec<f32> = words_of(&read_image(&self.device, frames, &targets.shaded)?);
        Ok(floats.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect())
    }

    /// What is seen through a pixel in the last frame. Waits for the device.
    ///
    /// # Errors
    /// When the view was removed, or the device fails.
    pub fn pick(&mut self, frames: &mut Frames, id: ViewId, pixel: [u32; 2]) -> Result<Option<PickHit>> {
        let view = self.view(id)?;
        let (Some((_, targets)), Some(parity)) = (view.targets.as_ref(), view.seen) else { return Ok(None) };
        if (0..2).any(|i| pixel[i] >= view.extent()[i]) {
            return Ok(None);
        }
        let depth = &targets.depth[parity % targets.depth.len()];
        let mut recorder = frames.begin()?;
        recorder.copy_to_buffer(&targets.id, pixel, [1, 1], &self.picked, 0)?;
        recorder.copy_to_buffer(depth, pixel, [1, 1], &self.picked, 16)?;
        frames.submit(recorder, None)?;
        frames.finish()?;
        let words: Vec<u32> = words_of(&self.picked.mapped()[..20]);
        let depth = f32::from_bits(words[4]);
        let Some(slot) = words[0].checked_sub(1).and_then(|slot| self.tables.instances.get(slot)) else {
            return Ok(None);
        };
        let matrices = CameraMatrices::of(view.camera(), view.extent());
        Ok(Some(PickHit {
            instance: slot.id,
            geometry: words[1] & 0x7fff_ffff,
            distance_m: (!matrices.orthographic && depth > 0.0).then(|| matrices.near_m / depth),
        }))
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

fn read_image(device: &Arc<Device>, frames: &mut Frames, image: &Image) -> Result<Vec<u8>> {
    let [width, height] = image.extent();
    let size = u64::from(width) * u64::from(height) * image.desc().format.texel_bytes();
    let kind = MemoryUse::Staging;
    let host = Buffer::new(device, "read-back", size, BufferUse::General, Location::ReadBack, kind)?;
    let mut recorder = frames.begin()?;
    recorder.copy_to_buffer(image, [0, 0], [width, height], &host, 0)?;
    frames.submit(recorder, None)?;
    frames.finish()?;
    Ok(host.mapped().to_vec())
}

/// Copies bytes into a vector of plain values, whatever their alignment.
fn words_of<T: bytemuck::Pod>(bytes: &[u8]) -> Vec<T> {
    bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}

/// Mean and half difference of the two streams, in double precision.
fn mean_of(pixels: &[AccumulatorPixel], extent: [u32; 2]) -> Accumulated {
    let count = extent[0] as usize * extent[1] as usize;
    let (mut mean, mut half_difference) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for pixel in pixels.iter().take(count) {
        let sums = [0, 1].map(|s| {
            let stream = &pixel.stream[s];
            [0, 1, 2, 3]
                .map(|c| f64::from(stream.high[c]) + f64::from(stream.low[c]) + f64::from(stream.block[c]))
        });
        let n = sums[0][3] + sums[1][3];
        let channel = |c: usize| if n > 0.0 { (sums[0][c] + sums[1][c]) / n } else { 0.0 };
        let of_stream =
            |s: usize, c: usize| if sums[s][3] > 0.0 { sums[s][c] / sums[s][3] } else { channel(c) };
        mean.push([0, 1, 2].map(|c| channel(c) as f32));
        half_difference.push([0, 1, 2].map(|c| (0.5 * (of_stream(0, c) - of_stream(1, c))) as f32));
    }
    Accumulated { extent, mean, half_difference }
}

/// IEEE 754 binary16 to binary32.
fn half_to_float(half: u16) -> f32 {
    let sign = if half & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from((half >> 10) & 0x1f), f32::from(half & 0x3ff));
    sign * match exponent {
        0 => fraction * 2f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f32.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_become_floats() {
        for (half, value) in [(0x3c00, 1.0), (0xc000, -2.0), (0x0001, 5.960_464_5e-8), (0x7bff, 65504.0)] {
            assert_eq!(half_to_float(half), value);
        }
        assert!(half_to_float(0x7e00).is_nan());
    }
}
