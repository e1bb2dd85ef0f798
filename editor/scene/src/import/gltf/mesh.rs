//! Meshes: accessors to attributes, any triangle topology to lists, then the mesh builder.
//! In: JSON and checked accessors. Out: meshes and what was repaired. Points and lines are only kept (`loose.rs`).

use std::collections::{BTreeMap, BTreeSet, HashMap};

use rayon::prelude::*;
use serde_json::Value;

use super::super::geometry::{MeshBuilder, PrimitiveInput, Repairs};
use super::accessor::Accessors;
use super::attributes::{AttributeReader, BASE};
use super::foreign::unknown;
use super::json::{Fault, Item};
use super::loose;
use crate::assets::{Material, Mesh};
use crate::foreign::{LooseMesh, Mapping, Unknown};
use crate::ids::MaterialId;
use crate::import::counted;

/// Mode of lists of triangles; below are points and lines.
const TRIANGLES: usize = 4;
/// The last mode that there is.
const TRIANGLE_FAN: usize = 6;

/// All meshes, and whether a primitive asked for the default material.
#[derive(Default)]
pub(super) struct Meshes {
    pub list: Vec<Mesh>,
    pub uses_default_material: bool,
    /// What variants of materials choose, by mesh and primitive.
    pub variants: BTreeMap<(usize, usize), Vec<Mapping>>,
    /// What is not known of primitives, likewise.
    pub unknown: BTreeMap<(usize, usize), Unknown>,
    /// Points and lines, by mesh.
    pub loose: BTreeMap<usize, LooseMesh>,
    /// What cannot be kept, and how often it is there.
    pub lost: BTreeMap<String, usize>,
    pub warnings: Vec<Fault>,
}

/// Reads all meshes on all cores; those of the same geometry share it. A primitive without a material gets the one after
/// the last.
pub(super) fn read_all(
    root: &Item<'_>,
    accessors: &Accessors<'_>,
    materials: &[Material],
    max_elements: usize,
) -> Result<Meshes, Fault> {
    let items = root.objects("meshes")?;
    let (mut places, mut firsts, mut shape_of) = (HashMap::new(), Vec::new(), Vec::new());
    for item in &items {
        let place = *places.entry(geometry_of(item, materials)?).or_insert_with(|| {
            firsts.push(item);
            firsts.len() - 1
        });
        shape_of.push(place);
    }
    let shapes: Vec<Result<Shape, Fault>> =
        firsts.par_iter().map(|item| Shape::read(item, accessors, materials, max_elements)).collect();
    let mut meshes = Meshes { list: Vec::with_capacity(items.len()), ..Meshes::default() };
    let (mut elements, mut counted) = (0_usize, 0);
    for (number, (item, place)) in items.iter().zip(shape_of).enumerate() {
        let Some(shape) = shapes.get(place) else { continue };
        let shape = shape.as_ref().map_err(Fault::clone)?;
        if place == counted {
            counted += 1;
            let mesh = &shape.mesh;
            elements =
                elements.saturating_add(mesh.data.positions.len()).saturating_add(mesh.triangle_count());
        }
        if elements > max_elements {
            return Err(too_many(item, max_elements));
        }
        meshes.add(number, item, shape, accessors, materials.len())?;
    }
    Ok(meshes)
}

/// What the triangles of a mesh are made from: of each primitive its accessors, mode, and the texture coordinates of its
/// normal map.
type Geometry<'a> = (Vec<([Option<&'a Value>; 4], Option<u32>)>, Vec<String>);

fn geometry_of<'a>(item: &Item<'a>, materials: &[Material]) -> Result<Geometry<'a>, Fault> {
    let of_primitive = |primitive: &Item<'a>| {
        let named = ["attributes", "targets", "indices", "mode"].map(|key| primitive.raw(key));
        Ok((named, normal_map(primitive, materials)?))
    };
    let primitives = item.objects("primitives")?.iter().map(of_primitive).collect::<Result<_, _>>()?;
    Ok((primitives, item.extra_texts("targetNames")))
}

/// The set of texture coordinates of its normal map, if it has one.
fn normal_map(primitive: &Item<'_>, materials: &[Material]) -> Result<Option<u32>, Fault> {
    let material = primitive.index("material", materials.len(), "material")?;
    let map = material.and_then(|m| materials.get(m)).and_then(|m| m.normal_texture.as_ref());
    Ok(map.map(|texture_use| texture_use.tex_coord))
}

/// What meshes of the same geometry have in common.
struct Shape {
    /// Without a name; its primitives have no material yet.
    mesh: Mesh,
    /// The place of the first mesh, where its warnings are.
    place: String,
    /// Which primitives of the file those of the mesh were.
    kept: Vec<usize>,
    warnings: Vec<Fault>,
}

fn too_many(item: &Item<'_>, limit: usize) -> Fault {
    item.fault(format!("more than {limit} vertices and triangles in one file are not read"))
}

