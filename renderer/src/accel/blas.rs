//! Which BLASes there are, and which instance slots use them. A BLAS that nothing uses is dropped.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use caustica_gpu::{AccelGeometry, AccelStructure, BoxGeometry, Device, Recorder, TriangleGeometry};
use glam::Vec3;

use crate::delta::{InstanceId, MeshId};
use crate::error::Result;
use crate::tables::{Download, Slot, Snapshot, Table, Tables};

/// What a BLAS is made for.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BlasKey {
    pub(crate) mesh: MeshId,
    /// The instance whose vertices deform; `None`: shared by all rigid instances of the mesh.
    pub(crate) deforming: Option<InstanceId>,
    /// For each geometry: any-hit is never called.
    pub(crate) opaque: Vec<bool>,
}

/// The geometries that a BLAS is built from: all of one kind.
pub(crate) enum BlasInput {
    Triangles(Vec<TriangleGeometry>),
    Boxes(Vec<BoxGeometry>),
}

impl BlasInput {
    pub(crate) fn geometry(&self) -> AccelGeometry<'_> {
        match self {
            Self::Triangles(list) => AccelGeometry::Triangles(list),
            Self::Boxes(list) => AccelGeometry::Boxes(list),
        }
    }

    /// Number of triangles or boxes.
    pub(crate) fn element_count(&self) -> u64 {
        match self {
            Self::Triangles(list) => list.iter().map(|geometry| u64::from(geometry.triangle_count)).sum(),
            Self::Boxes(list) => list.iter().map(|geometry| u64::from(geometry.count)).sum(),
        }
    }

    fn redirect(&mut self, snapshot: &Snapshot) {
        match self {
            Self::Triangles(list) => {
                list.iter_mut().for_each(|geometry| snapshot.redirect_triangles(geometry))
            }
            Self::Boxes(list) => list.iter_mut().for_each(|geometry| snapshot.redirect_boxes(geometry)),
        }
    }
}

impl BlasKey {
    pub(crate) fn of(slot: &Slot, tables: &Tables) -> Self {
        let materials = &tables.materials;
        let opaque = slot
            .instance
            .materials
            .iter()
            .map(|id| materials.get(*id).is_none_or(crate::tables::is_opaque))
            .collect();
        let deforming = tables.deforming.get(slot.id).map(|_| slot.id);
        Self { mesh: slot.instance.mesh, deforming, opaque }
    }

    /// Input of a build: of the tables as they are, or of a snapshot of them.
    pub(crate) fn geometries(&self, tables: &Tables, snapshot: Option<&Snapshot>) -> Result<BlasInput> {
        let mesh = tables.meshes.get(self.mesh)?;
        let opaque = self.opaque.iter().enumerate();
        let mut input = match self.deforming.and_then(|id| tables.deforming.get(id)) {
            Some(deforming) => BlasInput::Triangles(
                opaque.map(|(index, opaque)| deforming.triangles(index, *opaque)).collect(),
            ),
            None if mesh.shapes.is_some() => {
                BlasInput::Boxes(opaque.filter_map(|(index, opaque)| mesh.boxes(index, *opaque)).collect())
            }
            None => {
                BlasInput::Triangles(opaque.map(|(index, opaque)| mesh.triangles(index, *opaque)).collect())
            }
        };
        if let Some(snapshot) = snapshot {
            input.redirect(snapshot);
        }
        Ok(input)
    }
}

/// What a structure was built to be good at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Traced fast; may be compacted.
    Static {
        /// It was.
        compacted: bool,
    },
    /// Refitted and rebuilt in place.
    Dynamic,
}

/// A structure that is in use.
pub(crate) struct Built {
    pub(crate) structure: Arc<AccelStructure>,
    pub(crate) form: Form,
    /// Bounds of the geometries when it was built from nothing, mesh space.
    pub(crate) boxes: Vec<(Vec3, Vec3)>,
}

