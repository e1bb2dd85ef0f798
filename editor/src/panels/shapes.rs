//! The spheres and boxes of a mesh: one by its numbers, a cloud by its description, a file by its name. Enters: the
//! document. Leaves: edits that describe them anew; a drag of a field is one step of the history because its edits join.

use std::ops::RangeInclusive;

use caustica_scene::{Cloud, Distribution, Edit, MOST_SHAPES, ShapeSource, Target};
use egui::emath::Numeric;
use egui::{DragValue, RichText, Slider, Ui};
use egui_phosphor::regular as icon;
use glam::Vec3;

use super::inspector::VectorField;
use super::{Cx, field, section};

/// Draws the section; nothing for a mesh of triangles.
pub fn ui(cx: &mut Cx<'_>, ui: &mut Ui, target: Target) {
    let document = cx.session.document();
    let Some(mesh) = document.mesh_of(target) else { return };
    let Some(shapes) = document.mesh(mesh).and_then(|mesh| mesh.shapes()) else { return };
    let (old, count) = (shapes.source().clone(), shapes.list().len());
    section(ui, "Spheres and boxes", |ui| {
        let mut new = old.clone();
        match &mut new {
            ShapeSource::Sphere { centre, radius_m } => {
                length(ui, "Radius", "Of the sphere", radius_m);
                place(ui, "Centre", "Inside the mesh, metres", centre, Vec3::ZERO);
            }
            ShapeSource::Box { centre, half_extent_m } => {
                size(ui, "Of the box, metres", half_extent_m);
                place(ui, "Centre", "Inside the mesh, metres", centre, Vec3::ZERO);
            }
            ShapeSource::Cloud(cloud) => cloud_fields(ui, cloud),
            ShapeSource::File(file) => {
                ui.label(RichText::new(file.path.display().to_string()).small())
                    .on_hover_text("The file that they are read from");
                match file.shapes {
                    Some(_) => ui.weak(format!("{count} spheres and boxes")),
                    None => ui.colored_label(
                        ui.visuals().error_fg_color,
                        "The file was not found: nothing is shown in its place.",
                    ),
                };
            }
        }
        if new != old {
            cx.push(Edit::SetShapes { mesh, source: Box::new(new) });
        }
    });
}

/// The icon of a description.
pub fn source_icon(source: &ShapeSource) -> &'static str {
    match source {
        ShapeSource::Sphere { .. } => icon::SPHERE,
        ShapeSource::Box { .. } => icon::CUBE,
        ShapeSource::Cloud(_) | ShapeSource::File(_) => icon::DOTS_NINE,
    }
}

fn cloud_fields(ui: &mut Ui, cloud: &mut Cloud) {
    field(ui, "Count", "Spheres and boxes together; a million takes about 130 MB", |ui| {
        let speed = (f64::from(cloud.count) * 0.01).max(1.0);
        drag(ui, &mut cloud.count, 0..=MOST_SHAPES, speed, "");
    });
    field(ui, "Seed", "Another number gives another cloud of the same kind", |ui| {
        drag(ui, &mut cloud.seed, 0..=u64::MAX, 0.1, "");
    });
    field(ui, "Centres lie", "How the cloud fills its size", |ui| distribution(ui, &mut cloud.distribution));
    if let Distribution::Grid { jitter } = &mut cloud.distribution {
        share(ui, "Jitter", "How much of its cell a centre strays over", jitter);
    }
    size(ui, "Of the box around all centres, metres", &mut cloud.half_extent_m);
    let [least, most] = &mut cloud.radius_m;
    let before = *least;
    length(ui, "Least radius", "Of a box, half of its side", least);
    if *least != before {
        *most = most.max(*least);
    }
    length(ui, "Most radius", "Of a box, half of its side", most);
    *least = least.min(*most);
    share(ui, "Boxes", "Share of boxes; the rest are spheres", &mut cloud.boxes);
    ui.weak("Even and odd ones are two primitives, each with its own material.");
}

fn distribution(ui: &mut Ui, value: &mut Distribution) {
    let all = [
        ("Anywhere in the box", Distribution::Box),
        ("Anywhere in the ball", Distribution::Ball),
        ("On a grid", Distribution::Grid { jitter: 0.5 }),
    ];
    let same = |a: &Distribution, b: &Distribution| std::mem::discriminant(a) == std::mem::discriminant(b);
    let name = all.iter().find(|(_, other)| same(other, value)).map_or("", |(name, _)| name);
    egui::ComboBox::from_id_salt("distribution").selected_text(name).show_ui(ui, |ui| {
        for (name, other) in all {
            let selected = same(&other, value);
            if ui.selectable_label(selected, name).clicked() && !selected {
                *value = other;
            }
        }
    });
}

fn drag<T: Numeric>(ui: &mut Ui, value: &mut T, range: RangeInclusive<T>, speed: f64, suffix: &str) {
    ui.add(
        DragValue::new(value)
            .range(range)
            .clamp_existing_to_range(false)
            .speed(speed)
            .max_decimals(if T::INTEGRAL { 0 } else { 6 })
            .suffix(suffix)
            .update_while_editing(false),
    );
}

fn length(ui: &mut Ui, name: &str, tip: &str, value_m: &mut f32) {
    let speed = f64::from(value_m.abs().max(1e-4)) * 0.01;
    field(ui, name, tip, |ui| drag(ui, value_m, 0.0..=1e9, speed, " m"));
}

fn share(ui: &mut Ui, name: &str, tip: &str, value: &mut f32) {
    field(ui, name, tip, |ui| {
        let mut shown = *value;
        // The widget rounds what it shows: only a change by the user counts.
        if ui.add(Slider::new(&mut shown, 0.0..=1.0).fixed_decimals(2)).changed() && shown.is_finite() {
            *value = shown.clamp(0.0, 1.0);
        }
    });
}

/// Shown whole, kept as its half.
fn size(ui: &mut Ui, tip: &str, half_extent_m: &mut Vec3) {
    let mut whole = *half_extent_m * 2.0;
    place(ui, "Size", tip, &mut whole, Vec3::ONE);
    *half_extent_m = whole.max(Vec3::ZERO) * 0.5;
}

fn place(ui: &mut Ui, name: &str, tip: &str, value: &mut Vec3, neutral: Vec3) {
    let speed = (f64::from(value.abs().max_element()) * 0.01).clamp(1e-6, 1.0);
    let neutral = neutral.as_dvec3();
    let row = VectorField { name, tip, speed, decimals: 3, suffix: " m", neutral, driven: false };
    if let Some(new) = row.ui(ui, value.as_dvec3())
        && new.as_vec3().is_finite()
    {
        *value = new.as_vec3();
    }
}
