//! Pass `instance_descriptors` against `pack_instance`, which the TLAS was built from before: the same bytes, whatever the
//! slot holds, and nothing but the slots that are dirty.

use std::f32::consts::PI;

use caustica_gpu::pack_instance;
use caustica_renderer::gpu_types::{
    Instance, InstanceDescriptor, InstanceDescriptorJob, Rows, TLAS_NO_BLAS, TlasSlot,
};
use caustica_tests::compute::bytes;
use caustica_tests::gpu::session;
use caustica_tests::numbers::Random;

use crate::table_pass::TablePass;

const COUNT: usize = 1000;
/// What stands in a descriptor that nothing has written.
const UNTOUCHED: u8 = 0xab;
const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Slots that hold all there is: sound ones, free ones, ones whose BLAS is not built, and numbers that are none.
struct Scene {
    instances: Vec<Instance>,
    slots: Vec<TlasSlot>,
    blases: Vec<u64>,
}

fn scene() -> Scene {
    let mut random = Random::new(31);
    let blases: Vec<u64> = (0..16).map(|i| if i % 5 == 4 { 0 } else { random.bits() }).collect();
    let mut places: Vec<u32> = (0..COUNT as u32).collect();
    for i in (1..COUNT).rev() {
        places.swap(i, random.bits() as usize % (i + 1));
    }
    let mut instances = Vec::new();
    let mut slots = Vec::new();
    for place in places {
        let mut instance: Instance = bytemuck::Zeroable::zeroed();
        for entry in instance.render_from_mesh.iter_mut().flatten() {
            *entry = (random.between(-1.0, 1.0) * random.magnitude(-20.0, 20.0)) as f32;
        }
        if random.unit() < 0.2 {
            let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -f32::NAN][random.bits() as usize % 4];
            instance.render_from_mesh[random.bits() as usize % 3][random.bits() as usize % 4] = bad;
        }
        // The neighbours of the transform must not count.
        instance.previous_render_from_mesh = [[PI, f32::NAN, 0.0, 1.0]; 3];
        let blas = if random.unit() < 0.2 { TLAS_NO_BLAS } else { random.bits() as u32 % 16 };
        instances.push(instance);
        slots.push(TlasSlot { blas, mask_flags: random.bits() as u32 & 0xff_ffff, place });
    }
    Scene { instances, slots, blases }
}

impl Scene {
    fn expected(&self, slot: usize) -> [u8; 64] {
        let TlasSlot { blas, mask_flags, .. } = self.slots[slot];
        let [mask, flags, hit_groups, _] = mask_flags.to_le_bytes();
        let rows = self.instances[slot].render_from_mesh;
        let address = if blas == TLAS_NO_BLAS { 0 } else { self.blases[blas as usize] };
        let sound = address != 0 && rows.iter().flatten().all(|entry| entry.is_finite());
        let (rows, address) = if sound { (rows, address) } else { (IDENTITY, 0) };
        let mut bytes = pack_instance(rows, slot as u32, mask, flags, address);
        bytes[52] = hit_groups;
        bytes
    }

    /// Runs the pass over these slots, or over the first `count`; the descriptors by place.
    fn describe(&self, dirty: Option<&[u32]>, count: u32, groups: u32) -> Vec<[u8; 64]> {
        let mut session = session();
        let before = vec![UNTOUCHED; COUNT * size_of::<InstanceDescriptor>()];
        let inputs =
            [bytes(&self.instances), bytes(&self.slots), bytes(&self.blases), bytes(dirty.unwrap_or(&[0]))];
        let pass = TablePass {
            file: "passes/instance_descriptors/instance_descriptors.comp",
            groups,
            inputs: &inputs,
            outputs: &[&before],
        };
        let outputs = pass.run(&mut session, |_, inputs, outputs| {
            let job = InstanceDescriptorJob {
                instances: inputs[0],
                slots: inputs[1],
                blases: inputs[2],
                descriptors: outputs[0],
                dirty: if dirty.is_some() { inputs[3] } else { 0 },
                count,
                pad0: 0,
            };
            bytes(&[job]).to_vec()
        });
        outputs[0].chunks_exact(64).map(|chunk| chunk.try_into().expect("64 bytes")).collect()
    }
}

#[test]
fn every_slot_is_described_as_the_host_would() {
    let scene = scene();
    let kinds = (0..COUNT).filter(|slot| scene.expected(*slot)[56..] == [0; 8]).count();
    assert!((COUNT / 4..COUNT * 3 / 4).contains(&kinds), "{kinds} of {COUNT} have no reference");
    // Enough groups, and too few, so that the shader goes on in steps.
    for groups in [COUNT.div_ceil(64) as u32, 2] {
        let found = scene.describe(None, COUNT as u32, groups);
        for slot in 0..COUNT {
            let place = scene.slots[slot].place as usize;
            assert_eq!(found[place], scene.expected(slot), "slot {slot} at {place}: {:?}", scene.slots[slot]);
        }
    }
}

#[test]
fn slots_that_are_not_dirty_are_left_alone() {
    let scene = scene();
    let dirty: Vec<u32> = (0..COUNT as u32).filter(|slot| slot % 7 == 3).collect();
    let found = scene.describe(Some(&dirty), dirty.len() as u32, 4);
    for slot in 0..COUNT {
        let expected = if slot % 7 == 3 { scene.expected(slot) } else { [UNTOUCHED; 64] };
        assert_eq!(found[scene.slots[slot].place as usize], expected, "slot {slot}");
    }
}
