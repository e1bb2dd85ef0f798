//! Renders what a report compares. Enters: a session, settings, a reference. Leaves: curves and last pictures.

use std::time::{Duration, Instant};

use caustica_renderer::{
    Accumulated, ErrorMetrics, Halves, Radiance, Split, ViewSettings, flip_hdr, flip_ldr,
};
use indicatif::ProgressBar;
use rayon::prelude::*;

use crate::cli::bench::Series;
use crate::curve::{Curve, Point};
use crate::reference::settings_of_truth;
use crate::session::Session;

/// In turns, so that all of them have the machine's better and worse moments.
const ROUNDS: usize = 5;
/// How long one turn is at least.
const TURN: Duration = Duration::from_millis(200);

/// When to stop, whichever is first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Until {
    pub(super) samples: u64,
    pub(super) seconds: f64,
}

/// The curve of one choice, and its last picture.
#[derive(Debug)]
pub(super) struct Measured {
    pub(super) curve: Curve,
    pub(super) picture: Accumulated,
}

/// Where a run stood when its picture was read.
struct Stop {
    samples: u64,
    gpu_ms: f64,
    wall_s: f64,
    picture: Accumulated,
}

/// The path tracer's picture for what the session shows.
pub(super) fn reference(
    session: &mut Session,
    extent: [u32; 2],
    samples: u64,
    progress: &ProgressBar,
) -> anyhow::Result<Accumulated> {
    let settings = settings_of_truth(session.settings());
    begin(session, &settings, extent)?;
    progress.set_length(samples);
    while session.samples() < samples {
        session.render_frame(extent)?;
        progress.set_position(session.samples());
    }
    session.read_back()
}

/// Renders a choice, looks at it whenever its samples have doubled, and compares.
pub(super) fn measure(
    session: &mut Session,
    settings: &ViewSettings,
    reference: &Accumulated,
    until: Until,
    progress: &ProgressBar,
) -> anyhow::Result<Measured> {
    let extent = reference.extent;
    // Frames that share their past tell nothing of their noise: a second run with other random numbers does.
    let halves = if settings.denoise_stills { Halves::Runs } else { Halves::Streams };
    let first = if halves == Halves::Runs { 1 } else { 2 };
    let mut stops = run(session, settings, extent, first, until, progress)?;
    let others = match halves {
        Halves::Streams => Vec::new(),
        Halves::Runs => {
            let samples = stops.last().map_or(first, |stop| stop.samples);
            let again = ViewSettings { seed: settings.seed.wrapping_add(1), ..settings.clone() };
            let whole = Until { samples, seconds: f64::INFINITY };
            run(session, &again, extent, first, whole, progress)?
        }
    };
    let exposure = settings.exposure_ev.exp2();
    let compare = |(number, stop): (usize, &Stop)| -> anyhow::Result<Point> {
        let pair = others
            .get(number)
            .map(|other| Accumulated::of_runs(reference.extent, [&stop.picture.mean, &other.picture.mean]));
        let split = Split::of(reference, pair.as_ref().unwrap_or(&stop.picture), halves)?;
        point(reference, stop, split, exposure, number + 1 == stops.len())
    };
    // FLIP takes longer than many a picture.
    let points = stops.par_iter().enumerate().map(compare).collect::<anyhow::Result<_>>()?;
    let picture = stops.pop().map_or_else(|| reference.clone(), |stop| stop.picture);
    Ok(Measured { curve: Curve(points), picture })
}

fn point(
    reference: &Accumulated,
    stop: &Stop,
    split: Split,
    exposure: f32,
    is_last: bool,
) -> anyhow::Result<Point> {
    let [truth, seen] = [reference, &stop.picture].map(|image| Radiance::new(image.extent, &image.mean));
    let (truth, seen) = (truth?, seen?);
    Ok(Point {
        samples: stop.samples,
        gpu_ms: stop.gpu_ms,
        wall_s: stop.wall_s,
        metrics: ErrorMetrics::of(&truth, &seen)?,
        flip: flip_ldr(&truth, &seen, exposure)?.mean,
        flip_hdr: if is_last { flip_hdr(&truth, &seen)?.map(|flip| flip.mean) } else { None },
        split,
    })
}

/// Renders from the first sample on and stops at `first`, and whenever there are twice as many.
fn run(
    session: &mut Session,
    settings: &ViewSettings,
    extent: [u32; 2],
    first: u64,
    until: Until,
    progress: &ProgressBar,
) -> anyhow::Result<Vec<Stop>> {
    // Some samplers spread as many points as there will be.
    session.set_sample_target(Some(until.samples))?;
    begin(session, settings, extent)?;
    progress.set_length(until.samples);
    let before_ms = session.total_device_ms();
    let (mut stops, mut wall_s, mut next) = (Vec::new(), 0.0, first);
    loop {
        let start = Instant::now();
        while session.samples() < next {
            session.render_frame(extent)?;
            progress.set_position(session.samples());
        }
        session.finish()?;
        wall_s += start.elapsed().as_secs_f64();
        let gpu_ms = session.total_device_ms() - before_ms;
        stops.push(Stop { samples: next, gpu_ms, wall_s, picture: session.read_back()? });
        // The next stop takes as long again.
        if next >= until.samples || wall_s * 2.0 > until.seconds {
            session.set_sample_target(None)?;
            return Ok(stops);
        }
        next = (next * 2).min(until.samples);
    }
}

/// Shows the settings, with pipelines made and textures in place, at the first sample.
fn begin(session: &mut Session, settings: &ViewSettings, extent: [u32; 2]) -> anyhow::Result<()> {
    session.set_settings(settings.clone());
    loop {
        session.render_frame(extent)?;
        session.finish()?;
        if !session.textures_settle() && !session.builds_in_background() {
            break;
        }
    }
    // Begins anew, without the past of other settings.
    session.set_sample_offset(0)
}

/// Median milliseconds of a sample of each, in turns.
pub(super) fn ms_per_sample(
    session: &mut Session,
    all: &[ViewSettings],
    extent: [u32; 2],
    progress: &ProgressBar,
) -> anyhow::Result<Vec<f64>> {
    let mut times = vec![Series::default(); all.len()];
    progress.set_length(ROUNDS as u64);
    for _ in 0..ROUNDS {
        for (settings, times) in all.iter().zip(&mut times) {
            begin(session, settings, extent)?;
            let (start, before_ms) = (Instant::now(), session.total_device_ms());
            while session.samples() == 0 || start.elapsed() < TURN {
                session.render_frame(extent)?;
            }
            session.finish()?;
            times.push((session.total_device_ms() - before_ms) / session.samples() as f64);
        }
        progress.inc(1);
    }
    Ok(times.iter().map(|times| times.spread().median).collect())
}
