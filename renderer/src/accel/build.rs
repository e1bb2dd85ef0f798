//! Builds and refits inside a frame, batched under a scratch budget; those of a batch run side by side.

use std::sync::Arc;

use caustica_gpu::{
    AccelBuild, AccelStructure, Access, Buffer, BufferUse, BuildMode, BuildPreference, Device, Location,
    MemoryUse, Recorder, ResourceId, Stage, Use,
};

use super::blas::{BlasInput, BlasKey, Form};
use super::policy::SCRATCH_BUDGET;
use crate::error::Result;
use crate::tables::{Snapshot, Tables};

/// Scratch memory for builds, kept between frames.
pub(crate) struct Scratch {
    device: Arc<Device>,
    buffer: Option<Buffer>,
    group: ResourceId,
}

impl Scratch {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self { device: Arc::clone(device), buffer: None, group: device.new_resource_id() }
    }

    /// An aligned address with `size` bytes behind it.
    pub(crate) fn reserve(&mut self, size: u64) -> Result<u64> {
        let alignment = self.device.limits().scratch_alignment.max(1);
        let needed = size + alignment;
        let buffer = match &mut self.buffer {
            Some(buffer) if buffer.size() >= needed => buffer,
            slot => {
                let (usage, kind) = (BufferUse::General, MemoryUse::AccelerationStructures);
                slot.insert(Buffer::new(&self.device, "scratch", needed, usage, Location::Device, kind)?)
            }
        };
        Ok(buffer.address().next_multiple_of(alignment))
    }

    /// The use of the scratch memory by a batch of builds: one batch after the other.
    pub(crate) fn used(&self) -> Use<'static> {
        Use::Group(self.group, Stage::AccelBuild, Access::AccelWrite)
    }
}

/// A build or refit with everything that it takes.
pub(crate) struct Job {
    pub(crate) number: u32,
    pub(crate) structure: Arc<AccelStructure>,
    pub(crate) form: Form,
    pub(crate) mode: BuildMode,
    input: BlasInput,
    /// Bytes of scratch.
    scratch: u64,
}

/// A build into a structure of its own (`into`: `None`), or a build or refit in place.
pub(crate) fn job_of(
    device: &Arc<Device>,
    tables: &Tables,
    (number, key): (u32, &BlasKey),
    (form, mode): (Form, BuildMode),
    into: Option<&Arc<AccelStructure>>,
    snapshot: Option<&Snapshot>,
) -> Result<Job> {
    let input = key.geometries(tables, snapshot)?;
    let sizes = device.build_sizes(input.geometry(), preference(form));
    let structure = match into {
        Some(structure) => Arc::clone(structure),
        None => {
            let name = format!("{} blas", tables.meshes.get(key.mesh)?.host.name);
            Arc::new(AccelStructure::new(device, &name, sizes.structure, false)?)
        }
    };
    let scratch = if mode == BuildMode::Refit { sizes.refit_scratch } else { sizes.build_scratch };
    let alignment = device.limits().scratch_alignment.max(1);
    Ok(Job { number, structure, form, mode, input, scratch: scratch.next_multiple_of(alignment) })
}

impl Job {
    /// Number of triangles or boxes.
    pub(crate) fn element_count(&self) -> u64 {
        self.input.element_count()
    }

    /// Bytes of scratch, a multiple of their alignment.
    pub(crate) fn scratch(&self) -> u64 {
        self.scratch
    }

    fn build(&self, scratch: u64) -> AccelBuild<'_> {
        AccelBuild {
            target: &self.structure,
            geometry: self.input.geometry(),
            preference: preference(self.form),
            mode: self.mode,
            scratch,
        }
    }
}

fn preference(form: Form) -> BuildPreference {
    match form {
        Form::Static { .. } => BuildPreference::FastTrace,
        Form::Dynamic => BuildPreference::FastBuild,
    }
}

/// Scratch that the largest batch of `jobs` takes.
fn scratch_of(jobs: &[Job]) -> u64 {
    let largest = jobs.iter().map(|job| job.scratch).max().unwrap_or(0);
    let total: u64 = jobs.iter().map(|job| job.scratch).sum();
    total.min(SCRATCH_BUDGET.max(largest))
}

/// The longest run of jobs that fits into `budget` bytes of scratch, at least one.
pub(crate) fn batch(jobs: &[Job], base: u64, budget: u64) -> Vec<AccelBuild<'_>> {
    let mut used = 0;
    let mut builds = Vec::new();
    for job in jobs {
        if !builds.is_empty() && used + job.scratch > budget {
            break;
        }
        builds.push(job.build(base + used));
        used += job.scratch;
    }
    builds
}

/// Records jobs in batches. `group`: stands for all BLASes in the barrier tracker.
pub(crate) fn record(
    recorder: &mut Recorder,
    tables: &Tables,
    jobs: &[Job],
    scratch: &mut Scratch,
    group: ResourceId,
) -> Result<()> {
    let budget = scratch_of(jobs);
    let base = scratch.reserve(budget)?;
    let mut rest = jobs;
    while !rest.is_empty() {
        let builds = batch(rest, base, budget);
        let written = Use::Group(group, Stage::AccelBuild, Access::AccelWrite);
        recorder.build(&builds, &[tables.build_input(), scratch.used(), written]);
        rest = &rest[builds.len()..];
    }
    Ok(())
}
