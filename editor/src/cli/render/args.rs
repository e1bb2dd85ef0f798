//! Arguments of `caustica render`, and the settings that they ask for.

use std::path::PathBuf;

use caustica_renderer::{
    NeedsMode, Pipeline, Primary, ReflectionRate, Sampler, ShadowRate, Show, ToneMap, ViewSettings,
};
use clap::{Args, ValueEnum};
use serde_json::json;

use crate::cli::output;
use crate::cli::shot::{ShotArgs, parse_positive};

/// Arguments of `caustica render`.
#[derive(Args, Debug)]
pub(in crate::cli) struct RenderArgs {
    #[command(flatten)]
    pub(in crate::cli) shot: ShotArgs,
    /// Where the image goes: .png (tone mapped) or .exr (radiance)
    #[arg(short, long, value_name = "OUT", value_parser = parse_output)]
    pub(super) output: PathBuf,
    /// How the image is made
    #[arg(long, value_enum)]
    pipeline: Option<PipelineArg>,
    /// Samples a pixel. Of samples, time and target error whatever is reached first counts
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) samples: Option<u64>,
    /// Seconds to render
    #[arg(long, value_name = "SECONDS", value_parser = parse_positive)]
    pub(super) time: Option<f64>,
    /// Stop at this noise: sqrt(relMSE) estimated from two independent streams, 0.01 is 1 %
    #[arg(long, value_name = "X", value_parser = parse_positive)]
    pub(super) target_error: Option<f64>,
    /// Where random numbers come from. A Hammersley set is made for half of --samples, as there are two streams; without
    /// --samples, for 256
    #[arg(long, value_enum)]
    sampler: Option<SamplerArg>,
    /// Seed of all random numbers
    #[arg(long)]
    seed: Option<u32>,
    /// Reflections and refractions after the first surface; bounces in `path`, where the default is no limit
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1024))]
    max_depth: Option<u32>,
    /// In `path`, reflect the light too that rough surfaces scatter more than once (off: glTF to the letter)
    #[arg(long)]
    multiple_scattering: bool,
    /// Shadow rays a light and pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    shadow_rays: Option<u32>,
    /// First sample of a set that is rendered in parts
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(..1 << 47))]
    pub(super) sample_offset: u64,
    /// With --denoise, which pixels trace reflected light in a frame: each, or one of 2x2 in turns
    #[arg(long, value_enum)]
    reflection_rate: Option<RateArg>,
    /// With --denoise, which pixels trace shadow rays: each, or those in penumbrae and one of 8 in turns
    #[arg(long, value_enum)]
    shadow_rate: Option<ShadowRateArg>,
    /// How `hybrid` finds the first surfaces: `auto` as is faster on the device, by its profile
    #[arg(long, value_enum)]
    primary: Option<PrimaryArg>,
    /// Leave out what the scene does not need, or build everything
    #[arg(long, value_enum)]
    needs: Option<NeedsArg>,
    /// Exposure in stops
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = parse_finite)]
    exposure: Option<f32>,
    /// Tone map of a PNG
    #[arg(long, value_enum)]
    tone_map: Option<ToneMapArg>,
    /// What a PNG shows: the image, or a step on the way such as base_color, normal, depth
    #[arg(long, value_name = "VIEW", value_parser = parse_show, long_help = show_help())]
    show: Option<Show>,
    /// Filter the picture: over the frames alone, or over space too. Less noise for a bias that is not known
    #[arg(long, value_enum, conflicts_with_all = ["target_error", "sample_offset"], default_missing_value = "full", num_args = 0..=1)]
    denoise: Option<DenoiseArg>,
    /// The light of `--show shadow`: its name, or its number from 1; without it the first that shines
    #[arg(long, value_name = "NAME|N")]
    pub(super) show_light: Option<String>,
    /// Go on, and render again whenever the scene changes, its models, images and environment with it, or a shader in the folder of
    /// --shaders, else in that of the checkout. What is wrong with them is told, and the last picture stays. Ends with Ctrl+C
    #[arg(long)]
    pub(super) watch: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PipelineArg {
    Raster,
    Hybrid,
    Raytraced,
    Path,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum DenoiseArg {
    Off,
    Temporal,
    Full,
}

impl RenderArgs {
    /// The picture is to be denoised.
    pub(super) fn denoises(&self) -> bool {
        self.denoise.is_some_and(|denoise| denoise != DenoiseArg::Off)
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RateArg {
    Full,
    Half,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ShadowRateArg {
    Full,
    Penumbra,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PrimaryArg {
    Auto,
    Raster,
    Rays,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum NeedsArg {
    Auto,
    All,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ToneMapArg {
    Linear,
    Aces,
    Agx,
    Neutral,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SamplerArg {
    /// Owen-scrambled Sobol points
    Sobol,
    /// Halton points, scrambled a pixel
    Halton,
    /// Hammersley sets: even when complete, like independent numbers before
    Hammersley,
    /// Independent numbers (hashed PCG)
    Independent,
    /// Sobol points with offsets that make errors of neighbouring pixels cancel
    BlueNoise,
}

/// Options that were given and change nothing, with the reason.
pub(super) fn without_effect(args: &RenderArgs, settings: &ViewSettings) -> Vec<&'static str> {
    let (raster, path) = (settings.pipeline == Pipeline::Raster, settings.pipeline == Pipeline::Path);
    let half = matches!(args.reflection_rate, Some(RateArg::Half));
    let penumbra = matches!(args.shadow_rate, Some(ShadowRateArg::Penumbra));
    let primary = matches!(args.primary, Some(PrimaryArg::Raster | PrimaryArg::Rays));
    let deep = args.max_depth.is_some_and(|depth| depth > 1);
    let apart = matches!(settings.show, Show::DirectDiffuse | Show::DirectSpecular);
    let of_rays = matches!(settings.show, Show::Shadow | Show::RayDepth);
    let list = [
        (args.denoises() && raster, "--denoise: `raster` casts no rays, there is nothing to denoise"),
        (half && !args.denoises(), "--reflection-rate half: only while light is denoised (--denoise)"),
        (half && (raster || path), "--reflection-rate half: of `hybrid` and `raytraced` alone"),
        (penumbra && !args.denoises(), "--shadow-rate penumbra: only while light is denoised (--denoise)"),
        (penumbra && (raster || path), "--shadow-rate penumbra: of `hybrid` and `raytraced` alone"),
        (primary && settings.pipeline != Pipeline::Hybrid, "--primary: of `hybrid` alone"),
        (args.multiple_scattering && !path, "--multiple-scattering: of `path` alone"),
        (args.shadow_rays.is_some() && (raster || path), "--shadow-rays: of `hybrid` and `raytraced` alone"),
        (deep && raster, "--max-depth above 1: `raster` casts no rays"),
        (apart && path, "--show: `path` does not keep direct light apart, the view is black"),
        (of_rays && raster, "--show: `raster` casts no rays, the view is black"),
    ];
    list.into_iter().filter(|(given, _)| *given).map(|(_, what)| what).collect()
}

fn parse_finite(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(String::from("expected a number")),
    }
}

fn parse_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    output::kind_of(&path).map(|_| path).map_err(|error| error.to_string())
}

fn parse_show(text: &str) -> Result<Show, String> {
    serde_json::from_value(json!(text)).map_err(|_| {
        let names: Vec<String> = show_names().map(|(_, name)| name).collect();
        format!("one of {}", names.join(", "))
    })
}

/// Every view with its name on the command line.
fn show_names() -> impl Iterator<Item = (Show, String)> {
    let name = |show| serde_json::to_value(show).ok()?.as_str().map(str::to_owned);
    Show::ALL.into_iter().filter_map(move |(show, _)| Some((show, name(show)?)))
}

fn show_help() -> String {
    let lines: Vec<String> =
        show_names().map(|(show, name)| format!("  {name:16} {}", show.meaning())).collect();
    format!("What a PNG shows: the image, or a step on the way:\n{}", lines.join("\n"))
}

/// The settings that the arguments ask for, else those of the project.
pub(super) fn settings_of(args: &RenderArgs, of_project: ViewSettings) -> ViewSettings {
    ViewSettings {
        pipeline: args.pipeline.map_or(of_project.pipeline, |pipeline| match pipeline {
            PipelineArg::Raster => Pipeline::Raster,
            PipelineArg::Hybrid => Pipeline::Hybrid,
            PipelineArg::Raytraced => Pipeline::Raytraced,
            PipelineArg::Path => Pipeline::Path,
        }),
        needs: args.needs.map_or(of_project.needs, |needs| match needs {
            NeedsArg::Auto => NeedsMode::Auto,
            NeedsArg::All => NeedsMode::All,
        }),
        reflection_rate: args.reflection_rate.map_or(of_project.reflection_rate, |rate| match rate {
            RateArg::Full => ReflectionRate::Full,
            RateArg::Half => ReflectionRate::Half,
        }),
        shadow_rate: args.shadow_rate.map_or(of_project.shadow_rate, |rate| match rate {
            ShadowRateArg::Full => ShadowRate::Full,
            ShadowRateArg::Penumbra => ShadowRate::Penumbra,
        }),
        primary: args.primary.map_or(of_project.primary, |primary| match primary {
            PrimaryArg::Auto => Primary::Auto,
            PrimaryArg::Raster => Primary::Raster,
            PrimaryArg::Rays => Primary::Rays,
        }),
        tone_map: args.tone_map.map_or(of_project.tone_map, |tone_map| match tone_map {
            ToneMapArg::Linear => ToneMap::Linear,
            ToneMapArg::Aces => ToneMap::Aces,
            ToneMapArg::Agx => ToneMap::Agx,
            ToneMapArg::Neutral => ToneMap::Neutral,
        }),
        show: args.show.unwrap_or_default(),
        exposure_ev: args.exposure.unwrap_or(of_project.exposure_ev),
        sampler: args.sampler.map_or(of_project.sampler, |sampler| match sampler {
            SamplerArg::Sobol => Sampler::Sobol,
            SamplerArg::Halton => Sampler::Halton,
            SamplerArg::Hammersley => Sampler::Hammersley,
            SamplerArg::Independent => Sampler::Independent,
            SamplerArg::BlueNoise => Sampler::BlueNoise,
        }),
        seed: args.seed.unwrap_or(of_project.seed),
        max_depth: args.max_depth.unwrap_or(of_project.max_depth),
        path_depth: args.max_depth.or(of_project.path_depth),
        multiple_scattering: args.multiple_scattering || of_project.multiple_scattering,
        shadow_rays: args.shadow_rays.unwrap_or(of_project.shadow_rays),
        ..of_project
    }
    .for_still(args.denoises(), args.denoise == Some(DenoiseArg::Full))
}
