//! The frames of a window: which picture is due, how it reaches the screen, when the next one follows. Enters: the
//! editor's panels. Leaves: submits, and a plan for the event loop.

use std::time::{Duration, Instant};

use anyhow::Context as _;
use caustica_renderer::RendererError;
use caustica_renderer::gpu::{Access, Acquired, GpuError, Recorder, Stage, Use};
use egui::ViewportId;
use egui::epaint::ClippedPrimitive;

use super::{Broken, DEVICE_POLL, EditorWindow, PictureKey};
use crate::theme;

/// A device that takes longer than this from one submit to the next repaints the panels alone while there is input.
const SLOW_MS: f64 = 80.0;
/// Longest time without a new picture while there is input.
const PICTURE_AT_LEAST_EVERY: Duration = Duration::from_millis(250);
/// While the renderer's device is at work beside them panels are drawn no more often, except for input.
const PANELS_AT_MOST_EVERY: Duration = Duration::from_millis(33);
/// Label of the pass that draws the panels.
const UI_PASS: &str = "ui";

impl EditorWindow {
    pub(super) fn frame(&mut self) -> anyhow::Result<()> {
        self.silent = false;
        if self.must_resize {
            self.resize()?;
        }
        if self.swapchain.extent().contains(&0) {
            // Minimised: the next resize brings the window back.
            return Ok(());
        }
        let input = self.input.take_egui_input(&self.window);
        let output = self.context.run_ui(input, |ui| self.editor.ui(ui));
        self.input.handle_platform_output(&self.window, output.platform_output);
        self.set_title();
        self.keep();
        let primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
        self.ui.set_textures(output.textures_delta)?;
        let recorder = if self.apart.is_some() { self.picture_apart()? } else { self.picture()? };
        self.present(recorder, output.pixels_per_point, primitives)?;
        self.had_input = false;
        let delay =
            output.viewport_output.get(&ViewportId::ROOT).map_or(Duration::MAX, |root| root.repaint_delay);
        self.plan_next(delay);
        Ok(())
    }

    fn resize(&mut self) -> anyhow::Result<()> {
        let size = self.window.inner_size();
        self.must_resize = false;
        match self.swapchain.resize([size.width, size.height]) {
            Ok(()) => Ok(()),
            Err(GpuError::SurfaceOutOfDate) => {
                self.must_resize = true;
                Ok(())
            }
            Err(error) => Err(error).context("resizing the window"),
        }
    }

    fn set_title(&mut self) {
        let title = self.editor.title();
        if title != self.title {
            self.window.set_title(&title);
            self.title = title;
        }
    }

    /// Renders the view where that is due; else only opens a frame for the panels.
    fn picture(&mut self) -> anyhow::Result<Recorder> {
        let picture = self.picture_if_due()?;
        self.continuous = picture.is_some();
        match picture {
            Some(recorder) => Ok(recorder),
            None => self.editor.session.begin_ui_frame(),
        }
    }

    /// Fetches a picture that the renderer's device has finished, gives it the next one to do where that is due, and opens a frame of
    /// the panels' device.
    fn picture_apart(&mut self) -> anyhow::Result<Recorder> {
        let Some(apart) = &mut self.apart else { return self.picture() };
        let panels = apart.begin(&mut self.editor.session)?;
        if apart.is_pending() {
            return Ok(panels);
        }
        let picture = self.picture_if_due()?;
        self.continuous = picture.is_some();
        if let (Some(recorder), Some(apart)) = (picture, &mut self.apart) {
            apart.submit_picture(&mut self.editor.session, recorder)?;
        }
        Ok(panels)
    }

