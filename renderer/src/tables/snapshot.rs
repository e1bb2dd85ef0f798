//! A copy of what frames may write while a build in the background reads it. Vertices of rigid meshes never change and are
//! only held; the geometry records, and the vertices of an instance that deforms, are copied.

use std::sync::Arc;

use caustica_gpu::{
    Access, Buffer, BufferUse, Location, MemoryUse, Recorder, ResourceId, Stage, TriangleGeometry, Use,
};

use super::meshes::Vertices;
use crate::error::Result;

/// Input of a build that later frames leave alone.
pub(crate) struct Snapshot {
    _vertices: Arc<Vertices>,
    records: Copied,
    positions: Option<Copied>,
}

/// A buffer and the address of what it is a copy of.
struct Copied {
    copy: Buffer,
    original: u64,
}

impl Snapshot {
    /// Records the copies. `group`: stands for the geometry in the barrier tracker.
    pub(crate) fn new(
        recorder: &mut Recorder,
        vertices: &Arc<Vertices>,
        records: &Buffer,
        positions: Option<&Buffer>,
        group: ResourceId,
    ) -> Result<Self> {
        recorder.declare(&[Use::Group(group, Stage::Transfer, Access::TransferRead)]);
        Ok(Self {
            _vertices: Arc::clone(vertices),
            records: copy(recorder, records)?,
            positions: positions.map(|buffer| copy(recorder, buffer)).transpose()?,
        })
    }

    /// Makes a geometry read the copies.
    pub(crate) fn redirect(&self, geometry: &mut TriangleGeometry) {
        geometry.transform = self.records.copy.address() + (geometry.transform - self.records.original);
        if let Some(positions) = &self.positions {
            geometry.positions = positions.copy.address() + (geometry.positions - positions.original);
        }
    }
}

fn copy(recorder: &mut Recorder, original: &Buffer) -> Result<Copied> {
    let (usage, location) = (BufferUse::Geometry, Location::Device);
    let kind = MemoryUse::AccelerationStructures;
    let copy = Buffer::new(recorder.device(), "snapshot", original.size(), usage, location, kind)?;
    recorder.copy_buffer(original, &copy, original.size())?;
    Ok(Copied { copy, original: original.address() })
}
