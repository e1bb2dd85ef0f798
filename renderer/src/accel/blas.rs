//! Bottom-level structures. Builds are batched under a scratch budget; builds of a batch run side by side.

use std::sync::Arc;

use caustica_gpu::{
    AccelBuild, AccelGeometry, AccelStructure, Access, Buffer, BufferUse, BuildMode, BuildPreference, Device,
    Location, MemoryUse, Recorder, ResourceId, Stage, TriangleGeometry, Use,
};

use crate::delta::MeshId;
use crate::error::Result;
use crate::tables::{Materials, Slot, Tables};

/// Scratch memory that the builds of one batch may share, bytes.
const SCRATCH_BUDGET: u64 = 64 << 20;

/// What a BLAS is made for.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BlasKey {
    pub(crate) mesh: MeshId,
    /// For each geometry: any-hit is never called.
    pub(crate) opaque: Vec<bool>,
}

impl BlasKey {
    pub(crate) fn of(slot: &Slot, materials: &Materials) -> Self {
        let opaque = slot
            .instance
            .materials
            .iter()
            .map(|id| materials.get(*id).is_none_or(crate::tables::is_opaque))
            .collect();
        Self { mesh: slot.instance.mesh, opaque }
    }
}

/// A built BLAS.
pub(crate) struct Blas {
    structure: AccelStructure,
}

impl Blas {
    pub(crate) fn address(&self) -> u64 {
        self.structure.address()
    }

    pub(crate) fn size(&self) -> u64 {
        self.structure.size()
    }
}

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

/// A build that waits for its turn.
struct Job {
    key: BlasKey,
    geometries: Vec<TriangleGeometry>,
    structure: AccelStructure,
    scratch: u64,
}

/// Builds the structures of `keys`.
pub(crate) fn build_all(
    device: &Arc<Device>,
    recorder: &mut Recorder,
    tables: &Tables,
    keys: &[BlasKey],
    scratch: &mut Scratch,
    group: ResourceId,
) -> Result<Vec<(BlasKey, Blas)>> {
    let alignment = device.limits().scratch_alignment.max(1);
    let mut jobs = Vec::with_capacity(keys.len());
    for key in keys {
        let mesh = tables.meshes.get(key.mesh)?;
        let geometries: Vec<_> =
            key.opaque.iter().enumerate().map(|(index, opaque)| mesh.triangles(index, *opaque)).collect();
        let sizes = device.build_sizes(AccelGeometry::Triangles(&geometries), BuildPreference::FastTrace);
        let structure =
            AccelStructure::new(device, &format!("{} blas", mesh.host.name), sizes.structure, false)?;
        jobs.push(Job {
            key: key.clone(),
            geometries,
            structure,
            scratch: sizes.build_scratch.next_multiple_of(alignment),
        });
    }
    let largest = jobs.iter().map(|job| job.scratch).max().unwrap_or(0);
    let total: u64 = jobs.iter().map(|job| job.scratch).sum();
    let base = scratch.reserve(total.min(SCRATCH_BUDGET.max(largest)))?;
    let mut rest = jobs.as_slice();
    while !rest.is_empty() {
        let mut used = 0;
        let mut builds = Vec::new();
        for job in rest {
            if !builds.is_empty() && used + job.scratch > SCRATCH_BUDGET.max(largest) {
                break;
            }
            builds.push(AccelBuild {
                target: &job.structure,
                geometry: AccelGeometry::Triangles(&job.geometries),
                preference: BuildPreference::FastTrace,
                mode: BuildMode::Build,
                scratch: base + used,
            });
            used += job.scratch;
        }
        let written = Use::Group(group, Stage::AccelBuild, Access::AccelWrite);
        recorder.build(&builds, &[tables.build_input(), scratch.used(), written]);
        rest = &rest[builds.len()..];
    }
    Ok(jobs.into_iter().map(|job| (job.key, Blas { structure: job.structure })).collect())
}
