//! GPU instances of a node (`EXT_mesh_gpu_instancing`). In: its attributes. Out: a transform for each, and warnings that
//! count what of them cannot be used, which is left out.

use glam::{DQuat, DVec3};

use super::super::accessor::Accessors;
use super::super::json::{Fault, Item};
use super::unit;
use crate::import::counted;
use crate::node::MAX_NODES;
use crate::prefab::PartNode;
use crate::transform::Trs;

/// Attributes that are read, and how many numbers each has.
const READ: [(&str, usize); 3] = [("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)];

/// The transforms of all instances; `None` where there are none.
pub(super) fn read(
    accessors: &Accessors<'_>,
    extension: &Item<'_>,
    warnings: &mut Vec<Fault>,
) -> Result<Option<Vec<Trs>>, Fault> {
    let Some(attributes) = extension.child("attributes")? else {
        return Ok(None);
    };
    let mut count = None;
    let mut values = |(name, width)| {
        let Some(index) = attributes.size(name)? else {
            return Ok(None);
        };
        let accessor = accessors.get(index)?;
        let fault = |reason| Fault::new(format!("{}/{name}", attributes.place()), reason);
        if accessor.width != width || accessor.is_matrix {
            return Err(fault(format!("accessor {index} has the wrong type")));
        }
        if *count.get_or_insert(accessor.count) != accessor.count {
            return Err(fault("the attributes differ in their count".to_owned()));
        }
        if accessor.count > MAX_NODES {
            return Err(fault(format!("more than {MAX_NODES} nodes are not read")));
        }
        accessors.floats::<4>(index, 0.0).map(Some)
    };
    let [translation, rotation, scale] = READ;
    let (translations, rotations, scales) = (values(translation)?, values(rotation)?, values(scale)?);
    let Some(count) = count else {
        return Ok(None);
    };
    accessors.take(count, size_of::<Trs>() + size_of::<PartNode>(), extension.place())?;
    let mut instances = vec![Trs::IDENTITY; count];
    let unusable = [
        put(&mut instances, translations, |trs, v| put_vector(&mut trs.translation, v)),
        put(&mut instances, rotations, |trs, [x, y, z, w]| {
            let given = unit(DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into()));
            trs.rotation = given.unwrap_or(trs.rotation);
            given.is_some()
        }),
        put(&mut instances, scales, |trs, v| put_vector(&mut trs.scale, v)),
    ];
    for ((name, width), count) in READ.into_iter().zip(unusable).filter(|(_, count)| *count > 0) {
        let what = if width == 4 { "of length 0 or not finite" } else { "not finite" };
        let reason = format!("{} {what}: left out", counted(count, "value is", "values are"));
        warnings.push(Fault::new(format!("{}/{name}", attributes.place()), reason));
    }
    Ok(Some(instances))
}

fn put_vector(to: &mut DVec3, [x, y, z, _]: [f32; 4]) -> bool {
    *to = DVec3::new(x.into(), y.into(), z.into());
    true
}

/// Gives each instance its value; counts those that cannot be used.
fn put(
    instances: &mut [Trs],
    values: Option<Vec<[f32; 4]>>,
    set: impl Fn(&mut Trs, [f32; 4]) -> bool,
) -> usize {
    let given = instances.iter_mut().zip(values.into_iter().flatten());
    given
        .filter_map(|(trs, value)| {
            let used = value.iter().all(|number| number.is_finite()) && set(trs, value);
            (!used).then_some(())
        })
        .count()
}

/// Attributes that are not read.
pub(super) fn lost_attributes(instancing: &Item<'_>) -> Result<Vec<String>, Fault> {
    let Some(attributes) = instancing.child("attributes")? else { return Ok(Vec::new()) };
    let is_read = |name: &str| READ.iter().any(|(read, _)| *read == name);
    let names = attributes.object()?.keys().filter(|name| !is_read(name));
    Ok(names.map(|name| format!("the attribute {name} of GPU instances")).collect())
}
