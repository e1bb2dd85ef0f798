//! Instances whose mesh deforms: each has vertices of its own. Enters: instances, poses, primitives that move. Leaves:
//! vertices and geometry records on the device, those of the last frame among them, and which instances changed shape.
//! Only what has a new pose is evaluated, only joint matrices and weights are uploaded for it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bytemuck::Zeroable;
use caustica_gpu::{
    Access, Buffer, BufferUse, Device, Location, MemoryUse, Recorder, ResourceId, Stage, TriangleGeometry,
    Use,
};
use glam::Affine3A;

use super::deformation::DeformationBuffers;
use super::meshes::{GpuMesh, MeshBuffers, Meshes, TRANSFORM_OFFSET, rows_of};
use crate::delta::{Instance, InstanceId, MeshId, Pose};
use crate::error::Result;
use crate::gpu_types::{DeformJob, GEOMETRY_MOVED, GEOMETRY_MOVING, Geometry, VertexAttributes};
use crate::passes::Deform;

/// All instances whose mesh deforms, by id.
pub(crate) struct Deforming {
    device: Arc<Device>,
    by_id: BTreeMap<InstanceId, DeformingMesh>,
    /// Those to be evaluated, or with records that differ from those on the device.
    dirty: BTreeSet<InstanceId>,
    /// Those that changed shape in the last frame.
    moved_last_frame: BTreeSet<InstanceId>,
}

/// The vertices of one instance.
pub(crate) struct DeformingMesh {
    mesh: MeshId,
    /// Of the mesh that they were made from.
    content: ResourceId,
    deformation: Arc<DeformationBuffers>,
    rest_positions: u64,
    rest_attributes: u64,
    vertex_count: u32,
    /// `None`: at rest.
    pose: Option<Pose>,
    /// As posed, primitive space.
    pub(crate) positions: Buffer,
    previous_positions: Buffer,
    attributes: Buffer,
    /// Geometry records on the device.
    pub(crate) geometries: Buffer,
    records: Vec<Geometry>,
    /// What was uploaded of the records.
    uploaded: Vec<Geometry>,
    state: State,
    /// A primitive has moved since the last `record`.
    reshaped: bool,
}

/// How far the vertices are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Never evaluated: there is no last frame to remember.
    New,
    /// Of another pose.
    Stale,
    /// As the pose says.
    Posed,
}

