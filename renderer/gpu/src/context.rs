//! The logical device: features, extension functions, limits, the queues and their timeline semaphores.
//! Enters: an instance and a chosen physical device. Leaves: the `Device` that every other object holds an Arc of.

use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::Allocator;

use crate::barrier::Tracker;
use crate::device_choice::{self, Candidate, DeviceKind, REQUIRED_EXTENSIONS, Requirements};
use crate::error::{Context, GpuError};
use crate::hang::Watched;
use crate::instance::Instance;
use crate::retire::{Reached, RetireQueue};
use crate::{Result, memory};

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// Which one.
    pub requirements: Requirements,
    /// Refuse allocations past this many bytes in total; `None`: only the driver's budget.
    pub memory_limit_bytes: Option<u64>,
}

/// What the device allows; never hard-coded elsewhere.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Alignment of the scratch buffer of an acceleration structure build, bytes.
    pub scratch_alignment: u64,
    /// Size of a shader group handle, bytes.
    pub group_handle_size: u32,
    /// Alignment of a handle inside a shader binding table, bytes.
    pub group_handle_alignment: u32,
    /// Alignment of the start of a shader binding table region, bytes.
    pub group_base_alignment: u32,
    /// Nanoseconds in one tick of a timestamp.
    pub timestamp_period_ns: f32,
    /// Largest side of a 2D image, texels.
    pub max_image_extent: u32,
    /// Largest anisotropy of a sampler.
    pub max_anisotropy: f32,
    /// Largest bindless texture array.
    pub max_textures: u32,
    /// Most instances in a TLAS.
    pub max_instances: u64,
    /// Most geometries in a BLAS.
    pub max_geometries: u64,
    /// Most primitives in a BLAS.
    pub max_primitives: u64,
    /// Most invocations of a workgroup.
    pub max_group_invocations: u32,
    /// Most invocations of a workgroup along each axis.
    pub max_group_size: [u32; 3],
    /// Most bytes that a workgroup shares.
    pub max_shared_bytes: u32,
    /// Bytes of push constants.
    pub max_push_constants: u32,
    /// A buffer of this many bytes is too large.
    pub max_buffer_bytes: u64,
    /// Bits of a timestamp that count.
    pub timestamp_mask: u64,
}

/// A device with one queue for graphics, compute and transfer, and one for the background where it has such a family.
pub struct Device {
    pub(crate) raw: ash::Device,
    pub(crate) accel_fns: khr::acceleration_structure::Device,
    pub(crate) rt_fns: khr::ray_tracing_pipeline::Device,
    pub(crate) push_fns: khr::push_descriptor::Device,
    pub(crate) swapchain_fns: Option<khr::swapchain::Device>,
    pub(crate) debug_utils: Option<ext::debug_utils::Device>,
    pub(crate) allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    pub(crate) memory: memory::Ledger,
    pub(crate) queue: Mutex<vk::Queue>,
    pub(crate) timeline: vk::Semaphore,
    pub(crate) submitted: AtomicU64,
    pub(crate) async_queue: Option<Mutex<vk::Queue>>,
    pub(crate) background: BackgroundTimeline,
    pub(crate) retired: RetireQueue,
    pub(crate) tracker: Mutex<Tracker>,
    pub(crate) watched: Watched,
    next_resource: AtomicU64,
    pipeline_cache: vk::PipelineCache,
    limits: Limits,
    candidate: Candidate,
    instance: Arc<Instance>,
}

/// The timeline of the background queue, and how far it is known to be.
pub(crate) struct BackgroundTimeline {
    pub(crate) semaphore: vk::Semaphore,
    pub(crate) submitted: AtomicU64,
    /// The newest value that the host has seen finished: what the frames may use, and wait for on the device.
    pub(crate) seen: AtomicU64,
}

impl Device {
    /// Opens the device that `options` names, or the best suitable one.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`] with the reason for each refusal; [`GpuError::Vulkan`] when the driver refuses.
    pub fn new(instance: &Arc<Instance>, options: &DeviceOptions) -> Result<Arc<Self>> {
        let candidate = device_choice::choose(instance, &options.requirements)?;
        let raw = create(instance, &candidate)?;
        // SAFETY: the queue family and index 0 were asked for at creation.
        let queue = unsafe { raw.get_device_queue(candidate.queue_family, 0) };
        // SAFETY: likewise; `create` asks for one queue of this family when the candidate has it.
        let async_queue = candidate.async_family.map(|family| unsafe { raw.get_device_queue(family, 0) });
        let timeline = create_timeline(&raw)?;
        let background = BackgroundTimeline {
            semaphore: create_timeline(&raw)?,
            submitted: AtomicU64::new(0),
            seen: AtomicU64::new(0),
        };
        // SAFETY: plain creation on a live device; destroyed in Drop.
        let pipeline_cache =
            unsafe { raw.create_pipeline_cache(&vk::PipelineCacheCreateInfo::default(), None) }
                .during("vkCreatePipelineCache")?;
        let allocator = memory::create_allocator(instance, &raw, candidate.physical)?;
        let fns = &instance.raw;
        Ok(Arc::new(Self {
            accel_fns: khr::acceleration_structure::Device::new(fns, &raw),
            rt_fns: khr::ray_tracing_pipeline::Device::new(fns, &raw),
            push_fns: khr::push_descriptor::Device::new(fns, &raw),
            swapchain_fns: candidate.swapchain.then(|| khr::swapchain::Device::new(fns, &raw)),
            debug_utils: instance.debug_utils.then(|| ext::debug_utils::Device::new(fns, &raw)),
            allocator: ManuallyDrop::new(Arc::new(Mutex::new(allocator))),
            memory: memory::Ledger::new(options.memory_limit_bytes),
            queue: Mutex::new(queue),
            timeline,
            submitted: AtomicU64::new(0),
            async_queue: async_queue.map(Mutex::new),
            background,
            retired: RetireQueue::default(),
            tracker: Mutex::new(Tracker::default()),
            watched: Watched::new(candidate.kind),
            next_resource: AtomicU64::new(1),
            pipeline_cache,
            limits: Limits { timestamp_mask: candidate.timestamp_mask, ..limits_of(fns, candidate.physical) },
            candidate,
            raw,
            instance: Arc::clone(instance),
        }))
    }

