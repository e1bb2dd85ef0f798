//! Lights and cameras. In: JSON. Out: [`Light`] and [`Camera`], and warnings about values out of their range, which are
//! held to it, so that an export is valid. Formats: `KHR_lights_punctual`; glTF 2.0, section 3.10.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::Vec3;

use super::extras;
use super::json::{Fault, Item, POSITIVE, held};
use crate::assets::{Camera, Light, LightKind, Projection};
use crate::import::short;

/// Radius of point and spot lights whose file gives none, metres: hard shadows, as other programs show them.
const DEFAULT_LIGHT_RADIUS_M: f64 = 0.0;
/// Full angle of directional lights whose file gives none, degrees: hard shadows likewise.
const DEFAULT_SUN_ANGLE_DEG: f64 = 0.0;
/// Narrowest cone, radians: the format wants some angle.
pub(crate) const LEAST_CONE_RAD: f32 = 1e-6;
/// Nearest distance drawn by cameras whose file gives none that can be used, metres.
pub(crate) const DEFAULT_NEAR_M: f32 = 0.01;

/// A number in `extras` of the light, else of the node that carries it.
fn extra(
    light: &Item<'_>,
    node: Option<&Item<'_>>,
    key: &str,
    default: f64,
    warnings: &mut Vec<Fault>,
) -> f64 {
    for owner in std::iter::once(light).chain(node) {
        if let Some(given) = extras::number(owner, key, warnings) {
            let Some(value) = given else { return default };
            held(owner, &format!("extras/{key}"), value as f32, &POSITIVE, warnings);
            return value.max(0.0);
        }
    }
    default
}

/// A number that has to be above 0; else nothing, and a warning that says what stands in.
fn above_zero(
    item: &Item<'_>,
    key: &str,
    stands_in: &str,
    warnings: &mut Vec<Fault>,
) -> Result<Option<f32>, Fault> {
    let Some(given) = item.f64(key)? else { return Ok(None) };
    let narrow = given as f32;
    if narrow.is_finite() && narrow > 0.0 {
        return Ok(Some(narrow));
    }
    // What is too far away for a number is as good as no end.
    if given <= 0.0 || narrow == 0.0 {
        let place = format!("{}/{key}", item.place());
        warnings.push(Fault::new(place, format!("{given} has to be above 0; {stands_in}")));
    }
    Ok(None)
}

/// KHR_lights_punctual, with `radius` (metres) or `angle` (full angle in degrees) from `extras`. `node`: what carries it.
pub(super) fn read_light(
    item: &Item<'_>,
    node: Option<&Item<'_>>,
    warnings: &mut Vec<Fault>,
) -> Result<Light, Fault> {
    let kind = match item.text("type")? {
        Some("point") => LightKind::Point {
            radius_m: extra(item, node, "radius", DEFAULT_LIGHT_RADIUS_M, warnings) as f32,
            range_m: range_m(item, warnings)?,
        },
        Some("spot") => {
            let (inner, outer) = match item.child("spot")? {
                Some(spot) => {
                    (spot.f32_or("innerConeAngle", 0.0)?, spot.f32_or("outerConeAngle", FRAC_PI_4)?)
                }
                None => (0.0, FRAC_PI_4),
            };
            let outer_rad = held(item, "spot/outerConeAngle", outer, &(LEAST_CONE_RAD..=FRAC_PI_2), warnings);
            LightKind::Spot {
                radius_m: extra(item, node, "radius", DEFAULT_LIGHT_RADIUS_M, warnings) as f32,
                range_m: range_m(item, warnings)?,
                inner_rad: held(item, "spot/innerConeAngle", inner, &(0.0..=outer_rad), warnings),
                outer_rad,
            }
        }
        Some("directional") => {
            let angle_deg = extra(item, node, "angle", DEFAULT_SUN_ANGLE_DEG, warnings);
            if angle_deg > 180.0 {
                let words = format!("a sun of {angle_deg} degrees; 180 are taken");
                warnings.push(item.fault(words));
            }
            let angle_deg = angle_deg.min(180.0);
            LightKind::Directional { angular_radius_rad: (angle_deg.to_radians() / 2.0) as f32 }
        }
        Some(other) => return Err(item.fault(format!("light type {} does not exist", short(other)))),
        None => return Err(item.fault("\"type\" is missing")),
    };
    Ok(Light {
        color: color(item, warnings)?,
        intensity: held(item, "intensity", item.f32_or("intensity", 1.0)?, &POSITIVE, warnings),
        kind,
    })
}

