//! Menu bar, tool bar and status bar. Enters: session and memory. Leaves: actions and settings of the view.

use caustica_renderer::{Show, TlasWork};
use caustica_scene::{Finding, PrefabId, Severity};
use egui::{Button, MenuBar, RichText, Ui};
use egui_phosphor::regular as icon;

use super::{Cx, acceleration, render};
use crate::app::actions::{Action, Command, Menu, commands};
use crate::gizmo::Space;
use crate::ui_state::Tab;

/// The menus.
pub fn menu(cx: &mut Cx<'_>, ui: &mut Ui, shown_tabs: &[Tab]) {
    let commands = commands();
    MenuBar::new().ui(ui, |ui| {
        ui.label(RichText::new(icon::SPARKLE).color(crate::theme::accent(ui.visuals())).size(16.0));
        ui.menu_button("File", |ui| file_menu(cx, ui, &commands));
        ui.menu_button("Edit", |ui| edit_menu(cx, ui, &commands));
        ui.menu_button("Add", |ui| add_menu(cx, ui, &commands));
        ui.menu_button("View", |ui| view_menu(cx, ui, &commands, shown_tabs));
        ui.menu_button("Render", |ui| render_menu(cx, ui, &commands));
        ui.menu_button("Help", |ui| {
            of(&commands, Menu::Help).for_each(|command| entry(cx, ui, command, true));
            ui.separator();
            of(&commands, Menu::File)
                .filter(|c| c.action == Action::Quit)
                .for_each(|command| entry(cx, ui, command, true));
        });
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let device = cx.session.device();
            ui.label(RichText::new(device.name()).small().weak()).on_hover_text(device.driver());
            ui.label(RichText::new(icon::GRAPHICS_CARD).weak());
            let palette = Button::new(format!("{}  Commands", icon::MAGNIFYING_GLASS)).right_text("Ctrl+P");
            if ui.add(palette).on_hover_text("Every command by its name (Ctrl+P or F3)").clicked() {
                cx.act(Action::Palette);
            }
        });
    });
}

fn of(commands: &[Command], menu: Menu) -> impl Iterator<Item = &Command> {
    commands.iter().filter(move |command| command.menu == menu)
}

fn entry(cx: &mut Cx<'_>, ui: &mut Ui, command: &Command, enabled: bool) {
    named_entry(cx, ui, command, &command.name, enabled);
}

fn named_entry(cx: &mut Cx<'_>, ui: &mut Ui, command: &Command, name: &str, enabled: bool) {
    let text = if command.icon.is_empty() { name.to_owned() } else { format!("{}  {name}", command.icon) };
    let mut button = Button::new(text);
    if let Some(shortcut) = &command.shortcut {
        button = button.shortcut_text(ui.ctx().format_shortcut(shortcut));
    }
    if ui.add_enabled(enabled, button).clicked() {
        cx.act(command.action.clone());
        ui.close();
    }
}

fn file_menu(cx: &mut Cx<'_>, ui: &mut Ui, commands: &[Command]) {
    for command in of(commands, Menu::File) {
        match command.action {
            Action::Import | Action::Save | Action::Quit => {
                ui.separator();
            }
            _ => {}
        }
        entry(cx, ui, command, true);
        if command.action == Action::Open {
            recent_menu(cx, ui);
        }
    }
}

fn recent_menu(cx: &mut Cx<'_>, ui: &mut Ui) {
    let recent = cx.state.config.recent.clone();
    ui.add_enabled_ui(!recent.is_empty(), |ui| {
        ui.menu_button(format!("{}  Open recent", icon::CLOCK_COUNTER_CLOCKWISE), |ui| {
            for path in recent {
                let name =
                    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
                if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                    cx.act(Action::OpenPath(path));
                    ui.close();
                }
            }
            ui.separator();
            if ui.button("Clear the list").clicked() {
                cx.state.config.recent.clear();
                ui.close();
            }
        });
    });
}

