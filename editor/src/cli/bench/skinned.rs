//! A hundred skinned tubes in another pose every frame, straight into the renderer. Enters: how many. Leaves: device time of
//! the deformation, the BLASes and the TLAS, host time and bytes, once with refits and once with builds.

use std::sync::Arc;

use caustica_renderer::delta::{
    Camera, Deformation, Environment, Geometry, Instance, InstanceId, Material, MaterialId, Mesh, MeshId,
    Pose, SceneDelta, Visibility,
};
use caustica_renderer::gpu::Frames;
use caustica_renderer::{AccelBench, AccelPolicy, Pipeline, Renderer, RendererOptions, ViewId};
use glam::{Affine3A, Quat, Vec2, Vec3};
use serde::Serialize;
use serde_json::json;

use super::crowd::plain;
use super::series::{Series, Spread, passes_ms};
use super::shapes::lathe;
use super::table::{Table, count, figure};
use super::{Bench, Measured};
use crate::session::Lap;

const EXTENT: [u32; 2] = [64, 48];
const JOINTS: usize = 16;
const SEGMENTS: u32 = 20;
/// With [`SEGMENTS`] these make 2000 triangles.
const RINGS: usize = 51;
const HEIGHT_M: f32 = 2.0;
const RADIUS_M: f32 = 0.15;
/// Unmeasured frames at the start.
const WARM_UPS: usize = 6;
const FRAME_S: f32 = 1.0 / 60.0;

/// Figures of one policy, for all tubes together and each frame.
#[derive(Debug, Default, Serialize)]
struct Row {
    meshes: usize,
    triangles_each: usize,
    joints: usize,
    refit: bool,
    frames: usize,
    deform_ms: Spread,
    blas_ms: Spread,
    /// The look at how far refits have loosened the trees.
    surface_ms: Spread,
    tlas_ms: Spread,
    device_ms: Spread,
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
    apply: Series,
    render: Series,
    submit: Series,
}

pub(super) fn run(bench: &Bench) -> anyhow::Result<Measured> {
    let (meshes, frames) = if bench.quick { (10, 8) } else { (100, 60) };
    let bar = bench.bar("skinned", 2 * frames);
    let mut rows = Vec::new();
    for refit in [true, false] {
        bar.set_message(if refit { "refitted" } else { "built" });
        let mut dance = Dance::new(bench, meshes, refit)?;
        for frame in 0..WARM_UPS + frames {
            if frame == WARM_UPS {
                let row =
                    Row { meshes, triangles_each: triangles(), joints: JOINTS, refit, ..Row::default() };
                dance.tally = Tally { row, ..Tally::default() };
            }
            dance.frame(frame)?;
            bar.inc(u64::from(frame >= WARM_UPS));
        }
        rows.push(dance.tally.finish());
    }
    bar.set_message("bare BLAS");
    let mut frames = Frames::new(&bench.device)?;
    let bare = AccelBench::new(&bench.device, &mut frames)?.triangles(triangles() as u32)?;
    bar.finish_and_clear();
    let mut table = table_of(&rows);
    table.note(format!(
        "Straight through the renderer: no document and no sync. One BLAS of {} triangles alone, same run: refit {} ms, \
         built to be refitted {} ms; the {meshes} of a frame go to the device in one command.",
        count(bare.primitives.into()),
        figure(bare.refit_ms),
        figure(bare.build_fast_build_ms),
    ));
    Ok(Measured {
        figures: json!({ "rows": rows, "bare_blas": bare, "through": "renderer" }),
        tables: vec![table],
    })
}

fn triangles() -> usize {
    (RINGS - 1) * SEGMENTS as usize * 2
}

/// Tubes in a renderer of their own.
struct Dance {
    frames: Frames,
    renderer: Renderer,
    view: ViewId,
    meshes: usize,
    tally: Tally,
}

impl Dance {
    fn new(bench: &Bench, meshes: usize, refit: bool) -> anyhow::Result<Self> {
        let mut frames = Frames::new(&bench.device)?;
        let options = RendererOptions {
            shaders: bench.shaders.clone(),
            acceleration: AccelPolicy { refit, ..AccelPolicy::default() },
        };
        let mut renderer = Renderer::new(&bench.device, &mut frames, &options)?;
        let view = renderer.create_view(EXTENT, plain(Pipeline::Raytraced), false)?;
        renderer.view_mut(view)?.set_camera(camera());
        let mut dance = Self { frames, renderer, view, meshes, tally: Tally::default() };
        dance.show(&scene(meshes))?;
        Ok(dance)
    }

    /// Every tube takes the pose of this frame.
    fn frame(&mut self, frame: usize) -> anyhow::Result<()> {
        let time_s = frame as f32 * FRAME_S;
        let delta = SceneDelta {
            poses: (0..self.meshes).map(|i| (tube_id(i), pose(time_s + i as f32 * 0.37))).collect(),
            reason: String::from("danced"),
            ..SceneDelta::default()
        };
        self.show(&delta)
    }

