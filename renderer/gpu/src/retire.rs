//! Objects die here: each dropped object waits for the timeline values of the work that may still use it, on the
//! queue of the frames and on that of the background.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use ash::vk;

use crate::Result;
use crate::barrier::ResourceId;
use crate::context::Device;
use crate::memory::Memory;

/// A Vulkan object that nobody will use in new work.
pub(crate) enum Garbage {
    Buffer(vk::Buffer, Memory, ResourceId),
    Image(vk::Image, Vec<vk::ImageView>, Memory, ResourceId),
    Sampler(vk::Sampler),
    AccelStructure(vk::AccelerationStructureKHR),
    Pipeline(vk::Pipeline, vk::PipelineLayout, Vec<vk::DescriptorSetLayout>),
    ShaderModule(vk::ShaderModule),
    DescriptorPool(vk::DescriptorPool),
    SetLayout(vk::DescriptorSetLayout),
    CommandPool(vk::CommandPool),
    QueryPool(vk::QueryPool),
    Events(Vec<vk::Event>),
    Semaphore(vk::Semaphore),
    ImageViews(Vec<vk::ImageView>),
    Swapchain(vk::SwapchainKHR),
}

/// How far each queue must be, or is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    pub(crate) frames: u64,
    pub(crate) background: u64,
}

impl Reached {
    /// Both queues are idle.
    pub(crate) const ALL: Self = Self { frames: u64::MAX, background: u64::MAX };

    fn includes(self, needed: Self) -> bool {
        needed.frames <= self.frames && needed.background <= self.background
    }
}

/// What was dropped, in that order, each with how far both queues must be before it may be destroyed.
#[derive(Default)]
pub(crate) struct RetireQueue {
    waiting: Mutex<VecDeque<(Reached, Garbage)>>,
}

impl RetireQueue {
    /// Destroys everything that both queues are done with; what waits for a long build does not hold up the rest.
    /// A structure still goes before the buffer it lies in, which is dropped after it and so never needs less.
    pub(crate) fn collect(&self, device: &Device, reached: Reached) {
        let mut free = Vec::new();
        if let Ok(mut waiting) = self.waiting.lock() {
            for (needed, garbage) in std::mem::take(&mut *waiting) {
                if reached.includes(needed) {
                    free.push(garbage);
                } else {
                    waiting.push_back((needed, garbage));
                }
            }
        }
        free.into_iter().for_each(|garbage| destroy(device, garbage));
    }

    /// Number of objects that wait.
    pub(crate) fn len(&self) -> usize {
        self.waiting.lock().map(|waiting| waiting.len()).unwrap_or(0)
    }
}

impl Device {
    /// Takes an object that no new work will use. Work that is being recorded now may use it still: it is destroyed
    /// once the next submission has finished, and what the background was given before.
    pub(crate) fn retire(&self, garbage: Garbage) {
        let background = match garbage {
            // Only these are ever given to the background.
            Garbage::Buffer(..)
            | Garbage::AccelStructure(_)
            | Garbage::CommandPool(_)
            | Garbage::QueryPool(_) => self.background.submitted.load(Ordering::Acquire),
            _ => 0,
        };
        let needed = Reached { frames: self.submitted.load(Ordering::Acquire) + 1, background };
        if let Ok(mut waiting) = self.retired.waiting.lock() {
            waiting.push_back((needed, garbage));
        }
    }

    /// Destroys what both queues are done with.
    pub(crate) fn collect_retired(&self) -> Result<()> {
        let reached = Reached { frames: self.completed()?, background: self.background_completed()? };
        self.retired.collect(self, reached);
        Ok(())
    }

    /// Number of dropped objects that wait for the device.
    pub fn retired_objects(&self) -> usize {
        self.retired.len()
    }
}

fn destroy(device: &Device, garbage: Garbage) {
    let raw = &device.raw;
    // SAFETY: each handle was made by this device, was handed over by its only owner, and the timeline has passed the
    // last submission that could use it.
    unsafe {
        match garbage {
            Garbage::Buffer(buffer, memory, id) => {
                raw.destroy_buffer(buffer, None);
                device.free(memory);
                forget(device, id);
            }
            Garbage::Image(image, views, memory, id) => {
                views.into_iter().for_each(|view| raw.destroy_image_view(view, None));
                raw.destroy_image(image, None);
                device.free(memory);
                forget(device, id);
            }
            Garbage::Sampler(sampler) => raw.destroy_sampler(sampler, None),
            Garbage::AccelStructure(accel) => device.accel_fns.destroy_acceleration_structure(accel, None),
            Garbage::Pipeline(pipeline, layout, sets) => {
                raw.destroy_pipeline(pipeline, None);
                raw.destroy_pipeline_layout(layout, None);
                sets.into_iter().for_each(|set| raw.destroy_descriptor_set_layout(set, None));
            }
            Garbage::ShaderModule(module) => raw.destroy_shader_module(module, None),
            Garbage::DescriptorPool(pool) => raw.destroy_descriptor_pool(pool, None),
            Garbage::SetLayout(layout) => raw.destroy_descriptor_set_layout(layout, None),
            Garbage::CommandPool(pool) => raw.destroy_command_pool(pool, None),
            Garbage::QueryPool(pool) => raw.destroy_query_pool(pool, None),
            Garbage::Events(events) => events.into_iter().for_each(|event| raw.destroy_event(event, None)),
            Garbage::Semaphore(semaphore) => raw.destroy_semaphore(semaphore, None),
            Garbage::ImageViews(views) => {
                views.into_iter().for_each(|view| raw.destroy_image_view(view, None))
            }
            Garbage::Swapchain(swapchain) => {
                if let Some(fns) = &device.swapchain_fns {
                    fns.destroy_swapchain(swapchain, None);
                }
            }
        }
    }
}

fn forget(device: &Device, id: ResourceId) {
    if let Ok(mut tracker) = device.tracker.lock() {
        tracker.forget(id);
    }
}
