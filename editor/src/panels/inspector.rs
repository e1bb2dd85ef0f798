//! The selected object: name, transform, materials, light, camera. Enters: the document. Leaves: edits; a drag of a
//! field is one step of the history because its edits join.

use caustica_scene::{Camera, Driven, Edit, Light, LightKind, Local, NodeId, Projection, Target, Trs};
use egui::{DragValue, RichText, TextEdit, Ui};
use egui_phosphor::regular as icon;
use glam::DVec3;

use super::{Cx, field, light_icon, number, section, target_icon};
use crate::gizmo::paint::axis_color;
use crate::ui_state::EulerFields;

/// Draws the panel.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(target) = cx.state.selection.active() else {
        super::empty_note(ui, "Select an object in the view or in the outliner.");
        ui.add_space(8.0);
        section(ui, "Environment", |ui| super::environment::ui(cx, ui));
        return;
    };
    header(cx, ui, target);
    let lock = cx.session.document().locked_by(target);
    if let Some(node) = lock {
        locked_note(cx, ui, node);
    }
    ui.add_enabled_ui(lock.is_none(), |ui| sections(cx, ui, target));
}

/// Tells why nothing can be changed, and lets go.
fn locked_note(cx: &mut Cx<'_>, ui: &mut Ui, node: NodeId) {
    ui.horizontal(|ui| {
        let name = cx.session.document().display_name(node.into());
        ui.label(format!("{}  {name} is locked.", icon::LOCK_SIMPLE));
        if ui.button("Unlock").clicked() {
            cx.push(Edit::SetLocked { node, locked: false });
        }
    });
    ui.add_space(6.0);
}

fn sections(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    section(ui, "Transform", |ui| transform(cx, ui, target));
    if let Some(light) = cx.session.document().light_of(target) {
        section(ui, "Light", |ui| light_ui(cx, ui, target, light));
    }
    if let Some(camera) = cx.session.document().camera_of(target) {
        section(ui, "Camera", |ui| camera_ui(cx, ui, target, camera));
    }
    if cx.session.document().mesh_of(target).is_some() {
        super::shapes::ui(cx, ui, target);
        super::mesh::ui(cx, ui, target);
        super::material::ui(cx, ui, target);
    }
    super::source::ui(cx, ui, target);
}

fn header(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(target_icon(cx, target)).size(18.0));
        name_field(cx, ui, target);
        let visible = cx.session.document().visible(target).unwrap_or(true);
        let eye = if visible { icon::EYE } else { icon::EYE_SLASH };
        if ui
            .add(egui::Button::new(eye).frame(false))
            .on_hover_text("Show or hide this and everything below it")
            .clicked()
        {
            cx.push(Edit::SetVisible { target, visible: !visible });
        }
    });
    let document = cx.session.document();
    if document.driven(target).visibility {
        let shown = document.posed_visible(target) == Some(true);
        ui.horizontal(|ui| {
            ui.weak(if shown { "A clip shows it now." } else { "A clip hides it now." });
            rest_pose_mark(ui);
        });
    }
    let others = cx.state.selection.targets().len() - 1;
    if others > 0 {
        ui.weak(format!("and {others} more selected; the fields change the one shown"));
    }
    ui.add_space(6.0);
}

fn name_field(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let shown = cx.session.document().display_name(target);
    let typed = match cx.state.inspector.name.take() {
        Some((whose, text)) if whose == target => text,
        _ => shown.clone(),
    };
    let mut text = typed;
    let width = ui.available_width() - 34.0;
    let response = ui.add(TextEdit::singleline(&mut text).desired_width(width).id_salt(("name", target)));
    if response.lost_focus() {
        let escaped = ui.input(|input| input.key_pressed(egui::Key::Escape));
        if !escaped && text != shown {
            cx.push(Edit::Rename { target, name: text });
        }
    } else if response.has_focus() {
        cx.state.inspector.name = Some((target, text));
    }
}

fn transform(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let document = cx.session.document();
    let (Some(local), driven) = (document.local(target), document.driven(target)) else { return };
    let inspector = &mut cx.state.inspector;
    let (euler, uniform) = (&mut inspector.euler, inspector.uniform_scale);
    let changed = trs_fields(ui, "parent", euler, target, local.nearest_trs(), uniform, driven);
    ui.checkbox(&mut cx.state.inspector.uniform_scale, "Scale all axes together");
    if matches!(local, Local::Matrix(_)) {
        ui.colored_label(
            ui.visuals().warn_fg_color,
            "This transform has shear; changing a field removes it.",
        );
    }
    if let Some(trs) = changed {
        cx.push(Edit::SetTransform { target, local: Local::Trs(trs) });
    }
}

