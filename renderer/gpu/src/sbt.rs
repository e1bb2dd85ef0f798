//! The shader binding table of a ray-tracing pipeline: one ray generation record, misses, hit groups.

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::buffer::{Buffer, BufferUse, Location};
use crate::context::Device;
use crate::error::Context;
use crate::memory::MemoryUse;

/// Group handles laid out as the device wants them.
pub(crate) struct BindingTable {
    _buffer: Buffer,
    pub(crate) ray_generation: vk::StridedDeviceAddressRegionKHR,
    pub(crate) miss: vk::StridedDeviceAddressRegionKHR,
    pub(crate) hit: vk::StridedDeviceAddressRegionKHR,
}

impl BindingTable {
    /// Reads the handles of a pipeline whose groups are: ray generation, `misses`, `hits`.
    pub(crate) fn new(
        device: &Arc<Device>,
        name: &str,
        pipeline: vk::Pipeline,
        misses: u32,
        hits: u32,
    ) -> Result<Self> {
        let limits = device.limits();
        let handle = limits.group_handle_size as usize;
        let stride = limits.group_handle_size.next_multiple_of(limits.group_handle_alignment);
        let base = u64::from(limits.group_base_alignment.max(1));
        let groups = 1 + misses + hits;
        // SAFETY: the pipeline is alive and has exactly `groups` groups.
        let handles = unsafe {
            device.rt_fns.get_ray_tracing_shader_group_handles(pipeline, 0, groups, groups as usize * handle)
        }
        .during("vkGetRayTracingShaderGroupHandlesKHR")?;
        let region = |count: u32| (u64::from(count) * u64::from(stride)).next_multiple_of(base);
        let starts = [0, region(1), region(1) + region(misses)];
        let size = region(1) + region(misses) + region(hits);
        // Room to move the start up to the base alignment, whatever alignment the memory has.
        let label = format!("{name} binding table");
        let mut buffer = Buffer::new(
            device,
            &label,
            size + base,
            BufferUse::BindingTable,
            Location::Upload,
            MemoryUse::Staging,
        )?;
        let start = buffer.address().next_multiple_of(base);
        let shift = (start - buffer.address()) as usize;
        let mut groups = handles.chunks_exact(handle);
        for (offset, count) in starts.into_iter().zip([1, misses, hits]) {
            for i in 0..count {
                let at = shift + offset as usize + (i * stride) as usize;
                if let (Some(source), Some(target)) =
                    (groups.next(), buffer.mapped_mut().get_mut(at..at + handle))
                {
                    target.copy_from_slice(source);
                }
            }
        }
        let at = |offset: u64, count: u32, stride: u64| vk::StridedDeviceAddressRegionKHR {
            device_address: if count == 0 { 0 } else { start + offset },
            stride,
            size: u64::from(count) * stride,
        };
        let stride = u64::from(stride);
        // The size of the ray generation region must equal its stride.
        let first = region(1).max(stride);
        Ok(Self {
            ray_generation: vk::StridedDeviceAddressRegionKHR {
                device_address: start,
                stride: first,
                size: first,
            },
            miss: at(starts[1], misses, stride),
            hit: at(starts[2], hits, stride),
            _buffer: buffer,
        })
    }
}
