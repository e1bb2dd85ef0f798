//! Edits of other kinds than a move, on one node of documents of more and more nodes. Enters: sessions. Leaves: host time of
//! edit, sync and apply, by kind and size, and device time of the builds of the TLAS.

use std::time::Instant;

use caustica_renderer::gpu::BuildMode;
use caustica_renderer::{AccelBench, TlasWork};
use caustica_scene::{Edit, Material};
use indicatif::ProgressBar;
use serde::Serialize;

use super::crowd::Crowd;
use super::moves::{Pair, TLAS_PASS, WAIT_MS, goes_on};
use super::series::{Series, Spread, passes_ms};
use super::table::{Table, count, times};
use crate::session::Lap;

/// What is done to a node.
type Step = fn(&mut Crowd, usize) -> anyhow::Result<()>;

const UNDO: &str = "undo of it";

/// In this order within a round: an undo takes back what stands before it.
const STEPS: [(&str, Step); 9] = [
    ("hide", hide),
    (UNDO, undo),
    ("give a material", give_material),
    (UNDO, undo),
    ("delete", delete),
    (UNDO, undo),
    ("copy", Crowd::copy),
    (UNDO, undo),
    ("change values of a material", change_material),
];

/// Host and device time of one kind of edit in one document.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    edit: &'static str,
    /// Of what was taken back, when this is an undo.
    undone: Option<&'static str>,
    nodes: usize,
    scene_ms: Spread,
    /// How often the TLAS was built, and what that took on the device.
    tlas_builds: usize,
    tlas_build_ms: Spread,
    /// The bare TLAS built in the same rounds.
    bare_build_ms: Spread,
}

#[derive(Clone, Default)]
struct Tally {
    scene: Series,
    builds: usize,
    tlas: Series,
    bare: Series,
}

/// How many steps [`run`] takes for a document and round.
pub(super) const fn steps() -> usize {
    STEPS.len()
}

pub(super) fn run(
    accel: &mut AccelBench<'_>,
    pairs: &mut [Pair],
    rounds: usize,
    bar: &ProgressBar,
) -> anyhow::Result<Vec<Row>> {
    let mut tallies = vec![vec![Tally::default(); STEPS.len()]; pairs.len()];
    let start = Instant::now();
    for round in (0..).take_while(|round| goes_on(*round, rounds, start)) {
        for (index, (_, step)) in STEPS.iter().enumerate() {
            for (pair, tally) in pairs.iter_mut().zip(&mut tallies) {
                accel.keep_busy(WAIT_MS)?;
                one_step(accel, pair, *step, round, &mut tally[index])?;
                bar.inc(1);
            }
        }
    }
    let mut rows = Vec::new();
    for (index, (edit, _)) in STEPS.into_iter().enumerate() {
        let undone = (edit == UNDO).then(|| STEPS[index - 1].0);
        for (pair, tally) in pairs.iter().zip(&tallies) {
            let Tally { scene, builds, tlas, bare } = &tally[index];
            rows.push(Row {
                edit,
                undone,
                nodes: pair.crowd.len(),
                scene_ms: scene.spread(),
                tlas_builds: *builds,
                tlas_build_ms: tlas.spread(),
                bare_build_ms: bare.spread(),
            });
        }
    }
    Ok(rows)
}

fn one_step(
    accel: &mut AccelBench<'_>,
    pair: &mut Pair,
    step: Step,
    round: usize,
    tally: &mut Tally,
) -> anyhow::Result<()> {
    let Pair { crowd, bare } = pair;
    let mut lap = Lap::start();
    step(crowd, round)?;
    crowd.session.end_gesture();
    let edit_ms = lap.ms();
    let host = crowd.frame()?.host;
    tally.scene.push(edit_ms + host.sync_ms + host.apply_ms);
    let statistics = crowd.session.statistics();
    if statistics.acceleration.tlas == TlasWork::Built {
        tally.builds += 1;
        tally.tlas.push(passes_ms(&statistics.passes, &[TLAS_PASS]));
        tally.bare.push(accel.run(bare, BuildMode::Build)?);
    }
    Ok(())
}

/// Host time of every edit, and the builds of the TLAS that adding and deleting asks for.
pub(super) fn tables_of(rows: &[Row]) -> [Table; 2] {
    let sizes = rows.len() / STEPS.len();
    let mut head = vec![String::from("edit of one node")];
    head.extend(rows.iter().take(sizes).map(|row| format!("{} nodes", count(row.nodes as u64))));
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let mut host = Table::new("Other edits: edit + sync + apply on the host, ms", &head);
    for of_edit in rows.chunks(sizes.max(1)) {
        let mut cells: Vec<String> = of_edit.iter().take(1).map(|row| row.edit.to_owned()).collect();
        cells.extend(of_edit.iter().map(|row| row.scene_ms.to_string()));
        host.row(cells);
    }
    host.note("Each after a wait, as above.");
    let head = ["nodes", "edit", "accel.tlas, built", "bare TLAS build", "over it", "builds"];
    let mut device = Table::new("Edits that build the TLAS: the device, ms", &head);
    for row in rows.iter().filter(|row| row.tlas_builds > 0) {
        device.row(vec![
            count(row.nodes as u64),
            row.undone.map_or_else(|| row.edit.to_owned(), |undone| format!("undo of: {undone}")),
            row.tlas_build_ms.to_string(),
            row.bare_build_ms.to_string(),
            times(row.tlas_build_ms.over(&row.bare_build_ms)),
            row.tlas_builds.to_string(),
        ]);
    }
    [host, device]
}

fn hide(crowd: &mut Crowd, round: usize) -> anyhow::Result<()> {
    let target = crowd.far_node(round).into();
    Ok(crowd.session.push(Edit::SetVisible { target, visible: false })?)
}

fn give_material(crowd: &mut Crowd, round: usize) -> anyhow::Result<()> {
    let edit = crowd.give_material(crowd.far_node(round), round);
    Ok(crowd.session.push(edit)?)
}

fn delete(crowd: &mut Crowd, round: usize) -> anyhow::Result<()> {
    let node = crowd.far_node(round);
    Ok(crowd.session.push(Edit::RemoveNode { node })?)
}

fn change_material(crowd: &mut Crowd, round: usize) -> anyhow::Result<()> {
    let document = crowd.session.document();
    let Some((material, value)) = document.materials().next() else { return Ok(()) };
    let value = Material { roughness: 0.5 + 0.4 * (round % 2) as f32, ..value.clone() };
    Ok(crowd.session.push(Edit::SetMaterial { material, value: Box::new(value) })?)
}

fn undo(crowd: &mut Crowd, _round: usize) -> anyhow::Result<()> {
    anyhow::ensure!(crowd.session.undo().is_some(), "there was nothing to undo");
    Ok(())
}