/// Position, rotation and scale against `parent`; gives them when one was changed. `driven`: what a clip sets.
pub(super) fn trs_fields(
    ui: &mut Ui,
    parent: &str,
    euler: &mut EulerFields,
    target: Target,
    trs: Trs,
    uniform_scale: bool,
    driven: Driven,
) -> Option<Trs> {
    let mut changed = None;
    let position = VectorField {
        name: "Position",
        tip: &format!("Metres against the {parent}"),
        speed: (trs.translation.abs().max_element() * 0.002).clamp(0.002, 1.0),
        decimals: 3,
        suffix: " m",
        neutral: DVec3::ZERO,
        driven: driven.translation,
    };
    if let Some(translation) = position.ui(ui, trs.translation) {
        changed = Some(Trs { translation, ..trs });
    }
    let rotation = VectorField {
        name: "Rotation",
        tip: &format!("Degrees about X, then Y, then Z (fixed axes of the {parent})"),
        speed: 0.5,
        decimals: 1,
        suffix: "\u{b0}",
        neutral: DVec3::ZERO,
        driven: driven.rotation,
    };
    if let Some(degrees) = rotation.ui(ui, euler.degrees(target, trs.rotation)) {
        changed = Some(Trs { rotation: euler.set(target, degrees), ..trs });
    }
    let scale = VectorField {
        name: "Scale",
        tip: "Along its own axes; negative mirrors",
        speed: scale_speed(trs.scale),
        decimals: 2,
        suffix: "",
        neutral: DVec3::ONE,
        driven: driven.scale,
    };
    if let Some(scale) = scale.ui(ui, trs.scale) {
        changed = Some(Trs { scale: if uniform_scale { uniform(trs.scale, scale) } else { scale }, ..trs });
    }
    changed
}

/// A point of a drag is a hundredth of what is dragged, whatever its size.
fn scale_speed(scale: DVec3) -> f64 {
    let size = scale.abs().max_element();
    if size > 0.0 { size * 0.01 } else { 0.01 }
}

/// Scales all axes by the factor by which one was changed.
fn uniform(old: DVec3, new: DVec3) -> DVec3 {
    let axis = (0..3).find(|&axis| old[axis] != new[axis]);
    match axis {
        Some(axis) if old[axis].abs() > 1e-12 => old * (new[axis] / old[axis]),
        Some(axis) => DVec3::splat(new[axis]),
        None => new,
    }
}

/// Three numbers in a row below their name.
pub(super) struct VectorField<'a> {
    pub(super) name: &'a str,
    pub(super) tip: &'a str,
    /// Of a drag, a point.
    pub(super) speed: f64,
    pub(super) decimals: usize,
    pub(super) suffix: &'a str,
    pub(super) neutral: DVec3,
    /// A clip sets it: what is typed shows at rest only.
    pub(super) driven: bool,
}

impl VectorField<'_> {
    /// Gives the numbers when one was changed.
    pub(super) fn ui(&self, ui: &mut Ui, value: DVec3) -> Option<DVec3> {
        let mut edited = value;
        let mut changed = false;
        ui.horizontal(|ui| {
            ui.label(RichText::new(self.name).weak()).on_hover_text(self.tip);
            if self.driven {
                rest_pose_mark(ui);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let reset = egui::Button::new(icon::ARROW_COUNTER_CLOCKWISE).frame(false);
                let reset = ui.add_enabled(value != self.neutral, reset);
                if reset.on_hover_text("Back to the neutral value").clicked() {
                    edited = self.neutral;
                    changed = true;
                }
            });
        });
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let width = ((ui.available_width() - 8.0) / 3.0).max(48.0);
            for axis in 0..3 {
                let letter = RichText::new(["X ", "Y ", "Z "][axis]).color(axis_color(axis)).small().strong();
                let drag = number::field(&mut edited[axis], self.decimals)
                    .speed(self.speed)
                    .prefix(letter)
                    .suffix(self.suffix)
                    .update_while_editing(false);
                changed |= ui.add_sized([width, ui.spacing().interact_size.y], drag).changed();
            }
        });
        ui.add_space(2.0);
        (changed && edited.is_finite()).then_some(edited)
    }
}

