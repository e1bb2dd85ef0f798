//! Acceleration structures: one BLAS a (mesh, opaque geometries), one TLAS. Enters: tables and what changed in them.
//! Leaves: a TLAS that is right in this very frame. Builds nothing that did not change.

mod blas;
mod tlas;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use caustica_gpu::{Access, Device, Recorder, ResourceId, SceneSet, Stage, Use};

use crate::error::Result;
use crate::measure::AccelStatistics;
use crate::tables::{Changed, Tables};

use blas::{Blas, BlasKey};
use tlas::Tlas;

/// All acceleration structures of the scene.
pub(crate) struct Accel {
    device: Arc<Device>,
    blas: BTreeMap<BlasKey, Blas>,
    tlas: Tlas,
    /// Stands for all BLASes in the barrier tracker.
    blas_group: ResourceId,
    tlas_group: ResourceId,
    scratch: blas::Scratch,
    statistics: AccelStatistics,
}

impl Accel {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            device: Arc::clone(device),
            blas: BTreeMap::new(),
            tlas: Tlas::new(device),
            blas_group: device.new_resource_id(),
            tlas_group: device.new_resource_id(),
            scratch: blas::Scratch::new(device),
            statistics: AccelStatistics::default(),
        }
    }

    /// Builds, refits or leaves alone, as `changed` asks.
    ///
    /// # Errors
    /// When memory runs out.
    pub(crate) fn update(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        changed: &Changed,
    ) -> Result<()> {
        self.statistics.forget_frame();
        if changed.structure {
            self.update_blas(recorder, tables, changed)?;
        }
        if changed.structure || !changed.moved.is_empty() || !self.tlas.exists() {
            let refs = |key: &BlasKey| self.blas.get(key).map_or(0, Blas::address);
            let groups = tlas::Groups { blas: self.blas_group, tlas: self.tlas_group };
            let what = self.tlas.update(recorder, tables, changed, refs, &mut self.scratch, groups)?;
            self.statistics.tlas = what;
        }
        self.statistics.add_up();
        self.statistics.blas_count = self.blas.len() as u64;
        self.statistics.instance_count = tables.instances.len() as u64;
        if changed.structure {
            self.statistics.triangle_count = tables.meshes.triangle_count();
            self.statistics.blas_bytes = self.blas.values().map(Blas::size).sum();
        }
        Ok(())
    }

    fn update_blas(&mut self, recorder: &mut Recorder, tables: &Tables, changed: &Changed) -> Result<()> {
        let changed_meshes: BTreeSet<_> = changed.meshes.iter().copied().collect();
        let mut wanted: BTreeSet<BlasKey> = BTreeSet::new();
        for (_, slot) in tables.instances.iter() {
            wanted.insert(BlasKey::of(slot, &tables.materials));
        }
        self.blas.retain(|key, _| wanted.contains(key) && !changed_meshes.contains(&key.mesh));
        let missing: Vec<BlasKey> = wanted.into_iter().filter(|key| !self.blas.contains_key(key)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let (blas, scratch, group, device) =
            (&mut self.blas, &mut self.scratch, self.blas_group, &self.device);
        let built = recorder.pass("accel.blas", |recorder| {
            blas::build_all(device, recorder, tables, &missing, scratch, group)
        })?;
        self.statistics.blas_built = built.len() as u64;
        blas.extend(built);
        Ok(())
    }

    /// Puts the TLAS into the set of a frame that is free to record.
    pub(crate) fn update_set(&mut self, frame_slot: usize, set: &SceneSet) {
        self.tlas.update_set(frame_slot, set);
    }

    /// The uses of a pass that traces rays.
    pub(crate) fn uses(&self) -> [Use<'static>; 2] {
        [
            Use::Group(self.tlas_group, Stage::RayTracing, Access::AccelTrace),
            Use::Group(self.blas_group, Stage::RayTracing, Access::AccelTrace),
        ]
    }

    pub(crate) fn statistics(&self) -> &AccelStatistics {
        &self.statistics
    }
}
