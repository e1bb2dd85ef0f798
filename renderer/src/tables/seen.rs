//! How large textures appear in the views: which of them matter most when not all fit on the device.
//! Enters: instances and cameras. Leaves: pixels along the longer side, by texture, where it appears largest. An estimate: a
//! texture counts as laid once over the box of each geometry that uses it.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec3};

use super::Tables;
use crate::delta::{Camera, TextureId};
use crate::view::CameraMatrices;

/// What stands outside of the picture is seen in mirrors and glass at most.
const OUTSIDE: f32 = 0.25;

/// Walks all instances.
pub(super) fn sizes_px(tables: &Tables, views: &[(Camera, [u32; 2])]) -> BTreeMap<TextureId, f32> {
    let views: Vec<(CameraMatrices, [u32; 2])> =
        views.iter().map(|(camera, extent)| (CameraMatrices::of(camera, *extent), *extent)).collect();
    let mut sizes = BTreeMap::new();
    for (_, slot) in tables.instances.iter().filter(|(_, slot)| tables.instances.is_met(slot.id)) {
        let Ok(mesh) = tables.meshes.get(slot.instance.mesh) else { continue };
        for (index, id) in slot.instance.materials.iter().enumerate().take(mesh.geometry_count() as usize) {
            let Some(material) = tables.materials.get(*id) else { continue };
            if material.textures().next().is_none() {
                continue;
            }
            let size = largest(&slot.instance.render_from_mesh, mesh.placed_bounds(index), &views);
            for used in material.textures() {
                let known = sizes.entry(used.texture).or_insert(size);
                *known = size.max(*known);
            }
        }
    }
    sizes
}

fn largest(
    render_from_mesh: &Affine3A,
    (low, high): (Vec3, Vec3),
    views: &[(CameraMatrices, [u32; 2])],
) -> f32 {
    let centre = render_from_mesh.transform_point3((low + high) * 0.5);
    let radius = render_from_mesh.transform_vector3((high - low) * 0.5).length();
    let sizes = views.iter().map(|(camera, extent)| size_px(camera, *extent, centre, radius));
    sizes.fold(1.0, |largest, size| if size.is_finite() { size.max(largest) } else { largest })
}

/// Pixels across a ball in a view; `centre` in render space, `radius` in metres.
fn size_px(camera: &CameraMatrices, extent: [u32; 2], centre: Vec3, radius: f32) -> f32 {
    let clip = camera.clip_from_render * centre.extend(1.0);
    let px_per_unit = extent[1] as f32 * 0.5 / camera.half_extent.y;
    if camera.orthographic {
        return radius * 2.0 * px_per_unit;
    }
    // The ball's nearest point counts; in a perspective view w is the distance along the axis.
    let distance = (clip.w.abs() - radius).max(radius * 0.1).max(camera.near_m);
    let margin = radius * px_per_unit * 2.0 / extent[1] as f32;
    let inside =
        clip.w > -radius && clip.x.abs() < clip.w.abs() + margin && clip.y.abs() < clip.w.abs() + margin;
    let size = radius * 2.0 * px_per_unit / distance;
    if inside { size } else { size * OUTSIDE }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::delta::Projection;

    fn camera(projection: Projection) -> CameraMatrices {
        let camera = Camera { projection, render_from_camera: Affine3A::IDENTITY, ..Camera::default() };
        CameraMatrices::of(&camera, [200, 100])
    }

    #[test]
    fn near_things_appear_larger_than_far_ones_and_than_those_behind() {
        let yfov_rad = std::f32::consts::FRAC_PI_2;
        let camera = camera(Projection::Perspective { yfov_rad });
        let at = |x: f32, z: f32| size_px(&camera, [200, 100], Vec3::new(x, 0.0, z), 1.0);
        assert!((at(0.0, -11.0) - 10.0).abs() < 1e-3, "2 m at 10 m, 100 px for 20 m: {}", at(0.0, -11.0));
        assert!(at(0.0, -5.0) > at(0.0, -11.0));
        assert!((at(0.0, 11.0) - 2.5).abs() < 1e-3);
        assert!(at(100.0, -11.0) < at(0.0, -11.0), "outside to the right");
    }

    #[test]
    fn a_parallel_view_knows_no_distance() {
        let camera = camera(Projection::Orthographic { ymag_m: 5.0 });
        let at = |z: f32| size_px(&camera, [200, 100], Vec3::new(0.0, 0.0, z), 1.0);
        assert!((at(-1.0) - 20.0).abs() < 1e-3 && at(-1.0) == at(-100.0));
    }
}
