//! Meshes: vertices cut into the sets that primitives share, and primitives with indices and materials.
//! In: meshes of the document and what is to be written of them. Out: their JSON, and bytes in the buffer. Attributes that
//! say what is read without them are left out.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use glam::{Vec2, Vec4};
use serde_json::Value;

use super::buffer::{Buffer, Use};
use super::foreign::Sources;
use super::json::{Extensions, Object, Put, numbers};
use super::shapes;
use crate::assets::{Material, Mesh, MeshData, MorphTarget};
use crate::document::Document;
use crate::foreign::{Loose, Numbers};
use crate::ids::{MaterialId, MeshId, PrefabId};
use crate::import::tangents;
use crate::prefab::Prefab;

/// One mesh of the file: primitives of a mesh of the document with a choice of materials.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct MeshKey {
    pub mesh: MeshId,
    /// Which primitives, growing, at least one unless there are points and lines.
    pub primitives: Vec<u32>,
    /// One a primitive of the whole mesh.
    pub materials: Vec<MaterialId>,
    /// With its points and lines.
    pub loose: bool,
}

/// The meshes of the document as triangles.
pub(super) struct Meshes<'a> {
    document: &'a Document,
    made: BTreeMap<MeshId, Option<Mesh>>,
    loose: BTreeSet<MeshId>,
}

impl<'a> Meshes<'a> {
    pub fn new(document: &'a Document) -> Self {
        let of_shapes = document.meshes().filter(|(_, mesh)| mesh.shapes().is_some());
        let made = of_shapes.map(|(id, mesh)| (id, shapes::tessellated(mesh))).collect();
        let loose = document.prefabs().flat_map(|(_, prefab)| {
            prefab.foreign.loose.keys().filter_map(|place| prefab.meshes.get(*place).copied())
        });
        Self { document, made, loose: loose.collect() }
    }

    /// Whether a mesh has points or lines.
    pub fn has_loose(&self, id: MeshId) -> bool {
        self.loose.contains(&id)
    }

    /// A mesh; `None` where it has too many spheres and boxes, or is not there.
    pub fn get(&self, id: MeshId) -> Option<&Mesh> {
        match self.made.get(&id) {
            Some(made) => made.as_ref(),
            None => self.document.mesh(id),
        }
    }
}

/// A run of vertices that some primitives share, and nobody else uses.
struct VertexSet {
    vertices: Range<usize>,
    primitives: Vec<u32>,
}

/// The vertices of a mesh cut where no triangle crosses; unused ones go with those before them.
fn vertex_sets(mesh: &Mesh) -> Vec<VertexSet> {
    let mut spans: Vec<(Range<usize>, u32)> = (0..)
        .zip(&mesh.primitives)
        .map(|(number, primitive)| {
            let indices = mesh.indices_of(primitive);
            let first = indices.iter().min().map_or(0, |&index| index as usize);
            (first..indices.iter().max().map_or(first, |&index| index as usize + 1), number)
        })
        .collect();
    spans.sort_by_key(|(span, number)| (span.start, *number));
    let mut sets: Vec<VertexSet> = Vec::new();
    for (span, number) in spans {
        match sets.last_mut() {
            Some(last) if span.start < last.vertices.end => {
                last.vertices.end = last.vertices.end.max(span.end);
                last.primitives.push(number);
            }
            _ => sets.push(VertexSet { vertices: span, primitives: vec![number] }),
        }
    }
    let mut end = mesh.data.positions.len();
    for set in sets.iter_mut().rev() {
        set.vertices.end = end;
        end = set.vertices.start;
    }
    if let Some(first) = sets.first_mut() {
        first.vertices.start = 0;
    }
    sets
}

/// Colours of points and lines within 0 and 1; `None` where they are so already.
fn held(numbers: &Numbers) -> Option<Numbers> {
    let values = numbers.bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let bytes: Vec<u8> = values.flat_map(|value| value.clamp(0.0, 1.0).to_le_bytes()).collect();
    (numbers.component == 5126 && *bytes != *numbers.bytes)
        .then(|| Numbers { bytes: bytes.into(), ..numbers.clone() })
}

/// Writes meshes.
pub(super) struct MeshWriter<'a> {
    pub document: &'a Document,
    pub buffer: &'a mut Buffer,
    /// Places of the materials in the file.
    pub materials: &'a BTreeMap<MaterialId, usize>,
    pub sources: &'a Sources<'a>,
    pub used: &'a mut Extensions,
    /// Some colours of vertices were not within 0 and 1.
    pub colors_held: bool,
}

