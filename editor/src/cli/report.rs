//! `caustica report`: how far each way to make a picture is from a reference after how long, as figures and a page.

mod choice;
mod page;
mod picture;
mod plot;
mod run;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use caustica_renderer::gpu::DeviceKind;
use caustica_renderer::{Accumulated, ViewSettings};
use clap::Args;
use indicatif::ProgressBar;
use serde::Serialize;

use self::choice::Choice;
use self::run::{Measured, Until};
use super::shot::{ShotArgs, parse_positive};
use super::{DeviceArgs, progress_bar, steps_on};
use crate::curve::Curve;
use crate::reference::{self, Kept};
use crate::session::{Session, SessionOptions};

/// What is compared when nothing else is said.
const PIPELINES: &str = "raster,hybrid,hybrid+denoise,raytraced,path";
/// Samples of the reference when nothing else is said, and where a processor is the device.
const REFERENCE_SAMPLES: [u64; 2] = [1024, 128];

/// Arguments of `caustica report`.
#[derive(Args, Debug)]
pub(super) struct ReportArgs {
    #[command(flatten)]
    shot: ShotArgs,
    /// Folder for report.html, report.json, curves.csv and the images
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// What is compared: pipelines, each with settings after a '+'
    #[arg(long, value_name = "LIST", default_value = PIPELINES, value_delimiter = ',', long_help = choice::help())]
    pipelines: Vec<Choice>,
    /// The truth: an EXR of the same size, or so many samples of the path tracer, kept beside FILE (default: path:1024, with a
    /// processor as the device path:128)
    #[arg(long, value_name = "EXR|path:SPP", value_parser = parse_reference)]
    reference: Option<Reference>,
    /// Seconds for each of them
    #[arg(long, value_name = "S", value_parser = parse_positive, default_value_t = 10.0)]
    seconds: f64,
    /// Most samples of each of them
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u64).range(2..))]
    samples: u64,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Print report.json on standard output too
    #[arg(long)]
    json: bool,
}

/// What pictures are compared with.
#[derive(Clone, Debug)]
enum Reference {
    File(PathBuf),
    Path(u64),
}

fn parse_reference(text: &str) -> Result<Reference, String> {
    match text.strip_prefix("path:").map(str::parse::<u64>) {
        Some(Ok(samples)) if samples >= 2 => Ok(Reference::Path(samples)),
        Some(_) => Err(String::from("path: needs a number of samples, at least 2, such as path:1024")),
        None => Ok(Reference::File(PathBuf::from(text))),
    }
}

/// What report.json says.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    file: PathBuf,
    size: [u32; 2],
    device: String,
    driver: String,
    version: &'static str,
    /// Of the source that the program was built of; none where nobody said so (`CAUSTICA_COMMIT`).
    commit: Option<&'static str>,
    seed: u32,
    seconds: f64,
    reference: Truth,
    /// By the order of the command line.
    pipelines: Vec<Row>,
}

/// What pictures were compared with.
#[derive(Debug, Serialize)]
struct Truth {
    source: String,
    /// 0: not known.
    samples: u64,
    /// Its own noise; none: not known.
    noise: Option<f64>,
}

/// What was measured of one choice.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// Median milliseconds of a sample on the device, in turns with the others.
    ms_per_sample: f64,
    /// That by the one of the first.
    ratio: f64,
    /// Exponent with which the noise's relMSE falls with the samples.
    slope: Option<f64>,
    curve: Curve,
}

/// Measures and writes the report.
pub(super) fn run(
    args: &ReportArgs,
    device: &DeviceArgs,
    shaders: Option<PathBuf>,
) -> anyhow::Result<ExitCode> {
    if let Some(twice) = twice(&args.pipelines) {
        bail!("--pipelines: '{twice}' stands there twice");
    }
    if args.seed == reference::SEED {
        bail!("--seed {}: the reference has these random numbers, and both would err alike", args.seed);
    }
    let progress = progress_bar(args.json);
    progress.set_message("loading");
    let loaded = args.shot.load(&steps_on(&progress))?;
    // Found out before the work, not after it.
    std::fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    let device = device.open()?;
    let _watch = DeviceArgs::watch(&device);
    let options = SessionOptions { shaders, extent: args.shot.size, ..SessionOptions::default() };
    let mut session = Session::new(&device, options)?;
    args.shot.open(&mut session, loaded)?;
    let of_file = ViewSettings { seed: args.seed, ..session.settings().clone() };
    let (reference, source) = truth(&mut session, args, &progress)?;
    let mut measured = Vec::new();
    let until = Until { samples: args.samples, seconds: args.seconds };
    for choice in &args.pipelines {
        let settings = choice.settings(&of_file);
        progress.set_message(choice.name.clone());
        measured.push(run::measure(&mut session, &settings, &reference, until, &progress)?);
    }
    progress.set_message("times");
    let all: Vec<ViewSettings> = args.pipelines.iter().map(|choice| choice.settings(&of_file)).collect();
    let times = run::ms_per_sample(&mut session, &all, args.shot.size, &progress)?;
    progress.finish_and_clear();
    super::render::report_validation(&device)?;
    let first_ms = times.first().copied().unwrap_or(1.0);
    let rows = args.pipelines.iter().zip(&measured).zip(times).map(|((choice, measured), ms)| Row {
        name: choice.name.clone(),
        ms_per_sample: ms,
        ratio: ms / first_ms,
        slope: measured.curve.slope(),
        curve: measured.curve.clone(),
    });
    let report = Report {
        file: args.shot.file.clone(),
        size: args.shot.size,
        device: device.name().to_owned(),
        driver: device.driver().to_owned(),
        version: env!("CARGO_PKG_VERSION"),
        commit: option_env!("CAUSTICA_COMMIT").filter(|commit| !commit.is_empty()),
        seed: args.seed,
        seconds: args.seconds,
        reference: Truth { source, samples: reference.samples, noise: own_noise(&reference) },
        pipelines: rows.collect(),
    };
    write(args, &report, &reference, &measured, of_file.exposure_ev.exp2())?;
    Ok(ExitCode::SUCCESS)
}

