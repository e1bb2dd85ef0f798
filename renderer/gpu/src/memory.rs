//! Device memory: the allocator, the ledger of what is in use for what, and the budget.
//! Running out is an error in words, never a crash.

use std::collections::BTreeMap;
use std::sync::Mutex;

use ash::vk;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings, MemoryLocation};

use crate::Result;
use crate::context::Device;
use crate::error::GpuError;
use crate::instance::Instance;

/// What memory is used for; the columns of the statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MemoryUse {
    /// Vertices and indices.
    Geometry,
    /// Acceleration structures and their scratch.
    AccelerationStructures,
    /// Textures and the environment.
    Textures,
    /// Scene tables.
    Tables,
    /// Render targets and accumulators.
    Targets,
    /// Staging, read-back and other host-visible memory.
    Staging,
}

impl MemoryUse {
    /// Name in `--json` and in the panel.
    pub fn name(self) -> &'static str {
        match self {
            Self::Geometry => "geometry",
            Self::AccelerationStructures => "acceleration_structures",
            Self::Textures => "textures",
            Self::Tables => "tables",
            Self::Targets => "targets",
            Self::Staging => "staging",
        }
    }
}

/// How full the device is.
#[derive(Clone, Copy, Debug)]
pub struct MemoryBudget {
    /// Bytes that this process may use, by VK_EXT_memory_budget, else the heap's size.
    pub budget_bytes: u64,
    /// Bytes that this program has taken. (What the driver says counts other programs too where the device is the processor.)
    pub used_bytes: u64,
    /// The budget is a limit that was given at creation.
    pub is_limit: bool,
}

/// Bytes in use by kind.
#[derive(Default)]
pub(crate) struct Ledger {
    bytes: Mutex<BTreeMap<MemoryUse, u64>>,
    limit_bytes: Option<u64>,
}

impl Ledger {
    pub(crate) fn new(limit_bytes: Option<u64>) -> Self {
        Self { bytes: Mutex::default(), limit_bytes }
    }

    fn total(&self) -> u64 {
        self.bytes.lock().map(|bytes| bytes.values().sum()).unwrap_or(0)
    }
}

pub(crate) fn create_allocator(
    instance: &Instance,
    device: &ash::Device,
    physical_device: vk::PhysicalDevice,
) -> Result<Allocator> {
    Allocator::new(&AllocatorCreateDesc {
        instance: instance.raw.clone(),
        device: device.clone(),
        physical_device,
        debug_settings: AllocatorDebugSettings::default(),
        buffer_device_address: true,
        allocation_sizes: AllocationSizes::default(),
    })
    .map_err(|error| allocation_error(&error))
}

fn allocation_error(error: &gpu_allocator::AllocationError) -> GpuError {
    tracing::debug!("allocator: {error}");
    GpuError::Vulkan { call: "allocating device memory", result: vk::Result::ERROR_OUT_OF_DEVICE_MEMORY }
}

/// An allocation and the column of the ledger it is booked under.
pub(crate) struct Memory {
    pub(crate) allocation: Allocation,
    kind: MemoryUse,
}

impl Device {
    /// Allocates memory for a buffer or an image.
    pub(crate) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
        kind: MemoryUse,
    ) -> Result<Memory> {
        let size = requirements.size;
        let out_of_memory = || {
            let budget = self.memory_budget();
            const MIB: f64 = 1024.0 * 1024.0;
            GpuError::OutOfMemory {
                what: name.to_owned(),
                requested_mib: size as f64 / MIB,
                used_mib: budget.used_bytes as f64 / MIB,
                budget_mib: budget.budget_bytes as f64 / MIB,
            }
        };
        if self.memory.limit_bytes.is_some_and(|limit| self.memory.total().saturating_add(size) > limit) {
            return Err(out_of_memory());
        }
        let Ok(mut allocator) = self.allocator.lock() else {
            return Err(out_of_memory());
        };
        let allocation = allocator
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|error| {
                tracing::debug!("allocator: {error}");
                out_of_memory()
            })?;
        drop(allocator);
        if let Ok(mut bytes) = self.memory.bytes.lock() {
            *bytes.entry(kind).or_insert(0) += allocation.size();
        }
        Ok(Memory { allocation, kind })
    }

    /// Gives memory back. The caller has made sure that the device no longer uses it.
    pub(crate) fn free(&self, memory: Memory) {
        if let Ok(mut bytes) = self.memory.bytes.lock() {
            let entry = bytes.entry(memory.kind).or_insert(0);
            *entry = entry.saturating_sub(memory.allocation.size());
        }
        if let Ok(mut allocator) = self.allocator.lock()
            && let Err(error) = allocator.free(memory.allocation)
        {
            tracing::error!("freeing device memory failed: {error}");
        }
    }

    /// Bytes in use by kind, as allocated by this package.
    pub fn memory_by_use(&self) -> Vec<(MemoryUse, u64)> {
        self.memory
            .bytes
            .lock()
            .map(|bytes| bytes.iter().map(|(kind, n)| (*kind, *n)).collect())
            .unwrap_or_default()
    }

    /// Budget and use of the device-local heaps, or of the limit given at creation.
    pub fn memory_budget(&self) -> MemoryBudget {
        if let Some(limit) = self.memory.limit_bytes {
            return MemoryBudget { budget_bytes: limit, used_bytes: self.memory.total(), is_limit: true };
        }
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceMemoryProperties2::default();
        if self.has_memory_budget() {
            properties = properties.push_next(&mut budget);
        }
        // SAFETY: the budget structure is chained only where its extension is there.
        unsafe {
            self.instance().raw.get_physical_device_memory_properties2(self.physical(), &mut properties);
        }
        let heaps = properties.memory_properties;
        let local = (0..heaps.memory_heap_count as usize)
            .filter(|&i| heaps.memory_heaps[i].flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
        let known = self.has_memory_budget();
        let bytes =
            |heap: usize| if known { budget.heap_budget[heap] } else { heaps.memory_heaps[heap].size };
        MemoryBudget {
            budget_bytes: local.map(bytes).sum(),
            used_bytes: self.memory.total(),
            is_limit: false,
        }
    }
}
