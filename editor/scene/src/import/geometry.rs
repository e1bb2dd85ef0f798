//! From the vertices of a file to a mesh that can be rendered.
//! In: attributes as read and triangles as indices. Out: `MeshData` with finite numbers, unit normals, a
//! tangent everywhere and no degenerate triangle, and counts of what was repaired. Knows no file format.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

use super::room::{NoRoom, Room};
use super::tangents;
use crate::assets::{Mesh, MeshData, Primitive};
use crate::ids::MaterialId;

mod deform;

pub(super) use deform::{Deltas, Hold};

/// Sine squared between two edges below which a triangle has no area.
const NO_AREA_SIN2: f64 = 1e-26;

/// Bytes of a vertex in the lists that every mesh has.
const VERTEX_BYTES: usize = 2 * size_of::<Vec3>() + size_of::<Vec4>() + size_of::<Vec2>();
/// Bytes that a mesh keeps for each joint that holds something of a primitive.
const HELD_BYTES: usize = 96;

/// Attributes of one primitive as they were read; all of one length.
#[derive(Clone, Debug, Default)]
pub(super) struct Attributes {
    pub positions: Vec<Vec3>,
    pub normals: Option<Vec<Vec3>>,
    pub tangents: Option<Vec<Vec4>>,
    pub tex_coords0: Option<Vec<Vec2>>,
    pub tex_coords1: Option<Vec<Vec2>>,
    pub colors: Option<Vec<Vec4>>,
    /// Joints with their weights, as [`SkinData`] wants them.
    pub skin: Option<Vec<Hold>>,
    /// What the morph targets add.
    pub targets: Vec<Deltas>,
}

/// What was repaired or left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Repairs {
    pub degenerate_triangles: usize,
    pub non_finite_triangles: usize,
    pub non_finite_values: usize,
    pub replaced_normals: usize,
}

/// One primitive to be added.
pub(super) struct PrimitiveInput<'a> {
    pub attributes: &'a Arc<Attributes>,
    /// Three a triangle, each below the number of positions.
    pub indices: Vec<u32>,
    pub material: MaterialId,
    /// Set of texture coordinates of a normal map, when there is one.
    pub normal_map_tex_coord: Option<u32>,
}

/// Vertices and indices that grow by a primitive at a time.
#[derive(Default)]
pub(super) struct MeshBuilder<'a> {
    /// What the mesh may take in memory; `None`: it is bounded elsewhere.
    room: Option<&'a Room>,
    data: MeshData,
    has_tex_coords1: bool,
    has_colors: bool,
    /// How many joints the vertices name at most.
    joints: usize,
    primitives: Vec<Primitive>,
    /// Where attributes that several primitives share were put.
    shared: HashMap<usize, (u32, Arc<Attributes>)>,
    pub repairs: Repairs,
}

/// Why a mesh is not built.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum TooLarge {
    /// It would have more vertices or indices than 32 bits can count.
    Counts,
    Bytes(NoRoom),
}

impl fmt::Display for TooLarge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Counts => f.write_str("the mesh has more vertices than 32 bits can count"),
            Self::Bytes(no_room) => no_room.fmt(f),
        }
    }
}

impl From<NoRoom> for TooLarge {
    fn from(no_room: NoRoom) -> Self {
        Self::Bytes(no_room)
    }
}

impl<'a> MeshBuilder<'a> {
    /// A mesh that may take this much memory.
    pub fn within(room: &'a Room) -> Self {
        Self { room: Some(room), ..Self::default() }
    }

    /// Adds a primitive; one without a triangle left adds nothing and returns false.
    pub fn add(&mut self, input: PrimitiveInput<'_>) -> Result<bool, TooLarge> {
        let PrimitiveInput { attributes, indices, material, normal_map_tex_coord } = input;
        let indices = self.without_bad_triangles(&attributes.positions, indices);
        if indices.is_empty() {
            return Ok(false);
        }
        let good_normals = attributes
            .normals
            .as_ref()
            .is_some_and(|normals| indices.iter().all(|&i| usable(at(normals, i))));
        let mikktspace =
            normal_map_tex_coord.filter(|_| attributes.tangents.is_none() || attributes.normals.is_none());
        let indices = if good_normals && mikktspace.is_none() {
            let base = self.add_shared(attributes)?;
            indices.into_iter().map(|i| i + base).collect()
        } else {
            let split = self.split(attributes, &indices, mikktspace)?;
            let base = self.append(&split.0)?;
            split.1.into_iter().map(|i| i + base).collect()
        };
        self.push_primitive(indices, material)?;
        Ok(true)
    }

