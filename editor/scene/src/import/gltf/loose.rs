//! Points and lines: not rendered, but kept as they stand for an export. In: JSON and checked accessors. Out: numbers.
//! What vertices are becomes floats, as an export writes it; joints and attributes of other programs stay as they are.

use super::accessor::Accessors;
use super::foreign::unknown;
use super::json::{Fault, Item};
use super::mesh::read_mappings;
use crate::foreign::{Loose, Numbers};

/// A primitive of points or lines. `left`: how many elements may still be read.
pub(super) fn read(
    primitive: &Item<'_>,
    accessors: &Accessors<'_>,
    mode: usize,
    materials: usize,
    left: &mut usize,
) -> Result<Loose, Fault> {
    let mut reader = Reader { accessors, left };
    let targets = primitive.objects("targets")?;
    Ok(Loose {
        mode,
        material: primitive.index("material", materials, "material")?,
        attributes: match primitive.child("attributes")? {
            Some(attributes) => reader.attributes(&attributes)?,
            None => Vec::new(),
        },
        indices: primitive
            .size("indices")?
            .map(|index| reader.numbers(primitive, index, false))
            .transpose()?,
        targets: targets.iter().map(|target| reader.attributes(target)).collect::<Result<_, _>>()?,
        mappings: match primitive.extension("KHR_materials_variants")? {
            Some(extension) => read_mappings(&extension, materials)?,
            None => Vec::new(),
        },
        unknown: unknown(primitive, &[]),
    })
}

struct Reader<'a> {
    accessors: &'a Accessors<'a>,
    left: &'a mut usize,
}

impl Reader<'_> {
    fn attributes(&mut self, item: &Item<'_>) -> Result<Vec<(String, Numbers)>, Fault> {
        let mut list = Vec::new();
        for name in item.object()?.keys() {
            if let Some(index) = item.size(name)? {
                let own = name.starts_with('_') || name.starts_with("JOINTS_");
                list.push((name.clone(), self.numbers(item, index, !own)?));
            }
        }
        // In one order, whatever that of the file is.
        list.sort_by(|(a, _), (b, _)| a.cmp(b));
        Ok(list)
    }

    fn numbers(&mut self, item: &Item<'_>, index: usize, as_floats: bool) -> Result<Numbers, Fault> {
        let count = self.accessors.get(index)?.count;
        *self.left = self
            .left
            .checked_sub(count)
            .ok_or_else(|| item.fault("it has more points and lines than one file may bring"))?;
        self.accessors.numbers(index, as_floats)
    }
}