impl MeshWriter<'_> {
    /// A mesh, and what of its `extras` is ours.
    pub fn write(&mut self, key: &MeshKey, mesh: &Mesh) -> (Object, Object) {
        let sets = vertex_sets(mesh);
        let used: Vec<&VertexSet> =
            sets.iter().filter(|set| set.primitives.iter().any(|p| key.primitives.contains(p))).collect();
        let used_count = used.len();
        let mut primitives: BTreeMap<u32, Object> = BTreeMap::new();
        for (number, set) in used.into_iter().enumerate() {
            let usage = Use::Vertices { set: number };
            let surfaces: Vec<&Material> = set
                .primitives
                .iter()
                .filter(|p| key.primitives.contains(p))
                .filter_map(|&p| self.document.material(*key.materials.get(p as usize)?))
                .collect();
            let attributes = self.attributes(&mesh.data, &set.vertices, &surfaces, usage);
            let targets: Vec<Value> = mesh
                .data
                .morph
                .iter()
                .map(|target| Value::Object(self.target(target, &set.vertices, usage)))
                .collect();
            for &p in set.primitives.iter().filter(|p| key.primitives.contains(p)) {
                let Some(primitive) = mesh.primitives.get(p as usize) else { continue };
                let first = set.vertices.start as u32;
                let indices: Vec<u32> =
                    mesh.indices_of(primitive).iter().map(|index| index - first).collect();
                let mut object = Object::new();
                object.put("attributes", attributes.clone());
                object.put("indices", self.buffer.indices(&indices));
                let material = key.materials.get(p as usize);
                if let Some(&place) = material.and_then(|material| self.materials.get(material)) {
                    object.put("material", place);
                }
                object.put_filled("targets", targets.clone());
                primitives.insert(p, object);
            }
        }
        let mut list: Vec<(u32, &mut Object)> = primitives.iter_mut().map(|(p, o)| (*p, o)).collect();
        self.sources.put_variants(key.mesh, &mut list, self.materials, self.used);
        for (number, object) in list {
            let unknown = self.sources.primitive(key.mesh, number);
            self.sources.put(object, unknown, Object::new(), self.used);
        }
        let mut list: Vec<Value> = primitives.into_values().map(Value::Object).collect();
        let loose = self.sources.loose(key.mesh).filter(|_| key.loose);
        if let Some((id, prefab, loose)) = loose {
            // All primitives have as many targets.
            let own = loose.primitives.iter().map(|loose| loose.targets.len()).max();
            let targets = if list.is_empty() { own.unwrap_or(0) } else { mesh.data.morph.len() };
            for (loose, set) in loose.primitives.iter().zip(used_count..) {
                list.push(Value::Object(self.loose((id, prefab), loose, set, targets)));
            }
        }
        let mut object = Object::new();
        object.put_text("name", &mesh.name);
        object.put("primitives", list);
        if mesh.default_weights.iter().any(|weight| *weight != 0.0) {
            object.put("weights", numbers(&mesh.default_weights));
        } else if let Some(weights) = loose.and_then(|(_, _, loose)| loose.weights.clone()) {
            object.put("weights", weights);
        }
        (object, own_extras(&mesh.data))
    }

    /// Points or lines, as they were read, with so many targets.
    fn loose(
        &mut self,
        (id, prefab): (PrefabId, &Prefab),
        loose: &Loose,
        set: usize,
        targets: usize,
    ) -> Object {
        let usage = Use::Vertices { set };
        let mut attributes = |list: &[(String, Numbers)]| {
            let mut object = Object::new();
            for (name, numbers) in list {
                let held = name.starts_with("COLOR_").then(|| held(numbers)).flatten();
                self.colors_held |= held.is_some();
                let numbers = held.as_ref().unwrap_or(numbers);
                object.put(name, self.buffer.numbers(numbers, name == "POSITION", usage));
            }
            object
        };
        let mut object = Object::new();
        object.put("attributes", attributes(&loose.attributes));
        let own = loose.targets.iter().take(targets);
        let mut list: Vec<Value> = own.map(|target| Value::Object(attributes(target))).collect();
        let count = loose.attributes.first().map_or(0, |(_, numbers)| numbers.count);
        let is_empty = |target: &Value| target.as_object().is_some_and(Object::is_empty);
        if list.len() < targets || list.iter().any(is_empty) {
            let mut nothing = Object::new();
            nothing.put("POSITION", self.buffer.zeros::<3>(count, true));
            let nothing = Value::Object(nothing);
            list.iter_mut().filter(|target| is_empty(target)).for_each(|target| *target = nothing.clone());
            list.resize(targets, nothing);
        }
        if let Some(indices) = &loose.indices {
            object.put("indices", self.buffer.numbers(indices, false, Use::Indices));
        }
        let material = loose.material.and_then(|place| prefab.materials.get(place));
        if let Some(place) = material.and_then(|material| self.materials.get(material)) {
            object.put("material", *place);
        }
        object.put("mode", loose.mode);
        object.put_filled("targets", list);
        if !loose.mappings.is_empty() {
            self.sources.put_mappings((id, &loose.mappings), &mut object, self.materials, self.used);
        }
        self.sources.put(&mut object, Some((id, &loose.unknown)), Object::new(), self.used);
        object
    }

    fn attributes(
        &mut self,
        data: &MeshData,
        vertices: &Range<usize>,
        surfaces: &[&Material],
        usage: Use,
    ) -> Object {
        let mut attributes = Object::new();
        let cut = Cut { vertices };
        let positions: Vec<[f32; 3]> = cut.of(&data.positions).iter().map(|p| p.to_array()).collect();
        attributes.put("POSITION", self.buffer.floats(&positions, true, usage));
        let normals: Vec<[f32; 3]> = cut.of(&data.normals).iter().map(|n| n.to_array()).collect();
        attributes.put("NORMAL", self.buffer.floats(&normals, false, usage));
        if needs_tangents(data, vertices, surfaces) {
            let tangents: Vec<[f32; 4]> = cut.of(&data.tangents).iter().map(|t| t.to_array()).collect();
            attributes.put("TANGENT", self.buffer.floats(&tangents, false, usage));
        }
        let second = cut.needed(&data.tex_coords1, Vec2::ZERO);
        let textured = surfaces.iter().any(|material| material.textures().next().is_some());
        // A second set without a first is not allowed.
        let first =
            textured || second.is_some() || cut.of(&data.tex_coords0).iter().any(|uv| *uv != Vec2::ZERO);
        let first = first.then(|| cut.of(&data.tex_coords0));
        for (name, coordinates) in [("TEXCOORD_0", first), ("TEXCOORD_1", second)] {
            if let Some(coordinates) = coordinates {
                let values: Vec<[f32; 2]> = coordinates.iter().map(|uv| uv.to_array()).collect();
                attributes.put(name, self.buffer.floats(&values, false, usage));
            }
        }
        if let Some(colors) = cut.needed(&data.colors, Vec4::ONE) {
            let held = |color: &Vec4| color.clamp(Vec4::ZERO, Vec4::ONE);
            self.colors_held |= colors.iter().any(|color| held(color) != *color);
            let values: Vec<[f32; 4]> = colors.iter().map(|color| held(color).to_array()).collect();
            attributes.put("COLOR_0", self.buffer.floats(&values, false, usage));
        }
        if let Some(skin) = &data.skin
            && let Some(weights) = cut.needed(&skin.weights, [0.0; 4])
        {
            attributes.put("JOINTS_0", self.buffer.joints(cut.of(&skin.joints), usage));
            attributes.put("WEIGHTS_0", self.buffer.floats(weights, false, usage));
        }
        attributes
    }

    /// What a morph target adds; positions are always there, as a target must not be empty.
    fn target(&mut self, target: &MorphTarget, vertices: &Range<usize>, usage: Use) -> Object {
        let mut attributes = Object::new();
        let nothing = target.normals.is_empty() && target.tangents.is_empty();
        for (name, deltas) in
            [("POSITION", &target.positions), ("NORMAL", &target.normals), ("TANGENT", &target.tangents)]
        {
            let with_bounds = name == "POSITION";
            if deltas.is_empty() && !(with_bounds && nothing) {
                continue;
            }
            let values: Vec<[f32; 3]> = Cut { vertices }.of(deltas).iter().map(|d| d.to_array()).collect();
            let place = match values.iter().any(|value| *value != [0.0; 3]) {
                true => self.buffer.floats(&values, with_bounds, usage),
                false => self.buffer.zeros::<3>(vertices.len(), with_bounds),
            };
            attributes.put(name, place);
        }
        attributes
    }
}

