//! What the settings of `hybrid` cost and how far their pictures are from the truth. Enters: a project, sizes. Leaves: milliseconds
//! of a frame and of its passes, and the error against a picture of many samples that were not denoised.

use std::path::PathBuf;

use caustica_renderer::gpu::DeviceKind;
use caustica_renderer::{
    ErrorMetrics, Pipeline, Primary, Radiance, ReflectionRate, ShadowRate, ViewSettings,
};
use clap::Args;
use serde::Serialize;
use serde_json::json;

use super::series::{Series, Spread, passes_ms};
use super::table::{Table, times};
use super::{Bench, Measured};
use crate::cli::shot::parse_size;
use crate::session::{Session, SessionOptions, load};

/// Frames that are timed for each picture on a card: long enough for its clocks to rise.
const TIMED_FRAMES: u32 = 48;
/// What is known of the passes is so many frames old, and one frame belongs to what was before.
const LATE: u32 = 3;

const PROJECT: &str = "projects/gallery/gallery.caustica.json";

/// Arguments of suite `hybrid`.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Suite hybrid")]
pub(super) struct HybridArgs {
    /// Project or model that is rendered
    #[arg(long, value_name = "FILE", default_value = PROJECT)]
    pub(super) project: PathBuf,
    /// Columns and rows (default: 1280x720, with a processor as the device 320x180)
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Samples of each picture, one a frame
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(2..))]
    samples: u32,
    /// Samples of the reference (default: 1024, with a processor as the device 64)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    reference_samples: Option<u32>,
    /// Pictures of each variant, which take turns, each of other random numbers
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
}

/// One choice of settings.
struct Variant {
    name: &'static str,
    set: fn(&mut ViewSettings),
}

/// The first is what the others are compared with.
const VARIANTS: [Variant; 8] = [
    Variant { name: "not denoised", set: |_| () },
    Variant { name: "--primary raster", set: |settings| settings.primary = Primary::Raster },
    Variant { name: "--primary rays", set: |settings| settings.primary = Primary::Rays },
    Variant { name: "--denoise temporal", set: |settings| denoise(settings, false) },
    Variant { name: "--denoise full", set: |settings| denoise(settings, true) },
    Variant {
        name: "--denoise full --reflection-rate half",
        set: |settings| {
            denoise(settings, true);
            settings.reflection_rate = ReflectionRate::Half;
        },
    },
    Variant {
        name: "--denoise full --shadow-rate penumbra",
        set: |settings| {
            denoise(settings, true);
            settings.shadow_rate = ShadowRate::Penumbra;
        },
    },
    Variant {
        name: "--denoise full, both rates",
        set: |settings| {
            denoise(settings, true);
            settings.reflection_rate = ReflectionRate::Half;
            settings.shadow_rate = ShadowRate::Penumbra;
        },
    },
];

fn denoise(settings: &mut ViewSettings, spatial: bool) {
    (settings.temporal, settings.spatial, settings.denoise_stills) = (true, spatial, true);
}

/// Passes that are shown, by the beginnings of their labels.
const PASSES: [(&str, &[&str]); 4] = [
    ("first surfaces", &["gbuffer"]),
    ("shadow", &["shadow"]),
    ("shading", &["shading"]),
    ("denoiser", &["temporal", "denoise"]),
];

/// Difference from the reference, all pixels and channels, means over the rounds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Error {
    /// Mean of (x - r)^2 / (r^2 + 0.01), r the reference.
    rel_mse: f64,
    /// Without the worst 0.1 % of pixels.
    rel_mse_999: f64,
    /// Mean luminance (Rec. 709), by that of the reference.
    luminance: f64,
}

