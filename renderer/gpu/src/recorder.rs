//! Records one frame. Enters: pipelines, what they bind by name, what else they touch. Leaves: a command buffer whose
//! barriers the tracker derived. A binding that is missing or of the wrong kind is an error before the driver sees it.

mod bind;
mod draw;
mod transfer;

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::accel::{AccelBuild, AccelStructure, record_builds, record_compaction};
use crate::barrier::{Access, Barrier, ResourceId, Stage};
use crate::buffer::Buffer;
use crate::context::Device;
use crate::descriptors::SceneSet;
use crate::error::{Context, GpuError};
use crate::image::Image;
use crate::interface::Bind;
use crate::pipeline::{ComputePipeline, CullMode, RayTracingPipeline};
use crate::staging::Staging;
use crate::timers::Timers;

/// A use of a resource that no binding shows, such as a read by buffer address.
#[derive(Clone, Copy)]
pub enum Use<'a> {
    /// An image.
    Image(&'a Image, Stage, Access),
    /// A buffer.
    Buffer(&'a Buffer, Stage, Access),
    /// A group of resources under one number, such as all BLASes.
    Group(ResourceId, Stage, Access),
}

/// One draw.
#[derive(Clone, Copy)]
pub struct Draw<'a> {
    /// 32-bit indices; `None`: `gl_VertexIndex` counts up from `first_index`.
    pub indices: Option<&'a Buffer>,
    /// First index.
    pub first_index: u32,
    /// Number of indices.
    pub index_count: u32,
    /// First value of `gl_InstanceIndex`.
    pub first_instance: u32,
    /// Number of instances.
    pub instance_count: u32,
    /// Which faces are dropped.
    pub cull: CullMode,
    /// Whether front faces wind clockwise in render space (mirrored instances).
    pub clockwise: bool,
    /// Push constants.
    pub push: &'a [u8],
}

/// Commands of one frame.
pub struct Recorder {
    device: Arc<Device>,
    command: vk::CommandBuffer,
    slot: usize,
    parts: Option<(Staging, Timers)>,
    tag: u64,
}

impl Recorder {
    pub(crate) fn new(
        device: Arc<Device>,
        command: vk::CommandBuffer,
        slot: usize,
        staging: Staging,
        timers: Timers,
    ) -> Self {
        Self { device, command, slot, parts: Some((staging, timers)), tag: 0 }
    }

    pub(crate) fn finish(mut self) -> Result<(vk::CommandBuffer, usize, Staging, Timers)> {
        // SAFETY: the command buffer is being recorded.
        unsafe { self.device.raw.end_command_buffer(self.command) }.during("vkEndCommandBuffer")?;
        let parts = self.parts.take();
        let (staging, timers) = parts
            .ok_or(GpuError::Vulkan { call: "finishing a frame twice", result: vk::Result::ERROR_UNKNOWN })?;
        Ok((self.command, self.slot, staging, timers))
    }

    /// Which of the frames in flight this is, below `Frames::in_flight()`.
    pub fn slot(&self) -> usize {
        self.slot
    }

    /// Marks the frame; its times come back with this number.
    pub fn set_tag(&mut self, tag: u64) {
        self.tag = tag;
    }

    pub(crate) fn tag(&self) -> u64 {
        self.tag
    }

    /// The device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// The raw command buffer, for the one user-interface renderer that takes raw handles.
    pub fn raw_command(&self) -> vk::CommandBuffer {
        self.command
    }

    /// Bytes staged for upload so far in this frame.
    pub fn uploaded_bytes(&self) -> u64 {
        self.parts.as_ref().map_or(0, |(staging, _)| staging.total)
    }

    /// Runs `body` as the pass `label`: one name for the debug marker, the timer and the report.
    ///
    /// # Errors
    /// Those of `body`.
    pub fn pass<R, E>(
        &mut self,
        label: &str,
        body: impl FnOnce(&mut Self) -> std::result::Result<R, E>,
    ) -> std::result::Result<R, E> {
        if let Some((_, timers)) = &mut self.parts {
            timers.begin(self.command, label);
        }
        let name = std::ffi::CString::new(label).unwrap_or_default();
        if let Some(debug) = &self.device.debug_utils {
            let info = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: the command buffer is being recorded.
            unsafe { debug.cmd_begin_debug_utils_label(self.command, &info) };
        }
        let result = body(self);
        if let Some(debug) = &self.device.debug_utils {
            // SAFETY: closes the label opened above.
            unsafe { debug.cmd_end_debug_utils_label(self.command) };
        }
        if let Some((_, timers)) = &mut self.parts {
            timers.end(self.command);
        }
        result
    }

