//! How a mesh deforms, on the device: joints and weights of every vertex, offsets of every morph target. Enters: a
//! `Deformation`. Leaves: what pass `deform` reads of it, and the part of a job that a pose decides. Knows no instance.

use std::sync::Arc;

use bytemuck::Zeroable;
use caustica_gpu::{Buffer, BufferUse, Device, Location, MemoryUse, Recorder};
use glam::Vec3;

use super::meshes::rows_of;
use crate::delta::{Deformation, Mesh, MorphTarget, Pose};
use crate::error::{RendererError, Result};
use crate::gpu_types::{DeformJob, JointInfluences, MorphUse, Rows};

/// What a mesh that deforms has once, whatever the number of its instances.
pub(crate) struct DeformationBuffers {
    mesh_name: String,
    /// `JointInfluences` a vertex; `None`: no skin.
    influences: Option<Buffer>,
    joint_count: u32,
    targets: Vec<Target>,
}

/// One morph target: its lists one after the other in a buffer, and where each begins; 0: left out.
struct Target {
    _offsets: Option<Buffer>,
    addresses: [u64; 3],
}

impl DeformationBuffers {
    /// Uploads how `mesh` deforms; `None` for a rigid one.
    ///
    /// # Errors
    /// When lists have the wrong length or hold what is no number, or memory runs out.
    pub(crate) fn new(device: &Arc<Device>, recorder: &mut Recorder, mesh: &Mesh) -> Result<Option<Self>> {
        let Some(deformation) = &mesh.deformation else { return Ok(None) };
        check(deformation, mesh.positions.len())
            .map_err(|reason| RendererError::Deformation { mesh: mesh.name.clone(), reason })?;
        let make = |what: &str, bytes: usize| {
            let name = format!("{} {what}", mesh.name);
            let (usage, kind) = (BufferUse::General, MemoryUse::Geometry);
            Buffer::new(device, &name, bytes as u64, usage, Location::Device, kind)
        };
        let mut influences = None;
        if !deformation.joints.is_empty() {
            let pairs = deformation.joints.iter().zip(&deformation.weights);
            let list: Vec<JointInfluences> = pairs.map(|(j, w)| influences_of(*j, *w)).collect();
            let buffer = make("joints", size_of_val(list.as_slice()))?;
            recorder.upload(&buffer, 0, bytemuck::cast_slice(&list))?;
            influences = Some(buffer);
        }
        let mut targets = Vec::with_capacity(deformation.targets.len());
        for target in &deformation.targets {
            targets.push(Target::new(recorder, target, |bytes| make("morph target", bytes))?);
        }
        let (mesh_name, joint_count) = (mesh.name.clone(), deformation.joint_count);
        Ok(Some(Self { mesh_name, influences, joint_count, targets }))
    }

    /// Refuses a pose that is not of this mesh or holds what is no number.
    pub(crate) fn check_pose(&self, pose: &Pose) -> Result<()> {
        check_pose(pose, self.joint_count as usize, self.targets.len())
            .map_err(|reason| RendererError::Deformation { mesh: self.mesh_name.clone(), reason })
    }

    /// Stages a pose that was checked, and names it in a job.
    pub(crate) fn stage(&self, recorder: &mut Recorder, pose: &Pose, job: &mut DeformJob) -> Result<()> {
        if let Some(influences) = &self.influences {
            let joints: Vec<Rows> = pose.joints.iter().map(rows_of).collect();
            job.influences = influences.address();
            job.joints = recorder.stage_bytes(bytemuck::cast_slice(&joints))?;
        }
        let weighted = self.targets.iter().zip(&pose.weights).filter(|(_, weight)| **weight != 0.0);
        let active: Vec<MorphUse> = weighted
            .map(|(target, weight)| {
                let [positions, normals, tangents] = target.addresses;
                MorphUse { positions, normals, tangents, weight: *weight, pad0: 0 }
            })
            .collect();
        if !active.is_empty() {
            job.targets = recorder.stage_bytes(bytemuck::cast_slice(&active))?;
            job.target_count = active.len() as u32;
        }
        Ok(())
    }
}

