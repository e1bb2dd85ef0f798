//! Lobes of a material beside metallic-roughness: a line a lobe that opens when the lobe is there. Enters: a material.
//! Leaves: the material as the user wants it; the caller makes the edit.

use caustica_scene::{
    Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Material, Sheen, SpecularGlossiness,
};
use egui::{DragValue, Ui};

use super::material::{share_slider, texture_note};
use super::{Cx, field};

/// Every lobe of a PBR material; textures are noted, not chosen.
pub fn lobe_fields(cx: &Cx<'_>, ui: &mut Ui, material: &mut Material) {
    clearcoat(cx, ui, &mut material.clearcoat);
    sheen(cx, ui, &mut material.sheen);
    anisotropy(cx, ui, &mut material.anisotropy);
    iridescence(cx, ui, &mut material.iridescence);
    diffuse_transmission(cx, ui, &mut material.diffuse_transmission);
}

/// The line that adds or takes off a lobe; `begin` is what a user who adds it sees at once.
fn lobe<T>(
    ui: &mut Ui,
    name: &str,
    tip: &str,
    lobe: &mut Option<T>,
    begin: impl FnOnce() -> T,
    body: impl FnOnce(&mut Ui, &mut T),
) {
    let mut there = lobe.is_some();
    field(ui, name, tip, |ui| {
        ui.checkbox(&mut there, "").on_hover_text(if there { "Take it off" } else { "Add it" });
    });
    match (there, lobe.is_some()) {
        (true, false) => *lobe = Some(begin()),
        (false, true) => *lobe = None,
        _ => {}
    }
    if let Some(lobe) = lobe {
        ui.push_id(name, |ui| ui.indent(name, |ui| body(ui, lobe)));
    }
}

fn color_button(ui: &mut Ui, color: &mut glam::Vec3) {
    let mut rgb = color.to_array();
    if ui.color_edit_button_rgb(&mut rgb).changed() {
        *color = rgb.into();
    }
}

fn clearcoat(cx: &Cx<'_>, ui: &mut Ui, coat: &mut Option<Clearcoat>) {
    let tip = "A clear layer over everything, like the lacquer of a car";
    let begin = || Clearcoat { factor: 1.0, ..Clearcoat::default() };
    lobe(ui, "Clear coat", tip, coat, begin, |ui, coat| {
        field(ui, "Strength", "How much of the surface is coated", |ui| {
            share_slider(ui, &mut coat.factor);
            texture_note(cx, ui, coat.texture);
        });
        field(ui, "Roughness", "Of the coat. 0: polished", |ui| {
            share_slider(ui, &mut coat.roughness);
            texture_note(cx, ui, coat.roughness_texture);
        });
        if coat.normal_texture.is_some() {
            field(ui, "Normal map", "Strength of the bumps of the coat", |ui| {
                number(ui, &mut coat.normal_scale, 0.0..=8.0, 0.01, "");
                texture_note(cx, ui, coat.normal_texture);
            });
        }
    });
}

fn sheen(cx: &Cx<'_>, ui: &mut Ui, sheen: &mut Option<Sheen>) {
    let tip = "Fibres that stand up from the surface: velvet, felt, dust";
    let begin = || Sheen { color: glam::Vec3::ONE, roughness: 0.5, ..Sheen::default() };
    lobe(ui, "Sheen", tip, sheen, begin, |ui, sheen| {
        field(ui, "Colour", "Of the fibres; black: no sheen", |ui| {
            color_button(ui, &mut sheen.color);
            texture_note(cx, ui, sheen.color_texture);
        });
        field(ui, "Roughness", "0: a thin bright rim (0.05 is the least that is shown). 1: even", |ui| {
            share_slider(ui, &mut sheen.roughness);
            texture_note(cx, ui, sheen.roughness_texture);
        });
    });
}

