//! Pass `shadow`: direct light at the first surface, demodulated. This is where soft-shadow rays are launched
//! (`shaders/passes/shadow/shadow.rgen`); the raster pipeline evaluates the same lights without rays.

use caustica_gpu::{Bind, ComputePipeline, RayTracingPipeline, Recorder};

use super::{Builder, Scope};
use crate::error::Result;
use crate::view::Targets;

/// The pass.
pub(crate) enum Shadow {
    Rays(RayTracingPipeline),
    NoRays(ComputePipeline),
}

impl Shadow {
    pub(crate) fn new(builder: &mut Builder<'_>) -> Result<Self> {
        if builder.needs.shadow_rays {
            return Ok(Self::Rays(builder.rays("shadow.trace", "passes/shadow/shadow.rgen")?));
        }
        Ok(Self::NoRays(builder.compute("shadow.light", "passes/raster_light/raster_light.comp")?))
    }

    /// Fills `direct_diffuse` and `direct_specular`.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
    ) -> Result<()> {
        let (Some(diffuse), Some(specular)) = (&targets.direct_diffuse, &targets.direct_specular) else {
            return Ok(());
        };
        let binds = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("gbuffer_normal", Bind::Image(&targets.normal[parity % targets.normal.len()])),
            ("gbuffer_base_color", Bind::Image(&targets.base_color)),
            ("gbuffer_material", Bind::Image(&targets.material)),
            ("direct_diffuse", Bind::Image(diffuse)),
            ("direct_specular", Bind::Image(specular)),
        ];
        match self {
            Self::Rays(pipeline) => {
                scope.rays(recorder, "shadow.trace", pipeline, &binds, scope.rows.clone(), 0)
            }
            // Once a sample, with its last band.
            Self::NoRays(_) if scope.rows.end < scope.extent[1] => Ok(()),
            Self::NoRays(pipeline) => scope.compute(recorder, "shadow.light", pipeline, &binds, &[], 0),
        }
    }
}