/// Figures of one variant.
#[derive(Debug, Serialize)]
struct Row {
    settings: &'static str,
    /// Device time of a frame that has a past.
    frame_ms: Spread,
    passes_ms: Vec<(&'static str, Spread)>,
    /// Frame time by that of the first variant.
    ratio: Option<f64>,
    /// Shadow rays of the last frame by those of the first one, which has no past; none where all are traced anyway.
    shadow_rays_share: Option<f64>,
    error: Error,
}

/// What is measured of one variant, round after round.
#[derive(Default)]
struct Tally {
    frame: Series,
    passes: [Series; PASSES.len()],
    /// Of the first frames, and of the last ones.
    shadow_rays: [u64; 2],
    error: Error,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let args = &bench.hybrid;
    let on_processor = bench.device.kind() == DeviceKind::Cpu;
    let (extent_px, samples, many) = match () {
        () if bench.quick => ([64, 36], 2, 4),
        () if on_processor => ([320, 180], args.samples, 64),
        () => ([1280, 720], args.samples, 1024),
    };
    let extent_px = args.size.unwrap_or(extent_px);
    let many = args.reference_samples.unwrap_or(many);
    let rounds = if bench.quick { 1 } else { args.rounds };
    let options =
        SessionOptions { shaders: bench.shaders.clone(), extent: extent_px, ..SessionOptions::default() };
    let mut session = Session::new(&bench.device, options)?;
    session.open(&args.project, load(&args.project, false, &|_, _| ())?)?;
    let of_project =
        ViewSettings { pipeline: Pipeline::Hybrid, temporal: false, ..session.settings().clone() };
    let bar = bench.bar("hybrid", VARIANTS.len() * rounds as usize + 1);
    // Of random numbers that no round has.
    session.set_settings(ViewSettings { seed: u32::MAX, ..of_project.clone() });
    let reference = picture(&mut session, extent_px, many)?.mean;
    bar.inc(1);
    let mut tallies: [Tally; VARIANTS.len()] = Default::default();
    for round in 0..rounds {
        for (variant, tally) in VARIANTS.iter().zip(&mut tallies) {
            bar.set_message(variant.name);
            let mut settings = ViewSettings { seed: round, ..of_project.clone() };
            (variant.set)(&mut settings);
            session.set_settings(settings);
            let picture = picture(&mut session, extent_px, samples)?;
            let timed = if on_processor || bench.quick { samples } else { TIMED_FRAMES };
            time_frames(&mut session, extent_px, timed, tally)?;
            tally.shadow_rays = [0, 1].map(|i| tally.shadow_rays[i] + picture.shadow_rays[i]);
            let picture = Radiance::new(extent_px, &picture.mean)?;
            tally.compare(&Radiance::new(extent_px, &reference)?, &picture, rounds)?;
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    let rows = rows(&tallies);
    let figures = json!({
        "project": args.project, "extent_px": extent_px, "samples": samples, "rounds": rounds,
        "reference_samples": many, "rows": rows,
    });
    let title = format!(
        "{}, {} x {}, {samples} samples, {rounds} rounds, against {many} samples",
        args.project.display(),
        extent_px[0],
        extent_px[1]
    );
    Ok(Measured { figures, tables: vec![time_table(&title, &rows), error_table(&title, &rows)] })
}

struct Picture {
    mean: Vec<[f32; 3]>,
    /// Of the first frame and of the last one.
    shadow_rays: [u64; 2],
}

/// Goes on with a picture without a wait between its frames: a card that rests lowers its clocks.
fn time_frames(
    session: &mut Session,
    extent_px: [u32; 2],
    frames: u32,
    tally: &mut Tally,
) -> anyhow::Result<()> {
    for frame in 0..frames + LATE {
        session.render_frame(extent_px)?;
        if frame >= LATE {
            tally.take(session);
        }
    }
    Ok(())
}

/// So many frames of one sample each.
fn picture(session: &mut Session, extent_px: [u32; 2], samples: u32) -> anyhow::Result<Picture> {
    let mut first = 0;
    for frame in 0..samples {
        session.render_frame(extent_px)?;
        if frame == 0 {
            // Counts are those of the last frame only after everything was read.
            session.read_back()?;
            first = session.statistics().shadow_rays;
        }
    }
    let mean = session.read_back()?.mean;
    Ok(Picture { mean, shadow_rays: [first, session.statistics().shadow_rays] })
}

impl Tally {
    fn take(&mut self, session: &Session) {
        let statistics = session.statistics();
        self.frame.push(passes_ms(&statistics.passes, &[""]));
        for ((_, labels), series) in PASSES.iter().zip(&mut self.passes) {
            series.push(passes_ms(&statistics.passes, labels));
        }
    }

    /// Adds the error of one of `rounds` pictures.
    fn compare(
        &mut self,
        reference: &Radiance<'_>,
        picture: &Radiance<'_>,
        rounds: u32,
    ) -> anyhow::Result<()> {
        let error = ErrorMetrics::of(reference, picture)?;
        let share = 1.0 / f64::from(rounds);
        self.error.rel_mse += share * error.rel_mse;
        self.error.rel_mse_999 += share * error.rel_mse_trimmed;
        self.error.luminance += share * error.luminance_ratio;
        Ok(())
    }
}

fn rows(tallies: &[Tally]) -> Vec<Row> {
    let base = tallies.first().map(|tally| tally.frame.spread()).unwrap_or_default();
    let row = |(variant, tally): (&Variant, &Tally)| {
        let [first, last] = tally.shadow_rays.map(|rays| rays as f64);
        Row {
            settings: variant.name,
            frame_ms: tally.frame.spread(),
            passes_ms: PASSES.iter().zip(&tally.passes).map(|(pass, ms)| (pass.0, ms.spread())).collect(),
            ratio: tally.frame.spread().over(&base),
            shadow_rays_share: (first > 0.0).then(|| last / first),
            error: tally.error,
        }
    };
    VARIANTS.iter().zip(tallies).map(row).collect()
}

fn time_table(title: &str, rows: &[Row]) -> Table {
    let passes = PASSES.map(|(name, _)| name);
    let head: Vec<&str> = ["settings", "frame", "ratio"].into_iter().chain(passes).collect();
    let mut table = Table::new(format!("Hybrid, device ms: {title}"), &head);
    for row in rows {
        let of_frame = [row.settings.to_owned(), row.frame_ms.to_string(), times(row.ratio)];
        let of_passes = row.passes_ms.iter().map(|(_, ms)| ms.to_string());
        table.row(of_frame.into_iter().chain(of_passes).collect());
    }
    table.note("A frame is one sample a pixel.");
    table
}

fn error_table(title: &str, rows: &[Row]) -> Table {
    let head = ["settings", "relMSE", "without the worst 0.1 %", "mean luminance", "shadow rays traced"];
    let mut table = Table::new(format!("Hybrid, error: {title}"), &head);
    for row in rows {
        let Error { rel_mse, rel_mse_999, luminance } = row.error;
        let share = row.shadow_rays_share.map_or_else(String::new, |share| format!("{:.1} %", share * 100.0));
        table.row(vec![
            row.settings.to_owned(),
            format!("{rel_mse:.4}"),
            format!("{rel_mse_999:.4}"),
            format!("{luminance:.4}"),
            share,
        ]);
    }
    table.note("relMSE: mean of (x - r)^2 / (r^2 + 0.01); luminance by that of the reference.");
    table
}
