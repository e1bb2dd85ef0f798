//! What the user-interface renderer needs from Vulkan beyond raw handles: a descriptor set that shows one of our images,
//! and the queue together with a command pool for its texture uploads. Everything dies through the retire queue.

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::context::Device;
use crate::error::{Context, GpuError};
use crate::image::Image;
use crate::retire::Garbage;

/// A descriptor set with one image and a linear, clamping sampler at binding 0, for fragment shaders.
/// The image must be in the layout of `Access::Sampled` when a draw uses the set, and must outlive that work.
pub struct TextureSet {
    device: Arc<Device>,
    layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    sampler: vk::Sampler,
    set: vk::DescriptorSet,
}

impl TextureSet {
    /// Makes a set that shows `image`.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>, image: &Image) -> Result<Self> {
        let binding = [vk::DescriptorSetLayoutBinding::default()
            .binding(0)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&binding);
        // SAFETY: plain creation; destroyed through the retire queue.
        let layout = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .during("vkCreateDescriptorSetLayout")?;
        let mut set = Self {
            device: Arc::clone(device),
            layout,
            pool: vk::DescriptorPool::null(),
            sampler: vk::Sampler::null(),
            set: vk::DescriptorSet::null(),
        };
        let sizes =
            [vk::DescriptorPoolSize { ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER, descriptor_count: 1 }];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: as above.
        set.pool =
            unsafe { device.raw.create_descriptor_pool(&info, None) }.during("vkCreateDescriptorPool")?;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
        // SAFETY: as above.
        set.sampler = unsafe { device.raw.create_sampler(&info, None) }.during("vkCreateSampler")?;
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(set.pool).set_layouts(&layouts);
        // SAFETY: pool and layout are alive.
        set.set =
            unsafe { device.raw.allocate_descriptor_sets(&info) }.during("vkAllocateDescriptorSets")?[0];
        let info = [vk::DescriptorImageInfo {
            sampler: set.sampler,
            image_view: image.raw_view(),
            image_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        }];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(set.set)
            .dst_binding(0)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .image_info(&info);
        // SAFETY: set, view and sampler are alive; the set was not used yet.
        unsafe { device.raw.update_descriptor_sets(&[write], &[]) };
        Ok(set)
    }

    /// The raw set, for the one user-interface renderer that takes raw handles.
    pub fn raw(&self) -> vk::DescriptorSet {
        self.set
    }
}

impl Drop for TextureSet {
    fn drop(&mut self) {
        self.device.retire(Garbage::DescriptorPool(self.pool));
        self.device.retire(Garbage::SetLayout(self.layout));
        self.device.retire(Garbage::Sampler(self.sampler));
    }
}

/// The queue with a command pool of its own, for code that submits copies by itself and waits for them.
pub struct UploadQueue {
    device: Arc<Device>,
    pool: vk::CommandPool,
}

impl UploadQueue {
    /// Makes the pool.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.queue_family())
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: plain creation; destroyed through the retire queue.
        let pool = unsafe { device.raw.create_command_pool(&info, None) }.during("vkCreateCommandPool")?;
        Ok(Self { device: Arc::clone(device), pool })
    }

    /// Runs `body` with the raw queue, locked meanwhile, and the pool. `body` waits for what it submits.
    ///
    /// # Errors
    /// When the queue was poisoned by a panic.
    pub fn with<R>(&self, body: impl FnOnce(vk::Queue, vk::CommandPool) -> R) -> Result<R> {
        let queue = self
            .device
            .queue
            .lock()
            .map_err(|_| GpuError::Vulkan { call: "locking the queue", result: vk::Result::ERROR_UNKNOWN })?;
        Ok(body(*queue, self.pool))
    }
}

impl Drop for UploadQueue {
    fn drop(&mut self) {
        self.device.retire(Garbage::CommandPool(self.pool));
    }
}

impl Device {
    /// Whether everything submitted so far has finished; asks without waiting.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn has_finished(&self) -> Result<bool> {
        Ok(self.completed()? >= self.submitted.load(std::sync::atomic::Ordering::Acquire))
    }
}
