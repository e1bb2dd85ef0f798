//! Shaders while the program runs: which files the picture is made of, what is wrong with them, and a field to edit one.
//! Enters: the status of the renderer. Leaves: files saved to the disk, like by any other program.

use std::path::Path;

use caustica_renderer::shader::{ShaderFault, ShaderStatus, Watching};
use egui::{Id, Panel, RichText, ScrollArea, Ui};
use egui_phosphor::regular as icon;

use super::{Cx, code};
use crate::app::actions::Action;

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    let status = cx.session.shader_status();
    let Some(folder) = cx.session.shader_folder() else {
        built_in(cx, ui);
        return;
    };
    cx.state.shaders.follow(&folder);
    Panel::left("shader files")
        .resizable(true)
        .default_size(230.0)
        .show(ui, |ui| files(cx, ui, &folder, &status));
    ui.vertical(|ui| {
        head(cx, ui, &folder, &status);
        faults(cx, ui, &folder, &status);
        text(cx, ui, &status);
    });
}

fn built_in(cx: &mut Cx<'_>, ui: &mut Ui) {
    super::empty_note(
        ui,
        "The shaders are those of the program. A copy of them can be edited while the picture is shown.",
    );
    ui.vertical_centered(|ui| {
        let tip = "Writes the shaders into your own folder of Caustica and shows what is saved there at once";
        if ui.button("Edit the shaders").on_hover_text(tip).clicked() {
            cx.act(Action::EditShaders);
        }
    });
}

/// The files that the picture is made of: main files, with what the shown one includes.
fn files(cx: &mut Cx<'_>, ui: &mut Ui, folder: &Path, status: &ShaderStatus) {
    let all = cx.session.shader_files();
    let shown = cx.state.shaders.shown.clone();
    let broken = |file: &str| status.faults.iter().any(|fault| fault.file == file);
    let mut chosen = None;
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        let mut row = |ui: &mut Ui, file: &str, name: &str, modified: bool| {
            let mark = if modified { " \u{2022}" } else { "" };
            let mut label = RichText::new(format!("{name}{mark}"));
            if broken(file) {
                label = label.color(ui.visuals().error_fg_color);
            }
            if ui.selectable_label(shown.as_deref() == Some(file), label).on_hover_text(file).clicked() {
                chosen = Some(file.to_owned());
            }
        };
        for (main, includes) in all.iter() {
            let modified = |file: &str| cx.state.shaders.is_modified(file);
            row(ui, main, main.strip_prefix("passes/").unwrap_or(main), modified(main));
            let is_open = shown.as_ref() == Some(main);
            let wanted =
                |file: &&String| is_open || broken(file) || modified(file) || shown.as_ref() == Some(*file);
            ui.indent(main, |ui| {
                includes.iter().filter(wanted).for_each(|file| row(ui, file, file, modified(file)));
            });
        }
    });
    if let Some(file) = chosen {
        show(cx, folder, &file, None);
    }
}

fn show(cx: &mut Cx<'_>, folder: &Path, file: &str, place: Option<[u32; 2]>) {
    if let Err(error) = cx.state.shaders.show(folder, file, place) {
        cx.state.toasts.error(error);
    }
}

/// Name of the file and what can be done with it; how it stands with the compiler.
fn head(cx: &mut Cx<'_>, ui: &mut Ui, folder: &Path, status: &ShaderStatus) {
    ui.horizontal_wrapped(|ui| {
        if let Some(file) = cx.state.shaders.shown.clone() {
            let modified = cx.state.shaders.is_modified(&file);
            ui.strong(&file).on_hover_text(folder.join(&file).display().to_string());
            let button = |text: &str| egui::Button::new(text.to_owned());
            let save = ui.add_enabled(modified, button("Save"));
            if save.on_hover_text("Save the file; the picture follows (Ctrl+S)").clicked() {
                cx.act(Action::SaveShader);
                cx.state.shaders.wants_focus = true;
            }
            let revert = ui.add_enabled(modified, button("Revert"));
            if revert.on_hover_text("Back to what is on the disk").clicked() {
                cx.state.shaders.revert();
                cx.state.shaders.wants_focus = true;
            }
            let differs = cx.state.shaders.differs_from_built_in();
            let restore = ui.add_enabled(differs, button("Restore the built-in version"));
            if restore.on_hover_text("Save the text that came with the program in its place").clicked() {
                cx.state.shaders.wants_focus = true;
                if let Err(error) = cx.state.shaders.restore_built_in(folder) {
                    cx.state.toasts.error(error);
                }
            }
            ui.separator();
        }
        state(ui, status);
    });
    ui.separator();
}

