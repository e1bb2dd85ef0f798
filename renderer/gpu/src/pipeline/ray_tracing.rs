//! Ray-tracing pipelines with their shader binding table. Recursion depth is 1: ray generation traces.

use std::sync::Arc;

use ash::vk;

use super::{Layout, Raw, ShaderModule, Specialization, with_specialization};
use crate::Result;
use crate::context::Device;
use crate::descriptors::SceneLayout;
use crate::error::Context;
use crate::interface::Interface;
use crate::sbt::BindingTable;

/// The shaders of one ray kind and geometry kind.
#[derive(Clone, Copy, Default)]
pub struct HitGroup<'a> {
    /// Closest hit, if any.
    pub closest_hit: Option<&'a ShaderModule>,
    /// Any hit, if any.
    pub any_hit: Option<&'a ShaderModule>,
    /// Intersection: the group is for AABBs.
    pub intersection: Option<&'a ShaderModule>,
}

/// What a ray-tracing pipeline is made of.
pub struct RayTracingDesc<'a> {
    /// Name in messages.
    pub name: &'a str,
    /// Ray generation.
    pub ray_generation: &'a ShaderModule,
    /// Miss shaders, in order of the ray kinds.
    pub misses: &'a [&'a ShaderModule],
    /// Hit groups, in order of the ray kinds.
    pub hit_groups: &'a [HitGroup<'a>],
}

/// Most bytes of a payload in a pipeline that is linked of groups.
pub const MAX_LINKED_PAYLOAD: u32 = 64;
/// Most bytes of a hit attribute there: two floats, as triangles have.
const MAX_LINKED_ATTRIBUTE: u32 = 8;

/// The stages of one group.
#[derive(Clone, Copy)]
pub enum RayGroupDesc<'a> {
    /// Ray generation.
    Generation(&'a ShaderModule),
    /// Miss.
    Miss(&'a ShaderModule),
    /// What is hit.
    Hit(HitGroup<'a>),
}

/// One group of a ray-tracing pipeline, compiled by itself (VK_KHR_pipeline_library): when another group is edited, this one is
/// linked again and not compiled.
pub struct RayGroup {
    raw: Raw,
}

impl RayGroup {
    /// Compiles a group. `interface`: of the whole pipeline.
    ///
    /// # Errors
    /// As [`RayTracingPipeline::new`].
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        desc: RayGroupDesc<'_>,
        interface: &Interface,
        specialization: &Specialization,
        scene: Option<&SceneLayout>,
    ) -> Result<Self> {
        let layout = Layout::new(device, name, scene, interface)?;
        let created = with_specialization(specialization, |info| {
            let mut groups = Groups { stages: Vec::new(), groups: Vec::new(), specialization: info };
            match desc {
                RayGroupDesc::Generation(module) => groups.general(vk::ShaderStageFlags::RAYGEN_KHR, module),
                RayGroupDesc::Miss(module) => groups.general(vk::ShaderStageFlags::MISS_KHR, module),
                RayGroupDesc::Hit(hit) => groups.hit(&hit),
            }
            create_of(device, &groups, vk::PipelineCreateFlags::LIBRARY_KHR, &[], &layout)
        });
        let pipeline = created.map_err(|(_, error)| error).during("vkCreateRayTracingPipelinesKHR")?[0];
        Ok(Self { raw: Raw::new(device, name, pipeline, layout, interface) })
    }
}

/// A ray-tracing pipeline.
pub struct RayTracingPipeline {
    pub(crate) raw: Raw,
    pub(crate) table: BindingTable,
    _groups: Vec<Arc<RayGroup>>,
}

impl RayTracingPipeline {
    /// Makes a ray-tracing pipeline and its binding table.
    ///
    /// # Errors
    /// [`crate::GpuError::Interface`] when a shader uses what is not bound; refusals of the driver.
    pub fn new(
        device: &Arc<Device>,
        desc: &RayTracingDesc<'_>,
        interface: &Interface,
        specialization: &Specialization,
        scene: Option<&SceneLayout>,
    ) -> Result<Self> {
        let layout = Layout::new(device, desc.name, scene, interface)?;
        let created = with_specialization(specialization, |info| create(device, desc, info, &layout));
        let pipeline = created.map_err(|(_, error)| error).during("vkCreateRayTracingPipelinesKHR")?[0];
        let raw = Raw::new(device, desc.name, pipeline, layout, interface);
        let counts = [desc.misses.len() as u32, desc.hit_groups.len() as u32];
        let table = BindingTable::new(device, desc.name, pipeline, counts[0], counts[1])?;
        Ok(Self { raw, table, _groups: Vec::new() })
    }

    /// Links groups that were compiled with this interface: ray generation, `misses` misses, then what is hit.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn link(
        device: &Arc<Device>,
        name: &str,
        groups: Vec<Arc<RayGroup>>,
        misses: u32,
        interface: &Interface,
        scene: Option<&SceneLayout>,
    ) -> Result<Self> {
        let layout = Layout::new(device, name, scene, interface)?;
        let raws: Vec<vk::Pipeline> = groups.iter().map(|group| group.raw.pipeline).collect();
        let none = vk::SpecializationInfo::default();
        let own = Groups { stages: Vec::new(), groups: Vec::new(), specialization: &none };
        let created = create_of(device, &own, vk::PipelineCreateFlags::empty(), &raws, &layout);
        let pipeline = created.map_err(|(_, error)| error).during("vkCreateRayTracingPipelinesKHR")?[0];
        let raw = Raw::new(device, name, pipeline, layout, interface);
        let hits = (groups.len() as u32).saturating_sub(1 + misses);
        let table = BindingTable::new(device, name, pipeline, misses, hits)?;
        Ok(Self { raw, table, _groups: groups })
    }

    /// What it binds.
    pub fn interface(&self) -> &Interface {
        &self.raw.interface
    }
}