fn edit_menu(cx: &mut Cx<'_>, ui: &mut Ui, commands: &[Command]) {
    let history = cx.session.history();
    let (undo, redo) = (history.undo_label().map(str::to_owned), history.redo_label().map(str::to_owned));
    let selected = !cx.state.selection.is_empty();
    for command in of(commands, Menu::Edit) {
        match command.action {
            Action::Undo => {
                let name = undo.as_ref().map_or("Undo".to_owned(), |label| format!("Undo: {label}"));
                named_entry(cx, ui, command, &name, undo.is_some());
            }
            Action::Redo => {
                let name = redo.as_ref().map_or("Redo".to_owned(), |label| format!("Redo: {label}"));
                named_entry(cx, ui, command, &name, redo.is_some());
                ui.separator();
            }
            Action::SelectAll | Action::SelectNone => entry(cx, ui, command, true),
            _ => entry(cx, ui, command, selected),
        }
    }
}

fn add_menu(cx: &mut Cx<'_>, ui: &mut Ui, commands: &[Command]) {
    of(commands, Menu::Add).for_each(|command| entry(cx, ui, command, true));
    ui.separator();
    of(commands, Menu::File)
        .filter(|c| c.action == Action::Import)
        .for_each(|command| entry(cx, ui, command, true));
    let prefabs: Vec<(PrefabId, String)> =
        cx.session.document().prefabs().map(|(id, prefab)| (id, prefab.name.clone())).collect();
    ui.add_enabled_ui(!prefabs.is_empty(), |ui| {
        ui.menu_button(format!("{}  Another instance of", icon::PACKAGE), |ui| {
            for (id, name) in prefabs {
                if ui.button(name).clicked() {
                    cx.act(Action::AddInstance(id));
                    ui.close();
                }
            }
        });
    });
}

fn view_menu(cx: &mut Cx<'_>, ui: &mut Ui, commands: &[Command], shown_tabs: &[Tab]) {
    for command in of(commands, Menu::View) {
        match command.action {
            Action::ShowTab(_) => continue,
            Action::AxisView(crate::camera_control::AxisView::Front)
            | Action::ToggleProjection
            | Action::ToggleTheme => {
                ui.separator();
            }
            _ => {}
        }
        entry(cx, ui, command, true);
    }
    ui.menu_button(format!("{}  Animation", icon::FILM_STRIP), |ui| {
        let animated = cx.session.duration().is_some();
        of(commands, Menu::Animation).for_each(|command| entry(cx, ui, command, animated));
    });
    ui.menu_button(format!("{}  Panels", icon::SQUARES_FOUR), |ui| {
        for tab in Tab::ALL {
            let mark = if shown_tabs.contains(&tab) { icon::CHECK } else { icon::DOT_OUTLINE };
            if ui.button(format!("{mark}  {}", tab.name())).clicked() {
                cx.act(Action::ShowTab(tab));
                ui.close();
            }
        }
    });
}

fn render_menu(cx: &mut Cx<'_>, ui: &mut Ui, commands: &[Command]) {
    let settings = cx.session.settings().clone();
    let adaptive = cx.state.config.adaptive;
    let mut last_kind = 0;
    for command in of(commands, Menu::Render) {
        let (kind, on) = match &command.action {
            Action::Pipeline(pipeline) => (1, *pipeline == settings.pipeline),
            Action::Show(show) => (2, *show == settings.show),
            Action::ToggleAdaptive => (0, adaptive),
            _ => (0, false),
        };
        if kind != last_kind {
            ui.separator();
            last_kind = kind;
        }
        let mark = match (on, command.icon) {
            (true, _) => icon::CHECK,
            (false, "") => icon::DOT_OUTLINE,
            (false, icon) => icon,
        };
        let mut button = ui.button(format!("{mark}  {}", command.name));
        if let Action::Show(show) = command.action {
            button = button.on_hover_text(show.meaning());
        }
        if button.clicked() {
            cx.act(command.action.clone());
            ui.close();
        }
    }
}