    /// Names the morph targets in order; names without a target are dropped.
    pub fn name_targets(&mut self, names: Vec<String>) {
        for (target, name) in self.data.morph.iter_mut().zip(names) {
            target.name = name;
        }
    }

    /// The finished mesh.
    pub fn finish(mut self, name: String) -> Result<Mesh, TooLarge> {
        let count = self.data.positions.len();
        if let Some(room) = self.room {
            room.take(self.missing(count, self.has_tex_coords1, self.has_colors), 1)?;
            room.take(deform::missing(&self.data, None, count), 1)?;
        }
        self.data.tex_coords0.resize(count, Vec2::ZERO);
        if self.has_tex_coords1 {
            self.data.tex_coords1.resize(count, Vec2::ZERO);
        } else {
            self.data.tex_coords1.clear();
        }
        if self.has_colors {
            self.data.colors.resize(count, Vec4::ONE);
        } else {
            self.data.colors.clear();
        }
        deform::fill_up(&mut self.data);
        Ok(Mesh::new(name, Arc::new(self.data), self.primitives))
    }

    /// Bytes that the second texture coordinates and the colours lack to have `count` entries, of those that are wanted.
    fn missing(&self, count: usize, tex_coords1: bool, colors: bool) -> usize {
        let lacks = |length: usize, size: usize| count.saturating_sub(length).saturating_mul(size);
        let tex_coords1 = if tex_coords1 { lacks(self.data.tex_coords1.len(), size_of::<Vec2>()) } else { 0 };
        let colors = if colors { lacks(self.data.colors.len(), size_of::<Vec4>()) } else { 0 };
        tex_coords1.saturating_add(colors)
    }

    fn without_bad_triangles(&mut self, positions: &[Vec3], indices: Vec<u32>) -> Vec<u32> {
        let mut kept = Vec::with_capacity(indices.len());
        let (triangles, _) = indices.as_chunks::<3>();
        for &[a, b, c] in triangles {
            let [p, q, r] = [a, b, c].map(|i| at(positions, i));
            if !(p.is_finite() && q.is_finite() && r.is_finite()) {
                self.repairs.non_finite_triangles += 1;
            } else if has_no_area(p, q, r) {
                self.repairs.degenerate_triangles += 1;
            } else {
                kept.extend([a, b, c]);
            }
        }
        kept
    }

    fn add_shared(&mut self, attributes: &Arc<Attributes>) -> Result<u32, TooLarge> {
        let key = Arc::as_ptr(attributes) as usize;
        if let Some((base, _)) = self.shared.get(&key) {
            return Ok(*base);
        }
        let base = self.append(attributes)?;
        // The Arc is kept so that its address stays a key.
        self.shared.insert(key, (base, Arc::clone(attributes)));
        Ok(base)
    }

    /// Gives the primitive vertices of its own: flat normals where the file has none, normals from the
    /// neighbouring triangles where they are unusable, MikkTSpace tangents where asked for.
    fn split(
        &mut self,
        attributes: &Attributes,
        indices: &[u32],
        mikktspace: Option<u32>,
    ) -> Result<(Attributes, Vec<u32>), TooLarge> {
        if let Some(room) = self.room {
            match (&attributes.normals, mikktspace) {
                (None, _) => {
                    let morphed = attributes.targets.len().saturating_mul(2 * size_of::<Vec3>());
                    room.peek(indices.len(), VERTEX_BYTES.saturating_add(morphed))?;
                }
                (_, Some(_)) => room.take(indices.len(), size_of::<Vec4>())?,
                _ => {}
            }
        }
        let repaired = match &attributes.normals {
            None => Some(flat_normals(attributes, indices)),
            Some(normals) => {
                let bad = indices.iter().any(|&i| !usable(at(normals, i)));
                bad.then(|| (self.with_repaired_normals(attributes, indices), indices.to_vec()))
            }
        };
        let (attributes, indices) = repaired.unwrap_or_else(|| compacted(attributes, indices));
        Ok(match mikktspace {
            Some(tex_coord) => with_mikktspace(&attributes, &indices, tex_coord),
            None => (attributes, indices),
        })
    }

    fn with_repaired_normals(&mut self, attributes: &Attributes, indices: &[u32]) -> Attributes {
        let mut sums = vec![DVec3::ZERO; attributes.positions.len()];
        let (triangles, _) = indices.as_chunks::<3>();
        for triangle in triangles {
            let normal = face_normal(triangle.map(|i| at(&attributes.positions, i)));
            for &i in triangle {
                if let Some(sum) = sums.get_mut(i as usize) {
                    *sum += normal;
                }
            }
        }
        let mut repaired = attributes.clone();
        for (normal, sum) in repaired.normals.iter_mut().flatten().zip(&sums) {
            if !usable(*normal) {
                *normal = sum.normalize_or(DVec3::Z).as_vec3();
                self.repairs.replaced_normals += usize::from(*sum != DVec3::ZERO);
            }
        }
        repaired
    }

