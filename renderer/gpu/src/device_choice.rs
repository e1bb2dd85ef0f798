//! Which device to use and why not the others. Enters: an instance. Leaves: candidates with their refusals.

use std::ffi::CStr;

use ash::{ext, khr, vk};

use crate::Result;
use crate::error::{Context, GpuError};
use crate::instance::Instance;

/// What kind of device it is, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// Part of the processor.
    Integrated,
    /// A virtual machine's share of one.
    Virtual,
    /// The processor itself, such as Mesa's lavapipe.
    Cpu,
    /// Anything else.
    Other,
}

/// A device of this machine and what it lacks.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub(crate) physical: vk::PhysicalDevice,
    pub(crate) queue_family: u32,
    /// A family that computes beside the graphics, if the device has one.
    pub(crate) async_family: Option<u32>,
    /// Position in the driver's list, the INDEX of `--device`.
    pub index: usize,
    /// Name by the driver.
    pub name: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Vulkan version, such as "1.3.255".
    pub api_version: String,
    /// Kind of device.
    pub kind: DeviceKind,
    /// Bytes of the largest device-local heap.
    pub device_local_bytes: u64,
    /// One sentence for each thing it lacks; empty: it can run Caustica.
    pub lacks: Vec<String>,
    /// Whether VK_EXT_memory_budget is there.
    pub(crate) memory_budget: bool,
    /// Whether VK_KHR_pipeline_library is there.
    pub(crate) pipeline_library: bool,
    /// Whether VK_KHR_swapchain is there.
    pub(crate) swapchain: bool,
    /// Bits of a timestamp that count.
    pub(crate) timestamp_mask: u64,
}

impl Candidate {
    /// Order of preference among suitable devices: smaller is better.
    pub fn rank(&self) -> (DeviceKind, std::cmp::Reverse<u64>, usize) {
        (self.kind, std::cmp::Reverse(self.device_local_bytes), self.index)
    }

    /// Whether it has all that is required.
    pub fn is_suitable(&self) -> bool {
        self.lacks.is_empty()
    }
}

/// What a caller asks of a device beyond the fixed list of features.
#[derive(Clone, Debug, Default)]
pub struct Requirements {
    /// A part of the device's name, or its index; `None`: the best.
    pub device: Option<String>,
    /// It must be able to present to a window.
    pub present: bool,
}

/// Extensions without which nothing works, with what they are for.
pub(crate) const REQUIRED_EXTENSIONS: &[(&CStr, &str)] = &[
    (khr::acceleration_structure::NAME, "acceleration structures"),
    (khr::ray_tracing_pipeline::NAME, "ray-tracing pipelines"),
    (khr::deferred_host_operations::NAME, "acceleration structures"),
    (khr::push_descriptor::NAME, "push descriptors"),
];

/// Lists every device with what it lacks, in the driver's order.
///
/// # Errors
/// When the driver cannot be asked.
pub fn list_devices(instance: &Instance, present: bool) -> Result<Vec<Candidate>> {
    // SAFETY: a plain query on a live instance.
    let devices =
        unsafe { instance.raw.enumerate_physical_devices() }.during("vkEnumeratePhysicalDevices")?;
    devices.into_iter().enumerate().map(|(index, device)| examine(instance, index, device, present)).collect()
}

/// Chooses the device that `requirements` names, or the best suitable one.
///
/// # Errors
/// [`GpuError::NoDevice`] with a reason for each refusal.
pub(crate) fn choose(instance: &Instance, requirements: &Requirements) -> Result<Candidate> {
    let candidates = list_devices(instance, requirements.present)?;
    if candidates.is_empty() {
        return Err(GpuError::NoDevice { refusals: String::from("no Vulkan driver is installed") });
    }
    let count = candidates.len();
    let wanted = |candidate: &Candidate| match &requirements.device {
        None => true,
        Some(text) => match text.parse::<usize>() {
            Ok(index) if index < count => candidate.index == index,
            _ => candidate.name.to_lowercase().contains(&text.to_lowercase()),
        },
    };
    let refusals = candidates
        .iter()
        .map(|c| match (wanted(c), c.lacks.as_slice()) {
            (false, _) => format!("{} was not asked for", c.name),
            (true, lacks) => format!("{} lacks {}", c.name, lacks.join(", ")),
        })
        .collect::<Vec<_>>()
        .join("; ");
    candidates
        .into_iter()
        .filter(|c| wanted(c) && c.is_suitable())
        .min_by_key(Candidate::rank)
        .ok_or(GpuError::NoDevice { refusals })
}