/// One BLAS.
pub(crate) struct Blas {
    pub(crate) key: BlasKey,
    pub(crate) users: u32,
    pub(crate) built: Option<Built>,
    /// It takes the place of one that was built, as when a material lets light through or the mesh is another: whatever its size it is built at
    /// once, for what was seen must not vanish.
    pub(crate) succeeds: bool,
    /// Frame of the last change of its geometry.
    pub(crate) changed_at: u64,
    /// Another one with every change of its geometry: what was begun before is told from what fits.
    pub(crate) version: u64,
    /// Another one with every mesh content: what was built from another cannot be refitted to this one.
    pub(crate) content: u64,
    /// Bytes that it would take when compacted, once they are known.
    pub(crate) compacted_size: Option<u64>,
}

/// All BLASes, by number.
pub(crate) struct BlasTable {
    by_key: BTreeMap<BlasKey, u32>,
    entries: Vec<Option<Blas>>,
    free: Vec<u32>,
    of_slot: Vec<Option<u32>>,
    /// Device addresses by number, 0 where nothing is built: what the instance descriptors look up.
    addresses: Table<u64>,
    /// Numbers of those that are to be built in the next frame.
    pub(crate) unbuilt: BTreeSet<u32>,
    /// Numbers of those that were edited and are to be traced fast again once they rest.
    pub(crate) lively: BTreeSet<u32>,
    /// Numbers of static ones that were not compacted.
    pub(crate) uncompacted: BTreeSet<u32>,
    /// Numbers of those whose first build is left to the background.
    pub(crate) waiting: BTreeSet<u32>,
    /// Numbers of those that refits have made too loose.
    pub(crate) decayed: BTreeSet<u32>,
    bytes: u64,
    next_version: u64,
}