    /// Appends vertices, clean, and returns the number of the first.
    fn append(&mut self, new: &Attributes) -> Result<u32, TooLarge> {
        let base = self.data.positions.len();
        let count = new.positions.len();
        let end = base.checked_add(count).ok_or(TooLarge::Counts)?;
        u32::try_from(end).map_err(|_| TooLarge::Counts)?;
        if let Some(room) = self.room {
            room.take(count, VERTEX_BYTES)?;
            room.take(self.missing(end, new.tex_coords1.is_some(), new.colors.is_some()), 1)?;
            room.take(deform::missing(&self.data, Some(new), end), 1)?;
        }
        let data = &mut self.data;
        let bad = &mut self.repairs.non_finite_values;
        // Non-finite positions are used by no triangle any more; they only must not reach a device.
        let positions = new.positions.iter().copied();
        data.positions.extend(positions.map(|p| if p.is_finite() { p } else { Vec3::ZERO }));
        let normals = new.normals.iter().flatten().copied();
        data.normals.extend(normals.map(|n| tangents::unit(n).unwrap_or(Vec3::Z)));
        data.normals.resize(end, Vec3::Z);
        match &new.tangents {
            Some(given) => {
                let pairs = given.iter().zip(data.normals.get(base..).unwrap_or(&[]));
                data.tangents.extend(pairs.map(|(&t, &n)| tangents::usable_or_any(t, n)));
            }
            None => {
                let normals = data.normals.get(base..).unwrap_or(&[]);
                data.tangents.extend(normals.iter().map(|&n| tangents::any(n)));
            }
        }
        data.tangents.resize(end, Vec4::new(1.0, 0.0, 0.0, 1.0));
        extend_vec2(&mut data.tex_coords0, new.tex_coords0.as_deref(), base, bad);
        extend_vec2(&mut data.tex_coords1, new.tex_coords1.as_deref(), base, bad);
        if let Some(colors) = &new.colors {
            data.colors.resize(base, Vec4::ONE);
            *bad += colors.iter().filter(|color| !color.is_finite()).count();
            data.colors.extend(colors.iter().map(|color| if color.is_finite() { *color } else { Vec4::ONE }));
        }
        deform::append_skin(data, new, base);
        deform::append_targets(data, new, base, bad);
        self.has_tex_coords1 |= new.tex_coords1.is_some();
        self.has_colors |= new.colors.is_some();
        self.joints = self.joints.max(deform::joint_count(new));
        Ok(base as u32)
    }

    fn push_primitive(&mut self, indices: Vec<u32>, material: MaterialId) -> Result<(), TooLarge> {
        let first = u32::try_from(self.data.indices.len()).map_err(|_| TooLarge::Counts)?;
        let count = u32::try_from(indices.len()).map_err(|_| TooLarge::Counts)?;
        first.checked_add(count).ok_or(TooLarge::Counts)?;
        if let Some(room) = self.room {
            room.take(indices.len(), size_of::<u32>())?;
            room.take(self.joints.min(indices.len()), HELD_BYTES)?;
        }
        self.data.indices.extend(indices);
        self.primitives.push(Primitive {
            first_index: first,
            index_count: count,
            material,
            mesh_from_primitive: DAffine3::IDENTITY,
        });
        Ok(())
    }
}

/// The value of a vertex; indices were checked, a stray one reads the default.
fn at<T: Copy + Default>(values: &[T], index: u32) -> T {
    values.get(index as usize).copied().unwrap_or_default()
}

fn usable(normal: Vec3) -> bool {
    tangents::unit(normal).is_some()
}

/// Not normalised: twice the area long.
fn face_normal([p, q, r]: [Vec3; 3]) -> DVec3 {
    let [p, q, r] = [p, q, r].map(Vec3::as_dvec3);
    (q - p).cross(r - p)
}

/// Whether a triangle is a line or a point, by the double-precision sine of its angle.
pub(crate) fn has_no_area(p: Vec3, q: Vec3, r: Vec3) -> bool {
    let [p, q, r] = [p, q, r].map(Vec3::as_dvec3);
    let (a, b, c) = (q - p, r - p, r - q);
    let longest2 = a.length_squared().max(b.length_squared()).max(c.length_squared());
    // Unit-sized first: the fourth power of a tiny edge would underflow.
    let scale = longest2.sqrt().recip();
    if !scale.is_finite() {
        return true;
    }
    (a * scale).cross(b * scale).length_squared() <= NO_AREA_SIN2
}