    /// A frame of the renderer with the view, where that is due.
    fn picture_if_due(&mut self) -> anyhow::Result<Option<Recorder>> {
        let Some(full) = self.editor.state.view.extent_px else { return Ok(None) };
        let key = self.key(full);
        let fresh = self.shown.as_ref() == Some(&key);
        let waits =
            fresh && self.had_input && self.is_slow() && self.last_picture.elapsed() < PICTURE_AT_LEAST_EVERY;
        let done = fresh && self.editor.session.is_done();
        if waits || done || self.broken.as_ref().is_some_and(|broken| broken.holds(&key)) {
            return Ok(None);
        }
        let config = &self.editor.state.config;
        let target_ms = config.adaptive.then_some(f64::from(config.target_frame_ms));
        let view = &self.editor.state.view;
        let held = view.drag.is_some() || view.flying;
        let adaptive = &mut self.adaptive;
        let begun = self.editor.session.begin_frame_at(full, |moved| {
            Some(adaptive.next(Instant::now(), moved || held, full, target_ms))
        });
        match begun {
            Ok(recorder) => {
                self.broken = None;
                self.editor.state.view.divisor = self.editor.session.divisor();
                self.shown = Some(key);
                self.note_times();
                Ok(Some(recorder))
            }
            Err(error) if is_fatal(&error) => Err(error),
            Err(error) => {
                // What was retired may have made room: tried again by itself, and reported once.
                let again = self.broken.take().filter(|broken| broken.key == key);
                if again.is_none() {
                    self.editor.state.toasts.error(format!("The picture cannot be rendered: {error:#}."));
                }
                self.broken = Some(Broken::after(again, key));
                Ok(None)
            }
        }
    }

    fn key(&self, extent: [u32; 2]) -> PictureKey {
        let session = &self.editor.session;
        let (camera, settings) = (*session.camera(), session.settings().clone());
        PictureKey { camera, settings, state: session.picture_revision(), extent }
    }

    fn note_times(&mut self) {
        let now = Instant::now();
        if self.continuous {
            let interval_ms = now.duration_since(self.last_picture).as_secs_f64() * 1e3;
            self.interval_ms += (interval_ms - self.interval_ms) * 0.3;
        }
        self.last_picture = now;
        let passes = self.editor.session.statistics().passes.iter();
        let ms: f64 = passes.filter(|(label, _)| label != UI_PASS).map(|(_, ms)| ms).sum();
        self.adaptive.measured(ms);
    }

    fn is_slow(&self) -> bool {
        self.interval_ms > SLOW_MS
    }

    /// Draws the panels over the picture and shows them.
    fn present(
        &mut self,
        mut recorder: Recorder,
        points: f32,
        primitives: Vec<ClippedPrimitive>,
    ) -> anyhow::Result<()> {
        let image = match &self.apart {
            Some(apart) => apart.picture(),
            None => self.editor.session.window_image(),
        };
        if let Some(image) = image {
            self.ui.set_view(image)?;
            recorder.declare(&[Use::Image(image, Stage::Raster, Access::Sampled)]);
        }
        let acquired = match self.swapchain.acquire() {
            Ok(acquired) => acquired,
            Err(GpuError::SurfaceOutOfDate) => {
                self.must_resize = true;
                None
            }
            Err(error) => return Err(error).context("asking for the window's image"),
        };
        let Some(acquired) = acquired else {
            self.submit_panels(recorder, None)?;
            self.window.request_redraw();
            return Ok(());
        };
        let clear =
            theme::window_color(self.editor.state.config.dark).to_array().map(|c| f32::from(c) / 255.0);
        let extent = self.swapchain.extent();
        let (swapchain, ui) = (&self.swapchain, &mut self.ui);
        let mut drawn = Ok(());
        recorder.pass(UI_PASS, |recorder| {
            swapchain.begin_rendering(recorder, &acquired, clear);
            drawn = ui.draw(recorder, extent, points, primitives);
            swapchain.end_rendering(recorder, &acquired);
            Ok::<(), GpuError>(())
        })?;
        self.submit_panels(recorder, Some(&acquired))?;
        drawn?;
        self.window.pre_present_notify();
        match self.swapchain.present(acquired) {
            Ok(()) => Ok(()),
            Err(GpuError::SurfaceOutOfDate) => {
                self.must_resize = true;
                self.window.request_redraw();
                Ok(())
            }
            Err(error) => Err(error).context("showing the window's image"),
        }
    }

    fn submit_panels(&mut self, recorder: Recorder, window: Option<&Acquired>) -> anyhow::Result<()> {
        match &mut self.apart {
            Some(apart) => apart.submit(recorder, window),
            None => self.editor.session.submit(recorder, window),
        }
    }

