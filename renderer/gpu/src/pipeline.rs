//! Pipelines. Enters: SPIR-V and the interface reflected from it. Leaves: pipelines with their layouts.

mod compute;
mod graphics;
mod ray_tracing;

use std::sync::Arc;

use ash::vk;

pub use compute::ComputePipeline;
pub use graphics::{ColorTarget, CullMode, GraphicsDesc, GraphicsPipeline};
pub use ray_tracing::{
    HitGroup, MAX_LINKED_PAYLOAD, RayGroup, RayGroupDesc, RayTracingDesc, RayTracingPipeline,
};

use crate::Result;
use crate::context::Device;
use crate::descriptors::SceneLayout;
use crate::error::{Context, GpuError};
use crate::interface::Interface;
use crate::retire::Garbage;

/// A SPIR-V module.
pub struct ShaderModule {
    pub(crate) raw: vk::ShaderModule,
    device: Arc<Device>,
}

impl ShaderModule {
    /// Makes a module of SPIR-V that a compiler has produced.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>, name: &str, spirv: &[u32]) -> Result<Self> {
        let info = vk::ShaderModuleCreateInfo::default().code(spirv);
        // SAFETY: the words come from glslang and were reflected before; destroyed through the retire queue.
        let raw = unsafe { device.raw.create_shader_module(&info, None) }.during("vkCreateShaderModule")?;
        device.set_name(raw, name);
        Ok(Self { raw, device: Arc::clone(device) })
    }
}

impl Drop for ShaderModule {
    fn drop(&mut self) {
        self.device.retire(Garbage::ShaderModule(self.raw));
    }
}

/// Values of boolean and integer specialisation constants, by constant id.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Specialization {
    /// (constant id, value); booleans are 0 or 1.
    pub values: Vec<(u32, u32)>,
}

impl Specialization {
    fn entries(&self) -> Vec<vk::SpecializationMapEntry> {
        let entry = |(i, (id, _)): (usize, &(u32, u32))| vk::SpecializationMapEntry {
            constant_id: *id,
            offset: i as u32 * 4,
            size: 4,
        };
        self.values.iter().enumerate().map(entry).collect()
    }

    fn data(&self) -> Vec<u8> {
        self.values.iter().flat_map(|(_, value)| value.to_ne_bytes()).collect()
    }
}

/// A pipeline with its layout; shared by the three kinds.
pub(crate) struct Raw {
    pub(crate) pipeline: vk::Pipeline,
    pub(crate) layout: Layout,
    pub(crate) interface: Interface,
    pub(crate) name: String,
    device: Arc<Device>,
}

impl Raw {
    fn new(
        device: &Arc<Device>,
        name: &str,
        pipeline: vk::Pipeline,
        layout: Layout,
        interface: &Interface,
    ) -> Self {
        device.set_name(pipeline, name);
        Self {
            pipeline,
            layout,
            interface: interface.clone(),
            name: name.to_owned(),
            device: Arc::clone(device),
        }
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        let sets = std::mem::take(&mut self.layout.own_sets);
        self.device.retire(Garbage::Pipeline(self.pipeline, self.layout.raw, sets));
    }
}

/// A pipeline layout: set 0 is the scene's, set 1 is pushed.
pub(crate) struct Layout {
    pub(crate) raw: vk::PipelineLayout,
    own_sets: Vec<vk::DescriptorSetLayout>,
}

impl Layout {
    fn new(device: &Device, name: &str, scene: Option<&SceneLayout>, interface: &Interface) -> Result<Self> {
        let limit = device.limits().max_push_constants;
        if interface.push_bytes > limit {
            let (asked, limit) = (u64::from(interface.push_bytes), u64::from(limit));
            return Err(GpuError::Limit { what: format!("push constants of {name}"), asked, limit });
        }
        if interface.uses_scene && scene.is_none() {
            let reason = String::from("the shader uses set 0 (the scene), but no scene is bound here");
            return Err(GpuError::Interface { pipeline: name.to_owned(), reason });
        }
        let pushed: Vec<_> = interface
            .bindings
            .iter()
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.binding)
                    .descriptor_type(binding.kind.descriptor())
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::ALL)
            })
            .collect();
        let mut own_sets = Vec::new();
        let mut make = |flags, bindings: &[vk::DescriptorSetLayoutBinding<'_>]| {
            let info = vk::DescriptorSetLayoutCreateInfo::default().flags(flags).bindings(bindings);
            // SAFETY: plain creation; destroyed with the pipeline or below.
            let set = unsafe { device.raw.create_descriptor_set_layout(&info, None) };
            set.inspect(|set| own_sets.push(*set)).during("vkCreateDescriptorSetLayout")
        };
        let set0 = match scene {
            Some(scene) => scene.raw,
            None => make(vk::DescriptorSetLayoutCreateFlags::empty(), &[])?,
        };
        let set1 = make(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR, &pushed)?;
        let sets = [set0, set1];
        let ranges = [vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::ALL,
            offset: 0,
            size: interface.push_bytes.next_multiple_of(4).max(4),
        }];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        if interface.push_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        // SAFETY: the set layouts are alive.
        let raw =
            unsafe { device.raw.create_pipeline_layout(&info, None) }.during("vkCreatePipelineLayout")?;
        Ok(Self { raw, own_sets })
    }
}

/// Runs `create` with the specialisation info of `specialization`.
fn with_specialization<R>(
    specialization: &Specialization,
    create: impl FnOnce(&vk::SpecializationInfo<'_>) -> R,
) -> R {
    let (entries, data) = (specialization.entries(), specialization.data());
    create(&vk::SpecializationInfo::default().map_entries(&entries).data(&data))
}
