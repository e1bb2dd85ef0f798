//! The source of an instance: its file, the scene and the variant of materials that it shows, and what it shares with other instances.
//! Enters: the document. Leaves: edits, and actions that read files.

use caustica_scene::{Edit, NodeKind, OverrideField, PrefabId, Target};
use egui::{RichText, Ui};
use egui_phosphor::regular as icon;

use super::{Cx, field, section};
use crate::app::actions::Action;

/// Draws the section; nothing for what is no instance.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let document = cx.session.document();
    let Some(NodeKind::Prefab { prefab: id, .. }) = document.node(target.node).map(|node| &node.kind) else {
        return;
    };
    let id = *id;
    let Some(prefab) = document.prefab(id) else { return };
    // Inside the project's folder, the path from there is enough.
    let folder = cx.session.path().and_then(std::path::Path::parent);
    let shown = folder.and_then(|folder| prefab.source.strip_prefix(folder).ok()).unwrap_or(&prefab.source);
    let (source, missing, variants) = (shown.display().to_string(), prefab.missing, prefab.variants());
    let (scenes, default_scene) = (prefab.scene_names(), prefab.default_scene());
    section(ui, "Source", |ui| {
        ui.label(RichText::new(&source).small()).on_hover_text("The file that this instance shows");
        if missing {
            let message = "The file was not found: nothing is shown in its place.";
            ui.colored_label(ui.visuals().error_fg_color, message);
        }
        if scenes.len() > 1 {
            scene_field(cx, ui, target, &scenes, default_scene);
        }
        if !variants.is_empty() {
            variant_field(cx, ui, target, &variants);
        }
        file_buttons(cx, ui, id);
        if target.part.is_some() {
            follow_button(cx, ui, target);
        }
    });
}

/// A choice among several scenes of a file.
fn scene_field(cx: &mut Cx<'_>, ui: &mut Ui, target: Target, scenes: &[String], default_scene: usize) {
    field(ui, "Scene", "Which of the scenes in the file this instance shows", |ui| {
        let old = cx.session.document().scene_of(target.node).map(str::to_owned);
        let mut chosen = old.clone();
        let by_itself = format!("Default ({})", scenes.get(default_scene).map_or("", String::as_str));
        let text = chosen.clone().unwrap_or_else(|| by_itself.clone());
        egui::ComboBox::from_id_salt("scene").selected_text(text).show_ui(ui, |ui| {
            ui.selectable_value(&mut chosen, None, by_itself);
            for name in scenes {
                ui.selectable_value(&mut chosen, Some(name.clone()), name);
            }
        });
        if chosen != old {
            cx.push(Edit::SetScene { node: target.node, scene: chosen });
        }
    });
}

fn variant_field(cx: &mut Cx<'_>, ui: &mut Ui, target: Target, variants: &[String]) {
    field(ui, "Variant", "Which of the sets of materials in the file this instance shows", |ui| {
        let old = cx.session.document().variant_of(target.node).map(str::to_owned);
        let mut chosen = old.clone();
        let text = chosen.as_deref().unwrap_or("Default").to_owned();
        egui::ComboBox::from_id_salt("variant").selected_text(text).show_ui(ui, |ui| {
            ui.selectable_value(&mut chosen, None, "Default");
            for name in variants {
                ui.selectable_value(&mut chosen, Some(name.clone()), name);
            }
        });
        if chosen != old {
            cx.push(Edit::SetVariant { node: target.node, variant: chosen });
        }
    });
}

fn file_buttons(cx: &mut Cx<'_>, ui: &mut Ui, prefab: PrefabId) {
    let buttons = [
        (
            icon::ARROWS_CLOCKWISE,
            "Reload",
            "Reads the file again; what was changed here stays",
            Action::ReloadSource(prefab),
        ),
        (
            icon::SWAP,
            "Replace\u{2026}",
            "Shows another file in all instances of this one; what was changed in parts of the same name stays",
            Action::ReplaceSource(prefab),
        ),
        (
            icon::PACKAGE,
            "Make unique",
            "Gives this instance materials and a source of its own; vertices and textures then lie in device memory once more",
            Action::MakeUnique,
        ),
    ];
    ui.horizontal_wrapped(|ui| {
        for (icon, name, tip, action) in buttons {
            if ui.button(format!("{icon}  {name}")).on_hover_text(tip).clicked() {
                cx.act(action);
            }
        }
    });
}

fn follow_button(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let changed = cx.session.document().part_override(target).is_some();
    let tip = "Takes back everything that was changed in this part of this instance";
    if ui.add_enabled(changed, egui::Button::new("Follow the source again")).on_hover_text(tip).clicked() {
        cx.push(Edit::ResetOverride { target, field: OverrideField::All });
    }
}
