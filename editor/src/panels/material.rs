//! The materials of a placed mesh, one section a material. Enters: the document. Leaves: `SetMaterial` edits, which
//! change the material wherever it is used.

use caustica_scene::{AlphaMode, Edit, Material, MaterialEntry, MaterialId, ShadingMode, Target, TextureUse};
use egui::{DragValue, RichText, Slider, Ui};
use egui_phosphor::regular as icon;

use super::inspector::rest_pose_mark;
use super::material_lobes::{dispersion_field, glossiness_fields, lobe_fields};
use super::{Cx, field, section};

/// Indices of refraction for sodium light (589 nm), as tabulated in common handbooks.
const IOR_PRESETS: [(&str, f32); 8] = [
    ("Air", 1.0),
    ("Ice", 1.309),
    ("Water", 1.333),
    ("Acrylic", 1.49),
    ("Window glass", 1.52),
    ("Flint glass", 1.62),
    ("Sapphire", 1.77),
    ("Diamond", 2.417),
];

const MODES: [(ShadingMode, &str, &str); 4] = [
    (ShadingMode::Pbr, "PBR", "glTF's metallic-roughness model"),
    (ShadingMode::Reflective, "Mirror", "A perfect mirror, tinted by the base colour"),
    (ShadingMode::Refractive, "Glass", "Smooth glass: exact Fresnel reflection and refraction"),
    (ShadingMode::Unlit, "Unlit", "The base colour as it is, without light"),
];

/// Draws one section for each material of the mesh.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let Some(renderable) = cx.session.document().renderable(target) else { return };
    let mut shown: Vec<MaterialId> = Vec::new();
    for (primitive, id) in renderable.materials.iter().copied().enumerate() {
        if shown.contains(&id) {
            continue;
        }
        shown.push(id);
        let Some(old) = cx.session.document().material(id).cloned() else { continue };
        let name = if old.name.is_empty() { format!("material {}", id.0) } else { old.name.clone() };
        ui.push_id(id, |ui| {
            section(ui, &format!("Material: {name}"), |ui| {
                if cx.session.document().is_material_driven(id) {
                    rest_pose_mark(ui);
                }
                edit_material(cx, ui, id, &old);
                own_copy(cx, ui, target, primitive as u32, id, &old);
            });
        });
    }
    mesh_facts(cx, ui, renderable.mesh);
}

fn edit_material(cx: &mut Cx<'_>, ui: &mut Ui, id: MaterialId, old: &Material) {
    let mut new = old.clone();
    mode_buttons(ui, &mut new);
    field(
        ui,
        "Base colour",
        "Albedo of a rough surface, reflectance of metals and mirrors, tint of glass",
        |ui| {
            let mut rgba = new.base_color.to_array();
            // The widget rounds what it shows: only a change by the user counts.
            if ui.color_edit_button_rgba_unmultiplied(&mut rgba).changed() {
                new.base_color = rgba.into();
            }
            texture_note(cx, ui, new.base_color_texture);
        },
    );
    match new.mode {
        ShadingMode::Pbr => pbr_fields(cx, ui, &mut new),
        ShadingMode::Refractive => {
            ior_field(ui, &mut new.ior);
            volume_fields(ui, &mut new);
            dispersion_field(ui, &mut new.dispersion);
        }
        ShadingMode::Reflective | ShadingMode::Unlit => {}
    }
    emission_fields(cx, ui, &mut new);
    field(ui, "Both sides", "Seen from behind too; glass always is", |ui| {
        ui.checkbox(&mut new.double_sided, "");
    });
    alpha_field(ui, &mut new);
    if new.normal_texture.is_some() {
        field(ui, "Normal map", "Strength of the bumps", |ui| {
            ui.add(
                DragValue::new(&mut new.normal_scale)
                    .range(0.0..=8.0)
                    .clamp_existing_to_range(false)
                    .speed(0.01),
            );
            texture_note(cx, ui, new.normal_texture);
        });
    }
    if new != *old {
        cx.push(Edit::SetMaterial { material: id, value: Box::new(new) });
    }
}

fn mode_buttons(ui: &mut Ui, material: &mut Material) {
    field(ui, "Shading", "How light is scattered", |ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 6.0;
        for (mode, name, tip) in MODES {
            if ui.selectable_label(material.mode == mode, name).on_hover_text(tip).clicked() {
                material.mode = mode;
                // Glass is solid unless the user says that it is a sheet.
                material.has_volume |= mode == ShadingMode::Refractive;
            }
        }
    });
}

