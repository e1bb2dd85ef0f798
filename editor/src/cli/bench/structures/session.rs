//! The triangles of the bare measurement as a mesh of a document: what its BLAS costs on the program's own way, beside the
//! bare structure in the same rounds. Enters: how many. Leaves: device times of the first build, of the build that a first
//! moved primitive asks for, and of what later moves ask for.

use std::sync::Arc;

use anyhow::Context;
use caustica_renderer::gpu::{BuildMode, BuildPreference};
use caustica_renderer::{AccelBench, BareStructure, Pipeline};
use caustica_scene::import::Imported;
use caustica_scene::{
    Edit, Material, MaterialId, Mesh, MeshData, MeshId, Node, NodeId, NodeKind, Prefab, Primitive,
};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use serde::Serialize;

use super::super::Bench;
use super::super::crowd::plain;
use super::super::moves::WAIT_MS;
use super::super::series::{Series, Spread, passes_ms};
use super::super::table::{Table, count, times};
use super::{Compared, Work};
use crate::session::{Session, SessionOptions};

const EXTENT: [u32; 2] = [64, 48];

/// Device time of one kind of work on the BLAS.
#[derive(Serialize)]
pub(super) struct Row {
    triangles: u32,
    after: &'static str,
    builds: u64,
    refits: u64,
    blas_ms: Spread,
    bare_ms: Spread,
    over_bare: Option<f64>,
    against_floor: Option<Compared>,
}

#[derive(Default)]
struct Tally {
    builds: u64,
    refits: u64,
    blas: Series,
    bare: Series,
}

const STEPS: [&str; 3] = ["the mesh is new", "a primitive moves for the first time", "it moves again"];

pub(super) fn run(
    bench: &Bench,
    accel: &mut AccelBench<'_>,
    triangles: u32,
    rounds: usize,
) -> anyhow::Result<Vec<Row>> {
    let fixed = accel.bare_triangles(triangles, BuildPreference::FastTrace)?;
    let moving = accel.bare_triangles(triangles, BuildPreference::FastBuild)?;
    let mut one = One::new(bench, triangles)?;
    let mut tallies: [Tally; 3] = Default::default();
    accel.warm_up()?;
    for round in 0..rounds {
        one.session.push(Edit::RemoveNode { node: one.node })?;
        one.frame()?;
        for (step, tally) in tallies.iter_mut().enumerate() {
            accel.keep_busy(WAIT_MS)?;
            if step == 0 {
                anyhow::ensure!(one.session.undo().is_some(), "there was nothing to undo");
            } else {
                let shift = 1e-3 * (2 * round + step) as f64;
                one.session.push(one.shifted(shift))?;
            }
            one.session.end_gesture();
            one.frame()?;
            tally.note(&one.session, accel, if step == 0 { &fixed } else { &moving })?;
        }
    }
    let name = bench.device.name();
    Ok(STEPS.into_iter().zip(tallies).map(|(after, tally)| tally.finish(name, triangles, after)).collect())
}

impl Tally {
    fn note(
        &mut self,
        session: &Session,
        accel: &mut AccelBench<'_>,
        bare: &BareStructure,
    ) -> anyhow::Result<()> {
        let statistics = session.statistics();
        let (built, refit) = (statistics.acceleration.blas_built, statistics.acceleration.blas_refit);
        anyhow::ensure!(built + refit == 1, "one BLAS should have changed: {built} built, {refit} refitted");
        self.builds += built;
        self.refits += refit;
        self.blas.push(passes_ms(&statistics.passes, &["accel.blas"]));
        let mode = if refit == 1 { BuildMode::Refit } else { BuildMode::Build };
        self.bare.push(accel.run(bare, mode)?);
        Ok(())
    }

    fn finish(self, device: &str, triangles: u32, after: &'static str) -> Row {
        let (blas_ms, bare_ms) = (self.blas.spread(), self.bare.spread());
        // The floor knows structures that are traced fast, and refits.
        let work = match after {
            _ if after == STEPS[0] => Some(Work::TrianglesBuild),
            _ if self.refits > 0 => Some(Work::TrianglesRefit),
            _ => None,
        };
        Row {
            triangles,
            after,
            builds: self.builds,
            refits: self.refits,
            blas_ms,
            bare_ms,
            over_bare: blas_ms.over(&bare_ms),
            against_floor: work.map(|work| Compared::of(device, work, triangles, blas_ms.median)),
        }
    }
}

pub(super) fn table_of(rows: &[Row]) -> Table {
    let triangles = rows.first().map_or(0, |row| row.triangles);
    let title = format!("A mesh of {} triangles in a document, ms", count(triangles.into()));
    let head = ["its BLAS after", "built, refitted", "accel.blas", "bare", "over it", "against the floor"];
    let mut table = Table::new(title, &head);
    for row in rows {
        table.row(vec![
            row.after.to_owned(),
            format!("{}, {}", row.builds, row.refits),
            row.blas_ms.to_string(),
            row.bare_ms.to_string(),
            times(row.over_bare),
            row.against_floor.as_ref().map_or_else(String::new, Compared::in_words),
        ]);
    }
    table.note("Bare: the same triangles without a document, in the same rounds, the device kept at work.");
    table
}

/// A session with one node.
struct One {
    session: Session,
    node: NodeId,
    mesh: MeshId,
}

impl One {
    fn new(bench: &Bench, triangles: u32) -> anyhow::Result<Self> {
        let options = SessionOptions {
            shaders: bench.shaders.clone(),
            settings: plain(Pipeline::Raytraced),
            extent: EXTENT,
            ..SessionOptions::default()
        };
        let mut session = Session::new(&bench.device, options)?;
        session.edit_with(|document| document.import_edit(grid(triangles)))?;
        let document = session.document();
        let mesh = document.meshes().map(|(id, _)| id).next().context("no mesh")?;
        let materials = document.materials().map(|(id, _)| id).take(1).collect();
        let kind = NodeKind::Mesh { mesh, materials, weights: Vec::new() };
        let node = session.edit_with(|document| document.add_edit(Node::new("grid", kind), None))?;
        let mut one = Self { session, node, mesh };
        one.frame()?;
        Ok(one)
    }

    fn frame(&mut self) -> anyhow::Result<()> {
        self.session.render_frame(EXTENT)?;
        self.session.finish()
    }

    fn shifted(&self, shift_m: f64) -> Edit {
        let mesh_from_primitive = DAffine3::from_translation(DVec3::Z * shift_m);
        Edit::SetPrimitiveTransform { mesh: self.mesh, primitive: 0, mesh_from_primitive }
    }
}

/// The triangles as an imported file would bring them.
fn grid(triangles: u32) -> Imported {
    let (positions, corners) = AccelBench::grid(triangles);
    let vertices = positions.len();
    let primitive = Primitive {
        first_index: 0,
        index_count: triangles * 3,
        material: MaterialId(0),
        mesh_from_primitive: DAffine3::IDENTITY,
    };
    let data = MeshData {
        positions: positions.into_iter().map(Vec3::from_array).collect(),
        normals: vec![Vec3::Z; vertices],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); vertices],
        tex_coords0: vec![Vec2::ZERO; vertices],
        indices: corners.into_iter().flatten().collect(),
        ..MeshData::default()
    };
    Imported {
        prefab: Prefab::new("grid", ""),
        meshes: vec![Mesh::new(String::from("grid"), Arc::new(data), vec![primitive])],
        materials: vec![Material { metallic: 0.0, ..Material::default() }],
        ..Imported::default()
    }
}
