//! Light in three passes, for all pipelines but `path`: `shadow`, `temporal`, `shading`. Enters: the G-buffer. Leaves:
//! `shaded`.

use caustica_gpu::{Buffer, Recorder};

use super::{Builder, Scope, Shading, Shadow, Temporal};
use crate::error::Result;
use crate::view::Targets;

/// The passes.
pub(crate) struct Deferred {
    shadow: Option<Shadow>,
    temporal: Option<Temporal>,
    shading: Shading,
}

impl Deferred {
    pub(crate) fn new(builder: &mut Builder<'_>) -> Result<Self> {
        let needs = builder.needs;
        Ok(Self {
            shadow: needs.direct_light().then(|| Shadow::new(builder)).transpose()?,
            temporal: (needs.temporal && needs.direct_light()).then(|| Temporal::new(builder)).transpose()?,
            shading: Shading::new(builder)?,
        })
    }

    pub(crate) fn denoises(&self) -> bool {
        self.temporal.is_some()
    }

    /// Fills `shaded`. `moving`: which history is filled, and the counter of dropped samples, while something moves.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
        moving: Option<(usize, &Buffer)>,
    ) -> Result<()> {
        if let Some(shadow) = &self.shadow {
            shadow.record(recorder, scope, targets, parity)?;
        }
        if let (Some(temporal), Some((filled, counters))) = (&self.temporal, moving) {
            temporal.record(recorder, scope, targets, parity, filled, counters)?;
        }
        let light = match (&targets.history, moving) {
            (Some(history), Some((filled, _))) => Some((&history.diffuse[filled], &history.specular[filled])),
            _ => targets.direct_diffuse.as_ref().zip(targets.direct_specular.as_ref()),
        };
        self.shading.record(recorder, scope, targets, parity, light)
    }
}