fn pbr_fields(cx: &Cx<'_>, ui: &mut Ui, material: &mut Material) {
    match &mut material.specular_glossiness {
        Some(lobe) => glossiness_fields(cx, ui, lobe),
        None => metallic_roughness_fields(cx, ui, material),
    }
    field(ui, "Transmission", "Share of the light that passes instead of being scattered", |ui| {
        share_slider(ui, &mut material.transmission);
        texture_note(cx, ui, material.transmission_texture);
    });
    let scatters_inside = material.diffuse_transmission.is_some();
    if material.transmission > 0.0 || scatters_inside {
        volume_fields(ui, material);
    }
    if material.transmission > 0.0 && material.has_volume {
        dispersion_field(ui, &mut material.dispersion);
    }
    lobe_fields(cx, ui, material);
}

fn metallic_roughness_fields(cx: &Cx<'_>, ui: &mut Ui, material: &mut Material) {
    field(ui, "Metallic", "0: plastic, stone, wood. 1: metal", |ui| {
        share_slider(ui, &mut material.metallic);
        texture_note(cx, ui, material.metallic_roughness_texture);
    });
    field(ui, "Roughness", "0: polished. 1: chalk", |ui| {
        share_slider(ui, &mut material.roughness);
        texture_note(cx, ui, material.metallic_roughness_texture);
    });
    field(ui, "Specular", "Strength of the reflection of what is not metal", |ui| {
        share_slider(ui, &mut material.specular);
        texture_note(cx, ui, material.specular_texture);
    });
    ior_field(ui, &mut material.ior);
}

/// A slider from 0 to 1 that leaves room for its figure and an icon.
pub(super) fn share_slider(ui: &mut Ui, value: &mut f32) {
    ui.spacing_mut().slider_width = (ui.available_width() - 96.0).clamp(32.0, 160.0);
    let mut shown = *value;
    if ui
        .add(Slider::new(&mut shown, 0.0..=1.0).clamping(egui::SliderClamping::Edits).fixed_decimals(2))
        .changed()
    {
        *value = shown;
    }
}

fn ior_field(ui: &mut Ui, ior: &mut f32) {
    field(ui, "IOR", "Index of refraction: how strongly light bends", |ui| {
        ui.add(
            DragValue::new(ior).range(1.0..=4.0).clamp_existing_to_range(false).speed(0.005).max_decimals(3),
        );
        let name = IOR_PRESETS
            .iter()
            .find(|(_, value)| (value - *ior).abs() < 5e-4)
            .map_or("\u{2014}", |(name, _)| name);
        egui::ComboBox::from_id_salt("ior").height(400.0).selected_text(name).show_ui(ui, |ui| {
            for (name, value) in IOR_PRESETS {
                if ui.selectable_label((value - *ior).abs() < 5e-4, format!("{name}  {value:.3}")).clicked() {
                    *ior = value;
                }
            }
        });
    });
}

fn volume_fields(ui: &mut Ui, material: &mut Material) {
    field(
        ui,
        "Solid",
        "On: the mesh encloses glass, light bends. Off: a thin sheet, light goes straight through",
        |ui| {
            ui.checkbox(&mut material.has_volume, "");
        },
    );
    if material.has_volume {
        field(ui, "Priority", "Where solids overlap, the one with the higher number is there", |ui| {
            ui.add(DragValue::new(&mut material.volume_priority).speed(0.1));
        });
    }
    field(ui, "Absorption", "White light has this colour after the distance beside it; off: clear", |ui| {
        let mut absorbs = material.attenuation_distance_m.is_some();
        ui.checkbox(&mut absorbs, "");
        match (absorbs, material.attenuation_distance_m) {
            (true, None) => {
                material.attenuation_distance_m = Some(0.1);
                material.has_volume = true;
            }
            (false, Some(_)) => material.attenuation_distance_m = None,
            _ => {}
        }
        if let Some(distance) = &mut material.attenuation_distance_m {
            let mut rgb = material.attenuation_color.to_array();
            if ui.color_edit_button_rgb(&mut rgb).changed() {
                material.attenuation_color = rgb.into();
            }
            ui.add(
                DragValue::new(distance)
                    .range(1e-5..=1e5)
                    .clamp_existing_to_range(false)
                    .speed(0.002)
                    .max_decimals(4)
                    .suffix(" m"),
            );
        }
    });
}

