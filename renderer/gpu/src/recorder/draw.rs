//! Drawing: targets are cleared and filled in one scope, several pipelines one after the other.

use ash::vk;

use super::{Draw, Recorder, Use};
use crate::Result;
use crate::barrier::{Access, Stage, layout_of};
use crate::descriptors::SceneSet;
use crate::image::Image;
use crate::interface::Bind;
use crate::pipeline::{CullMode, GraphicsPipeline, Raw};

impl Recorder {
    /// Draws into cleared targets: colours to 0, depth to 0 (infinitely far in reverse depth).
    ///
    /// # Errors
    /// [`crate::GpuError::Interface`] when `binds` and the shader disagree.
    #[expect(
        clippy::too_many_arguments,
        reason = "one call a raster pass; a struct would only rename the arguments"
    )]
    pub fn draw(
        &mut self,
        pipelines: &[(&GraphicsPipeline, &[Draw<'_>])],
        scene: Option<&SceneSet>,
        binds: &[(&str, Bind<'_>)],
        uses: &[Use<'_>],
        colors: &[&Image],
        depth: Option<&Image>,
        extent: [u32; 2],
    ) -> Result<()> {
        let mut all: Vec<Use<'_>> = uses.to_vec();
        all.extend(colors.iter().map(|image| Use::Image(image, Stage::Raster, Access::ColorAttachment)));
        all.extend(depth.map(|image| Use::Image(image, Stage::Raster, Access::DepthAttachment)));
        for (pipeline, draws) in pipelines {
            let indices = draws.iter().filter_map(|draw| draw.indices);
            all.extend(indices.map(|buffer| Use::Buffer(buffer, Stage::Raster, Access::IndexRead)));
            all.extend(self.uses_of(&pipeline.raw, Stage::Raster, binds)?);
        }
        self.declare(&all);
        self.begin_rendering(colors, depth, extent);
        let result = pipelines.iter().try_for_each(|(pipeline, draws)| {
            self.bind_sets(&pipeline.raw, vk::PipelineBindPoint::GRAPHICS, scene, binds)?;
            draws.iter().try_for_each(|draw| self.draw_one(&pipeline.raw, draw))
        });
        // SAFETY: closes the scope opened above.
        unsafe { self.device.raw.cmd_end_rendering(self.command) };
        result
    }

    fn begin_rendering(&self, colors: &[&Image], depth: Option<&Image>, extent: [u32; 2]) {
        let attachment = |image: &Image, layout| {
            vk::RenderingAttachmentInfo::default()
                .image_view(image.view)
                .image_layout(layout)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
        };
        let color_infos: Vec<_> =
            colors.iter().map(|image| attachment(image, layout_of(Access::ColorAttachment))).collect();
        let depth_info = depth.map(|image| attachment(image, layout_of(Access::DepthAttachment)));
        let area = vk::Rect2D::default().extent(vk::Extent2D { width: extent[0], height: extent[1] });
        let mut info =
            vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color_infos);
        if let Some(depth) = &depth_info {
            info = info.depth_attachment(depth);
        }
        // The matrices turn y over, as Vulkan wants it.
        let viewport = [vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: extent[0] as f32,
            height: extent[1] as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        }];
        let raw = &self.device.raw;
        // SAFETY: the targets are alive and in the layouts named; the command buffer is being recorded.
        unsafe {
            raw.cmd_begin_rendering(self.command, &info);
            raw.cmd_set_viewport(self.command, 0, &viewport);
            raw.cmd_set_scissor(self.command, 0, &[area]);
        }
    }

    fn draw_one(&self, pipeline: &Raw, draw: &Draw<'_>) -> Result<()> {
        self.push_constants(pipeline, draw.push)?;
        let raw = &self.device.raw;
        let cull = match draw.cull {
            CullMode::None => vk::CullModeFlags::NONE,
            CullMode::Back => vk::CullModeFlags::BACK,
        };
        let front = if draw.clockwise { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE };
        // SAFETY: pipeline and sets are bound; the index range lies inside the buffer, which import has checked.
        unsafe {
            raw.cmd_set_cull_mode(self.command, cull);
            raw.cmd_set_front_face(self.command, front);
            let (count, first) = (draw.index_count, draw.first_index);
            if let Some(indices) = draw.indices {
                raw.cmd_bind_index_buffer(self.command, indices.raw, 0, vk::IndexType::UINT32);
                raw.cmd_draw_indexed(self.command, count, draw.instance_count, first, 0, draw.first_instance);
            } else {
                raw.cmd_draw(self.command, count, draw.instance_count, first, draw.first_instance);
            }
        }
        Ok(())
    }
}
