//! Draw batches of the raster G-buffer: the same geometry in the same state is one instanced draw. Each batch owns a run
//! of one table with room to grow, so that an instance comes and goes at its own cost.

use std::collections::BTreeMap;
use std::sync::Arc;

use caustica_gpu::{CullMode, Device, Recorder};

use super::instances::{Instances, Slot};
use super::materials::{Materials, has_alpha, shows_both_sides};
use super::meshes::Meshes;
use super::table::{Download, Table};
use crate::delta::MeshId;
use crate::error::Result;

/// Entries of the smallest run.
const SMALLEST_RUN: u32 = 4;

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

/// The instance slots of one batch, and the run of the table that holds them.
#[derive(Debug, Default)]
struct List {
    key: Option<BatchKey>,
    start: u32,
    capacity: u32,
    slots: Vec<u32>,
}

/// Where a slot stands: number of the list and place in it.
type Entry = (u32, u32);

/// All batches, and the slots they draw.
pub(crate) struct Draws {
    table: Table<u32>,
    by_key: BTreeMap<BatchKey, u32>,
    lists: Vec<List>,
    free_lists: Vec<u32>,
    /// Free runs of the table, by capacity.
    free_runs: BTreeMap<u32, Vec<u32>>,
    entries: Vec<Vec<Entry>>,
}

impl Draws {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            table: Table::new(device, "draw instances"),
            by_key: BTreeMap::new(),
            lists: Vec::new(),
            free_lists: Vec::new(),
            free_runs: BTreeMap::new(),
            entries: Vec::new(),
        }
    }

    /// Sorts one slot into the batches that it belongs to now; a free, hidden or degenerate one into none.
    pub(crate) fn follow(
        &mut self,
        slot: u32,
        instances: &Instances,
        materials: &Materials,
        meshes: &Meshes,
    ) {
        self.take_out(slot);
        let Some(entry) = instances.get(slot).filter(|entry| is_drawn(entry)) else { return };
        let Ok(mesh) = meshes.get(entry.instance.mesh) else { return };
        let mirrored = instances.is_mirrored(slot);
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
            self.put_in(slot, key);
        }
    }

    fn put_in(&mut self, slot: u32, key: BatchKey) {
        let number = match self.by_key.get(&key) {
            Some(number) => *number,
            None => {
                let number = self.free_lists.pop().unwrap_or_else(|| {
                    self.lists.push(List::default());
                    self.lists.len() as u32 - 1
                });
                self.lists[number as usize].key = Some(key);
                self.by_key.insert(key, number);
                number
            }
        };
        let place = self.lists[number as usize].slots.len() as u32;
        if place == self.lists[number as usize].capacity {
            self.grow(number);
        }
        let list = &mut self.lists[number as usize];
        list.slots.push(slot);
        self.table.set((list.start + place) as usize, slot);
        if self.entries.len() <= slot as usize {
            self.entries.resize_with(slot as usize + 1, Vec::new);
        }
        self.entries[slot as usize].push((number, place));
    }

    /// Moves a list to a run twice as long.
    fn grow(&mut self, number: u32) {
        let list = &mut self.lists[number as usize];
        let (old_start, old_capacity) = (list.start, list.capacity);
        list.capacity = (list.capacity * 2).max(SMALLEST_RUN);
        let free = self.free_runs.get_mut(&list.capacity).and_then(Vec::pop);
        list.start = free.unwrap_or(self.table.len() as u32);
        // The last entry first: the table then grows once.
        self.table.set((list.start + list.capacity) as usize - 1, 0);
        for (place, slot) in list.slots.iter().enumerate() {
            self.table.set(list.start as usize + place, *slot);
        }
        if old_capacity > 0 {
            self.free_runs.entry(old_capacity).or_default().push(old_start);
        }
    }

    fn take_out(&mut self, slot: u32) {
        let Some(entries) = self.entries.get_mut(slot as usize) else { return };
        for (number, place) in std::mem::take(entries) {
            let list = &mut self.lists[number as usize];
            list.slots.swap_remove(place as usize);
            if let Some(moved) = list.slots.get(place as usize).copied() {
                let from = list.slots.len() as u32;
                self.table.set((list.start + place) as usize, moved);
                for entry in &mut self.entries[moved as usize] {
                    if *entry == (number, from) {
                        entry.1 = place;
                    }
                }
            }
            if list.slots.is_empty() {
                let List { key, start, capacity, .. } = std::mem::take(list);
                self.free_runs.entry(capacity).or_default().push(start);
                self.free_lists.push(number);
                if let Some(key) = key {
                    self.by_key.remove(&key);
                }
            }
        }
    }

    /// Forgets every run once nothing is drawn, so that a scene loaded afresh lies as in a new renderer.
    pub(crate) fn tidy(&mut self) {
        if self.by_key.is_empty() {
            self.table.clear();
            self.lists.clear();
            self.free_lists.clear();
            self.free_runs.clear();
            self.entries.clear();
        }
    }

    /// All batches in the order in which they are drawn.
    pub(crate) fn batches(&self) -> impl Iterator<Item = Batch> {
        self.by_key.iter().map(|(key, number)| {
            let list = &self.lists[*number as usize];
            Batch { key: *key, first_instance: list.start, instance_count: list.slots.len() as u32 }
        })
    }

    pub(crate) fn address(&self) -> u64 {
        self.table.address()
    }

    /// Records the copy of the table back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<Download> {
        self.table.download(recorder)
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.table.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.table.flush(recorder)
    }
}

fn is_drawn(entry: &Slot) -> bool {
    let visibility = entry.instance.visibility;
    visibility.shown && visibility.to_camera && !entry.degenerate
}
