//! The top-level structure: one descriptor an instance slot, in spatial order at the last build. Refitted when only transforms moved, built anew when the
//! count or an active state changed. Hidden instances have mask 0, degenerate ones a null reference.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use caustica_gpu::{
    AccelBuild, AccelGeometry, AccelStructure, Access, BuildMode, BuildPreference, Device, Frames, Recorder,
    ResourceId, SceneSet, Stage, TlasInstances, Use, pack_instance,
};

use glam::DVec3;

use super::blas::{BlasKey, Scratch};
use crate::delta::Visibility;
use crate::error::{RendererError, Result};
use crate::gpu_types::{MASK_CAMERA, MASK_INDIRECT, MASK_SHADOWS};
use crate::measure::TlasWork;
use crate::tables::{Changed, Slot, Table, Tables};

/// VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR.
const CULL_DISABLE: u8 = 1;

/// One VkAccelerationStructureInstanceKHR.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq)]
#[repr(C)]
struct Descriptor([u8; 64]);

/// Numbers of the two groups in the barrier tracker.
#[derive(Clone, Copy)]
pub(crate) struct Groups {
    pub(crate) blas: ResourceId,
    pub(crate) tlas: ResourceId,
}

/// The TLAS and its descriptors.
pub(crate) struct Tlas {
    device: Arc<Device>,
    descriptors: Table<Descriptor>,
    /// Where the descriptor of each slot stands.
    place_of_slot: Vec<u32>,
    /// Stands for the descriptors in the barrier tracker.
    descriptor_group: ResourceId,
    structure: Option<AccelStructure>,
    /// Active slots (reference not null) at the last build.
    active: BTreeMap<u32, bool>,
    built_count: u32,
    stale: Vec<bool>,
}

impl Tlas {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            device: Arc::clone(device),
            descriptors: Table::new(device, "instance descriptors"),
            place_of_slot: Vec::new(),
            descriptor_group: device.new_resource_id(),
            structure: None,
            active: BTreeMap::new(),
            built_count: 0,
            stale: vec![true; Frames::in_flight()],
        }
    }

    pub(crate) fn exists(&self) -> bool {
        self.structure.is_some()
    }

    /// Writes the descriptors that changed and builds or refits.
    pub(crate) fn update(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        changed: &Changed,
        blas_of: impl Fn(&BlasKey) -> u64,
        scratch: &mut Scratch,
        groups: Groups,
    ) -> Result<TlasWork> {
        let mut activity_changed = false;
        if changed.structure {
            let count = tables.instances.slot_count();
            self.place_slots(count, tables);
            for slot in 0..count {
                activity_changed |= self.describe(slot, tables, &blas_of);
            }
        } else {
            for &slot in &changed.moved {
                activity_changed |= self.describe(slot, tables, &blas_of);
            }
        }
        let count = self.descriptors.len() as u32;
        let limit = self.device.limits().max_instances;
        if u64::from(count) > limit {
            return Err(RendererError::Limit {
                what: String::from("instances"),
                asked: u64::from(count),
                limit,
            });
        }
        let rebuild = changed.structure || activity_changed || count != self.built_count || !self.exists();
        if self.descriptors.is_dirty() {
            recorder.declare(&[Use::Group(self.descriptor_group, Stage::Transfer, Access::TransferWrite)]);
            self.descriptors.flush(recorder)?;
        }
        recorder.pass("accel.tlas", |recorder| self.build(recorder, count, rebuild, scratch, groups))?;
        Ok(if rebuild { TlasWork::Built } else { TlasWork::Refit })
    }

    /// Gives every slot a place near its neighbours in space.
    fn place_slots(&mut self, count: u32, tables: &Tables) {
        let centre = |slot: u32| {
            let entry = tables.instances.get(slot)?;
            let mesh = tables.meshes.get(entry.instance.mesh).ok()?;
            Some(entry.instance.render_from_mesh.transform_point3(mesh.centre).as_dvec3())
        };
        let centres: Vec<DVec3> = (0..count).map(|slot| centre(slot).unwrap_or(DVec3::NAN)).collect();
        self.place_of_slot = vec![0; count as usize];
        for (place, slot) in crate::tables::order_of(&centres).into_iter().enumerate() {
            self.place_of_slot[slot as usize] = place as u32;
        }
    }

    /// Writes one descriptor; true when the slot became active or inactive.
    fn describe(&mut self, slot: u32, tables: &Tables, blas_of: &impl Fn(&BlasKey) -> u64) -> bool {
        let entry = tables.instances.get(slot);
        let descriptor =
            entry.map_or_else(Zeroable::zeroed, |entry| descriptor_of(slot, entry, tables, blas_of));
        let place = self.place_of_slot.get(slot as usize).copied().unwrap_or(slot) as usize;
        if self.descriptors.get(place) != Some(&descriptor) {
            self.descriptors.set(place, descriptor);
        }
        let active = descriptor.0[56..] != [0; 8];
        self.active.insert(slot, active) != Some(active)
    }

    fn build(
        &mut self,
        recorder: &mut Recorder,
        count: u32,
        rebuild: bool,
        scratch: &mut Scratch,
        groups: Groups,
    ) -> Result<()> {
        let instances = TlasInstances { descriptors: self.descriptors.address(), count };
        let geometry = AccelGeometry::Instances(instances);
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
            Use::Group(self.descriptor_group, Stage::AccelBuild, Access::BuildInput),
            Use::Group(groups.blas, Stage::AccelBuild, Access::AccelRead),
            Use::Group(groups.tlas, Stage::AccelBuild, Access::AccelWrite),
            scratch.used(),
        ];
        recorder.build(&[build], &uses);
        if rebuild {
            self.built_count = count;
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
}

/// Which rays meet an instance.
fn mask_of(visibility: Visibility) -> u8 {
    let Visibility { shown, to_camera, to_shadows } = visibility;
    let bits = [(true, MASK_INDIRECT), (to_camera, MASK_CAMERA), (to_shadows, MASK_SHADOWS)];
    bits.iter().filter(|(set, _)| shown && *set).fold(0, |mask, (_, bit)| mask | *bit as u8)
}

fn descriptor_of(slot: u32, entry: &Slot, tables: &Tables, blas_of: &impl Fn(&BlasKey) -> u64) -> Descriptor {
    let both_sides = entry.instance.materials.iter().enumerate().any(|(geometry, id)| {
        let turned = tables
            .meshes
            .get(entry.instance.mesh)
            .is_ok_and(|mesh| mesh.host.geometries[geometry].mesh_from_primitive.matrix3.determinant() < 0.0);
        turned || tables.materials.get(*id).is_some_and(crate::tables::shows_both_sides)
    });
    // Facing is judged in object space, where glTF's front is Vulkan's without the flip flag.
    let flags = if both_sides { CULL_DISABLE } else { 0 };
    let mask = mask_of(entry.instance.visibility);
    let blas = if entry.degenerate { 0 } else { blas_of(&BlasKey::of(entry, &tables.materials)) };
    // A NaN must not reach the device even in an inactive instance.
    let transform = if entry.degenerate { glam::Affine3A::IDENTITY } else { entry.instance.render_from_mesh };
    Descriptor(pack_instance(crate::tables::rows_of(&transform), slot, mask, flags, blas))
}
