//! Builds, refits and compaction of bare acceleration structures, beside what the same device did without this program.
//! Enters: sizes. Leaves: milliseconds and bytes.

mod session;

use caustica_renderer::gpu::Frames;
use caustica_renderer::{AccelBench, BlasTimes, TlasTimes};
use serde::Serialize;
use serde_json::json;

use super::table::{Table, count, figure};
use super::{Bench, Measured};

const TRIANGLES: [u32; 4] = [10_000, 100_000, 1_000_000, 5_000_000];
const TRIANGLES_QUICK: [u32; 2] = [1000, 10_000];
const BOXES: [u32; 1] = [2_000_000];
const BOXES_QUICK: [u32; 1] = [2000];
const INSTANCES: [u32; 4] = [1, 1000, 100_000, 1_000_000];
const INSTANCES_QUICK: [u32; 2] = [1, 1000];
/// Triangles of the mesh that is built through a document, and rounds.
const IN_SESSION: (u32, usize) = (100_000, 30);
const IN_SESSION_QUICK: (u32, usize) = (1000, 3);

/// What a bare program measured on a device: lowest and highest milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Floor {
    low_ms: f64,
    high_ms: f64,
}

/// Part of the device's name, what, how many, milliseconds. Measured on 2026-11-24 by programs of a few hundred lines,
/// before there was a renderer.
const FLOORS: [(&str, Work, u32, f64, f64); 9] = [
    ("H100", Work::TrianglesBuild, 100_000, 0.49, 0.49),
    ("H100", Work::TrianglesRefit, 100_000, 0.09, 0.09),
    ("H100", Work::BoxesBuild, 2_000_000, 4.0, 4.0),
    ("H100", Work::BoxesRefit, 2_000_000, 1.0, 1.0),
    ("H100", Work::InstancesBuild, 100_000, 0.41, 0.41),
    ("H100", Work::InstancesRefit, 100_000, 0.05, 0.05),
    ("llvmpipe", Work::TrianglesBuild, 100_000, 4.7, 4.7),
    ("llvmpipe", Work::BoxesBuild, 2_000_000, 90.0, 400.0),
    ("llvmpipe", Work::InstancesBuild, 100_000, 6.0, 12.0),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    TrianglesBuild,
    TrianglesRefit,
    BoxesBuild,
    BoxesRefit,
    InstancesBuild,
    InstancesRefit,
}

fn floor_of(device: &str, work: Work, count: u32) -> Option<Floor> {
    FLOORS
        .iter()
        .find(|floor| device.contains(floor.0) && floor.1 == work && floor.2 == count)
        .map(|&(_, _, _, low_ms, high_ms)| Floor { low_ms, high_ms })
}

impl Floor {
    /// 1 inside of the range, else against its nearer end.
    fn ratio(self, ms: f64) -> f64 {
        ms / ms.clamp(self.low_ms, self.high_ms)
    }

    fn in_words(self) -> String {
        if self.low_ms == self.high_ms {
            figure(self.low_ms)
        } else {
            format!("{} to {}", figure(self.low_ms), figure(self.high_ms))
        }
    }
}

/// A time with its floor, where there is one.
#[derive(Serialize)]
struct Compared {
    ms: f64,
    floor: Option<Floor>,
    ratio: Option<f64>,
}

impl Compared {
    fn of(device: &str, work: Work, count: u32, ms: f64) -> Self {
        let floor = floor_of(device, work, count);
        Self { ms, floor, ratio: floor.map(|floor| floor.ratio(ms)) }
    }