    /// Limits of the device.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Name of the device.
    pub fn name(&self) -> &str {
        &self.candidate.name
    }

    /// Name and version of the driver.
    pub fn driver(&self) -> &str {
        &self.candidate.driver
    }

    /// Kind of the device.
    pub fn kind(&self) -> DeviceKind {
        self.candidate.kind
    }

    /// The instance it belongs to.
    pub fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }

    /// Whether ray-tracing pipelines can be linked of groups that were compiled by themselves.
    /// Never on a processor: lavapipe 25.0 crashes in the linked shaders, and compiles at the first trace anyway.
    pub fn links_pipelines(&self) -> bool {
        self.candidate.pipeline_library && self.candidate.kind != DeviceKind::Cpu
    }

    /// Whether VK_EXT_memory_budget is there.
    pub(crate) fn has_memory_budget(&self) -> bool {
        self.candidate.memory_budget
    }

    pub(crate) fn physical(&self) -> vk::PhysicalDevice {
        self.candidate.physical
    }

    pub(crate) fn queue_family(&self) -> u32 {
        self.candidate.queue_family
    }

    /// Family of the queue that the background submits to.
    pub(crate) fn background_family(&self) -> u32 {
        self.candidate.async_family.unwrap_or(self.candidate.queue_family)
    }

    /// Both families when there are two: buffers are then used by both without a transfer of ownership.
    pub(crate) fn shared_families(&self) -> Option<[u32; 2]> {
        self.candidate.async_family.map(|family| [self.candidate.queue_family, family])
    }

    /// Whether background work runs on a queue of its own, beside the frames; else it takes its turn between them.
    pub fn has_async_queue(&self) -> bool {
        self.async_queue.is_some()
    }

    /// The queue that the background submits to.
    pub(crate) fn background_queue(&self) -> &Mutex<vk::Queue> {
        self.async_queue.as_ref().unwrap_or(&self.queue)
    }

    pub(crate) fn cache(&self) -> vk::PipelineCache {
        self.pipeline_cache
    }

    /// A number for a resource or a group of resources that the barrier tracker follows.
    pub fn new_resource_id(&self) -> crate::ResourceId {
        crate::ResourceId(self.next_resource.fetch_add(1, Ordering::Relaxed))
    }

    /// The timeline value that the frame being recorded will reach. Work recorded at value `v` is known to be submitted
    /// when this is above `v`, and finished when it is at `v + Frames::in_flight()`.
    pub fn recording(&self) -> u64 {
        self.submitted.load(Ordering::Acquire) + 1
    }

    /// The timeline value that the device has reached.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn completed(&self) -> Result<u64> {
        // SAFETY: the semaphore lives as long as the device.
        unsafe { self.raw.get_semaphore_counter_value(self.timeline) }.during("vkGetSemaphoreCounterValue")
    }

    /// Waits until the timeline has reached `value`.
    ///
    /// # Errors
    /// [`GpuError::Timeout`] after `seconds`, and nobody waits for the device any more; [`GpuError::DeviceLost`].
    pub fn wait_for(&self, value: u64, seconds: u64) -> Result<()> {
        self.wait_on(self.timeline, value, seconds)
    }

    /// Waits until a timeline of this device has reached `value`.
    pub(crate) fn wait_on(&self, timeline: vk::Semaphore, value: u64, seconds: u64) -> Result<()> {
        let (semaphores, values) = ([timeline], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore lives as long as the device.
        match unsafe { self.raw.wait_semaphores(&info, seconds.saturating_mul(1_000_000_000)) } {
            Err(vk::Result::TIMEOUT) => {
                self.give_up();
                let [last_pass, next_pass] = ["unknown"; 2].map(String::from);
                Err(GpuError::Timeout { seconds, last_pass, next_pass })
            }
            other => other.during("vkWaitSemaphores"),
        }
    }

    /// Waits for all submitted work and destroys what was dropped meanwhile. For the end of the program, tests and
    /// the user-interface renderer; never called in a frame.
    ///
    /// # Errors
    /// When the device is lost, or was given up.
    pub fn wait_idle(&self) -> Result<()> {
        if self.is_given_up() {
            return Err(self.overdue(self.hung_after_s()));
        }
        let _queues = (self.queue.lock(), self.async_queue.as_ref().map(Mutex::lock));
        // SAFETY: the queues are locked, so nobody submits meanwhile.
        unsafe { self.raw.device_wait_idle() }.during("vkDeviceWaitIdle")?;
        self.retired.collect(self, Reached::ALL);
        Ok(())
    }

    /// The raw device, for the one user-interface renderer that takes raw handles.
    pub fn raw(&self) -> &ash::Device {
        &self.raw
    }

    /// The shared allocator, for the one user-interface renderer that needs it.
    pub fn allocator(&self) -> Arc<Mutex<Allocator>> {
        Arc::clone(&self.allocator)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if self.is_given_up() {
            // It may still be at work, and would be waited for: it ends with the process.
            std::mem::forget(Arc::clone(&self.instance));
            return;
        }
        // SAFETY: every object that uses the device holds an Arc of it, so this is the last use; after the wait no
        // work is pending. The allocator goes before the device, once.
        unsafe {
            if let Err(error) = self.raw.device_wait_idle() {
                tracing::error!("waiting for the device at the end failed: {error}");
            }
            self.retired.collect(self, Reached::ALL);
            self.raw.destroy_semaphore(self.background.semaphore, None);
            self.raw.destroy_pipeline_cache(self.pipeline_cache, None);
            self.raw.destroy_semaphore(self.timeline, None);
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
        }
    }
}

