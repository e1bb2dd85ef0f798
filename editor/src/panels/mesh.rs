//! What is particular to a placed mesh: which rays meet it, the weights of its morph targets, its primitives. Enters: the
//! document. Leaves: edits; a drag of a slider is one step of the history because its edits join.

use caustica_scene::{Document, Driven, Edit, Local, OverrideField, Target};
use egui::{Button, RichText, ScrollArea, Slider, Ui};
use egui_phosphor::regular as icon;
use glam::DAffine3;

use super::inspector::{rest_pose_mark, trs_fields};
use super::{Cx, field, section};
use crate::ui_state::SelectedPrimitive;

/// Height of a line of the list of primitives, points.
const ROW: f32 = 24.0;
/// Lines of that list that are shown at once.
const ROWS: f32 = 6.0;

/// Draws the sections.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    section(ui, "Visibility", |ui| rays(cx, ui, target));
    if let Some(weights) = cx.session.document().morph_weights(target) {
        section(ui, "Shape", |ui| shape(cx, ui, target, weights));
    }
    section(ui, "Primitives", |ui| primitives(cx, ui, target));
}

fn rays(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let document = cx.session.document();
    let Some(old) = document.ray_visibility(target) else { return };
    let own = document.part_override(target).is_some_and(|own| own.ray_visibility.is_some());
    let mut new = old;
    ui.horizontal(|ui| {
        ui.checkbox(&mut new.camera_visible, "seen by the camera")
            .on_hover_text("Off: only mirrors, glass and its shadow tell of it");
        if own {
            follow_button(cx, ui, target, OverrideField::RayVisibility);
        }
    });
    ui.checkbox(&mut new.casts_shadows, "casts shadows")
        .on_hover_text("Off: light passes as if it were not there");
    if new != old {
        let (camera_visible, casts_shadows) = (new.camera_visible, new.casts_shadows);
        cx.push(Edit::SetRayVisibility { target, camera_visible, casts_shadows });
    }
}

/// Gives a part back to its source in one respect.
fn follow_button(cx: &mut Cx<'_>, ui: &mut Ui, target: Target, field: OverrideField) {
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        let button = Button::new(icon::ARROW_COUNTER_CLOCKWISE).frame(false);
        if ui.add(button).on_hover_text("Follow the source again").clicked() {
            cx.push(Edit::ResetOverride { target, field });
        }
    });
}

fn shape(cx: &mut Cx<'_>, ui: &mut Ui, target: Target, old: Vec<f32>) {
    let document = cx.session.document();
    let mesh = document.mesh_of(target).and_then(|id| document.mesh(id));
    let names: Vec<String> = mesh.map_or_else(Vec::new, |mesh| {
        let name = |(index, name): (usize, &String)| match name.is_empty() {
            true => format!("shape {}", index + 1),
            false => name.clone(),
        };
        mesh.data.morph.iter().map(|morph| &morph.name).enumerate().map(name).collect()
    });
    let driven = document.driven(target).weights;
    let own = document.part_override(target).is_some_and(|own| own.weights.is_some());
    let mut new = old.clone();
    for (index, (name, weight)) in names.iter().zip(&mut new).enumerate() {
        ui.push_id(index, |ui| field(ui, name, name, |ui| weight_slider(ui, weight)));
    }
    if driven {
        rest_pose_mark(ui);
    }
    let mut reset = false;
    ui.horizontal(|ui| {
        let zero = old.iter().all(|weight| *weight == 0.0);
        let button = Button::new(format!("{}  All to 0", icon::ARROW_COUNTER_CLOCKWISE));
        if ui.add_enabled(!zero, button).on_hover_text("The mesh as it is without its shapes").clicked() {
            new.fill(0.0);
        }
        let button = Button::new("Follow the source");
        reset = own && ui.add(button).on_hover_text("The weights of the file").clicked();
    });
    if reset {
        cx.push(Edit::ResetOverride { target, field: OverrideField::Weights });
    } else if new != old {
        cx.push(Edit::SetMorphWeights { target, weights: new });
    }
}