impl Shape {
    fn read(
        item: &Item<'_>,
        accessors: &Accessors<'_>,
        materials: &[Material],
        max_elements: usize,
    ) -> Result<Self, Fault> {
        let mut builder = MeshBuilder::within(accessors.room());
        let mut attribute_reader = AttributeReader::new(accessors, max_elements);
        let (mut warnings, mut kept) = (Vec::new(), Vec::new());
        let mut corners = 0_usize;
        let mut target_counts = BTreeSet::new();
        for (number, primitive) in item.objects("primitives")?.iter().enumerate() {
            target_counts.insert(primitive.items("targets")?.len());
            let mode = primitive.size("mode")?.unwrap_or(TRIANGLES);
            if mode > TRIANGLE_FAN {
                return Err(primitive.fault(format!("mode {mode} does not exist")));
            }
            if mode < TRIANGLES {
                continue;
            }
            let Some(attributes) = attribute_reader.read(primitive, &mut warnings)? else {
                warnings.push(primitive.fault("it has no POSITION; it was left out"));
                continue;
            };
            let indices = read_triangles(primitive, accessors, mode, attributes.positions.len())?;
            corners = corners.saturating_add(indices.len());
            if corners / 3 > max_elements {
                return Err(too_many(primitive, max_elements));
            }
            let input = PrimitiveInput {
                attributes: &attributes,
                indices,
                material: MaterialId::default(),
                normal_map_tex_coord: normal_map(primitive, materials)?,
            };
            if builder.add(input).map_err(|too_large| primitive.fault(too_large.to_string()))? {
                kept.push(number);
            } else {
                warnings.push(primitive.fault("no triangle with an area is left; it was left out"));
            }
        }
        warnings.extend(repair_warnings(item, &builder.repairs));
        if target_counts.len() > 1 {
            warnings.push(
                item.fault("its primitives differ in their number of morph targets; missing ones do nothing"),
            );
        }
        builder.name_targets(item.extra_texts("targetNames"));
        let mesh = builder.finish(String::new()).map_err(|too_large| item.fault(too_large.to_string()))?;
        Ok(Self { mesh, place: item.place().to_owned(), kept, warnings })
    }

    /// Its warnings, said of another mesh.
    fn warnings_of<'a>(&'a self, item: &'a Item<'_>) -> impl Iterator<Item = Fault> + 'a {
        self.warnings.iter().map(|fault| {
            let within = fault.place.strip_prefix(&self.place).unwrap_or_default();
            Fault::new(format!("{}{within}", item.place()), fault.reason.clone())
        })
    }
}

impl Meshes {
    /// Adds a mesh: its shape with what is its own.
    fn add(
        &mut self,
        number: usize,
        item: &Item<'_>,
        shape: &Shape,
        accessors: &Accessors<'_>,
        materials: usize,
    ) -> Result<(), Fault> {
        self.warnings.extend(shape.warnings_of(item));
        let mut mesh = shape.mesh.clone();
        mesh.name = item.name()?;
        let primitives = item.objects("primitives")?;
        let kept = shape.kept.iter().filter_map(|&place| primitives.get(place));
        for (place, (primitive, made)) in kept.zip(&mut mesh.primitives).enumerate() {
            let material = primitive.index("material", materials, "material")?;
            self.uses_default_material |= material.is_none();
            made.material = MaterialId(material.unwrap_or(materials) as u64);
            let mappings = read_mappings(primitive, materials, &mut self.warnings)?;
            if !mappings.is_empty() {
                self.variants.insert((number, place), mappings);
            }
            let unknown = unknown(primitive, &[]);
            if !unknown.is_empty() {
                self.unknown.insert((number, place), unknown);
            }
            for name in lost_attributes(primitive)? {
                *self.lost.entry(name).or_default() += 1;
            }
        }
        let mut loose = LooseMesh::default();
        for primitive in &primitives {
            let mode = primitive.size("mode")?.unwrap_or(TRIANGLES);
            if mode < TRIANGLES {
                loose.primitives.extend(loose::read(
                    primitive,
                    accessors,
                    mode,
                    materials,
                    &mut self.warnings,
                )?);
            }
        }
        if !loose.primitives.is_empty() {
            self.warnings.push(item.fault(format!(
                "{} not rendered and only kept for exports",
                counted(
                    loose.primitives.len(),
                    "primitive of points or lines is",
                    "primitives of points or lines are"
                )
            )));
        }
        if mesh.primitives.is_empty() && !loose.primitives.is_empty() {
            loose.weights = item.raw("weights").cloned();
        } else if let Some(weights) = read_weights(item, mesh.data.morph.len(), &mut self.warnings)? {
            mesh.default_weights = weights;
        }
        if !loose.primitives.is_empty() {
            self.loose.insert(number, loose);
        }
        self.list.push(mesh);
        Ok(())
    }
}

/// Attributes of a primitive of triangles that are not read.
fn lost_attributes(primitive: &Item<'_>) -> Result<Vec<String>, Fault> {
    let Some(attributes) = primitive.child("attributes")? else {
        return Ok(Vec::new());
    };
    let is_read =
        |name: &str| BASE.contains(&name) || name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_");
    let names = attributes.object()?.keys().filter(|name| !is_read(name));
    Ok(names.map(|name| format!("the attribute {name} of triangles")).collect())
}

