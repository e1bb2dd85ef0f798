//! The figures of moves as tables. Enters: rows. Leaves: tables with what must be known to read them.

use caustica_renderer::gpu_types;

use super::super::series::Spread;
use super::super::table::{Table, count, figure, times};
use super::{CONDITIONS, Pair, REST, Row, WAIT_MS};

pub(super) fn of(rows: &[Row]) -> Vec<Table> {
    vec![host(rows), bytes(rows), device(rows)]
}

fn host(rows: &[Row]) -> Table {
    let head = [
        "nodes",
        "pipeline",
        "move",
        "edit",
        "sync",
        "apply",
        "edit + sync + apply",
        "begin_frame",
        "submit",
    ];
    let mut table = Table::new("One node moves: the host, ms", &head);
    for row in rows {
        for (condition, host) in CONDITIONS.iter().zip(&row.host) {
            let times = [
                host.edit_ms,
                host.sync_ms,
                host.apply_ms,
                host.scene_ms,
                host.begin_frame_ms,
                host.submit_ms,
            ];
            let mut cells = vec![count(row.nodes as u64), row.pipeline.to_owned(), (*condition).to_owned()];
            cells.extend(times.iter().map(Spread::to_string));
            table.row(cells);
        }
    }
    table.note(format!(
        "After a wait: the host has slept for {WAIT_MS} ms while the device built other structures. Back to back: right \
         behind the move before, for which nobody waits. Cold caches: the host has just written memory larger than its \
         caches. `begin_frame` is without waiting for the device. The documents take turns."
    ));
    for row in rows.iter().filter(|row| row.nodes > 1000) {
        let Some(small) = rows.iter().find(|small| small.nodes == 1000 && small.pipeline == row.pipeline)
        else {
            continue;
        };
        let over = |i: usize| times(row.host[i].scene_ms.over(&small.host[i].scene_ms));
        table.note(format!(
            "{} nodes over 1,000, {}: after a wait {}, back to back {}, cold caches {}.",
            count(row.nodes as u64),
            row.pipeline,
            over(0),
            over(1),
            over(2),
        ));
    }
    table
}

fn bytes(rows: &[Row]) -> Table {
    let head = ["nodes", "pipeline", "bytes, moved", "bytes, settled", "frames until shown"];
    let mut table = Table::new("One node moves: uploads and delay", &head);
    for row in rows {
        table.row(vec![
            count(row.nodes as u64),
            row.pipeline.to_owned(),
            count(row.moved_bytes),
            count(row.settled_bytes),
            row.latency_frames.to_string(),
        ]);
    }
    let constants = rows.first().map_or(0, |row| row.constant_bytes);
    table.note(format!(
        "Bytes are those of one moved node; the constants of a frame ({constants} bytes, its record {}) are taken off. \
         Settled: the frame after the move, in which the previous transform becomes the present one.",
        size_of::<gpu_types::Frame>()
    ));
    table
}

fn device(rows: &[Row]) -> Table {
    let head = [
        "nodes",
        "pipeline",
        "accel.tlas",
        "bare TLAS refit",
        "over it",
        "instance_descriptors",
        "both, over it",
        "bare refit, device at rest",
        "TLAS refitted, built",
        "all passes",
    ];
    let mut table = Table::new("One node moves: the device, ms", &head);
    for row in rows {
        table.row(vec![
            count(row.nodes as u64),
            row.pipeline.to_owned(),
            row.tlas_ms.to_string(),
            row.bare_refit_ms.to_string(),
            times(row.tlas_over_bare),
            row.descriptors_ms.to_string(),
            times(row.accel_ms.over(&row.bare_refit_ms)),
            row.bare_refit_at_rest_ms.to_string(),
            format!("{}, {}", row.tlas_refits, row.tlas_builds),
            row.device_ms.to_string(),
        ]);
    }
    table.note(format!(
        "Bare: as many instances of one cube, nothing else in the program (`AccelBench`), refitted in the same rounds. The \
         device was kept at work, but for the column at rest: there its queue was empty for {} ms before.",
        REST.as_millis()
    ));
    table
}

pub(super) fn documents(pairs: &[Pair]) -> Table {
    let mut table = Table::new("The documents, seconds", &["nodes", "made by edits", "first picture"]);
    for Pair { crowd, .. } in pairs {
        table.row(vec![count(crowd.len() as u64), figure(crowd.document_s), figure(crowd.first_frame_s)]);
    }
    table
}
