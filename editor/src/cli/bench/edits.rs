//! Edits of other kinds than a move, on one node of documents of more and more nodes. Enters: sessions. Leaves: host time of
//! edit, sync and apply, by kind and size.

use caustica_scene::{Edit, Material};
use indicatif::ProgressBar;
use serde::Serialize;

use super::crowd::Crowd;
use super::series::{Series, Spread, passes_ms};
use super::table::{Table, count};
use crate::session::Lap;

/// What is done to a node.
type Step = fn(&mut Crowd, usize) -> anyhow::Result<()>;

/// In this order within a round: an undo takes back what stands before it.
const STEPS: [(&str, Step); 9] = [
    ("hide", hide),
    ("undo of it", undo),
    ("give a material", give_material),
    ("undo of it", undo),
    ("delete", delete),
    ("undo of it", undo),
    ("copy", Crowd::copy),
    ("undo of it", undo),
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
    accel_ms: Spread,
}

/// How many steps [`run`] takes for a document and round.
pub(super) const fn steps() -> usize {
    STEPS.len()
}

pub(super) fn run(crowds: &mut [Crowd], rounds: usize, bar: &ProgressBar) -> anyhow::Result<Vec<Row>> {
    let mut tallies = vec![[(); STEPS.len()].map(|()| (Series::default(), Series::default())); crowds.len()];
    for round in 0..rounds {
        for (index, (_, step)) in STEPS.iter().enumerate() {
            for (crowd, tally) in crowds.iter_mut().zip(&mut tallies) {
                let mut lap = Lap::start();
                step(crowd, round)?;
                crowd.session.end_gesture();
                let edit_ms = lap.ms();
                let host = crowd.frame()?.host;
                let (scene, accel) = &mut tally[index];
                scene.push(edit_ms + host.sync_ms + host.apply_ms);
                accel.push(passes_ms(&crowd.session.statistics().passes, &super::moves::ACCEL_PASSES));
                bar.inc(1);
            }
        }
    }
    let mut rows = Vec::new();
    for (index, (edit, _)) in STEPS.into_iter().enumerate() {
        let undone = (edit == "undo of it").then(|| STEPS[index - 1].0);
        for (crowd, tally) in crowds.iter().zip(&tallies) {
            let (scene, accel) = &tally[index];
            let (scene_ms, accel_ms) = (scene.spread(), accel.spread());
            rows.push(Row { edit, undone, nodes: crowd.len(), scene_ms, accel_ms });
        }
    }
    Ok(rows)
}

/// A row a kind of edit, a column a size.
pub(super) fn table_of(rows: &[Row]) -> Table {
    let sizes = rows.len() / STEPS.len();
    let mut head = vec![String::from("edit of one node")];
    head.extend(rows.iter().take(sizes).map(|row| format!("{} nodes", count(row.nodes as u64))));
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let mut table = Table::new("Other edits: edit + sync + apply on the host, ms", &head);
    for of_edit in rows.chunks(sizes.max(1)) {
        let mut cells: Vec<String> = of_edit.iter().take(1).map(|row| row.edit.to_owned()).collect();
        cells.extend(of_edit.iter().map(|row| row.scene_ms.to_string()));
        table.row(cells);
    }
    table
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
