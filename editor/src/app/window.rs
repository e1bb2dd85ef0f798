//! One window: events in, frames out. Enters: winit's events. Leaves: pictures on the screen. A frame is drawn only
//! when there is a reason: input, an unfinished picture, an animation of the user interface.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use caustica_renderer::ViewSettings;
use caustica_renderer::gpu::{
    Access, Device, DeviceOptions, GpuError, Instance, InstanceOptions, Recorder, Requirements, Stage,
    Swapchain, Use,
};
use egui::ViewportId;
use egui::epaint::ClippedPrimitive;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::Window;

use super::AppOptions;
use super::actions::Action;
use super::adaptive::AdaptiveResolution;
use super::editor::Editor;
use crate::log_buffer::LogBuffer;
use crate::session::{Session, SessionOptions, ViewCamera};
use crate::theme;
use crate::ui_renderer::UiRenderer;
use crate::ui_state::Config;
use crate::worker::Wake;

/// A device that takes longer than this from one submit to the next repaints the panels alone while there is input.
const SLOW_MS: f64 = 80.0;
/// Longest time without a new picture while there is input.
const PICTURE_AT_LEAST_EVERY: Duration = Duration::from_millis(250);

/// Label of the pass that draws the panels.
const UI_PASS: &str = "ui";
/// How often a slow device is asked whether it has finished.
const DEVICE_POLL: Duration = Duration::from_millis(4);

/// Whether the program goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Next {
    /// It does.
    GoOn,
    /// The user quits.
    Quit,
}

/// What a picture depends on apart from its samples.
#[derive(Clone, Debug, PartialEq)]
struct PictureKey {
    camera: ViewCamera,
    settings: ViewSettings,
    state: u64,
    extent: [u32; 2],
}

/// The window with all it holds. Fields are dropped in this order: the device's users before the window.
pub(super) struct EditorWindow {
    ui: UiRenderer,
    swapchain: Swapchain,
    editor: Editor,
    input: egui_winit::State,
    context: egui::Context,
    adaptive: AdaptiveResolution,
    /// The last picture that was rendered.
    shown: Option<PictureKey>,
    /// A picture that could not be rendered; it is tried again when something changes.
    broken: Option<PictureKey>,
    last_picture: Instant,
    /// The next picture follows the last one without a pause or a frame of panels alone.
    continuous: bool,
    /// Milliseconds from one picture to the next while they follow each other, smoothed.
    interval_ms: f64,
    had_input: bool,
    must_resize: bool,
    occluded: bool,
    redraw_at: Option<Instant>,
    /// When the panels want to be drawn again, as for an animation.
    panels_due: Option<Instant>,
    /// The next frame only carries on with the picture: nothing new is to be shown yet.
    silent: bool,
    /// Samples of the picture at the last frame.
    samples: u64,
    /// The next picture waits until the device has finished this one.
    waits_for_device: bool,
    title: String,
    device: Arc<Device>,
    window: Arc<Window>,
}