    /// Renders one frame, waits for it, and notes what it cost.
    fn show(&mut self, delta: &SceneDelta) -> anyhow::Result<()> {
        let mut recorder = self.frames.begin()?;
        self.renderer.note_times(self.view, &self.frames)?;
        let mut lap = Lap::start();
        self.renderer.apply(&mut recorder, delta)?;
        self.tally.apply.push(lap.ms());
        self.renderer.render(&mut recorder, self.view)?;
        self.tally.render.push(lap.ms());
        self.frames.submit(recorder, None)?;
        self.tally.submit.push(lap.ms());
        self.frames.finish()?;
        self.renderer.note_times(self.view, &self.frames)?;
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
        "host: apply",
        "host: render",
        "submit",
        "bytes a frame",
        "refits, builds",
    ];
    let title = rows.first().map_or_else(String::new, |row| {
        format!(
            "Skinned meshes of {} triangles and {} joints, each in another pose every frame, ms a frame",
            count(row.triangles_each as u64),
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
            row.apply_ms.to_string(),
            row.render_ms.to_string(),
            row.submit_ms.to_string(),
            count(row.uploaded_bytes),
            format!("{}, {}", row.blas_refits, row.blas_builds),
        ]);
    }
    table
}

fn camera() -> Camera {
    let rotation = Quat::from_rotation_x(-0.6);
    Camera {
        render_from_camera: Affine3A::from_rotation_translation(rotation, Vec3::new(0.0, 12.0, 16.0)),
        ..Camera::default()
    }
}

fn tube_id(index: usize) -> InstanceId {
    InstanceId { node: index as u64 + 1, part: 0 }
}

/// The tubes in a square, at rest.
fn scene(meshes: usize) -> SceneDelta {
    let side = (meshes as f64).sqrt().ceil() as usize;
    let place = |i: usize| {
        Vec3::new((i % side) as f32, 0.0, (i / side) as f32) - (side / 2) as f32 * (Vec3::X + Vec3::Z)
    };
    let tube_instance = |i: usize| Instance {
        mesh: MeshId(1),
        render_from_mesh: Affine3A::from_translation(place(i)),
        materials: vec![MaterialId(1)],
        visibility: Visibility::default(),
        pose: None,
    };
    SceneDelta {
        meshes: vec![(MeshId(1), Arc::new(tube()))],
        materials: vec![(MaterialId(1), Material { metallic: 0.0, ..Material::default() })],
        instances: (0..meshes).map(|i| (tube_id(i), tube_instance(i))).collect(),
        environment: Some(Environment::Constant(Vec3::ONE)),
        reason: String::from("tubes"),
        ..SceneDelta::default()
    }
}

/// A tube along y; each ring hangs on the two joints next to it.
fn tube() -> Mesh {
    let height = |ring: usize| HEIGHT_M * ring as f32 / (RINGS - 1) as f32;
    let profile: Vec<Vec2> = (0..RINGS).map(|ring| Vec2::new(RADIUS_M, height(ring))).collect();
    let made = lathe(&profile, SEGMENTS);
    let held = |position: &Vec3| {
        let at = position.y / HEIGHT_M * (JOINTS - 1) as f32;
        let below = at.floor().clamp(0.0, (JOINTS - 2) as f32);
        let upper = at - below;
        ([below as u16, below as u16 + 1, 0, 0], [1.0 - upper, upper, 0.0, 0.0])
    };
    let (joints, weights) = made.positions.iter().map(held).unzip();
    Mesh {
        name: String::from("tube"),
        normals: made.normals,
        tangents: made.tangents,
        tex_coords0: made.tex_coords,
        geometries: vec![Geometry {
            first_index: 0,
            index_count: made.indices.len() as u32,
            mesh_from_primitive: Affine3A::IDENTITY,
        }],
        positions: made.positions,
        indices: made.indices,
        deformation: Some(Deformation { joints, weights, joint_count: JOINTS as u32, targets: Vec::new() }),
        ..Mesh::default()
    }
}

/// Every joint turns a little against the one below it, as sea grass does.
fn pose(time_s: f32) -> Pose {
    let mut above = Affine3A::IDENTITY;
    let joints = (0..JOINTS).map(|joint| {
        let pivot = Vec3::Y * HEIGHT_M * joint as f32 / (JOINTS - 1) as f32;
        let turn = Quat::from_rotation_z(0.08 * (time_s * 3.0 + joint as f32 * 0.4).sin());
        let around = Affine3A::from_translation(pivot)
            * Affine3A::from_quat(turn)
            * Affine3A::from_translation(-pivot);
        above *= around;
        above
    });
    Pose { joints: joints.collect(), weights: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tube_has_its_triangles_and_whole_weights() {
        let tube = tube();
        assert_eq!((triangles(), tube.indices.len()), (2000, 6000));
        let deformation = tube.deformation.unwrap_or_default();
        assert_eq!(deformation.weights.len(), tube.positions.len());
        assert!(deformation.joints.iter().flatten().all(|joint| usize::from(*joint) < JOINTS));
        assert!(
            deformation
                .weights
                .iter()
                .all(|w| (w.iter().sum::<f32>() - 1.0).abs() < 1e-6 && w.iter().all(|x| *x >= 0.0))
        );
    }

    #[test]
    fn poses_are_rigid_and_differ() {
        let (a, b) = (pose(0.0), pose(FRAME_S));
        assert!(a.joints.len() == JOINTS && a != b);
        assert!(a.joints.iter().all(|joint| (joint.matrix3.determinant() - 1.0).abs() < 1e-5));
    }
}
