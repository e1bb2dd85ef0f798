//! Meshes of spheres and boxes.

use caustica_renderer::delta::{Geometry, Mesh, Shape, ShapeKind};
use glam::{Affine3A, Vec3};

/// A mesh of shapes, each of them a primitive.
pub fn mesh_of(shapes: &[Shape]) -> Mesh {
    let geometry = |first_index: usize| Geometry {
        first_index: first_index as u32,
        index_count: 1,
        mesh_from_primitive: Affine3A::IDENTITY,
    };
    Mesh {
        name: String::from("shapes"),
        shapes: shapes.to_vec(),
        geometries: (0..shapes.len()).map(geometry).collect(),
        ..Mesh::default()
    }
}

/// A sphere around the origin.
pub fn ball(radius: f32) -> Shape {
    Shape { kind: ShapeKind::Sphere, centre: Vec3::ZERO, half_extent: Vec3::splat(radius) }
}

/// A cube around the origin.
pub fn block(side: f32) -> Shape {
    Shape { kind: ShapeKind::Box, centre: Vec3::ZERO, half_extent: Vec3::splat(0.5 * side) }
}

/// A shift.
pub fn at(x: f32, y: f32, z: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(x, y, z))
}
