//! Draw batches of the raster G-buffer: the same geometry in the same state is one instanced draw.

use std::collections::BTreeMap;
use std::sync::Arc;

use caustica_gpu::{CullMode, Device, Recorder};

use super::instances::Instances;
use super::materials::{Materials, has_alpha, shows_both_sides};
use super::meshes::Meshes;
use super::table::Table;
use crate::delta::MeshId;
use crate::error::Result;

/// What must be equal for two instances to share a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BatchKey {
    /// Drawn with the alpha variant of the fragment stage.
    pub(crate) alpha: bool,
    pub(crate) cull: CullMode,
    /// Front faces wind clockwise.
    pub(crate) mirrored: bool,
    pub(crate) mesh: MeshId,
    pub(crate) geometry: u32,
}

/// One instanced draw.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Batch {
    pub(crate) key: BatchKey,
    pub(crate) first_instance: u32,
    pub(crate) instance_count: u32,
}

/// All batches, and the slots they draw.
pub(crate) struct Draws {
    slots: Table<u32>,
    batches: Vec<Batch>,
    mirrored: BTreeMap<u32, bool>,
}

impl Draws {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self { slots: Table::new(device, "draw instances"), batches: Vec::new(), mirrored: BTreeMap::new() }
    }

    /// Sorts every visible instance into its batches.
    pub(crate) fn rebuild(&mut self, instances: &Instances, materials: &Materials, meshes: &Meshes) {
        let mut lists: BTreeMap<BatchKey, Vec<u32>> = BTreeMap::new();
        self.mirrored.clear();
        for (slot, entry) in instances.iter() {
            if !entry.instance.visibility.shown || entry.degenerate {
                continue;
            }
            let Ok(mesh) = meshes.get(entry.instance.mesh) else { continue };
            let mirrored = instances.is_mirrored(slot);
            self.mirrored.insert(slot, mirrored);
            for (geometry, id) in entry.instance.materials.iter().enumerate() {
                let Some(material) = materials.get(*id) else { continue };
                let turned = mesh.host.geometries[geometry].mesh_from_primitive.matrix3.determinant() < 0.0;
                let key = BatchKey {
                    alpha: has_alpha(material),
                    cull: if shows_both_sides(material) { CullMode::None } else { CullMode::Back },
                    mirrored: mirrored != turned,
                    mesh: entry.instance.mesh,
                    geometry: geometry as u32,
                };
                lists.entry(key).or_default().push(slot);
            }
        }
        let mut slots = Vec::new();
        self.batches = lists
            .into_iter()
            .map(|(key, list)| {
                let first_instance = slots.len() as u32;
                slots.extend_from_slice(&list);
                Batch { key, first_instance, instance_count: list.len() as u32 }
            })
            .collect();
        self.slots.replace(slots);
    }

    /// After transforms changed: a mirrored or degenerate state that flipped moves the instance to another batch.
    pub(crate) fn follow_mirrored(
        &mut self,
        moved: &[u32],
        instances: &Instances,
        materials: &Materials,
        meshes: &Meshes,
    ) {
        let flipped = moved.iter().any(|slot| {
            let now = instances
                .get(*slot)
                .filter(|entry| entry.instance.visibility.shown && !entry.degenerate)
                .map(|_| instances.is_mirrored(*slot));
            now != self.mirrored.get(slot).copied()
        });
        if flipped {
            self.rebuild(instances, materials, meshes);
        }
    }

    pub(crate) fn batches(&self) -> &[Batch] {
        &self.batches
    }

    pub(crate) fn address(&self) -> u64 {
        self.slots.address()
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.slots.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.slots.flush(recorder)
    }
}
