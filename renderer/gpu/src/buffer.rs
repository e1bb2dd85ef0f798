//! Buffers. Every buffer has an address; what it holds is booked under one kind of memory.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use crate::Result;
use crate::barrier::ResourceId;
use crate::context::Device;
use crate::error::{Context, GpuError};
use crate::memory::{Memory, MemoryUse};
use crate::retire::Garbage;

/// Where a buffer's memory is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Location {
    /// On the device; filled by copies and shaders.
    Device,
    /// Written by the host, read by the device.
    Upload,
    /// Written by the device, read by the host.
    ReadBack,
}

/// What a buffer is for, beyond storage, address and copies, which all buffers allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUse {
    /// Tables, vertices, staging.
    General,
    /// Index buffer and input of acceleration structure builds.
    Geometry,
    /// Memory of acceleration structures.
    AccelStorage,
    /// Shader binding table.
    BindingTable,
}

/// A buffer with its memory.
pub struct Buffer {
    pub(crate) raw: vk::Buffer,
    memory: Option<Memory>,
    address: u64,
    size: u64,
    id: ResourceId,
    device: Arc<Device>,
}

impl Buffer {
    /// Makes a buffer of `size` bytes (at least 1).
    ///
    /// # Errors
    /// [`crate::GpuError::OutOfMemory`] and other refusals of the driver.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        usage: BufferUse,
        location: Location,
        kind: MemoryUse,
    ) -> Result<Self> {
        let size = size.max(4);
        let limit = device.limits().max_buffer_bytes;
        if size >= limit {
            return Err(GpuError::Limit { what: format!("buffer '{name}' in bytes"), asked: size, limit });
        }
        let families = device.shared_families();
        let mut info = vk::BufferCreateInfo::default().size(size).usage(usage_flags(usage));
        // The background builds from and copies between these while the frames trace and read them.
        if let (Some(families), true) = (&families, usage != BufferUse::BindingTable) {
            info = info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(families);
        }
        // SAFETY: plain creation; destroyed through the retire queue.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.during("vkCreateBuffer")?;
        // SAFETY: `raw` was just made.
        let mut requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        // Scratch starts at addresses that some devices want aligned; transforms of a BLAS build lie on 16 bytes.
        let alignment = if usage == BufferUse::Geometry { 16 } else { 256 };
        requirements.alignment = requirements.alignment.max(alignment);
        let memory_location = match location {
            Location::Device => MemoryLocation::GpuOnly,
            Location::Upload => MemoryLocation::CpuToGpu,
            Location::ReadBack => MemoryLocation::GpuToCpu,
        };
        let memory = match device.allocate(name, requirements, memory_location, true, kind) {
            Ok(memory) => memory,
            Err(error) => {
                // SAFETY: never used.
                unsafe { device.raw.destroy_buffer(raw, None) };
                return Err(error);
            }
        };
        // SAFETY: the allocation was made for this buffer's requirements and is not bound to anything else.
        let bound = unsafe {
            device.raw.bind_buffer_memory(raw, memory.allocation.memory(), memory.allocation.offset())
        };
        if let Err(error) = bound.during("vkBindBufferMemory") {
            // SAFETY: never used.
            unsafe { device.raw.destroy_buffer(raw, None) };
            device.free(memory);
            return Err(error);
        }
        // SAFETY: the buffer is bound and was made with SHADER_DEVICE_ADDRESS.
        let address = unsafe {
            device.raw.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(raw))
        };
        device.set_name(raw, name);
        let id = device.new_resource_id();
        Ok(Self { raw, memory: Some(memory), address, size, id, device: Arc::clone(device) })
    }

    /// Device address of the first byte.
    pub fn address(&self) -> u64 {
        self.address
    }

    /// Size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Its number in the barrier tracker.
    pub fn id(&self) -> ResourceId {
        self.id
    }

    /// The mapped bytes of an upload or read-back buffer; empty for one on the device.
    pub fn mapped(&self) -> &[u8] {
        self.memory
            .as_ref()
            .and_then(|memory| memory.allocation.mapped_slice())
            .map_or(&[], |slice| slice.get(..self.size as usize).unwrap_or(slice))
    }

    /// The mapped bytes for writing; empty for a buffer on the device.
    pub fn mapped_mut(&mut self) -> &mut [u8] {
        let size = self.size as usize;
        self.memory.as_mut().and_then(|memory| memory.allocation.mapped_slice_mut()).map_or(
            &mut [],
            |slice| {
                let len = size.min(slice.len());
                &mut slice[..len]
            },
        )
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let Some(memory) = self.memory.take() {
            self.device.retire(Garbage::Buffer(self.raw, memory, self.id));
        }
    }
}

fn usage_flags(usage: BufferUse) -> vk::BufferUsageFlags {
    use vk::BufferUsageFlags as F;
    let common = F::TRANSFER_SRC | F::TRANSFER_DST | F::SHADER_DEVICE_ADDRESS | F::STORAGE_BUFFER;
    match usage {
        BufferUse::General => common | F::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR,
        BufferUse::Geometry => common | F::INDEX_BUFFER | F::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR,
        BufferUse::AccelStorage => common | F::ACCELERATION_STRUCTURE_STORAGE_KHR,
        BufferUse::BindingTable => common | F::SHADER_BINDING_TABLE_KHR,
    }
}