fn emission_fields(cx: &Cx<'_>, ui: &mut Ui, material: &mut Material) {
    field(ui, "Emission", "Colour, and strength in candela per square metre (nits)", |ui| {
        let mut rgb = material.emissive.to_array();
        if ui.color_edit_button_rgb(&mut rgb).changed() {
            material.emissive = rgb.into();
        }
        let speed = f64::from(material.emissive_strength.abs().max(0.1)) * 0.01;
        ui.add(
            DragValue::new(&mut material.emissive_strength)
                .range(0.0..=1e9)
                .clamp_existing_to_range(false)
                .speed(speed)
                .prefix("\u{d7} "),
        );
        texture_note(cx, ui, material.emissive_texture);
    });
}

fn alpha_field(ui: &mut Ui, material: &mut Material) {
    field(ui, "Alpha", "What the base colour's alpha does", |ui| {
        let name = match material.alpha {
            AlphaMode::Opaque => "Opaque",
            AlphaMode::Mask { .. } => "Mask",
            AlphaMode::Blend => "Blend",
        };
        egui::ComboBox::from_id_salt("alpha").selected_text(name).show_ui(ui, |ui| {
            ui.selectable_value(&mut material.alpha, AlphaMode::Opaque, "Opaque");
            ui.selectable_value(&mut material.alpha, AlphaMode::Mask { cutoff: 0.5 }, "Mask");
            ui.selectable_value(&mut material.alpha, AlphaMode::Blend, "Blend");
        });
        if let AlphaMode::Mask { cutoff } = &mut material.alpha {
            ui.add(DragValue::new(cutoff).range(0.0..=1.0).clamp_existing_to_range(false).speed(0.005))
                .on_hover_text("Below this, nothing is there");
        }
    });
}

pub(super) fn texture_note(cx: &Cx<'_>, ui: &mut Ui, used: Option<TextureUse>) {
    let Some(used) = used else { return };
    let Some(texture) = cx.session.document().texture(used.texture) else { return };
    let name = if texture.name.is_empty() { "unnamed image" } else { &texture.name };
    let space = if texture.srgb { "sRGB" } else { "linear" };
    let missing = if texture.placeholder { "; the image was not found" } else { "" };
    let color = if texture.placeholder { ui.visuals().warn_fg_color } else { ui.visuals().weak_text_color() };
    ui.label(RichText::new(icon::IMAGE).color(color)).on_hover_text(format!(
        "{name}, {} \u{d7} {} texels, {space}{missing}",
        texture.width, texture.height
    ));
}

/// Gives this primitive a material of its own when others use the same.
fn own_copy(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    target: Target,
    primitive: u32,
    id: MaterialId,
    material: &Material,
) {
    let tip = "Other objects may use this material too; a copy changes this object alone";
    if !ui.button(format!("{}  Make a copy for this object", icon::COPY)).on_hover_text(tip).clicked() {
        return;
    }
    let mut value = material.clone();
    value.name = if value.name.is_empty() {
        format!("material {} copy", id.0)
    } else {
        format!("{} copy", value.name)
    };
    let made = cx.session.edit_with(|document| {
        let material = MaterialId(document.allocate_id());
        let entry = Box::new(MaterialEntry::made_here(value));
        let edits =
            vec![Edit::AddMaterial { material, entry }, Edit::AssignMaterial { target, primitive, material }];
        ((), Edit::batch("copied a material", edits))
    });
    if let Err(error) = made {
        cx.state.toasts.error(format!("The material cannot be copied: {error}."));
    }
}

fn mesh_facts(cx: &Cx<'_>, ui: &mut Ui, id: caustica_scene::MeshId) {
    let Some(mesh) = cx.session.document().mesh(id) else { return };
    let elements = match mesh.shapes() {
        Some(_) => format!("{} spheres and boxes", mesh.shape_count()),
        None => format!("{} triangles, {} vertices", mesh.triangle_count(), mesh.data.positions.len()),
    };
    let facts = format!("{elements}, {} primitives", mesh.primitives.len());
    ui.label(RichText::new(facts).small().weak()).on_hover_text("Of the mesh that this object places");
}
