//! Pass `instance_descriptors`: what the TLAS is built from, written on the device from the instance table.

use std::sync::Arc;

use caustica_gpu::{ComputePipeline, Device, Recorder, Use};

use super::{table_groups, table_pass};
use crate::error::Result;
use crate::gpu_types::{InstanceDescriptorJob, Push};
use crate::shader::{Live, ShaderLibrary};

/// Device addresses of the tables that the pass reads and writes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DescriptorAddresses {
    /// `Instance` by slot.
    pub(crate) instances: u64,
    /// `TlasSlot` by slot.
    pub(crate) slots: u64,
    /// Address of a BLAS by its number, 0 where nothing is built.
    pub(crate) blases: u64,
    /// Descriptors by place, 16-byte aligned.
    pub(crate) descriptors: u64,
}

/// The pass.
pub(crate) struct InstanceDescriptors {
    pipeline: Live<ComputePipeline>,
}

impl InstanceDescriptors {
    pub(crate) fn new(device: &Arc<Device>, library: &Arc<ShaderLibrary>) -> Result<Self> {
        let file = "passes/instance_descriptors/instance_descriptors.comp";
        Ok(Self { pipeline: table_pass(device, library, "instance_descriptors", file)? })
    }

    /// Writes the descriptors of the slots `dirty`, or of all `count` slots. `uses`: the tables, the descriptors among them.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        addresses: &DescriptorAddresses,
        dirty: Option<&[u32]>,
        count: u32,
        uses: &[Use<'_>],
    ) -> Result<()> {
        let count = dirty.map_or(count, |slots| slots.len() as u32);
        if count == 0 {
            return Ok(());
        }
        let dirty = match dirty {
            Some(slots) => recorder.stage_bytes(bytemuck::cast_slice(slots))?,
            None => 0,
        };
        let DescriptorAddresses { instances, slots, blases, descriptors } = *addresses;
        let job = InstanceDescriptorJob { instances, slots, blases, descriptors, dirty, count, pad0: 0 };
        let frame_address = recorder.stage_bytes(bytemuck::bytes_of(&job))?;
        let push = Push { frame_address, argument0: 0, argument1: 0 };
        let pipeline = self.pipeline.get(&[])?;
        recorder.pass("instance_descriptors", |recorder| {
            let push = bytemuck::bytes_of(&push);
            recorder.dispatch(&pipeline, None, &[], uses, push, table_groups(count))
        })?;
        Ok(())
    }
}
