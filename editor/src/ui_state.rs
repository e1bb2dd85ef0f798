//! What the window remembers between frames and what is no part of the scene: selection, tool, open rows, toasts.
//! Enters: what the user does in panels. Leaves: plain data for panels and actions. It changes no document.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use caustica_scene::{Finding, MeshId, NodeId, Target};

use crate::app::actions::Action;
use crate::error_watch::ErrorWatch;
use crate::gizmo::{Drag, Handle, Motion, Space, Start, Tool};
use crate::log_buffer::LogBuffer;
use crate::playback::Playback;

mod config;
mod euler;
mod rows;
mod selection;
mod shader_texts;

pub use config::{Config, Tab, add_tab, default_layout};
pub use euler::EulerFields;
pub use rows::{OutlinerState, Row};
pub use selection::{SelectedPrimitive, Selection};
pub use shader_texts::{ShaderTexts, write_built_in};

/// How bad a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToastKind {
    /// Something was done.
    Info,
    /// Something was done in part.
    Warning,
    /// Something was not done.
    Error,
}

/// A sentence shown for a while.
#[derive(Clone, Debug)]
pub struct Toast {
    /// How bad it is.
    pub kind: ToastKind,
    /// One sentence that says what to do.
    pub text: String,
    /// When it goes.
    pub until: Instant,
}

/// The sentences that are shown now.
#[derive(Debug, Default)]
pub struct Toasts {
    /// Oldest first.
    pub items: Vec<Toast>,
}

impl Toasts {
    /// Says that something was done.
    pub fn info(&mut self, text: impl Into<String>) {
        let text = text.into();
        tracing::info!("{text}");
        self.add(ToastKind::Info, text, 4);
    }

    /// Says that something was done in part.
    pub fn warning(&mut self, text: impl Into<String>) {
        let text = text.into();
        tracing::warn!("{text}");
        self.add(ToastKind::Warning, text, 10);
    }

    /// Says that something went wrong.
    pub fn error(&mut self, text: impl Into<String>) {
        let text = text.into();
        tracing::error!("{text}");
        self.add(ToastKind::Error, text, 15);
    }

    fn add(&mut self, kind: ToastKind, text: String, seconds: u64) {
        let until = Instant::now() + Duration::from_secs(seconds);
        // The same sentence again lasts longer instead of piling up.
        match self.items.iter_mut().find(|toast| toast.text == text) {
            Some(toast) => toast.until = until,
            None => self.items.push(Toast { kind, text, until }),
        }
        let surplus = self.items.len().saturating_sub(5);
        self.items.drain(..surplus);
    }
}

/// What a drag of the gizmo moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Moved {
    /// An object.
    Object(Target),
    /// A primitive inside its mesh, wherever that is placed.
    Primitive(MeshId, u32),
}

/// A drag of the gizmo.
#[derive(Clone, Debug)]
pub struct GizmoDrag {
    /// The handle and where it was taken.
    pub drag: Drag,
    /// What moves, as it was at the start.
    pub starts: Vec<(Moved, Start)>,
    /// What it did so far.
    pub motion: Option<Motion>,
}

/// What the view remembers.
#[derive(Debug)]
pub struct ViewState {
    /// Where it is in the window, points.
    pub rect: egui::Rect,
    /// Its size in device pixels; `None` while it is hidden.
    pub extent_px: Option<[u32; 2]>,
    /// One pixel is rendered for so many device pixels in each direction: 1 to 4, or up to 8 where memory is short.
    pub divisor: u32,
    /// Distance from the eye to what it orbits.
    pub distance_m: f64,
    /// The handle under the pointer.
    pub hovered: Option<Handle>,
    /// The drag that is going on.
    pub drag: Option<GizmoDrag>,
    /// The right button is held: keys fly.
    pub flying: bool,
    /// How fast.
    pub fly_speed_m_s: f64,
    /// A mouse button moves the camera now.
    pub navigating: bool,
    /// Lights and cameras, and the `History::structure_revision` that they were collected at.
    pub marked: Option<(u64, Vec<Target>)>,
}

impl Default for ViewState {
    fn default() -> Self {
        Self {
            rect: egui::Rect::NOTHING,
            extent_px: None,
            divisor: 1,
            distance_m: 5.0,
            hovered: None,
            drag: None,
            flying: false,
            fly_speed_m_s: 2.0,
            navigating: false,
            marked: None,
        }
    }
}

/// The command palette while it is open.
#[derive(Debug, Default)]
pub struct PaletteState {
    /// What was typed.
    pub text: String,
    /// Which of the hits is chosen.
    pub chosen: usize,
}

/// A window of the Help menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HelpWindow {
    /// Keys and mouse.
    Shortcuts,
    /// Version and device.
    About,
}

/// What the inspector remembers.
#[derive(Debug, Default)]
pub struct InspectorState {
    /// Angles as they are shown, so that they do not jump while they are edited.
    pub euler: EulerFields,
    /// The same for the selected primitive.
    pub primitive_euler: EulerFields,
    /// A name that is being typed, and whose.
    pub name: Option<(Target, String)>,
    /// Scale fields change together.
    pub uniform_scale: bool,
}

/// Findings of the audit and the state of the document that they are about.
#[derive(Debug)]
pub struct Health {
    /// `History::state` at the time.
    pub state: u64,
    /// What was found.
    pub findings: Vec<Finding>,
}

/// Everything the window remembers.
#[derive(Debug, Default)]
pub struct UiState {
    /// What is selected.
    pub selection: Selection,
    /// What a drag in the view does.
    pub tool: Tool,
    /// Whose axes the gizmo follows.
    pub space: Space,
    /// Drags go in steps; Ctrl turns it round.
    pub snap: bool,
    /// The view.
    pub view: ViewState,
    /// How the animation plays.
    pub playback: Playback,
    /// Instances with clips, and the `History::structure_revision` that they were collected at.
    pub animated: Option<(u64, Vec<NodeId>)>,
    /// The outliner.
    pub outliner: OutlinerState,
    /// The inspector.
    pub inspector: InspectorState,
    /// Sentences shown for a while.
    pub toasts: Toasts,
    /// The command palette, while open.
    pub palette: Option<PaletteState>,
    /// A window of the Help menu, while open.
    pub help: Option<HelpWindow>,
    /// What panels ask for; carried out after they are drawn.
    pub actions: Vec<Action>,
    /// What is kept between runs.
    pub config: Config,
    /// Texts of shaders that are open.
    pub shaders: ShaderTexts,
    /// The log.
    pub log: LogBuffer,
    /// The latest audit.
    pub health: Option<Health>,
    /// The error of the picture.
    pub error: ErrorWatch,
    /// Smoothed milliseconds of each pass.
    pub pass_ms: BTreeMap<String, f64>,
}
