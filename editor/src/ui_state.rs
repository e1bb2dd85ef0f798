//! What the window remembers between frames and what is no part of the scene: selection, tool, open rows, toasts.
//! Enters: what the user does in panels. Leaves: plain data for panels and actions. It changes no document.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use caustica_scene::{Document, Finding, Target};

use crate::app::actions::Action;
use crate::gizmo::{Drag, Handle, Motion, Space, Start, Tool};
use crate::log_buffer::LogBuffer;

mod config;
mod euler;
mod rows;

pub use config::{Config, Tab, default_layout};
pub use euler::EulerFields;
pub use rows::{OutlinerState, Row};

/// What is selected. The active target is the one the inspector shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    targets: BTreeSet<Target>,
    active: Option<Target>,
}

impl Selection {
    /// Everything selected.
    pub fn targets(&self) -> &BTreeSet<Target> {
        &self.targets
    }

    /// The one selected last.
    pub fn active(&self) -> Option<Target> {
        self.active
    }

    /// Whether a target is selected.
    pub fn contains(&self, target: Target) -> bool {
        self.targets.contains(&target)
    }

    /// Whether nothing is selected.
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }

    /// Selects nothing.
    pub fn clear(&mut self) {
        self.targets.clear();
        self.active = None;
    }

    /// Selects this alone.
    pub fn set(&mut self, target: Target) {
        self.targets = BTreeSet::from([target]);
        self.active = Some(target);
    }

    /// Selects these; the last one becomes active.
    pub fn set_all(&mut self, targets: impl IntoIterator<Item = Target>) {
        self.clear();
        for target in targets {
            self.add(target);
        }
    }

    /// Selects this too.
    pub fn add(&mut self, target: Target) {
        self.targets.insert(target);
        self.active = Some(target);
    }

    /// Selects or deselects this and leaves the rest.
    pub fn toggle(&mut self, target: Target) {
        if self.targets.remove(&target) {
            self.active = self.targets.last().copied();
        } else {
            self.add(target);
        }
    }

    /// Drops what is no longer in the document.
    pub fn retain_in(&mut self, document: &Document) {
        self.targets.retain(|target| document.contains(*target));
        if self.active.is_some_and(|target| !self.targets.contains(&target)) {
            self.active = self.targets.last().copied();
        }
    }

    /// The selected targets that hang below no other selected one: what a move has to touch.
    pub fn tops(&self, document: &Document) -> Vec<Target> {
        let below_another = |target: Target| {
            std::iter::successors(document.parent_of(target), |&t| document.parent_of(t))
                .any(|t| self.targets.contains(&t))
        };
        self.targets.iter().copied().filter(|&target| !below_another(target)).collect()
    }
}

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

/// A drag of the gizmo.
#[derive(Clone, Debug)]
pub struct GizmoDrag {
    /// The handle and where it was taken.
    pub drag: Drag,
    /// What moves, as it was at the start.
    pub starts: Vec<(Target, Start)>,
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
    /// The picture is rendered at this fraction of the device pixels: 1, 2, 3 or 4.
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
    /// The log.
    pub log: LogBuffer,
    /// The latest audit.
    pub health: Option<Health>,
    /// Smoothed milliseconds of each pass.
    pub pass_ms: BTreeMap<String, f64>,
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use caustica_scene::{Node, NodeKind};

    use super::*;

    #[test]
    fn tops_leave_out_what_moves_with_its_parent() {
        let mut document = Document::new();
        let add = |document: &mut Document, parent| {
            let (id, edit) = document.add_edit(Node::new("n", NodeKind::Group), parent);
            document.apply(edit).unwrap();
            id
        };
        let root = add(&mut document, None);
        let child = add(&mut document, Some(root));
        let grandchild = add(&mut document, Some(child));
        let other = add(&mut document, None);
        let mut selection = Selection::default();
        selection.set_all([grandchild, root, other].map(Target::node));
        assert_eq!(selection.tops(&document), [root, other].map(Target::node));
        assert_eq!(selection.active(), Some(Target::node(other)));
    }

    #[test]
    fn toggling_moves_the_active_target_on() {
        let (a, b) = (Target::part(caustica_scene::NodeId(1), 0), Target::part(caustica_scene::NodeId(1), 1));
        let mut selection = Selection::default();
        selection.set(a);
        selection.toggle(b);
        assert_eq!(selection.active(), Some(b));
        selection.toggle(b);
        assert_eq!(selection.active(), Some(a));
        selection.retain_in(&Document::new());
        assert!(selection.is_empty() && selection.active().is_none());
    }
}
