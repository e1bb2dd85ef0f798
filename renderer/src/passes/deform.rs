//! Pass `deform`: the vertices of instances whose pose changed, made anew from their meshes at rest.

use std::sync::Arc;

use caustica_gpu::{Access, ComputePipeline, Device, Recorder, ResourceId, Stage, Use};

use super::{table_groups, table_pass};
use crate::error::Result;
use crate::gpu_types::{DeformJob, Push};
use crate::shader::{Live, ShaderLibrary};

/// The pass.
pub(crate) struct Deform {
    pipeline: Live<ComputePipeline>,
}

impl Deform {
    pub(crate) fn new(device: &Arc<Device>, library: &Arc<ShaderLibrary>) -> Result<Self> {
        Ok(Self { pipeline: table_pass(device, library, "deform", "passes/deform/deform.comp")? })
    }

    /// Runs one dispatch a job. `geometry`: stands for all vertices in the barrier tracker.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        jobs: &[DeformJob],
        geometry: ResourceId,
    ) -> Result<()> {
        if jobs.is_empty() {
            return Ok(());
        }
        let frame_address = recorder.stage_bytes(bytemuck::cast_slice(jobs))?;
        let pipeline = self.pipeline.get(&[])?;
        recorder.pass("deform", |recorder| {
            // Declared once: the jobs write vertices of their own, so they may run side by side.
            recorder.declare(&[Use::Group(geometry, Stage::Compute, Access::StorageReadWrite)]);
            for (argument0, job) in (0..).zip(jobs) {
                let push = Push { frame_address, argument0, argument1: 0 };
                let groups = table_groups(job.vertex_count);
                recorder.dispatch(&pipeline, None, &[], &[], bytemuck::bytes_of(&push), groups)?;
            }
            Ok(())
        })
    }
}
