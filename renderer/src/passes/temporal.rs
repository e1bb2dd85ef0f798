//! Pass `temporal`: light of the last frames, reprojected by motion vectors or by where its mirror image was, clamped to
//! the neighbourhood, dropped where depth or normal disagree. Enters: this frame's signals and the past. Leaves: the new
//! past.

use caustica_gpu::{Access, Bind, ComputePipeline, Recorder, Stage, Use};

use super::denoise::Moving;
use super::{Builder, Scope};
use crate::error::Result;
use crate::shader::Live;
use crate::view::{History, Targets};

/// The pass.
pub(crate) struct Temporal {
    pipeline: Live<ComputePipeline>,
}

impl Temporal {
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Self> {
        Ok(Self { pipeline: builder.compute("temporal", "passes/temporal/temporal.comp")? })
    }

    /// Fills the history images `moving.filled` from the other ones; `parity`: the normal and depth images of this
    /// frame; `moments`: those of the luminance are wanted.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        (targets, history): (&Targets, &History),
        parity: usize,
        moving: Moving<'_>,
        moments: bool,
    ) -> Result<()> {
        let unused = scope.tables.textures.white();
        let [diffuse, specular] = [&targets.direct_diffuse, &targets.direct_specular]
            .map(|image| Bind::Image(image.as_ref().unwrap_or(unused)));
        let (now, past) = (parity % 2, (parity + 1) % 2);
        let (filled, old) = (moving.filled, 1 - moving.filled);
        let (normals, depths, before) = match &targets.past {
            Some(past) => (&past.normal, &past.depth, &past.history),
            None => (&targets.normal, &targets.depth, history),
        };
        let binds = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("gbuffer_normal", Bind::Image(&targets.normal[now])),
            ("gbuffer_motion", Bind::Image(&targets.motion)),
            ("direct_diffuse", diffuse),
            ("direct_specular", specular),
            ("reflected", Bind::Image(&targets.reflected)),
            ("previous_depth", Bind::Image(&depths[past])),
            ("previous_normal", Bind::Image(&normals[past])),
            ("previous_diffuse", Bind::Image(&before.diffuse[old])),
            ("previous_specular", Bind::Image(&before.specular[old])),
            ("previous_reflected", Bind::Image(&before.reflected[old])),
            ("previous_moments", Bind::Image(&before.moments[old])),
            ("previous_image", Bind::Image(&before.image[old])),
            ("history_diffuse", Bind::Image(&history.diffuse[filled])),
            ("history_specular", Bind::Image(&history.specular[filled])),
            ("history_reflected", Bind::Image(&history.reflected[filled])),
            ("history_moments", Bind::Image(&history.moments[filled])),
            ("history_image", Bind::Image(&history.image[filled])),
        ];
        let uses = [Use::Buffer(moving.counters, Stage::Compute, Access::StorageReadWrite)];
        scope.compute(recorder, "temporal", &self.pipeline, &binds, &uses, u32::from(moments))
    }
}