fn own_noise(reference: &Accumulated) -> Option<f64> {
    let is_known = reference.half_difference.iter().flatten().any(|half| *half != 0.0);
    is_known.then(|| caustica_renderer::Noise::of(reference)).flatten().map(|noise| noise.error().value)
}

/// The reference, and where it is from.
fn truth(
    session: &mut Session,
    args: &ReportArgs,
    progress: &ProgressBar,
) -> anyhow::Result<(Accumulated, String)> {
    let on_processor = session.device().kind() == DeviceKind::Cpu;
    let default = REFERENCE_SAMPLES[usize::from(on_processor)];
    let samples = match args.reference.clone().unwrap_or(Reference::Path(default)) {
        Reference::File(path) => {
            return Ok((reference::read_exr(&path, args.shot.size)?, path.display().to_string()));
        }
        Reference::Path(samples) => samples,
    };
    let kept = Kept::of(session, &args.shot.file, args.shot.size, samples)?;
    let source = format!("path tracer, {samples} samples a pixel");
    match kept.load(args.shot.size) {
        Ok(Some(picture)) => return Ok((picture, format!("{source}, from {}", kept.path.display()))),
        Ok(None) => {}
        Err(error) => tracing::warn!("{error:#}; the reference is made anew"),
    }
    progress.set_message("reference");
    let picture = run::reference(session, args.shot.size, samples, progress)?;
    if let Err(error) = kept.save(&picture) {
        tracing::warn!("{error:#}; the reference is not kept");
    }
    Ok((picture, source))
}

/// Writes all files.
fn write(
    args: &ReportArgs,
    report: &Report,
    reference: &Accumulated,
    measured: &[Measured],
    exposure: f32,
) -> anyhow::Result<()> {
    let put = |name: &str, bytes: &[u8]| {
        let path = args.output.join(name);
        crate::whole_file::replace(&path, |path| std::fs::write(path, bytes))
            .with_context(|| path.display().to_string())
    };
    let json = serde_json::to_string_pretty(report)? + "\n";
    put("report.json", json.as_bytes())?;
    put("curves.csv", csv(report).as_bytes())?;
    let images = picture::all(report, reference, measured, exposure)?;
    for image in &images {
        put(&image.file, &image.png)?;
    }
    put("report.html", page::html(report, &images).as_bytes())?;
    match args.json {
        true => say!("{}", json.trim_end()),
        false => say!("{}", in_words(report, &args.output)),
    }
    Ok(())
}

/// One line for every point of every curve.
fn csv(report: &Report) -> String {
    let mut text = String::from(
        "pipeline,samples,gpu_ms,wall_s,relMSE,relMSE_trimmed,block_relMSE,RMSE,FLIP,HDR_FLIP,luminance_ratio,non_finite,\
         noise,bias,bias_low,bias_high\n",
    );
    for row in &report.pipelines {
        for point in &row.curve.0 {
            let (metrics, split) = (&point.metrics, &point.split);
            let numbers = [
                point.gpu_ms,
                point.wall_s,
                metrics.rel_mse,
                metrics.rel_mse_trimmed,
                metrics.block_rel_mse,
                metrics.rmse,
                point.flip,
                point.flip_hdr.unwrap_or(f64::NAN),
                metrics.luminance_ratio,
                metrics.non_finite as f64,
                split.noise,
                split.bias.value,
                split.bias.low,
                split.bias.high,
            ];
            let numbers = numbers
                .map(|number| if number.is_finite() { format!("{number:.6e}") } else { String::new() });
            text += &format!("{},{},{}\n", row.name, point.samples, numbers.join(","));
        }
    }
    text
}

/// The last point of each curve.
fn in_words(report: &Report, output: &Path) -> String {
    let mut text = format!("{}, against {}:\n", report.file.display(), report.reference.source);
    for row in &report.pipelines {
        let Some(last) = row.curve.0.last() else { continue };
        let bias = last.split.bias;
        text += &format!(
            "  {:24} {:6} samples, {:9.1} ms: error {:6.2} %, noise {:6.2} %, bias {:6.2} % ({:.2} to {:.2}), FLIP {:.4}\n",
            row.name,
            last.samples,
            last.gpu_ms,
            last.split.total * 100.0,
            last.split.noise * 100.0,
            bias.value * 100.0,
            bias.low * 100.0,
            bias.high * 100.0,
            last.flip,
        );
    }
    text + &output.join("report.html").display().to_string()
}

/// The name that two have; it would be one file.
fn twice(choices: &[Choice]) -> Option<&str> {
    let names = || choices.iter().map(|choice| choice.name.as_str());
    names()
        .enumerate()
        .find(|(number, name)| names().take(*number).any(|other| other == *name))
        .map(|(_, name)| name)
}
