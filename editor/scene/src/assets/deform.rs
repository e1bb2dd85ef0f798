//! What bends a mesh: joints of a skin and morph targets, and how far a bent mesh can reach.
//! Plain data, one entry a vertex; poses are the document's affair.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3, Vec3};

use super::mesh::{MeshData, Primitive};

/// Joints that hold the vertices, one entry a vertex in both lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinData {
    /// Indices into the joints of whatever skin bends the mesh; 0 where the weight is 0.
    pub joints: Vec<[u16; 4]>,
    /// Not negative, with sum 1; or all zero: no joint holds the vertex, it keeps its place in the instance.
    pub weights: Vec<[f32; 4]>,
}

/// What one morph target adds at weight 1. Each list is empty or has one entry a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphTarget {
    /// Name in the file; may be empty.
    pub name: String,
    /// Added to positions, mesh space, metres.
    pub positions: Vec<Vec3>,
    /// Added to normals, which are then made unit vectors again.
    pub normals: Vec<Vec3>,
    /// Added to tangents (without handedness), likewise.
    pub tangents: Vec<Vec3>,
}

/// How a placed mesh that deforms is bent right now. Positions are morphed, then skinned, then moved by the
/// primitive's `mesh_from_primitive`, then placed by `world_from_mesh`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeformPose {
    /// One a joint of the skin, finite: a vertex goes to the sum of weight * matrix * position, in the space of
    /// the instance. Empty: no skin bends it, whatever the mesh has.
    pub joint_matrices: Vec<DAffine3>,
    /// One a morph target.
    pub weights: Vec<f32>,
}

/// A box by its smallest and largest corner.
pub(crate) type Bounds = (DVec3, DVec3);

/// The box around two boxes.
pub(crate) fn join(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The box around a box that was moved.
pub(crate) fn moved(by: &DAffine3, (low, high): Bounds) -> Bounds {
    let corner = |i: u32| {
        let pick = |bit: u32, a: f64, b: f64| if i & bit == 0 { a } else { b };
        by.transform_point3(DVec3::new(
            pick(1, low.x, high.x),
            pick(2, low.y, high.y),
            pick(4, low.z, high.z),
        ))
    };
    (1..8).map(corner).fold((corner(0), corner(0)), |bounds, p| join(bounds, (p, p)))
}

/// What of one primitive moves with what.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Reach {
    /// Boxes around the vertices that a joint holds at all; `None`: those that no joint holds, or all of them
    /// when no skin bends the mesh.
    held: BTreeMap<Option<u16>, Bounds>,
    all: Option<Bounds>,
    /// Boxes around the position deltas of each morph target.
    deltas: Vec<Bounds>,
}

impl Reach {
    /// The boxes of the vertices `indices`.
    pub fn of(data: &MeshData, indices: &[u32]) -> Self {
        let mut reach = Self::default();
        for &index in indices {
            let vertex = index as usize;
            let Some(p) = data.positions.get(vertex).map(|p| p.as_dvec3()) else {
                continue;
            };
            reach.all = Some(reach.all.map_or((p, p), |bounds| join(bounds, (p, p))));
            for joint in holders(data, vertex) {
                let bounds = reach.held.entry(joint).or_insert((p, p));
                *bounds = join(*bounds, (p, p));
            }
        }
        let delta_bounds = |target: &MorphTarget| {
            let deltas = indices.iter().filter_map(|&i| target.positions.get(i as usize));
            let boxes = deltas.map(|d| (d.as_dvec3(), d.as_dvec3()));
            boxes.reduce(join).unwrap_or_default()
        };
        reach.deltas = data.morph.iter().map(delta_bounds).collect();
        reach
    }

    /// A box around the primitive in this pose, mesh space. It never is too small: a skinned vertex lies between
    /// the places where its joints alone would put it. It may be too large.
    pub fn posed(&self, pose: &DeformPose, primitive: &Primitive) -> Option<Bounds> {
        let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
        for (delta, &weight) in self.deltas.iter().zip(&pose.weights) {
            let (a, b) = (delta.0 * f64::from(weight), delta.1 * f64::from(weight));
            low += a.min(b);
            high += a.max(b);
        }
        let morphed = |bounds: Bounds| (bounds.0 + low, bounds.1 + high);
        let bent = match pose.joint_matrices.is_empty() {
            true => self.all.map(morphed),
            false => {
                let place = |(joint, bounds): (&Option<u16>, &Bounds)| {
                    let matrix = joint.and_then(|joint| pose.joint_matrices.get(joint as usize));
                    let bounds = morphed(*bounds);
                    matrix.map_or(bounds, |matrix| moved(matrix, bounds))
                };
                self.held.iter().map(place).reduce(join)
            }
        };
        bent.map(|bounds| moved(&primitive.mesh_from_primitive, bounds))
    }
}

/// The joints that hold a vertex; `None` alone where there are none.
fn holders(data: &MeshData, vertex: usize) -> impl Iterator<Item = Option<u16>> {
    let entry =
        data.skin.as_ref().and_then(|skin| Some((skin.joints.get(vertex)?, skin.weights.get(vertex)?)));
    let (joints, weights) = entry.map_or(([0; 4], [0.0; 4]), |(joints, weights)| (*joints, *weights));
    let free = weights == [0.0; 4];
    let held = joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
    held.map(|(joint, _)| Some(joint)).chain(free.then_some(None))
}
