//! What surrounds the scenes of a file, as this program writes it into `extras.environment` of a scene: glTF has no word for it.
//! In: JSON and buffers. Out: environments, and a warning for a map that cannot be read.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::accessor::View;
use super::buffers::Buffers;
use super::extras;
use super::json::{Fault, Item, POSITIVE, held};
use crate::assets::{Environment, EnvironmentFile};
use crate::import::environment::of_bytes;
use crate::prefab::SourceScene;

/// Whether a scene has some of the words of this program.
fn may_be_ours(environment: &Item<'_>) -> bool {
    ["constantRadiance", "sky", "bufferView"].iter().any(|word| environment.get(word).is_some())
}

/// Gives the scenes their environments. What `extras` say otherwise than this program does is no fault of the file: it is
/// kept, with a warning. `path`: of the file.
pub(super) fn read(
    root: &Item<'_>,
    buffers: &Buffers,
    views: &[View],
    path: &Path,
    scenes: &mut [SourceScene],
) -> Result<Vec<Fault>, Fault> {
    let mut warnings = Vec::new();
    for (item, scene) in root.objects("scenes")?.iter().zip(scenes) {
        let environment = item.get("extras").and_then(|extras| extras.get("environment"));
        let Some(environment) = environment.filter(may_be_ours) else { continue };
        match one(&environment, buffers, views, path, &mut warnings) {
            Ok(read) => scene.environment = Some(read),
            Err(fault) => {
                let at = fault.place.strip_prefix(environment.place()).unwrap_or_default();
                let reason = match at.trim_start_matches('/') {
                    "" => fault.reason,
                    member => format!("{member}: {}", fault.reason),
                };
                warnings.push(extras::not_read(&environment, &reason));
            }
        }
    }
    Ok(warnings)
}

fn one(
    item: &Item<'_>,
    buffers: &Buffers,
    views: &[View],
    path: &Path,
    warnings: &mut Vec<Fault>,
) -> Result<Environment, Fault> {
    if let Some(index) = item.index("bufferView", views.len(), "buffer view")? {
        let (rotation_rad, scale) = (item.f32_or("rotationRad", 0.0)?, item.f32_or("scale", 1.0)?);
        let scale = held(item, "scale", scale, &POSITIVE, warnings);
        let bytes = views.get(index).and_then(|view| view.bytes(buffers));
        let map = match of_bytes(bytes.unwrap_or_default(), path) {
            Ok((map, repairs)) => {
                warnings.extend(repairs.into_iter().map(|repair| item.fault(repair.message)));
                Some(Arc::new(map))
            }
            Err(error) => {
                warnings.push(item.fault(format!("the map cannot be read and is black: {}", error.reason)));
                None
            }
        };
        return Ok(Environment::File(EnvironmentFile { path: path.to_owned(), rotation_rad, scale, map }));
    }
    if item.bool_or("sky", false)? {
        return Ok(Environment::DefaultSky);
    }
    let radiance = item.f32s_or("constantRadiance", [f32::NAN; 3])?;
    if radiance[0].is_nan() {
        return Err(item.fault("it names no environment"));
    }
    let radiance = radiance.map(|channel| held(item, "constantRadiance", channel, &POSITIVE, warnings));
    Ok(Environment::Constant(Vec3::from(radiance)))
}
