//! Binding by name: what a pipeline's interface asks for is found among what the host gives, or refused in words.

use ash::vk;

use super::{Recorder, Use};
use crate::Result;
use crate::barrier::{Stage, layout_of};
use crate::descriptors::SceneSet;
use crate::error::GpuError;
use crate::interface::{Bind, BindingKind};
use crate::pipeline::Raw;

impl Recorder {
    #[expect(clippy::too_many_arguments, reason = "private: the shared half of dispatch and trace_rays")]
    pub(super) fn bind(
        &mut self,
        pipeline: &Raw,
        point: vk::PipelineBindPoint,
        stage: Stage,
        scene: Option<&SceneSet>,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        push: &[u8],
    ) -> Result<()> {
        let mut all = self.uses_of(pipeline, stage, binds)?;
        all.extend_from_slice(uses);
        self.declare(&all);
        self.bind_sets(pipeline, point, scene, binds)?;
        self.push_constants(pipeline, push)
    }

    /// The uses that a pipeline's bindings imply; checks that each one is given and of the right kind.
    pub(super) fn uses_of<'a>(
        &self,
        pipeline: &Raw,
        stage: Stage,
        binds: &[(&str, Bind<'a>)],
    ) -> Result<Vec<Use<'a>>> {
        let find = |name: &str| binds.iter().find(|(n, _)| *n == name).map(|(_, bind)| *bind);
        let mut uses = Vec::new();
        for binding in &pipeline.interface.bindings {
            let refuse = |reason: String| GpuError::Interface { pipeline: pipeline.name.clone(), reason };
            let bind = find(&binding.name).ok_or_else(|| {
                let known: Vec<_> = binds.iter().map(|(name, _)| *name).collect();
                refuse(format!("the shader binds '{}', the host offers {}", binding.name, known.join(", ")))
            })?;
            let access = binding.kind.access();
            uses.push(match (binding.kind, bind) {
                (BindingKind::SampledImage | BindingKind::StorageImage(_), Bind::Image(image)) => {
                    Use::Image(image, stage, access)
                }
                (BindingKind::CombinedImage, Bind::Combined(image, _)) => Use::Image(image, stage, access),
                (BindingKind::StorageBuffer(_), Bind::Buffer(buffer)) => Use::Buffer(buffer, stage, access),
                (BindingKind::AccelStructure, Bind::Accel(_)) => continue,
                (kind, _) => return Err(refuse(format!("'{}' is declared as {kind:?}", binding.name))),
            });
        }
        Ok(uses)
    }

    pub(super) fn bind_sets(
        &self,
        pipeline: &Raw,
        point: vk::PipelineBindPoint,
        scene: Option<&SceneSet>,
        binds: &[(&str, Bind<'_>)],
    ) -> Result<()> {
        let raw = &self.device.raw;
        // SAFETY: the pipeline is alive and retires late.
        unsafe { raw.cmd_bind_pipeline(self.command, point, pipeline.pipeline) };
        if pipeline.interface.uses_scene {
            let scene = scene.ok_or_else(|| GpuError::Interface {
                pipeline: pipeline.name.clone(),
                reason: String::from("the shader uses the scene, but none was given"),
            })?;
            // SAFETY: set and layout are alive and compatible: the pipeline was made with this set's layout.
            unsafe {
                raw.cmd_bind_descriptor_sets(self.command, point, pipeline.layout.raw, 0, &[scene.set], &[])
            };
        }
        self.push_descriptors(pipeline, point, binds);
        Ok(())
    }

    pub(super) fn push_descriptors(
        &self,
        pipeline: &Raw,
        point: vk::PipelineBindPoint,
        binds: &[(&str, Bind<'_>)],
    ) {
        let bindings = &pipeline.interface.bindings;
        let mut images = Vec::with_capacity(bindings.len());
        let mut buffers = Vec::with_capacity(bindings.len());
        let mut accels = Vec::with_capacity(bindings.len());
        let mut order = Vec::with_capacity(bindings.len());
        for binding in bindings {
            let Some((_, bind)) = binds.iter().find(|(name, _)| *name == binding.name) else { continue };
            let layout = layout_of(binding.kind.access());
            match bind {
                Bind::Image(image) => images.push([vk::DescriptorImageInfo {
                    sampler: vk::Sampler::null(),
                    image_view: image.view,
                    image_layout: layout,
                }]),
                Bind::Combined(image, sampler) => images.push([vk::DescriptorImageInfo {
                    sampler: sampler.raw,
                    image_view: image.view,
                    image_layout: layout,
                }]),
                Bind::Buffer(buffer) => buffers.push([vk::DescriptorBufferInfo {
                    buffer: buffer.raw,
                    offset: 0,
                    range: vk::WHOLE_SIZE,
                }]),
                Bind::Accel(accel) => accels.push([accel.raw]),
            }
            order.push((binding, bind));
        }
        let mut accel_writes: Vec<_> = accels
            .iter()
            .map(|handles| {
                vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(handles)
            })
            .collect();
        let (mut image_infos, mut buffer_infos, mut accel_infos) =
            (images.iter(), buffers.iter(), accel_writes.iter_mut());
        let mut writes = Vec::with_capacity(order.len());
        for (binding, bind) in order {
            let mut write = vk::WriteDescriptorSet::default()
                .dst_binding(binding.binding)
                .descriptor_type(binding.kind.descriptor())
                .descriptor_count(1);
            write = match bind {
                Bind::Image(_) | Bind::Combined(..) => {
                    image_infos.next().map_or(write, |info| write.image_info(info))
                }
                Bind::Buffer(_) => buffer_infos.next().map_or(write, |info| write.buffer_info(info)),
                Bind::Accel(_) => accel_infos.next().map_or(write, |info| write.push_next(info)),
            };
            writes.push(write);
        }
        if !writes.is_empty() {
            // SAFETY: every handle is alive; kinds were checked against the reflected interface.
            unsafe {
                self.device.push_fns.cmd_push_descriptor_set(
                    self.command,
                    point,
                    pipeline.layout.raw,
                    1,
                    &writes,
                );
            }
        }
    }

    pub(super) fn push_constants(&self, pipeline: &Raw, push: &[u8]) -> Result<()> {
        let expected = pipeline.interface.push_bytes as usize;
        if push.len() < expected {
            return Err(GpuError::Interface {
                pipeline: pipeline.name.clone(),
                reason: format!(
                    "the shader reads {expected} bytes of push constants, the host gives {}",
                    push.len()
                ),
            });
        }
        if expected > 0 {
            let range = expected.next_multiple_of(4).min(push.len());
            // SAFETY: the range is that of the layout.
            unsafe {
                self.device.raw.cmd_push_constants(
                    self.command,
                    pipeline.layout.raw,
                    vk::ShaderStageFlags::ALL,
                    0,
                    &push[..range],
                );
            }
        }
        Ok(())
    }
}
