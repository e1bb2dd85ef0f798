//! From saving a shader to the first picture made with it, for each main file of every pipeline, beside what the driver itself takes
//! to make the pipelines; and how long frames take meanwhile. Enters: a project. Leaves: milliseconds.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use caustica_renderer::gpu::DeviceKind;
use caustica_renderer::shader::ShaderSources;
use caustica_renderer::{NeedsMode, Pipeline, Primary, Show, ViewSettings, WakeFn};
use serde::Serialize;
use serde_json::json;

use super::series::{Series, Spread, passes_ms};
use super::table::{Table, figure, times};
use super::{Bench, Measured};
use crate::session::{Session, SessionOptions, load};
use crate::ui_state::write_built_in;

/// Frames whose times are the measure for those during a change.
const STILL_FRAMES: usize = 40;
/// Longer than this no change takes.
const PATIENCE: Duration = Duration::from_secs(120);
const MAIN: &str = "void main() {";

/// Figures of one file.
#[derive(Debug, Serialize)]
struct Row {
    pipeline: &'static str,
    file: String,
    edits: u32,
    /// From before the file is written to the end of the first frame that shows it.
    latency_ms: Spread,
    /// Stages from GLSL to SPIR-V.
    compile_ms: Spread,
    /// Pipelines made by the driver.
    driver_ms: Spread,
    /// Pipelines that hold the file.
    pipelines: usize,
    /// Time of a frame on the host while nothing changes.
    frame_ms: f64,
    /// The longest frame between the save and the frame that takes it over.
    longest_frame_ms: f64,
}

/// What ray-tracing pipelines cost in each frame that are linked of groups.
#[derive(Debug, Serialize)]
struct LinkedRow {
    way: String,
    /// Device time of a frame: pipelines made at once, as without edits.
    at_once_ms: Spread,
    linked_ms: Spread,
    ratio: Option<f64>,
}

/// Pictures that are made most often, with what their scene needs; and views that together use every other stage, with all of it.
const WAYS: [(Pipeline, Primary, NeedsMode, Show); 7] = [
    (Pipeline::Hybrid, Primary::Raster, NeedsMode::Auto, Show::Image),
    (Pipeline::Hybrid, Primary::Rays, NeedsMode::Auto, Show::Image),
    (Pipeline::Path, Primary::Rays, NeedsMode::Auto, Show::Image),
    (Pipeline::Hybrid, Primary::Raster, NeedsMode::All, Show::Shadow),
    (Pipeline::Raster, Primary::Raster, NeedsMode::All, Show::Normal),
    (Pipeline::Raster, Primary::Raster, NeedsMode::All, Show::Wireframe),
    (Pipeline::Raster, Primary::Raster, NeedsMode::All, Show::NonFinite),
];
/// The endings of main files.
const STAGES: [&str; 8] = ["comp", "vert", "frag", "rgen", "rchit", "rahit", "rmiss", "rint"];

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let on_processor = bench.device.kind() == DeviceKind::Cpu;
    let (extent_px, edits) = match () {
        () if bench.quick => ([32, 18], 1),
        () if on_processor => ([96, 54], 5),
        () => ([1280, 720], 20),
    };
    let mut seen = BTreeSet::new();
    let (mut rows, mut linked) = (Vec::new(), Vec::new());
    for (pipeline, primary, needs, show) in WAYS {
        if bench.quick && needs == NeedsMode::All {
            continue;
        }
        let folder = tempfile::tempdir()?;
        write_built_in(folder.path()).map_err(anyhow::Error::msg)?;
        let settings = ViewSettings { pipeline, primary, needs, show, ..ViewSettings::default() };
        let mut session = session_of(bench, Some(folder.path()), &settings, extent_px)?;
        let files: Vec<String> =
            session.shader_files().keys().filter(|file| seen.insert((*file).clone())).cloned().collect();
        let bar = bench.bar(pipeline.name(), files.len());
        for file in files {
            bar.set_message(file.clone());
            rows.extend(row(&mut session, folder.path(), &file, extent_px, edits)?);
            bar.inc(1);
            if bench.quick && rows.len() >= 2 {
                break;
            }
        }
        bar.finish_and_clear();
        if needs == NeedsMode::Auto {
            linked.push(linked_row(bench, &mut session, extent_px)?);
        }
    }
    let is_stage = |file: &String| STAGES.contains(&file.rsplit('.').next().unwrap_or_default());
    let not_measured = ShaderSources::built_in_files().into_iter().filter(is_stage);
    let not_measured: Vec<String> =
        not_measured.filter(|file| rows.iter().all(|row: &Row| row.file != *file)).collect();
    let figures =
        json!({ "extent_px": extent_px, "rows": rows, "linked": linked, "not_measured": not_measured });
    Ok(Measured { figures, tables: vec![table(&rows, &not_measured), linked_table(&linked)] })
}

/// Frame times of two sessions that show the same, taking turns.
fn linked_row(bench: &Bench, linked: &mut Session, extent_px: [u32; 2]) -> anyhow::Result<LinkedRow> {
    let settings = linked.settings().clone();
    let mut whole = session_of(bench, None, &settings, extent_px)?;
    let (mut at_once, mut of_groups) = (Series::default(), Series::default());
    for _ in 0..if bench.quick { 1 } else { 5 } {
        for (session, series) in [(&mut whole, &mut at_once), (&mut *linked, &mut of_groups)] {
            for index in 0..STILL_FRAMES {
                session.render_frame(extent_px)?;
                // The first ones tell of frames before.
                if index >= 4 {
                    series.push(passes_ms(&session.statistics().passes, &[""]));
                }
            }
            session.finish()?;
        }
    }
    let (at_once_ms, linked_ms) = (at_once.spread(), of_groups.spread());
    let way =
        format!("{}, first surfaces by {:?}", settings.pipeline.name(), settings.primary).to_lowercase();
    Ok(LinkedRow { way, at_once_ms, linked_ms, ratio: linked_ms.over(&at_once_ms) })
}