fn range_m(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Option<f32>, Fault> {
    above_zero(item, "range", "it is left out, and the light reaches everywhere", warnings)
}

/// Channels above 1 are those of a stronger light.
fn color(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Vec3, Fault> {
    let given = item.f32s_or("color", [1.0; 3])?;
    if given.iter().any(|channel| *channel > 1.0) {
        let reason = format!("{given:?} has to be within 0 and 1; it is taken as a stronger light");
        warnings.push(Fault::new(format!("{}/color", item.place()), reason));
    }
    Ok(Vec3::from(given.map(|channel| held(item, "color", channel, &POSITIVE, warnings))))
}

/// A camera that cannot be used is left out with a warning.
pub(super) fn read_camera(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Option<Camera>, Fault> {
    let kind = match item.text("type")? {
        Some(kind @ ("perspective" | "orthographic")) => kind,
        _ => return Err(item.fault("the camera is neither perspective nor orthographic")),
    };
    let Some(lens) = item.child(kind)? else {
        return Err(item.fault(format!("\"{kind}\" is missing")));
    };
    let projection = match kind {
        "perspective" => Projection::Perspective { yfov_rad: lens.f32_or("yfov", 0.0)? },
        _ => {
            let given = lens.f32_or("ymag", 0.0)?;
            if given < 0.0 {
                mirrored(&lens, "ymag", warnings);
            }
            Projection::Orthographic { ymag_m: given.abs() }
        }
    };
    let usable = match projection {
        Projection::Perspective { yfov_rad } => yfov_rad > 0.0 && yfov_rad < PI,
        Projection::Orthographic { ymag_m } => ymag_m > 0.0,
    };
    if !usable {
        warnings.push(item.fault("its angle or size is 0 or less, or too wide; it was left out"));
        return Ok(None);
    }
    let aspect = match projection {
        Projection::Perspective { .. } => above_zero(&lens, "aspectRatio", "it is left out", warnings)?,
        Projection::Orthographic { ymag_m } => aspect_of(&lens, ymag_m, warnings)?,
    };
    let (near_m, far_m) = ends(&lens, matches!(projection, Projection::Orthographic { .. }), warnings)?;
    Ok(Some(Camera { projection, near_m, far_m, aspect }))
}

fn mirrored(lens: &Item<'_>, key: &str, warnings: &mut Vec<Fault>) {
    let reason = "it is below 0, which mirrors the picture; it is taken without the sign";
    warnings.push(Fault::new(format!("{}/{key}", lens.place()), reason));
}

/// Width by height of a parallel camera, in double precision, so that an export can give the width that leads to the same
/// quotient.
fn aspect_of(lens: &Item<'_>, ymag_m: f32, warnings: &mut Vec<Fault>) -> Result<Option<f32>, Fault> {
    let Some(xmag) = lens.f64("xmag")? else { return Ok(None) };
    if xmag < 0.0 {
        mirrored(lens, "xmag", warnings);
    }
    let aspect = (xmag.abs() / f64::from(ymag_m)) as f32;
    if aspect.is_finite() && aspect > 0.0 {
        return Ok(Some(aspect));
    }
    let reason = format!("{xmag} is no width of a picture; the height is taken");
    warnings.push(Fault::new(format!("{}/xmag", lens.place()), reason));
    Ok(None)
}

/// The nearest and the farthest distance. Parallel cameras may begin where they are.
fn ends(lens: &Item<'_>, may_be_zero: bool, warnings: &mut Vec<Fault>) -> Result<(f32, Option<f32>), Fault> {
    let begins_at_zero = may_be_zero && lens.f64("znear")? == Some(0.0);
    let near_m = match begins_at_zero {
        true => Some(0.0),
        false => above_zero(lens, "znear", &format!("{DEFAULT_NEAR_M} is taken"), warnings)?,
    };
    let far_m = above_zero(lens, "zfar", "it is left out, and the camera sees without end", warnings)?;
    // What stands in has to be nearer than the end, too.
    let stands_in_m = far_m.map_or(DEFAULT_NEAR_M, |far_m| DEFAULT_NEAR_M.min(far_m / 2.0));
    let Some((near_m, end_m)) = near_m.zip(far_m).filter(|(near_m, far_m)| far_m <= near_m) else {
        return Ok((near_m.unwrap_or(stands_in_m.max(f32::MIN_POSITIVE)), far_m));
    };
    let reason =
        format!("{end_m} has to be above znear, {near_m}; it is left out, and the camera sees without end");
    warnings.push(Fault::new(format!("{}/zfar", lens.place()), reason));
    Ok((near_m, None))
}
