//! Acceleration structures: one BLAS a (mesh, opaque geometries, deforming instance), one TLAS. Enters: tables and what
//! changed in them. Leaves: a TLAS that is right in this very frame. Builds nothing that did not change.

mod background;
mod blas;
mod build;
mod order;
mod policy;
mod surface;
mod tlas;

use std::sync::Arc;

use caustica_gpu::{Access, BuildMode, Device, Recorder, SceneSet, Stage, Use};
use glam::Vec3;

use crate::delta::MeshId;
use crate::error::Result;
use crate::measure::AccelStatistics;
use crate::passes::ScenePasses;
use crate::tables::{Changed, Download, Tables};

use background::{Adopted, Later};
use blas::{BlasKey, BlasTable, Built, Form};
use build::{Job, Scratch, job_of};
pub use policy::AccelPolicy;
use policy::{Change, SURFACE_LIMIT, change_of, stretch};
use surface::Surfaces;
use tlas::{Dirty, Tlas};

/// All acceleration structures of the scene.
pub(crate) struct Accel {
    device: Arc<Device>,
    policy: AccelPolicy,
    blases: BlasTable,
    tlas: Tlas,
    later: Later,
    surfaces: Surfaces,
    scratch: Scratch,
    groups: tlas::Groups,
    /// Updates so far.
    frame: u64,
    /// No background work before this update.
    try_again_at: u64,
    statistics: AccelStatistics,
}

/// So many frames after memory did not suffice for background work it is tried again.
const TRY_AGAIN_FRAMES: u64 = 60;

impl Accel {
    /// # Errors
    /// When memory runs out.
    pub(crate) fn new(device: &Arc<Device>, policy: AccelPolicy) -> Result<Self> {
        let groups = tlas::Groups {
            blas: device.new_resource_id(),
            tlas: device.new_resource_id(),
            descriptors: device.new_resource_id(),
        };
        Ok(Self {
            device: Arc::clone(device),
            policy,
            blases: BlasTable::new(device),
            tlas: Tlas::new(device),
            later: Later::new(device)?,
            surfaces: Surfaces::new(device),
            scratch: Scratch::new(device),
            groups,
            frame: 0,
            try_again_at: 0,
            statistics: AccelStatistics::default(),
        })
    }

    /// Builds, refits or leaves alone, as `changed` asks. True: something of which the build was left to the background
    /// has appeared, so that the image is another though the scene is the same.
    ///
    /// # Errors
    /// When memory runs out.
    pub(crate) fn update(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        changed: &Changed,
        passes: &ScenePasses,
    ) -> Result<bool> {
        self.frame += 1;
        self.statistics.forget_frame();
        let mut dirty = Dirty::default();
        self.follow(tables, changed, &mut dirty);
        self.blases.decayed.extend(self.surfaces.read());
        let adopted = self.step_later()?;
        let jobs = self.plan(tables, changed, &adopted)?;
        dirty.bounds = !jobs.is_empty();
        dirty.addresses = !adopted.swapped.is_empty();
        self.build(recorder, tables, jobs, &mut dirty)?;
        self.surfaces.record(recorder, tables, &self.blases, &passes.blas_surface)?;
        if !adopted.appeared.is_empty() {
            // An instance that waited for its BLAS becomes active: its record names a structure now.
            dirty.slots = (0..tables.instances.slot_count()).collect();
        }
        let emptied = self.tlas.built_count() != tables.instances.slot_count();
        if !dirty.is_empty() || !self.tlas.exists() || emptied {
            let (policy, scratch, groups) = (&self.policy, &mut self.scratch, self.groups);
            let pass = &passes.instance_descriptors;
            self.statistics.tlas =
                self.tlas.update(recorder, tables, &mut self.blases, dirty, policy, pass, scratch, groups)?;
        }
        self.prepare_later(recorder, tables)?;
        self.note(tables, &adopted);
        Ok(adopted.appeared.iter().any(|number| self.is_met(tables, *number)))
    }

    /// Whether a ray can meet an instance of it.
    fn is_met(&self, tables: &Tables, number: u32) -> bool {
        self.blases.get(number).is_some_and(|blas| match blas.key.deforming {
            Some(id) => tables.instances.is_met(id),
            None => tables.instances.meets_mesh(blas.key.mesh),
        })
    }

    /// Submits what the last frame prepared and takes into use what the background has finished.
    fn step_later(&mut self) -> Result<Adopted> {
        let stepped = self.later.step(&mut self.blases, &self.policy);
        self.spare_memory(stepped)
    }

    fn prepare_later(&mut self, recorder: &mut Recorder, tables: &Tables) -> Result<()> {
        if self.frame < self.try_again_at {
            return Ok(());
        }
        let prepared = self.later.prepare(recorder, tables, &self.blases, &self.policy, self.frame);
        self.spare_memory(prepared)
    }