/// `folder`: shaders are edited there.
fn session_of(
    bench: &Bench,
    folder: Option<&Path>,
    settings: &ViewSettings,
    extent: [u32; 2],
) -> anyhow::Result<Session> {
    let options = SessionOptions {
        shaders: folder.map(Path::to_owned),
        watch_shaders: folder.map(|_| WakeFn(Arc::new(|| ()))),
        settings: settings.clone(),
        extent,
        // As only then there is a stage that encodes for one.
        window: settings.needs == NeedsMode::All,
        ..SessionOptions::default()
    };
    let mut session = Session::new(&bench.device, options)?;
    let project = &bench.hybrid.project;
    let loaded = load(project, false, &|_, _| ()).with_context(|| project.display().to_string())?;
    session.open(project, loaded)?;
    session.set_settings(settings.clone());
    for _ in 0..STILL_FRAMES {
        session.render_frame(extent)?;
    }
    session.finish()?;
    Ok(session)
}

fn row(
    session: &mut Session,
    folder: &Path,
    file: &str,
    extent_px: [u32; 2],
    edits: u32,
) -> anyhow::Result<Option<Row>> {
    let path = folder.join(file);
    let text = std::fs::read_to_string(&path)?;
    if !text.contains(MAIN) {
        return Ok(None);
    }
    let (mut latency, mut compile, mut driver, mut still) =
        (Series::default(), Series::default(), Series::default(), Series::default());
    let (mut longest_frame_ms, mut pipelines) = (0.0_f64, 0);
    for edit in 0..edits {
        for _ in 0..STILL_FRAMES / edits.max(1) as usize + 1 {
            let start = Instant::now();
            session.render_frame(extent_px)?;
            still.push(ms_since(start));
        }
        // A variable that nothing reads: the same picture from another module, so that no cache of the driver knows it.
        let number = std::process::id().wrapping_mul(1000).wrapping_add(edit);
        let edited = text.replacen(MAIN, &format!("{MAIN}\n    float edit_of_bench = {number}.0;\n"), 1);
        let before = session.shader_status().reloads;
        let saved = Instant::now();
        std::fs::write(&path, edited)?;
        loop {
            let start = Instant::now();
            session.render_frame(extent_px)?;
            let status = session.shader_status();
            if status.reloads > before {
                session.finish()?;
                latency.push(ms_since(saved));
                let last = status.last.context("a reload without figures")?;
                compile.push(last.compile_ms);
                driver.push(last.driver_ms);
                pipelines = last.counts[1];
                break;
            }
            longest_frame_ms = longest_frame_ms.max(ms_since(start));
            if let Some(fault) = status.faults.first() {
                bail!("the edit was refused: {fault}");
            }
            if saved.elapsed() > PATIENCE {
                bail!("{file}: the edit was not noticed");
            }
        }
    }
    let before = session.shader_status().reloads;
    std::fs::write(&path, &text)?;
    let saved = Instant::now();
    while session.shader_status().reloads == before && saved.elapsed() < PATIENCE {
        session.render_frame(extent_px)?;
    }
    Ok(Some(Row {
        pipeline: session.settings().pipeline.name(),
        file: file.to_owned(),
        edits,
        latency_ms: latency.spread(),
        compile_ms: compile.spread(),
        driver_ms: driver.spread(),
        pipelines,
        frame_ms: still.spread().median,
        longest_frame_ms,
    }))
}

fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

fn table(rows: &[Row], not_measured: &[String]) -> Table {
    let head = [
        "pipeline",
        "file",
        "saved to shown",
        "GLSL to SPIR-V",
        "driver",
        "beyond the driver",
        "pipelines",
        "frame",
        "longest frame meanwhile",
    ];
    let mut table = Table::new("From saving a shader to the picture made with it, ms", &head);
    for row in rows {
        let beyond = row.latency_ms.median - row.driver_ms.median;
        table.row(vec![
            row.pipeline.to_owned(),
            row.file.clone(),
            row.latency_ms.to_string(),
            row.compile_ms.to_string(),
            row.driver_ms.to_string(),
            figure(beyond),
            row.pipelines.to_string(),
            figure(row.frame_ms),
            figure(row.longest_frame_ms),
        ]);
    }
    table.note(
        "Saved to shown: from before the file is written to the end of the first frame with the new pipelines. Each edit makes \
         another module, which no cache knows. Frame: on the host, two in flight.",
    );
    if !not_measured.is_empty() {
        table.note(format!("Not measured: {}.", not_measured.join(", ")));
    }
    table
}

fn linked_table(rows: &[LinkedRow]) -> Table {
    let head = ["picture", "made at once", "linked", "linked / at once"];
    let mut table = Table::new("Ray-tracing pipelines linked of groups: device ms of a frame", &head);
    for row in rows {
        let [at_once, linked] = [row.at_once_ms, row.linked_ms].map(|spread| spread.to_string());
        table.row(vec![row.way.clone(), at_once, linked, times(row.ratio)]);
    }
    table.note("Linked where shaders are edited; without edits they are made at once.");
    table
}
