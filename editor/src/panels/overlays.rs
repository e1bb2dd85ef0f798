//! What lies over everything: toasts, the progress of a job, the command palette, help. Enters: the window's memory.
//! Leaves: actions. Nothing here blocks the view.

use std::time::Instant;

use egui::{
    Align2, Area, Color32, Context, Frame, Id, Key, Margin, Order, ProgressBar, RichText, ScrollArea, Stroke,
    TextEdit,
};
use egui_phosphor::regular as icon;

use crate::app::actions::{Action, Command, Menu, commands};
use crate::session::Session;
use crate::ui_state::{HelpWindow, ToastKind, UiState};
use crate::worker::Progress;

/// Height of the list of commands, points.
const LIST_POINTS: f32 = 360.0;

/// Sentences in the lower right corner of the view.
pub fn toasts(state: &mut UiState, context: &Context) {
    let now = Instant::now();
    state.toasts.items.retain(|toast| toast.until > now);
    let Some(first) = state.toasts.items.iter().map(|toast| toast.until).min() else { return };
    context.request_repaint_after(first - now);
    let mut closed = None;
    let corner = Align2::RIGHT_BOTTOM;
    let from = if state.view.rect.is_positive() {
        state.view.rect.right_bottom()
    } else {
        context.content_rect().max
    };
    Area::new(Id::new("toasts"))
        .order(Order::Foreground)
        .pivot(corner)
        .fixed_pos(from - egui::vec2(12.0, 12.0))
        .show(context, |ui| {
            for (index, toast) in state.toasts.items.iter().enumerate() {
                let (mark, color) = match toast.kind {
                    ToastKind::Info => (icon::CHECK_CIRCLE, crate::theme::accent(ui.visuals())),
                    ToastKind::Warning => (icon::WARNING, ui.visuals().warn_fg_color),
                    ToastKind::Error => (icon::X_CIRCLE, ui.visuals().error_fg_color),
                };
                let frame = Frame::popup(ui.style())
                    .inner_margin(Margin::symmetric(12, 8))
                    .stroke(Stroke::new(1.0, color));
                frame.show(ui, |ui| {
                    ui.set_max_width(380.0);
                    ui.horizontal(|ui| {
                        ui.label(RichText::new(mark).color(color).size(16.0));
                        ui.add(egui::Label::new(&toast.text).wrap());
                        if ui.add(egui::Button::new(icon::X).frame(false)).clicked() {
                            closed = Some(index);
                        }
                    });
                });
                ui.add_space(4.0);
            }
        });
    if let Some(index) = closed {
        state.toasts.items.remove(index);
    }
}

/// How far a job is; true: the user cancels it.
pub fn progress(
    context: &Context,
    state: &UiState,
    label: &str,
    progress: &Progress,
    can_cancel: bool,
) -> bool {
    let mut cancelled = false;
    let at = if state.view.rect.is_positive() {
        state.view.rect.center_top()
    } else {
        context.content_rect().center_top()
    };
    Area::new(Id::new("progress"))
        .order(Order::Foreground)
        .pivot(Align2::CENTER_TOP)
        .fixed_pos(at + egui::vec2(0.0, 16.0))
        .show(context, |ui| {
            Frame::popup(ui.style()).inner_margin(Margin::same(12)).show(ui, |ui| {
                ui.set_width(360.0);
                ui.label(RichText::new(label).strong());
                ui.add(ProgressBar::new(progress.share).desired_height(8.0).animate(progress.share == 0.0));
                ui.horizontal(|ui| {
                    ui.weak(&progress.step);
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        cancelled = can_cancel && ui.button("Cancel").clicked();
                    });
                });
            });
        });
    cancelled
}