fn create(instance: &Instance, candidate: &Candidate) -> Result<ash::Device> {
    let mut extensions: Vec<_> = REQUIRED_EXTENSIONS.iter().map(|(name, _)| name.as_ptr()).collect();
    if candidate.memory_budget {
        extensions.push(ext::memory_budget::NAME.as_ptr());
    }
    if candidate.pipeline_library {
        extensions.push(khr::pipeline_library::NAME.as_ptr());
    }
    if candidate.swapchain && instance.surface_fns.is_some() {
        extensions.push(khr::swapchain::NAME.as_ptr());
    }
    let priorities = [1.0];
    let queues: Vec<_> = std::iter::once(candidate.queue_family)
        .chain(candidate.async_family)
        .map(|family| {
            vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&priorities)
        })
        .collect();
    let (device, _) = device_choice::with_features(true, |features| {
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(features);
        // SAFETY: every pointer in `info` lives until the call returns; features and extensions were checked.
        unsafe { instance.raw.create_device(candidate.physical, &info, None) }
    });
    device.during("vkCreateDevice")
}

fn create_timeline(raw: &ash::Device) -> Result<vk::Semaphore> {
    let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
    // SAFETY: plain creation on a live device; destroyed when the device is dropped.
    unsafe { raw.create_semaphore(&info, None) }.during("vkCreateSemaphore")
}

fn limits_of(fns: &ash::Instance, physical: vk::PhysicalDevice) -> Limits {
    let mut accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut rt = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
    let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut v12 = vk::PhysicalDeviceVulkan12Properties::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Properties::default();
    let mut head = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut accel)
        .push_next(&mut rt)
        .push_next(&mut v12)
        .push_next(&mut v11)
        .push_next(&mut v13);
    // SAFETY: the extensions that define the structures were checked when the device was chosen.
    unsafe { fns.get_physical_device_properties2(physical, &mut head) };
    let core = head.properties.limits;
    Limits {
        scratch_alignment: u64::from(accel.min_acceleration_structure_scratch_offset_alignment),
        group_handle_size: rt.shader_group_handle_size,
        group_handle_alignment: rt.shader_group_handle_alignment,
        group_base_alignment: rt.shader_group_base_alignment,
        timestamp_period_ns: core.timestamp_period,
        max_image_extent: core.max_image_dimension2_d,
        max_anisotropy: core.max_sampler_anisotropy,
        max_textures: v12
            .max_per_stage_descriptor_update_after_bind_sampled_images
            .min(v12.max_per_stage_descriptor_update_after_bind_samplers)
            .min(v12.max_descriptor_set_update_after_bind_sampled_images)
            .min(v12.max_descriptor_set_update_after_bind_samplers)
            .saturating_sub(1)
            .min(16_384),
        // The custom index of an instance has 24 bits.
        max_instances: accel.max_instance_count.min(1 << 24),
        max_geometries: accel.max_geometry_count,
        max_primitives: accel.max_primitive_count,
        max_group_invocations: core.max_compute_work_group_invocations,
        max_group_size: core.max_compute_work_group_size,
        max_shared_bytes: core.max_compute_shared_memory_size,
        max_push_constants: core.max_push_constants_size,
        max_buffer_bytes: v13.max_buffer_size.min(v11.max_memory_allocation_size),
        timestamp_mask: u64::MAX,
    }
}