/// Collects stages and groups.
struct Groups<'a> {
    stages: Vec<vk::PipelineShaderStageCreateInfo<'a>>,
    groups: Vec<vk::RayTracingShaderGroupCreateInfoKHR<'a>>,
    specialization: &'a vk::SpecializationInfo<'a>,
}

impl<'a> Groups<'a> {
    fn stage(&mut self, stage: vk::ShaderStageFlags, module: Option<&ShaderModule>) -> u32 {
        let Some(module) = module else {
            return vk::SHADER_UNUSED_KHR;
        };
        self.stages.push(
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage)
                .module(module.raw)
                .name(c"main")
                .specialization_info(self.specialization),
        );
        self.stages.len() as u32 - 1
    }

    fn general(&mut self, stage: vk::ShaderStageFlags, module: &ShaderModule) {
        let index = self.stage(stage, Some(module));
        self.groups.push(empty_group(vk::RayTracingShaderGroupTypeKHR::GENERAL).general_shader(index));
    }

    fn hit(&mut self, hit: &HitGroup<'_>) {
        let closest = self.stage(vk::ShaderStageFlags::CLOSEST_HIT_KHR, hit.closest_hit);
        let any = self.stage(vk::ShaderStageFlags::ANY_HIT_KHR, hit.any_hit);
        let intersection = self.stage(vk::ShaderStageFlags::INTERSECTION_KHR, hit.intersection);
        let kind = if hit.intersection.is_some() {
            vk::RayTracingShaderGroupTypeKHR::PROCEDURAL_HIT_GROUP
        } else {
            vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP
        };
        self.groups.push(
            empty_group(kind)
                .closest_hit_shader(closest)
                .any_hit_shader(any)
                .intersection_shader(intersection),
        );
    }
}

fn empty_group<'a>(kind: vk::RayTracingShaderGroupTypeKHR) -> vk::RayTracingShaderGroupCreateInfoKHR<'a> {
    vk::RayTracingShaderGroupCreateInfoKHR::default()
        .ty(kind)
        .general_shader(vk::SHADER_UNUSED_KHR)
        .closest_hit_shader(vk::SHADER_UNUSED_KHR)
        .any_hit_shader(vk::SHADER_UNUSED_KHR)
        .intersection_shader(vk::SHADER_UNUSED_KHR)
}

fn create(
    device: &Device,
    desc: &RayTracingDesc<'_>,
    specialization: &vk::SpecializationInfo<'_>,
    layout: &Layout,
) -> std::result::Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)> {
    let mut collected = Groups { stages: Vec::new(), groups: Vec::new(), specialization };
    collected.general(vk::ShaderStageFlags::RAYGEN_KHR, desc.ray_generation);
    for miss in desc.misses {
        collected.general(vk::ShaderStageFlags::MISS_KHR, miss);
    }
    for hit in desc.hit_groups {
        collected.hit(hit);
    }
    create_of(device, &collected, vk::PipelineCreateFlags::empty(), &[], layout)
}

/// `libraries`: pipelines of single groups that follow those in `groups`.
fn create_of(
    device: &Device,
    groups: &Groups<'_>,
    flags: vk::PipelineCreateFlags,
    libraries: &[vk::Pipeline],
    layout: &Layout,
) -> std::result::Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)> {
    let interface = vk::RayTracingPipelineInterfaceCreateInfoKHR::default()
        .max_pipeline_ray_payload_size(MAX_LINKED_PAYLOAD)
        .max_pipeline_ray_hit_attribute_size(MAX_LINKED_ATTRIBUTE);
    let linked = vk::PipelineLibraryCreateInfoKHR::default().libraries(libraries);
    let mut info = vk::RayTracingPipelineCreateInfoKHR::default()
        .flags(flags)
        .stages(&groups.stages)
        .groups(&groups.groups)
        .max_pipeline_ray_recursion_depth(1)
        .layout(layout.raw);
    if !libraries.is_empty() || flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR) {
        info = info.library_interface(&interface);
    }
    if !libraries.is_empty() {
        info = info.library_info(&linked);
    }
    let null = vk::DeferredOperationKHR::null();
    // SAFETY: modules, libraries, layout and every pointer live until the call returns; the interface was reflected.
    unsafe { device.rt_fns.create_ray_tracing_pipelines(null, device.cache(), &[info], None) }
}