/// Says of a value that a clip sets it: what is edited is that of the rest pose.
pub(super) fn rest_pose_mark(ui: &mut Ui) {
    let text = RichText::new(format!("{}  rest pose", icon::FILM_STRIP)).small();
    ui.colored_label(ui.visuals().warn_fg_color, text).on_hover_text(
        "A clip sets this at the time that is shown. What is changed here is the rest pose: Shift+Space shows it.",
    );
}

/// What a clip makes of something at the time that is shown, above the fields of the rest pose.
fn posed_fields(ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    ui.push_id("posed", |ui| {
        ui.weak("At the time that is shown, a clip sets:");
        ui.add_enabled_ui(false, body);
    });
    ui.add_space(4.0);
    rest_pose_mark(ui);
}

fn light_ui(cx: &mut Cx<'_>, ui: &mut Ui, target: Target, old: Light) {
    let document = cx.session.document();
    if let Some(mut posed) = document.posed_light(target).filter(|_| document.driven(target).light) {
        posed_fields(ui, |ui| light_fields(ui, &mut posed));
    }
    let mut light = old;
    light_fields(ui, &mut light);
    if light != old {
        cx.push(Edit::SetLight { target, light });
    }
}

fn light_fields(ui: &mut Ui, light: &mut Light) {
    field(ui, "Kind", "What the light looks like from afar", |ui| kind_menu(ui, &mut light.kind));
    field(ui, "Colour", "Linear colour, multiplied by the intensity", |ui| {
        let mut rgb = light.color.to_array();
        // The widget rounds what it shows: only a change by the user counts.
        if ui.color_edit_button_rgb(&mut rgb).changed() {
            light.color = rgb.into();
        }
    });
    let (unit, tip) = match light.kind {
        LightKind::Directional { .. } => (" lx", "Illuminance in lux, on a surface that faces the light"),
        _ => (" cd", "Luminous intensity in candela: lux at one metre"),
    };
    field(ui, "Intensity", tip, |ui| {
        let speed = f64::from(light.intensity.abs().max(0.1)) * 0.01;
        ui.add(
            DragValue::new(&mut light.intensity)
                .range(0.0..=1e9)
                .clamp_existing_to_range(false)
                .speed(speed)
                .suffix(unit),
        );
    });
    match &mut light.kind {
        LightKind::Point { radius_m, range_m } => {
            radius_field(ui, radius_m);
            range_field(ui, range_m);
        }
        LightKind::Spot { radius_m, range_m, inner_rad, outer_rad } => {
            radius_field(ui, radius_m);
            range_field(ui, range_m);
            angle_field(
                ui,
                "Inner cone",
                "Full strength inside this angle from the axis",
                inner_rad,
                0.0,
                89.0,
            );
            angle_field(ui, "Outer cone", "No light outside this angle from the axis", outer_rad, 0.1, 90.0);
            *inner_rad = inner_rad.min(*outer_rad);
        }
        LightKind::Directional { angular_radius_rad } => {
            let tip = "Half the angle under which the light is seen; the sun has 0.27 degrees. Zero gives hard shadows";
            angle_field(ui, "Angular radius", tip, angular_radius_rad, 0.0, 45.0);
        }
    }
}

fn kind_menu(ui: &mut Ui, kind: &mut LightKind) {
    let radius = match *kind {
        LightKind::Point { radius_m, .. } | LightKind::Spot { radius_m, .. } => radius_m,
        LightKind::Directional { .. } => 0.05,
    };
    let kinds = [
        ("Point", LightKind::Point { radius_m: radius, range_m: None }),
        ("Spot", LightKind::Spot { radius_m: radius, range_m: None, inner_rad: 0.4, outer_rad: 0.6 }),
        ("Sun", LightKind::Directional { angular_radius_rad: 0.00465 }),
    ];
    let same = |a: &LightKind| std::mem::discriminant(a) == std::mem::discriminant(kind);
    let name = kinds.iter().find(|(_, k)| same(k)).map_or("", |(name, _)| name);
    egui::ComboBox::from_id_salt("light kind")
        .selected_text(format!("{}  {name}", light_icon(kind)))
        .show_ui(ui, |ui| {
            for (name, new) in kinds {
                let selected = std::mem::discriminant(&new) == std::mem::discriminant(kind);
                if ui.selectable_label(selected, format!("{}  {name}", light_icon(&new))).clicked()
                    && !selected
                {
                    *kind = new;
                }
            }
        });
}

