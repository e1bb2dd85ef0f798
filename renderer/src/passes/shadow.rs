//! Pass `shadow`: direct light at the first surface, demodulated. This is where soft-shadow rays are launched
//! (`shaders/passes/shadow/shadow.rgen`); the raster pipeline evaluates the same lights without rays.

use caustica_gpu::{Access, Bind, ComputePipeline, RayTracingPipeline, Recorder, Stage, Use};

use super::denoise::Moving;
use super::{Builder, Scope};
use crate::error::Result;
use crate::shader::Live;
use crate::view::Targets;

/// The pass.
pub(crate) enum Shadow {
    Rays(Live<RayTracingPipeline>),
    NoRays(Live<ComputePipeline>),
}

impl Shadow {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        if builder.needs.shadow_rays {
            return Ok(Self::Rays(builder.rays("shadow.trace", "passes/shadow/shadow.rgen")?));
        }
        Ok(Self::NoRays(builder.compute("shadow.light", "passes/raster_light/raster_light.comp")?))
    }

    /// Fills `direct_diffuse` and `direct_specular`; of a denoised frame, where asked for, `shadows` too.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
        moving: Option<Moving<'_>>,
    ) -> Result<()> {
        let (Some(diffuse), Some(specular)) = (&targets.direct_diffuse, &targets.direct_specular) else {
            return Ok(());
        };
        let light = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("gbuffer_normal", Bind::Image(&targets.normal[parity % targets.normal.len()])),
            ("gbuffer_base_color", Bind::Image(&targets.base_color)),
            ("gbuffer_material", Bind::Image(&targets.material)),
            ("direct_diffuse", Bind::Image(diffuse)),
            ("direct_specular", Bind::Image(specular)),
        ];
        match self {
            Self::Rays(pipeline) => {
                let filled = moving.map_or(0, |moving| moving.filled);
                let past = (parity + 1) % targets.normal.len();
                let known = [
                    ("gbuffer_motion", Bind::Image(&targets.motion)),
                    ("previous_depth", Bind::Image(&targets.depth[past])),
                    ("previous_normal", Bind::Image(&targets.normal[past])),
                    ("previous_shadows", Bind::Image(&targets.shadows[1 - filled])),
                    ("shadows", Bind::Image(&targets.shadows[filled])),
                ];
                let binds = [&light[..], &known].concat();
                let counters = moving
                    .map(|moving| Use::Buffer(moving.counters, Stage::RayTracing, Access::StorageReadWrite));
                let uses = Vec::from_iter(counters);
                scope.rays(recorder, "shadow.trace", pipeline, &binds, &uses, 0)
            }
            // Once a sample, with its last band.
            Self::NoRays(_) if scope.rows.end < scope.extent[1] => Ok(()),
            Self::NoRays(pipeline) => scope.compute(recorder, "shadow.light", pipeline, &light, &[], 0),
        }
    }
}