    /// Background work may fail for want of memory: the scene stays as it is, and it is tried again after a while.
    fn spare_memory<T: Default>(&mut self, result: Result<T>) -> Result<T> {
        match result {
            Err(error) if error.is_out_of_memory() => {
                tracing::warn!("acceleration structures stay as they are: {error}");
                self.try_again_at = self.frame + TRY_AGAIN_FRAMES;
                Ok(T::default())
            }
            other => other,
        }
    }

    /// Gives every slot that changed the BLAS that it needs now.
    fn follow(&mut self, tables: &Tables, changed: &Changed, dirty: &mut Dirty) {
        let count = tables.instances.slot_count();
        if changed.all {
            dirty.slots = (0..count.max(self.blases.slot_count())).collect();
        } else {
            dirty.slots = changed.slots.iter().copied().collect();
        }
        dirty.reused = if changed.all { count } else { changed.reused.len() as u32 };
        let mut swapped = false;
        for slot in &dirty.slots {
            let key = tables.instances.get(*slot).map(|entry| BlasKey::of(entry, tables));
            swapped |= self.blases.assign(*slot, key);
        }
        self.blases.tidy();
        if swapped {
            self.surfaces.tidy();
        }
        dirty.slots.retain(|slot| *slot < count);
        for mesh in &changed.meshes {
            for number in self.blases.of_mesh(*mesh) {
                self.blases.forget_structure(number);
                self.blases.mark_changed(number, self.frame);
            }
        }
        if !changed.all {
            // A slot may be named twice: an instance that was changed and moved.
            let moved = changed.moved.iter().copied().filter(|slot| !changed.slots.contains(slot));
            dirty.slots.extend(moved);
        }
    }

    /// What is to be built or refitted in this frame.
    fn plan(&mut self, tables: &Tables, changed: &Changed, adopted: &Adopted) -> Result<Vec<Job>> {
        let mut jobs = Vec::new();
        for mesh in &changed.reshaped {
            for number in self.blases.of_mesh(*mesh) {
                self.blases.mark_changed(number, self.frame);
                jobs.extend(self.change(tables, number)?);
            }
        }
        for id in &changed.deformed {
            let Some(entry) = tables.instances.slot_of(*id).and_then(|slot| tables.instances.get(slot))
            else {
                continue;
            };
            let Some(number) = self.blases.of_deforming(entry.instance.mesh, *id) else { continue };
            if jobs.iter().any(|job: &Job| job.number == number) {
                continue;
            }
            self.blases.mark_changed(number, self.frame);
            jobs.extend(self.change(tables, number)?);
        }
        for number in &adopted.to_refit {
            if !jobs.iter().any(|job| job.number == *number) {
                jobs.extend(self.change(tables, *number)?);
            }
        }
        let missing: Vec<u32> = self.blases.unbuilt.iter().copied().collect();
        let mut triangles = 0;
        for number in missing {
            let Some(blas) = self.blases.get(number) else { continue };
            let deforms = blas.key.deforming.is_some();
            let edited = changed.reshaped.contains(&blas.key.mesh);
            let form = if deforms || edited { Form::Dynamic } else { Form::Static { compacted: false } };
            let own = tables.meshes.get(blas.key.mesh)?.element_count();
            if !(deforms || blas.succeeds || self.policy.fits_frame(triangles, own)) {
                self.blases.wait_for_background(number);
                continue;
            }
            triangles += own;
            let key = (number, &blas.key);
            jobs.push(job_of(&self.device, tables, key, (form, BuildMode::Build), None, None)?);
        }
        Ok(jobs)
    }

    /// The job for a BLAS whose geometry has moved; none when it is still to be built at all.
    fn change(&mut self, tables: &Tables, number: u32) -> Result<Option<Job>> {
        let Some(blas) = self.blases.get(number) else { return Ok(None) };
        let Some(built) = &blas.built else { return Ok(None) };
        let (form, mode, into) = match change_of(&self.policy, built.form == Form::Dynamic) {
            Change::MakeDynamic => (Form::Dynamic, BuildMode::Build, None),
            Change::Refit => (Form::Dynamic, BuildMode::Refit, Some(&built.structure)),
            Change::Rebuild => (Form::Dynamic, BuildMode::Build, Some(&built.structure)),
        };
        let job = job_of(&self.device, tables, (number, &blas.key), (form, mode), into, None)?;
        if mode == BuildMode::Refit && self.is_loose(tables, number) {
            self.blases.decayed.insert(number);
        }
        Ok(Some(job))
    }

    /// Whether refits have stretched the boxes of a BLAS too far.
    fn is_loose(&self, tables: &Tables, number: u32) -> bool {
        let Some((blas, built)) = self.blases.get(number).and_then(|blas| Some((blas, blas.built.as_ref()?)))
        else {
            return false;
        };
        stretch(&built.boxes, &boxes_of(tables, blas.key.mesh)) > SURFACE_LIMIT
    }

