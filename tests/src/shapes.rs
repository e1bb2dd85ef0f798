//! Meshes of spheres and boxes, and how two pictures of them are compared.

use caustica_renderer::Accumulated;
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

/// A picture to be compared to the bit.
pub fn bits(image: &Accumulated) -> Vec<[u32; 3]> {
    image.mean.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

/// Pixels of which a channel differs by more than a share of its value.
pub fn differing(a: &Accumulated, b: &Accumulated, share: f32) -> usize {
    let far = |p: &[f32; 3], q: &[f32; 3]| {
        p.iter().zip(q).any(|(x, y)| (x - y).abs() > share * (x.abs() + y.abs() + 0.01))
    };
    a.mean.iter().zip(&b.mean).filter(|(p, q)| far(p, q)).count()
}

/// Mean of all channels of all pixels.
pub fn mean_of(image: &Accumulated) -> f32 {
    image.mean.iter().flatten().sum::<f32>() / (3.0 * image.mean.len() as f32)
}