impl Deforming {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            device: Arc::clone(device),
            by_id: BTreeMap::new(),
            dirty: BTreeSet::new(),
            moved_last_frame: BTreeSet::new(),
        }
    }

    /// Adds an instance or takes its new mesh or pose over; nothing happens to one that stays as it was. An instance whose
    /// mesh is rigid is forgotten. It is evaluated by the next [`Self::record`].
    ///
    /// # Errors
    /// When the mesh is unknown, the pose is not of this mesh or not finite, or memory runs out.
    pub(crate) fn set(&mut self, id: InstanceId, instance: &Instance, meshes: &Meshes) -> Result<()> {
        let mesh = meshes.get(instance.mesh)?;
        let Some(deformation) = &mesh.deformation else {
            self.remove(id);
            return Ok(());
        };
        if let Some(pose) = &instance.pose {
            deformation.check_pose(pose)?;
        }
        if self.by_id.get(&id).is_some_and(|known| known.content == mesh.content()) {
            self.take_pose(id, instance.pose.as_ref());
            return Ok(());
        }
        let new = DeformingMesh::new(&self.device, instance.mesh, mesh, deformation, instance.pose.clone())?;
        self.insert(id, new);
        Ok(())
    }

    /// Whether an instance is in this pose already.
    pub(crate) fn is_in_pose(&self, id: InstanceId, pose: &Pose) -> bool {
        self.by_id.get(&id).is_some_and(|known| known.pose.as_ref() == Some(pose))
    }

    /// Takes a new pose over. False: the instance does not deform.
    ///
    /// # Errors
    /// When the pose is not of its mesh or not finite.
    pub(crate) fn set_pose(&mut self, id: InstanceId, pose: &Pose) -> Result<bool> {
        let Some(known) = self.by_id.get(&id) else { return Ok(false) };
        known.deformation.check_pose(pose)?;
        self.take_pose(id, Some(pose));
        Ok(true)
    }

    /// A primitive of a mesh moved: so it does in all its instances.
    pub(crate) fn set_primitive(&mut self, mesh: MeshId, geometry: u32, mesh_from_primitive: &Affine3A) {
        for (id, known) in self.by_id.iter_mut().filter(|(_, known)| known.mesh == mesh) {
            let has_past = known.state != State::New;
            let Some(record) = known.records.get_mut(geometry as usize) else { continue };
            move_primitive(record, mesh_from_primitive, has_past);
            known.reshaped = true;
            self.dirty.insert(*id);
        }
    }

    /// The mesh of an instance has new content: its vertices are made anew, or it begins or ceases to deform. A pose that
    /// does not fit the new content is dropped: the instance then rests until the next one.
    ///
    /// # Errors
    /// When the mesh is unknown, or memory runs out.
    pub(crate) fn follow_mesh(&mut self, id: InstanceId, instance: &Instance, meshes: &Meshes) -> Result<()> {
        let mesh = meshes.get(instance.mesh)?;
        let Some(deformation) = &mesh.deformation else {
            self.remove(id);
            return Ok(());
        };
        let known = self.by_id.get(&id);
        if known.is_some_and(|known| known.content == mesh.content()) {
            return Ok(());
        }
        let pose = known.map_or(&instance.pose, |known| &known.pose).clone();
        let pose = pose.filter(|pose| deformation.check_pose(pose).is_ok());
        let new = DeformingMesh::new(&self.device, instance.mesh, mesh, deformation, pose)?;
        self.insert(id, new);
        Ok(())
    }

    pub(crate) fn remove(&mut self, id: InstanceId) {
        self.by_id.remove(&id);
        self.dirty.remove(&id);
        self.moved_last_frame.remove(&id);
    }

    /// The vertices of an instance; `None`: it shares those of its mesh.
    pub(crate) fn get(&self, id: InstanceId) -> Option<&DeformingMesh> {
        self.by_id.get(&id)
    }

    /// All instances that deform, in order of id.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (InstanceId, &DeformingMesh)> {
        self.by_id.iter().map(|(id, deforming)| (*id, deforming))
    }

    /// A frame has gone by: what changed shape in it has its present shape as its previous one.
    pub(crate) fn settle(&mut self) {
        for id in std::mem::take(&mut self.moved_last_frame) {
            if let Some(known) = self.by_id.get_mut(&id) {
                known.records.iter_mut().for_each(come_to_rest);
                self.dirty.insert(id);
            }
        }
    }

    /// Evaluates what has a new pose and uploads the records that changed. `geometry`: stands for all vertices in the
    /// barrier tracker. Returns the instances that changed shape: their BLAS is to be refitted, or built if there is none.
    ///
    /// # Errors
    /// When memory runs out; then the next call does it all again.
    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder,
        pass: &Deform,
        geometry: ResourceId,
    ) -> Result<Vec<InstanceId>> {
        let mut jobs = Vec::new();
        let mut changed = Vec::new();
        for id in &self.dirty {
            let Some(known) = self.by_id.get_mut(id) else { continue };
            if known.state != State::Posed {
                jobs.push(known.job(recorder)?);
            }
            if known.state == State::Stale {
                let previous = known.previous_positions.address();
                known.records.iter_mut().for_each(|record| begin_to_move(record, previous));
            }
            if known.state != State::Posed || known.reshaped {
                changed.push(*id);
            }
        }
        self.upload_records(recorder, geometry)?;
        pass.record(recorder, &jobs, geometry)?;
        self.moved_last_frame.extend(&changed);
        for id in std::mem::take(&mut self.dirty) {
            if let Some(known) = self.by_id.get_mut(&id) {
                known.state = State::Posed;
                known.reshaped = false;
            }
        }
        Ok(changed)
    }

    fn insert(&mut self, id: InstanceId, new: DeformingMesh) {
        self.moved_last_frame.remove(&id);
        self.by_id.insert(id, new);
        self.dirty.insert(id);
    }

    fn take_pose(&mut self, id: InstanceId, pose: Option<&Pose>) {
        let Some(known) = self.by_id.get_mut(&id) else { return };
        if known.pose.as_ref() == pose {
            return;
        }
        known.pose = pose.cloned();
        if known.state == State::Posed {
            known.state = State::Stale;
        }
        self.dirty.insert(id);
    }

    fn upload_records(&mut self, recorder: &mut Recorder, geometry: ResourceId) -> Result<()> {
        let mut declared = false;
        for id in &self.dirty {
            let Some(known) = self.by_id.get_mut(id).filter(|known| known.records != known.uploaded) else {
                continue;
            };
            if !declared {
                recorder.declare(&[Use::Group(geometry, Stage::Transfer, Access::TransferWrite)]);
                declared = true;
            }
            recorder.upload(&known.geometries, 0, bytemuck::cast_slice(&known.records))?;
            known.uploaded.clone_from(&known.records);
        }
        Ok(())
    }
}

