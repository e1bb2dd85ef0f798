//! Where the primitives of a mesh stand, and how much room they take. Enters: vertices, shapes and maps. Leaves: boxes in single precision,
//! and maps that never leave it.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

use super::shapes;
use crate::delta::{self, Mesh};

/// Bounds of a primitive, primitive space; a point at the origin when it is empty.
pub(super) fn bounds_of(mesh: &Mesh, geometry: &delta::Geometry) -> (Vec3, Vec3) {
    let range = geometry.first_index as usize..(geometry.first_index + geometry.index_count) as usize;
    if !mesh.shapes.is_empty() {
        let boxes = mesh.shapes[range].iter().map(shapes::bounds_of);
        return boxes.reduce(join).unwrap_or((Vec3::ZERO, Vec3::ZERO));
    }
    let points = mesh.indices[range].iter().map(|i| mesh.positions[*i as usize]);
    points.map(|p| (p, p)).reduce(join).unwrap_or((Vec3::ZERO, Vec3::ZERO))
}

fn join(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Bounds of a box after a map.
pub(super) fn placed((low, high): (Vec3, Vec3), map: &Affine3A) -> (Vec3, Vec3) {
    let (centre, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let m = map.matrix3;
    let reach = Vec3::from(m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z);
    let centre = map.transform_point3(centre);
    (centre - reach, centre + reach)
}

/// Squares of what is farther away overflow single precision.
const FARTHEST_M: f32 = 1e19;

/// Where a primitive may stand: its map, or one that leaves nothing of it where the map or what it gives ends single precision. A structure
/// would spread such numbers to all that shares a node with it, so they never reach the device.
pub(super) fn standing(map: &Affine3A, bounds: (Vec3, Vec3)) -> Affine3A {
    let (low, high) = placed(bounds, map);
    let near = |corner: Vec3| corner.is_finite() && corner.abs().max_element() < FARTHEST_M;
    let stands = map.is_finite() && near(low) && near(high);
    if stands || *map == Affine3A::IDENTITY {
        return *map;
    }
    Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO }
}

/// Middle of the bounds of all primitives, mesh space.
pub(super) fn centre_of(mesh: &Mesh, bounds: &[(Vec3, Vec3)]) -> Vec3 {
    let all =
        mesh.geometries.iter().zip(bounds).map(|(geometry, b)| placed(*b, &geometry.mesh_from_primitive));
    all.reduce(join).map_or(Vec3::ZERO, |(low, high)| (low + high) * 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_primitive_beyond_single_precision_stands_nowhere() {
        let bounds = (Vec3::splat(-1.0), Vec3::splat(1.0));
        let moved = |by: f32| Affine3A::from_translation(Vec3::new(0.0, by, 0.0));
        for there in [Affine3A::IDENTITY, moved(1e18), Affine3A::from_scale(Vec3::splat(1e-30))] {
            assert_eq!(standing(&there, bounds), there);
        }
        let gone = |map: Affine3A| standing(&map, bounds).matrix3 == Mat3A::ZERO;
        assert!(gone(moved(f32::NAN)) && gone(moved(f32::INFINITY)) && gone(moved(3e38)));
        // Finite entries whose sum is not.
        let rows = Mat3A::from_cols(Vec3A::splat(3e38), Vec3A::splat(3e38), Vec3A::Z);
        assert!(gone(Affine3A { matrix3: rows, translation: Vec3A::ZERO }));
    }
}
