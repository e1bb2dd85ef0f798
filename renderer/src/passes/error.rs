//! Pass `error`: what the accumulated picture and a reference differ by, as sums of blocks (`measure/live.rs`).

use caustica_gpu::{Access, Buffer, ComputePipeline, Recorder, Stage, Use};

use super::{Builder, Scope};
use crate::error::Result;
use crate::shader::Live;

/// The pass.
pub(crate) struct MeasureError {
    pipeline: Live<ComputePipeline>,
}

impl MeasureError {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        Ok(Self { pipeline: builder.compute("error", "passes/error/error.comp")? })
    }

    /// Fills `blocks`; without a reference with what the picture tells by itself.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        accumulator: &Buffer,
        reference: Option<&Buffer>,
        blocks: &Buffer,
    ) -> Result<()> {
        let mut uses = vec![
            Use::Buffer(accumulator, Stage::Compute, Access::StorageRead),
            Use::Buffer(blocks, Stage::Compute, Access::StorageReadWrite),
        ];
        uses.extend(reference.map(|buffer| Use::Buffer(buffer, Stage::Compute, Access::StorageRead)));
        scope.compute(recorder, "error", &self.pipeline, &[], &uses, 0)
    }
}
