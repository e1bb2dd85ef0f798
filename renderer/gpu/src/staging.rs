//! Host memory for uploads: one growing chunk a frame in flight, reused when its frame has finished.
//! In a steady state nothing is allocated.

use std::sync::Arc;

use crate::Result;
use crate::buffer::{Buffer, BufferUse, Location};
use crate::context::Device;
use crate::memory::MemoryUse;

/// First size of a chunk, bytes.
const FIRST_CHUNK: u64 = 1 << 20;
/// Chunks above this size are given back after their frame, bytes.
const KEPT_CHUNK: u64 = 32 << 20;

/// Staging memory of one frame in flight.
pub(crate) struct Staging {
    device: Arc<Device>,
    chunks: Vec<Buffer>,
    used: u64,
    /// Bytes staged since the last reset.
    pub(crate) total: u64,
}

/// Bytes that were staged: chunk and offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Staged {
    pub(crate) buffer: ash::vk::Buffer,
    pub(crate) address: u64,
    pub(crate) offset: u64,
}

impl Staging {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self { device: Arc::clone(device), chunks: Vec::new(), used: 0, total: 0 }
    }

    /// Forgets what the finished frame staged; keeps the largest chunk of reasonable size.
    pub(crate) fn reset(&mut self) {
        self.chunks.retain(|chunk| chunk.size() <= KEPT_CHUNK);
        self.chunks.sort_by_key(Buffer::size);
        if let Some(largest) = self.chunks.pop() {
            self.chunks.clear();
            self.chunks.push(largest);
        }
        self.used = 0;
        self.total = 0;
    }

    /// Copies bytes into staging memory, 16-byte aligned.
    pub(crate) fn stage(&mut self, bytes: &[u8]) -> Result<Staged> {
        let len = bytes.len() as u64;
        let start = self.used.next_multiple_of(16);
        let fits = self.chunks.last().is_some_and(|chunk| start + len <= chunk.size());
        let start = if fits {
            start
        } else {
            let last = self.chunks.last().map_or(FIRST_CHUNK, |chunk| (chunk.size() * 2).min(KEPT_CHUNK));
            let chunk = |size| {
                let (usage, kind) = (BufferUse::General, MemoryUse::Staging);
                Buffer::new(&self.device, "staging", size, usage, Location::Upload, kind)
            };
            // Where memory is short, no more than is needed.
            self.chunks.push(chunk(last.max(len)).or_else(|_| chunk(len))?);
            0
        };
        self.used = start + len;
        self.total += len;
        let Some(chunk) = self.chunks.last_mut() else {
            return Err(crate::GpuError::Limit { what: String::from("staging"), asked: len, limit: 0 });
        };
        let (buffer, address) = (chunk.raw, chunk.address() + start);
        if let Some(target) = chunk.mapped_mut().get_mut(start as usize..(start + len) as usize) {
            target.copy_from_slice(bytes);
        }
        Ok(Staged { buffer, address, offset: start })
    }
}
