//! What surrounds the scene. Enters: the document's environment. Leaves: `SetEnvironment` edits.

use caustica_scene::{Edit, Environment, EnvironmentFile};
use egui::{DragValue, RichText, Ui};
use egui_phosphor::regular as icon;
use glam::Vec3;

use super::{Cx, field};
use crate::app::actions::Action;

/// Draws the fields.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui) {
    let old = cx.session.document().environment().clone();
    let mut new = old.clone();
    let mut choose_file = false;
    field(ui, "Surroundings", "What rays see that leave the scene", |ui| {
        egui::ComboBox::from_id_salt("environment").selected_text(name(&old)).show_ui(ui, |ui| {
            let mut entry = |ui: &mut Ui, value: Environment, tip: &str| {
                let selected = std::mem::discriminant(&value) == std::mem::discriminant(&old);
                if ui.selectable_label(selected, name(&value)).on_hover_text(tip).clicked() && !selected {
                    new = value;
                }
            };
            entry(
                ui,
                Environment::Auto,
                "What the model asks for; else the sky when nothing shines, else black",
            );
            entry(ui, Environment::DefaultSky, "A plain sky without a sun");
            entry(ui, Environment::Constant(Vec3::ONE), "The same light from all sides");
            let is_file = matches!(old, Environment::File(_));
            if ui
                .selectable_label(is_file, "Image\u{2026}")
                .on_hover_text("An equirectangular .hdr or .exr")
                .clicked()
            {
                choose_file = true;
            }
        });
    });
    match &mut new {
        Environment::Constant(radiance) => constant_field(ui, radiance),
        Environment::File(file) => choose_file |= file_fields(ui, file),
        Environment::Auto => {
            let effective = cx.session.document().effective_environment();
            ui.weak(format!("At present: {}", name(&effective).to_lowercase()));
        }
        Environment::DefaultSky => {}
    }
    if choose_file {
        cx.act(Action::Environment);
    }
    if new != old {
        cx.push(Edit::SetEnvironment(new));
    }
}

fn name(environment: &Environment) -> &'static str {
    match environment {
        Environment::Auto => "Automatic",
        Environment::DefaultSky => "Sky",
        Environment::Constant(_) => "Constant colour",
        Environment::File(_) => "Image",
    }
}

fn constant_field(ui: &mut Ui, radiance: &mut Vec3) {
    field(ui, "Radiance", "Colour times strength, candela per square metre", |ui| {
        let strength = radiance.max_element();
        let mut rgb = if strength > 0.0 { (*radiance / strength).to_array() } else { [1.0; 3] };
        let mut factor = strength;
        let recolored = ui.color_edit_button_rgb(&mut rgb).changed();
        let speed = f64::from(factor.max(0.1)) * 0.01;
        let scaled = ui
            .add(
                DragValue::new(&mut factor)
                    .range(0.0..=1e6)
                    .clamp_existing_to_range(false)
                    .speed(speed)
                    .prefix("\u{d7} "),
            )
            .changed();
        if recolored || scaled {
            *radiance = Vec3::from(rgb) * factor;
        }
    });
}

/// True: another image is wanted.
fn file_fields(ui: &mut Ui, file: &mut EnvironmentFile) -> bool {
    let name = file.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let mut choose = false;
    field(ui, "Image", "Equirectangular radiance", |ui| {
        let text = RichText::new(format!("{}  {name}", icon::IMAGE));
        choose = ui.button(text).on_hover_text(file.path.display().to_string()).clicked();
    });
    if file.map.is_none() {
        ui.colored_label(ui.visuals().error_fg_color, "The image was not found: the surroundings are black.");
    }
    field(ui, "Rotation", "About the vertical axis", |ui| {
        let mut degrees = file.rotation_rad.to_degrees();
        if ui.add(DragValue::new(&mut degrees).speed(0.5).max_decimals(1).suffix("\u{b0}")).changed() {
            file.rotation_rad = degrees.to_radians();
        }
    });
    field(ui, "Strength", "Factor on the image's radiance", |ui| {
        let speed = f64::from(file.scale.max(0.1)) * 0.01;
        ui.add(
            DragValue::new(&mut file.scale)
                .range(0.0..=1e6)
                .clamp_existing_to_range(false)
                .speed(speed)
                .prefix("\u{d7} "),
        );
    });
    choose
}
