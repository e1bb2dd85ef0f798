//! How wrong frames are while something moves, and what the denoiser's memory does to them: noise, and what is left of the past (ghosts,
//! lag) or blurred. Enters: a project, a camera that orbits, an animation that plays. Leaves: both for each setting, in the mean over the frames.

use std::path::PathBuf;

use anyhow::Context;
use caustica_renderer::gpu::DeviceKind;
use caustica_renderer::{Accumulated, ErrorMetrics, Halves, Pipeline, Radiance, Split, ViewSettings};
use clap::Args;
use glam::{DAffine3, DQuat, DVec3};
use serde::Serialize;
use serde_json::json;

use super::series::Series;
use super::table::Table;
use super::{Bench, Measured};
use crate::session::{Session, SessionOptions, ViewCamera, load};

const PROJECT: &str = "projects/gallery/gallery.caustica.json";
/// Time between two frames of an animation, seconds.
const FRAME_S: f64 = 1.0 / 60.0;
/// Frames before the first one that counts: the past must be one.
const WARM: usize = 8;
/// Longest memories that are tried, frames.
const MEMORIES: [f32; 6] = [2.0, 4.0, 8.0, 16.0, 24.0, 48.0];

/// Arguments of suite `motion`.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Suite motion")]
pub(super) struct MotionArgs {
    /// Project or model in which something moves
    #[arg(long, value_name = "FILE", default_value = PROJECT)]
    moving: PathBuf,
    /// Degrees that the camera goes around what it looks at between two frames
    #[arg(long, value_name = "DEGREES", default_value_t = 0.5, allow_negative_numbers = true)]
    orbit: f64,
    /// Look through this camera of the scene, wherever the animation takes it, instead of going around
    #[arg(long, value_name = "CAMERA", conflicts_with = "orbit")]
    along: Option<String>,
    /// Frames that count (default: 24, with a processor as the device 4)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Samples of the reference of each frame (default: 512, with a processor as the device 32)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..))]
    still_samples: Option<u64>,
}

/// What stands before the camera in a frame.
struct Moment {
    camera: ViewCamera,
    time_s: Option<f64>,
}

/// Figures of one setting, in the mean over the frames; errors are sqrt(relMSE).
#[derive(Debug, Serialize)]
struct Row {
    settings: String,
    error: f64,
    /// The error without the 0.1 % of pixels of each frame where it is largest.
    error_trimmed: f64,
    noise: f64,
    /// What stays in the mean over random numbers: ghosts, lag and blur.
    bias: f64,
    frame_ms: f64,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let args = &bench.motion;
    let on_processor = bench.device.kind() == DeviceKind::Cpu;
    let (extent, frames, samples) = match () {
        () if bench.quick => ([64, 36], 1, 2),
        () if on_processor => ([160, 90], 4, 32),
        () => ([1280, 720], 24, 512),
    };
    let frames = if bench.quick { frames } else { args.frames.unwrap_or(frames) };
    let samples = if bench.quick { samples } else { args.still_samples.unwrap_or(samples) };
    let options = SessionOptions { shaders: bench.shaders.clone(), extent, ..SessionOptions::default() };
    let mut session = Session::new(&bench.device, options)?;
    session.open(&args.moving, load(&args.moving, false, &|_, _| ())?)?;
    let of_project =
        ViewSettings { pipeline: Pipeline::Hybrid, temporal: false, ..session.settings().clone() };
    let moments = moments(&mut session, args, WARM + frames as usize)?;
    let all = variants(&of_project);
    let bar = bench.bar("motion", all.len() * 2 + frames as usize);
    let mut references = Vec::new();
    for moment in &moments[WARM..] {
        references.push(still(&mut session, &of_project, moment, extent, samples)?);
        bar.inc(1);
    }
    let mut rows = Vec::new();
    for (name, settings) in all {
        bar.set_message(name.clone());
        let mut times = Series::default();
        let mut run = |seed| {
            let settings = ViewSettings { seed, ..settings.clone() };
            let pictures = moving(&mut session, &settings, &moments, extent, &mut times);
            bar.inc(1);
            pictures
        };
        let (a, b) = (run(1)?, run(2)?);
        let mut sums = [0.0; 4];
        for ((a, b), reference) in a.iter().zip(&b).zip(&references) {
            let pair = Accumulated::of_runs(extent, [a, b]);
            let split = Split::of(reference, &pair, Halves::Runs)?;
            let truth = Radiance::new(extent, &reference.mean)?;
            let trimmed = ErrorMetrics::of(&truth, &Radiance::new(extent, a)?)?.rel_mse_trimmed;
            let parts = [split.total.powi(2), trimmed, split.noise.powi(2), split.bias.value.powi(2)];
            sums = [0, 1, 2, 3].map(|i| sums[i] + parts[i] / f64::from(frames));
        }
        let [error, error_trimmed, noise, bias] = sums.map(f64::sqrt);
        rows.push(Row { settings: name, error, error_trimmed, noise, bias, frame_ms: times.spread().median });
    }
    bar.finish_and_clear();
    let way = args.along.as_ref().map_or_else(
        || format!("{} degrees a frame", args.orbit),
        |camera| format!("through camera '{camera}'"),
    );
    let title = format!(
        "{}, {} x {}, {way}, {frames} frames, against {samples} samples each",
        args.moving.display(),
        extent[0],
        extent[1]
    );
    let figures = json!({
        "project": args.moving, "extent_px": extent, "way": way, "frames": frames,
        "reference_samples": samples, "rows": rows,
    });
    Ok(Measured { figures, tables: vec![table(&title, &rows)] })
}

