//! What holds vertices and what morph targets add to them, on the way into a mesh.
//! In: lists of one primitive. Out: lists of the whole mesh, with zeros for primitives that have none.

use glam::Vec3;

use super::Attributes;
use crate::assets::{MeshData, MorphTarget, SkinData};

/// Joints of a vertex and their weights.
pub(in crate::import) type Hold = ([u16; 4], [f32; 4]);

/// What one morph target adds; each list is as long as the positions.
#[derive(Clone, Debug, Default)]
pub(in crate::import) struct Deltas {
    pub positions: Option<Vec<Vec3>>,
    pub normals: Option<Vec<Vec3>>,
    pub tangents: Option<Vec<Vec3>>,
}

/// Bytes that lists lack to have an entry for `count` vertices: those that `new` brings, or all that there are.
pub(super) fn missing(data: &MeshData, new: Option<&Attributes>, count: usize) -> usize {
    let lacks = |length: usize, size: usize| count.saturating_sub(length).saturating_mul(size);
    let held = data.skin.as_ref().map_or(0, |skin| skin.joints.len());
    let wanted = new.map_or(data.skin.is_some(), |new| new.skin.is_some());
    let skin = if wanted { lacks(held, size_of::<Hold>()) } else { 0 };
    let none = MorphTarget::default();
    let targets = new.map_or(data.morph.len(), |new| new.targets.len());
    let deltas = (0..targets).flat_map(|place| {
        let target = data.morph.get(place).unwrap_or(&none);
        let lengths = [&target.positions, &target.normals, &target.tangents].map(Vec::len);
        let deltas = new.and_then(|new| new.targets.get(place));
        let brought = deltas.map(|d| [&d.positions, &d.normals, &d.tangents].map(Option::is_some));
        lengths.into_iter().zip(brought.unwrap_or(lengths.map(|length| length > 0)))
    });
    let deltas = deltas.filter(|(_, wanted)| *wanted).map(|(length, _)| lacks(length, size_of::<Vec3>()));
    deltas.fold(skin, usize::saturating_add)
}

/// How many joints the vertices name at most; 0 where none holds any.
pub(super) fn joint_count(new: &Attributes) -> usize {
    let joints = new.skin.iter().flatten().flat_map(|(joints, _)| joints);
    joints.max().map_or(0, |largest| usize::from(*largest) + 1)
}

/// Vertices of earlier primitives without joints are held by none.
pub(super) fn append_skin(data: &mut MeshData, new: &Attributes, base: usize) {
    let Some(entries) = &new.skin else {
        return;
    };
    let SkinData { joints, weights } = data.skin.get_or_insert_default();
    joints.resize(base, [0; 4]);
    weights.resize(base, [0.0; 4]);
    joints.extend(entries.iter().map(|(joints, _)| joints));
    weights.extend(entries.iter().map(|(_, weights)| weights));
}

/// Deltas stay as short as nobody has any; then they begin with zeros.
pub(super) fn append_targets(data: &mut MeshData, new: &Attributes, base: usize, bad: &mut usize) {
    if data.morph.len() < new.targets.len() {
        data.morph.resize_with(new.targets.len(), MorphTarget::default);
    }
    for (target, deltas) in data.morph.iter_mut().zip(&new.targets) {
        for (to, from) in [
            (&mut target.positions, &deltas.positions),
            (&mut target.normals, &deltas.normals),
            // Without tangents of its own the base has others than those that the file's deltas go with.
            (&mut target.tangents, if new.tangents.is_some() { &deltas.tangents } else { &None }),
        ] {
            let Some(from) = from else {
                continue;
            };
            to.resize(base, Vec3::ZERO);
            for &delta in from {
                *bad += usize::from(!delta.is_finite());
                to.push(if delta.is_finite() { delta } else { Vec3::ZERO });
            }
        }
    }
}

/// Gives the lists that there are an entry for every vertex.
pub(super) fn fill_up(data: &mut MeshData) {
    let count = data.positions.len();
    if let Some(skin) = &mut data.skin {
        skin.joints.resize(count, [0; 4]);
        skin.weights.resize(count, [0.0; 4]);
    }
    for target in &mut data.morph {
        for deltas in [&mut target.positions, &mut target.normals, &mut target.tangents] {
            let wanted = if deltas.is_empty() { 0 } else { count };
            deltas.resize(wanted, Vec3::ZERO);
        }
    }
}

/// Where the base has flat normals, a morphed face gets a flat normal of its own (glTF 2.0, section 3.7.2.2).
/// `normals_of` gives those of positions that are corners of triangles, one after the other.
pub(super) fn flatten(own: &mut Attributes, normals: &[Vec3], normals_of: impl Fn(&[Vec3]) -> Vec<Vec3>) {
    for target in &mut own.targets {
        target.normals = target.positions.as_ref().map(|deltas| {
            let moved: Vec<Vec3> = own.positions.iter().zip(deltas).map(|(&p, &d)| p + d).collect();
            normals_of(&moved).iter().zip(normals).map(|(&moved, &normal)| moved - normal).collect()
        });
    }
}