fn state(ui: &mut Ui, status: &ShaderStatus) {
    if let Some((name, seconds)) = status.slow.first() {
        ui.spinner();
        let text = format!(
            "{name} has been compiled for {seconds} s and is not ready; what is saved meanwhile waits"
        );
        ui.colored_label(ui.visuals().warn_fg_color, text);
    } else if status.compiling {
        ui.spinner();
        ui.label("compiling");
    } else if let Some(last) = &status.last {
        let [stages, pipelines] = last.counts;
        let text = format!("{}: shown after {:.0} ms", last.files.join(", "), last.total_ms);
        ui.weak(text).on_hover_text(format!(
            "{stages} stages compiled in {:.0} ms, {pipelines} pipelines made by the driver in {:.0} ms; {} edits were taken over, \
             {} refused",
            last.compile_ms, last.driver_ms, status.reloads, status.refused
        ));
    }
    match &status.watching {
        Some(Watching::Polled(reason)) => {
            ui.weak("looked at twice a second").on_hover_text(reason);
        }
        Some(Watching::Off(reason)) => {
            ui.colored_label(ui.visuals().warn_fg_color, "changes are not noticed").on_hover_text(reason);
        }
        Some(Watching::Told) | None => {}
    }
}

/// What is wrong; a click shows the place.
fn faults(cx: &mut Cx<'_>, ui: &mut Ui, folder: &Path, status: &ShaderStatus) {
    if status.faults.is_empty() {
        return;
    }
    let error = ui.visuals().error_fg_color;
    ui.colored_label(error, format!("{} The picture is that of the last good shaders.", icon::WARNING));
    let mut chosen = None;
    ScrollArea::vertical().id_salt("shader faults").max_height(110.0).show(ui, |ui| {
        for fault in &status.faults {
            let label = RichText::new(fault.to_string()).monospace().color(error);
            let link = ui.add(egui::Label::new(label).sense(egui::Sense::click()));
            if link.on_hover_text("Show the place").clicked() {
                chosen = Some((fault.file.clone(), fault.line.map(|line| [line, fault.column.unwrap_or(1)])));
            }
        }
    });
    ui.separator();
    if let Some((file, place)) = chosen {
        show(cx, folder, &file, place);
    }
}

fn text(cx: &mut Cx<'_>, ui: &mut Ui, status: &ShaderStatus) {
    let texts = &mut cx.state.shaders;
    let Some(file) = texts.shown.clone() else {
        super::empty_note(
            ui,
            "Choose a file to the left. What is saved is shown at once, by whatever program it was saved.",
        );
        return;
    };
    let of_file: Vec<&ShaderFault> = status.faults.iter().filter(|fault| fault.file == file).collect();
    // Of each file its own, wherever it is: what can be undone, the cursor and what is scrolled to.
    let id = Id::new(("shader text", &file));
    let go_to = texts.go_to.take();
    if let Some(text) = texts.text_mut() {
        let has_focus = code::field(ui, id, text, &of_file, go_to);
        texts.has_focus = has_focus;
    }
    // After the text, as a click outside of it takes the keyboard from it.
    if std::mem::take(&mut texts.wants_focus) {
        ui.memory_mut(|memory| memory.request_focus(id));
    }
}
