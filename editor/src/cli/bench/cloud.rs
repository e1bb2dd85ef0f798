//! Clouds of spheres and boxes without triangles, up to two million: what they cost until the first picture, in memory and in each
//! frame after it. Enters: sizes. Leaves: milliseconds and bytes.

use std::collections::BTreeMap;

use caustica_renderer::Pipeline;
use caustica_renderer::gpu::DeviceKind;
use caustica_renderer::gpu_types::{Shape, ShapeBox};
use caustica_scene::{Cloud, Distribution, Edit, Environment, Local, ShapeSource};
use glam::{DVec3, Vec3};
use serde::Serialize;
use serde_json::json;

use super::crowd::plain;
use super::series::{Series, Spread, passes_ms};
use super::table::{Table, count, figure};
use super::{Bench, Measured};
use crate::session::{Lap, Session, SessionOptions, ViewCamera};

const COUNTS: [u32; 3] = [20_000, 200_000, 2_000_000];
const COUNTS_QUICK: [u32; 1] = [2000];
const EXTENT: [u32; 2] = [1280, 720];
/// Where the processor is the device.
const EXTENT_CPU: [u32; 2] = [320, 180];
const EXTENT_QUICK: [u32; 2] = [64, 36];
/// Unmeasured frames after a pipeline was chosen: its shaders are compiled in them.
const WARM_UPS: usize = 3;
/// Frames that may pass until the background has compacted the structure.
const MOST_FRAMES: usize = 100;

/// Figures of one cloud.
#[derive(Debug, Serialize)]
struct Row {
    count: u32,
    extent_px: [u32; 2],
    /// From the description to the shapes, on the host.
    make_ms: f64,
    /// Flattened for the renderer.
    sync_ms: f64,
    /// Sorted, and copied to staging memory.
    apply_ms: f64,
    /// Boxes around the shapes, on the device.
    boxes_ms: f64,
    /// The bottom-level structure, on the device.
    build_ms: f64,
    /// Until the first picture was finished, shaders and pipelines included.
    first_frame_s: f64,
    shape_bytes: u64,
    box_bytes: u64,
    blas_bytes: u64,
    /// After compaction, where the device gains by it.
    blas_bytes_at_rest: u64,
    /// Everything that the program has on the device, by kind.
    device_bytes: BTreeMap<String, u64>,
    frames: Vec<FrameRow>,
}

