//! One window: events in, frames out. Enters: winit's events. Leaves: pictures on the screen. A frame is drawn only
//! when there is a reason: input, an unfinished picture, an animation. How one is made is in `window/frames.rs`.

mod apart;
mod frames;
mod pace;

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use caustica_renderer::gpu::{
    Device, DeviceKind, DeviceOptions, Instance, InstanceOptions, Requirements, Swapchain,
};
use caustica_renderer::{ViewSettings, WakeFn};
use egui::ViewportId;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::Window;

use apart::Apart;
use pace::Pace;

use super::AppOptions;
use super::actions::Action;
use super::adaptive::AdaptiveResolution;
use super::after_hang::AfterHang;
use super::editor::Editor;
use super::rescue::Rescue;
use crate::log_buffer::LogBuffer;
use crate::recovery;
use crate::session::{Session, SessionOptions, ViewCamera};
use crate::theme;
use crate::ui_renderer::UiRenderer;
use crate::ui_state::Config;
use crate::worker::Wake;

/// How often a slow device is asked whether it has finished.
const DEVICE_POLL: Duration = Duration::from_millis(4);

/// How often is noted how everything is, should the device not come back.
const KEEP_EVERY: Duration = Duration::from_millis(500);

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

/// The first pause before a picture that could not be rendered is tried again, and the longest: each is twice the last one.
const TRY_AGAIN: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(8)];

/// A picture that could not be rendered. It is tried again when something changes, and after a pause, as memory may be free by then.
struct Broken {
    key: PictureKey,
    pause: Duration,
    again_at: Instant,
}

impl Broken {
    /// `again`: the failure before, of the same picture.
    fn after(again: Option<Self>, key: PictureKey) -> Self {
        let pause = again.map_or(TRY_AGAIN[0], |broken| (broken.pause * 2).min(TRY_AGAIN[1]));
        Self { key, pause, again_at: Instant::now() + pause }
    }

    /// It is too early to try this picture again.
    fn holds(&self, key: &PictureKey) -> bool {
        self.key == *key && !self.delay().is_zero()
    }

    fn delay(&self) -> Duration {
        self.again_at.saturating_duration_since(Instant::now())
    }
}