/// What variants of materials choose for a primitive. A variant is named once: where it is named again, and what names
/// none, is left out with a warning.
pub(super) fn read_mappings(
    primitive: &Item<'_>,
    materials: usize,
    warnings: &mut Vec<Fault>,
) -> Result<Vec<Mapping>, Fault> {
    let Some(extension) = primitive.extension("KHR_materials_variants")? else {
        return Ok(Vec::new());
    };
    let (mut seen, mut list) = (BTreeSet::new(), Vec::new());
    for item in extension.objects("mappings")? {
        let material = item.required_index("material", materials, "material")?;
        // Checked with the other references.
        let mut variants = item.indices("variants", usize::MAX, "variant")?;
        let count = variants.len();
        variants.retain(|variant| seen.insert(*variant));
        if variants.len() < count {
            warnings.push(item.fault("it names a variant that has a material already; the first one counts"));
        }
        match variants.is_empty() {
            true => warnings.push(item.fault("it chooses for no variant and is left out")),
            false => {
                list.push(Mapping { material, variants, name: item.name()?, unknown: unknown(&item, &[]) })
            }
        }
    }
    Ok(list)
}

/// Weights of `count` morph targets, of a mesh or a node; `None` when it has none.
pub(super) fn read_weights(
    item: &Item<'_>,
    count: usize,
    warnings: &mut Vec<Fault>,
) -> Result<Option<Vec<f32>>, Fault> {
    let Some(numbers) = item.numbers("weights")? else {
        return Ok(None);
    };
    if numbers.len() != count {
        let found = numbers.len();
        warnings.push(
            item.fault(format!("it has {found} weights for {count} morph targets; missing ones are 0")),
        );
    }
    let mut weights: Vec<f32> = numbers.into_iter().map(|number| number as f32).collect();
    weights.resize(count, 0.0);
    match weights.iter().all(|weight| weight.is_finite()) {
        true => Ok(Some(weights)),
        false => Err(item.fault("a weight is too large")),
    }
}

fn repair_warnings(item: &Item<'_>, repairs: &Repairs) -> Vec<Fault> {
    let lines = [
        (repairs.degenerate_triangles, "triangle without area was", "triangles without area were", "removed"),
        (
            repairs.non_finite_triangles,
            "triangle with positions that are not finite was",
            "triangles with positions that are not finite were",
            "removed",
        ),
        (
            repairs.non_finite_values,
            "texture coordinate, colour, weight or morph was not finite and was",
            "texture coordinates, colours, weights or morphs were not finite and were",
            "replaced",
        ),
        (
            repairs.replaced_normals,
            "normal had no direction and was",
            "normals had no direction and were",
            "replaced by those of their triangles",
        ),
    ];
    let found = lines.into_iter().filter(|(count, ..)| *count > 0);
    let words = |(count, one, many, done)| item.fault(format!("{} {done}", counted(count, one, many)));
    found.map(words).collect()
}

/// Three checked indices a triangle, from lists, strips and fans, indexed or not.
fn read_triangles(
    primitive: &Item<'_>,
    accessors: &Accessors<'_>,
    mode: usize,
    vertex_count: usize,
) -> Result<Vec<u32>, Fault> {
    let count = u32::try_from(vertex_count)
        .map_err(|_| primitive.fault("it has more vertices than 32 bits can count"))?;
    let order = match primitive.size("indices")? {
        Some(index) => accessors.indices(index)?,
        None => {
            accessors.take(vertex_count, size_of::<u32>(), primitive.place())?;
            (0..count).collect()
        }
    };
    if let Some(bad) = order.iter().find(|&&index| index >= count) {
        return Err(Fault::new(
            format!("{}/indices", primitive.place()),
            format!("vertex index {bad} is out of range, there are {count} vertices"),
        ));
    }
    if mode > TRIANGLES {
        accessors.take(order.len(), 3 * size_of::<u32>(), primitive.place())?;
    }
    Ok(match mode {
        5 => strip(&order),
        6 => fan(&order),
        _ => {
            let mut list = order;
            list.truncate(list.len() / 3 * 3);
            list
        }
    })
}

/// Every second triangle is turned, so that all face the same way (glTF 2.0, section 3.7.2.1).
fn strip(order: &[u32]) -> Vec<u32> {
    let triangles = order.array_windows::<3>().enumerate();
    triangles.flat_map(|(i, &[a, b, c])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] }).collect()
}

fn fan(order: &[u32]) -> Vec<u32> {
    let Some((&hub, rim)) = order.split_first() else {
        return Vec::new();
    };
    rim.array_windows::<2>().flat_map(|&[a, b]| [a, b, hub]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_facing() {
        assert_eq!(strip(&[0, 1, 2, 3, 4]), [0, 1, 2, 1, 3, 2, 2, 3, 4]);
        assert_eq!(fan(&[0, 1, 2, 3]), [1, 2, 0, 2, 3, 0]);
        assert!(strip(&[0, 1]).is_empty());
        assert!(fan(&[]).is_empty());
    }
}