    fn in_words(&self) -> String {
        match (self.floor, self.ratio) {
            (Some(floor), Some(ratio)) => {
                format!("{} (floor {}, x {ratio:.2})", figure(self.ms), floor.in_words())
            }
            _ => figure(self.ms),
        }
    }
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let triangles = bench.sizes(&TRIANGLES, &TRIANGLES_QUICK);
    let boxes = bench.sizes(&BOXES, &BOXES_QUICK);
    let instances = bench.sizes(&INSTANCES, &INSTANCES_QUICK);
    let bar = bench.bar("structures", triangles.len() + boxes.len() + instances.len());
    let mut frames = Frames::new(&bench.device)?;
    let mut accel = AccelBench::new(&bench.device, &mut frames)?;
    let mut blas = Vec::new();
    for size in triangles {
        bar.set_message(format!("{} triangles", count((*size).into())));
        blas.push(("triangles", accel.triangles(*size)?));
        bar.inc(1);
    }
    for size in boxes {
        bar.set_message(format!("{} boxes", count((*size).into())));
        blas.push(("boxes", accel.boxes(*size)?));
        bar.inc(1);
    }
    let mut tlas = Vec::new();
    for size in instances {
        bar.set_message(format!("{} instances", count((*size).into())));
        tlas.push(accel.instances(*size)?);
        bar.inc(1);
    }
    bar.set_message("in a document");
    let (triangles, rounds) = if bench.quick { IN_SESSION_QUICK } else { IN_SESSION };
    let in_session = session::run(bench, &mut accel, triangles, rounds)?;
    bar.finish_and_clear();
    let name = bench.device.name();
    let (blas_rows, blas_table) = blas_figures(name, &blas);
    let (tlas_rows, tlas_table) = tlas_figures(name, &tlas);
    Ok(Measured {
        figures: json!({ "blas": blas_rows, "tlas": tlas_rows, "in_session": in_session }),
        tables: vec![blas_table, tlas_table, session::table_of(&in_session)],
    })
}

fn blas_figures(device: &str, times: &[(&str, BlasTimes)]) -> (Vec<serde_json::Value>, Table) {
    let head =
        ["BLAS of", "build, fast trace", "build, fast build", "refit", "compaction", "MiB", "MiB compacted"];
    let mut table = Table::new("Bottom-level structures, ms", &head);
    let mut rows = Vec::new();
    for (what, times) in times {
        let (build, refit) = match *what {
            "boxes" => (Work::BoxesBuild, Work::BoxesRefit),
            _ => (Work::TrianglesBuild, Work::TrianglesRefit),
        };
        let build = Compared::of(device, build, times.primitives, times.build_fast_trace_ms);
        let refit = Compared::of(device, refit, times.primitives, times.refit_ms);
        table.row(vec![
            format!("{} {what}", count(times.primitives.into())),
            build.in_words(),
            figure(times.build_fast_build_ms),
            refit.in_words(),
            figure(times.compact_ms),
            mib(times.bytes),
            mib(times.compacted_bytes),
        ]);
        rows.push(json!({
            "of": what,
            "count": times.primitives,
            "build_fast_trace": build,
            "build_fast_build_ms": times.build_fast_build_ms,
            "refit": refit,
            "compact_ms": times.compact_ms,
            "bytes": times.bytes,
            "compacted_bytes": times.compacted_bytes,
        }));
    }
    table.note(
        "Floor: a bare program on the same kind of device before there was a renderer; x: this run over it.",
    );
    (rows, table)
}

fn tlas_figures(device: &str, times: &[TlasTimes]) -> (Vec<serde_json::Value>, Table) {
    let mut table = Table::new("Top-level structures, ms", &["TLAS of", "build", "refit", "MiB"]);
    let mut rows = Vec::new();
    for times in times {
        let build = Compared::of(device, Work::InstancesBuild, times.instances, times.build_ms);
        let refit = Compared::of(device, Work::InstancesRefit, times.instances, times.refit_ms);
        let what = format!("{} instances", count(times.instances.into()));
        table.row(vec![what, build.in_words(), refit.in_words(), mib(times.bytes)]);
        rows.push(json!({ "count": times.instances, "build": build, "refit": refit, "bytes": times.bytes }));
    }
    (rows, table)
}

fn mib(bytes: u64) -> String {
    figure(bytes as f64 / f64::from(1 << 20))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_are_found_by_device_and_size_alone() {
        let h100 = "NVIDIA H100 80GB HBM3";
        assert_eq!(
            floor_of(h100, Work::TrianglesRefit, 100_000),
            Some(Floor { low_ms: 0.09, high_ms: 0.09 })
        );
        assert_eq!(floor_of(h100, Work::TrianglesRefit, 10_000), None);
        assert_eq!(floor_of("llvmpipe (LLVM 15.0.6, 256 bits)", Work::TrianglesRefit, 100_000), None);
        assert_eq!(floor_of("NVIDIA H200", Work::TrianglesBuild, 100_000), None);
    }

    #[test]
    fn a_range_is_met_anywhere_inside() {
        let floor = Floor { low_ms: 6.0, high_ms: 12.0 };
        assert_eq!([3.0, 6.0, 9.0, 24.0].map(|ms| floor.ratio(ms)), [0.5, 1.0, 1.0, 2.0]);
    }
}
