//! A view: one camera, one choice of pipeline, its targets, its history and its frame counter.
//! Moving a view's camera resets that view alone; an edit of the scene resets all of them.

mod bands;
mod camera;
mod measuring;
mod targets;

use std::sync::Arc;

use caustica_gpu::{Buffer, BufferUse, Device, Frames, Image, Location, MemoryUse, Recorder};

pub(crate) use bands::Bands;
pub(crate) use camera::CameraMatrices;
pub(crate) use measuring::Measuring;
pub(crate) use targets::{History, Past, Targets};

use crate::accumulation::Accumulation;
use crate::delta::{Camera, Invalidation, LightId};
use crate::error::Result;
use crate::gpu_types::AccumulatorPixel;
use crate::measure::Statistics;
use crate::needs::Needs;
use crate::renderer::Accumulated;
use crate::sampling::Sampling;
use crate::settings::{Pipeline, Show, ToneMap, ViewSettings};

/// Names a view of a renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ViewId(pub(crate) u32);

/// One view of the scene.
pub struct View {
    device: Arc<Device>,
    camera: Camera,
    settings: ViewSettings,
    /// Size in pixels at full resolution.
    full_extent: [u32; 2],
    /// What the full resolution is divided by.
    divisor: u32,
    /// Samples that the caller is going to take; `None`: nobody knows.
    sample_target: Option<u64>,
    extent: [u32; 2],
    pub(crate) accumulation: Accumulation,
    pub(crate) statistics: Statistics,
    /// Instance slots that are outlined, as a bit set, and its copy for the device; made anew when they change.
    selection: Option<(Vec<u32>, Buffer)>,
    selection_revision: u64,
    /// Targets of the present extent, with what they were made for; made at the first frame.
    pub(crate) targets: Option<((Needs, Pipeline), Targets)>,
    /// The past of the targets that were let go with their size, and what those were made for.
    retired: Option<((Needs, Pipeline), Past)>,
    pub(crate) accumulator: Option<Buffer>,
    pub(crate) counters: Counters,
    /// Camera of the last frame, without jitter.
    pub(crate) previous: Option<CameraMatrices>,
    /// Which history images the temporal pass filled last; `None`: there is no history.
    pub(crate) history: Option<usize>,
    /// Parity of the G-buffer that was recorded last; `None`: there is none.
    pub(crate) seen: Option<usize>,
    /// The window's image of the last size, shown until the first sample of the new size is complete.
    last_window: Option<Image>,
    /// Frames rendered; its parity chooses among the history images.
    pub(crate) frame_count: u64,
    /// How still samples are cut into submits.
    pub(crate) bands: Bands,
    /// What the display image was made with.
    pub(crate) displayed: Option<Displayed>,
    /// What is measured of the picture.
    pub(crate) measuring: Measuring,
    /// The image goes to a window: the last pass encodes it and draws the outline.
    window: bool,
}

/// What the display depends on beside the samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Displayed {
    exposure_ev: f32,
    tone_map: ToneMap,
    show: Show,
    show_light: Option<LightId>,
    selection_revision: u64,
    reference_revision: u64,
}

/// The device's counters and their copies for the host, one a frame in flight.
pub(crate) struct Counters {
    pub(crate) device: Buffer,
    pub(crate) host: Vec<Buffer>,
}