fn examine(
    instance: &Instance,
    index: usize,
    physical: vk::PhysicalDevice,
    present: bool,
) -> Result<Candidate> {
    let raw = &instance.raw;
    // SAFETY: plain queries on a physical device of this instance.
    let (properties, extensions, memory) = unsafe {
        (
            raw.get_physical_device_properties(physical),
            raw.enumerate_device_extension_properties(physical)
                .during("vkEnumerateDeviceExtensionProperties")?,
            raw.get_physical_device_memory_properties(physical),
        )
    };
    let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    let version = properties.api_version;
    let mut lacks = Vec::new();
    if version < vk::API_VERSION_1_3 {
        lacks.push(String::from("Vulkan 1.3"));
    }
    for (name, purpose) in REQUIRED_EXTENSIONS {
        if !has(name) {
            lacks.push(format!("{purpose} ({})", name.to_string_lossy()));
        }
    }
    let mut driver = String::new();
    if lacks.is_empty() {
        lacks.extend(missing_features(raw, physical));
        driver = driver_name(raw, physical);
    }
    if present && !has(khr::swapchain::NAME) {
        lacks.push(String::from("a window surface (VK_KHR_swapchain)"));
    }
    let queue_family = universal_queue_family(raw, physical);
    if !filters_floats(raw, physical) {
        lacks.push(String::from("linear filtering of 32-bit float images (the environment)"));
    }
    if queue_family.is_none() {
        lacks.push(String::from("a queue for graphics and compute"));
    }
    let device_local_bytes = memory
        .memory_heaps_as_slice()
        .iter()
        .filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
        .map(|heap| heap.size)
        .max()
        .unwrap_or(0);
    Ok(Candidate {
        physical,
        queue_family: queue_family.map_or(0, |(index, _)| index),
        async_family: async_queue_family(raw, physical),
        timestamp_mask: queue_family.map_or(0, |(_, bits)| u64::MAX >> (64 - bits.clamp(1, 64))),
        index,
        name: properties.device_name_as_c_str().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
        driver,
        api_version: format!(
            "{}.{}.{}",
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version)
        ),
        kind: match properties.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
            vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
            _ => DeviceKind::Other,
        },
        device_local_bytes,
        lacks,
        memory_budget: has(ext::memory_budget::NAME),
        pipeline_library: has(khr::pipeline_library::NAME),
        swapchain: has(khr::swapchain::NAME),
    })
}

/// Index of the first family that can do everything, and the bits of its timestamps.
fn universal_queue_family(raw: &ash::Instance, physical: vk::PhysicalDevice) -> Option<(u32, u32)> {
    // SAFETY: a plain query.
    let families = unsafe { raw.get_physical_device_queue_family_properties(physical) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let found = families.iter().position(|f| f.queue_flags.contains(wanted) && f.timestamp_valid_bits > 0)?;
    Some((found as u32, families[found].timestamp_valid_bits))
}

/// Index of the first family for compute without graphics: its queues run beside the one of the frames.
fn async_queue_family(raw: &ash::Instance, physical: vk::PhysicalDevice) -> Option<u32> {
    // SAFETY: a plain query.
    let families = unsafe { raw.get_physical_device_queue_family_properties(physical) };
    let beside = |flags: vk::QueueFlags| {
        flags.contains(vk::QueueFlags::COMPUTE) && !flags.contains(vk::QueueFlags::GRAPHICS)
    };
    families.iter().position(|family| beside(family.queue_flags)).map(|index| index as u32)
}

fn filters_floats(raw: &ash::Instance, physical: vk::PhysicalDevice) -> bool {
    // SAFETY: a plain query.
    let properties =
        unsafe { raw.get_physical_device_format_properties(physical, vk::Format::R32G32B32A32_SFLOAT) };
    properties.optimal_tiling_features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR)
}