/// Device time of a frame: one sample a pixel, the camera still.
#[derive(Debug, Serialize)]
struct FrameRow {
    pipeline: &'static str,
    device_ms: Spread,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let counts = bench.sizes(&COUNTS, &COUNTS_QUICK);
    let bar = bench.bar("cloud", counts.len());
    let mut rows = Vec::new();
    for shapes in counts {
        bar.set_message(format!("{} shapes", count((*shapes).into())));
        rows.push(row(bench, *shapes)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Measured { figures: json!({ "rows": rows }), tables: vec![cost_table(&rows), frame_table(&rows)] })
}

fn extent(bench: &Bench) -> [u32; 2] {
    match bench.device.kind() {
        _ if bench.quick => EXTENT_QUICK,
        DeviceKind::Cpu => EXTENT_CPU,
        _ => EXTENT,
    }
}

/// A ball of 2 m that fills a third of the picture, as `projects/cloud`; its shapes are about as large as their distances.
fn cloud(count: u32) -> Cloud {
    let spacing_m = 2.0 / (count.max(1) as f32).cbrt();
    Cloud {
        count,
        distribution: Distribution::Ball,
        half_extent_m: Vec3::ONE,
        radius_m: [0.1 * spacing_m, 0.4 * spacing_m],
        ..Cloud::default()
    }
}

fn row(bench: &Bench, count: u32) -> anyhow::Result<Row> {
    let extent_px = extent(bench);
    let options = SessionOptions {
        shaders: bench.shaders.clone(),
        settings: plain(Pipeline::Raytraced),
        extent: extent_px,
        ..SessionOptions::default()
    };
    let mut session = Session::new(&bench.device, options)?;
    session.push(Edit::SetEnvironment(Environment::DefaultSky))?;
    let mut lap = Lap::start();
    session.add_shapes("cloud", ShapeSource::Cloud(cloud(count)), Local::default())?;
    let make_ms = lap.ms();
    session.set_camera(ViewCamera::looking_at(DVec3::new(1.4, 1.0, 3.0), DVec3::ZERO, 0.7, 0.01));
    let mut lap = Lap::start();
    frame(&mut session, extent_px)?;
    let first_frame_s = lap.ms() / 1e3;
    let host = session.host_times();
    let passes = session.statistics().passes.clone();
    let blas_bytes = session.statistics().acceleration.blas_bytes;
    rest(&mut session, extent_px)?;
    let mut frames = Vec::new();
    for pipeline in Pipeline::ALL {
        frames.push(frames_of(bench, &mut session, pipeline, extent_px)?);
    }
    Ok(Row {
        count,
        extent_px,
        make_ms,
        sync_ms: host.sync_ms,
        apply_ms: host.apply_ms,
        boxes_ms: passes_ms(&passes, &["shape_boxes"]),
        build_ms: passes_ms(&passes, &["accel.blas"]),
        first_frame_s,
        shape_bytes: u64::from(count) * size_of::<Shape>() as u64,
        box_bytes: u64::from(count) * size_of::<ShapeBox>() as u64,
        blas_bytes,
        blas_bytes_at_rest: session.statistics().acceleration.blas_bytes,
        device_bytes: session.statistics().memory.iter().cloned().collect(),
        frames,
    })
}

/// Renders one frame and waits for it.
fn frame(session: &mut Session, extent_px: [u32; 2]) -> anyhow::Result<()> {
    session.render_frame(extent_px)?;
    session.finish()
}

/// Lets the background finish what it has begun.
fn rest(session: &mut Session, extent_px: [u32; 2]) -> anyhow::Result<()> {
    for _ in 0..MOST_FRAMES {
        frame(session, extent_px)?;
        let acceleration = &session.statistics().acceleration;
        if acceleration.blas_background + acceleration.blas_pending == 0 {
            break;
        }
    }
    frame(session, extent_px)
}

fn frames_of(
    bench: &Bench,
    session: &mut Session,
    pipeline: Pipeline,
    extent_px: [u32; 2],
) -> anyhow::Result<FrameRow> {
    session.set_settings(plain(pipeline));
    let mut device = Series::default();
    let frames = if bench.quick { 2 } else { 20 };
    for index in 0..WARM_UPS + frames {
        frame(session, extent_px)?;
        if index >= WARM_UPS {
            device.push(passes_ms(&session.statistics().passes, &[""]));
        }
    }
    Ok(FrameRow { pipeline: pipeline.name(), device_ms: device.spread() })
}

fn mib(bytes: u64) -> String {
    figure(bytes as f64 / f64::from(1 << 20))
}

fn cost_table(rows: &[Row]) -> Table {
    let head = [
        "shapes",
        "make",
        "sync",
        "upload",
        "boxes",
        "BLAS build",
        "first picture, s",
        "shapes, MiB",
        "boxes, MiB",
        "BLAS, MiB",
        "at rest, MiB",
    ];
    let mut table = Table::new("A cloud of spheres and boxes: once, ms", &head);
    for row in rows {
        let times = [row.make_ms, row.sync_ms, row.apply_ms, row.boxes_ms, row.build_ms, row.first_frame_s];
        let bytes = [row.shape_bytes, row.box_bytes, row.blas_bytes, row.blas_bytes_at_rest];
        let cells = [count(row.count.into())].into_iter().chain(times.map(figure)).chain(bytes.map(mib));
        table.row(cells.collect());
    }
    table.note(
        "Make, sync and upload: the host. Boxes and build: the device. First picture: pipelines included.",
    );
    table
}

fn frame_table(rows: &[Row]) -> Table {
    let names = Pipeline::ALL.map(Pipeline::name);
    let head: Vec<&str> = ["shapes", "picture"].into_iter().chain(names).collect();
    let mut table = Table::new("A cloud of spheres and boxes: each frame, device ms", &head);
    for row in rows {
        let [width, height] = row.extent_px;
        let cells = [count(row.count.into()), format!("{width} x {height}")].into_iter();
        table.row(cells.chain(row.frames.iter().map(|frame| frame.device_ms.to_string())).collect());
    }
    table.note(
        "One sample a pixel, the camera still, no denoiser; the built-in sky, default depth of reflections.",
    );
    table
}