impl Target {
    fn new(
        recorder: &mut Recorder,
        target: &MorphTarget,
        make: impl FnOnce(usize) -> std::result::Result<Buffer, caustica_gpu::GpuError>,
    ) -> Result<Self> {
        // Files often give offsets of zero for what a target leaves alone.
        let lists = [&target.positions, &target.normals, &target.tangents]
            .map(|list| if list.iter().all(|offset| *offset == Vec3::ZERO) { &[] } else { list.as_slice() });
        let bytes = lists.map(size_of_val);
        if bytes == [0; 3] {
            return Ok(Self { _offsets: None, addresses: [0; 3] });
        }
        let buffer = make(bytes.iter().sum())?;
        let mut addresses = [0; 3];
        let mut offset = 0;
        for (address, list) in addresses.iter_mut().zip(lists).filter(|(_, list)| !list.is_empty()) {
            *address = buffer.address() + offset;
            recorder.upload(&buffer, offset, bytemuck::cast_slice(list))?;
            offset += size_of_val(list) as u64;
        }
        Ok(Self { _offsets: Some(buffer), addresses })
    }
}

/// The influences of one vertex, the heaviest first, weights in sum 1. Equal ones in another order give the same, so that
/// corners that were split for their normals stay together to the bit.
fn influences_of(joints: [u16; 4], weights: [f32; 4]) -> JointInfluences {
    let sum: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
    if sum <= 0.0 {
        return JointInfluences::zeroed();
    }
    let mut pairs: [(u16, f32); 4] =
        std::array::from_fn(|i| (joints[i], (f64::from(weights[i]) / sum) as f32));
    pairs.sort_by(|(joint_a, a), (joint_b, b)| b.total_cmp(a).then(joint_a.cmp(joint_b)));
    // What has no weight names the heaviest joint: the difference of the two is then 0, whatever the pose.
    let joint = |i: usize| u32::from(if pairs[i].1 > 0.0 { pairs[i].0 } else { pairs[0].0 });
    JointInfluences {
        joints_01: joint(0) | joint(1) << 16,
        joints_23: joint(2) | joint(3) << 16,
        weights: pairs.map(|(_, weight)| weight),
    }
}

/// What is wrong with a deformation of `vertices` vertices, in words.
fn check(deformation: &Deformation, vertices: usize) -> std::result::Result<(), String> {
    let Deformation { joints, weights, joint_count, targets } = deformation;
    for (what, len) in [("joints", joints.len()), ("weights", weights.len())] {
        if len != 0 && len != vertices {
            return Err(format!("{len} {what} for {vertices} vertices"));
        }
    }
    if joints.len() != weights.len() {
        return Err(format!("{} vertices have joints, {} have weights", joints.len(), weights.len()));
    }
    if let Some(joint) = joints.iter().flatten().find(|joint| u32::from(**joint) >= *joint_count) {
        return Err(format!("joint {joint} is named, there are {joint_count}"));
    }
    if let Some(weight) = weights.iter().flatten().find(|weight| !(weight.is_finite() && **weight >= 0.0)) {
        return Err(format!("{weight} is no weight of a joint"));
    }
    for (i, target) in targets.iter().enumerate() {
        for (what, list) in
            [("positions", &target.positions), ("normals", &target.normals), ("tangents", &target.tangents)]
        {
            if !list.is_empty() && list.len() != vertices {
                return Err(format!("morph target {i} has {} {what} for {vertices} vertices", list.len()));
            }
            if let Some(offset) = list.iter().find(|offset| !offset.is_finite()) {
                return Err(format!("morph target {i} moves {what} by {offset}"));
            }
        }
    }
    Ok(())
}

