//! The frames of a session and what is read from them. Enters: a size, a pixel. Leaves: recorded commands, images,
//! figures. The document only has its changes drained here.

use std::collections::BTreeSet;
use std::sync::Arc;

use caustica_renderer::Statistics;
use caustica_renderer::gpu::{Acquired, Image, Recorder};
use caustica_scene::{Document, NodeId, Target};

use super::view_size::is_out_of_memory;
use super::{HostTimes, Lap, Pick, Session, Tally};
use crate::sync::{camera_of, instance_id};

/// A still view stops asking for frames at this many samples.
const CONVERGED_SAMPLES: u64 = 4096;

impl Session {
    /// Syncs the document and records one frame of the view, `extent_px` large at full resolution.
    ///
    /// # Errors
    /// When a shader does not compile or fit, memory runs out, or the device is lost.
    pub fn begin_frame(&mut self, extent_px: [u32; 2]) -> anyhow::Result<Recorder> {
        self.begin_frame_at(extent_px, |_| None)
    }

    /// Like [`Self::begin_frame`], with one pixel for `divisor` x `divisor` of the view, as while something moves on a slow device.
    /// `divisor` is asked once it is known whether the view or what it shows has moved; `None`: as in the last frame. Where
    /// memory is short, textures give way, then the size of a view in a window ([`Self::least_divisor`]).
    ///
    /// # Errors
    /// As [`Self::begin_frame`].
    pub fn begin_frame_at(
        &mut self,
        extent_px: [u32; 2],
        mut divisor: impl FnMut(bool) -> Option<u32>,
    ) -> anyhow::Result<Recorder> {
        self.grow_back();
        let mut has_let_go = false;
        loop {
            match self.try_frame(extent_px, &mut divisor) {
                Ok(recorder) => {
                    self.note_size();
                    return Ok(recorder);
                }
                // What the scene needs comes before the detail of its textures, and of the view.
                Err(error) if is_out_of_memory(&error) && self.make_room(&mut has_let_go) => {
                    self.resync = true
                }
                Err(error) => return Err(self.advise(error)),
            }
        }
    }

    fn try_frame(
        &mut self,
        extent_px: [u32; 2],
        divisor: &mut dyn FnMut(bool) -> Option<u32>,
    ) -> anyhow::Result<Recorder> {
        if std::mem::take(&mut self.resync) {
            self.send_all_again()?;
        }
        let mut lap = Lap::start();
        let mut recorder = self.frames.begin()?;
        self.renderer.note_times(self.view, &self.frames)?;
        self.host_times.begin_ms = lap.ms();
        match self.record(&mut recorder, extent_px, divisor) {
            Ok(()) => Ok(recorder),
            Err(error) => {
                // Uploads and builds recorded until then count as done: they must reach the device.
                self.frames.submit(recorder, None)?;
                Err(error)
            }
        }
    }

    /// After a change that the device had no room for, part of which is there: takes the scene off it and waits until its memory is free;
    /// the next delta sends the whole document.
    fn send_all_again(&mut self) -> anyhow::Result<()> {
        // Marked first: should this fail too, the next frame still sends everything.
        Arc::make_mut(&mut self.scene.document).mark_all_added("tried again");
        let mut recorder = self.frames.begin()?;
        let emptied = self.renderer.apply(&mut recorder, &std::mem::take(&mut self.sync).clear());
        self.frames.submit(recorder, None)?;
        emptied?;
        Ok(self.frames.trim()?)
    }