impl BlasTable {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            by_key: BTreeMap::new(),
            entries: Vec::new(),
            free: Vec::new(),
            of_slot: Vec::new(),
            addresses: Table::new(device, "blas addresses"),
            unbuilt: BTreeSet::new(),
            lively: BTreeSet::new(),
            uncompacted: BTreeSet::new(),
            waiting: BTreeSet::new(),
            decayed: BTreeSet::new(),
            bytes: 0,
            next_version: 0,
        }
    }

    /// The geometry of a BLAS has changed in `frame`.
    pub(crate) fn mark_changed(&mut self, number: u32, frame: u64) {
        self.next_version += 1;
        let version = self.next_version;
        if let Some(blas) = self.get_mut(number) {
            (blas.version, blas.changed_at) = (version, frame);
        }
    }

    /// Gives a slot the BLAS that it needs now. True: it is another than before.
    pub(crate) fn assign(&mut self, slot: u32, key: Option<BlasKey>) -> bool {
        if self.of_slot.len() <= slot as usize {
            self.of_slot.resize(slot as usize + 1, None);
        }
        let old = self.of_slot[slot as usize];
        if old.and_then(|number| self.get(number)).map(|blas| &blas.key) == key.as_ref() {
            return false;
        }
        let shown = old.and_then(|old| self.get(old)).filter(|old| old.built.is_some());
        let succeeds = shown.zip(key.as_ref()).is_some_and(|(old, new)| old.key.mesh == new.mesh);
        let number = key.map(|key| match self.by_key.get(&key) {
            Some(number) => *number,
            None => self.insert(key),
        });
        if let Some(blas) = number.and_then(|number| self.get_mut(number)) {
            blas.users += 1;
            blas.succeeds |= succeeds;
        }
        self.of_slot[slot as usize] = number;
        if let Some(blas) = old.and_then(|old| self.get_mut(old)) {
            blas.users -= 1;
        }
        if let Some(old) = old.filter(|old| self.get(*old).is_some_and(|blas| blas.users == 0)) {
            self.drop_entry(old);
        }
        true
    }

    fn insert(&mut self, key: BlasKey) -> u32 {
        let number = self.free.pop().unwrap_or(self.entries.len() as u32);
        if self.entries.len() <= number as usize {
            self.entries.resize_with(number as usize + 1, || None);
        }
        self.by_key.insert(key.clone(), number);
        self.next_version += 1;
        self.entries[number as usize] = Some(Blas {
            key,
            users: 0,
            built: None,
            succeeds: false,
            changed_at: 0,
            version: self.next_version,
            content: self.next_version,
            compacted_size: None,
        });
        self.addresses.set(number as usize, 0);
        self.unbuilt.insert(number);
        number
    }

    /// Leaves a first build to the background.
    pub(crate) fn wait_for_background(&mut self, number: u32) {
        self.unbuilt.remove(&number);
        self.waiting.insert(number);
    }

    fn drop_entry(&mut self, number: u32) {
        self.forget_structure(number);
        if let Some(blas) = self.entries[number as usize].take() {
            self.by_key.remove(&blas.key);
        }
        self.waiting.remove(&number);
        self.unbuilt.remove(&number);
        self.free.push(number);
    }

    /// Forgets numbers and slots once nothing is left, so that a scene loaded afresh lies as in a new renderer.
    pub(crate) fn tidy(&mut self) {
        if self.by_key.is_empty() {
            self.entries.clear();
            self.free.clear();
            self.of_slot.clear();
            self.addresses.clear();
        }
    }

    /// What it was built from is gone: it is to be built anew.
    pub(crate) fn forget_structure(&mut self, number: u32) {
        self.lively.remove(&number);
        self.uncompacted.remove(&number);
        self.decayed.remove(&number);
        self.waiting.remove(&number);
        self.unbuilt.insert(number);
        self.addresses.set(number as usize, 0);
        self.next_version += 1;
        let content = self.next_version;
        let Some(blas) = self.entries.get_mut(number as usize).and_then(Option::as_mut) else { return };
        (blas.content, blas.compacted_size) = (content, None);
        if let Some(old) = blas.built.take() {
            self.bytes -= old.structure.size();
            blas.succeeds = true;
        }
    }

    /// Takes a structure into use.
    pub(crate) fn adopt(&mut self, number: u32, built: Built) {
        for set in
            [&mut self.unbuilt, &mut self.waiting, &mut self.decayed, &mut self.lively, &mut self.uncompacted]
        {
            set.remove(&number);
        }
        let Some(blas) = self.entries.get_mut(number as usize).and_then(Option::as_mut) else { return };
        match built.form {
            Form::Dynamic if blas.key.deforming.is_none() => self.lively.insert(number),
            Form::Static { compacted: false } => self.uncompacted.insert(number),
            _ => false,
        };
        self.addresses.set(number as usize, built.structure.address());
        self.bytes += built.structure.size();
        blas.compacted_size = None;
        if let Some(old) = blas.built.replace(built) {
            self.bytes -= old.structure.size();
        }
    }

    pub(crate) fn get(&self, number: u32) -> Option<&Blas> {
        self.entries.get(number as usize).and_then(Option::as_ref)
    }

    pub(crate) fn get_mut(&mut self, number: u32) -> Option<&mut Blas> {
        self.entries.get_mut(number as usize).and_then(Option::as_mut)
    }

    /// Number of the BLAS of a slot.
    pub(crate) fn number_of(&self, slot: u32) -> Option<u32> {
        self.of_slot.get(slot as usize).copied().flatten()
    }

    /// Numbers of the BLASes of a mesh.
    pub(crate) fn of_mesh(&self, mesh: MeshId) -> Vec<u32> {
        let first = BlasKey { mesh, deforming: None, opaque: Vec::new() };
        self.by_key
            .range(first..)
            .take_while(|(key, _)| key.mesh == mesh)
            .map(|(_, number)| *number)
            .collect()
    }

    /// Number of the BLAS of an instance whose vertices deform.
    pub(crate) fn of_deforming(&self, mesh: MeshId, id: InstanceId) -> Option<u32> {
        let first = BlasKey { mesh, deforming: Some(id), opaque: Vec::new() };
        let (key, number) = self.by_key.range(first..).next()?;
        (key.deforming == Some(id)).then_some(*number)
    }

    /// All keys with their BLAS, in order of key.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, &Blas)> {
        self.by_key.values().filter_map(|number| Some((*number, self.get(*number)?)))
    }

    /// How many slots ever had a BLAS.
    pub(crate) fn slot_count(&self) -> u32 {
        self.of_slot.len() as u32
    }

    pub(crate) fn len(&self) -> usize {
        self.by_key.len()
    }

    /// Bytes of all structures in use.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(crate) fn address(&self) -> u64 {
        self.addresses.address()
    }

    /// Records the copy of the addresses back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<Download> {
        self.addresses.download(recorder)
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.addresses.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.addresses.flush(recorder)
    }
}
