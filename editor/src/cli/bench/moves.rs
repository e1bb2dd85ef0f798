//! One node moves in documents of more and more nodes: what should cost the same whatever the size. Enters: sizes. Leaves:
//! host times, bytes and device times of the frame that shows the move, and after how many frames that is.

use caustica_renderer::gpu::Frames;
use caustica_renderer::{AccelBench, Pipeline, TlasTimes, TlasWork, gpu_types};
use serde::Serialize;
use serde_json::json;

use super::crowd::{Crowd, FAR, plain};
use super::edits;
use super::series::{Series, Spread, passes_ms};
use super::table::{Table, count, figure};
use super::{Bench, Measured};
use crate::session::Lap;

const NODES: [usize; 4] = [1, 1000, 100_000, 1_000_000];
const NODES_QUICK: [usize; 3] = [1, 100, 1000];
const PIPELINES: [Pipeline; 2] = [Pipeline::Raytraced, Pipeline::Hybrid];
/// Unmeasured moves of each document, with a still frame after each: their bytes are counted.
const WARM_UPS: usize = 5;

/// Figures of one document and pipeline.
#[derive(Debug, Default, Serialize)]
struct Row {
    nodes: usize,
    pipeline: &'static str,
    moves: usize,
    /// The edit itself.
    edit_ms: Spread,
    /// Drained and flattened.
    sync_ms: Spread,
    /// Taken into tables and acceleration structures.
    apply_ms: Spread,
    /// The three together: all that could grow with the scene or the change.
    scene_ms: Spread,
    /// Passes of the view recorded.
    render_ms: Spread,
    /// `begin_frame` less the waiting for the device.
    begin_frame_ms: Spread,
    submit_ms: Spread,
    /// Uploaded in the frame of a move, less the constants of a frame.
    moved_bytes: u64,
    /// Uploaded in the still frame after it, likewise.
    settled_bytes: u64,
    constant_bytes: u64,
    /// Device time of descriptors, BLASes and TLAS.
    accel_ms: Spread,
    /// As many instances of one cube, nothing else in the program.
    bare_tlas: Option<TlasTimes>,
    /// Of all passes.
    device_ms: Spread,
    tlas_refits: u64,
    tlas_builds: u64,
    blas_builds: u64,
    latency_frames: u32,
}

#[derive(Default)]
struct Tally {
    row: Row,
    edit: Series,
    sync: Series,
    apply: Series,
    scene: Series,
    render: Series,
    begin_frame: Series,
    submit: Series,
    accel: Series,
    device: Series,
}

/// The passes that bring acceleration structures up to date.
pub(super) const ACCEL_PASSES: [&str; 2] = ["accel.", "instance_descriptors"];

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let sizes = bench.sizes(&NODES, &NODES_QUICK);
    let rounds = if bench.quick { 12 } else { 60 };
    let edit_rounds = if bench.quick { 3 } else { 20 };
    let steps = 1 + PIPELINES.len() * (1 + rounds) + edits::steps() * edit_rounds;
    let bar = bench.bar("moves", sizes.len() * steps);
    let mut crowds = Vec::new();
    for size in sizes {
        bar.set_message(format!("document of {size} nodes"));
        crowds.push(Crowd::new(bench, *size, Pipeline::Raytraced)?);
        bar.inc(1);
    }
    let mut rows = Vec::new();
    for pipeline in PIPELINES {
        let mut tallies = Vec::new();
        for crowd in &mut crowds {
            // Right before the moves, so that both meet the machine in the same mood.
            bar.set_message("bare TLAS");
            let bare_tlas = bare_tlas(bench, crowd.len() as u32)?;
            bar.inc(1);
            bar.set_message(format!("{} warms up", pipeline.name()));
            let row = Row { bare_tlas: Some(bare_tlas), ..warm_up(crowd, pipeline)? };
            tallies.push(Tally { row, ..Tally::default() });
        }
        // One move in each document after the other, so that a slow second of the machine falls on all of them.
        bar.set_message(pipeline.name());
        for round in 0..rounds {
            for (crowd, tally) in crowds.iter_mut().zip(&mut tallies) {
                one_move(crowd, round, tally)?;
                bar.inc(1);
            }
        }
        for (crowd, tally) in crowds.iter_mut().zip(tallies) {
            let row = tally.finish();
            rows.push(Row { latency_frames: crowd.latency_frames()?, ..row });
        }
    }
    bar.set_message("other edits");
    crowds.iter_mut().for_each(|crowd| crowd.session.set_settings(plain(Pipeline::Raytraced)));
    let edits = edits::run(&mut crowds, edit_rounds, &bar)?;
    bar.finish_and_clear();
    let documents: Vec<_> = crowds
        .iter()
        .map(|crowd| {
            json!({ "nodes": crowd.len(), "document_s": crowd.document_s, "first_frame_s": crowd.first_frame_s })
        })
        .collect();
    let tables =
        vec![host_table(&rows), device_table(&rows), edits::table_of(&edits), document_table(&crowds)];
    let figures = json!({ "rows": rows, "edits": edits, "documents": documents });
    Ok(Measured { figures, tables })
}

/// The TLAS alone, without the program around it: the floor of this very run.
fn bare_tlas(bench: &Bench, instances: u32) -> anyhow::Result<TlasTimes> {
    let mut frames = Frames::new(&bench.device)?;
    Ok(AccelBench::new(&bench.device, &mut frames)?.instances(instances)?)
}