    fn record(
        &mut self,
        recorder: &mut Recorder,
        extent_px: [u32; 2],
        divisor: &mut dyn FnMut(bool) -> Option<u32>,
    ) -> anyhow::Result<()> {
        let mut lap = Lap::start();
        let eye = self.camera.world_from_camera.translation;
        let changed = self
            .scene
            .document
            .has_changes()
            .then(|| Arc::make_mut(&mut self.scene.document).drain_changes());
        let delta = self.sync.delta_of(&self.scene.document, &changed.unwrap_or_default(), eye);
        self.host_times.sync_ms = lap.ms();
        let selection_stale = self.selection_changed || !delta.instances.is_empty();
        if let Err(error) = self.renderer.apply(recorder, &delta) {
            // Half of the change is in: the next frame sends the whole scene again.
            self.resync = true;
            return Err(error.into());
        }
        self.host_times.apply_ms = lap.ms();
        if selection_stale {
            self.renderer.select(self.view, outlined(&self.scene.document, &self.selection).into_iter())?;
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
        let wanted = divisor(view.is_about_to_move()).unwrap_or(view.divisor());
        view.set_divisor(wanted.max(self.view_size.divisor));
        self.renderer.render(recorder, self.view)?;
        self.tally.note(self.renderer.statistics(self.view)?);
        self.host_times.render_ms = lap.ms();
        Ok(())
    }

    /// Where the host's time of the last frame went.
    pub fn host_times(&self) -> HostTimes {
        self.host_times
    }

    /// Starts a frame that leaves the view's image as it was: the window repaints its panels alone.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn begin_ui_frame(&mut self) -> anyhow::Result<Recorder> {
        let recorder = self.frames.begin()?;
        self.renderer.note_times(self.view, &self.frames)?;
        self.renderer.note_error(self.view, recorder.slot())?;
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

    /// Renders one frame without a window and does not wait for it.
    ///
    /// # Errors
    /// As [`Self::begin_frame`] and [`Self::submit`].
    pub fn render_frame(&mut self, extent_px: [u32; 2]) -> anyhow::Result<()> {
        let recorder = self.begin_frame(extent_px)?;
        self.submit(recorder, None)
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

    /// Whether more frames would hardly change the image, or it is as good as was asked for.
    pub fn is_converged(&self) -> bool {
        self.samples() >= CONVERGED_SAMPLES || self.is_good_enough()
    }

    /// Whether nothing is left to do: no sample, no structure that is still built or made better, no texture that waits.
    pub fn is_done(&self) -> bool {
        self.is_converged()
            && !self.renderer.is_busy()
            && !self.textures_settle()
            && !self.renderer.shaders_wait()
    }

    /// Whether it is still open how much of the textures fits; when it is known, samples begin anew.
    pub fn textures_settle(&self) -> bool {
        self.renderer.textures_settle()
    }

    /// Whether acceleration structures are left to later frames.
    pub fn builds_in_background(&self) -> bool {
        self.renderer.is_busy()
    }

    /// Whether edited shaders are being compiled, or are ready to be taken over.
    pub fn compiles_shaders(&self) -> bool {
        self.renderer.compiles_shaders()
    }

    /// What is seen through a pixel of the last frame. Waits for the device.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn pick(&mut self, pixel: [u32; 2]) -> anyhow::Result<Option<Pick>> {
        let Some(hit) = self.renderer.pick(&mut self.frames, self.view, pixel)? else { return Ok(None) };
        let node = NodeId(hit.instance.node);
        let is_prefab = self.scene.document.node(node).is_some_and(|node| node.prefab().is_some());
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

    /// Milliseconds of all passes of the newest frame that has finished; `None` before the first one.
    pub fn device_ms(&self) -> Option<f64> {
        total_ms(&self.statistics().passes)
    }

    /// Milliseconds of all passes of all frames known to have finished; after [`Self::finish`] those of all.
    pub fn total_device_ms(&self) -> f64 {
        self.frames.total_ms()
    }

    /// What all frames did together.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// The accumulated radiance. Waits for the device.
    ///
    /// # Errors
    /// When there is no frame yet or the device is lost.
    pub fn read_back(&mut self) -> anyhow::Result<caustica_renderer::Accumulated> {
        Ok(self.renderer.read_back(&mut self.frames, self.view)?)
    }

    /// The radiance of the last frame, denoised where that frame was. Waits for the device.
    ///
    /// # Errors
    /// When there is no frame yet or the device is lost.
    pub fn read_frame(&mut self) -> anyhow::Result<Vec<[f32; 3]>> {
        Ok(self.renderer.read_frame(&mut self.frames, self.view)?)
    }

    /// The tone-mapped image, linear. Waits for the device.
    ///
    /// # Errors
    /// When there is no frame yet or the device is lost.
    pub fn read_display(&mut self) -> anyhow::Result<Vec<[f32; 4]>> {
        Ok(self.renderer.read_display(&mut self.frames, self.view)?)
    }
}

/// A sum of nothing is no time, and in Rust it is -0.
fn total_ms(passes: &[(String, f64)]) -> Option<f64> {
    passes.iter().map(|(_, ms)| *ms).reduce(|a, b| a + b)
}

/// Instances of the selected targets and of everything below them.
fn outlined(document: &Document, selection: &BTreeSet<Target>) -> Vec<caustica_renderer::delta::InstanceId> {
    let mut waiting: Vec<Target> = selection.iter().copied().collect();
    let mut found = Vec::new();
    while let Some(target) = waiting.pop() {
        if document.mesh_of(target).is_some() {
            found.push(instance_id(target));
        }
        waiting.extend(document.children_of(target));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn before_the_first_frame_there_is_no_time() {
        assert_eq!(total_ms(&[]), None);
        let passes = [("gbuffer", 0.25), ("shadow", 0.5)].map(|(label, ms)| (label.to_owned(), ms));
        assert_eq!(total_ms(&passes), Some(0.75));
    }
}