impl DeformingMesh {
    fn new(
        device: &Arc<Device>,
        id: MeshId,
        mesh: &GpuMesh,
        deformation: &Arc<DeformationBuffers>,
        pose: Option<Pose>,
    ) -> Result<Self> {
        let vertices = mesh.host.positions.len();
        let make = |what: &str, bytes: usize| {
            let name = format!("{} posed {what}", mesh.host.name);
            let (usage, kind) = (BufferUse::Geometry, MemoryUse::Geometry);
            Buffer::new(device, &name, bytes as u64, usage, Location::Device, kind)
        };
        let positions = make("positions", vertices * 12)?;
        let attributes = make("attributes", vertices * size_of::<VertexAttributes>())?;
        let ranges = mesh.host.geometries.iter();
        let records: Vec<Geometry> = ranges
            .map(|range| Geometry {
                positions: positions.address(),
                previous_positions: positions.address(),
                attributes: attributes.address(),
                indices: mesh.vertices.indices.address() + u64::from(range.first_index) * 4,
                triangle_count: range.index_count / 3,
                flags: moved_flag(&range.mesh_from_primitive),
                mesh_from_primitive: rows_of(&range.mesh_from_primitive),
                previous_mesh_from_primitive: rows_of(&range.mesh_from_primitive),
                ..Zeroable::zeroed()
            })
            .collect();
        Ok(Self {
            mesh: id,
            content: mesh.content(),
            deformation: Arc::clone(deformation),
            rest_positions: mesh.positions_address(),
            rest_attributes: mesh.attributes_address(),
            vertex_count: vertices as u32,
            pose,
            previous_positions: make("previous positions", vertices * 12)?,
            geometries: make("geometries", size_of_val(records.as_slice()))?,
            positions,
            attributes,
            records,
            uploaded: Vec::new(),
            state: State::New,
            reshaped: false,
        })
    }

    /// Address of the geometry records.
    pub(crate) fn geometries_address(&self) -> u64 {
        self.geometries.address()
    }

    /// Its buffers, to be read back.
    pub(crate) fn buffers(&self) -> MeshBuffers<'_> {
        MeshBuffers { vertices: vec![&self.positions, &self.attributes], geometries: &self.geometries }
    }

    /// Input of a BLAS build for geometry `index`.
    pub(crate) fn triangles(&self, index: usize, opaque: bool) -> TriangleGeometry {
        let record = &self.records[index];
        TriangleGeometry {
            positions: self.positions.address(),
            vertex_count: self.vertex_count,
            indices: record.indices,
            triangle_count: record.triangle_count,
            transform: self.geometries.address() + (index * size_of::<Geometry>()) as u64 + TRANSFORM_OFFSET,
            opaque,
        }
    }

    /// What the pass is to do for the present pose.
    fn job(&self, recorder: &mut Recorder) -> Result<DeformJob> {
        let has_past = self.state != State::New;
        let mut job = DeformJob {
            rest_positions: self.rest_positions,
            rest_attributes: self.rest_attributes,
            positions: self.positions.address(),
            previous_positions: if has_past { self.previous_positions.address() } else { 0 },
            attributes: self.attributes.address(),
            vertex_count: self.vertex_count,
            ..Zeroable::zeroed()
        };
        if let Some(pose) = &self.pose {
            self.deformation.stage(recorder, pose, &mut job)?;
        }
        Ok(job)
    }
}

