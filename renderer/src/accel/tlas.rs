//! The top-level structure: a small record a slot on the device, from which a compute pass writes the descriptors in
//! place. Refitted when only transforms moved, built anew when the count, an active state or the quality demands it. Hidden
//! instances have mask 0, degenerate ones a null reference.

use std::sync::Arc;

use caustica_gpu::{
    AccelBuild, AccelGeometry, AccelStructure, Access, Buffer, BufferUse, BuildMode, BuildPreference, Device,
    Frames, Location, MemoryUse, Recorder, ResourceId, SceneSet, Stage, TlasInstances, Use,
};
use glam::{DVec3, Vec3};

use super::blas::BlasTable;
use super::build::Scratch;
use super::order::{Displacement, Places};
use super::policy::{AccelPolicy, SORTED_SLOTS};
use crate::delta::Visibility;
use crate::error::{RendererError, Result};
use crate::gpu_types::{MASK_CAMERA, MASK_INDIRECT, MASK_SHADOWS, RAY_SHAPES, Rows, TLAS_NO_BLAS, TlasSlot};
use crate::measure::TlasWork;
use crate::passes::InstanceDescriptors;
use crate::tables::{Slot, Table, Tables, shows_both_sides};

/// VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR.
const CULL_DISABLE: u32 = 1;
/// Bytes of one VkAccelerationStructureInstanceKHR.
const DESCRIPTOR_BYTES: u64 = 64;

/// Numbers of the groups in the barrier tracker.
#[derive(Clone, Copy)]
pub(crate) struct Groups {
    pub(crate) blas: ResourceId,
    pub(crate) tlas: ResourceId,
    /// Records, addresses and descriptors.
    pub(crate) descriptors: ResourceId,
}

/// What of the descriptors is to be written anew, and why the tree may have to be built.
#[derive(Debug, Default)]
pub(crate) struct Dirty {
    /// Slots to be looked at.
    pub(crate) slots: Vec<u32>,
    /// Slots that are used for something else than before.
    pub(crate) reused: u32,
    /// Structures were swapped: every descriptor is written anew, though no record changed.
    pub(crate) addresses: bool,
    /// A BLAS changed in place: boxes are others.
    pub(crate) bounds: bool,
}

impl Dirty {
    pub(crate) fn is_empty(&self) -> bool {
        self.slots.is_empty() && !self.addresses && !self.bounds
    }
}

/// The TLAS and its descriptors.
pub(crate) struct Tlas {
    device: Arc<Device>,
    records: Table<TlasSlot>,
    places: Places,
    displacement: Displacement,
    descriptors: Option<Buffer>,
    structure: Option<AccelStructure>,
    /// By slot: the reference is not null.
    active: Vec<bool>,
    /// An active state changed since the last build.
    activity_changed: bool,
    built_count: u32,
    /// Frames whose set 0 names an older structure.
    stale: Vec<bool>,
}