/// The tool bar.
pub fn tools(cx: &mut Cx<'_>, ui: &mut Ui) {
    let commands = commands();
    ui.horizontal_centered(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let history = cx.session.history();
        let (undo, redo) = (history.undo_label().map(str::to_owned), history.redo_label().map(str::to_owned));
        history_button(cx, ui, icon::ARROW_U_UP_LEFT, "Undo", undo, Action::Undo);
        history_button(cx, ui, icon::ARROW_U_UP_RIGHT, "Redo", redo, Action::Redo);
        ui.separator();
        for command in of(&commands, Menu::Tool) {
            tool_button(cx, ui, command);
        }
        ui.separator();
        let mut settings = cx.session.settings().clone();
        ui.label(RichText::new("Pipeline").weak());
        render::pipeline_menu(ui, &mut settings.pipeline);
        ui.label(RichText::new("Show").weak());
        render::show_menu(ui, &mut settings.show);
        if settings.show == Show::Shadow {
            render::light_menu(cx.session, ui, &mut settings.show_light);
        }
        if settings != *cx.session.settings() {
            cx.session.set_settings(settings);
        }
        ui.separator();
        let frame = Button::new(icon::FRAME_CORNERS);
        if ui.add(frame).on_hover_text("Frame everything (Home)").clicked() {
            cx.act(Action::FrameAll);
        }
        if ui.add(Button::new(icon::VIDEO_CAMERA)).on_hover_text("Look through the camera (0)").clicked() {
            cx.act(Action::SceneCamera);
        }
    });
}

fn history_button(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    mark: &str,
    name: &str,
    label: Option<String>,
    action: Action,
) {
    let response = ui.add_enabled(label.is_some(), Button::new(RichText::new(mark).size(16.0)));
    let tip = label.map_or(format!("Nothing to {}", name.to_lowercase()), |label| format!("{name}: {label}"));
    if response.on_hover_text(&tip).on_disabled_hover_text(&tip).clicked() {
        cx.act(action);
    }
}

fn tool_button(cx: &mut Cx<'_>, ui: &mut Ui, command: &Command) {
    let key = command.shortcut.map(|shortcut| ui.ctx().format_shortcut(&shortcut)).unwrap_or_default();
    let (mark, on, tip) = match &command.action {
        Action::Tool(tool) => (command.icon, *tool == cx.state.tool, format!("{} ({key})", command.name)),
        Action::ToggleSpace => {
            ui.separator();
            let local = cx.state.space == Space::Local;
            let (mark, now) =
                if local { (icon::CUBE_FOCUS, "object's own") } else { (icon::GLOBE_SIMPLE, "world's") };
            (mark, local, format!("Handles follow the {now} axes ({key})"))
        }
        Action::ToggleSnap => {
            (command.icon, cx.state.snap, format!("Drags go in steps ({key}); Ctrl turns it round"))
        }
        _ => (command.icon, false, command.name.clone()),
    };
    let button = Button::new(RichText::new(mark).size(16.0)).selected(on).min_size(egui::vec2(30.0, 26.0));
    if ui.add(button).on_hover_text(tip).clicked() {
        cx.act(command.action.clone());
    }
}

/// The status bar.
pub fn status(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        ui.spacing_mut().item_spacing.x = 12.0;
        status_figures(cx, ui);
        // What the window has no room for is cut off.
        ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.set_clip_rect(ui.clip_rect().intersect(ui.max_rect()));
            status_words(cx, ui);
        });
    });
}

fn mono(text: String) -> RichText {
    RichText::new(text).monospace().size(11.5)
}

/// On the left.
fn status_words(cx: &mut Cx<'_>, ui: &mut Ui) {
    saved(cx, ui);
    coarse_view(cx, ui);
    ui.separator();
    let statistics = cx.session.statistics();
    let reason = if statistics.reset_reason.is_empty() { "\u{2014}" } else { &statistics.reset_reason };
    ui.label(mono(format!("reset: {reason}"))).on_hover_text("Why the picture was last begun anew");
    ui.separator();
    let accel = &statistics.acceleration;
    let text = format!(
        "BLAS {} ({} built, {} refit, {} pending) \u{b7} TLAS {}",
        accel.blas_count,
        accel.blas_built,
        accel.blas_refit,
        accel.blas_pending,
        tlas_word(accel.tlas)
    );
    let tip = "Acceleration structures: a BLAS for each mesh and each object that deforms, one TLAS over all \
               instances; in brackets what the last frame did. Click for all figures";
    if ui.add(egui::Label::new(mono(text)).sense(egui::Sense::click())).on_hover_text(tip).clicked() {
        cx.state.actions.push(Action::ShowTab(Tab::Acceleration));
    }
    acceleration::pending(cx, ui);
    ui.separator();
    memory(cx, ui);
    if statistics.non_finite > 0 {
        let text = mono(format!("{} {} non-finite", icon::WARNING, statistics.non_finite));
        let tip = "Samples that were no finite numbers; they were dropped";
        ui.label(text.color(ui.visuals().warn_fg_color)).on_hover_text(tip);
    }
}