/// A run of vertices.
struct Cut<'a> {
    vertices: &'a Range<usize>,
}

impl Cut<'_> {
    fn of<'d, T>(&self, values: &'d [T]) -> &'d [T] {
        values.get(self.vertices.clone()).unwrap_or(&[])
    }

    /// The values here, where they differ from what is read without them; and where nobody's do, so that they are there.
    fn needed<'d, T: PartialEq>(&self, values: &'d [T], absent: T) -> Option<&'d [T]> {
        let here = self.of(values);
        let says = |values: &[T]| values.iter().any(|value| *value != absent);
        (!here.is_empty() && (says(here) || !says(values))).then_some(here)
    }
}

/// Without tangents, import makes any that complete a frame; or those of a normal map, if there is one.
fn needs_tangents(data: &MeshData, vertices: &Range<usize>, surfaces: &[&Material]) -> bool {
    let cut = Cut { vertices };
    let mut pairs = cut.of(&data.tangents).iter().zip(cut.of(&data.normals));
    surfaces.iter().any(|material| material.normal_texture.is_some())
        || data.morph.iter().any(|target| !target.tangents.is_empty())
        || pairs.any(|(tangent, normal)| *tangent != tangents::any(*normal))
}

/// Names of the morph targets.
fn own_extras(data: &MeshData) -> Object {
    let mut extras = Object::new();
    if data.morph.iter().any(|target| !target.name.is_empty()) {
        let names: Vec<Value> = data.morph.iter().map(|target| Value::from(target.name.as_str())).collect();
        extras.put("targetNames", names);
    }
    extras
}
