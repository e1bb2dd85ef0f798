//! A hundred skinned tubes, each in another pose every frame: from the time of the document to the picture. Enters: how many.
//! Leaves: device time of deformation, BLASes and TLAS, host time and bytes, once with refits and once with builds.

use caustica_renderer::gpu::Frames;
use caustica_renderer::{AccelBench, AccelPolicy, Pipeline, Renderer, RendererOptions, ViewId};
use caustica_scene::{ClipChoice, Document, Local, Node, NodeKind, Projection, Trs};
use glam::{DAffine3, DQuat, DVec3};
use serde::Serialize;
use serde_json::json;

use super::crowd::plain;
use super::rig::{JOINTS, triangles, tube};
use super::series::{Series, Spread, passes_ms};
use super::table::{Table, count, figure};
use super::{Bench, Measured};
use crate::session::Lap;
use crate::sync::{Sync, camera_of};

const EXTENT: [u32; 2] = [64, 48];
/// Unmeasured frames at the start.
const WARM_UPS: usize = 6;
const FRAME_S: f64 = 1.0 / 60.0;
/// Other work of the device before each frame, milliseconds.
const BUSY_MS: f64 = 5.0;

/// Figures of one policy, for all tubes together and each frame.
#[derive(Debug, Default, Serialize)]
struct Row {
    meshes: usize,
    triangles_each: u32,
    joints: u32,
    refit: bool,
    frames: usize,
    deform_ms: Spread,
    blas_ms: Spread,
    /// The look at how far refits have loosened the trees.
    surface_ms: Spread,
    tlas_ms: Spread,
    device_ms: Spread,
    /// The time is laid over the document.
    time_ms: Spread,
    sync_ms: Spread,
    apply_ms: Spread,
    render_ms: Spread,
    submit_ms: Spread,
    uploaded_bytes: u64,
    blas_refits: u64,
    blas_builds: u64,
}

#[derive(Default)]
struct Tally {
    row: Row,
    deform: Series,
    blas: Series,
    surface: Series,
    tlas: Series,
    device: Series,
    time: Series,
    sync: Series,
    apply: Series,
    render: Series,
    submit: Series,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let (meshes, frames) = if bench.quick { (10, 8) } else { (100, 60) };
    let bar = bench.bar("skinned", 2 * frames);
    let mut rows = Vec::new();
    let mut queue = Frames::new(&bench.device)?;
    let mut accel = AccelBench::new(&bench.device, &mut queue)?;
    for refit in [true, false] {
        bar.set_message(if refit { "refitted" } else { "built" });
        let mut dance = Dance::new(bench, meshes, refit)?;
        accel.warm_up()?;
        for frame in 0..WARM_UPS + frames {
            if frame == WARM_UPS {
                let row =
                    Row { meshes, triangles_each: triangles(), joints: JOINTS, refit, ..Row::default() };
                dance.tally = Tally { row, ..Tally::default() };
            }
            // A queue that is empty between short frames lets the device lower its clocks.
            accel.keep_busy(BUSY_MS)?;
            dance.frame(frame)?;
            bar.inc(u64::from(frame >= WARM_UPS));
        }
        rows.push(dance.tally.finish());
    }
    bar.set_message("bare BLAS");
    let bare = accel.triangles(triangles())?;
    bar.finish_and_clear();
    let mut table = table_of(&rows);
    table.note(format!(
        "Document, sync and renderer, no window; every tube plays a clip of its own. One BLAS of {} triangles alone, same run: refit {} ms, \
         built to be refitted {} ms; the {meshes} of a frame go to the device in one command.",
        count(bare.primitives.into()),
        figure(bare.refit_ms),
        figure(bare.build_fast_build_ms),
    ));
    table.note("Surfaces: how far refits have loosened the trees is looked at now and then, so that its median is 0.");
    Ok(Measured {
        figures: json!({ "rows": rows, "bare_blas": bare, "through": "document" }),
        tables: vec![table],
    })
}

/// Tubes in a document of their own, with a renderer.
struct Dance {
    document: Document,
    sync: Sync,
    frames: Frames,
    renderer: Renderer,
    view: ViewId,
    tally: Tally,
}

impl Dance {
    fn new(bench: &Bench, meshes: usize, refit: bool) -> anyhow::Result<Self> {
        let mut frames = Frames::new(&bench.device)?;
        let options = RendererOptions {
            shaders: bench.shaders.clone(),
            acceleration: AccelPolicy { refit, ..AccelPolicy::default() },
            ..RendererOptions::default()
        };
        let mut renderer = Renderer::new(&bench.device, &mut frames, &options)?;
        let view = renderer.create_view(EXTENT, plain(Pipeline::Raytraced), false)?;
        let document = document(meshes)?;
        Ok(Self { document, sync: Sync::new(), frames, renderer, view, tally: Tally::default() })
    }

