//! Pass `instance_descriptors`: the instance descriptors of the TLAS, written on the device from the instance table, so that
//! moving an instance uploads its transform once. Enters: addresses and a list of slots. Leaves: descriptors in their places.

use std::sync::Arc;

use caustica_gpu::{ComputePipeline, Device, Recorder, Use};

use super::scene_compute;
use crate::error::Result;
use crate::gpu_types::{DescriptorJob, Push};
use crate::shader::ShaderLibrary;

/// Invocations of a work group, as in the shader.
const GROUP: u32 = 64;

/// Device addresses of what the pass reads and writes.
pub(crate) struct DescriptorAddresses {
    pub(crate) instances: u64,
    pub(crate) slots: u64,
    pub(crate) blases: u64,
    pub(crate) descriptors: u64,
}

/// The pass.
pub(crate) struct InstanceDescriptors {
    pipeline: ComputePipeline,
}

impl InstanceDescriptors {
    pub(crate) fn new(device: &Arc<Device>, library: &mut ShaderLibrary) -> Result<Self> {
        let file = "passes/instance_descriptors/instance_descriptors.comp";
        Ok(Self { pipeline: scene_compute(device, library, "instance_descriptors", file)? })
    }

    /// Writes the descriptors of the slots in `listed`, or of all `count` slots.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        addresses: &DescriptorAddresses,
        listed: Option<&[u32]>,
        count: u32,
        uses: &[Use<'_>],
    ) -> Result<()> {
        let list = listed.map(|slots| recorder.stage_bytes(bytemuck::cast_slice(slots))).transpose()?;
        let count = listed.map_or(count, |slots| slots.len() as u32);
        let job = DescriptorJob {
            instances: addresses.instances,
            slots: addresses.slots,
            blases: addresses.blases,
            descriptors: addresses.descriptors,
            listed: list.unwrap_or(0),
            count,
            pad0: 0,
        };
        let push = Push {
            frame_address: recorder.stage_bytes(bytemuck::bytes_of(&job))?,
            argument0: 0,
            argument1: 0,
        };
        let groups = [count.div_ceil(GROUP), 1, 1];
        recorder.pass("accel.descriptors", |recorder| {
            recorder.dispatch(&self.pipeline, None, &[], uses, bytemuck::bytes_of(&push), groups)
        })?;
        Ok(())
    }
}