impl View {
    pub(crate) fn new(
        device: &Arc<Device>,
        extent: [u32; 2],
        settings: ViewSettings,
        window: bool,
    ) -> Result<Self> {
        let counter = |location| {
            Buffer::new(device, "frame counters", 16, BufferUse::General, location, MemoryUse::Staging)
        };
        let host = (0..Frames::in_flight())
            .map(|_| counter(Location::ReadBack))
            .collect::<std::result::Result<_, _>>()?;
        Ok(Self {
            device: Arc::clone(device),
            camera: Camera::default(),
            settings,
            full_extent: extent.map(|n| n.max(1)),
            divisor: 1,
            sample_target: None,
            extent: extent.map(|n| n.max(1)),
            accumulation: Accumulation::default(),
            statistics: Statistics::default(),
            selection: None,
            selection_revision: 0,
            targets: None,
            retired: None,
            accumulator: None,
            counters: Counters { device: counter(Location::Device)?, host },
            previous: None,
            history: None,
            seen: None,
            last_window: None,
            frame_count: 0,
            bands: Bands::default(),
            displayed: None,
            measuring: Measuring::default(),
            window,
        })
    }

    /// Size in pixels, as it is rendered.
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Settings.
    pub fn settings(&self) -> &ViewSettings {
        &self.settings
    }

    /// Camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Whether the image goes to a window.
    pub fn is_for_window(&self) -> bool {
        self.window
    }

    /// Figures of the last frame.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Samples accumulated.
    pub fn samples(&self) -> u64 {
        self.accumulation.samples()
    }

    /// Device time that one submit of a still view may take: a slower sample is cut into several. `None`: never cut,
    /// as for headless runs.
    pub fn set_submit_budget(&mut self, budget_ms: Option<f64>) {
        self.bands.set_budget(budget_ms);
    }

    /// What the display would be made with now.
    pub(crate) fn display_key(&self) -> Displayed {
        Displayed {
            exposure_ev: self.settings.exposure_ev,
            tone_map: self.settings.tone_map,
            show: self.settings.show,
            show_light: self.settings.show_light,
            selection_revision: self.selection_revision,
            reference_revision: self.measuring.reference_revision,
        }
    }

    /// Outlines the instance slots of a bit set.
    pub(crate) fn set_selection(&mut self, bits: &[u32]) -> Result<()> {
        // Memory that is written for the device may be slow to read.
        if self.selection.as_ref().map_or(&[][..], |(bits, _)| bits) == bits {
            return Ok(());
        }
        self.selection = None;
        self.selection_revision += 1;
        if !bits.is_empty() {
            let (usage, kind) = (BufferUse::General, MemoryUse::Tables);
            let size = size_of_val(bits) as u64;
            let mut buffer = Buffer::new(&self.device, "selection", size, usage, Location::Upload, kind)?;
            buffer.mapped_mut().copy_from_slice(bytemuck::cast_slice(bits));
            self.selection = Some((bits.to_vec(), buffer));
        }
        Ok(())
    }

    /// Device address of the bit set of the outlined slots and how many slots it covers; 0 when nothing is outlined.
    pub(crate) fn selection(&self) -> (u64, u32) {
        self.selection.as_ref().map_or((0, 0), |(bits, buffer)| (buffer.address(), bits.len() as u32 * 32))
    }

    /// Starts the sample set at `offset`. Resets the view.
    pub fn set_sample_offset(&mut self, offset: u64) {
        self.accumulation.set_offset(offset);
    }

    /// Says how many samples are going to be taken, as far as known: Hammersley sets are made for a number. Resets the
    /// view when its samples depend on it.
    pub fn set_sample_target(&mut self, samples: Option<u64>) {
        let before = self.sampling();
        self.sample_target = samples;
        if self.sampling() != before {
            self.accumulation.invalidate(Invalidation::Everything, "number of samples");
        }
    }

    /// What the picture is compared with, where it has the same size; `None`: nothing. Keeps the samples.
    pub fn set_reference(&mut self, reference: Option<Arc<Accumulated>>) {
        self.measuring.set_reference(reference);
    }

    /// Whether there is something that the picture is compared with.
    pub fn has_reference(&self) -> bool {
        self.measuring.has_reference()
    }

    /// Asks for the error of the picture with its next sample; it is in [`Statistics::error`] some frames later.
    pub fn measure(&mut self) {
        self.measuring.wanted = true;
    }

