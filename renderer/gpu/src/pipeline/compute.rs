//! Compute pipelines.

use std::sync::Arc;

use ash::vk;

use super::{Layout, Raw, ShaderModule, Specialization, with_specialization};
use crate::Result;
use crate::context::Device;
use crate::descriptors::SceneLayout;
use crate::error::Context;
use crate::interface::Interface;

/// A compute pipeline.
pub struct ComputePipeline {
    pub(crate) raw: Raw,
}

impl ComputePipeline {
    /// Makes a compute pipeline of one module.
    ///
    /// # Errors
    /// [`crate::GpuError::Interface`] when the shader uses what is not bound; refusals of the driver.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        module: &ShaderModule,
        interface: &Interface,
        specialization: &Specialization,
        scene: Option<&SceneLayout>,
    ) -> Result<Self> {
        let layout = Layout::new(device, name, scene, interface)?;
        let pipelines = with_specialization(specialization, |info| {
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module.raw)
                .name(c"main")
                .specialization_info(info);
            let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout.raw)];
            // SAFETY: module, layout and every pointer live until the call returns; the interface was reflected.
            unsafe { device.raw.create_compute_pipelines(device.cache(), &info, None) }
        });
        let pipeline = pipelines.map_err(|(_, error)| error).during("vkCreateComputePipelines")?[0];
        Ok(Self { raw: Raw::new(device, name, pipeline, layout, interface) })
    }

    /// What it binds.
    pub fn interface(&self) -> &Interface {
        &self.raw.interface
    }
}
