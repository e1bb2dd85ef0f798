//! One node moves in documents of more and more nodes: what should cost the same whatever the size. Enters: sizes. Leaves:
//! host times, bytes and device times of the frame that shows the move, and after how many frames that is.
//!
//! A round moves three nodes. The first move comes after a wait, as in a window at rest; the second right behind it; before
//! the third the host's caches are emptied. The device is kept at work in between, and the bare structure is refitted in
//! the same round.

mod tables;

use std::time::{Duration, Instant};

use caustica_renderer::gpu::{BuildMode, Frames};
use caustica_renderer::{AccelBench, BareStructure, Pipeline, TlasWork};
use serde::Serialize;
use serde_json::json;

use super::crowd::{Crowd, FAR, FrameCost, plain};
use super::edits;
use super::series::{Series, Spread, passes_ms};
use super::{Bench, Measured};
use crate::session::Lap;

const NODES: [usize; 4] = [1, 1000, 100_000, 1_000_000];
const NODES_QUICK: [usize; 3] = [1, 100, 1000];
const PIPELINES: [Pipeline; 2] = [Pipeline::Raytraced, Pipeline::Hybrid];
/// Unmeasured moves of each document, with a still frame after each: their bytes are counted.
const WARM_UPS: usize = 5;
/// How long the host waits for the device before the first move of a round, milliseconds: more than one frame of a window.
pub(super) const WAIT_MS: f64 = 20.0;
/// Memory that the host walks over to empty its caches, bytes: more than the last level of common processors.
const FLOOD_BYTES: usize = 128 << 20;
/// How long the queue is empty before the refits that are to find a device at rest.
const REST: Duration = Duration::from_millis(100);
const REST_ROUNDS: usize = 8;
/// Rounds of a slow device end after this long, but not before so many.
const ENOUGH: Duration = Duration::from_secs(180);
const FEWEST_ROUNDS: usize = 15;

/// Whether another round of at most `most` is due, `round` of them being done since `start`.
pub(super) fn goes_on(round: usize, most: usize, start: Instant) -> bool {
    round < most && (round < FEWEST_ROUNDS || start.elapsed() < ENOUGH)
}

/// Host time of a move under one condition.
#[derive(Debug, Default, Serialize)]
struct Host {
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
}

/// Figures of one document and pipeline.
#[derive(Debug, Default, Serialize)]
struct Row {
    nodes: usize,
    pipeline: &'static str,
    moves: usize,
    /// By condition, in the order of [`CONDITIONS`].
    host: [Host; 3],
    /// Uploaded in the frame of a move, less the constants of a frame.
    moved_bytes: u64,
    /// Uploaded in the still frame after it, likewise.
    settled_bytes: u64,
    constant_bytes: u64,
    /// Device time of descriptors, BLASes and TLAS.
    accel_ms: Spread,
    /// The TLAS alone.
    tlas_ms: Spread,
    /// Its descriptors.
    descriptors_ms: Spread,
    /// As many instances of one cube, nothing else in the program, refitted in the same rounds.
    bare_refit_ms: Spread,
    tlas_over_bare: Option<f64>,
    /// The same after the queue has been empty for a while.
    bare_refit_at_rest_ms: Spread,
    /// Of all passes.
    device_ms: Spread,
    tlas_refits: u64,
    tlas_builds: u64,
    blas_builds: u64,
    latency_frames: u32,
}

/// What came before a move.
const CONDITIONS: [&str; 3] = ["after a wait", "back to back", "cold caches"];

#[derive(Default)]
struct HostTally {
    edit: Series,
    sync: Series,
    apply: Series,
    scene: Series,
    render: Series,
    begin_frame: Series,
    submit: Series,
}

#[derive(Default)]
struct Tally {
    row: Row,
    host: [HostTally; 3],
    accel: Series,
    tlas: Series,
    descriptors: Series,
    bare_refit: Series,
    at_rest: Series,
    device: Series,
}

/// The passes that bring acceleration structures up to date.
const ACCEL_PASSES: [&str; 2] = ["accel.", DESCRIPTORS_PASS];
pub(super) const TLAS_PASS: &str = "accel.tlas";
const DESCRIPTORS_PASS: &str = "instance_descriptors";

