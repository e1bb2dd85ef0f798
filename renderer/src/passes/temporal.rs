//! Pass `temporal`: direct light of the last frames, reprojected by motion vectors, clamped to the neighbourhood,
//! dropped where depth or normal disagree. Enters: this frame's signals and the past. Leaves: the new past.

use caustica_gpu::{Access, Bind, Buffer, ComputePipeline, Recorder, Stage, Use};

use super::{Builder, Scope};
use crate::error::Result;
use crate::view::Targets;

/// The pass.
pub(crate) struct Temporal {
    pipeline: ComputePipeline,
}

impl Temporal {
    pub(crate) fn new(builder: &mut Builder<'_>) -> Result<Self> {
        Ok(Self { pipeline: builder.compute("temporal", "passes/temporal/temporal.comp")? })
    }

    /// Fills the history images `filled` from the other ones; `parity`: the normal and depth images of this frame.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
        filled: usize,
        counters: &Buffer,
    ) -> Result<()> {
        let (Some(history), Some(diffuse), Some(specular)) =
            (&targets.history, &targets.direct_diffuse, &targets.direct_specular)
        else {
            return Ok(());
        };
        let (now, past) = (parity % 2, (parity + 1) % 2);
        let binds = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("gbuffer_normal", Bind::Image(&targets.normal[now])),
            ("gbuffer_depth", Bind::Image(&targets.depth[now])),
            ("gbuffer_motion", Bind::Image(&targets.motion)),
            ("direct_diffuse", Bind::Image(diffuse)),
            ("direct_specular", Bind::Image(specular)),
            ("previous_depth", Bind::Image(&targets.depth[past])),
            ("previous_normal", Bind::Image(&targets.normal[past])),
            ("previous_diffuse", Bind::Image(&history.diffuse[1 - filled])),
            ("previous_specular", Bind::Image(&history.specular[1 - filled])),
            ("history_diffuse", Bind::Image(&history.diffuse[filled])),
            ("history_specular", Bind::Image(&history.specular[filled])),
        ];
        let uses = [Use::Buffer(counters, Stage::Compute, Access::StorageReadWrite)];
        scope.compute(recorder, "temporal", &self.pipeline, &binds, &uses, 0)
    }
}