/// The command palette: type a part of a name, Enter does it.
pub fn palette(state: &mut UiState, context: &Context) {
    let Some(mut palette) = state.palette.take() else { return };
    let hits = hits(&commands(), &palette.text);
    let (down, up, enter, escape) = context.input_mut(|input| {
        let mut taken = |key| input.consume_key(egui::Modifiers::NONE, key);
        (taken(Key::ArrowDown), taken(Key::ArrowUp), taken(Key::Enter), taken(Key::Escape))
    });
    let last = hits.len().saturating_sub(1);
    palette.chosen = match (down, up) {
        (true, _) => (palette.chosen + 1).min(last),
        (_, true) => palette.chosen.saturating_sub(1),
        _ => palette.chosen.min(last),
    };
    // Enter on an untouched palette does nothing: it would do the first command of the list.
    let enter = enter && (!palette.text.trim().is_empty() || palette.chosen > 0);
    let mut done = enter.then(|| hits.get(palette.chosen).map(|hit| hit.action.clone())).flatten();
    let mut open = !escape && !enter;
    let at = context.content_rect().center_top() + egui::vec2(0.0, 72.0);
    let area = Area::new(Id::new("palette")).order(Order::Foreground).pivot(Align2::CENTER_TOP).fixed_pos(at);
    let shown = area.show(context, |ui| {
        Frame::popup(ui.style()).inner_margin(Margin::same(8)).show(ui, |ui| {
            ui.set_width(460.0);
            let edit = TextEdit::singleline(&mut palette.text)
                .hint_text("Type a command")
                .desired_width(f32::INFINITY);
            let response = ui.add(edit);
            response.request_focus();
            if response.changed() {
                palette.chosen = 0;
            }
            ui.add_space(4.0);
            // Without the minimum a list that was short once would stay so: the area remembers its size.
            let list = ScrollArea::vertical().max_height(LIST_POINTS).min_scrolled_height(LIST_POINTS);
            list.show(ui, |ui| {
                for (index, hit) in hits.iter().enumerate() {
                    let chosen = index == palette.chosen;
                    let response = ui.add(row(ui, hit, chosen));
                    if chosen && (down || up) {
                        response.scroll_to_me(None);
                    }
                    if response.clicked() {
                        done = Some(hit.action.clone());
                    }
                }
                if hits.is_empty() {
                    ui.weak("No command has this name.");
                }
            });
        });
    });
    if context.input(|input| input.pointer.any_pressed())
        && context.pointer_interact_pos().is_some_and(|at| !shown.response.rect.contains(at))
    {
        open = false;
    }
    match done {
        Some(action) => state.actions.push(action),
        None if open => state.palette = Some(palette),
        None => {}
    }
}

fn row<'a>(ui: &egui::Ui, command: &Command, chosen: bool) -> egui::Button<'a> {
    let key = command.shortcut.map(|shortcut| ui.ctx().format_shortcut(&shortcut)).unwrap_or_default();
    let icon = if command.icon.is_empty() { icon::DOT_OUTLINE } else { command.icon };
    egui::Button::new(format!("{icon}  {}", command.name))
        .selected(chosen)
        .frame_when_inactive(chosen)
        .min_size(egui::vec2(ui.available_width(), 26.0))
        .right_text(RichText::new(format!("{}   {key}", menu_name(command.menu))).weak().small())
}

fn menu_name(menu: Menu) -> &'static str {
    match menu {
        Menu::File => "File",
        Menu::Edit => "Edit",
        Menu::Add => "Add",
        Menu::View => "View",
        Menu::Render => "Render",
        Menu::Animation => "Animation",
        Menu::Tool => "Tool",
        Menu::Help => "Help",
    }
}

/// Commands that contain every typed word; those that begin with the text come first.
fn hits(commands: &[Command], text: &str) -> Vec<Command> {
    let text = text.trim().to_lowercase();
    let fits = |command: &&Command| {
        let name = format!("{} {}", menu_name(command.menu), command.name).to_lowercase();
        text.split_whitespace().all(|word| name.contains(word))
    };
    let mut hits: Vec<_> =
        commands.iter().filter(|c| c.action != Action::Palette).filter(fits).cloned().collect();
    hits.sort_by_key(|command| !command.name.to_lowercase().starts_with(&text));
    hits
}