fn radius_field(ui: &mut Ui, radius_m: &mut f32) {
    field(ui, "Radius", "Of the shining sphere: larger gives softer shadows, zero hard ones", |ui| {
        ui.add(
            DragValue::new(radius_m)
                .range(0.0..=1e4)
                .clamp_existing_to_range(false)
                .speed(0.002)
                .max_decimals(4)
                .suffix(" m"),
        );
    });
}

fn range_field(ui: &mut Ui, range_m: &mut Option<f32>) {
    field(ui, "Range", "The light ends here; without a range it reaches everywhere", |ui| {
        let mut limited = range_m.is_some();
        ui.checkbox(&mut limited, "");
        match (limited, *range_m) {
            (true, None) => *range_m = Some(10.0),
            (false, Some(_)) => *range_m = None,
            _ => {}
        }
        if let Some(range) = range_m {
            ui.add(
                DragValue::new(range)
                    .range(1e-3..=1e9)
                    .clamp_existing_to_range(false)
                    .speed(0.05)
                    .suffix(" m"),
            );
        }
    });
}

fn angle_field(ui: &mut Ui, name: &str, tip: &str, angle_rad: &mut f32, low: f32, high: f32) {
    field(ui, name, tip, |ui| {
        let mut degrees = angle_rad.to_degrees();
        let drag = DragValue::new(&mut degrees)
            .range(low..=high)
            .clamp_existing_to_range(false)
            .speed(0.1)
            .max_decimals(3)
            .suffix("\u{b0}");
        if ui.add(drag).changed() {
            *angle_rad = degrees.to_radians();
        }
    });
}

fn camera_ui(cx: &mut Cx<'_>, ui: &mut Ui, target: Target, old: Camera) {
    let document = cx.session.document();
    if let Some(mut posed) = document.posed_camera(target).filter(|_| document.driven(target).camera) {
        posed_fields(ui, |ui| camera_fields(ui, &mut posed));
    }
    let mut camera = old;
    camera_fields(ui, &mut camera);
    if camera != old {
        cx.push(Edit::SetCamera { target, camera });
    }
    let chosen = cx.session.document().main_camera().is_some_and(|main| main.target == target);
    ui.horizontal(|ui| {
        let button =
            egui::Button::new(format!("{}  Render with this camera", icon::APERTURE)).selected(chosen);
        let tip = "The command line and the 0 key use this camera when none is named";
        if ui.add(button).on_hover_text(tip).clicked() && !chosen {
            cx.push(Edit::SetDefaultCamera(Some(target)));
        }
    });
}

fn camera_fields(ui: &mut Ui, camera: &mut Camera) {
    match &mut camera.projection {
        Projection::Perspective { yfov_rad } => {
            angle_field(
                ui,
                "Field of view",
                "From the lower to the upper edge of the picture",
                yfov_rad,
                1.0,
                170.0,
            );
        }
        Projection::Orthographic { ymag_m } => {
            field(ui, "Half height", "Of the picture, metres", |ui| {
                ui.add(
                    DragValue::new(ymag_m)
                        .range(1e-4..=1e6)
                        .clamp_existing_to_range(false)
                        .speed(0.01)
                        .suffix(" m"),
                );
            });
        }
    }
    field(ui, "Near", "Nothing nearer than this is seen", |ui| {
        ui.add(
            DragValue::new(&mut camera.near_m)
                .range(1e-6..=1e3)
                .clamp_existing_to_range(false)
                .speed(0.001)
                .max_decimals(5)
                .suffix(" m"),
        );
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaling_together_keeps_proportions() {
        let old = DVec3::new(1.0, 2.0, -4.0);
        assert_eq!(uniform(old, DVec3::new(1.0, 3.0, -4.0)), DVec3::new(1.5, 3.0, -6.0));
        assert_eq!(uniform(DVec3::ZERO, DVec3::new(0.0, 2.0, 0.0)), DVec3::splat(2.0));
        assert_eq!(uniform(old, old), old);
    }
}
