//! 2D images with their memory and view.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;

use crate::Result;
use crate::barrier::ResourceId;
use crate::context::Device;
use crate::error::{Context, GpuError};
use crate::memory::{Memory, MemoryUse};
use crate::retire::Garbage;

/// Formats in use. Names are channels and bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// 8-bit unsigned normalised RGBA.
    Rgba8Unorm,
    /// 8-bit sRGB-encoded RGB with linear alpha.
    Rgba8Srgb,
    /// Half-float RGBA.
    Rgba16Float,
    /// Float RGBA.
    Rgba32Float,
    /// Half-float RG.
    Rg16Float,
    /// Float RG.
    Rg32Float,
    /// Float R.
    R32Float,
    /// Unsigned integer RG.
    Rg32Uint,
    /// Unsigned integer RGBA.
    Rgba32Uint,
    /// Unsigned integer R.
    R32Uint,
    /// Float depth.
    Depth32,
}

impl Format {
    /// Whether its texels are unsigned integers, and not floating-point numbers to a shader.
    pub fn is_uint(self) -> bool {
        matches!(self, Self::Rg32Uint | Self::Rgba32Uint | Self::R32Uint)
    }

    pub(crate) fn raw(self) -> vk::Format {
        match self {
            Self::Rgba8Unorm => vk::Format::R8G8B8A8_UNORM,
            Self::Rgba8Srgb => vk::Format::R8G8B8A8_SRGB,
            Self::Rgba16Float => vk::Format::R16G16B16A16_SFLOAT,
            Self::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
            Self::Rg16Float => vk::Format::R16G16_SFLOAT,
            Self::Rg32Float => vk::Format::R32G32_SFLOAT,
            Self::R32Float => vk::Format::R32_SFLOAT,
            Self::Rg32Uint => vk::Format::R32G32_UINT,
            Self::Rgba32Uint => vk::Format::R32G32B32A32_UINT,
            Self::R32Uint => vk::Format::R32_UINT,
            Self::Depth32 => vk::Format::D32_SFLOAT,
        }
    }

    /// Bytes of a texel.
    pub fn texel_bytes(self) -> u64 {
        match self {
            Self::Rgba8Unorm
            | Self::Rgba8Srgb
            | Self::Rg16Float
            | Self::R32Float
            | Self::R32Uint
            | Self::Depth32 => 4,
            Self::Rgba16Float | Self::Rg32Float | Self::Rg32Uint => 8,
            Self::Rgba32Float | Self::Rgba32Uint => 16,
        }
    }
}

/// What an image is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageUse {
    /// Sampled, with mip levels made by blits.
    Texture,
    /// Rendered to, stored to, fetched, copied from.
    Target,
    /// Depth buffer, fetched and copied from.
    Depth,
}

/// Size and kind of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageDesc {
    /// Columns and rows.
    pub extent: [u32; 2],
    /// Format.
    pub format: Format,
    /// Levels, 1 for none but the base.
    pub mip_levels: u32,
    /// What it is for.
    pub usage: ImageUse,
}

/// A 2D image.
pub struct Image {
    pub(crate) raw: vk::Image,
    pub(crate) view: vk::ImageView,
    memory: Option<Memory>,
    desc: ImageDesc,
    id: ResourceId,
    device: Arc<Device>,
}

impl Image {
    /// Makes an image; its content is undefined.
    ///
    /// # Errors
    /// [`GpuError::Limit`] when it is too large, [`GpuError::OutOfMemory`], other refusals of the driver.
    pub fn new(device: &Arc<Device>, name: &str, desc: ImageDesc) -> Result<Self> {
        let limit = device.limits().max_image_extent;
        let [width, height] = desc.extent;
        if width.max(height) > limit || width.min(height) == 0 {
            let asked = u64::from(width.max(height));
            return Err(GpuError::Limit { what: format!("image {name}"), asked, limit: u64::from(limit) });
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format.raw())
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(desc.mip_levels)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage_flags(desc.usage));
        // SAFETY: plain creation; destroyed through the retire queue.
        let raw = unsafe { device.raw.create_image(&info, None) }.during("vkCreateImage")?;
        // SAFETY: `raw` was just made.
        let requirements = unsafe { device.raw.get_image_memory_requirements(raw) };
        let kind = if desc.usage == ImageUse::Texture { MemoryUse::Textures } else { MemoryUse::Targets };
        let memory = match device.allocate(name, requirements, MemoryLocation::GpuOnly, false, kind) {
            Ok(memory) => memory,
            Err(error) => {
                // SAFETY: never used.
                unsafe { device.raw.destroy_image(raw, None) };
                return Err(error);
            }
        };
        match bind_and_view(device, raw, &memory, desc) {
            Ok(view) => {
                device.set_name(raw, name);
                device.set_name(view, name);
                let id = device.new_resource_id();
                Ok(Self { raw, view, memory: Some(memory), desc, id, device: Arc::clone(device) })
            }
            Err(error) => {
                // SAFETY: never used.
                unsafe { device.raw.destroy_image(raw, None) };
                device.free(memory);
                Err(error)
            }
        }
    }

    /// Size and kind.
    pub fn desc(&self) -> &ImageDesc {
        &self.desc
    }

    /// Columns and rows.
    pub fn extent(&self) -> [u32; 2] {
        self.desc.extent
    }

    /// Its number in the barrier tracker.
    pub fn id(&self) -> ResourceId {
        self.id
    }

    /// The raw view, for the one user-interface renderer that takes raw handles.
    pub fn raw_view(&self) -> vk::ImageView {
        self.view
    }

    pub(crate) fn aspect(&self) -> vk::ImageAspectFlags {
        aspect_of(self.desc.usage)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        if let Some(memory) = self.memory.take() {
            self.device.retire(Garbage::Image(self.raw, vec![self.view], memory, self.id));
        }
    }
}

fn bind_and_view(device: &Device, raw: vk::Image, memory: &Memory, desc: ImageDesc) -> Result<vk::ImageView> {
    // SAFETY: the allocation was made for this image's requirements and is not bound to anything else.
    unsafe { device.raw.bind_image_memory(raw, memory.allocation.memory(), memory.allocation.offset()) }
        .during("vkBindImageMemory")?;
    let info = vk::ImageViewCreateInfo::default()
        .image(raw)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(desc.format.raw())
        .subresource_range(
            vk::ImageSubresourceRange::default()
                .aspect_mask(aspect_of(desc.usage))
                .level_count(desc.mip_levels)
                .layer_count(1),
        );
    // SAFETY: the image is bound and alive.
    unsafe { device.raw.create_image_view(&info, None) }.during("vkCreateImageView")
}

fn aspect_of(usage: ImageUse) -> vk::ImageAspectFlags {
    if usage == ImageUse::Depth { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR }
}

fn usage_flags(usage: ImageUse) -> vk::ImageUsageFlags {
    use vk::ImageUsageFlags as F;
    let common = F::SAMPLED | F::TRANSFER_SRC | F::TRANSFER_DST;
    match usage {
        ImageUse::Texture => common,
        ImageUse::Target => common | F::STORAGE | F::COLOR_ATTACHMENT,
        ImageUse::Depth => common | F::DEPTH_STENCIL_ATTACHMENT,
    }
}
