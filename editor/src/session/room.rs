//! Whether a scene has room on the device, before it takes the place of another or an edit brings more into it. Enters: a
//! document or an edit, a budget. Leaves: a refusal in words where even the least that it needs is too much. Textures do
//! not count: they go without levels.

use std::collections::{BTreeMap, BTreeSet};

use caustica_renderer::gpu::{GpuError, MemoryBudget};
use caustica_scene::{Document, Edit, MeshId, NodeKind, PrefabId, PrefabPackage};

use crate::sync::{Sync, least_bytes};

/// Refuses meshes that cannot be on the device together, whatever else is on it now.
///
/// # Errors
/// [`GpuError::NoRoom`] with what is needed, what there is and what would help.
pub(super) fn check(needed_bytes: u64, budget: MemoryBudget) -> Result<(), GpuError> {
    if needed_bytes <= budget.budget_bytes {
        return Ok(());
    }
    Err(GpuError::NoRoom {
        what: String::from("the meshes of the scene"),
        needed_mib: mib(needed_bytes),
        budget_mib: mib(budget.budget_bytes),
        remedy: format!("fewer or simpler meshes would fit, or {}", more_memory(budget)),
    })
}

/// What gives the program more device memory, in words.
pub(super) fn more_memory(budget: MemoryBudget) -> &'static str {
    if budget.is_limit { "a larger --memory-budget" } else { "a device with more memory" }
}

pub(super) fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// What the meshes that a document places take at least. Costs as much as the document is large.
pub(super) fn of_document(document: &Document) -> u64 {
    placed(document).into_values().fold(0, u64::saturating_add)
}

fn placed(document: &Document) -> BTreeMap<MeshId, u64> {
    let ids: BTreeSet<MeshId> = document.renderables().map(|placed| placed.mesh).collect();
    ids.into_iter().filter_map(|id| Some((id, least_bytes(document.mesh(id)?)))).collect()
}

/// What the meshes of a document take with an edit that brings some. Costs as much as the edit is large where the last frame
/// has shown the document as it is.
pub(super) fn with_edit(document: &Document, sync: &Sync, edit: &Edit) -> u64 {
    let mut brought = Brought::default();
    brought.take(document, edit);
    let (there, gone) = if document.has_changes() {
        let placed = placed(document);
        let gone = brought.replaced.iter().filter_map(|id| placed.get(id)).sum();
        (placed.values().fold(0, |sum: u64, bytes| sum.saturating_add(*bytes)), gone)
    } else {
        (sync.mesh_bytes(), brought.replaced.iter().map(|id| sync.mesh_bytes_of(*id)).sum())
    };
    there.saturating_sub(gone).saturating_add(brought.bytes())
}

/// Meshes that an edit brings and takes away.
#[derive(Default)]
struct Brought {
    /// What each new prefab takes.
    prefabs: BTreeMap<PrefabId, u64>,
    /// Prefabs of which the edit makes an instance.
    instanced: BTreeSet<PrefabId>,
    /// What comes without a prefab, or with one whose instances are there.
    placed_bytes: u64,
    /// Meshes of sources that others take the place of.
    replaced: Vec<MeshId>,
}

impl Brought {
    fn take(&mut self, document: &Document, edit: &Edit) {
        match edit {
            Edit::Batch { edits, .. } => edits.iter().for_each(|edit| self.take(document, edit)),
            Edit::AddPrefab(package) => {
                self.prefabs.insert(package.id, bytes_of(package));
            }
            Edit::ReplacePrefab(package) => {
                self.placed_bytes = self.placed_bytes.saturating_add(bytes_of(package));
                let old = document.prefab(package.id).map_or(&[][..], |prefab| &prefab.meshes);
                self.replaced.extend(old.iter().copied().collect::<BTreeSet<_>>());
            }
            Edit::AddMesh { value, .. } => {
                self.placed_bytes = self.placed_bytes.saturating_add(least_bytes(value));
            }
            Edit::SetPrefab { prefab, .. } => {
                self.instanced.insert(*prefab);
            }
            Edit::AddNode { subtree, .. } => {
                let kinds = subtree.nodes.iter().map(|(_, node)| &node.kind);
                self.instanced.extend(kinds.filter_map(|kind| match kind {
                    NodeKind::Prefab { prefab, .. } => Some(*prefab),
                    _ => None,
                }));
            }
            _ => {}
        }
    }

    fn bytes(&self) -> u64 {
        let instanced = self.instanced.iter().filter_map(|id| self.prefabs.get(id));
        instanced.fold(self.placed_bytes, |sum, bytes| sum.saturating_add(*bytes))
    }
}

/// What the meshes take that parts of a prefab place.
fn bytes_of(package: &PrefabPackage) -> u64 {
    let used: BTreeSet<MeshId> = package.prefab.nodes().iter().filter_map(|part| part.mesh).collect();
    let meshes = package.meshes.iter().filter(|(id, _)| used.contains(id));
    meshes.fold(0, |sum, (_, mesh)| sum.saturating_add(least_bytes(mesh)))
}
