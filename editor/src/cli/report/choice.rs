//! What `caustica report` compares: a pipeline with settings, such as `hybrid+denoise+half`. Enters: text. Leaves: settings.

use std::str::FromStr;

use caustica_renderer::{NeedsMode, Pipeline, Primary, ReflectionRate, Sampler, ShadowRate, ViewSettings};

/// A pipeline with settings, by the name that the user gave it.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    pub(super) name: String,
    pipeline: Pipeline,
    changes: Vec<Change>,
}

/// One setting.
#[derive(Clone, Copy, Debug)]
struct Change {
    name: &'static str,
    meaning: &'static str,
    set: fn(&mut ViewSettings),
}

const CHANGES: [Change; 14] = [
    Change { name: "denoise", meaning: "denoised over the frames and over space", set: |s| denoise(s, true) },
    Change { name: "temporal", meaning: "denoised over the frames alone", set: |s| denoise(s, false) },
    Change {
        name: "half",
        meaning: "with denoise: one of 2 x 2 pixels traces reflected light",
        set: |s| s.reflection_rate = ReflectionRate::Half,
    },
    Change {
        name: "penumbra",
        meaning: "with denoise: shadow rays in penumbrae and one of 8 elsewhere",
        set: |s| s.shadow_rate = ShadowRate::Penumbra,
    },
    Change {
        name: "primary-raster",
        meaning: "hybrid: first surfaces by raster",
        set: |s| s.primary = Primary::Raster,
    },
    Change {
        name: "primary-rays",
        meaning: "hybrid: first surfaces by rays",
        set: |s| s.primary = Primary::Rays,
    },
    Change {
        name: "general",
        meaning: "nothing that the scene does not need is left out",
        set: |s| s.needs = NeedsMode::All,
    },
    Change {
        name: "special",
        meaning: "what the scene does not need is left out",
        set: |s| s.needs = NeedsMode::Auto,
    },
    Change {
        name: "multiple-scattering",
        meaning: "path: rough surfaces reflect light that they scatter more than once",
        set: |s| s.multiple_scattering = true,
    },
    Change { name: "sobol", meaning: "sampler", set: |s| s.sampler = Sampler::Sobol },
    Change { name: "halton", meaning: "sampler", set: |s| s.sampler = Sampler::Halton },
    Change { name: "hammersley", meaning: "sampler", set: |s| s.sampler = Sampler::Hammersley },
    Change { name: "independent", meaning: "sampler", set: |s| s.sampler = Sampler::Independent },
    Change { name: "blue-noise", meaning: "sampler", set: |s| s.sampler = Sampler::BlueNoise },
];

const PIPELINES: [Pipeline; 4] = [Pipeline::Raster, Pipeline::Hybrid, Pipeline::Raytraced, Pipeline::Path];

fn denoise(settings: &mut ViewSettings, spatial: bool) {
    (settings.temporal, settings.spatial, settings.denoise_stills) = (true, spatial, true);
    // A still keeps all of its frames.
    settings.temporal_max_history = f32::MAX;
}

impl Choice {
    /// The settings, on top of those of the file.
    pub(super) fn settings(&self, of_file: &ViewSettings) -> ViewSettings {
        let mut settings = ViewSettings {
            pipeline: self.pipeline,
            temporal: false,
            spatial: false,
            denoise_stills: false,
            ..of_file.clone()
        };
        self.changes.iter().for_each(|change| (change.set)(&mut settings));
        settings
    }
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split('+').map(str::trim);
        let first = parts.next().unwrap_or_default();
        let pipeline = PIPELINES.into_iter().find(|pipeline| pipeline.name() == first).ok_or_else(|| {
            format!("no pipeline '{first}'; there is: {}", PIPELINES.map(Pipeline::name).join(", "))
        })?;
        let known = |part: &str| {
            CHANGES.into_iter().find(|change| change.name == part).ok_or_else(|| {
                format!("no setting '{part}'; there is: {}", CHANGES.map(|change| change.name).join(", "))
            })
        };
        let changes = parts.map(known).collect::<Result<_, _>>()?;
        Ok(Self { name: text.trim().to_owned(), pipeline, changes })
    }
}

/// Says what there is.
pub(super) fn help() -> String {
    let lines = CHANGES.map(|change| format!("  +{:20} {}", change.name, change.meaning));
    format!(
        "What is compared: of {}, each with settings after a '+', as in hybrid+denoise+half:\n{}",
        PIPELINES.map(Pipeline::name).join(", "),
        lines.join("\n")
    )
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    #[test]
    fn a_name_becomes_settings() {
        let choice: Choice = "hybrid+denoise+half".parse().unwrap();
        let settings = choice.settings(&ViewSettings::default());
        assert_eq!((settings.pipeline, settings.reflection_rate), (Pipeline::Hybrid, ReflectionRate::Half));
        assert!(settings.denoise_stills && settings.spatial);
        let plain: Choice = "path".parse().unwrap();
        assert!(
            !plain.settings(&settings).denoise_stills,
            "the file's settings do not denoise a plain choice"
        );
        let error = "hybrid+blurry".parse::<Choice>().unwrap_err();
        assert!(error.contains("'blurry'") && error.contains("penumbra"), "{error}");
        assert!("magic".parse::<Choice>().unwrap_err().contains("raster, hybrid, raytraced, path"));
    }
}
