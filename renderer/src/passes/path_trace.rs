//! Pass `path_trace`: the radiance of every pixel by one path, denoised while something moves. Enters: the ids of the
//! first surfaces. Leaves: `shaded`, linear HDR.

use caustica_gpu::{Bind, RayTracingPipeline, Recorder};

use super::denoise::Moving;
use super::{Builder, Denoise, Scope};
use crate::error::Result;
use crate::shader::Live;
use crate::view::Targets;

/// The pass.
pub(crate) struct PathTrace {
    pipeline: Live<RayTracingPipeline>,
    pub(super) denoise: Option<Denoise>,
}

impl PathTrace {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        let pipeline = builder.rays("path_trace", "passes/path_trace/path_trace.rgen")?;
        Ok(Self { pipeline, denoise: Denoise::new(builder)? })
    }

    /// Fills `shaded`; denoised when `moving`.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
        moving: Option<Moving<'_>>,
    ) -> Result<()> {
        // Bound and not written in frames that are not denoised.
        let light = targets.direct_diffuse.as_ref().unwrap_or(&targets.shaded);
        let binds = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("shaded", Bind::Image(&targets.shaded)),
            ("ray_depth", Bind::Image(&targets.ray_depth)),
            ("direct_diffuse", Bind::Image(light)),
            ("reflected", Bind::Image(&targets.reflected)),
            ("reflected_tint", Bind::Image(&targets.reflected_tint)),
        ];
        scope.rays(recorder, "path_trace", &self.pipeline, &binds, &[], 0)?;
        let Some((denoise, moving)) = self.denoise.as_ref().zip(moving) else { return Ok(()) };
        let Some(signals) = denoise.record(recorder, scope, targets, parity, moving)? else { return Ok(()) };
        denoise.compose(recorder, scope, targets, parity, signals)
    }
}