impl Tlas {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            device: Arc::clone(device),
            records: Table::new(device, "instance records"),
            places: Places::default(),
            displacement: Displacement::default(),
            descriptors: None,
            structure: None,
            active: Vec::new(),
            activity_changed: false,
            built_count: 0,
            stale: vec![true; Frames::in_flight()],
        }
    }

    /// Number of slots at the last build.
    pub(crate) fn built_count(&self) -> u32 {
        self.built_count
    }

    pub(crate) fn exists(&self) -> bool {
        self.structure.is_some()
    }

    /// Brings records, descriptors and the tree up to date.
    #[expect(clippy::too_many_arguments, reason = "each is another part of the scene")]
    pub(crate) fn update(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        blases: &mut BlasTable,
        mut dirty: Dirty,
        policy: &AccelPolicy,
        pass: &InstanceDescriptors,
        scratch: &mut Scratch,
        groups: Groups,
    ) -> Result<TlasWork> {
        let count = tables.instances.slot_count();
        let limit = self.device.limits().max_instances;
        if u64::from(count) > limit {
            let what = String::from("instances");
            return Err(RendererError::Limit { what, asked: u64::from(count), limit });
        }
        self.places.follow(count, dirty.reused);
        self.active.resize(count as usize, false);
        for slot in &dirty.slots {
            self.follow_displacement(*slot, tables);
        }
        let loose = self.displacement.demands_build(tables.instances.len());
        // Sorted places are those of another tree, and what has taken a slot does not stand where its last owner stood.
        let sorts = self.places.wants_sorting() || (loose && (count <= SORTED_SLOTS || !policy.refit));
        let rebuild = sorts || dirty.reused > 0 || loose || !policy.refit_tlas;
        if sorts {
            self.sort(tables);
            dirty.slots = (0..count).collect();
        }
        for slot in &dirty.slots {
            self.describe(*slot, tables, blases);
        }
        let grown = self.make_descriptors(count)?;
        self.write_descriptors(recorder, tables, blases, pass, &dirty, grown, groups)?;
        let rebuild = rebuild || !self.exists() || self.activity_changed || count != self.built_count;
        recorder.pass("accel.tlas", |recorder| self.build(recorder, count, rebuild, scratch, groups))?;
        Ok(if rebuild { TlasWork::Built } else { TlasWork::Refit })
    }

    fn follow_displacement(&mut self, slot: u32, tables: &Tables) {
        let Some(entry) = tables.instances.get(slot) else { return };
        let Ok(mesh) = tables.meshes.get(entry.instance.mesh) else { return };
        let now = Vec3::from(entry.instance.render_from_mesh.transform_point3a(mesh.centre.into()));
        match tables.instances.previous_transform(slot) {
            Some(rows) if !entry.degenerate => {
                self.displacement.note(slot, transform_point(rows, mesh.centre), now);
            }
            _ => self.displacement.reach(now),
        }
    }

    /// Gives every slot a place near its neighbours in space.
    fn sort(&mut self, tables: &Tables) {
        let centre = |slot: u32| {
            let entry = tables.instances.get(slot)?;
            let mesh = tables.meshes.get(entry.instance.mesh).ok()?;
            Some(entry.instance.render_from_mesh.transform_point3(mesh.centre).as_dvec3())
        };
        let centres: Vec<DVec3> =
            (0..self.places.len()).map(|slot| centre(slot).unwrap_or(DVec3::NAN)).collect();
        self.places.sort(&centres);
        self.displacement.enclose(&centres);
    }

    /// Brings the record of one slot up to date.
    fn describe(&mut self, slot: u32, tables: &Tables, blases: &BlasTable) {
        let record = record_of(slot, self.places.of(slot), tables, blases);
        let active = record.blas != TLAS_NO_BLAS;
        if self.records.get(slot as usize) != Some(&record) {
            self.records.set(slot as usize, record);
        }
        self.activity_changed |= std::mem::replace(&mut self.active[slot as usize], active) != active;
    }

    /// Makes room for the descriptors. True: nothing is written there yet.
    fn make_descriptors(&mut self, count: u32) -> Result<bool> {
        let needed = u64::from(count.max(1)) * DESCRIPTOR_BYTES;
        if self.descriptors.as_ref().is_some_and(|buffer| buffer.size() >= needed) {
            return Ok(false);
        }
        let (usage, kind) = (BufferUse::Geometry, MemoryUse::AccelerationStructures);
        let size = needed.next_power_of_two();
        let buffer = Buffer::new(&self.device, "instance descriptors", size, usage, Location::Device, kind)?;
        self.descriptors = Some(buffer);
        Ok(true)
    }

    #[expect(clippy::too_many_arguments, reason = "each is another part of the scene")]
    fn write_descriptors(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        blases: &mut BlasTable,
        pass: &InstanceDescriptors,
        dirty: &Dirty,
        grown: bool,
        groups: Groups,
    ) -> Result<()> {
        if self.records.is_dirty() || blases.is_dirty() {
            recorder.declare(&[Use::Group(groups.descriptors, Stage::Transfer, Access::TransferWrite)]);
            self.records.flush(recorder)?;
            blases.flush(recorder)?;
        }
        let count = self.places.len();
        let all = grown || dirty.addresses || dirty.slots.len() as u32 >= count;
        if count == 0 || (!all && dirty.slots.is_empty()) {
            return Ok(());
        }
        let mut uses = tables.uses(Stage::Compute).to_vec();
        uses.push(Use::Group(groups.descriptors, Stage::Compute, Access::StorageReadWrite));
        let addresses = crate::passes::DescriptorAddresses {
            instances: tables.instances.address(),
            slots: self.records.address(),
            blases: blases.address(),
            descriptors: self.descriptors.as_ref().map_or(0, Buffer::address),
        };
        let listed = if all { None } else { Some(dirty.slots.as_slice()) };
        pass.record(recorder, &addresses, listed, count, &uses)
    }

    fn build(
        &mut self,
        recorder: &mut Recorder,
        count: u32,
        rebuild: bool,
        scratch: &mut Scratch,
        groups: Groups,
    ) -> Result<()> {
        let descriptors = self.descriptors.as_ref().map_or(0, Buffer::address);
        let geometry = AccelGeometry::Instances(TlasInstances { descriptors, count });
        let sizes = self.device.build_sizes(geometry, BuildPreference::FastTrace);
        let structure = match &mut self.structure {
            Some(structure) if structure.size() >= sizes.structure => structure,
            slot => {
                // Room to grow, so that adding an instance does not make a new structure every time.
                let size = sizes.structure + sizes.structure / 2;
                self.stale.fill(true);
                slot.insert(AccelStructure::new(&self.device, "tlas", size, true)?)
            }
        };
        let size = if rebuild { sizes.build_scratch } else { sizes.refit_scratch };
        let build = AccelBuild {
            target: structure,
            geometry,
            preference: BuildPreference::FastTrace,
            mode: if rebuild { BuildMode::Build } else { BuildMode::Refit },
            scratch: scratch.reserve(size)?,
        };
        let uses = [
            Use::Group(groups.descriptors, Stage::AccelBuild, Access::BuildInput),
            Use::Group(groups.blas, Stage::AccelBuild, Access::AccelRead),
            Use::Group(groups.tlas, Stage::AccelBuild, Access::AccelWrite),
            scratch.used(),
        ];
        recorder.build(&[build], &uses);
        if rebuild {
            self.built_count = count;
            self.activity_changed = false;
            self.displacement.reset();
        }
        Ok(())
    }

    /// Puts the structure into the set of a frame that is free to record.
    pub(crate) fn update_set(&mut self, frame_slot: usize, set: &SceneSet) {
        let index = frame_slot % self.stale.len();
        if let Some(structure) = self.structure.as_ref().filter(|_| self.stale[index]) {
            set.set_tlas(structure);
            self.stale[index] = false;
        }
    }

    /// Where the descriptor of a slot stands.
    pub(crate) fn place_of(&self, slot: u32) -> u32 {
        self.places.of(slot)
    }

    /// The descriptors on the device.
    pub(crate) fn descriptors(&self) -> Option<&Buffer> {
        self.descriptors.as_ref()
    }
}