/// What is wrong with a pose, in words.
fn check_pose(pose: &Pose, joint_count: usize, target_count: usize) -> std::result::Result<(), String> {
    for (what, found, expected) in
        [("joints", pose.joints.len(), joint_count), ("morph targets", pose.weights.len(), target_count)]
    {
        if found != expected {
            return Err(format!("the pose has {found} {what}, the mesh {expected}"));
        }
    }
    if let Some(joint) = pose.joints.iter().position(|map| !map.is_finite()) {
        return Err(format!("joint {joint} of the pose is not finite"));
    }
    if let Some(target) = pose.weights.iter().position(|weight| !weight.is_finite()) {
        return Err(format!("the weight of morph target {target} is not finite"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;

    fn joints_of(influences: &JointInfluences) -> [u32; 4] {
        let JointInfluences { joints_01, joints_23, .. } = *influences;
        [joints_01 & 0xffff, joints_01 >> 16, joints_23 & 0xffff, joints_23 >> 16]
    }

    #[test]
    fn influences_are_sorted_and_add_up_to_one() {
        let found = influences_of([7, 3, 9, 40000], [0.25, 1.0, 0.0, 0.75]);
        assert_eq!(joints_of(&found), [3, 40000, 7, 3]);
        assert_eq!(found.weights, [0.5, 0.375, 0.125, 0.0]);
        let turned = influences_of([40000, 9, 7, 3], [0.75, 0.0, 0.25, 1.0]);
        assert_eq!(found, turned);
        assert_eq!(
            influences_of([4, 2, 0, 0], [0.5, 0.5, 0.0, 0.0]),
            influences_of([2, 4, 1, 1], [0.5, 0.5, 0.0, 0.0])
        );
    }

    #[test]
    fn a_vertex_without_weights_follows_no_joint() {
        assert_eq!(influences_of([1, 2, 3, 4], [0.0; 4]), JointInfluences::zeroed());
    }

    #[test]
    fn wrong_deformations_are_refused_in_words() {
        let good = || Deformation {
            joints: vec![[0, 1, 0, 0]; 3],
            weights: vec![[0.5, 0.5, 0.0, 0.0]; 3],
            joint_count: 2,
            targets: vec![MorphTarget { positions: vec![Vec3::ONE; 3], ..MorphTarget::default() }],
        };
        assert_eq!(check(&good(), 3), Ok(()));
        assert_eq!(check(&Deformation::default(), 3), Ok(()));
        let refused = |change: fn(&mut Deformation), words: &str| {
            let mut bad = good();
            change(&mut bad);
            let reason = check(&bad, 3).err().unwrap_or_default();
            assert!(reason.contains(words), "'{reason}' does not say '{words}'");
        };
        refused(|d| d.joints.truncate(2), "2 joints for 3 vertices");
        refused(|d| d.weights.clear(), "0 have weights");
        refused(|d| d.joints[2][3] = 2, "joint 2 is named, there are 2");
        refused(|d| d.weights[1][0] = f32::NAN, "NaN is no weight");
        refused(|d| d.weights[1][0] = -0.5, "-0.5 is no weight");
        refused(|d| d.targets[0].tangents = vec![Vec3::X], "target 0 has 1 tangents");
        refused(|d| d.targets[0].positions[1].y = f32::INFINITY, "target 0 moves positions");
    }

    #[test]
    fn wrong_poses_are_refused_in_words() {
        let pose = |map: Affine3A, weight: f32| Pose { joints: vec![map; 2], weights: vec![weight] };
        assert_eq!(check_pose(&pose(Affine3A::ZERO, -3.0), 2, 1), Ok(()));
        let refused = |pose: Pose, words: &str| {
            let reason = check_pose(&pose, 2, 1).err().unwrap_or_default();
            assert!(reason.contains(words), "'{reason}' does not say '{words}'");
        };
        refused(Pose::default(), "0 joints, the mesh 2");
        refused(Pose { weights: vec![], ..pose(Affine3A::IDENTITY, 0.0) }, "0 morph targets, the mesh 1");
        refused(pose(Affine3A::from_translation(Vec3::NAN), 0.0), "joint 0 of the pose");
        refused(pose(Affine3A::IDENTITY, f32::INFINITY), "morph target 0");
    }
}