/// The window with all it holds. Fields are dropped in this order: the device's users before the window.
pub(super) struct EditorWindow {
    rescue: Rescue,
    /// When the rescue was told how everything is.
    kept: Option<Instant>,
    ui: UiRenderer,
    swapchain: Swapchain,
    /// Where the renderer's device is a processor: the one that draws the panels.
    apart: Option<Apart>,
    editor: Editor,
    input: egui_winit::State,
    context: egui::Context,
    adaptive: AdaptiveResolution,
    /// The last picture that was rendered.
    shown: Option<PictureKey>,
    /// A picture that could not be rendered.
    broken: Option<Broken>,
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
    pace: Pace,
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
        let after_hang = options.after_hang.as_deref().and_then(AfterHang::take);
        let config = after_hang.as_ref().map_or_else(Config::load, |after| after.config.clone());
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
        let apart = (device.kind() == DeviceKind::Cpu).then(|| Apart::new(&device)).transpose()?;
        let of_panels = apart.as_ref().map_or(&device, Apart::device);
        let swapchain = Swapchain::new(of_panels, display, handle, [size.width, size.height])?;
        let ui = UiRenderer::new(of_panels, &swapchain)?;
        let context = egui::Context::default();
        theme::install(&context, config.dark);
        // A second pass would carry out clicks twice.
        context.options_mut(|options| options.max_passes = std::num::NonZeroUsize::MIN);
        let max_side = device.limits().max_image_extent as usize;
        let scale = Some(window.scale_factor() as f32);
        let input =
            egui_winit::State::new(context.clone(), ViewportId::ROOT, &window, scale, None, Some(max_side));
        let mut session = Session::new(
            &device,
            SessionOptions {
                shaders: match &after_hang {
                    Some(after) => after.shaders.clone(),
                    None => options.shaders.clone(),
                },
                held_shaders: after_hang.as_ref().map(|after| after.held.clone()).unwrap_or_default(),
                watch_shaders: Some(WakeFn(Arc::clone(&wake))),
                extent: [size.width.max(8), size.height.max(8)],
                window: true,
                ..SessionOptions::default()
            },
        )?;
        let kept = recovery::folder();
        match &kept {
            Some(folder) => session.scene_mut().keep_journal(folder),
            None => tracing::warn!("unsaved changes are not kept: neither XDG_DATA_HOME nor HOME is set"),
        }
        let mut editor = Editor::new(session, config, wake);
        editor.state.log = log;
        if let Some(folder) = &kept {
            editor.keep_typed_in(folder);
        }
        tracing::info!("{} ({})", device.name(), device.driver());
        let rescue = Rescue::new(&device, editor.session.shader_library(), after_hang.is_some());
        if let Some(after) = after_hang {
            editor.go_on_after_hang(after);
        } else {
            editor.ask_about_left_behind();
            if let Some(file) = &options.file {
                editor.request(Action::OpenPath(file.clone()));
            }
        }
        window.request_redraw();
        Ok(Self {
            rescue,
            kept: None,
            ui,
            swapchain,
            apart,
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
            pace: Pace::default(),
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
        let panels_wait = self.panels_due.is_none_or(|due| Instant::now() < due);
        // A lost device shows itself in the next frame.
        let is_busy = self.waits_for_device && self.device.has_finished().is_ok_and(|finished| !finished);
        if is_busy && (panels_wait || self.apart.is_none()) {
            self.redraw_at = Instant::now().checked_add(DEVICE_POLL);
        } else if self.silent && panels_wait {
            self.carry_on();
        } else {
            self.request_redraw();
        }
    }

    /// Until when nothing has to be done.
    pub(super) fn control_flow(&self) -> ControlFlow {
        self.redraw_at.map_or(ControlFlow::Wait, ControlFlow::WaitUntil)
    }

    /// Whether there are unsaved changes that the next run can recover.
    pub(super) fn keeps_changes(&self) -> bool {
        self.editor.session.scene().keeps_changes()
    }

    /// Keeps layout, theme and recent files for the next run.
    pub(super) fn save_config(&mut self) {
        self.note_window_size();
        if let Err(error) = self.editor.config().save() {
            tracing::warn!("the layout is not kept: {error:#}");
        }
    }

    /// Tells the rescue how everything is: before every frame that shows a new shader for the first times, else now and then.
    fn keep(&mut self) {
        if !self.rescue.has_suspects() && self.kept.is_some_and(|kept| kept.elapsed() < KEEP_EVERY) {
            return;
        }
        self.kept = Some(Instant::now());
        self.note_window_size();
        self.rescue.keep(self.editor.to_keep());
    }

    /// Says in the log how fast the window answered while edited shaders came into use.
    fn note_pace(&mut self, start: Instant) {
        let session = &self.editor.session;
        let counts =
            session.shader_folder().is_some() && (session.compiles_shaders() || self.rescue.has_suspects());
        if let Some((longest, frames)) = self.pace.drawn(start, counts) {
            let ms = longest.as_secs_f64() * 1e3;
            tracing::info!(
                "shaders: input was answered within {ms:.0} ms meanwhile ({frames} frames of the window)"
            );
        }
    }

    /// Where the device is gone, starts the program again; comes back when that cannot be.
    fn start_again(&self, error: anyhow::Error) -> anyhow::Error {
        match frames::device_gone(&error) {
            Some(gone) => {
                self.rescue.keep(self.editor.to_keep());
                let why = self.rescue.start_again(gone);
                error.context(why)
            }
            None => error,
        }
    }

    fn note_window_size(&mut self) {
        let size: LogicalSize<f32> = self.window.inner_size().to_logical(self.window.scale_factor());
        self.editor.state.config.window = [size.width, size.height];
    }

    /// Takes in one event.
    pub(super) fn event(&mut self, event: WindowEvent) -> anyhow::Result<Next> {
        if matches!(event, WindowEvent::RedrawRequested) {
            let silent =
                self.silent && !self.must_resize && self.panels_due.is_none_or(|due| Instant::now() < due);
            let start = Instant::now();
            let drawn = if silent { self.silent_frame() } else { self.frame() };
            self.note_pace(start);
            drawn.map_err(|error| self.start_again(error))?;
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
}

impl Drop for EditorWindow {
    fn drop(&mut self) {
        self.rescue.leave();
        if !self.device.is_given_up()
            && let Err(error) = self.device.wait_idle()
        {
            tracing::error!("waiting for the device at the end failed: {error}");
        }
    }
}
