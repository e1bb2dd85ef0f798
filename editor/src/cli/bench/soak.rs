//! Thousands of edits, each taken back, with a frame after every step: memory must stay where it was. Enters: how many.
//! Leaves: memory by kind and of the process after some of them.

use std::collections::{BTreeMap, BTreeSet};

use caustica_renderer::Pipeline;
use caustica_scene::{Edit, NodeId};
use serde::Serialize;
use serde_json::json;

use super::crowd::{Crowd, FAR};
use super::table::{Table, count};
use super::{Bench, Measured, machine};

const NODES: usize = 1000;
/// Cycles after which memory is looked at.
const LOOKS: [usize; 4] = [100, 1000, 5000, 10_000];
const LOOKS_QUICK: [usize; 3] = [100, 150, 300];
/// Readings of the process's memory over the last half of the cycles.
const READINGS: usize = 50;
/// Still frames before a look: what compaction and the retire queue hold comes to its end.
const REST_FRAMES: usize = 8;
/// Largest growth of the process over the last half of the cycles that still counts as steady.
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
    let mut readings = Vec::new();
    for cycle in 0..last {
        edit(&mut crowd, cycle, lone)?;
        crowd.session.end_gesture();
        crowd.frame_without_waiting()?;
        anyhow::ensure!(crowd.session.undo().is_some(), "there was nothing to undo after cycle {cycle}");
        crowd.frame_without_waiting()?;
        bar.inc(1);
        if 2 * cycle >= last && (cycle + 1).is_multiple_of((last / 2 / READINGS).max(1)) {
            readings.extend(machine::resident_bytes().map(|bytes| (cycle as f64, bytes as f64)));
        }
        if looks_at.contains(&(cycle + 1)) {
            looks.push(look(bench, &mut crowd, cycle + 1)?);
        }
    }
    bar.finish_and_clear();
    let unchanged = *crowd.session.document() == before;
    let (device, process) = (on_device(&looks), Process::of(&readings));
    let table = table_of(&looks, device, process.as_ref(), unchanged);
    let figures = json!({
        "nodes": NODES,
        "looks": looks,
        "device": { "growth_bytes": device, "steady": device == Some(0) },
        "process": process,
        "document_unchanged": unchanged,
    });
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

/// By how many bytes the device's memory differs between the first and the last look, all kinds together but none against
/// another; `None`: one look tells nothing.
fn on_device(looks: &[Look]) -> Option<u64> {
    let [first, .., last] = looks else { return None };
    let of = |look: &Look, kind: &str| look.device_bytes.get(kind).copied().unwrap_or(0);
    let kinds: BTreeSet<&str> = first.device_bytes.keys().chain(last.device_bytes.keys()).copied().collect();
    Some(kinds.into_iter().map(|kind| of(first, kind).abs_diff(of(last, kind))).sum())
}

/// Memory of the process over the last half of the cycles: a straight line through the readings, and how far they lie from
/// it. The allocator takes and gives back memory in pieces, so that single readings say little.
#[derive(Debug, Serialize)]
struct Process {
    readings: usize,
    /// Of the line, by the mean.
    growth_share: f64,
    /// Largest distance of a reading from the line, by the mean.
    noise_share: f64,
    steady: bool,
}

impl Process {
    /// `readings`: cycle and bytes; `None` for fewer than two.
    fn of(readings: &[(f64, f64)]) -> Option<Self> {
        let (first, last) = (readings.first()?, readings.last()?);
        let span = last.0 - first.0;
        if span <= 0.0 {
            return None;
        }
        let n = readings.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| readings.iter().map(of).sum::<f64>() / n;
        let (x, y) = (mean(&|r| r.0), mean(&|r| r.1));
        let slope = mean(&|r| (r.0 - x) * (r.1 - y)) / mean(&|r| (r.0 - x).powi(2));
        let distance = |r: &(f64, f64)| (r.1 - y - slope * (r.0 - x)).abs();
        let growth_share = slope * span / y;
        Some(Self {
            readings: readings.len(),
            growth_share,
            noise_share: readings.iter().map(distance).fold(0.0, f64::max) / y,
            steady: growth_share < STEADY_SHARE,
        })
    }
}

fn verdict(steady: bool) -> &'static str {
    if steady { "steady" } else { "NOT steady" }
}

fn table_of(looks: &[Look], device: Option<u64>, process: Option<&Process>, unchanged: bool) -> Table {
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
    let after = looks.first().map_or(0, |look| look.cycles);
    table.note(match device {
        Some(bytes) => format!(
            "Device: {bytes} bytes apart, kind by kind, between {} cycles and the last: {}.",
            count(after as u64),
            verdict(bytes == 0)
        ),
        None => String::from("Device: not judged."),
    });
    table.note(match process {
        Some(process) => format!(
            "Process: {:+.3} % over the last half of the cycles (a line through {} readings, none farther from it than \
             {:.3} %: the allocator's noise): {}.",
            process.growth_share * 100.0,
            process.readings,
            process.noise_share * 100.0,
            verdict(process.steady)
        ),
        None => String::from("Process: the system does not tell its memory."),
    });
    table.note(format!(
        "The document is {} afterwards.",
        if unchanged { "as it was" } else { "NOT as it was" }
    ));
    table.note("A cycle moves, hides, deletes, gives a material to or copies a node, renders, undoes and renders again.");
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(cycles: usize, tables: u64, targets: u64) -> Look {
        let device_bytes = BTreeMap::from([("tables", tables), ("targets", targets)]);
        Look { cycles, device_bytes, resident_bytes: None }
    }

    #[test]
    fn the_device_is_steady_when_no_kind_differs_by_a_byte() {
        assert_eq!(on_device(&[at(1, 5, 8), at(2, 7, 9), at(3, 5, 8)]), Some(0));
        assert_eq!(on_device(&[at(1, 5, 8), at(2, 5, 9)]), Some(1));
        assert_eq!(on_device(&[at(1, 5, 8), at(2, 6, 7)]), Some(2), "what one lost the other has not got");
        assert_eq!(on_device(&[at(1, 5, 8)]), None);
    }

    #[test]
    fn the_process_is_judged_by_a_line_and_its_noise_told() {
        let judged = |of: &dyn Fn(f64) -> f64| {
            let readings: Vec<_> = (0..=100).map(f64::from).map(|cycle| (cycle, of(cycle))).collect();
            Process::of(&readings)
                .map_or((f64::NAN, f64::NAN, false), |p| (p.growth_share, p.noise_share, p.steady))
        };
        assert_eq!(judged(&|_| 1000.0), (0.0, 0.0, true));
        let (growth, noise, steady) = judged(&|cycle| 990.0 + 0.2 * cycle);
        assert!((growth - 0.02).abs() < 1e-9 && noise < 1e-9 && !steady, "{growth} {noise}");
        let (growth, noise, steady) = judged(&|cycle| if cycle == 50.0 { 1100.0 } else { 1000.0 });
        assert!(growth.abs() < 1e-9 && (noise - 0.099).abs() < 1e-3 && steady, "{growth} {noise}");
        assert!(Process::of(&[(1.0, 1.0)]).is_none());
    }
}
