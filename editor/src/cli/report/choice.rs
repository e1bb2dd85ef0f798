//! What `caustica report` compares: a pipeline with settings, such as `hybrid+denoise+half`. Enters: text. Leaves: settings.

use std::str::FromStr;

use caustica_renderer::{NeedsMode, Pipeline, Primary, ReflectionRate, Sampler, ShadowRate, ViewSettings};

/// A pipeline with settings, by the name that the user gave it.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    pub(super) name: String,
    pipeline: Pipeline,
    changes: Vec<Change>,
    sampler: Option<Sampler>,
}

/// One setting.
#[derive(Clone, Copy, Debug)]
struct Change {
    name: &'static str,
    meaning: &'static str,
    set: fn(&mut ViewSettings),
}

const CHANGES: [Change; 9] = [
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
];

fn denoise(settings: &mut ViewSettings, spatial: bool) {
    *settings = settings.clone().for_still(true, spatial);
}

impl Choice {
    /// The settings, on top of those of the file.
    pub(super) fn settings(&self, of_file: &ViewSettings) -> ViewSettings {
        let sampler = self.sampler.unwrap_or(of_file.sampler);
        let mut settings =
            ViewSettings { pipeline: self.pipeline, sampler, ..of_file.clone() }.for_still(false, false);
        self.changes.iter().for_each(|change| (change.set)(&mut settings));
        settings
    }
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts = text.split('+').map(str::trim);
        let first = parts.next().unwrap_or_default();
        let pipeline =
            Pipeline::ALL.into_iter().find(|pipeline| pipeline.name() == first).ok_or_else(|| {
                format!("no pipeline '{first}'; there is: {}", Pipeline::ALL.map(Pipeline::name).join(", "))
            })?;
        let mut choice = Self { name: text.trim().to_owned(), pipeline, changes: Vec::new(), sampler: None };
        for part in parts {
            let sampler = Sampler::ALL.into_iter().find(|sampler| sampler.name() == part);
            match (CHANGES.into_iter().find(|change| change.name == part), sampler) {
                (Some(change), _) => choice.changes.push(change),
                (None, Some(sampler)) => choice.sampler = Some(sampler),
                (None, None) => {
                    let known = CHANGES.map(|change| change.name).into_iter();
                    let known: Vec<&str> = known.chain(Sampler::ALL.map(Sampler::name)).collect();
                    return Err(format!("no setting '{part}'; there is: {}", known.join(", ")));
                }
            }
        }
        Ok(choice)
    }
}

/// Says what there is.
pub(super) fn help() -> String {
    let changes = CHANGES.map(|change| (change.name, change.meaning));
    let samplers = Sampler::ALL.map(|sampler| (sampler.name(), "sampler"));
    let lines = changes.into_iter().chain(samplers).map(|(name, meaning)| format!("  +{name:20} {meaning}"));
    format!(
        "What is compared: of {}, each with settings after a '+', as in hybrid+denoise+half:\n{}",
        Pipeline::ALL.map(Pipeline::name).join(", "),
        lines.collect::<Vec<_>>().join("\n")
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
