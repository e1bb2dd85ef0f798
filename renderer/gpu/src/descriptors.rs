//! Set 0, the scene: TLAS, bindless textures, environment map. Every slot of the array holds an image at all times:
//! a sampled slot that was never written crashes some drivers.

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::accel::AccelStructure;
use crate::context::Device;
use crate::error::Context;
use crate::image::Image;
use crate::retire::Garbage;
use crate::sampler::Sampler;

/// Binding of the TLAS in set 0.
const TLAS: u32 = 0;
/// Binding of the texture array in set 0.
const TEXTURES: u32 = 1;
/// Binding of the environment map in set 0.
const ENVIRONMENT: u32 = 2;

/// The layout of set 0. Shared, so that pipelines can be made on another thread than the one that owns the set.
pub struct SceneLayout {
    pub(crate) raw: vk::DescriptorSetLayout,
    device: Arc<Device>,
}

impl Drop for SceneLayout {
    fn drop(&mut self) {
        self.device.retire(Garbage::SetLayout(self.raw));
    }
}

/// The descriptor set of the scene.
pub struct SceneSet {
    layout: Arc<SceneLayout>,
    pub(crate) set: vk::DescriptorSet,
    pool: vk::DescriptorPool,
    capacity: u32,
    device: Arc<Device>,
}

impl SceneSet {
    /// Makes a set with room for `capacity` textures, each slot filled with the default image.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(
        device: &Arc<Device>,
        capacity: u32,
        default_image: &Image,
        sampler: &Sampler,
    ) -> Result<Self> {
        let capacity = capacity.clamp(1, device.limits().max_textures.max(1));
        let layout = SceneLayout { raw: create_layout(device, capacity)?, device: Arc::clone(device) };
        let sizes = [
            vk::DescriptorPoolSize {
                ty: vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
                descriptor_count: 1,
            },
            vk::DescriptorPoolSize {
                ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
                descriptor_count: capacity + 1,
            },
        ];
        let info = vk::DescriptorPoolCreateInfo::default()
            .flags(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND)
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: plain creation; destroyed through the retire queue.
        let pool =
            unsafe { device.raw.create_descriptor_pool(&info, None) }.during("vkCreateDescriptorPool")?;
        let layouts = [layout.raw];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: pool and layout are alive; the set dies with the pool.
        let set =
            unsafe { device.raw.allocate_descriptor_sets(&info) }.during("vkAllocateDescriptorSets")?[0];
        let this = Self { layout: Arc::new(layout), set, pool, capacity, device: Arc::clone(device) };
        for slot in 0..capacity {
            this.set_texture(slot, default_image, sampler);
        }
        this.set_environment(default_image, sampler);
        Ok(this)
    }

    /// Its layout; the same for every set of this capacity.
    pub fn layout(&self) -> &Arc<SceneLayout> {
        &self.layout
    }

    /// Number of texture slots.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Puts a texture into a slot below the capacity; a slot past it is ignored.
    pub fn set_texture(&self, slot: u32, image: &Image, sampler: &Sampler) {
        if slot < self.capacity {
            self.write_image(TEXTURES, slot, image, sampler);
        }
    }

    /// Sets the environment map. No work that is still running may use the set.
    pub fn set_environment(&self, image: &Image, sampler: &Sampler) {
        self.write_image(ENVIRONMENT, 0, image, sampler);
    }

    /// Sets the TLAS. No work that is still running may use the set.
    pub fn set_tlas(&self, tlas: &AccelStructure) {
        let handles = [tlas.raw];
        let mut accel =
            vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&handles);
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(TLAS)
            .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
            .descriptor_count(1)
            .push_next(&mut accel);
        // SAFETY: set and handle are alive; the caller keeps running work away from the set.
        unsafe { self.device.raw.update_descriptor_sets(&[write], &[]) };
    }

    fn write_image(&self, binding: u32, slot: u32, image: &Image, sampler: &Sampler) {
        let info = [vk::DescriptorImageInfo {
            sampler: sampler.raw,
            image_view: image.view,
            image_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        }];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(binding)
            .dst_array_element(slot)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .image_info(&info);
        // SAFETY: set, view and sampler are alive; textures are bound with UPDATE_AFTER_BIND and retired late.
        unsafe { self.device.raw.update_descriptor_sets(&[write], &[]) };
    }
}

impl Drop for SceneSet {
    fn drop(&mut self) {
        self.device.retire(Garbage::DescriptorPool(self.pool));
    }
}

fn create_layout(device: &Device, capacity: u32) -> Result<vk::DescriptorSetLayout> {
    let all = vk::ShaderStageFlags::ALL;
    let bindings = [
        vk::DescriptorSetLayoutBinding::default()
            .binding(TLAS)
            .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
            .descriptor_count(1)
            .stage_flags(all),
        vk::DescriptorSetLayoutBinding::default()
            .binding(TEXTURES)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .descriptor_count(capacity)
            .stage_flags(all),
        vk::DescriptorSetLayoutBinding::default()
            .binding(ENVIRONMENT)
            .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
            .descriptor_count(1)
            .stage_flags(all),
    ];
    let texture_flags =
        vk::DescriptorBindingFlags::UPDATE_AFTER_BIND | vk::DescriptorBindingFlags::PARTIALLY_BOUND;
    let flags = [
        vk::DescriptorBindingFlags::PARTIALLY_BOUND,
        texture_flags,
        vk::DescriptorBindingFlags::PARTIALLY_BOUND,
    ];
    let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
    let info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
        .bindings(&bindings)
        .push_next(&mut flags);
    // SAFETY: plain creation; destroyed through the retire queue.
    unsafe { device.raw.create_descriptor_set_layout(&info, None) }.during("vkCreateDescriptorSetLayout")
}
