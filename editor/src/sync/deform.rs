//! Skins and morph targets as the renderer wants them. Enters: meshes and poses of the document. Leaves: deformations
//! and poses of which the numbers agree, whichever skin bends the mesh.

use caustica_renderer::delta;
use caustica_scene::{self as scene, DeformPose};
use glam::{Affine3A, DAffine3, DVec3};

use super::convert::render_from;

/// What every pose of a mesh has as many of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Shape {
    /// One more than the last joint that a vertex names. Skins may have more: those bend nothing.
    joints: usize,
    targets: usize,
}

impl Shape {
    /// Costs the vertices of a mesh with joints.
    pub(super) fn of(mesh: &scene::Mesh) -> Self {
        let joints = mesh.data.skin.iter().flat_map(|skin| &skin.joints).flatten();
        Self { joints: joints.max().map_or(0, |last| usize::from(*last) + 1), targets: mesh.data.morph.len() }
    }

    /// Whether poses say anything.
    pub(super) fn deforms(self) -> bool {
        self.joints > 0 || self.targets > 0
    }

    /// A pose of the document; `None` for a mesh that is rigid. Joints that no skin moves stay where they are, and so
    /// does what is no finite number in single precision.
    pub(super) fn pose_of(self, pose: Option<DeformPose>) -> Option<delta::Pose> {
        let DeformPose { joint_matrices, mut weights } = pose.unwrap_or_default();
        let single = |instance_from_mesh: &DAffine3| {
            let matrix = render_from(instance_from_mesh, DVec3::ZERO);
            if matrix.is_finite() { matrix } else { Affine3A::IDENTITY }
        };
        let mut joints: Vec<Affine3A> = joint_matrices.iter().take(self.joints).map(single).collect();
        joints.resize(self.joints, Affine3A::IDENTITY);
        weights.resize(self.targets, 0.0);
        weights.iter_mut().filter(|weight| !weight.is_finite()).for_each(|weight| *weight = 0.0);
        self.deforms().then_some(delta::Pose { joints, weights })
    }
}

/// How the vertices of a mesh follow a pose; `None`: it is rigid.
pub(super) fn deformation_of(mesh: &scene::Mesh) -> Option<delta::Deformation> {
    let shape = Shape::of(mesh);
    let skin = mesh.data.skin.as_ref().filter(|_| shape.joints > 0);
    let target = |target: &scene::MorphTarget| delta::MorphTarget {
        positions: target.positions.clone(),
        normals: target.normals.clone(),
        tangents: target.tangents.clone(),
    };
    shape.deforms().then(|| delta::Deformation {
        joints: skin.map(|skin| skin.joints.clone()).unwrap_or_default(),
        weights: skin.map(|skin| skin.weights.clone()).unwrap_or_default(),
        joint_count: shape.joints as u32,
        targets: mesh.data.morph.iter().map(target).collect(),
    })
}