fn record_of(slot: u32, place: u32, tables: &Tables, blases: &BlasTable) -> TlasSlot {
    let Some(entry) = tables.instances.get(slot).filter(|entry| !entry.degenerate) else {
        return TlasSlot { blas: TLAS_NO_BLAS, mask_flags: 0, place };
    };
    let built =
        blases.number_of(slot).filter(|number| blases.get(*number).is_some_and(|blas| blas.built.is_some()));
    // Facing is judged in object space, where glTF's front is Vulkan's without the flip flag.
    let flags = if has_both_sides(entry, tables) { CULL_DISABLE } else { 0 };
    let shapes = tables.meshes.get(entry.instance.mesh).is_ok_and(|mesh| mesh.shapes.is_some());
    let hit_groups = if shapes { RAY_SHAPES } else { 0 };
    let mask_flags = mask_of(entry.instance.visibility) | flags << 8 | hit_groups << 16;
    TlasSlot { blas: built.unwrap_or(TLAS_NO_BLAS), mask_flags, place }
}

/// Whether the camera may see back faces of the instance, or a primitive is turned over, so that rays must not cull.
fn has_both_sides(entry: &Slot, tables: &Tables) -> bool {
    let Ok(mesh) = tables.meshes.get(entry.instance.mesh) else { return true };
    entry.instance.materials.iter().zip(&mesh.host.geometries).any(|(id, geometry)| {
        geometry.mesh_from_primitive.matrix3.determinant() < 0.0
            || tables.materials.get(*id).is_some_and(shows_both_sides)
    })
}

/// Which rays meet an instance.
fn mask_of(visibility: Visibility) -> u32 {
    let Visibility { shown, to_camera, to_shadows } = visibility;
    let bits = [(true, MASK_INDIRECT), (to_camera, MASK_CAMERA), (to_shadows, MASK_SHADOWS)];
    bits.iter().filter(|(set, _)| shown && *set).fold(0, |mask, (_, bit)| mask | bit)
}

fn transform_point(rows: &Rows, point: Vec3) -> Vec3 {
    let [x, y, z] = rows.map(|[a, b, c, d]| glam::Vec4::new(a, b, c, d).dot(point.extend(1.0)));
    Vec3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;

    #[test]
    fn masks_say_which_rays_meet_an_instance() {
        let all = Visibility::default();
        assert_eq!(mask_of(all), MASK_CAMERA | MASK_SHADOWS | MASK_INDIRECT);
        assert_eq!(mask_of(Visibility { shown: false, ..all }), 0);
        assert_eq!(mask_of(Visibility { to_camera: false, ..all }), MASK_SHADOWS | MASK_INDIRECT);
        assert_eq!(mask_of(Visibility { to_shadows: false, ..all }), MASK_CAMERA | MASK_INDIRECT);
    }

    #[test]
    fn rows_move_points_as_the_map_does() {
        let map = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.0, 2.0, -3.0),
            glam::Quat::from_rotation_y(0.7),
            Vec3::new(4.0, 5.0, 6.0),
        );
        let point = Vec3::new(0.3, -0.2, 0.9);
        let moved = transform_point(&crate::tables::rows_of(&map), point);
        assert!((moved - map.transform_point3(point)).length() < 1e-5);
    }
}
