//! Pass `accumulate`: adds `shaded` to the accumulator; samples that are not finite are dropped and counted.

use caustica_gpu::{Access, Bind, Buffer, ComputePipeline, Recorder, Stage, Use};

use super::{Builder, Scope};
use crate::error::Result;
use crate::shader::Live;
use crate::view::Targets;

/// The pass.
pub(crate) struct Accumulate {
    pipeline: Live<ComputePipeline>,
}

impl Accumulate {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        Ok(Self { pipeline: builder.compute("accumulate", "passes/accumulate/accumulate.comp")? })
    }

    /// Adds one sample to every pixel.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        accumulator: &Buffer,
        counters: &Buffer,
    ) -> Result<()> {
        let uses = [
            Use::Buffer(accumulator, Stage::Compute, Access::StorageReadWrite),
            Use::Buffer(counters, Stage::Compute, Access::StorageReadWrite),
        ];
        let binds = [("shaded", Bind::Image(&targets.shaded))];
        scope.compute(recorder, "accumulate", &self.pipeline, &binds, &uses, 0)
    }
}