/// On the right, from there to the left.
fn status_figures(cx: &mut Cx<'_>, ui: &mut Ui) {
    let ms = super::milliseconds(cx.session.device_ms(), 2);
    ui.label(mono(format!("{ms:>7} ms"))).on_hover_text("All passes of a frame on the device");
    let samples = mono(format!("{:6} samples", cx.session.statistics().samples));
    ui.label(samples).on_hover_text("Samples in each pixel of the picture");
    if let Some(noise) = cx.session.live_error().and_then(|found| found.noise)
        && !cx.session.settings().denoise_stills
    {
        let text = mono(format!("noise {:.2} %", noise.error().value * 100.0));
        ui.label(text).on_hover_text("What more samples would take away; the Error panel says more");
    }
    let Some(audit) = &cx.state.health else { return };
    let is_problem = |finding: &&Finding| finding.severity != Severity::Info;
    let problems = audit.findings.iter().filter(is_problem).count();
    let link = mono(format!("problems {problems}"));
    if problems > 0 && ui.link(link).on_hover_text("Open the Health panel").clicked() {
        cx.state.actions.push(Action::ShowTab(Tab::Health));
    }
}

fn tlas_word(work: TlasWork) -> &'static str {
    match work {
        TlasWork::Kept => "kept",
        TlasWork::Refit => "refit",
        TlasWork::Built => "built",
    }
}

fn saved(cx: &Cx<'_>, ui: &mut Ui) {
    let name =
        cx.session.path().and_then(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned());
    let name = name.unwrap_or_else(|| "unsaved scene".to_owned());
    let (mark, color, tip) = if cx.session.is_modified() {
        (icon::CIRCLE, ui.visuals().warn_fg_color, "There are changes that are not saved (Ctrl+S)")
    } else {
        (icon::CHECK_CIRCLE, ui.visuals().weak_text_color(), "Everything is saved")
    };
    ui.label(RichText::new(format!("{mark}  {name}")).color(color).size(12.0)).on_hover_text(tip);
}

/// Says so when there is no memory for the whole view.
fn coarse_view(cx: &Cx<'_>, ui: &mut Ui) {
    let coarse = cx.session.least_divisor();
    if coarse > 1 {
        ui.separator();
        let text = mono(format!("{} view at 1/{coarse}: memory is short", icon::WARNING));
        let tip = format!("The view is shown at 1/{coarse} of its size, {}", cx.session.shortage());
        ui.label(text.color(ui.visuals().warn_fg_color)).on_hover_text(tip);
    }
}

fn memory(cx: &Cx<'_>, ui: &mut Ui) {
    const MIB: f64 = 1024.0 * 1024.0;
    let budget = cx.session.device().memory_budget();
    let text = format!("{:.0} / {:.0} MiB", budget.used_bytes as f64 / MIB, budget.budget_bytes as f64 / MIB);
    ui.label(RichText::new(text).monospace().size(11.5)).on_hover_ui(|ui| {
        ui.label("Device memory: in use / allowed. By kind:");
        egui::Grid::new("memory").num_columns(2).show(ui, |ui| {
            for (kind, bytes) in &cx.session.statistics().memory {
                ui.label(kind.to_string());
                ui.monospace(format!("{:9.1} MiB", *bytes as f64 / MIB));
                ui.end_row();
            }
        });
    });
}