/// A document with a bare TLAS of as many instances.
pub(super) struct Pair {
    pub(super) crowd: Crowd,
    pub(super) bare: BareStructure,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let sizes = bench.sizes(&NODES, &NODES_QUICK);
    let rounds = if bench.quick { 12 } else { 60 };
    let edit_rounds = if bench.quick { 3 } else { 20 };
    let steps = 1 + PIPELINES.len() * rounds + edits::steps() * edit_rounds;
    let bar = bench.bar("moves", sizes.len() * steps);
    let mut frames = Frames::new(&bench.device)?;
    let mut accel = AccelBench::new(&bench.device, &mut frames)?;
    let mut pairs = Vec::new();
    for size in sizes {
        bar.set_message(format!("document of {size} nodes"));
        let crowd = Crowd::new(bench, *size, Pipeline::Raytraced)?;
        pairs.push(Pair { crowd, bare: accel.bare_instances(*size as u32)? });
        bar.inc(1);
    }
    let mut flood = vec![0_u8; FLOOD_BYTES];
    let mut rows = Vec::new();
    for pipeline in PIPELINES {
        bar.set_message(format!("{} warms up", pipeline.name()));
        let mut tallies = Vec::new();
        for pair in &mut pairs {
            tallies.push(Tally { row: warm_up(&mut pair.crowd, pipeline)?, ..Tally::default() });
        }
        accel.warm_up()?;
        // One round of each document after the other, so that a slow second of the machine falls on all of them.
        bar.set_message(pipeline.name());
        let start = Instant::now();
        for round in (0..).take_while(|round| goes_on(*round, rounds, start)) {
            for (pair, tally) in pairs.iter_mut().zip(&mut tallies) {
                one_round(&mut accel, pair, &mut flood, round, tally)?;
                bar.inc(1);
            }
        }
        for (pair, mut tally) in pairs.iter_mut().zip(tallies) {
            refits_at_rest(&mut accel, &pair.bare, &mut tally.at_rest)?;
            rows.push(Row { latency_frames: pair.crowd.latency_frames()?, ..tally.finish() });
        }
    }
    bar.set_message("other edits");
    pairs.iter_mut().for_each(|pair| pair.crowd.session.set_settings(plain(Pipeline::Raytraced)));
    let edits = edits::run(&mut accel, &mut pairs, edit_rounds, &bar)?;
    bar.finish_and_clear();
    let documents: Vec<_> = pairs
        .iter()
        .map(|Pair { crowd, .. }| {
            json!({ "nodes": crowd.len(), "document_s": crowd.document_s, "first_frame_s": crowd.first_frame_s })
        })
        .collect();
    let figures = json!({ "rows": rows, "edits": edits, "documents": documents });
    let mut shown = tables::of(&rows);
    shown.extend(edits::tables_of(&edits));
    shown.push(tables::documents(&pairs));
    Ok(Measured { figures, tables: shown })
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

fn one_round(
    accel: &mut AccelBench<'_>,
    pair: &mut Pair,
    flood: &mut [u8],
    round: usize,
    tally: &mut Tally,
) -> anyhow::Result<()> {
    let Pair { crowd, bare } = pair;
    accel.keep_busy(WAIT_MS)?;
    one_move(crowd, 3 * round, 0, tally)?;
    one_move(crowd, 3 * round + 1, 1, tally)?;
    crowd.session.finish()?;
    let passes = &crowd.session.statistics().passes;
    tally.accel.push(passes_ms(passes, &ACCEL_PASSES));
    tally.tlas.push(passes_ms(passes, &[TLAS_PASS]));
    tally.descriptors.push(passes_ms(passes, &[DESCRIPTORS_PASS]));
    tally.device.push(passes.iter().map(|(_, ms)| ms).sum());
    // The second of two, as the move's: both find the device's caches the same.
    accel.run(bare, BuildMode::Refit)?;
    tally.bare_refit.push(accel.run(bare, BuildMode::Refit)?);
    // Every line of the processor's caches is written.
    flood.iter_mut().step_by(64).for_each(|byte| *byte = byte.wrapping_add(1));
    one_move(crowd, 3 * round + 2, 2, tally)?;
    crowd.session.finish()
}

fn one_move(crowd: &mut Crowd, index: usize, condition: usize, tally: &mut Tally) -> anyhow::Result<()> {
    let edit = crowd.next_move(index * FAR);
    let mut lap = Lap::start();
    crowd.session.push(edit)?;
    crowd.session.end_gesture();
    let edit_ms = lap.ms();
    let cost = crowd.frame_without_waiting()?;
    tally.host[condition].note(edit_ms, &cost);
    let work = &crowd.session.statistics().acceleration;
    anyhow::ensure!(work.tlas != TlasWork::Kept, "a move changed nothing");
    tally.row.moves += 1;
    tally.row.tlas_refits += u64::from(work.tlas == TlasWork::Refit);
    tally.row.tlas_builds += u64::from(work.tlas == TlasWork::Built);
    tally.row.blas_builds += work.blas_built;
    Ok(())
}

/// What the same work takes on a device that has just been idle.
fn refits_at_rest(
    accel: &mut AccelBench<'_>,
    bare: &BareStructure,
    times: &mut Series,
) -> anyhow::Result<()> {
    for _ in 0..REST_ROUNDS {
        std::thread::sleep(REST);
        times.push(accel.run(bare, BuildMode::Refit)?);
    }
    Ok(())
}

impl HostTally {
    fn note(&mut self, edit_ms: f64, cost: &FrameCost) {
        let host = cost.host;
        self.edit.push(edit_ms);
        self.sync.push(host.sync_ms);
        self.apply.push(host.apply_ms);
        self.scene.push(edit_ms + host.sync_ms + host.apply_ms);
        self.render.push(host.render_ms);
        self.begin_frame.push(host.sync_ms + host.apply_ms + host.render_ms);
        self.submit.push(cost.submit_ms);
    }

    fn finish(self) -> Host {
        Host {
            edit_ms: self.edit.spread(),
            sync_ms: self.sync.spread(),
            apply_ms: self.apply.spread(),
            scene_ms: self.scene.spread(),
            render_ms: self.render.spread(),
            begin_frame_ms: self.begin_frame.spread(),
            submit_ms: self.submit.spread(),
        }
    }
}

impl Tally {
    fn finish(self) -> Row {
        let (tlas_ms, bare_refit_ms) = (self.tlas.spread(), self.bare_refit.spread());
        Row {
            host: self.host.map(HostTally::finish),
            accel_ms: self.accel.spread(),
            tlas_ms,
            descriptors_ms: self.descriptors.spread(),
            bare_refit_ms,
            tlas_over_bare: tlas_ms.over(&bare_refit_ms),
            bare_refit_at_rest_ms: self.at_rest.spread(),
            device_ms: self.device.spread(),
            ..self.row
        }
    }
}
