//! Numbers of a project that cannot be: they are held to their range, as those of a glTF file are, by the table that clips are
//! held by too. In: a material, light or camera of the file. Out: one that can be, and what was changed, with its JSON pointer.

use std::f32::consts::{FRAC_PI_2, PI};

use serde::Serialize;
use serde_json::Value;

use super::record::NodeRecord;
use crate::animation::hold;
use crate::assets::{Camera, Light, LightKind, Material, Projection};
use crate::import::gltf::{DEFAULT_NEAR_M, LEAST_CONE_RAD};

/// Holds the numbers of a material. `place`: its JSON pointer.
pub(super) fn material(value: &mut Material, place: &str) -> Vec<(String, String)> {
    told(value, place, |material| {
        above_zero(&mut material.attenuation_distance_m);
        hold(material);
    })
}

/// Holds the numbers of the light and the camera of a node, and of those of its parts.
pub(super) fn node(record: &mut NodeRecord, place: &str) -> Vec<(String, String)> {
    let mut said = Vec::new();
    let mut one = |light: &mut Option<Light>, camera: &mut Option<Camera>, place: &str| {
        said.extend(light.iter_mut().flat_map(|light| told(light, &format!("{place}/light"), held_light)));
        said.extend(
            camera.iter_mut().flat_map(|camera| told(camera, &format!("{place}/camera"), held_camera)),
        );
    };
    one(&mut record.light, &mut record.camera, place);
    for (path, own) in &mut record.overrides {
        let path = path.to_string().replace('~', "~0").replace('/', "~1");
        one(&mut own.light, &mut own.camera, &format!("{place}/overrides/{path}"));
    }
    said
}

fn held_light(light: &mut Light) {
    match &mut light.kind {
        LightKind::Point { radius_m, range_m } => {
            above_zero(range_m);
            *radius_m = radius_m.max(0.0);
        }
        LightKind::Spot { radius_m, range_m, inner_rad, outer_rad } => {
            above_zero(range_m);
            *radius_m = radius_m.max(0.0);
            *outer_rad = outer_rad.clamp(LEAST_CONE_RAD, FRAC_PI_2);
            *inner_rad = inner_rad.clamp(0.0, *outer_rad);
        }
        LightKind::Directional { angular_radius_rad } => {
            *angular_radius_rad = angular_radius_rad.clamp(0.0, PI);
        }
    }
    hold(light);
}

fn held_camera(camera: &mut Camera) {
    above_zero(&mut camera.far_m);
    above_zero(&mut camera.aspect);
    // Parallel cameras may begin where they are.
    let may_be_zero = matches!(camera.projection, Projection::Orthographic { .. });
    if camera.near_m < 0.0 || camera.near_m == 0.0 && !may_be_zero {
        camera.near_m = camera.far_m.map_or(DEFAULT_NEAR_M, |far_m| DEFAULT_NEAR_M.min(far_m / 2.0));
    }
    camera.far_m = camera.far_m.filter(|far_m| *far_m > camera.near_m);
    hold(camera);
}

/// What is not above 0 is left out.
fn above_zero(number: &mut Option<f32>) {
    *number = number.filter(|number| *number > 0.0);
}

/// What that changes in a value, by the places in its JSON.
fn told<T: Clone + PartialEq + Serialize>(
    value: &mut T,
    place: &str,
    change: impl FnOnce(&mut T),
) -> Vec<(String, String)> {
    let before = value.clone();
    change(value);
    let mut said = Vec::new();
    if let (true, Ok(before), Ok(after)) =
        (before != *value, serde_json::to_value(&before), serde_json::to_value(&*value))
    {
        compare(&before, &after, place.to_owned(), &mut said);
    }
    said
}

fn compare(before: &Value, after: &Value, place: String, said: &mut Vec<(String, String)>) {
    match (before, after) {
        (Value::Object(before), Value::Object(after)) => {
            for (name, before) in before {
                compare(before, after.get(name).unwrap_or(&Value::Null), format!("{place}/{name}"), said);
            }
        }
        (Value::Array(before), Value::Array(after)) => {
            for (index, (before, after)) in before.iter().zip(after).enumerate() {
                compare(before, after, format!("{place}/{index}"), said);
            }
        }
        _ if before == after => {}
        (_, Value::Null) => said.push((place, format!("{} cannot be; it is left out", shown(before)))),
        _ => said.push((place, format!("{} cannot be; {} is taken", shown(before), shown(after)))),
    }
}

/// A number of single precision in its short form.
fn shown(value: &Value) -> String {
    value.as_f64().map_or_else(|| value.to_string(), |number| (number as f32).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_is_held_and_named() {
        let mut one = Material { metallic: 7.0, attenuation_distance_m: Some(-1.0), ..Material::default() };
        let said = material(&mut one, "/m");
        let said: Vec<String> = said.iter().map(|(place, words)| format!("{place}: {words}")).collect();
        assert_eq!(
            said,
            [
                "/m/metallic: 7 cannot be; 1 is taken",
                "/m/attenuation_distance_m: -1 cannot be; it is left out"
            ]
        );
        assert_eq!(one, Material { metallic: 1.0, ..Material::default() });
        assert_eq!(material(&mut one, "/m"), []);
    }

    #[test]
    fn a_camera_that_ends_before_it_begins_sees_without_end() {
        let mut camera = Camera { near_m: -1.0, far_m: Some(0.001), aspect: Some(0.0), ..Camera::default() };
        assert_eq!(told(&mut camera, "", held_camera).len(), 2);
        assert_eq!((camera.near_m, camera.far_m, camera.aspect), (0.0005, Some(0.001), None));
        let projection = Projection::Orthographic { ymag_m: 1.0 };
        let mut parallel = Camera { projection, near_m: 0.0, ..Camera::default() };
        assert_eq!(told(&mut parallel, "", held_camera), []);
        let mut camera = Camera { near_m: 2.0, far_m: Some(1.0), ..Camera::default() };
        assert_eq!(
            told(&mut camera, "", held_camera),
            [("/far_m".to_owned(), "1 cannot be; it is left out".to_owned())]
        );
    }
}
