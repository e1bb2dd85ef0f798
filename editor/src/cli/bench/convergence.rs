//! How fast the error of `path` falls with its samples, by sampler. Enters: scenes. Leaves: mean errors over many seeds and the slope
//! of the straight line through their logarithms, -1 for independent samples of finite variance.

use std::path::PathBuf;

use anyhow::Context;
use caustica_renderer::gpu::DeviceKind;
use caustica_renderer::{Accumulated, Halves, Pipeline, Sampler, Split, ViewSettings};
use clap::Args;
use serde::Serialize;
use serde_json::json;

use super::table::Table;
use super::{Bench, Measured};
use crate::curve::slope;
use crate::session::{Session, SessionOptions, ViewCamera, load};

/// The error is that of all pixels; more of them would say nothing else.
const EXTENT: [u32; 2] = [64, 64];
/// The reference has so many times the samples; its own noise, which it tells, is taken off.
const REFERENCE: u64 = 16;
/// Of the reference, none of the seeds that are counted from 1.
const REFERENCE_SEED: u32 = u32::MAX;
const SCENE: &str = "tests/references/cornell-diffuse-f0.gltf";

/// Arguments of suite `convergence`.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Suite convergence")]
pub(super) struct ConvergenceArgs {
    /// Scenes that are rendered
    #[arg(long, value_name = "FILE", value_delimiter = ',', default_value = SCENE)]
    scenes: Vec<PathBuf>,
    /// Most samples, a power of two (default: 4096, with a processor as the device 64)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(4..))]
    most: Option<u64>,
    /// Pictures of each, with other random numbers
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
    seeds: u32,
}

/// The figures of one sampler.
#[derive(Debug, Serialize)]
struct Row {
    scene: PathBuf,
    sampler: &'static str,
    /// relMSE in the mean over the seeds, by samples.
    rel_mse: Vec<(u64, f64)>,
    slope: Option<f64>,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let args = &bench.convergence;
    let default = if bench.device.kind() == DeviceKind::Cpu { 64 } else { 4096 };
    let most = if bench.quick { 4 } else { args.most.unwrap_or(default) };
    let seeds = if bench.quick { 1 } else { args.seeds };
    let options =
        SessionOptions { shaders: bench.shaders.clone(), extent: EXTENT, ..SessionOptions::default() };
    let mut session = Session::new(&bench.device, options)?;
    let bar = bench.bar("convergence", args.scenes.len() * Sampler::ALL.len() * seeds as usize);
    let mut rows = Vec::new();
    for scene in &args.scenes {
        bar.set_message(scene.display().to_string());
        session.open(scene, load(scene, true, &|_, _| ())?).with_context(|| scene.display().to_string())?;
        session.set_camera(ViewCamera::of_document(session.document(), 1.0));
        let of = |sampler, seed| ViewSettings {
            pipeline: Pipeline::Path,
            sampler,
            seed,
            ..ViewSettings::default()
        };
        let reference = &mut None;
        render(
            &mut session,
            &of(Sampler::Independent, REFERENCE_SEED),
            most * REFERENCE,
            |samples, picture| {
                (samples == most * REFERENCE).then(|| *reference = Some(picture));
                Ok(())
            },
        )?;
        let reference = reference.as_ref().context("no reference")?;
        for sampler in Sampler::ALL {
            let mut sums: Vec<(u64, f64)> = Vec::new();
            for seed in 1..=seeds {
                let mut step = 0;
                render(&mut session, &of(sampler, seed), most, |samples, picture| {
                    let error = Split::of(reference, &picture, Halves::Streams)?.total.powi(2);
                    match sums.get_mut(step) {
                        Some((_, sum)) => *sum += error / f64::from(seeds),
                        None => sums.push((samples, error / f64::from(seeds))),
                    }
                    step += 1;
                    Ok(())
                })?;
                bar.inc(1);
            }
            let slope = slope(sums.iter().map(|(samples, error)| (*samples as f64, *error)));
            rows.push(Row { scene: scene.clone(), sampler: sampler.name(), rel_mse: sums, slope });
        }
    }
    bar.finish_and_clear();
    let figures =
        json!({ "extent_px": EXTENT, "seeds": seeds, "reference_samples": most * REFERENCE, "rows": rows });
    Ok(Measured { figures, tables: vec![table(&rows, most, seeds)] })
}

/// Renders from the first sample on; `look` gets the picture at 1, 2, 4 ... samples.
fn render(
    session: &mut Session,
    settings: &ViewSettings,
    most: u64,
    mut look: impl FnMut(u64, Accumulated) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    session.set_settings(settings.clone());
    session.set_sample_target(Some(most))?;
    session.set_sample_offset(0)?;
    let (mut next, mut done) = (1, 0);
    while done < most {
        session.render_frame(EXTENT)?;
        done = session.samples();
        if done == next && !session.textures_settle() {
            look(done, session.read_back()?)?;
            next = (next * 2).min(most);
        }
    }
    Ok(())
}

fn table(rows: &[Row], most: u64, seeds: u32) -> Table {
    let head = ["scene", "sampler", "relMSE, 1 sample", "relMSE, most", "slope"];
    let [width, height] = EXTENT;
    let mut table = Table::new(
        format!("Convergence of path: {width} x {height}, 1 to {most} samples, {seeds} seeds"),
        &head,
    );
    for row in rows {
        let error =
            |end: Option<&(u64, f64)>| end.map_or_else(String::new, |(_, error)| format!("{error:.3e}"));
        table.row(vec![
            row.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            row.sampler.to_owned(),
            error(row.rel_mse.first()),
            error(row.rel_mse.last()),
            row.slope.map_or_else(String::new, |slope| format!("{slope:.3}")),
        ]);
    }
    table.note("Slope of relMSE over samples in logarithms; the noise of the reference, independent samples, is taken off.");
    table
}
