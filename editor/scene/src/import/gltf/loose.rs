//! Points and lines: not rendered, but kept as they stand for an export. In: JSON and checked accessors. Out: numbers.
//! What vertices are becomes floats, as an export writes it; joints and attributes of other programs stay as they are.

use super::accessor::Accessors;
use super::foreign::unknown;
use super::json::{Fault, Item};
use super::mesh::read_mappings;
use crate::foreign::{Loose, Numbers};

/// A primitive of points or lines; `None`, with a warning, for one without places.
pub(super) fn read(
    primitive: &Item<'_>,
    accessors: &Accessors<'_>,
    mode: usize,
    materials: usize,
    warnings: &mut Vec<Fault>,
) -> Result<Option<Loose>, Fault> {
    let targets = primitive.objects("targets")?;
    let position = match primitive.child("attributes")? {
        Some(attributes) => attributes.size("POSITION")?,
        None => None,
    };
    let count = match position.map(|index| accessors.get(index)).transpose()? {
        Some(accessor) if accessor.width == 3 => accessor.count,
        _ => {
            warnings.push(primitive.fault("its POSITION is missing or has the wrong type; it is left out"));
            return Ok(None);
        }
    };
    let mut read = |item: &Item<'_>| attributes_of(accessors, item, count, warnings);
    let attributes = match primitive.child("attributes")? {
        Some(attributes) => read(&attributes)?,
        None => Vec::new(),
    };
    let targets = targets.iter().map(&mut read).collect::<Result<_, _>>()?;
    Ok(Some(Loose {
        mode,
        material: primitive.index("material", materials, "material")?,
        attributes,
        indices: primitive.size("indices")?.map(|index| accessors.numbers(index, false)).transpose()?,
        targets,
        mappings: read_mappings(primitive, materials, warnings)?,
        unknown: unknown(primitive, &[]),
    }))
}

fn attributes_of(
    accessors: &Accessors<'_>,
    item: &Item<'_>,
    count: usize,
    warnings: &mut Vec<Fault>,
) -> Result<Vec<(String, Numbers)>, Fault> {
    let mut list = Vec::new();
    for name in item.object()?.keys() {
        let Some(index) = item.size(name)? else { continue };
        let accessor = accessors.get(index)?;
        let own = name.starts_with('_') || name.starts_with("JOINTS_");
        let fits = widths(name).is_none_or(|widths| widths.contains(&accessor.width) && !accessor.is_matrix);
        if fits && accessor.count == count {
            list.push((name.clone(), accessors.numbers(index, !own)?));
            continue;
        }
        let place = format!("{}/{name}", item.place());
        let reason = match fits {
            true => format!("it has {} elements, POSITION has {count}; it is left out", accessor.count),
            false => format!("accessor {index} has the wrong type; it is left out"),
        };
        warnings.push(Fault::new(place, reason));
    }
    // In one order, whatever that of the file is.
    list.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(list)
}

/// How many numbers an element of an attribute of the format has; `None`: those of other programs have any.
fn widths(name: &str) -> Option<&'static [usize]> {
    let (kind, _) = name.rsplit_once('_').unwrap_or((name, ""));
    Some(match kind {
        "POSITION" | "NORMAL" => &[3],
        "TANGENT" => &[3, 4],
        "TEXCOORD" => &[2],
        "COLOR" => &[3, 4],
        "JOINTS" | "WEIGHTS" => &[4],
        _ => return None,
    })
}