/// From 0 to 1; more and less can be typed, and are kept.
fn weight_slider(ui: &mut Ui, weight: &mut f32) {
    ui.spacing_mut().slider_width = (ui.available_width() - 72.0).clamp(32.0, 200.0);
    let mut shown = *weight;
    let slider = Slider::new(&mut shown, 0.0..=1.0).clamping(egui::SliderClamping::Never).fixed_decimals(2);
    // The widget rounds what it shows: only a change by the user counts.
    if ui.add(slider).changed() && shown.is_finite() {
        *weight = shown;
    }
}

fn primitives(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let document = cx.session.document();
    let Some(renderable) = document.renderable(target) else { return };
    let selected = cx.state.selection.primitive(document).filter(|selected| selected.target == target);
    let count = renderable.materials.len();
    let mut chosen = selected.map(|selected| selected.index);
    let height = ROW * ROWS.min(count as f32);
    ui.spacing_mut().item_spacing.y = 0.0;
    ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show_rows(ui, ROW, count, |ui, range| {
        for index in range {
            let material = renderable.materials.get(index).and_then(|id| document.material(*id));
            let name = material.map_or("", |material| material.name.as_str());
            let elements = elements_of(document, target, index);
            let index = index as u32;
            let text = format!("{}  {index}  {name}", icon::TRIANGLE);
            let button = Button::new(text)
                .right_text(RichText::new(format!("{elements}")).weak().small())
                .selected(chosen == Some(index))
                .frame_when_inactive(chosen == Some(index))
                .truncate()
                .min_size(egui::vec2(ui.available_width(), ROW));
            let tip = "What has one material: triangles, or spheres and boxes. Click to move it inside its mesh; a double click in the view does the same";
            if ui.add(button).on_hover_text(tip).clicked() {
                chosen = if chosen == Some(index) { None } else { Some(index) };
            }
        }
    });
    if chosen != selected.map(|selected| selected.index) {
        cx.state.selection.set(target);
        cx.state.selection.set_primitive(cx.session.document(), chosen);
    } else if let Some(selected) = selected {
        ui.add_space(6.0);
        ui.spacing_mut().item_spacing.y = 4.0;
        place(cx, ui, selected);
    }
}

/// Number of triangles, or of spheres and boxes, of a primitive.
fn elements_of(document: &Document, target: Target, index: usize) -> u32 {
    let Some(mesh) = document.mesh_of(target).and_then(|id| document.mesh(id)) else { return 0 };
    let corners = if mesh.shapes().is_some() { 1 } else { 3 };
    mesh.primitives.get(index).map_or(0, |primitive| primitive.index_count / corners)
}

/// The place of the selected primitive inside its mesh.
fn place(cx: &mut Cx<'_>, ui: &mut Ui, selected: SelectedPrimitive) {
    let SelectedPrimitive { target, mesh, index, mesh_from_primitive, .. } = selected;
    let name = primitive_name(cx.session.document(), &selected);
    ui.colored_label(
        ui.visuals().warn_fg_color,
        format!("{}  {name} moves in every object that places this mesh.", icon::WARNING),
    );
    let inspector = &mut cx.state.inspector;
    let (euler, uniform) = (&mut inspector.primitive_euler, inspector.uniform_scale);
    let trs = Local::from_affine(mesh_from_primitive).nearest_trs();
    let changed = ui
        .push_id("primitive", |ui| trs_fields(ui, "mesh", euler, target, trs, uniform, Driven::default()))
        .inner;
    let mut new = changed.map(|trs| Local::Trs(trs).to_affine());
    let moved = mesh_from_primitive != DAffine3::IDENTITY;
    let button = Button::new(format!("{}  Back to its place in the file", icon::ARROW_COUNTER_CLOCKWISE));
    if ui.add_enabled(moved, button).clicked() {
        new = Some(DAffine3::IDENTITY);
    }
    if let Some(mesh_from_primitive) = new {
        cx.push(Edit::SetPrimitiveTransform { mesh, primitive: index, mesh_from_primitive });
    }
}

/// "primitive 1 of Plates".
pub fn primitive_name(document: &Document, selected: &SelectedPrimitive) -> String {
    let mesh = document.mesh(selected.mesh).map_or("", |mesh| mesh.name.as_str());
    let mesh = if mesh.is_empty() { document.display_name(selected.target) } else { mesh.to_owned() };
    format!("Primitive {} of {mesh}", selected.index)
}
