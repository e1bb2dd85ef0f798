//! Whether a scene has room on the device, before it takes the place of another. Enters: a document, a budget. Leaves: a
//! refusal in words where even the least that it needs is too much. Textures do not count: they go without levels.

use std::collections::BTreeSet;

use caustica_renderer::gpu::{GpuError, MemoryBudget};
use caustica_scene::{Document, Mesh, MeshId};

/// Position, normal, tangent, two sets of texture coordinates, colour.
const VERTEX_BYTES: u64 = 64;
/// Indices, and what an acceleration structure holds at least: half a node of 32 bytes and an index.
const TRIANGLE_BYTES: u64 = 12 + 20;
/// A sphere or box with its bounds, and the same of the structure.
const SHAPE_BYTES: u64 = 32 + 24 + 20;

/// Refuses a document whose meshes cannot be on the device together, whatever else is on it now.
///
/// # Errors
/// [`GpuError::OutOfMemory`] with what is needed and what there is.
pub(super) fn check(document: &Document, budget: MemoryBudget) -> Result<(), GpuError> {
    let placed: BTreeSet<MeshId> = document.renderables().map(|placed| placed.mesh).collect();
    let meshes = placed.into_iter().filter_map(|id| document.mesh(id));
    let needed = meshes.fold(0_u64, |sum, mesh| sum.saturating_add(least_bytes(mesh)));
    if needed <= budget.budget_bytes {
        return Ok(());
    }
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    Err(GpuError::OutOfMemory {
        what: String::from("what the scene at least holds in meshes"),
        requested_mib: mib(needed),
        used_mib: 0.0,
        budget_mib: mib(budget.budget_bytes),
    })
}

fn least_bytes(mesh: &Mesh) -> u64 {
    let vertices = mesh.data.positions.len() as u64 * VERTEX_BYTES;
    vertices + mesh.triangle_count() as u64 * TRIANGLE_BYTES + mesh.shape_count() as u64 * SHAPE_BYTES
}
