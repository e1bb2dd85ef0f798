//! What a node of a project, written by hand, says that cannot be: two things at once, turns without an axis.
//! In: its record. Out: why it is refused, or what was put right.

use glam::DQuat;

use super::record::{LocalRecord, NodeRecord};
use crate::assets::Environment;

/// Largest difference of the length of a rotation from 1 that is rounding.
const LENGTH_TOLERANCE: f64 = 1e-6;

/// Why a node cannot be what its record says.
pub(super) fn refusal(record: &NodeRecord) -> Option<String> {
    let kinds = [
        ("prefab", record.prefab.is_some()),
        ("mesh", record.mesh.is_some()),
        ("light", record.light.is_some()),
        ("camera", record.camera.is_some()),
    ];
    let named: Vec<&str> =
        kinds.into_iter().filter_map(|(name, is_there)| is_there.then_some(name)).collect();
    if named.len() > 1 {
        return Some(format!(
            "has {}; a node is one of them, others go into nodes below it",
            named.join(" and ")
        ));
    }
    let parts = record
        .overrides
        .iter()
        .filter_map(|(path, own)| Some((format!(" of part \"{path}\""), own.local.as_ref()?)));
    let mut all = std::iter::once((String::new(), &record.local)).chain(parts);
    let (of, _) = all.find(|(_, local)| local.matrix.is_some() && local.has_trs())?;
    Some(format!(
        "says of its place{of} a matrix beside translation, rotation or scale; one or the other counts"
    ))
}

/// Why surroundings cannot be: each number that is none, or takes light away, with its place.
pub(super) fn refusal_of_environment(environment: &Environment) -> Option<String> {
    let numbers: Vec<(String, f32)> = match environment {
        Environment::Constant(radiance) => {
            let channels = radiance.to_array().into_iter().enumerate();
            channels.map(|(channel, value)| (format!("/environment/radiance/{channel}"), value)).collect()
        }
        Environment::File(file) => vec![
            ("/environment/scale".to_owned(), file.scale),
            ("/environment/rotationRad".to_owned(), file.rotation_rad.abs()),
        ],
        Environment::Auto | Environment::DefaultSky => Vec::new(),
    };
    let bad = numbers.into_iter().filter_map(|(place, value)| match value {
        _ if !value.is_finite() => Some(format!("{place}: it is larger than single precision can hold")),
        _ if value < 0.0 => Some(format!("{place}: {value} is below 0, which takes light away")),
        _ => None,
    });
    let bad: Vec<String> = bad.collect();
    (!bad.is_empty()).then(|| bad.join("; "))
}

/// Makes every rotation one of length 1; says which were none.
pub(super) fn repair_rotations(record: &mut NodeRecord) -> Vec<String> {
    let parts = record
        .overrides
        .iter_mut()
        .filter_map(|(path, own)| Some((format!(" of part \"{path}\""), own.local.as_mut()?)));
    let all = std::iter::once((String::new(), &mut record.local)).chain(parts);
    all.filter_map(|(of, local)| Some(format!("the rotation{of} {}", repaired(local)?))).collect()
}

fn repaired(local: &mut LocalRecord) -> Option<&'static str> {
    let length = local.rotation.length();
    if !length.is_finite() || (length - 1.0).abs() <= LENGTH_TOLERANCE {
        return None;
    }
    if length < f64::MIN_POSITIVE {
        local.rotation = DQuat::IDENTITY;
        return Some("has no length and is left out");
    }
    local.rotation = local.rotation.normalize();
    Some("is not of length 1; it is made so")
}
