//! Spheres and boxes as triangles, for glTF has no word for them. In: a mesh of shapes. Out: a mesh with the same
//! primitives, normals and texture coordinates as those of the shapes (`shaders/lib/shape.glsl`), or `None` for too many.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::assets::{Mesh, MeshData, Primitive, Shape, ShapeKind};

/// Most shapes of a mesh that become triangles.
pub(super) const MOST_TESSELLATED: usize = 16_384;
/// Up to this many shapes of a mesh, spheres are fine.
const MOST_FINE: usize = 256;
/// Meridians and parallels of a sphere; among many shapes, and among few.
const COARSE: (u32, u32) = (16, 8);
const FINE: (u32, u32) = (64, 32);

/// The triangles of a mesh of shapes.
pub(super) fn tessellated(mesh: &Mesh) -> Option<Mesh> {
    let list = mesh.shapes()?.list();
    if list.len() > MOST_TESSELLATED {
        return None;
    }
    let detail = if list.len() > MOST_FINE { COARSE } else { FINE };
    let mut data = MeshData::default();
    let mut primitives = Vec::with_capacity(mesh.primitives.len());
    for source in &mesh.primitives {
        let first_index = data.indices.len() as u32;
        let (first, count) = (source.first_index as usize, source.index_count as usize);
        for shape in list.get(first..first + count).unwrap_or(&[]) {
            match shape.kind {
                ShapeKind::Sphere => add_sphere(&mut data, shape, detail),
                ShapeKind::Box => add_box(&mut data, shape),
            }
        }
        let index_count = data.indices.len() as u32 - first_index;
        primitives.push(Primitive { first_index, index_count, ..*source });
    }
    Some(Mesh::new(mesh.name.clone(), Arc::new(data), primitives))
}

/// Longitude from +Z over +X, angle from +Y. The first and last meridian lie on each other with other coordinates.
fn add_sphere(data: &mut MeshData, shape: &Shape, (meridians, parallels): (u32, u32)) {
    let base = data.positions.len() as u32;
    let row = meridians + 1;
    for (y, x) in (0..=parallels).flat_map(|y| (0..=meridians).map(move |x| (y, x))) {
        let uv = Vec2::new(x as f32 / meridians as f32, y as f32 / parallels as f32);
        let ((east, north), (out, up)) = ((uv.x * TAU).sin_cos(), (uv.y * PI).sin_cos());
        let normal = Vec3::new(out * east, up, out * north).normalize();
        add_vertex(data, shape, normal, normal, Vec3::new(north, 0.0, -east), uv);
    }
    for (y, x) in (0..parallels).flat_map(|y| (0..meridians).map(move |x| (y, x))) {
        let corner = base + y * row + x;
        let (above, below) =
            ([corner, corner + row + 1, corner + 1], [corner, corner + row, corner + row + 1]);
        // At the poles one of the two triangles is a line.
        if y > 0 {
            data.indices.extend(above);
        }
        if y + 1 < parallels {
            data.indices.extend(below);
        }
    }
}

/// To the right on each face as seen from outside with +Y up; -Z up on top, +Z up below.
fn add_box(data: &mut MeshData, shape: &Shape) {
    for normal in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
        let right = if normal.y.abs() > 0.5 { Vec3::X } else { Vec3::new(normal.z, 0.0, -normal.x) };
        let up = normal.cross(right);
        let base = data.positions.len() as u32;
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let uv = 0.5 + 0.5 * Vec2::new(x, -y);
            add_vertex(data, shape, normal + x * right + y * up, normal, right, uv);
        }
        data.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| base + corner));
    }
}

fn add_vertex(data: &mut MeshData, shape: &Shape, unit: Vec3, normal: Vec3, tangent: Vec3, uv: Vec2) {
    data.positions.push(shape.centre + shape.half_extent * unit);
    data.normals.push(normal);
    data.tangents.push(tangent.extend(1.0));
    data.tex_coords0.push(uv);
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use crate::assets::ShapeSource;

    #[test]
    fn triangles_lie_on_the_shape_and_face_outwards() {
        let sphere = ShapeSource::Sphere { centre: Vec3::X, radius_m: 2.0 };
        let cuboid = ShapeSource::Box { centre: Vec3::X, half_extent_m: Vec3::new(1.0, 2.0, 3.0) };
        for (source, volume) in [(sphere, 4.0 / 3.0 * PI * 8.0), (cuboid, 48.0)] {
            let mesh = tessellated(&Mesh::of_shapes(String::new(), source, &[]).unwrap()).unwrap();
            let corner = |i: u32| mesh.data.positions[i as usize] - Vec3::X;
            let (triangles, _) = mesh.data.indices.as_chunks::<3>();
            // The divergence theorem: only a closed surface that faces outwards has this volume.
            let found: f32 =
                triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum();
            assert!((found / volume - 1.0).abs() < 0.01, "{found} {volume}");
            for (normal, tangent) in mesh.data.normals.iter().zip(&mesh.data.tangents) {
                assert!((normal.length() - 1.0).abs() < 1e-6 && tangent.truncate().dot(*normal).abs() < 1e-6);
            }
        }
    }
}