    fn build(
        &mut self,
        recorder: &mut Recorder,
        tables: &Tables,
        jobs: Vec<Job>,
        dirty: &mut Dirty,
    ) -> Result<()> {
        if jobs.is_empty() {
            return Ok(());
        }
        let (scratch, group) = (&mut self.scratch, self.groups.blas);
        recorder.pass("accel.blas", |recorder| build::record(recorder, tables, &jobs, scratch, group))?;
        for job in jobs {
            let Some(blas) = self.blases.get(job.number) else { continue };
            let refit = job.mode == BuildMode::Refit;
            if self.policy.refit && blas.key.deforming.is_some() {
                self.surfaces.note(job.number, &job.structure, refit);
            }
            if refit {
                self.statistics.blas_refit += 1;
                continue;
            }
            self.statistics.blas_built += 1;
            // A structure of its own: descriptors name another address, and what was inactive may be active.
            let in_place =
                blas.built.as_ref().is_some_and(|built| Arc::ptr_eq(&built.structure, &job.structure));
            dirty.addresses |= !in_place && blas.built.is_some();
            let boxes = boxes_of(tables, blas.key.mesh);
            self.blases.adopt(job.number, Built { structure: job.structure, form: job.form, boxes });
        }
        Ok(())
    }

    fn note(&mut self, tables: &Tables, adopted: &Adopted) {
        let statistics = &mut self.statistics;
        statistics.blas_swapped = adopted.swapped.len() as u64;
        statistics.blas_compacted = adopted.compacted;
        statistics.blas_pending = self.blases.waiting.len() as u64;
        statistics.blas_background = self.later.len() as u64;
        statistics.blas_count = self.blases.len() as u64;
        statistics.blas_bytes = self.blases.bytes();
        statistics.instance_count = tables.instances.len() as u64;
        statistics.triangle_count = tables.meshes.triangle_count();
        statistics.add_up();
    }

    /// Whether work is left to later frames.
    pub(crate) fn is_busy(&self) -> bool {
        self.later.is_busy() || !self.blases.waiting.is_empty() || !self.blases.decayed.is_empty()
    }

    /// Puts the TLAS into the set of a frame that is free to record.
    pub(crate) fn update_set(&mut self, frame_slot: usize, set: &SceneSet) {
        self.tlas.update_set(frame_slot, set);
    }

    /// The uses of a pass that traces rays.
    pub(crate) fn uses(&self) -> [Use<'static>; 2] {
        [
            Use::Group(self.groups.tlas, Stage::RayTracing, Access::AccelTrace),
            Use::Group(self.groups.blas, Stage::RayTracing, Access::AccelTrace),
        ]
    }

    /// The use of a copy of the descriptors back to the host.
    pub(crate) fn download_uses(&self) -> [Use<'static>; 1] {
        [Use::Group(self.groups.descriptors, Stage::Transfer, Access::TransferRead)]
    }

    /// Records the copy of the descriptors back to the host.
    pub(crate) fn download_descriptors(&self, recorder: &mut Recorder) -> Result<Download> {
        match self.tlas.descriptors() {
            Some(buffer) => Download::of(recorder, buffer),
            None => Ok(Download::default()),
        }
    }

    /// Records the copy of the addresses that descriptors are made with back to the host.
    pub(crate) fn download_addresses(&self, recorder: &mut Recorder) -> Result<Download> {
        self.blases.download(recorder)
    }

    /// Number of the BLAS of a slot.
    pub(crate) fn number_of(&self, slot: u32) -> Option<u32> {
        self.blases.number_of(slot)
    }

    /// Where the descriptor of a slot stands.
    pub(crate) fn place_of(&self, slot: u32) -> u32 {
        self.tlas.place_of(slot)
    }

    /// Key of the BLAS at a device address, in words.
    pub(crate) fn key_at(&self, address: u64) -> Option<String> {
        let at =
            |blas: &blas::Blas| blas.built.as_ref().is_some_and(|built| built.structure.address() == address);
        self.blases.iter().find(|(_, blas)| at(blas)).map(|(_, blas)| format!("{:?}", blas.key))
    }

    /// Keys of all BLASes, in words.
    pub(crate) fn keys(&self) -> impl Iterator<Item = String> {
        self.blases.iter().map(|(_, blas)| format!("{:?}", blas.key))
    }

    pub(crate) fn statistics(&self) -> &AccelStatistics {
        &self.statistics
    }
}

/// Bounds of the primitives of a mesh where they stand now, mesh space.
fn boxes_of(tables: &Tables, mesh: MeshId) -> Vec<(Vec3, Vec3)> {
    let mesh = tables.meshes.get(mesh).ok();
    mesh.map_or_else(Vec::new, |mesh| {
        (0..mesh.geometry_count() as usize).map(|index| mesh.placed_bounds(index)).collect()
    })
}