    /// Whether the next frame shows another place or another scene than the last.
    pub fn is_about_to_move(&self) -> bool {
        matches!(self.accumulation.pending(), Invalidation::Camera | Invalidation::Scene)
    }

    /// How random numbers are drawn.
    pub(crate) fn sampling(&self) -> Sampling {
        Sampling::of(self.settings.sampler, self.sample_target)
    }

    /// Moves the camera. Resets the view when it differs from the last one.
    pub fn set_camera(&mut self, camera: Camera) {
        if camera != self.camera {
            self.camera = camera;
            self.accumulation.invalidate(Invalidation::Camera, "camera");
        }
    }

    /// Changes settings. Exposure, tone map, what is shown and the choice of variants keep the samples.
    pub fn set_settings(&mut self, settings: ViewSettings) {
        let what = invalidation_of(&self.settings, &settings);
        let reason = match &self.settings {
            old if old.pipeline != settings.pipeline => "pipeline",
            old if old.sampler != settings.sampler => "sampler",
            _ => "render settings",
        };
        self.settings = settings;
        self.accumulation.invalidate(what, reason);
    }

    /// Changes the size at full resolution. Resets the view when it differs from the last one.
    pub fn resize(&mut self, full_extent: [u32; 2]) {
        let full_extent = full_extent.map(|n| n.max(1));
        if full_extent != self.full_extent {
            self.full_extent = full_extent;
            self.follow_extent("size of the view");
        }
    }

    /// Changes what the full resolution is divided by, at least 1. Resets the view when it differs from the last one. The
    /// resolution follows what moves, so that whatever was the last reason stays it.
    pub fn set_divisor(&mut self, divisor: u32) {
        let divisor = divisor.max(1);
        if divisor != self.divisor {
            self.divisor = divisor;
            let reason = self.accumulation.reason().to_owned();
            self.follow_extent(&reason);
        }
    }

    /// What the full resolution is divided by.
    pub fn divisor(&self) -> u32 {
        self.divisor
    }

    /// Lets go of all that can be made anew, with the samples: memory is short. False: there was nothing.
    pub fn let_go(&mut self) -> bool {
        let held = self.targets.is_some() || self.retired.is_some() || self.frame_count > 0;
        self.drop_targets();
        self.accumulator = None;
        held
    }

    fn follow_extent(&mut self, reason: &str) {
        let extent = self.full_extent.map(|side| side.div_ceil(self.divisor));
        if extent != self.extent {
            self.extent = extent;
            self.retire_targets();
            self.accumulator = None;
            self.accumulation.invalidate(Invalidation::Resize, reason);
        }
    }

    /// The tone-mapped image, still linear; `None` before the first frame.
    pub fn display_image(&self) -> Option<&Image> {
        self.targets.as_ref().map(|(_, targets)| &targets.display)
    }

    /// The image encoded for the window; `None` before the first frame and in a view without a window.
    pub fn window_image(&self) -> Option<&Image> {
        let ready = self.displayed.as_ref().and(self.targets.as_ref());
        ready.map_or(self.last_window.as_ref(), |(_, targets)| targets.window.as_ref())
    }

    /// Lets the targets go and keeps what they remember; the window's image stays until there is a new one.
    fn retire_targets(&mut self) {
        if let Some((made_for, mut targets)) = self.targets.take() {
            let window = targets.window.take();
            if self.displayed.take().is_some() {
                self.last_window = window;
            }
            self.retired = targets.into_past().map(|past| (made_for, past));
        }
        self.seen = None;
        self.bands.abandon();
    }

    /// Lets the targets go, and with them what they remember.
    fn drop_targets(&mut self) {
        self.retire_targets();
        self.previous = None;
        self.forget_light();
    }

    /// The light of the frames before is of no use.
    pub(crate) fn forget_light(&mut self) {
        self.retired = None;
        if let Some((_, targets)) = &mut self.targets {
            targets.past = None;
        }
        self.history = None;
    }