/// The windows of the Help menu.
pub fn help(state: &mut UiState, session: &Session, context: &Context) {
    let Some(which) = state.help else { return };
    let mut open = true;
    let title = match which {
        HelpWindow::Shortcuts => "Keys and mouse",
        HelpWindow::About => "About Caustica",
    };
    egui::Window::new(title)
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .pivot(Align2::CENTER_CENTER)
        .default_pos(context.content_rect().center())
        .show(context, |ui| match which {
            HelpWindow::Shortcuts => shortcuts(ui),
            HelpWindow::About => about(ui, session),
        });
    if !open || context.input(|input| input.key_pressed(Key::Escape)) {
        state.help = None;
    }
}

const MOUSE: [(&str, &str); 12] = [
    ("Click", "select; with Ctrl or Shift add or take away"),
    ("Double click", "select one primitive of the mesh"),
    ("Drag a handle", "move, rotate or scale; Ctrl in steps, Esc cancels"),
    ("Middle drag, Alt + drag", "orbit"),
    ("Shift + middle drag", "pan"),
    ("Wheel, Ctrl + middle drag", "nearer and farther"),
    ("Hold right, W A S D Q E", "fly; Shift faster, wheel changes the speed"),
    ("Double click in the outliner", "rename"),
    ("Drag in the outliner", "hang below another object"),
    ("Drop a file", ".gltf .glb .obj import, .hdr .exr surround, projects open"),
    ("Drag a number", "change it; click to type, expressions of digits only"),
    ("X, Period, F3", "delete, frame, command palette"),
];

fn shortcuts(ui: &mut egui::Ui) {
    ScrollArea::vertical().max_height(520.0).show(ui, |ui| {
        egui::Grid::new("mouse").num_columns(2).spacing([32.0, 6.0]).show(ui, |ui| {
            for (keys, meaning) in MOUSE {
                ui.label(RichText::new(keys).strong());
                ui.label(meaning);
                ui.end_row();
            }
            ui.separator();
            ui.separator();
            ui.end_row();
            for command in commands() {
                if let Some(shortcut) = command.shortcut {
                    ui.label(RichText::new(ui.ctx().format_shortcut(&shortcut)).strong());
                    ui.label(command.name);
                    ui.end_row();
                }
            }
        });
    });
}

fn about(ui: &mut egui::Ui, session: &Session) {
    let device = session.device();
    ui.heading(format!("{}  Caustica {}", icon::SPARKLE, env!("CARGO_PKG_VERSION")));
    ui.label("A scene editor with a hybrid ray-tracing renderer.");
    ui.add_space(8.0);
    egui::Grid::new("about").num_columns(2).spacing([24.0, 6.0]).show(ui, |ui| {
        ui.weak("Device");
        ui.label(device.name());
        ui.end_row();
        ui.weak("Driver");
        ui.label(device.driver());
        ui.end_row();
        ui.weak("Licence");
        ui.label("MIT or Apache-2.0");
        ui.end_row();
    });
}

/// A veil over the window while a file is dragged over it.
pub fn drop_hint(context: &Context) {
    let names: Vec<String> = context.input(|input| {
        let name = |file: &egui::HoveredFile| {
            file.path
                .as_ref()
                .and_then(|path| path.file_name())
                .map(|name| name.to_string_lossy().into_owned())
        };
        input.raw.hovered_files.iter().filter_map(name).collect()
    });
    if names.is_empty() {
        return;
    }
    let rect = context.content_rect();
    let painter = context.layer_painter(egui::LayerId::new(Order::Foreground, Id::new("drop")));
    painter.rect_filled(rect, 0.0, Color32::from_black_alpha(150));
    let text = format!("{}  Drop {}", icon::DOWNLOAD_SIMPLE, names.join(", "));
    painter.text(
        rect.center(),
        Align2::CENTER_CENTER,
        text,
        egui::FontId::proportional(22.0),
        Color32::WHITE,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_palette_finds_commands_by_words_in_any_order() {
        let commands = commands();
        let names = |text: &str| hits(&commands, text).into_iter().map(|hit| hit.name).collect::<Vec<_>>();
        assert_eq!(names("light spot"), ["Add spot light"]);
        assert_eq!(names("undo").first().map(String::as_str), Some("Undo"));
        assert_eq!(names("s").first().map(|name| name.to_lowercase().starts_with('s')), Some(true));
        assert!(names("no such thing").is_empty());
        assert_eq!(hits(&commands, "").len(), commands.len() - 1);
    }
}
