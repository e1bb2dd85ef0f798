//! Pass `blas_surface`: the surface of the boxes around runs of neighbouring triangles, by which the quality of a refitted
//! BLAS is judged.

use std::sync::Arc;

use caustica_gpu::{ComputePipeline, Device, Recorder, Use};

use super::{table_groups, table_pass};
use crate::error::Result;
use crate::gpu_types::{Push, SurfaceJob};
use crate::shader::{Live, ShaderLibrary};

/// The pass.
pub(crate) struct BlasSurface {
    pipeline: Live<ComputePipeline>,
}

impl BlasSurface {
    pub(crate) fn new(device: &Arc<Device>, library: &Arc<ShaderLibrary>) -> Result<Self> {
        let file = "passes/blas_surface/blas_surface.comp";
        Ok(Self { pipeline: table_pass(device, library, "blas_surface", file)? })
    }

    /// Runs one dispatch a job, side by side. `uses`: geometry that is read, buffers that are written.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        jobs: &[SurfaceJob],
        uses: &[Use<'_>],
    ) -> Result<()> {
        let frame_address = recorder.stage_bytes(bytemuck::cast_slice(jobs))?;
        let pipeline = self.pipeline.get(&[])?;
        recorder.pass("accel.surface", |recorder| {
            recorder.declare(uses);
            for (argument0, job) in (0..).zip(jobs) {
                let push = Push { frame_address, argument0, argument1: 0 };
                let groups = table_groups(job.cluster_count);
                recorder.dispatch(&pipeline, None, &[], &[], bytemuck::bytes_of(&push), groups)?;
            }
            Ok(())
        })
    }
}
