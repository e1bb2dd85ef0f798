//! `caustica render`: a project or model to an image file.

mod args;
mod watch;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use caustica_renderer::delta::LightId;
use caustica_renderer::{Estimate, Noise, ViewSettings, WakeFn};
use indicatif::ProgressBar;
use serde_json::json;

pub(super) use args::RenderArgs;
use args::{settings_of, without_effect};

use super::output::{self, Kind, Metadata};
use super::{DeviceArgs, progress_bar, steps_on};
use crate::session::{Loaded, Session, SessionOptions};

/// Frames of which the times are kept for the median.
const TIMED_FRAMES: usize = 4096;
/// Samples when nothing else is said.
const DEFAULT_SAMPLES: u64 = 64;

/// The light that `--show-light` names.
fn light_of(session: &Session, name: &str) -> anyhow::Result<LightId> {
    let lights = session.light_names();
    let by_number = || name.parse::<usize>().ok()?.checked_sub(1).and_then(|index| lights.get(index));
    match lights.iter().find(|(_, light)| light == name).or_else(by_number) {
        Some((id, _)) => Ok(*id),
        None if lights.is_empty() => bail!("--show-light '{name}': the scene has no light"),
        None => {
            let known: Vec<&str> = lights.iter().map(|(_, light)| light.as_str()).collect();
            bail!("--show-light '{name}': no such light; there is: {}", known.join(", "))
        }
    }
}

