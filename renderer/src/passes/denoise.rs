//! Pass `denoise`: noisy light of this frame to light that can be shown: `temporal`, an a-trous filter guided by the
//! variance (SVGF), and what puts both back onto the surfaces. Enters: signals, G-buffers. Leaves: denoised signals.

use caustica_gpu::{Bind, Buffer, ComputePipeline, Image, Recorder};

use super::{Builder, Scope, Temporal};
use crate::error::Result;
use crate::shader::Live;
use crate::view::{History, Targets};

/// Pixels between the taps of each step of the filter.
const STEPS_PX: [u32; 5] = [1, 2, 4, 8, 16];

/// What a moving frame has to know.
#[derive(Clone, Copy)]
pub(crate) struct Moving<'a> {
    /// Which history images are filled by this frame.
    pub(crate) filled: usize,
    /// Counter of dropped samples.
    pub(crate) counters: &'a Buffer,
    /// One pixel of each 2 x 2 traces reflected light.
    pub(crate) half_reflections: bool,
}

/// Denoised light: demodulated direct light, diffuse and specular, and what rays bring.
pub(crate) type Signals<'a> = [&'a Image; 3];

/// The passes.
pub(crate) struct Denoise {
    temporal: Temporal,
    filter: Option<Filter>,
    /// Where light is put back after shading: what rays bring is denoised.
    compose: Option<Live<ComputePipeline>>,
}

struct Filter {
    variance: Live<ComputePipeline>,
    step: Live<ComputePipeline>,
}

impl Denoise {
    /// The passes that the needs ask for; `None`: nothing is denoised.
    pub(crate) fn new(builder: &Builder<'_>) -> Result<Option<Self>> {
        let needs = builder.needs;
        if !(needs.temporal && needs.direct_light()) {
            return Ok(None);
        }
        let filter = if needs.spatial {
            let variance = builder.compute("denoise.variance", "passes/denoise/variance.comp")?;
            let step = builder.compute("denoise.filter", "passes/denoise/filter.comp")?;
            Some(Filter { variance, step })
        } else {
            None
        };
        let composes = needs.secondary_rays() || needs.paths;
        let compose = composes.then(|| builder.compute("denoise.compose", "passes/shading/compose.comp"));
        Ok(Some(Self { temporal: Temporal::new(builder)?, filter, compose: compose.transpose()? }))
    }

    /// Whether [`Denoise::compose`] follows instead of shading.
    pub(crate) fn composes(&self) -> bool {
        self.compose.is_some()
    }

    /// Denoises the signals in `targets`.
    pub(crate) fn record<'a>(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &'a Targets,
        parity: usize,
        moving: Moving<'_>,
    ) -> Result<Option<Signals<'a>>> {
        let Some(history) = &targets.history else { return Ok(None) };
        self.temporal.record(recorder, scope, (targets, history), parity, moving, self.filter.is_some())?;
        let filled = moving.filled;
        if let Some(filter) = &self.filter {
            filter.record(recorder, scope, (targets, history), parity, filled)?;
            return Ok(Some(history.filtered[1].each_ref()));
        }
        Ok(Some([&history.diffuse[filled], &history.specular[filled], &history.reflected[filled]]))
    }

    /// Puts denoised light onto the first surfaces: fills `shaded`.
    pub(crate) fn compose(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        targets: &Targets,
        parity: usize,
        signals: Signals<'_>,
    ) -> Result<()> {
        let Some(pipeline) = &self.compose else { return Ok(()) };
        let unused = scope.tables.textures.white();
        let binds = [
            ("gbuffer_id", Bind::Image(&targets.id)),
            ("gbuffer_normal", Bind::Image(&targets.normal[parity % targets.normal.len()])),
            ("gbuffer_base_color", Bind::Image(&targets.base_color)),
            ("gbuffer_material", Bind::Image(&targets.material)),
            ("gbuffer_emissive", Bind::Image(targets.emissive.as_ref().unwrap_or(unused))),
            ("direct_diffuse", Bind::Image(signals[0])),
            ("direct_specular", Bind::Image(signals[1])),
            ("reflected", Bind::Image(signals[2])),
            ("reflected_tint", Bind::Image(&targets.reflected_tint)),
            ("shaded", Bind::Image(&targets.shaded)),
        ];
        scope.compute(recorder, "denoise.compose", pipeline, &binds, &[], 1)
    }
}

impl Filter {
    /// Fills `filtered[1]` from the history.
    fn record(
        &self,
        recorder: &mut Recorder,
        scope: &Scope<'_>,
        (targets, history): (&Targets, &History),
        parity: usize,
        filled: usize,
    ) -> Result<()> {
        let past = [&history.diffuse[filled], &history.specular[filled], &history.reflected[filled]];
        let filtered = |i: usize| history.filtered[i].each_ref();
        let binds = |from, to| filter_binds(targets, history, (parity, filled), from, to);
        scope.compute(
            recorder,
            "denoise.variance",
            &self.variance,
            &binds((past, 1), (filtered(0), 0)),
            &[],
            0,
        )?;
        for (i, apart_px) in STEPS_PX.into_iter().enumerate() {
            let (from, to) = (i % 2, (i + 1) % 2);
            let binds = binds((filtered(from), from), (filtered(to), to));
            scope.compute(recorder, "denoise.filter", &self.step, &binds, &[], apart_px)?;
        }
        Ok(())
    }
}

/// What the steps of the filter read and write: light goes from `from` to `to`, each with the number of its guide.
fn filter_binds<'a>(
    targets: &'a Targets,
    history: &'a History,
    (parity, filled): (usize, usize),
    (from, from_guide): (Signals<'a>, usize),
    (to, to_guide): (Signals<'a>, usize),
) -> [(&'static str, Bind<'a>); 13] {
    let named = [
        ("gbuffer_id", &targets.id),
        ("gbuffer_normal", &targets.normal[parity % targets.normal.len()]),
        ("gbuffer_depth", &targets.depth[parity % targets.depth.len()]),
        ("image_of_surface", &history.image[filled]),
        ("moments", &history.moments[filled]),
        ("in_guide", &history.guide[from_guide]),
        ("out_guide", &history.guide[to_guide]),
        ("in_diffuse", from[0]),
        ("in_specular", from[1]),
        ("in_reflected", from[2]),
        ("out_diffuse", to[0]),
        ("out_specular", to[1]),
        ("out_reflected", to[2]),
    ];
    named.map(|(name, image)| (name, Bind::Image(image)))
}
