//! What a caller may choose for a view. Plain values; the editor's panel and the command line fill the same struct.

mod show;

use serde::{Deserialize, Serialize};

pub use show::Show;

use crate::delta::LightId;

/// How an image is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pipeline {
    /// G-buffer and deferred shading, no rays.
    Raster,
    /// Rasterised G-buffer, ray-traced shadows, reflections and refractions.
    #[default]
    Hybrid,
    /// The same with ray-traced primary visibility.
    Raytraced,
    /// Unbiased path tracing: the reference for all others.
    Path,
}

impl Pipeline {
    /// Every pipeline, in the order of menus.
    pub const ALL: [Self; 4] = [Self::Raster, Self::Hybrid, Self::Raytraced, Self::Path];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Hybrid => "hybrid",
            Self::Raytraced => "raytraced",
            Self::Path => "path",
        }
    }
}

/// How radiance becomes a displayable colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ToneMap {
    /// Cut at 1.
    Linear,
    /// A fit of the ACES filmic curve.
    Aces,
    /// A fit of AgX.
    Agx,
    /// Khronos PBR Neutral: base colours come out as they are.
    #[default]
    Neutral,
}

impl ToneMap {
    /// Every curve, in the order of menus.
    pub const ALL: [Self; 4] = [Self::Linear, Self::Aces, Self::Agx, Self::Neutral];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Aces => "aces",
            Self::Agx => "agx",
            Self::Neutral => "neutral",
        }
    }
}

/// How `hybrid` finds the first surfaces. The picture is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Primary {
    /// As is faster on the device, by its profile.
    #[default]
    Auto,
    /// By the rasteriser; by rays where the scene holds spheres or boxes.
    Raster,
    /// By rays.
    Rays,
}

impl Primary {
    /// Every way, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Raster, Self::Rays];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Raster => "raster",
            Self::Rays => "rays",
        }
    }
}

/// How many pixels trace reflected and refracted light in frames of `hybrid` and `raytraced` that are denoised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReflectionRate {
    /// Each.
    #[default]
    Full,
    /// One of each 2 x 2, in turns.
    Half,
}

/// Which pixels trace shadow rays in frames of `hybrid` and `raytraced` that are denoised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShadowRate {
    /// Each, to every light.
    #[default]
    Full,
    /// Those near which the frames before met both light and shadow of a punctual light, and one of 8 in turns: while the
    /// scene stands still, every light is visited and it is one of the first 16.
    Penumbra,
}

/// Where the random numbers of a picture come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Owen-scrambled Sobol points.
    #[default]
    Sobol,
    /// Halton points, scrambled a pixel.
    Halton,
    /// Hammersley sets of as many points as samples are asked for.
    Hammersley,
    /// Independent numbers: hashed PCG.
    Independent,
    /// Sobol points with blue-noise offsets between the pixels.
    BlueNoise,
}

impl Sampler {
    /// Every sampler, in the order of menus.
    pub const ALL: [Self; 5] =
        [Self::Sobol, Self::Halton, Self::Hammersley, Self::Independent, Self::BlueNoise];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Halton => "halton",
            Self::Hammersley => "hammersley",
            Self::Independent => "independent",
            Self::BlueNoise => "blue-noise",
        }
    }
}

/// Whether pipelines are made for this scene or for any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NeedsMode {
    /// Leave out what the scene does not need.
    #[default]
    Auto,
    /// Build and run everything.
    All,
}

/// Settings of a view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ViewSettings {
    /// Pipeline.
    pub pipeline: Pipeline,
    /// What is shown.
    pub show: Show,
    /// The light of [`Show::Shadow`]; `None`: the first that shines.
    pub show_light: Option<LightId>,
    /// Special or general variants.
    pub needs: NeedsMode,
    /// How `hybrid` finds the first surfaces.
    pub primary: Primary,
    /// Exposure in stops; 0 leaves radiance 1 at 1.
    pub exposure_ev: f32,
    /// Tone map.
    pub tone_map: ToneMap,
    /// Where the random numbers come from.
    pub sampler: Sampler,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Lights a pixel in the shadow pass; all of them when there are at most this many.
    pub light_samples: u32,
    /// Shadow rays a light and pixel.
    pub shadow_rays: u32,
    /// Reflections and refractions after the first surface: `hybrid` and `raytraced`.
    pub max_depth: u32,
    /// Bounces after the first surface in `path`; `None`: as many as paths take until chance ends them.
    pub path_depth: Option<u32>,
    /// In `path`, rough interfaces reflect the light too that they scatter more than once; off is glTF to the letter.
    pub multiple_scattering: bool,
    /// Surfaces up to this roughness trace their specular lobe; rougher ones see the environment only.
    pub reflection_roughness_max: f32,
    /// How many pixels trace reflected light while it is denoised.
    pub reflection_rate: ReflectionRate,
    /// Which pixels trace shadow rays while light is denoised.
    pub shadow_rate: ShadowRate,
    /// Shadow rays stop at glass instead of passing it tinted and unbent.
    pub opaque_glass_shadows: bool,
    /// Denoise over time while things move. Off for headless stills, which accumulate anyway.
    pub temporal: bool,
    /// Denoise over space too; nothing without `temporal`.
    pub spatial: bool,
    /// Denoise when nothing moves, too: the mean is that of denoised frames, and biased.
    pub denoise_stills: bool,
    /// Longest history while moving, frames.
    pub temporal_max_history: f32,
    /// Jitter primary samples inside the pixel; off gives hard, reproducible edges for tests.
    pub jitter: bool,
}

impl ViewSettings {
    /// Whether more and more samples lead to the truth: not where light is left out, paths end early, or frames are denoised.
    #[must_use]
    pub fn is_unbiased(&self) -> bool {
        self.pipeline == Pipeline::Path && self.path_depth.is_none() && !self.denoise_stills
    }

    /// These for a still: denoised over its frames, each with all of those before it as its past, and over space too; or not.
    #[must_use]
    pub fn for_still(self, temporal: bool, spatial: bool) -> Self {
        let temporal_max_history = if temporal { f32::MAX } else { self.temporal_max_history };
        Self { temporal, spatial, denoise_stills: temporal, temporal_max_history, ..self }
    }
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            pipeline: Pipeline::Hybrid,
            show: Show::Image,
            show_light: None,
            needs: NeedsMode::Auto,
            primary: Primary::Auto,
            exposure_ev: 0.0,
            tone_map: ToneMap::Neutral,
            sampler: Sampler::Sobol,
            seed: 0,
            light_samples: 4,
            shadow_rays: 1,
            max_depth: 12,
            path_depth: None,
            multiple_scattering: false,
            reflection_roughness_max: 0.5,
            reflection_rate: ReflectionRate::Full,
            shadow_rate: ShadowRate::Full,
            opaque_glass_shadows: false,
            temporal: true,
            spatial: true,
            denoise_stills: false,
            temporal_max_history: 24.0,
            jitter: true,
        }
    }
}
