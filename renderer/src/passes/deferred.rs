//! Light of all pipelines but `path`: `shadow`, `shading`, and while something moves `denoise`. Enters: the G-buffer.
//! Leaves: `shaded`.

use caustica_gpu::Recorder;

use super::denoise::Moving;
use super::{Builder, Denoise, Scope, Shading, Shadow};
use crate::error::Result;
use crate::view::Targets;

/// The passes.
pub(crate) struct Deferred {
    shadow: Option<Shadow>,
    shading: Shading,
    pub(super) denoise: Option<Denoise>,
}

impl Deferred {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        Ok(Self {
            shadow: builder.needs.direct_light().then(|| Shadow::new(builder)).transpose()?,
            shading: Shading::new(builder)?,
            denoise: Denoise::new(builder)?,
        })
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
        if let Some(shadow) = &self.shadow {
            shadow.record(recorder, scope, targets, parity, moving)?;
        }
        let direct = targets.direct_diffuse.as_ref().zip(targets.direct_specular.as_ref());
        let Some((denoise, moving)) = self.denoise.as_ref().zip(moving) else {
            return self.shading.record(recorder, scope, targets, parity, direct);
        };
        if denoise.composes() {
            let [width, height] = scope.extent.map(|side| side.div_ceil(2));
            let quads = Scope { extent: [width, height], rows: 0..height, ..*scope };
            let traced = if moving.half_reflections { &quads } else { scope };
            self.shading.record(recorder, traced, targets, parity, None)?;
        }
        let Some(signals) = denoise.record(recorder, scope, targets, parity, moving)? else { return Ok(()) };
        if denoise.composes() {
            return denoise.compose(recorder, scope, targets, parity, signals);
        }
        self.shading.record(recorder, scope, targets, parity, Some((signals[0], signals[1])))
    }
}