impl EditorWindow {
    /// Opens the window, the device and an empty session, and starts to read the file that was asked for.
    pub(super) fn open(
        event_loop: &ActiveEventLoop,
        options: &AppOptions,
        log: LogBuffer,
        wake: Wake,
    ) -> anyhow::Result<Self> {
        let config = Config::load();
        let [width, height] = config.window;
        let attributes = Window::default_attributes()
            .with_title("Caustica")
            .with_inner_size(LogicalSize::new(width, height))
            // Below this the panels are squeezed to their smallest widths, which the layout would then keep.
            .with_min_inner_size(LogicalSize::new(1000.0, 640.0));
        let window = Arc::new(event_loop.create_window(attributes).context("opening the window")?);
        let display = window.display_handle().context("asking for the display")?.as_raw();
        let handle = window.window_handle().context("asking for the window")?.as_raw();
        let instance =
            Instance::new(InstanceOptions { validation: options.validation, display: Some(display) })?;
        let requirements = Requirements { device: options.device.clone(), present: true };
        let device = Device::new(
            &instance,
            &DeviceOptions { requirements, memory_limit_bytes: options.memory_limit_bytes },
        )?;
        let size = window.inner_size();
        let swapchain = Swapchain::new(&device, display, handle, [size.width, size.height])?;
        let ui = UiRenderer::new(&device, &swapchain)?;
        let context = egui::Context::default();
        theme::install(&context, config.dark);
        // A second pass would carry out clicks twice.
        context.options_mut(|options| options.max_passes = std::num::NonZeroUsize::MIN);
        let max_side = device.limits().max_image_extent as usize;
        let scale = Some(window.scale_factor() as f32);
        let input =
            egui_winit::State::new(context.clone(), ViewportId::ROOT, &window, scale, None, Some(max_side));
        let session = Session::new(
            &device,
            SessionOptions {
                shaders: options.shaders.clone(),
                extent: [size.width.max(8), size.height.max(8)],
                window: true,
                ..SessionOptions::default()
            },
        )?;
        let mut editor = Editor::new(session, config, wake);
        editor.state.log = log;
        tracing::info!("{} ({})", device.name(), device.driver());
        if let Some(file) = &options.file {
            editor.request(Action::OpenPath(file.clone()));
        }
        window.request_redraw();
        Ok(Self {
            ui,
            swapchain,
            editor,
            input,
            context,
            adaptive: AdaptiveResolution::default(),
            shown: None,
            broken: None,
            last_picture: Instant::now(),
            continuous: false,
            interval_ms: 0.0,
            had_input: false,
            must_resize: false,
            occluded: false,
            redraw_at: None,
            panels_due: None,
            silent: false,
            samples: 0,
            waits_for_device: false,
            title: String::new(),
            device,
            window,
        })
    }

    /// Draws a frame soon.
    pub(super) fn request_redraw(&mut self) {
        self.silent = false;
        self.carry_on();
    }

    /// Draws a frame soon; a silent one stays silent.
    fn carry_on(&mut self) {
        self.redraw_at = None;
        self.waits_for_device = false;
        self.window.request_redraw();
    }

    /// The time that was waited for has come.
    pub(super) fn time_reached(&mut self) {
        // A lost device shows itself in the next frame.
        if self.waits_for_device && self.device.has_finished().is_ok_and(|finished| !finished) {
            self.redraw_at = Instant::now().checked_add(DEVICE_POLL);
        } else if self.silent && self.panels_due.is_none_or(|due| Instant::now() < due) {
            self.carry_on();
        } else {
            self.request_redraw();
        }
    }

    /// Until when nothing has to be done.
    pub(super) fn control_flow(&self) -> ControlFlow {
        self.redraw_at.map_or(ControlFlow::Wait, ControlFlow::WaitUntil)
    }

    /// Writes unsaved changes to a place of their own.
    pub(super) fn rescue(&self) -> Option<PathBuf> {
        self.editor.rescue()
    }

    /// Keeps layout, theme and recent files for the next run.
    pub(super) fn save_config(&mut self) {
        let size: LogicalSize<f32> = self.window.inner_size().to_logical(self.window.scale_factor());
        self.editor.state.config.window = [size.width, size.height];
        if let Err(error) = self.editor.config().save() {
            tracing::warn!("the layout is not kept: {error:#}");
        }
    }