fn warm_up(crowd: &mut Crowd, pipeline: Pipeline) -> anyhow::Result<Row> {
    crowd.session.set_settings(plain(pipeline));
    // Compaction and what else is left to later frames comes to its end.
    for _ in 0..8 {
        crowd.frame()?;
    }
    let constant_bytes = crowd.session.statistics().uploaded_bytes;
    let mut row = Row { nodes: crowd.len(), pipeline: pipeline.name(), constant_bytes, ..Row::default() };
    for round in 0..WARM_UPS {
        let edit = crowd.next_move(round);
        crowd.session.push(edit)?;
        crowd.session.end_gesture();
        crowd.frame()?;
        row.moved_bytes = crowd.session.statistics().uploaded_bytes.saturating_sub(constant_bytes);
        crowd.frame()?;
        row.settled_bytes = crowd.session.statistics().uploaded_bytes.saturating_sub(constant_bytes);
    }
    Ok(row)
}

fn one_move(crowd: &mut Crowd, round: usize, tally: &mut Tally) -> anyhow::Result<()> {
    let edit = crowd.next_move(round * FAR);
    let mut lap = Lap::start();
    crowd.session.push(edit)?;
    crowd.session.end_gesture();
    let edit_ms = lap.ms();
    let cost = crowd.frame()?;
    let host = cost.host;
    tally.edit.push(edit_ms);
    tally.sync.push(host.sync_ms);
    tally.apply.push(host.apply_ms);
    tally.scene.push(edit_ms + host.sync_ms + host.apply_ms);
    tally.render.push(host.render_ms);
    tally.begin_frame.push(host.sync_ms + host.apply_ms + host.render_ms);
    tally.submit.push(cost.submit_ms);
    let statistics = crowd.session.statistics();
    tally.accel.push(passes_ms(&statistics.passes, &ACCEL_PASSES));
    tally.device.push(statistics.passes.iter().map(|(_, ms)| ms).sum());
    anyhow::ensure!(statistics.acceleration.tlas != TlasWork::Kept, "a move changed nothing");
    tally.row.moves += 1;
    tally.row.tlas_refits += u64::from(statistics.acceleration.tlas == TlasWork::Refit);
    tally.row.tlas_builds += u64::from(statistics.acceleration.tlas == TlasWork::Built);
    tally.row.blas_builds += statistics.acceleration.blas_built;
    Ok(())
}

impl Tally {
    fn finish(self) -> Row {
        Row {
            edit_ms: self.edit.spread(),
            sync_ms: self.sync.spread(),
            apply_ms: self.apply.spread(),
            scene_ms: self.scene.spread(),
            render_ms: self.render.spread(),
            begin_frame_ms: self.begin_frame.spread(),
            submit_ms: self.submit.spread(),
            accel_ms: self.accel.spread(),
            device_ms: self.device.spread(),
            ..self.row
        }
    }
}

fn host_table(rows: &[Row]) -> Table {
    let head = [
        "nodes",
        "pipeline",
        "edit",
        "sync",
        "apply",
        "edit + sync + apply",
        "begin_frame without waiting",
        "submit",
        "bytes, moved",
        "bytes, settled",
    ];
    let mut table = Table::new("One node moves: the host, ms", &head);
    for row in rows {
        table.row(vec![
            count(row.nodes as u64),
            row.pipeline.to_owned(),
            row.edit_ms.to_string(),
            row.sync_ms.to_string(),
            row.apply_ms.to_string(),
            row.scene_ms.to_string(),
            row.begin_frame_ms.to_string(),
            row.submit_ms.to_string(),
            count(row.moved_bytes),
            count(row.settled_bytes),
        ]);
    }
    let constants = rows.first().map_or(0, |row| row.constant_bytes);
    table.note(format!(
        "Bytes are those of one moved node; the constants of a frame ({constants} bytes, its record {}) are taken off. \
         Settled: the frame after the move, in which the previous transform becomes the present one. The documents take \
         turns, the smallest after the largest, whose frame leaves it cold caches.",
        size_of::<gpu_types::Frame>()
    ));
    table
}

fn device_table(rows: &[Row]) -> Table {
    let head = [
        "nodes",
        "pipeline",
        "accel.*, descriptors",
        "bare TLAS refit",
        "bare TLAS build",
        "TLAS refitted, built",
        "all passes",
        "frames until shown",
    ];
    let mut table = Table::new("One node moves: the device, ms", &head);
    for row in rows {
        let bare =
            |of: fn(&TlasTimes) -> f64| row.bare_tlas.as_ref().map_or_else(String::new, |t| figure(of(t)));
        table.row(vec![
            count(row.nodes as u64),
            row.pipeline.to_owned(),
            row.accel_ms.to_string(),
            bare(|times| times.refit_ms),
            bare(|times| times.build_ms),
            format!("{}, {}", row.tlas_refits, row.tlas_builds),
            row.device_ms.to_string(),
            row.latency_frames.to_string(),
        ]);
    }
    table.note("Bare: as many instances of one cube, nothing else in the program (`AccelBench`), right before the moves.");
    table
}

fn document_table(crowds: &[Crowd]) -> Table {
    let mut table = Table::new("The documents, seconds", &["nodes", "made by edits", "first picture"]);
    for crowd in crowds {
        table.row(vec![count(crowd.len() as u64), figure(crowd.document_s), figure(crowd.first_frame_s)]);
    }
    table
}
