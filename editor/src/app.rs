//! The window's program: event loop, device, session, frames. Enters: what the command line says. Leaves: when the
//! window is closed. The parts that know winit and the swapchain are in `app/window.rs`, all else is in `app/editor.rs`.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context as _;
use winit::application::ApplicationHandler;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy};
use winit::window::WindowId;

use crate::log_buffer::{self, LogBuffer};
use crate::worker::Wake;

pub mod actions;
mod adaptive;
pub mod after_hang;
mod dispatch;
pub mod editor;
mod export;
mod files;
mod recovery;
pub mod rescue;
mod shaders;
mod window;

/// What the command line says.
#[derive(Clone, Debug, Default)]
pub struct AppOptions {
    /// A project or model to open.
    pub file: Option<PathBuf>,
    /// A part of the device's name, or its index.
    pub device: Option<String>,
    /// Read shaders from this folder instead of the copy in the binary.
    pub shaders: Option<PathBuf>,
    /// Load the validation layer.
    pub validation: bool,
    /// Refuse to use more device memory than this.
    pub memory_limit_bytes: Option<u64>,
    /// What a process has left for this one whose device did not come back.
    pub after_hang: Option<PathBuf>,
}

/// Opens the window and runs until it is closed.
///
/// # Errors
/// Without a display, without a suitable device, or when the device is lost.
pub fn run(options: AppOptions) -> anyhow::Result<()> {
    let log = log_buffer::install();
    let event_loop = EventLoop::<Wakeup>::with_user_event()
        .build()
        .context("no window can be opened here; `caustica render` makes pictures without one")?;
    let proxy = event_loop.create_proxy();
    let mut app = App { options, log, proxy, window: None, failure: None };
    event_loop.run_app(&mut app).context("the window system ended the program")?;
    app.failure.map_or(Ok(()), Err)
}

/// Another thread has something for the window.
#[derive(Clone, Copy, Debug)]
struct Wakeup;

struct App {
    options: AppOptions,
    log: LogBuffer,
    proxy: EventLoopProxy<Wakeup>,
    window: Option<window::EditorWindow>,
    failure: Option<anyhow::Error>,
}

impl App {
    fn wake(&self) -> Wake {
        let proxy = self.proxy.clone();
        Arc::new(move || {
            // Nobody needs waking once the event loop has ended.
            let _ = proxy.send_event(Wakeup);
        })
    }

    /// Ends the program with an error.
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: anyhow::Error) {
        let kept = self.window.as_ref().is_some_and(window::EditorWindow::keeps_changes);
        self.failure = Some(match kept {
            true => error.context("the unsaved changes are kept; start the editor again to recover them"),
            false => error,
        });
        self.window = None;
        event_loop.exit();
    }
}

impl ApplicationHandler<Wakeup> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_some() {
            return;
        }
        match window::EditorWindow::open(event_loop, &self.options, self.log.clone(), self.wake()) {
            Ok(window) => self.window = Some(window),
            Err(error) => self.fail(event_loop, error),
        }
    }

    fn new_events(&mut self, _event_loop: &ActiveEventLoop, cause: StartCause) {
        if let (Some(window), StartCause::ResumeTimeReached { .. }) = (&mut self.window, cause) {
            window.time_reached();
        }
    }

    fn user_event(&mut self, _event_loop: &ActiveEventLoop, _event: Wakeup) {
        if let Some(window) = &mut self.window {
            window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _window: WindowId, event: WindowEvent) {
        let Some(window) = &mut self.window else { return };
        match window.event(event) {
            Ok(window::Next::GoOn) => {}
            Ok(window::Next::Quit) => {
                window.save_config();
                self.window = None;
                event_loop.exit();
            }
            Err(error) => self.fail(event_loop, error),
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(window) = &self.window {
            event_loop.set_control_flow(window.control_flow());
        }
    }

    fn exiting(&mut self, _event_loop: &ActiveEventLoop) {
        // Device and swapchain go while the display is still there.
        self.window = None;
    }
}
