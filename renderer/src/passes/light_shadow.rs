//! Pass `light_shadow`: what arrives of one light at the first surfaces. Runs only while it is shown; its image gathers
//! the mean over the frames that show it. Enters: G-buffer ids, the number of the light.

use caustica_gpu::{Bind, Image, RayTracingPipeline, Recorder};

use super::{Builder, Scope};
use crate::error::Result;
use crate::gpu_types::LIGHT_SHADOW_FRESH;
use crate::shader::Live;

/// The pass.
pub(crate) struct LightShadow {
    trace: Live<RayTracingPipeline>,
}

impl LightShadow {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        Ok(Self { trace: builder.rays("light_shadow.trace", "passes/light_shadow/light_shadow.rgen")? })
    }

    /// Adds one ray a pixel. `light`: its number in the table; `fresh`: the image is begun anew.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        (id, light_shadow): (&Image, &Image),
        light: u32,
        fresh: bool,
    ) -> Result<()> {
        let argument0 = light | if fresh { LIGHT_SHADOW_FRESH } else { 0 };
        let binds = [("gbuffer_id", Bind::Image(id)), ("light_shadow", Bind::Image(light_shadow))];
        scope.whole().rays(recorder, "light_shadow.trace", &self.trace, &binds, &[], argument0)
    }
}
