//! What is measured of a view's picture on the device. Enters: a reference, the wish to measure. Leaves: buffers for pass error, and what
//! it found, two frames later.

use std::sync::Arc;

use caustica_gpu::{Buffer, BufferUse, Device, Frames, Location, MemoryUse, Recorder};

use crate::error::Result;
use crate::gpu_types::{ERROR_BLOCK_SIDE, ErrorBlock, ReferencePixel};
use crate::measure::LiveError;
use crate::renderer::Accumulated;

/// Reference and results of one view.
#[derive(Default)]
pub(crate) struct Measuring {
    reference: Option<Reference>,
    /// Grows with every other reference.
    pub(crate) reference_revision: u64,
    /// The next sample is to be measured.
    pub(crate) wanted: bool,
    blocks: Option<Blocks>,
}

struct Reference {
    picture: Arc<Accumulated>,
    /// Made when a picture of its size is there for the first time.
    on_device: Option<Buffer>,
}

/// Sums of the blocks, and their copies for the host with what they belong to, one a frame in flight.
struct Blocks {
    extent: [u32; 2],
    device: Buffer,
    host: Vec<(Buffer, Option<Owner>)>,
}

/// The picture that sums belong to.
#[derive(Clone, Copy)]
struct Owner {
    samples: u64,
    resets: u64,
    has_reference: bool,
}

impl Measuring {
    pub(crate) fn set_reference(&mut self, picture: Option<Arc<Accumulated>>) {
        self.reference = picture.map(|picture| Reference { picture, on_device: None });
        self.reference_revision += 1;
    }

    pub(crate) fn has_reference(&self) -> bool {
        self.reference.is_some()
    }

    /// Brings what is needed for a picture of this size to the device.
    pub(crate) fn prepare(
        &mut self,
        device: &Arc<Device>,
        recorder: &mut Recorder,
        extent: [u32; 2],
    ) -> Result<()> {
        if let Some(reference) = self.reference.as_mut().filter(|known| known.picture.extent == extent)
            && reference.on_device.is_none()
        {
            let pixels: Vec<ReferencePixel> = reference
                .picture
                .mean
                .iter()
                .zip(&reference.picture.half_difference)
                .map(|(mean, half)| ReferencePixel { mean: *mean, half_difference: *half })
                .collect();
            let buffer = buffer(device, "reference", size_of_val(&pixels[..]), Location::Device)?;
            recorder.upload(&buffer, 0, bytemuck::cast_slice(&pixels))?;
            reference.on_device = Some(buffer);
        }
        if self.wanted && self.blocks.as_ref().is_none_or(|blocks| blocks.extent != extent) {
            let size = block_count(extent) * size_of::<ErrorBlock>();
            let host = (0..Frames::in_flight())
                .map(|_| Ok((buffer(device, "error sums", size, Location::ReadBack)?, None)))
                .collect::<Result<_>>()?;
            let device = buffer(device, "error sums", size, Location::Device)?;
            self.blocks = Some(Blocks { extent, device, host });
        }
        Ok(())
    }

    /// The reference for a picture of this size.
    pub(crate) fn reference(&self, extent: [u32; 2]) -> Option<&Buffer> {
        self.reference.as_ref().filter(|known| known.picture.extent == extent)?.on_device.as_ref()
    }

    /// Where the sums go.
    pub(crate) fn blocks(&self, extent: [u32; 2]) -> Option<&Buffer> {
        self.blocks
            .as_ref()
            .filter(|blocks| self.wanted && blocks.extent == extent)
            .map(|blocks| &blocks.device)
    }

    /// Copies the sums of this frame for the host.
    pub(crate) fn copy(&mut self, recorder: &mut Recorder, samples: u64, resets: u64) -> Result<()> {
        let Some(extent) = self.blocks.as_ref().map(|blocks| blocks.extent) else { return Ok(()) };
        let has_reference = self.reference(extent).is_some();
        if let Some(Blocks { device, host, .. }) = &mut self.blocks {
            let slot = recorder.slot() % host.len();
            recorder.copy_buffer(device, &host[slot].0, device.size())?;
            host[slot].1 = Some(Owner { samples, resets, has_reference });
        }
        self.wanted = false;
        Ok(())
    }

    /// What a finished frame of this slot has found, once.
    pub(crate) fn take(&mut self, slot: usize) -> Option<LiveError> {
        let blocks = self.blocks.as_mut()?;
        let slot = slot % blocks.host.len();
        let (buffer, owner) = &mut blocks.host[slot];
        let owner = owner.take()?;
        let sums: Vec<ErrorBlock> = bytemuck::cast_slice(buffer.mapped()).to_vec();
        Some(LiveError::of(&sums, blocks.extent, (owner.samples, owner.resets), owner.has_reference))
    }
}

fn block_count(extent: [u32; 2]) -> usize {
    extent.map(|side| side.div_ceil(ERROR_BLOCK_SIDE) as usize).iter().product()
}

fn buffer(device: &Arc<Device>, name: &str, bytes: usize, location: Location) -> Result<Buffer> {
    Ok(Buffer::new(device, name, bytes as u64, BufferUse::General, location, MemoryUse::Targets)?)
}