    /// Takes in one event.
    pub(super) fn event(&mut self, event: WindowEvent) -> anyhow::Result<Next> {
        if matches!(event, WindowEvent::RedrawRequested) {
            if self.silent && !self.must_resize && self.panels_due.is_none_or(|due| Instant::now() < due) {
                self.silent_frame()?;
            } else {
                self.frame()?;
            }
            return Ok(if self.editor.should_quit() { Next::Quit } else { Next::GoOn });
        }
        let response = self.input.on_window_event(&self.window, &event);
        match event {
            WindowEvent::CloseRequested => {
                self.editor.request(Action::Quit);
                self.request_redraw();
            }
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                self.must_resize = true;
                self.request_redraw();
            }
            WindowEvent::Occluded(occluded) => {
                self.occluded = occluded;
                self.request_redraw();
            }
            _ if response.repaint => {
                self.had_input = true;
                self.request_redraw();
            }
            _ => {}
        }
        Ok(Next::GoOn)
    }

    fn frame(&mut self) -> anyhow::Result<()> {
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
        let primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
        self.ui.set_textures(output.textures_delta)?;
        let recorder = self.picture()?;
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
        let (recorder, is_picture) = self.picture_or_panels()?;
        self.continuous = is_picture;
        Ok(recorder)
    }

    /// True: the recorder holds a picture.
    fn picture_or_panels(&mut self) -> anyhow::Result<(Recorder, bool)> {
        let Some(full) = self.editor.state.view.extent_px else {
            return self.panels_alone();
        };
        let key = self.key(full);
        let fresh = self.shown.as_ref() == Some(&key);
        let moving =
            self.shown.as_ref().is_some_and(|shown| shown.camera != key.camera || shown.state != key.state)
                || self.editor.state.view.drag.is_some()
                || self.editor.state.view.flying;
        let waits =
            fresh && self.had_input && self.is_slow() && self.last_picture.elapsed() < PICTURE_AT_LEAST_EVERY;
        let done = fresh && self.editor.session.is_converged();
        if waits || done || self.broken.as_ref() == Some(&key) {
            return self.panels_alone();
        }
        let config = &self.editor.state.config;
        let target_ms = config.adaptive.then_some(f64::from(config.target_frame_ms));
        let divisor = self.adaptive.next(Instant::now(), moving, full, target_ms);
        self.editor.state.view.divisor = divisor;
        match self.editor.session.begin_frame(full.map(|side| side.div_ceil(divisor).max(1))) {
            Ok(recorder) => {
                self.broken = None;
                self.shown = Some(key);
                self.note_times();
                Ok((recorder, true))
            }
            Err(error) if is_fatal(&error) => Err(error),
            Err(error) => {
                self.editor.state.toasts.error(format!("The picture cannot be rendered: {error:#}."));
                self.broken = Some(key);
                self.panels_alone()
            }
        }
    }

    fn panels_alone(&mut self) -> anyhow::Result<(Recorder, bool)> {
        Ok((self.editor.session.begin_ui_frame()?, false))
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
        if let Some(image) = self.editor.session.window_image() {
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
            self.editor.session.submit(recorder, None)?;
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
        self.editor.session.submit(recorder, Some(&acquired))?;
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

    /// Goes on with a picture that takes several submits, without drawing the panels: nothing they show has changed.
    fn silent_frame(&mut self) -> anyhow::Result<()> {
        let Some(full) = self.editor.state.view.extent_px else {
            self.request_redraw();
            return Ok(());
        };
        match self.editor.session.begin_frame(full) {
            Ok(recorder) => self.editor.session.submit(recorder, None)?,
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
        let full = self.editor.state.view.extent_px;
        let fresh = full.is_some_and(|full| self.shown.as_ref() == Some(&self.key(full)));
        let whole = self.editor.state.view.divisor == 1;
        let unfinished = full.is_some_and(|full| {
            self.broken.as_ref() != Some(&self.key(full))
                && !(fresh && whole && self.editor.session.is_converged())
        });
        let samples = self.editor.session.samples();
        let nothing_new = samples == self.samples;
        self.samples = samples;
        self.panels_due = Instant::now().checked_add(repaint_delay);
        let goes_on = unfinished && !self.occluded;
        self.continuous &= goes_on;
        if goes_on && !repaint_delay.is_zero() {
            self.silent = fresh && whole && nothing_new;
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
        if self.is_slow() {
            // Never two slow pictures in a row on the queue: panels that react to input would wait for both.
            self.waits_for_device = true;
            self.redraw_at = Instant::now().checked_add(DEVICE_POLL);
        } else {
            self.carry_on();
        }
    }
}

impl Drop for EditorWindow {
    fn drop(&mut self) {
        if let Err(error) = self.device.wait_idle() {
            tracing::error!("waiting for the device at the end failed: {error}");
        }
    }
}

/// Whether the device is gone, so that nothing can be drawn any more.
fn is_fatal(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        matches!(
            cause.downcast_ref::<GpuError>(),
            Some(GpuError::DeviceLost { .. } | GpuError::Timeout { .. })
        )
    }) || matches!(
        error.downcast_ref::<caustica_renderer::RendererError>(),
        Some(caustica_renderer::RendererError::Gpu(GpuError::DeviceLost { .. } | GpuError::Timeout { .. }))
    )
}
