//! Pass `shape_boxes`: the boxes around spheres and boxes that are new or whose primitive has moved.

use std::sync::Arc;

use caustica_gpu::{Access, ComputePipeline, Device, Recorder, ResourceId, Stage, Use};

use super::{table_groups, table_pass};
use crate::error::Result;
use crate::gpu_types::{Push, ShapeBoxJob};
use crate::shader::{Live, ShaderLibrary};

/// The pass.
pub(crate) struct ShapeBoxes {
    pipeline: Live<ComputePipeline>,
}

impl ShapeBoxes {
    pub(crate) fn new(device: &Arc<Device>, library: &Arc<ShaderLibrary>) -> Result<Self> {
        Ok(Self {
            pipeline: table_pass(device, library, "shape_boxes", "passes/shape_boxes/shape_boxes.comp")?,
        })
    }

    /// Runs one dispatch a job. `geometry`: stands for all vertices, shapes and boxes in the barrier tracker.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        jobs: &[ShapeBoxJob],
        geometry: ResourceId,
    ) -> Result<()> {
        if jobs.is_empty() {
            return Ok(());
        }
        let frame_address = recorder.stage_bytes(bytemuck::cast_slice(jobs))?;
        let pipeline = self.pipeline.get(&[])?;
        recorder.pass("shape_boxes", |recorder| {
            // Declared once: the jobs write boxes of their own, so they may run side by side.
            recorder.declare(&[Use::Group(geometry, Stage::Compute, Access::StorageReadWrite)]);
            for (argument0, job) in (0..).zip(jobs) {
                let push = Push { frame_address, argument0, argument1: 0 };
                let groups = table_groups(job.count);
                recorder.dispatch(&pipeline, None, &[], &[], bytemuck::bytes_of(&push), groups)?;
            }
            Ok(())
        })
    }
}
