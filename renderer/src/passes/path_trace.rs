//! Pass `path_trace`: the radiance of every pixel by one path. Enters: the ids of the first surfaces. Leaves: `shaded`,
//! linear HDR.

use caustica_gpu::{Bind, RayTracingPipeline, Recorder};

use super::{Builder, Scope};
use crate::error::Result;
use crate::view::Targets;

/// The pass.
pub(crate) struct PathTrace {
    pipeline: RayTracingPipeline,
}

impl PathTrace {
    pub(crate) fn new(builder: &mut Builder<'_>) -> Result<Self> {
        Ok(Self { pipeline: builder.rays("path_trace", "passes/path_trace/path_trace.rgen")? })
    }

    /// Fills `shaded`.
    pub(crate) fn record(&self, recorder: &mut Recorder, scope: &Scope<'_>, targets: &Targets) -> Result<()> {
        let binds = [("gbuffer_id", Bind::Image(&targets.id)), ("shaded", Bind::Image(&targets.shaded))];
        scope.rays(recorder, "path_trace", &self.pipeline, &binds, scope.rows.clone(), 0)
    }
}