fn anisotropy(cx: &Cx<'_>, ui: &mut Ui, anisotropy: &mut Option<Anisotropy>) {
    let tip = "Brushed surfaces: highlights are drawn out along one direction";
    let begin = || Anisotropy { strength: 0.5, ..Anisotropy::default() };
    lobe(ui, "Anisotropy", tip, anisotropy, begin, |ui, anisotropy| {
        field(ui, "Strength", "How far the highlight is drawn out", |ui| {
            share_slider(ui, &mut anisotropy.strength);
            texture_note(cx, ui, anisotropy.texture);
        });
        field(ui, "Rotation", "Of the direction, from the tangent of the texture coordinates", |ui| {
            let mut degrees = anisotropy.rotation_rad.to_degrees();
            let drag = DragValue::new(&mut degrees).speed(0.5).max_decimals(2).suffix("\u{b0}");
            if ui.add(drag).changed() {
                anisotropy.rotation_rad = degrees.to_radians();
            }
        });
    });
}

fn iridescence(cx: &Cx<'_>, ui: &mut Ui, film: &mut Option<Iridescence>) {
    let tip = "A thin film whose colours change with the angle: oil, soap, tempered steel";
    let begin = || Iridescence { factor: 1.0, ..Iridescence::default() };
    lobe(ui, "Iridescence", tip, film, begin, |ui, film| {
        field(ui, "Strength", "Share of the film in the reflection", |ui| {
            share_slider(ui, &mut film.factor);
            texture_note(cx, ui, film.texture);
        });
        field(ui, "Film IOR", "Index of refraction of the film; oil 1.4, soap 1.33", |ui| {
            number(ui, &mut film.ior, 1.0..=4.0, 0.005, "");
        });
        if film.thickness_texture.is_some() {
            field(ui, "Thinnest", "Thickness of the film where its texture is black", |ui| {
                number(ui, &mut film.thickness_min_nm, 0.0..=5000.0, 1.0, " nm");
                texture_note(cx, ui, film.thickness_texture);
            });
        }
        field(ui, "Thickness", "Of the film; with a texture, where that is white", |ui| {
            number(ui, &mut film.thickness_max_nm, 0.0..=5000.0, 1.0, " nm");
        });
    });
}

fn diffuse_transmission(cx: &Cx<'_>, ui: &mut Ui, through: &mut Option<DiffuseTransmission>) {
    let tip = "Light that passes scattered: leaves, paper, wax. Shown by the path tracer";
    let begin = || DiffuseTransmission { factor: 0.5, ..DiffuseTransmission::default() };
    lobe(ui, "Translucency", tip, through, begin, |ui, through| {
        field(ui, "Share", "Of the diffuse light that passes instead of being reflected", |ui| {
            share_slider(ui, &mut through.factor);
            texture_note(cx, ui, through.texture);
        });
        field(ui, "Tint", "Of the light that passes", |ui| {
            color_button(ui, &mut through.color);
            texture_note(cx, ui, through.color_texture);
        });
    });
}

/// Reflectance and glossiness, which stand in place of metalness, roughness, specular and index.
pub fn glossiness_fields(cx: &Cx<'_>, ui: &mut Ui, lobe: &mut SpecularGlossiness) {
    field(ui, "Reflectance", "What is reflected head-on (specular-glossiness model)", |ui| {
        color_button(ui, &mut lobe.specular);
        texture_note(cx, ui, lobe.texture);
    });
    field(ui, "Glossiness", "1: polished. 0: chalk", |ui| {
        share_slider(ui, &mut lobe.glossiness);
        texture_note(cx, ui, lobe.texture);
    });
}

/// How the index depends on the colour, shown where light bends.
pub fn dispersion_field(ui: &mut Ui, dispersion: &mut f32) {
    let tip = "Rainbow colours in glass: 20 / Abbe number. Crown glass 0.33, diamond 0.36. Shown by the path tracer";
    field(ui, "Dispersion", tip, |ui| number(ui, dispersion, 0.0..=20.0, 0.01, ""));
}

fn number(ui: &mut Ui, value: &mut f32, range: std::ops::RangeInclusive<f32>, speed: f64, suffix: &str) {
    let drag = DragValue::new(value).range(range).clamp_existing_to_range(false);
    ui.add(drag.speed(speed).max_decimals(3).suffix(suffix));
}
