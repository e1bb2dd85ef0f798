//! A growing array of plain structs with its copy on the device. Entries that changed are uploaded in runs.

use std::collections::BTreeSet;
use std::sync::Arc;

use bytemuck::Pod;
use caustica_gpu::{Buffer, BufferUse, Device, Location, MemoryUse, Recorder};

use crate::error::Result;

/// Runs of dirty entries with a gap of at most this many clean ones are uploaded as one.
const GAP: usize = 4;

/// An array on the host and on the device.
pub(crate) struct Table<T> {
    device: Arc<Device>,
    name: &'static str,
    host: Vec<T>,
    dirty: BTreeSet<usize>,
    buffer: Option<Buffer>,
}

impl<T: Pod> Table<T> {
    pub(crate) fn new(device: &Arc<Device>, name: &'static str) -> Self {
        Self { device: Arc::clone(device), name, host: Vec::new(), dirty: BTreeSet::new(), buffer: None }
    }

    /// Sets an entry; the table grows with zeroed entries up to it.
    pub(crate) fn set(&mut self, index: usize, value: T) {
        if index >= self.host.len() {
            self.dirty.extend(self.host.len()..=index);
            self.host.resize(index + 1, T::zeroed());
        }
        self.host[index] = value;
        self.dirty.insert(index);
    }

    /// Replaces everything.
    pub(crate) fn replace(&mut self, values: Vec<T>) {
        self.dirty = (0..values.len()).collect();
        self.host = values;
    }

    /// Forgets every entry; the memory on the device stays.
    pub(crate) fn clear(&mut self) {
        self.host.clear();
        self.dirty.clear();
    }

    pub(crate) fn get(&self, index: usize) -> Option<&T> {
        self.host.get(index)
    }

    pub(crate) fn len(&self) -> usize {
        self.host.len()
    }

    pub(crate) fn is_dirty(&self) -> bool {
        !self.dirty.is_empty()
    }

    /// Device address; 0 before the first upload.
    pub(crate) fn address(&self) -> u64 {
        self.buffer.as_ref().map_or(0, Buffer::address)
    }

    /// Records the copy of what the device holds back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<Download> {
        let bytes = (self.host.len() * size_of::<T>()) as u64;
        match &self.buffer {
            Some(buffer) if bytes > 0 => Download::new(recorder, buffer, bytes),
            _ => Ok(Download { host: None, bytes: 0 }),
        }
    }

    /// Uploads what changed since the last call.
    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        if self.dirty.is_empty() {
            return Ok(());
        }
        let entry = size_of::<T>() as u64;
        let needed = self.host.len() as u64 * entry;
        let buffer = match &mut self.buffer {
            Some(buffer) if buffer.size() >= needed => buffer,
            slot => {
                let size = needed.next_power_of_two();
                let (usage, kind) = (BufferUse::General, MemoryUse::Tables);
                self.dirty = (0..self.host.len()).collect();
                slot.insert(Buffer::new(&self.device, self.name, size, usage, Location::Device, kind)?)
            }
        };
        for (start, end) in runs(&self.dirty) {
            recorder.upload(buffer, start as u64 * entry, bytemuck::cast_slice(&self.host[start..end]))?;
        }
        self.dirty.clear();
        Ok(())
    }
}

/// A copy of a table on its way back to the host.
#[derive(Default)]
pub(crate) struct Download {
    host: Option<Buffer>,
    bytes: usize,
}

impl Download {
    /// Records the copy of a whole buffer.
    pub(crate) fn of(recorder: &mut Recorder, buffer: &Buffer) -> Result<Self> {
        Self::new(recorder, buffer, buffer.size())
    }

    fn new(recorder: &mut Recorder, buffer: &Buffer, bytes: u64) -> Result<Self> {
        let kind = MemoryUse::Staging;
        let host =
            Buffer::new(recorder.device(), "download", bytes, BufferUse::General, Location::ReadBack, kind)?;
        recorder.copy_buffer(buffer, &host, bytes)?;
        Ok(Self { host: Some(host), bytes: bytes as usize })
    }

    /// The entries, once the copy has finished.
    pub(crate) fn read<T: Pod>(&self) -> Vec<T> {
        let bytes = self.host.as_ref().map_or(&[][..], |host| &host.mapped()[..self.bytes]);
        bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
    }
}

/// Half-open runs that cover a sorted set.
fn runs(indices: &BTreeSet<usize>) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &index in indices {
        match runs.last_mut() {
            Some((_, end)) if index <= *end + GAP => *end = index + 1,
            _ => runs.push((index, index + 1)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_join_neighbours_and_keep_the_far_apart() {
        let set: BTreeSet<usize> = [0, 1, 2, 5, 20, 21].into();
        assert_eq!(runs(&set), [(0, 6), (20, 22)]);
        assert!(runs(&BTreeSet::new()).is_empty());
    }
}