/// A list stays as short as nobody has any; then it begins with zeros.
fn extend_vec2(to: &mut Vec<Vec2>, from: Option<&[Vec2]>, base: usize, bad: &mut usize) {
    let Some(from) = from else {
        return;
    };
    to.resize(base, Vec2::ZERO);
    *bad += from.iter().filter(|value| !value.is_finite()).count();
    to.extend(from.iter().map(|value| if value.is_finite() { *value } else { Vec2::ZERO }));
}

/// The attributes of the vertices `order`, one after the other.
fn gathered(attributes: &Attributes, order: &[u32]) -> Attributes {
    fn pick<T: Copy + Default>(values: &Option<Vec<T>>, order: &[u32]) -> Option<Vec<T>> {
        let values = values.as_ref()?;
        Some(order.iter().map(|&i| at(values, i)).collect())
    }
    Attributes {
        positions: order.iter().map(|&i| at(&attributes.positions, i)).collect(),
        normals: pick(&attributes.normals, order),
        tangents: pick(&attributes.tangents, order),
        tex_coords0: pick(&attributes.tex_coords0, order),
        tex_coords1: pick(&attributes.tex_coords1, order),
        colors: pick(&attributes.colors, order),
        skin: pick(&attributes.skin, order),
        targets: attributes
            .targets
            .iter()
            .map(|target| Deltas {
                positions: pick(&target.positions, order),
                normals: pick(&target.normals, order),
                tangents: pick(&target.tangents, order),
            })
            .collect(),
    }
}

/// Only the vertices that the triangles use.
fn compacted(attributes: &Attributes, indices: &[u32]) -> (Attributes, Vec<u32>) {
    let mut place = HashMap::new();
    let mut order = Vec::new();
    let indices = indices
        .iter()
        .map(|&i| {
            *place.entry(i).or_insert_with(|| {
                order.push(i);
                (order.len() - 1) as u32
            })
        })
        .collect();
    (gathered(attributes, &order), indices)
}

/// Every triangle gets its own three vertices with the face's normal (glTF 2.0, section 3.7.2.1: without
/// normals they are flat, and tangents of the file are ignored).
fn flat_normals(attributes: &Attributes, indices: &[u32]) -> (Attributes, Vec<u32>) {
    let mut own = gathered(attributes, indices);
    let flat = |triangle: [Vec3; 3]| face_normal(triangle).normalize_or(DVec3::Z).as_vec3();
    let normals_of = |positions: &[Vec3]| -> Vec<Vec3> {
        let (triangles, _) = positions.as_chunks::<3>();
        triangles.iter().flat_map(|&triangle| [flat(triangle); 3]).collect()
    };
    let normals = normals_of(&own.positions);
    deform::flatten(&mut own, &normals, normals_of);
    own.normals = Some(normals);
    own.tangents = None;
    let indices = (0..own.positions.len() as u32).collect();
    (own, indices)
}

/// MikkTSpace tangents; a vertex is doubled where its corners need different ones.
fn with_mikktspace(attributes: &Attributes, indices: &[u32], tex_coord: u32) -> (Attributes, Vec<u32>) {
    let no_normals = Vec::new();
    let zeros;
    let chosen = match tex_coord {
        0 => &attributes.tex_coords0,
        _ => &attributes.tex_coords1,
    };
    let tex_coords = match chosen {
        Some(tex_coords) => tex_coords,
        None => {
            zeros = vec![Vec2::ZERO; attributes.positions.len()];
            &zeros
        }
    };
    let corners = tangents::mikktspace(
        &attributes.positions,
        attributes.normals.as_ref().unwrap_or(&no_normals),
        tex_coords,
        indices,
    );
    let mut place = HashMap::new();
    let (mut order, mut tangents_by_vertex) = (Vec::new(), Vec::new());
    let new_indices = indices
        .iter()
        .zip(corners)
        .map(|(&i, tangent)| {
            let key = (i, tangent.to_array().map(f32::to_bits));
            *place.entry(key).or_insert_with(|| {
                order.push(i);
                tangents_by_vertex.push(tangent);
                (order.len() - 1) as u32
            })
        })
        .collect();
    let mut own = gathered(attributes, &order);
    own.tangents = Some(tangents_by_vertex);
    own.targets.iter_mut().for_each(|target| target.tangents = None);
    (own, new_indices)
}

#[cfg(test)]
mod tests;
