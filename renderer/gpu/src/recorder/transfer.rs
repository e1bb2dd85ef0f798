//! Uploads by way of staging memory, mip levels, and copies back to the host. Every range is checked first.

use std::ops::Range;

use ash::vk;

use super::{Recorder, Use};
use crate::Result;
use crate::barrier::{Access, Stage};
use crate::buffer::Buffer;
use crate::error::GpuError;
use crate::image::Image;

impl Recorder {
    /// Copies bytes into a buffer by way of staging memory.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when the range lies outside the buffer; [`GpuError::OutOfMemory`].
    pub fn upload(&mut self, target: &Buffer, offset: u64, bytes: &[u8]) -> Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let end = offset.saturating_add(bytes.len() as u64);
        if end > target.size() {
            return Err(GpuError::Limit { what: String::from("upload"), asked: end, limit: target.size() });
        }
        let staged = self.stage(bytes)?;
        self.declare(&[Use::Buffer(target, Stage::Transfer, Access::TransferWrite)]);
        let region =
            [vk::BufferCopy { src_offset: staged.offset, dst_offset: offset, size: bytes.len() as u64 }];
        // SAFETY: both ranges were checked; the staging chunk lives until the frame has finished.
        unsafe { self.device.raw.cmd_copy_buffer(self.command, staged.buffer, target.raw, &region) };
        Ok(())
    }

    /// Puts bytes into host-visible memory that lives until this frame has finished; returns their device address,
    /// 16-byte aligned.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`].
    pub fn stage_bytes(&mut self, bytes: &[u8]) -> Result<u64> {
        Ok(self.stage(bytes)?.address)
    }

    fn stage(&mut self, bytes: &[u8]) -> Result<crate::staging::Staged> {
        match &mut self.parts {
            Some((staging, _)) => staging.stage(bytes),
            None => {
                Err(GpuError::Limit { what: String::from("staging"), asked: bytes.len() as u64, limit: 0 })
            }
        }
    }

    /// Fills the base level of an image from tightly packed texels, makes the other levels by blits, and leaves it
    /// ready to be sampled.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when `texels` is not the size of the image; [`GpuError::OutOfMemory`].
    pub fn upload_image(&mut self, image: &Image, texels: &[u8]) -> Result<()> {
        let [width, height] = image.extent();
        let expected = u64::from(width) * u64::from(height) * image.desc().format.texel_bytes();
        if texels.len() as u64 != expected {
            return Err(GpuError::Limit {
                what: String::from("texels of an image"),
                asked: texels.len() as u64,
                limit: expected,
            });
        }
        let staged = self.stage(texels)?;
        self.declare(&[Use::Image(image, Stage::Transfer, Access::TransferWrite)]);
        let region = [vk::BufferImageCopy::default()
            .buffer_offset(staged.offset)
            .image_subresource(level(image, 0))
            .image_extent(vk::Extent3D { width, height, depth: 1 })];
        // SAFETY: sizes were checked; the staging chunk lives until the frame has finished.
        unsafe {
            self.device.raw.cmd_copy_buffer_to_image(
                self.command,
                staged.buffer,
                image.raw,
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &region,
            );
        }
        self.make_mips(image);
        self.declare(&[Use::Image(image, Stage::AnyShader, Access::Sampled)]);
        Ok(())
    }

    /// Makes every level from the one above it. The levels change layout one by one, which the tracker does not
    /// follow; at the end all are back in the layout it knows.
    fn make_mips(&self, image: &Image) {
        let raw = &self.device.raw;
        let levels = image.desc().mip_levels;
        let step = |base, old, new, source, target| {
            let barrier = [vk::ImageMemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .src_access_mask(source)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .dst_access_mask(target)
                .old_layout(old)
                .new_layout(new)
                .image(image.raw)
                .subresource_range(
                    vk::ImageSubresourceRange::default()
                        .aspect_mask(image.aspect())
                        .base_mip_level(base)
                        .level_count(1)
                        .layer_count(1),
                )];
            // SAFETY: the command buffer is being recorded.
            unsafe {
                raw.cmd_pipeline_barrier2(
                    self.command,
                    &vk::DependencyInfo::default().image_memory_barriers(&barrier),
                );
            }
        };
        let (dst, src) = (vk::ImageLayout::TRANSFER_DST_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        let (write, read) = (vk::AccessFlags2::TRANSFER_WRITE, vk::AccessFlags2::TRANSFER_READ);
        for target in 1..levels {
            step(target - 1, dst, src, write, read);
            let corner = |l: u32| {
                let [width, height] = image.extent();
                [
                    vk::Offset3D::default(),
                    vk::Offset3D { x: (width >> l).max(1) as i32, y: (height >> l).max(1) as i32, z: 1 },
                ]
            };
            let blit = [vk::ImageBlit {
                src_subresource: level(image, target - 1),
                src_offsets: corner(target - 1),
                dst_subresource: level(image, target),
                dst_offsets: corner(target),
            }];
            // SAFETY: both levels exist and are in the layouts named.
            unsafe {
                raw.cmd_blit_image(self.command, image.raw, src, image.raw, dst, &blit, vk::Filter::LINEAR)
            };
        }
        for source in 0..levels.saturating_sub(1) {
            step(source, src, dst, read, write);
        }
    }

    /// Copies a rectangle of an image into a buffer, tightly packed from `target_offset` on.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when the rectangle lies outside the image or the buffer is too small.
    pub fn copy_to_buffer(
        &mut self,
        image: &Image,
        origin: [u32; 2],
        extent: [u32; 2],
        target: &Buffer,
        target_offset: u64,
    ) -> Result<()> {
        let inside =
            (0..2).all(|i| origin[i].checked_add(extent[i]).is_some_and(|end| end <= image.extent()[i]));
        let bytes = u64::from(extent[0]) * u64::from(extent[1]) * image.desc().format.texel_bytes();
        if !inside || bytes.saturating_add(target_offset) > target.size() {
            return Err(GpuError::Limit {
                what: String::from("read-back"),
                asked: bytes,
                limit: target.size(),
            });
        }
        self.declare(&[
            Use::Image(image, Stage::Transfer, Access::TransferRead),
            Use::Buffer(target, Stage::Transfer, Access::TransferWrite),
        ]);
        let region = [vk::BufferImageCopy::default()
            .buffer_offset(target_offset)
            .image_subresource(level(image, 0))
            .image_offset(vk::Offset3D { x: origin[0] as i32, y: origin[1] as i32, z: 0 })
            .image_extent(vk::Extent3D { width: extent[0], height: extent[1], depth: 1 })];
        // SAFETY: the rectangle and the size were checked.
        unsafe {
            self.device.raw.cmd_copy_image_to_buffer(
                self.command,
                image.raw,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                target.raw,
                &region,
            );
        }
        self.declare(&[Use::Buffer(target, Stage::Host, Access::HostRead)]);
        Ok(())
    }

    /// Copies the first `size` bytes of a buffer into another.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when a buffer is too small.
    pub fn copy_buffer(&mut self, source: &Buffer, target: &Buffer, size: u64) -> Result<()> {
        let limit = source.size().min(target.size());
        if size > limit {
            return Err(GpuError::Limit { what: String::from("buffer copy"), asked: size, limit });
        }
        self.declare(&[
            Use::Buffer(source, Stage::Transfer, Access::TransferRead),
            Use::Buffer(target, Stage::Transfer, Access::TransferWrite),
        ]);
        let region = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size }];
        // SAFETY: the sizes were checked.
        unsafe { self.device.raw.cmd_copy_buffer(self.command, source.raw, target.raw, &region) };
        self.declare(&[Use::Buffer(target, Stage::Host, Access::HostRead)]);
        Ok(())
    }

    /// Sets a range of a buffer to zero, as far as the buffer goes; its ends are multiples of 4.
    pub fn clear_buffer(&mut self, target: &Buffer, bytes: Range<u64>) {
        self.declare(&[Use::Buffer(target, Stage::Transfer, Access::TransferWrite)]);
        let end = bytes.end.min(target.size());
        if bytes.start >= end {
            return;
        }
        // SAFETY: the range lies in the buffer and is not empty.
        unsafe {
            self.device.raw.cmd_fill_buffer(self.command, target.raw, bytes.start, end - bytes.start, 0);
        }
    }
}

fn level(image: &Image, mip_level: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers { aspect_mask: image.aspect(), mip_level, base_array_layer: 0, layer_count: 1 }
}
