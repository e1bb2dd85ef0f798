//! Pass `shading`: the radiance of every pixel. Enters: G-buffer and direct light. Leaves: `shaded`, linear HDR;
//! in frames that are denoised `reflected` and its tint.
//! Reflection and refraction rays start in its ray generation shader; without any it is a compute pass.

use caustica_gpu::{Bind, ComputePipeline, Image, RayTracingPipeline, Recorder};

use super::{Builder, Scope};
use crate::error::Result;
use crate::shader::Live;
use crate::view::Targets;

/// The pass.
pub(crate) enum Shading {
    Rays(Live<RayTracingPipeline>),
    NoRays(Live<ComputePipeline>),
}

impl Shading {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        if builder.needs.secondary_rays() {
            return Ok(Self::Rays(builder.rays("shading.trace", "passes/shading/shading.rgen")?));
        }
        Ok(Self::NoRays(builder.compute("shading", "passes/shading/shading.comp")?))
    }

    /// Fills `shaded`, or `reflected` where rays are denoised. `light`: diffuse and specular direct light, this frame's or
    /// the denoised ones; `None`: no light.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
        light: Option<(&Image, &Image)>,
    ) -> Result<()> {
        let unused = scope.tables.textures.white();
        let (diffuse, specular) = light.unwrap_or((unused, unused));
        let binds = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("gbuffer_normal", Bind::Image(&targets.normal[parity % targets.normal.len()])),
            ("gbuffer_base_color", Bind::Image(&targets.base_color)),
            ("gbuffer_material", Bind::Image(&targets.material)),
            ("gbuffer_emissive", Bind::Image(targets.emissive.as_ref().unwrap_or(unused))),
            ("direct_diffuse", Bind::Image(diffuse)),
            ("direct_specular", Bind::Image(specular)),
            ("shaded", Bind::Image(&targets.shaded)),
            ("reflected", Bind::Image(&targets.reflected)),
            ("reflected_tint", Bind::Image(&targets.reflected_tint)),
            ("ray_depth", Bind::Image(&targets.ray_depth)),
        ];
        let has_light = u32::from(light.is_some());
        match self {
            Self::Rays(pipeline) => scope.rays(recorder, "shading.trace", pipeline, &binds, &[], has_light),
            // Once a sample, with its last band.
            Self::NoRays(_) if scope.rows.end < scope.extent[1] => Ok(()),
            Self::NoRays(pipeline) => scope.compute(recorder, "shading", pipeline, &binds, &[], has_light),
        }
    }
}
