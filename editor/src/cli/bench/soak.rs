//! Thousands of edits, each taken back, with a frame after every step: memory must stay where it was. Enters: how many.
//! Leaves: memory by kind and of the process after some of them.

use std::collections::BTreeMap;

use caustica_renderer::Pipeline;
use caustica_scene::{Edit, NodeId};
use serde::Serialize;
use serde_json::json;

use super::crowd::{Crowd, FAR};
use super::table::{Table, count};
use super::{Bench, Measured, machine};

const NODES: usize = 1000;
/// Cycles after which memory is looked at.
const LOOKS: [usize; 3] = [100, 1000, 10_000];
const LOOKS_QUICK: [usize; 2] = [100, 300];
/// Still frames before a look: what compaction and the retire queue hold comes to its end.
const REST_FRAMES: usize = 8;
/// Largest growth of the process between the last two looks that still counts as steady.
const STEADY_SHARE: f64 = 0.01;

/// Memory after a number of cycles.
#[derive(Clone, Debug, Serialize)]
struct Look {
    cycles: usize,
    /// Bytes on the device by kind, as the program has booked them.
    device_bytes: BTreeMap<&'static str, u64>,
    resident_bytes: Option<u64>,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let looks_at = bench.sizes(&LOOKS, &LOOKS_QUICK);
    let last = looks_at.last().copied().unwrap_or(0);
    let bar = bench.bar("soak", last);
    let mut crowd = Crowd::new(bench, NODES, Pipeline::Hybrid)?;
    let lone = crowd.add_lone()?;
    crowd.frame()?;
    let before = crowd.session.document().clone();
    let mut looks = Vec::new();
    for cycle in 0..last {
        edit(&mut crowd, cycle, lone)?;
        crowd.session.end_gesture();
        crowd.frame_without_waiting()?;
        anyhow::ensure!(crowd.session.undo().is_some(), "there was nothing to undo after cycle {cycle}");
        crowd.frame_without_waiting()?;
        bar.inc(1);
        if looks_at.contains(&(cycle + 1)) {
            looks.push(look(bench, &mut crowd, cycle + 1)?);
        }
    }
    bar.finish_and_clear();
    let unchanged = *crowd.session.document() == before;
    let steady = Steady::of(&looks);
    let table = table_of(&looks, &steady, unchanged);
    let figures =
        json!({ "nodes": NODES, "looks": looks, "steady": steady, "document_unchanged": unchanged });
    Ok(Measured { figures, tables: vec![table] })
}

/// The edit of a cycle.
fn edit(crowd: &mut Crowd, cycle: usize, lone: NodeId) -> anyhow::Result<()> {
    let node = crowd.far_node(cycle);
    let edit = match cycle % 5 {
        0 => crowd.next_move(cycle * FAR),
        1 => Edit::SetVisible { target: node.into(), visible: false },
        // The mesh and the BLAS of the lone node go with it and come back; those of the others stay.
        2 => Edit::RemoveNode { node: if cycle.is_multiple_of(2) { lone } else { node } },
        3 => crowd.give_material(node, cycle),
        _ => return crowd.copy(cycle),
    };
    Ok(crowd.session.push(edit)?)
}

fn look(bench: &Bench, crowd: &mut Crowd, cycles: usize) -> anyhow::Result<Look> {
    for _ in 0..REST_FRAMES {
        crowd.frame()?;
    }
    let device_bytes = bench.device.memory_by_use().into_iter().map(|(kind, n)| (kind.name(), n)).collect();
    Ok(Look { cycles, device_bytes, resident_bytes: machine::resident_bytes() })
}

/// What the last two looks say.
#[derive(Debug, Serialize)]
struct Steady {
    device_growth_bytes: i64,
    resident_growth: Option<f64>,
    steady: bool,
}

impl Steady {
    fn of(looks: &[Look]) -> Self {
        let (Some(now), Some(before)) = (looks.last(), looks.iter().nth_back(1)) else {
            return Self { device_growth_bytes: 0, resident_growth: None, steady: false };
        };
        let total = |look: &Look| look.device_bytes.values().sum::<u64>() as i64;
        let device_growth_bytes = total(now) - total(before);
        let resident = now.resident_bytes.zip(before.resident_bytes);
        let resident_growth = resident.map(|(now, before)| now as f64 / before as f64 - 1.0);
        let steady = now.device_bytes == before.device_bytes
            && resident_growth.is_none_or(|share| share < STEADY_SHARE);
        Self { device_growth_bytes, resident_growth, steady }
    }
}

fn table_of(looks: &[Look], steady: &Steady, unchanged: bool) -> Table {
    let mut kinds: Vec<&'static str> =
        looks.iter().flat_map(|look| look.device_bytes.keys().copied()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let mut head = vec!["cycles"];
    head.extend(&kinds);
    head.push("process, resident");
    let mut table =
        Table::new(format!("Edits taken back, in a scene of {} nodes: bytes", count(NODES as u64)), &head);
    for look in looks {
        let mut row = vec![count(look.cycles as u64)];
        row.extend(kinds.iter().map(|kind| count(look.device_bytes.get(kind).copied().unwrap_or(0))));
        row.push(look.resident_bytes.map_or_else(|| String::from("unknown"), count));
        table.row(row);
    }
    let resident =
        steady.resident_growth.map_or_else(String::new, |share| format!(", process {:+.2} %", share * 100.0));
    table.note(format!(
        "Between the last two: device {:+} bytes{resident}: {}. The document is {} afterwards.",
        steady.device_growth_bytes,
        if steady.steady { "steady" } else { "NOT steady" },
        if unchanged { "as it was" } else { "NOT as it was" },
    ));
    table.note("A cycle moves, hides, deletes, gives a material to or copies a node, renders, undoes and renders again.");
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(cycles: usize, tables: u64, resident: u64) -> Look {
        Look { cycles, device_bytes: BTreeMap::from([("tables", tables)]), resident_bytes: Some(resident) }
    }

    #[test]
    fn steady_means_not_a_byte_on_the_device_and_hardly_one_in_the_process() {
        assert!(Steady::of(&[at(1, 5, 100), at(2, 7, 1000), at(3, 7, 1009)]).steady);
        assert!(!Steady::of(&[at(2, 7, 1000), at(3, 8, 1000)]).steady);
        assert!(!Steady::of(&[at(2, 7, 1000), at(3, 7, 1020)]).steady);
        assert!(!Steady::of(&[at(2, 7, 1000)]).steady, "one look tells nothing");
    }
}