/// Without a memory, then with longer and longer ones, over the frames alone and over space too.
fn variants(of_project: &ViewSettings) -> Vec<(String, ViewSettings)> {
    let with = |spatial: bool, memory: f32| ViewSettings {
        temporal: true,
        spatial,
        temporal_max_history: memory,
        ..of_project.clone()
    };
    let mut all = vec![(String::from("not denoised"), of_project.clone())];
    for (spatial, what) in [(false, "temporal"), (true, "full")] {
        all.extend(MEMORIES.map(|memory| (format!("{what}, {memory} frames"), with(spatial, memory))));
    }
    all
}

/// The animation plays, and the camera goes where it takes it, or around what lies before it.
fn moments(session: &mut Session, args: &MotionArgs, count: usize) -> anyhow::Result<Vec<Moment>> {
    let times = (0..count)
        .map(|number| session.duration().map(|duration_s| (number as f64 * FRAME_S).min(duration_s)));
    let times: Vec<Option<f64>> = times.collect();
    let start = *session.camera();
    let centre = session.document().bounds().map_or(DVec3::ZERO, |(low, high)| (low + high) * 0.5);
    let eye = start.world_from_camera.translation;
    let forward = -start.world_from_camera.matrix3.z_axis.normalize();
    let pivot = eye + forward * (centre - eye).dot(forward).max(start.near_m);
    let around = |number: usize| {
        let turn = DQuat::from_rotation_y((args.orbit * number as f64).to_radians());
        let turned = DAffine3::from_translation(pivot)
            * DAffine3::from_quat(turn)
            * DAffine3::from_translation(-pivot);
        ViewCamera { world_from_camera: turned * start.world_from_camera, ..start }
    };
    let at = |(number, time_s): (usize, Option<f64>)| {
        let camera = match &args.along {
            None => around(number),
            Some(name) => {
                session.set_time(time_s);
                ViewCamera::named(session.document(), name).context("--along")?
            }
        };
        Ok(Moment { camera, time_s })
    };
    times.into_iter().enumerate().map(at).collect()
}

fn show(session: &mut Session, moment: &Moment, extent: [u32; 2]) -> anyhow::Result<()> {
    session.set_time(moment.time_s);
    session.set_camera(moment.camera);
    session.render_frame(extent)
}

/// What a moment looks like when it lasts.
fn still(
    session: &mut Session,
    settings: &ViewSettings,
    moment: &Moment,
    extent: [u32; 2],
    samples: u64,
) -> anyhow::Result<Accumulated> {
    session.set_settings(ViewSettings { seed: u32::MAX, ..settings.clone() });
    show(session, moment, extent)?;
    while session.samples() < samples || session.textures_settle() {
        show(session, moment, extent)?;
    }
    session.read_back().context("the reference")
}

/// The frames that count, as they are seen while everything moves.
fn moving(
    session: &mut Session,
    settings: &ViewSettings,
    moments: &[Moment],
    extent: [u32; 2],
    times: &mut Series,
) -> anyhow::Result<Vec<Vec<[f32; 3]>>> {
    session.set_settings(settings.clone());
    session.set_sample_offset(0)?;
    let mut pictures = Vec::new();
    for (number, moment) in moments.iter().enumerate() {
        show(session, moment, extent)?;
        if number >= WARM {
            pictures.push(session.read_frame()?);
            times.push(session.device_ms().unwrap_or(0.0));
        }
    }
    Ok(pictures)
}

fn table(title: &str, rows: &[Row]) -> Table {
    let head = ["settings", "error", "trimmed", "noise", "ghosts, lag, blur", "ms a frame"];
    let mut table = Table::new(format!("Hybrid in motion: {title}"), &head);
    let percent = |share: f64| format!("{:.2} %", share * 100.0);
    for row in rows {
        table.row(vec![
            row.settings.clone(),
            percent(row.error),
            percent(row.error_trimmed),
            percent(row.noise),
            percent(row.bias),
            format!("{:.2}", row.frame_ms),
        ]);
    }
    table.note("sqrt(relMSE) against the same pipeline at rest, of single frames; trimmed: without the 0.1 % of pixels where it is largest; noise from two runs with other random numbers.");
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_is_all_that_the_variants_of_a_filter_differ_by() {
        let all = variants(&ViewSettings::default());
        assert_eq!(all.len(), 1 + 2 * MEMORIES.len());
        let shortest = ViewSettings { temporal_max_history: MEMORIES[0], ..all[6].1.clone() };
        assert_eq!(all[1].1, shortest);
        assert_eq!(all[6].0, "temporal, 48 frames");
    }
}