fn moved_flag(mesh_from_primitive: &Affine3A) -> u32 {
    if *mesh_from_primitive == Affine3A::IDENTITY { 0 } else { GEOMETRY_MOVED }
}

/// Places a primitive elsewhere; where it was stays known until the frame has gone by.
fn move_primitive(record: &mut Geometry, mesh_from_primitive: &Affine3A, has_past: bool) {
    record.mesh_from_primitive = rows_of(mesh_from_primitive);
    if has_past {
        record.flags |= GEOMETRY_MOVED | GEOMETRY_MOVING;
    } else {
        record.previous_mesh_from_primitive = record.mesh_from_primitive;
        record.flags = moved_flag(mesh_from_primitive);
    }
}

/// The vertices are evaluated anew; the pass leaves those of the last frame at `previous_positions`.
fn begin_to_move(record: &mut Geometry, previous_positions: u64) {
    record.previous_positions = previous_positions;
    record.flags |= GEOMETRY_MOVING;
}

/// The past is as the present.
fn come_to_rest(record: &mut Geometry) {
    record.previous_positions = record.positions;
    record.previous_mesh_from_primitive = record.mesh_from_primitive;
    let identity = rows_of(&Affine3A::IDENTITY);
    record.flags = if record.mesh_from_primitive == identity { 0 } else { GEOMETRY_MOVED };
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn record() -> Geometry {
        let identity = rows_of(&Affine3A::IDENTITY);
        Geometry {
            positions: 64,
            previous_positions: 64,
            mesh_from_primitive: identity,
            previous_mesh_from_primitive: identity,
            ..Zeroable::zeroed()
        }
    }

    #[test]
    fn what_is_posed_anew_remembers_one_frame() {
        let mut moved = record();
        begin_to_move(&mut moved, 128);
        assert_eq!((moved.positions, moved.previous_positions, moved.flags), (64, 128, GEOMETRY_MOVING));
        come_to_rest(&mut moved);
        assert_eq!(moved, record());
    }

    #[test]
    fn a_primitive_that_moved_remembers_where_it_was() {
        let there = Affine3A::from_translation(Vec3::X);
        let mut moved = record();
        move_primitive(&mut moved, &there, true);
        move_primitive(&mut moved, &Affine3A::from_translation(Vec3::Y), true);
        move_primitive(&mut moved, &there, true);
        assert_eq!(moved.flags, GEOMETRY_MOVED | GEOMETRY_MOVING);
        assert_eq!(moved.mesh_from_primitive, rows_of(&there));
        assert_eq!(moved.previous_mesh_from_primitive, record().mesh_from_primitive);
        come_to_rest(&mut moved);
        assert_eq!(moved.flags, GEOMETRY_MOVED);
        assert_eq!(moved.previous_mesh_from_primitive, rows_of(&there));
        move_primitive(&mut moved, &Affine3A::IDENTITY, true);
        assert_eq!(
            moved.flags,
            GEOMETRY_MOVED | GEOMETRY_MOVING,
            "it was not at the identity in the last frame"
        );
        come_to_rest(&mut moved);
        assert_eq!(moved, record());
    }

    #[test]
    fn what_was_never_drawn_has_no_past() {
        let there = Affine3A::from_translation(Vec3::X);
        let mut moved = record();
        move_primitive(&mut moved, &there, false);
        assert_eq!(moved.flags, GEOMETRY_MOVED);
        assert_eq!(moved.previous_mesh_from_primitive, rows_of(&there));
    }
}
