//! Points and lines: not rendered, but kept as they stand for an export. In: JSON and checked accessors. Out: numbers.
//! What vertices are becomes floats, as an export writes it; joints and attributes of other programs stay as they are.

use super::accessor::Accessors;
use super::foreign::unknown;
use super::json::{Fault, Item};
use super::mesh::read_mappings;
use crate::foreign::{Loose, Numbers};

/// A primitive of points or lines.
pub(super) fn read(
    primitive: &Item<'_>,
    accessors: &Accessors<'_>,
    mode: usize,
    materials: usize,
) -> Result<Loose, Fault> {
    let targets = primitive.objects("targets")?;
    Ok(Loose {
        mode,
        material: primitive.index("material", materials, "material")?,
        attributes: match primitive.child("attributes")? {
            Some(attributes) => attributes_of(accessors, &attributes)?,
            None => Vec::new(),
        },
        indices: primitive.size("indices")?.map(|index| accessors.numbers(index, false)).transpose()?,
        targets: targets.iter().map(|target| attributes_of(accessors, target)).collect::<Result<_, _>>()?,
        mappings: match primitive.extension("KHR_materials_variants")? {
            Some(extension) => read_mappings(&extension, materials)?,
            None => Vec::new(),
        },
        unknown: unknown(primitive, &[]),
    })
}

fn attributes_of(accessors: &Accessors<'_>, item: &Item<'_>) -> Result<Vec<(String, Numbers)>, Fault> {
    let mut list = Vec::new();
    for name in item.object()?.keys() {
        if let Some(index) = item.size(name)? {
            let own = name.starts_with('_') || name.starts_with("JOINTS_");
            list.push((name.clone(), accessors.numbers(index, !own)?));
        }
    }
    // In one order, whatever that of the file is.
    list.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(list)
}
