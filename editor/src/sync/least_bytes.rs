//! What a mesh takes on the device at least: vertices, indices and the smallest structure over them.

use caustica_scene::Mesh;

/// Position, normal, tangent, two sets of texture coordinates, colour.
const VERTEX_BYTES: u64 = 64;
/// Indices, and what an acceleration structure holds at least: half a node of 32 bytes and an index.
const TRIANGLE_BYTES: u64 = 12 + 20;
/// A sphere or box with its bounds, and the same of the structure.
const SHAPE_BYTES: u64 = 32 + 24 + 20;

/// Bytes that no scene with this mesh does without.
pub fn least_bytes(mesh: &Mesh) -> u64 {
    let vertices = mesh.data.positions.len() as u64 * VERTEX_BYTES;
    vertices + mesh.triangle_count() as u64 * TRIANGLE_BYTES + mesh.shape_count() as u64 * SHAPE_BYTES
}