    /// Goes on with a picture that takes several submits, without drawing the panels: nothing they show has changed.
    pub(super) fn silent_frame(&mut self) -> anyhow::Result<()> {
        let Some(full) = self.editor.state.view.extent_px else {
            self.request_redraw();
            return Ok(());
        };
        if self.apart.is_some() && !self.device.has_finished()? {
            self.go_on_soon();
            return Ok(());
        }
        match self.editor.session.begin_frame(full) {
            Ok(recorder) => {
                self.editor.state.view.divisor = self.editor.session.divisor();
                match &mut self.apart {
                    Some(apart) => apart.submit_picture(&mut self.editor.session, recorder)?,
                    None => self.editor.session.submit(recorder, None)?,
                }
            }
            Err(error) if is_fatal(&error) => return Err(error),
            Err(error) => {
                // The next whole frame meets the same error and shows it.
                tracing::debug!("{error:#}");
                self.request_redraw();
                return Ok(());
            }
        }
        self.note_times();
        if self.editor.session.samples() == self.samples {
            self.go_on_soon();
        } else {
            self.request_redraw();
        }
        Ok(())
    }

    fn plan_next(&mut self, repaint_delay: Duration) {
        let repaint_delay =
            self.broken.as_ref().map_or(repaint_delay, |broken| broken.delay().min(repaint_delay));
        let full = self.editor.state.view.extent_px;
        let fresh = full.is_some_and(|full| self.shown.as_ref() == Some(&self.key(full)));
        let whole = self.editor.state.view.divisor <= self.editor.session.least_divisor();
        let unfinished = full.is_some_and(|full| {
            let fails = self.broken.as_ref().is_some_and(|broken| broken.holds(&self.key(full)));
            let finished = fresh && whole && self.editor.session.is_done();
            !(fails || finished)
        });
        // While an animation plays the next picture is due, and with it the panels: time goes on there.
        let plays = self.editor.state.playback.playing;
        let samples = self.editor.session.samples();
        let nothing_new = samples == self.samples;
        self.samples = samples;
        self.panels_due = Instant::now().checked_add(repaint_delay);
        let goes_on = (unfinished || plays) && !self.occluded;
        self.continuous &= goes_on;
        if let Some(apart) = self.apart.as_ref().filter(|apart| apart.is_pending()) {
            // The panels leave the processor to the picture, but for what is moving in them.
            self.panels_due = Instant::now().checked_add(repaint_delay.max(PANELS_AT_MOST_EVERY));
            self.silent = goes_on && fresh && whole && nothing_new && !plays && apart.shows(samples);
            self.go_on_soon();
        } else if goes_on && !repaint_delay.is_zero() {
            self.silent = fresh && whole && nothing_new && !plays;
            self.go_on_soon();
        } else if goes_on || repaint_delay.is_zero() || !nothing_new {
            // The panels were drawn before the last sample was counted: once more.
            self.request_redraw();
        } else {
            self.redraw_at = self.panels_due;
        }
    }

    /// The next picture: at once, or when a slow device has finished this one.
    fn go_on_soon(&mut self) {
        if self.apart.is_some() || self.is_slow() {
            // Never two slow pictures in a row on the queue: panels that react to input would wait for both.
            self.waits_for_device = true;
            self.redraw_at = Instant::now().checked_add(DEVICE_POLL);
        } else {
            self.carry_on();
        }
    }
}

/// The error that the device is gone, so that nothing can be drawn any more, if it is that.
pub(super) fn device_gone(error: &anyhow::Error) -> Option<&GpuError> {
    error.chain().find_map(|cause| {
        let gpu = match cause.downcast_ref::<RendererError>() {
            Some(RendererError::Gpu(gpu)) => Some(gpu),
            _ => cause.downcast_ref::<GpuError>(),
        };
        gpu.filter(|gpu| gpu.unfinished_pass().is_some())
    })
}

fn is_fatal(error: &anyhow::Error) -> bool {
    device_gone(error).is_some()
}
