//! How loose refits have made a BLAS whose vertices deform: the surface of the boxes around runs of neighbouring triangles,
//! now and when it was built, measured on the device and read two frames later. Triangles lie along a Morton curve, so that
//! runs are like the leaves of a tree.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Weak};

use caustica_gpu::{
    AccelStructure, Access, Buffer, BufferUse, Device, Frames, Location, MemoryUse, Recorder, Stage, Use,
};

use super::blas::BlasTable;
use super::policy::SURFACE_LIMIT;
use crate::error::Result;
use crate::gpu_types::{CLUSTER_TRIANGLES, Geometry, SurfaceJob};
use crate::passes::BlasSurface;
use crate::tables::Tables;

/// One refit in so many is measured, and the last one before a rest.
const MEASURE_EVERY: u32 = 8;

/// What is known of one structure.
struct Known {
    /// A structure that was replaced is not this one any more.
    structure: Weak<AccelStructure>,
    refits: u32,
    /// Square metres when it was built, once they are read.
    at_build: Option<f64>,
}

/// A measurement that the device has not finished.
struct Measurement {
    number: u32,
    structure: Weak<AccelStructure>,
    /// Value of the timeline that the frame which measures will reach.
    value: u64,
    surfaces: Buffer,
    count: usize,
}

/// Measurements of all BLASes that deform.
pub(crate) struct Surfaces {
    device: Arc<Device>,
    known: BTreeMap<u32, Known>,
    running: Vec<Measurement>,
    wanted: Vec<u32>,
    /// Those that were refitted since they were last measured.
    unmeasured: BTreeSet<u32>,
    /// Those that were refitted in this frame.
    refitted: BTreeSet<u32>,
}

impl Surfaces {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            device: Arc::clone(device),
            known: BTreeMap::new(),
            running: Vec::new(),
            wanted: Vec::new(),
            unmeasured: BTreeSet::new(),
            refitted: BTreeSet::new(),
        }
    }

    /// A BLAS was built or refitted in this frame.
    pub(crate) fn note(&mut self, number: u32, structure: &Arc<AccelStructure>, refit: bool) {
        let same = |known: &Known| std::ptr::eq(known.structure.as_ptr(), Arc::as_ptr(structure));
        match self.known.get_mut(&number).filter(|known| refit && same(known)) {
            Some(known) => {
                known.refits += 1;
                self.refitted.insert(number);
                if known.refits.is_multiple_of(MEASURE_EVERY) {
                    self.wanted.push(number);
                    self.unmeasured.remove(&number);
                } else {
                    self.unmeasured.insert(number);
                }
            }
            None => {
                let structure = Arc::downgrade(structure);
                self.known.insert(number, Known { structure, refits: 0, at_build: None });
                self.wanted.push(number);
                self.unmeasured.remove(&number);
            }
        }
    }

    /// The last pose of what has come to rest is measured, too.
    fn measure_rested(&mut self) {
        let refitted = std::mem::take(&mut self.refitted);
        let rested: Vec<u32> = self.unmeasured.difference(&refitted).copied().collect();
        self.unmeasured.retain(|number| refitted.contains(number));
        self.wanted.extend(rested);
    }

    /// Records the measurements that this frame asks for.
    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        blases: &BlasTable,
        pass: &BlasSurface,
    ) -> Result<()> {
        self.measure_rested();
        let first = self.running.len();
        let mut jobs = Vec::new();
        for number in std::mem::take(&mut self.wanted) {
            let Some((blas, built)) = blases.get(number).and_then(|blas| Some((blas, blas.built.as_ref()?)))
            else {
                continue;
            };
            let Some(posed) = blas.key.deforming.and_then(|id| tables.deforming.get(id)) else { continue };
            let geometries = &tables.meshes.get(blas.key.mesh)?.host.geometries;
            let counts = geometries.iter().map(|range| (range.index_count / 3).div_ceil(CLUSTER_TRIANGLES));
            let count: u32 = counts.clone().sum();
            let (usage, kind) = (BufferUse::General, MemoryUse::Staging);
            let size = u64::from(count) * 4;
            let surfaces = Buffer::new(&self.device, "surfaces", size, usage, Location::ReadBack, kind)?;
            let mut offset = 0;
            for (index, cluster_count) in counts.enumerate() {
                jobs.push(SurfaceJob {
                    geometry: posed.geometries_address() + (index * size_of::<Geometry>()) as u64,
                    surfaces: surfaces.address() + offset,
                    cluster_count,
                    pad0: 0,
                });
                offset += u64::from(cluster_count) * 4;
            }
            let structure = Arc::downgrade(&built.structure);
            let value = self.device.recording();
            self.running.push(Measurement { number, structure, value, surfaces, count: count as usize });
        }
        jobs.retain(|job| job.cluster_count > 0);
        if jobs.is_empty() {
            return Ok(());
        }
        let buffers = || self.running[first..].iter().map(|measurement| &measurement.surfaces);
        let mut uses = tables.uses(Stage::Compute).to_vec();
        uses.extend(buffers().map(|buffer| Use::Buffer(buffer, Stage::Compute, Access::StorageWrite)));
        pass.record(recorder, &jobs, &uses)?;
        let read: Vec<_> =
            buffers().map(|buffer| Use::Buffer(buffer, Stage::Host, Access::HostRead)).collect();
        recorder.declare(&read);
        Ok(())
    }

    /// Reads what the device has finished; returns the BLASes that have become too loose.
    pub(crate) fn read(&mut self) -> Vec<u32> {
        // Not as soon as it has finished, which would depend on the clock, but when it is sure to have.
        let finished = self.device.recording().saturating_sub(Frames::in_flight() as u64);
        let mut loose = Vec::new();
        let count = self.running.iter().take_while(|measurement| measurement.value <= finished).count();
        for measurement in self.running.drain(..count) {
            let Some(known) = self.known.get_mut(&measurement.number) else { continue };
            if !known.structure.ptr_eq(&measurement.structure) {
                continue;
            }
            let words = measurement.surfaces.mapped().chunks_exact(4).take(measurement.count);
            let surface: f64 = words.map(|word| f64::from(bytemuck::pod_read_unaligned::<f32>(word))).sum();
            match known.at_build {
                None => known.at_build = Some(surface),
                Some(at_build) if surface > SURFACE_LIMIT * at_build => loose.push(measurement.number),
                Some(_) => {}
            }
        }
        loose
    }

    /// Forgets what is no longer built.
    pub(crate) fn tidy(&mut self) {
        self.known.retain(|_, known| known.structure.strong_count() > 0);
        self.unmeasured.retain(|number| self.known.contains_key(number));
    }
}
