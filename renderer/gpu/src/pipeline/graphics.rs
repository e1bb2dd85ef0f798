//! Graphics pipelines: triangle lists with vertices pulled by address, dynamic rendering, reverse depth.

use std::sync::Arc;

use ash::vk;

use super::{Layout, Raw, ShaderModule, Specialization, with_specialization};
use crate::Result;
use crate::context::Device;
use crate::descriptors::SceneLayout;
use crate::error::Context;
use crate::image::Format;
use crate::interface::Interface;

/// Which faces are dropped; set while recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CullMode {
    /// Both sides are drawn.
    None,
    /// Back faces are dropped.
    Back,
}

/// A colour target of a graphics pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColorTarget {
    /// Its format.
    pub format: Format,
}

/// What a graphics pipeline is made of.
pub struct GraphicsDesc<'a> {
    /// Name in messages.
    pub name: &'a str,
    /// Vertex stage.
    pub vertex: &'a ShaderModule,
    /// Fragment stage.
    pub fragment: &'a ShaderModule,
    /// Formats of the colour targets, in order of their location.
    pub colors: &'a [ColorTarget],
    /// Format of the depth target; greater depth wins (reverse z).
    pub depth: Option<Format>,
}

/// A graphics pipeline.
pub struct GraphicsPipeline {
    pub(crate) raw: Raw,
}

impl GraphicsPipeline {
    /// Makes a graphics pipeline.
    ///
    /// # Errors
    /// [`crate::GpuError::Interface`] when a shader uses what is not bound; refusals of the driver.
    pub fn new(
        device: &Arc<Device>,
        desc: &GraphicsDesc<'_>,
        interface: &Interface,
        specialization: &Specialization,
        scene: Option<&SceneLayout>,
    ) -> Result<Self> {
        let layout = Layout::new(device, desc.name, scene, interface)?;
        let created = with_specialization(specialization, |info| create(device, desc, info, &layout));
        let pipeline = created.map_err(|(_, error)| error).during("vkCreateGraphicsPipelines")?[0];
        Ok(Self { raw: Raw::new(device, desc.name, pipeline, layout, interface) })
    }

    /// What it binds.
    pub fn interface(&self) -> &Interface {
        &self.raw.interface
    }
}

fn create(
    device: &Device,
    desc: &GraphicsDesc<'_>,
    specialization: &vk::SpecializationInfo<'_>,
    layout: &Layout,
) -> std::result::Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)> {
    let stage = |stage, module: &ShaderModule| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(module.raw)
            .name(c"main")
            .specialization_info(specialization)
    };
    let stages = [
        stage(vk::ShaderStageFlags::VERTEX, desc.vertex),
        stage(vk::ShaderStageFlags::FRAGMENT, desc.fragment),
    ];
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly =
        vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(desc.depth.is_some())
        .depth_write_enable(desc.depth.is_some())
        .depth_compare_op(vk::CompareOp::GREATER);
    let blends = vec![
        vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(vk::ColorComponentFlags::RGBA);
        desc.colors.len()
    ];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = [
        vk::DynamicState::VIEWPORT,
        vk::DynamicState::SCISSOR,
        vk::DynamicState::CULL_MODE,
        vk::DynamicState::FRONT_FACE,
    ];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let formats: Vec<_> = desc.colors.iter().map(|target| target.format.raw()).collect();
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(&formats)
        .depth_attachment_format(desc.depth.map_or(vk::Format::UNDEFINED, Format::raw));
    let info = [vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout.raw)
        .push_next(&mut rendering)];
    // SAFETY: modules, layout and every pointer live until the call returns; the interface was reflected.
    unsafe { device.raw.create_graphics_pipelines(device.cache(), &info, None) }
}