    /// Places the barriers that these uses need.
    pub fn declare(&mut self, uses: &[Use<'_>]) {
        let device = Arc::clone(&self.device);
        let Ok(mut tracker) = device.tracker.lock() else { return };
        let mut memory = vk::MemoryBarrier2::default();
        let mut any_memory = false;
        let mut images = Vec::new();
        for used in uses {
            let barrier = match *used {
                Use::Image(image, stage, access) => tracker.access(image.id(), true, stage, access),
                Use::Buffer(buffer, stage, access) => tracker.access(buffer.id(), false, stage, access),
                Use::Group(id, stage, access) => tracker.access(id, false, stage, access),
            };
            let Some(barrier) = barrier else { continue };
            match (used, barrier.layouts) {
                (Use::Image(image, ..), Some(layouts)) => {
                    images.push(image_barrier(image, &barrier, layouts))
                }
                _ => {
                    any_memory = true;
                    memory.src_stage_mask |= barrier.source_stages;
                    memory.src_access_mask |= barrier.source_access;
                    memory.dst_stage_mask |= barrier.target_stages;
                    memory.dst_access_mask |= barrier.target_access;
                }
            }
        }
        drop(tracker);
        let memory = [memory];
        let mut info = vk::DependencyInfo::default().image_memory_barriers(&images);
        if any_memory {
            info = info.memory_barriers(&memory);
        }
        if any_memory || !images.is_empty() {
            // SAFETY: the command buffer is being recorded outside of a rendering scope.
            unsafe { device.raw.cmd_pipeline_barrier2(self.command, &info) };
        }
    }

    /// Dispatches a compute pipeline. `uses`: what it touches beyond its bindings.
    ///
    /// # Errors
    /// [`GpuError::Interface`] when `binds` and the shader disagree.
    pub fn dispatch(
        &mut self,
        pipeline: &ComputePipeline,
        scene: Option<&SceneSet>,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        push: &[u8],
        groups: [u32; 3],
    ) -> Result<()> {
        self.bind(&pipeline.raw, vk::PipelineBindPoint::COMPUTE, Stage::Compute, scene, binds, uses, push)?;
        // SAFETY: pipeline, sets and constants were bound above.
        unsafe { self.device.raw.cmd_dispatch(self.command, groups[0], groups[1], groups[2]) };
        Ok(())
    }

    /// Launches one ray generation shader a pixel of `extent`.
    ///
    /// # Errors
    /// [`GpuError::Interface`] when `binds` and the shader disagree.
    pub fn trace_rays(
        &mut self,
        pipeline: &RayTracingPipeline,
        scene: Option<&SceneSet>,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        push: &[u8],
        extent: [u32; 2],
    ) -> Result<()> {
        self.bind(
            &pipeline.raw,
            vk::PipelineBindPoint::RAY_TRACING_KHR,
            Stage::RayTracing,
            scene,
            binds,
            uses,
            push,
        )?;
        let table = &pipeline.table;
        let callable = vk::StridedDeviceAddressRegionKHR::default();
        // SAFETY: pipeline, sets and constants were bound above; the table belongs to the pipeline.
        unsafe {
            self.device.rt_fns.cmd_trace_rays(
                self.command,
                &table.ray_generation,
                &table.miss,
                &table.hit,
                &callable,
                extent[0],
                extent[1],
                1,
            );
        }
        Ok(())
    }

    /// Records builds and refits that may run side by side. `uses`: inputs, scratch and targets, as groups.
    pub fn build(&mut self, builds: &[AccelBuild<'_>], uses: &[Use<'_>]) {
        self.declare(uses);
        record_builds(&self.device, self.command, builds);
    }

    /// Copies a BLAS into one of its compacted size. `uses`: both, as groups.
    pub fn compact(&mut self, from: &AccelStructure, to: &AccelStructure, uses: &[Use<'_>]) {
        self.declare(uses);
        record_compaction(&self.device, self.command, from, to);
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.parts.is_some() {
            // Never submitted: the states that were declared will not come about.
            if let Ok(mut tracker) = self.device.tracker.lock() {
                tracker.roll_back();
            }
        }
    }
}

fn image_barrier(
    image: &Image,
    barrier: &Barrier,
    (old, new): (vk::ImageLayout, vk::ImageLayout),
) -> vk::ImageMemoryBarrier2<'static> {
    vk::ImageMemoryBarrier2::default()
        .src_stage_mask(barrier.source_stages)
        .src_access_mask(barrier.source_access)
        .dst_stage_mask(barrier.target_stages)
        .dst_access_mask(barrier.target_access)
        .old_layout(old)
        .new_layout(new)
        .image(image.raw)
        .subresource_range(
            vk::ImageSubresourceRange::default()
                .aspect_mask(image.aspect())
                .level_count(vk::REMAINING_MIP_LEVELS)
                .layer_count(1),
        )
}
