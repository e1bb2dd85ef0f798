//! The panels of the window, one a file. Enters: the session and the window's memory. Leaves: drawings, edits pushed
//! to the session, actions asked for. Panels never change the document by themselves.

use caustica_scene::{Edit, LightKind, Target};
use egui::{RichText, Ui};
use egui_phosphor::regular as icon;

use crate::app::actions::Action;
use crate::session::Session;
use crate::ui_state::UiState;

pub mod acceleration;
pub mod bars;
mod code;
pub mod environment;
pub mod error;
pub mod inspector;
pub mod material;
mod material_lobes;
pub mod mesh;
pub mod number;
pub mod outliner;
pub mod overlays;
pub mod render;
pub mod reports;
pub mod shaders;
pub mod shapes;
pub mod source;
pub mod timeline;
pub mod view;
pub mod view_input;

/// What a panel works with.
pub struct Cx<'a> {
    /// The open document and its picture.
    pub session: &'a mut Session,
    /// What the window remembers.
    pub state: &'a mut UiState,
}

impl Cx<'_> {
    /// Pushes an edit; a refusal is told to the user.
    pub fn push(&mut self, edit: Edit) {
        if let Err(error) = self.session.push(edit) {
            self.state.toasts.error(format!("That cannot be done: {error}."));
        }
    }

    /// Asks for an action; it is carried out after all panels are drawn.
    pub fn act(&mut self, action: Action) {
        self.state.actions.push(action);
    }
}

/// The icon of what a target is.
pub fn target_icon(cx: &Cx<'_>, target: Target) -> &'static str {
    let document = cx.session.document();
    if let Some(light) = document.light_of(target) {
        return light_icon(&light.kind);
    }
    if document.camera_of(target).is_some() {
        return icon::VIDEO_CAMERA;
    }
    if let Some(mesh) = document.mesh_of(target) {
        let shapes = document.mesh(mesh).and_then(|mesh| mesh.shapes());
        return shapes.map_or(icon::CUBE, |shapes| shapes::source_icon(shapes.source()));
    }
    match target.part {
        None if document.node(target.node).is_some_and(|node| node.prefab().is_some()) => icon::PACKAGE,
        _ => icon::FOLDER_SIMPLE,
    }
}

/// The icon of a kind of light.
pub fn light_icon(kind: &LightKind) -> &'static str {
    match kind {
        LightKind::Point { .. } => icon::LIGHTBULB,
        LightKind::Spot { .. } => icon::FLASHLIGHT,
        LightKind::Directional { .. } => icon::SUN,
    }
}

/// A section of a panel that can be closed.
pub fn section(ui: &mut Ui, title: &str, body: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(RichText::new(title).strong())
        .id_salt(title)
        .default_open(true)
        .show_unindented(ui, |ui| {
            ui.add_space(2.0);
            body(ui);
            ui.add_space(6.0);
        });
}

/// A line of a form: a name of fixed width, then what is edited.
pub fn field(ui: &mut Ui, name: &str, tip: &str, body: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        let width = (ui.available_width() * 0.36).clamp(72.0, 128.0);
        let size = egui::vec2(width, ui.spacing().interact_size.y);
        let label = egui::Label::new(RichText::new(name).weak()).truncate();
        ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.set_min_width(width);
            ui.add(label).on_hover_text(tip);
        });
        body(ui);
    });
}

/// Milliseconds, or a dash as long as nothing was measured.
pub fn milliseconds(ms: Option<f64>, decimals: usize) -> String {
    ms.map_or_else(|| String::from("\u{2014}"), |ms| format!("{ms:.decimals$}"))
}

/// A sentence in the middle of an empty panel.
pub fn empty_note(ui: &mut Ui, text: &str) {
    ui.add_space(12.0);
    ui.vertical_centered(|ui| ui.weak(text));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_measured_is_no_zero() {
        assert_eq!(milliseconds(None, 2), "\u{2014}");
        assert_eq!(milliseconds(Some(1.256), 2), "1.26");
    }
}
