//! What the first surfaces cost by raster and by rays. Enters: a device. Leaves: milliseconds, by the device's clock. The
//! scene is generated: 64 bumpy sheets of 2048 triangles that fill the picture and partly hide each other.

use std::sync::Arc;

use caustica_gpu::{Device, Frames};
use glam::{Affine3A, Vec2, Vec3, Vec4};

use super::device_profile::PrimaryTimes;
use crate::delta::{
    Camera, Geometry, Instance, InstanceId, Material, MaterialId, Mesh, MeshId, SceneDelta, Visibility,
};
use crate::error::Result;
use crate::renderer::{Renderer, RendererOptions};
use crate::settings::{Pipeline, Primary, ViewSettings};

/// Cells along the side of a sheet, and sheets along the side of the field.
const CELLS: u32 = 32;
const SHEETS: u32 = 8;
const EXTENT: [u32; 2] = [640, 360];
/// Unmeasured frames, then measured ones of each kind.
const UNMEASURED: u32 = 3;
const FRAMES: u32 = 9;

/// Measures both ways.
pub(super) fn measure(device: &Arc<Device>, frames: &mut Frames) -> Result<PrimaryTimes> {
    let mut renderer = Renderer::new(device, frames, &RendererOptions::default())?;
    let settings = ViewSettings { pipeline: Pipeline::Hybrid, temporal: false, ..ViewSettings::default() };
    let view = renderer.create_view(EXTENT, settings.clone(), false)?;
    let back = Affine3A::from_translation(Vec3::new(0.0, 0.0, 1.2 * SHEETS as f32));
    renderer.view_mut(view)?.set_camera(Camera { render_from_camera: back, ..Camera::default() });
    let mut delta = scene();
    let mut times = [0.0; 2];
    for (primary, time) in [Primary::Raster, Primary::Rays].into_iter().zip(&mut times) {
        renderer.view_mut(view)?.set_settings(ViewSettings { primary, ..settings.clone() });
        let mut measured = Vec::new();
        for frame in 0..UNMEASURED + FRAMES {
            let mut recorder = frames.begin()?;
            renderer.apply(&mut recorder, &std::mem::take(&mut delta))?;
            renderer.render(&mut recorder, view)?;
            frames.submit(recorder, None)?;
            frames.finish()?;
            renderer.note_times(view, frames)?;
            if frame >= UNMEASURED {
                let passes = &renderer.statistics(view)?.passes;
                measured.push(
                    passes.iter().filter(|(label, _)| label.starts_with("gbuffer.")).map(|p| p.1).sum(),
                );
            }
        }
        measured.sort_by(f64::total_cmp);
        *time = measured[measured.len() / 2];
    }
    let [raster_ms, rays_ms] = times;
    Ok(PrimaryTimes { raster_ms, rays_ms })
}

fn scene() -> SceneDelta {
    let (mesh, material) = (MeshId(1), MaterialId(1));
    let instances = (0..SHEETS * SHEETS).map(|i| {
        let (x, y) = ((i % SHEETS) as f32, (i / SHEETS) as f32);
        let middle = 0.5 * (SHEETS - 1) as f32;
        // Wider than their distance: neighbours overlap.
        let place = Vec3::new(x - middle, y - middle, 0.3 * ((x + 2.0 * y) % 3.0));
        let instance = Instance {
            mesh,
            render_from_mesh: Affine3A::from_scale_rotation_translation(
                Vec3::splat(1.5),
                glam::Quat::from_rotation_y(0.3 * x),
                place,
            ),
            materials: vec![material],
            visibility: Visibility::default(),
            pose: None,
        };
        (InstanceId { node: u64::from(i) + 1, part: 0 }, instance)
    });
    SceneDelta {
        meshes: vec![(mesh, Arc::new(sheet()))],
        materials: vec![(material, Material { double_sided: true, ..Material::default() })],
        instances: instances.collect(),
        reason: String::from("measurement"),
        ..SceneDelta::default()
    }
}

/// A unit square in the plane z = 0 with bumps.
fn sheet() -> Mesh {
    let row = CELLS + 1;
    let corners = (0..row * row).map(|i| Vec2::new((i % row) as f32, (i / row) as f32));
    let positions: Vec<Vec3> = corners
        .map(|c| ((c / CELLS as f32) - 0.5).extend(0.03 * (0.7 * c.x).sin() * (0.45 * c.y).cos()))
        .collect();
    let cells = (0..CELLS * CELLS).map(|i| i / CELLS * row + i % CELLS);
    let indices: Vec<u32> =
        cells.flat_map(|at| [at, at + 1, at + row, at + 1, at + row + 1, at + row]).collect();
    let count = positions.len();
    Mesh {
        name: String::from("sheet"),
        normals: vec![Vec3::Z; count],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); count],
        tex_coords0: vec![Vec2::ZERO; count],
        geometries: vec![Geometry {
            first_index: 0,
            index_count: indices.len() as u32,
            mesh_from_primitive: Affine3A::IDENTITY,
        }],
        positions,
        indices,
        ..Mesh::default()
    }
}