fn driver_name(raw: &ash::Instance, physical: vk::PhysicalDevice) -> String {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: Vulkan 1.2 and later know the structure; checked by the caller.
    unsafe { raw.get_physical_device_properties2(physical, &mut properties) };
    let text = |result: std::result::Result<&CStr, _>| {
        result.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
    };
    format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()))
        .trim()
        .to_owned()
}

/// The features that Caustica switches on, as one chain. `with` gets the head of the chain.
pub(crate) fn with_features<R>(
    fill: bool,
    with: impl FnOnce(&mut vk::PhysicalDeviceFeatures2<'_>) -> R,
) -> (R, Vec<(&'static str, bool)>) {
    let mut rt = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(fill);
    let mut accel =
        vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(fill);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(fill)
        .dynamic_rendering(fill)
        .shader_demote_to_helper_invocation(fill)
        .maintenance4(fill);
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
        .buffer_device_address(fill)
        .timeline_semaphore(fill)
        .scalar_block_layout(fill)
        .descriptor_indexing(fill)
        .runtime_descriptor_array(fill)
        .shader_sampled_image_array_non_uniform_indexing(fill)
        .descriptor_binding_sampled_image_update_after_bind(fill)
        .descriptor_binding_partially_bound(fill)
        .host_query_reset(fill);
    let features = vk::PhysicalDeviceFeatures::default()
        .shader_int64(fill)
        .full_draw_index_uint32(fill)
        .geometry_shader(fill)
        .sampler_anisotropy(fill)
        .independent_blend(fill)
        .shader_storage_image_extended_formats(fill);
    let mut head = vk::PhysicalDeviceFeatures2::default()
        .features(features)
        .push_next(&mut rt)
        .push_next(&mut accel)
        .push_next(&mut v13)
        .push_next(&mut v12);
    let result = with(&mut head);
    let core = head.features;
    let list = vec![
        ("ray-tracing pipelines", rt.ray_tracing_pipeline),
        ("acceleration structures", accel.acceleration_structure),
        ("synchronization2", v13.synchronization2),
        ("dynamic rendering", v13.dynamic_rendering),
        ("maintenance4", v13.maintenance4),
        ("demotion to helper invocations", v13.shader_demote_to_helper_invocation),
        ("buffer addresses", v12.buffer_device_address),
        ("timeline semaphores", v12.timeline_semaphore),
        ("scalar block layout", v12.scalar_block_layout),
        ("descriptor indexing", v12.descriptor_indexing),
        ("runtime descriptor arrays", v12.runtime_descriptor_array),
        ("non-uniform texture indexing", v12.shader_sampled_image_array_non_uniform_indexing),
        ("texture update after bind", v12.descriptor_binding_sampled_image_update_after_bind),
        ("partially bound descriptors", v12.descriptor_binding_partially_bound),
        ("host query reset", v12.host_query_reset),
        ("64-bit integers in shaders", core.shader_int64),
        ("32-bit vertex indices", core.full_draw_index_uint32),
        ("primitive ids in fragment shaders (geometryShader)", core.geometry_shader),
        ("anisotropic filtering", core.sampler_anisotropy),
        ("independent blending", core.independent_blend),
        ("extended storage image formats", core.shader_storage_image_extended_formats),
    ];
    (result, list.into_iter().map(|(name, value)| (name, value == vk::TRUE)).collect())
}

fn missing_features(raw: &ash::Instance, physical: vk::PhysicalDevice) -> Vec<String> {
    // SAFETY: the extensions that define the structures were checked before.
    let ((), list) =
        with_features(false, |head| unsafe { raw.get_physical_device_features2(physical, head) });
    list.into_iter().filter(|(_, there)| !there).map(|(name, _)| name.to_owned()).collect()
}