/// Renders the file.
pub(super) fn run(
    args: &RenderArgs,
    device: &DeviceArgs,
    shaders: Option<PathBuf>,
) -> anyhow::Result<ExitCode> {
    let kind = output::kind_of(&args.output)?;
    let shaders = shaders.or_else(|| args.watch.then(super::shader_folder).flatten());
    let (wake, woken) = channel();
    let watch_shaders = args.watch.then(|| {
        WakeFn(Arc::new(move || {
            // Nobody needs waking once the last picture was written.
            let _ = wake.send(());
        }))
    });
    let start = Instant::now();
    let progress = progress_bar(args.json);
    progress.set_message("loading");
    let loaded = args.shot.load(&steps_on(&progress))?;
    let device = device.open()?;
    let _watch = DeviceArgs::watch(&device);
    let mut session = Session::new(
        &device,
        SessionOptions { shaders, watch_shaders, extent: args.shot.size, ..SessionOptions::default() },
    )?;
    open(&mut session, args, loaded)?;
    let loaded_in = start.elapsed();
    picture(&mut session, args, kind, &progress, loaded_in)?;
    if args.watch {
        watch::follow(&mut session, args, &woken, |session, loaded_in| {
            picture(session, args, kind, &progress, loaded_in)
        })?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Shows what was loaded as the arguments say.
fn open(session: &mut Session, args: &RenderArgs, loaded: Loaded) -> anyhow::Result<()> {
    args.shot.open(session, loaded)?;
    if session.document().is_source(&args.output) {
        bail!("{}: is a source of this scene; choose another name", args.output.display());
    }
    let show_light = args.show_light.as_deref().map(|name| light_of(session, name)).transpose()?;
    let settings = settings_of(args, session.settings().clone());
    for what in without_effect(args, &settings) {
        tracing::warn!("without effect: {what}");
    }
    session.set_settings(ViewSettings { show_light, ..settings });
    session.set_sample_target(sample_limit(args))?;
    if args.sample_offset > 0 {
        session.set_sample_offset(args.sample_offset)?;
    }
    Ok(())
}

/// Renders one picture, writes it and says so.
fn picture(
    session: &mut Session,
    args: &RenderArgs,
    kind: Kind,
    progress: &ProgressBar,
    loaded_in: Duration,
) -> anyhow::Result<()> {
    let device = Arc::clone(session.device());
    let run =
        accumulate(session, args, progress).map_err(|error| session.advise_size(args.shot.size, error))?;
    progress.finish_and_clear();
    let metadata = Metadata {
        samples: run.samples,
        sample_offset: args.sample_offset,
        seconds: run.seconds,
        device: format!("{}, {}", device.name(), device.driver()),
        pipeline: session.settings().pipeline.name(),
        sampler: session.settings().sampler.name(),
        seed: session.settings().seed,
    };
    // What the scene has no need of was left out.
    let left_out = &session.statistics().left_out;
    let denoised = args.denoises() && left_out.iter().all(|left| left.what != "temporal denoising");
    let accumulated = session.read_back()?;
    // Frames that share their past do not tell how far they are from the truth.
    let noise = if denoised { None } else { Noise::of(&accumulated) };
    match kind {
        Kind::Exr => output::write_exr(&args.output, args.shot.size, &accumulated.mean, &metadata)?,
        Kind::Png => output::write_png(&args.output, args.shot.size, &session.read_display()?)?,
    }
    report_validation(&device)?;
    if args.json {
        say!("{}", summary(args, session, &metadata, &run, noise, denoised, loaded_in));
    } else {
        say!(
            "{}: {}x{}, {} samples in {:.2} s ({}), noise {}{}, {}",
            args.output.display(),
            args.shot.size[0],
            args.shot.size[1],
            metadata.samples,
            metadata.seconds,
            metadata.pipeline,
            noise.map_or_else(|| String::from("unknown"), in_words),
            match (denoised, session.settings().is_unbiased()) {
                (true, _) => ", denoised: bias unknown",
                (false, true) => "",
                (false, false) => ", bias unknown",
            },
            metadata.device
        );
    }
    Ok(())
}

/// Messages of the validation layer are an error of ours: they are never silent.
pub(super) fn report_validation(device: &caustica_renderer::gpu::Device) -> anyhow::Result<()> {
    let messages = device.instance().take_messages();
    match messages.first() {
        Some(first) => {
            bail!("{} validation messages, the first: {}: {}", messages.len(), first.id, first.text)
        }
        None => Ok(()),
    }
}

/// How a run went.
struct Run {
    seconds: f64,
    samples: u64,
    /// Milliseconds of each frame, by pass.
    frames: Vec<Vec<(String, f64)>>,
}

/// Samples to take; `None`: until a time or a noise is reached.
fn sample_limit(args: &RenderArgs) -> Option<u64> {
    let other_end = args.time.is_some() || args.target_error.is_some();
    args.samples.or((!other_end).then_some(DEFAULT_SAMPLES))
}

fn accumulate(session: &mut Session, args: &RenderArgs, progress: &ProgressBar) -> anyhow::Result<Run> {
    let samples = sample_limit(args).unwrap_or(u64::MAX);
    let limit =
        args.time.map(|seconds| Duration::try_from_secs_f64(seconds).context("--time")).transpose()?;
    progress.set_length(if samples == u64::MAX { 0 } else { samples });
    progress.set_message("rendering");
    let start = Instant::now();
    let mut frames = Vec::new();
    let in_time = |samples: u64| samples == 0 || limit.is_none_or(|limit| start.elapsed() < limit);
    let mut done = 0;
    let mut can_be_read = false;
    while (done < samples || session.textures_settle()) && in_time(done) {
        session.render_frame(args.shot.size)?;
        let times = &session.statistics().passes;
        if frames.len() < TIMED_FRAMES && !times.is_empty() {
            frames.push(times.clone());
        }
        // At the end, when hours may have passed, it would be too late to find out.
        if !can_be_read && !session.textures_settle() {
            session.check_read_back()?;
            can_be_read = true;
        }
        done = session.samples();
        progress.set_position(done);
        // Looked at a few times only: reading back waits for the device.
        if let Some(target) = args.target_error
            && done >= 16
            && done.is_power_of_two()
            && let Some(noise) = Noise::of(&session.read_back()?)
        {
            if noise.error().value <= target {
                break;
            }
            let left = noise.seconds_to(target, start.elapsed().as_secs_f64());
            progress.set_message(format!("{}, about {:.0} s to go", in_words(noise), left.value.ceil()));
        }
    }
    session.finish()?;
    frames.push(session.statistics().passes.clone());
    Ok(Run { samples: done, seconds: start.elapsed().as_secs_f64(), frames })
}

/// The noise with the interval that holds it in 95 of 100 cases.
fn in_words(noise: Noise) -> String {
    let Estimate { value, low, high } = noise.error();
    format!("{:.2} % ({:.2} to {:.2})", value * 100.0, low * 100.0, high * 100.0)
}

fn summary(
    args: &RenderArgs,
    session: &Session,
    metadata: &Metadata,
    run: &Run,
    noise: Option<Noise>,
    denoised: bool,
    loaded_in: Duration,
) -> serde_json::Value {
    let statistics = session.statistics();
    let profile = session.device_profile().file.as_ref();
    let passes: serde_json::Map<String, serde_json::Value> =
        medians(&run.frames).into_iter().map(|(label, ms)| (label, json!(ms))).collect();
    let memory: serde_json::Map<String, serde_json::Value> =
        statistics.memory.iter().map(|(kind, bytes)| (kind.clone(), json!(bytes))).collect();
    json!({
        "output": args.output,
        "size": args.shot.size,
        "pipeline": metadata.pipeline,
        "sampler": metadata.sampler,
        "device": metadata.device,
        "device_profile": profile.map_or_else(|| String::from("default"), |file| file.display().to_string()),
        "at": args.shot.at,
        "version": env!("CARGO_PKG_VERSION"),
        "samples": metadata.samples,
        "sample_offset": metadata.sample_offset,
        "seconds": metadata.seconds,
        "load_seconds": loaded_in.as_secs_f64(),
        "ms_per_pass": passes,
        "noise": noise.map(|noise| noise.error().value),
        "noise_interval": noise.map(|noise| [noise.error().low, noise.error().high]),
        "bias": if session.settings().is_unbiased() { "none" } else { "unknown" },
        "efficiency": noise.map(|noise| noise.efficiency(session.total_device_ms() * 1e-3)),
        "denoised": denoised,
        "acceleration_structures": statistics.acceleration,
        "memory_bytes": memory,
        "non_finite_samples": statistics.non_finite,
        "shadow_rays_of_last_frame": (statistics.shadow_rays > 0).then_some(statistics.shadow_rays),
        "reset_reason": statistics.reset_reason,
        "left_out": statistics.left_out,
    })
}

/// Median milliseconds of each pass, in order of the first frame that has it; passes of a few frames only (builds at
/// the start) come first.
fn medians(frames: &[Vec<(String, f64)>]) -> Vec<(String, f64)> {
    let mut labels: Vec<&String> = Vec::new();
    for (label, _) in frames.iter().flatten() {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels
        .into_iter()
        .map(|label| {
            let mut times: Vec<f64> =
                frames.iter().flatten().filter(|(l, _)| l == label).map(|(_, ms)| *ms).collect();
            times.sort_by(f64::total_cmp);
            (label.clone(), times[times.len() / 2])
        })
        .collect()
}