    /// Goes to the time of a frame, renders it, waits for it, and notes what it cost.
    fn frame(&mut self, frame: usize) -> anyhow::Result<()> {
        let eye = camera();
        let mut recorder = self.frames.begin()?;
        self.renderer.note_times(self.view, &self.frames)?;
        let mut lap = Lap::start();
        self.document.set_time(Some(frame as f64 * FRAME_S));
        self.tally.time.push(lap.ms());
        let delta = self.sync.delta(&mut self.document, eye.translation);
        self.tally.sync.push(lap.ms());
        self.renderer.apply(&mut recorder, &delta)?;
        self.tally.apply.push(lap.ms());
        let projection = Projection::Perspective { yfov_rad: 0.7 };
        self.renderer.view_mut(self.view)?.set_camera(camera_of(&eye, projection, 0.01, self.sync.origin()));
        self.renderer.render(&mut recorder, self.view)?;
        self.tally.render.push(lap.ms());
        self.frames.submit(recorder, None)?;
        self.tally.submit.push(lap.ms());
        self.frames.finish()?;
        self.renderer.note_times(self.view, &self.frames)?;
        self.note()
    }

    /// Notes the figures of the device.
    fn note(&mut self) -> anyhow::Result<()> {
        let statistics = self.renderer.statistics(self.view)?;
        let passes = &statistics.passes;
        let tally = &mut self.tally;
        tally.deform.push(passes_ms(passes, &["deform"]));
        tally.blas.push(passes_ms(passes, &["accel.blas"]));
        tally.surface.push(passes_ms(passes, &["accel.surface"]));
        tally.tlas.push(passes_ms(passes, &["accel.tlas", "instance_descriptors"]));
        tally.device.push(passes.iter().map(|(_, ms)| ms).sum());
        tally.row.frames += 1;
        tally.row.uploaded_bytes = statistics.uploaded_bytes;
        tally.row.blas_refits += statistics.acceleration.blas_refit;
        tally.row.blas_builds += statistics.acceleration.blas_built;
        Ok(())
    }
}

impl Tally {
    fn finish(self) -> Row {
        Row {
            deform_ms: self.deform.spread(),
            blas_ms: self.blas.spread(),
            surface_ms: self.surface.spread(),
            tlas_ms: self.tlas.spread(),
            device_ms: self.device.spread(),
            time_ms: self.time.spread(),
            sync_ms: self.sync.spread(),
            apply_ms: self.apply.spread(),
            render_ms: self.render.spread(),
            submit_ms: self.submit.spread(),
            ..self.row
        }
    }
}

fn table_of(rows: &[Row]) -> Table {
    let head = [
        "meshes",
        "BLASes are",
        "deform",
        "BLASes",
        "surfaces",
        "TLAS, descriptors",
        "all passes",
        "host: set_time",
        "sync",
        "apply",
        "render",
        "submit",
        "bytes a frame",
        "refits, builds",
    ];
    let title = rows.first().map_or_else(String::new, |row| {
        format!(
            "Skinned meshes of {} triangles and {} joints, each in another pose every frame, ms a frame",
            count(row.triangles_each.into()),
            row.joints
        )
    });
    let mut table = Table::new(title, &head);
    for row in rows {
        table.row(vec![
            row.meshes.to_string(),
            String::from(if row.refit { "refitted" } else { "built" }),
            row.deform_ms.to_string(),
            row.blas_ms.to_string(),
            row.surface_ms.to_string(),
            row.tlas_ms.to_string(),
            row.device_ms.to_string(),
            row.time_ms.to_string(),
            row.sync_ms.to_string(),
            row.apply_ms.to_string(),
            row.render_ms.to_string(),
            row.submit_ms.to_string(),
            count(row.uploaded_bytes),
            format!("{}, {}", row.blas_refits, row.blas_builds),
        ]);
    }
    table
}

/// World from camera: looks down on the square of tubes.
fn camera() -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_x(-0.6), DVec3::new(0.0, 12.0, 16.0))
}

/// The tubes in a square, each with a clip of its own.
fn document(meshes: usize) -> anyhow::Result<Document> {
    let side = (meshes as f64).sqrt().ceil() as usize;
    let place = |i: usize| {
        DVec3::new((i % side) as f64, 0.0, (i / side) as f64) - (side / 2) as f64 * (DVec3::X + DVec3::Z)
    };
    let mut document = Document::new();
    let prefab = document.add_imported(tube(meshes)?)?;
    for i in 0..meshes {
        let mut kind = NodeKind::instance_of(prefab);
        if let NodeKind::Prefab { clip, .. } = &mut kind {
            *clip = ClipChoice::Clip(i as u32);
        }
        let node = Node::new("tube", kind).with_local(Local::from(Trs::from_translation(place(i))));
        let (_, edit) = document.add_edit(node, None);
        document.apply(edit)?;
    }
    Ok(document)
}