    /// A frame is complete; `filled`: the history images that it filled, if it was denoised.
    pub(crate) fn complete(&mut self, matrices: CameraMatrices, filled: Option<usize>) {
        let resized = self.targets.as_mut().is_some_and(|(_, targets)| targets.past.take().is_some());
        // A past of another size lasts for one frame.
        if filled.is_some() || resized {
            self.history = filled;
        }
        self.previous = Some(matrices);
        self.frame_count += 1;
    }

    /// Notes that the display was made.
    pub(crate) fn set_displayed(&mut self, display: Displayed) {
        self.displayed = Some(display);
        self.last_window = None;
    }

    /// Takes over what a finished frame of this slot has measured.
    pub(crate) fn note_error(&mut self, slot: usize) {
        if let Some(found) = self.measuring.take(slot) {
            self.statistics.error = Some(found);
        }
    }

    /// Brings to the device what the measuring of the next sample needs.
    pub(crate) fn prepare_measuring(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.measuring.prepare(&self.device, recorder, self.extent)
    }

    /// Makes targets for these needs unless they are there; the history starts anew with them.
    pub(crate) fn prepare_targets(&mut self, needs: Needs) -> Result<()> {
        let wanted = (needs, self.settings.pipeline);
        if self.targets.as_ref().is_none_or(|(made_for, _)| *made_for != wanted) {
            let past = self.retired.take().filter(|(made_for, _)| *made_for == wanted);
            let (history, previous) = (self.history, self.previous.take());
            // Should the targets find no room, nothing refers to a past any more.
            self.drop_targets();
            let mut targets = Targets::new(&self.device, self.extent, &needs, self.window)?;
            if let Some((_, past)) = past {
                targets.past = Some(past);
                (self.history, self.previous) = (history, previous);
            }
            self.targets = Some((wanted, targets));
        }
        if let Some((_, targets)) = &mut self.targets {
            targets.prepare_shown(&self.device, self.extent, self.settings.show)?;
        }
        if self.accumulator.is_none() {
            let pixels = u64::from(self.extent[0]) * u64::from(self.extent[1]);
            self.accumulator = Some(Buffer::new(
                &self.device,
                "accumulator",
                pixels * size_of::<AccumulatorPixel>() as u64,
                BufferUse::General,
                Location::Device,
                MemoryUse::Targets,
            )?);
            self.accumulation.invalidate(Invalidation::Resize, "size of the view");
        }
        Ok(())
    }
}

/// What a change of settings costs.
fn invalidation_of(old: &ViewSettings, new: &ViewSettings) -> Invalidation {
    let shown_only = ViewSettings {
        exposure_ev: new.exposure_ev,
        tone_map: new.tone_map,
        show: new.show,
        show_light: new.show_light,
        needs: new.needs,
        ..old.clone()
    };
    if shown_only == *new { Invalidation::Nothing } else { Invalidation::Everything }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{NeedsMode, Sampler};

    #[test]
    fn what_only_changes_the_display_keeps_the_samples() {
        let old = ViewSettings::default();
        let kept = ViewSettings {
            exposure_ev: 2.0,
            tone_map: ToneMap::Aces,
            show: Show::Normal,
            show_light: Some(LightId { node: 3, part: 0 }),
            needs: NeedsMode::All,
            ..old.clone()
        };
        assert_eq!(invalidation_of(&old, &kept), Invalidation::Nothing);
        for changed in [
            ViewSettings { pipeline: Pipeline::Raster, ..old.clone() },
            ViewSettings { max_depth: 1, ..old.clone() },
            ViewSettings { seed: 9, ..old.clone() },
            ViewSettings { sampler: Sampler::Halton, ..old.clone() },
            ViewSettings { shadow_rays: 2, ..old.clone() },
        ] {
            assert_eq!(invalidation_of(&old, &changed), Invalidation::Everything);
        }
    }
}
