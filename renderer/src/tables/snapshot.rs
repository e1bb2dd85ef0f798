//! A copy of what frames may write while a build in the background reads it. Vertices of rigid meshes never change and are
//! only held; the geometry records, the vertices of an instance that deforms, and the boxes around shapes are copied.

use std::sync::Arc;

use caustica_gpu::{
    Access, BoxGeometry, Buffer, BufferUse, Location, MemoryUse, Recorder, ResourceId, Stage,
    TriangleGeometry, Use,
};

use super::meshes::Vertices;
use super::shapes::ShapeBuffers;
use crate::error::Result;

/// Input of a build that later frames leave alone.
pub(crate) enum Snapshot {
    /// Of a mesh of triangles, or of an instance of it that deforms.
    Triangles { _vertices: Arc<Vertices>, records: Copied, positions: Option<Copied> },
    /// Of a mesh of shapes.
    Boxes(Copied),
}

/// A buffer and the address of what it is a copy of.
pub(crate) struct Copied {
    copy: Buffer,
    original: u64,
}

impl Copied {
    fn redirect(&self, address: &mut u64) {
        *address = self.copy.address() + (*address - self.original);
    }
}

impl Snapshot {
    /// Records the copies. `group`: stands for the geometry in the barrier tracker.
    pub(crate) fn of_triangles(
        recorder: &mut Recorder,
        vertices: &Arc<Vertices>,
        records: &Buffer,
        positions: Option<&Buffer>,
        group: ResourceId,
    ) -> Result<Self> {
        recorder.declare(&[Use::Group(group, Stage::Transfer, Access::TransferRead)]);
        Ok(Self::Triangles {
            _vertices: Arc::clone(vertices),
            records: copy(recorder, records)?,
            positions: positions.map(|buffer| copy(recorder, buffer)).transpose()?,
        })
    }

    /// Records the copy of the boxes around shapes. `group`: stands for the geometry in the barrier tracker.
    pub(crate) fn of_shapes(
        recorder: &mut Recorder,
        shapes: &ShapeBuffers,
        group: ResourceId,
    ) -> Result<Self> {
        recorder.declare(&[Use::Group(group, Stage::Transfer, Access::TransferRead)]);
        Ok(Self::Boxes(copy(recorder, &shapes.boxes)?))
    }

    /// Makes a geometry read the copies.
    pub(crate) fn redirect_triangles(&self, geometry: &mut TriangleGeometry) {
        let Self::Triangles { records, positions, .. } = self else { return };
        records.redirect(&mut geometry.transform);
        if let Some(positions) = positions {
            positions.redirect(&mut geometry.positions);
        }
    }

    /// Makes a geometry read the copies.
    pub(crate) fn redirect_boxes(&self, geometry: &mut BoxGeometry) {
        if let Self::Boxes(boxes) = self {
            boxes.redirect(&mut geometry.boxes);
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
