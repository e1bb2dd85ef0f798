//! Samplers.

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::context::Device;
use crate::error::Context;
use crate::retire::Garbage;

/// How texels are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The nearest one.
    Nearest,
    /// Weighted by distance.
    Linear,
}

/// What lies outside 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WrapMode {
    /// Tiles.
    Repeat,
    /// Tiles, every second one mirrored.
    MirroredRepeat,
    /// The border texel goes on.
    ClampToEdge,
}

/// Settings of a sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SamplerDesc {
    /// When magnified.
    pub mag: Filter,
    /// When minified.
    pub min: Filter,
    /// Between mip levels.
    pub mip: Filter,
    /// False: the base level alone.
    pub mipmaps: bool,
    /// In u and v.
    pub wrap: [WrapMode; 2],
    /// Largest anisotropy; 1: none. Cut to the device's limit.
    pub anisotropy: u8,
}

/// A sampler.
pub struct Sampler {
    pub(crate) raw: vk::Sampler,
    device: Arc<Device>,
}

impl Sampler {
    /// Makes a sampler.
    ///
    /// # Errors
    /// When the driver refuses.
    pub fn new(device: &Arc<Device>, desc: SamplerDesc) -> Result<Self> {
        let filter = |f| if f == Filter::Linear { vk::Filter::LINEAR } else { vk::Filter::NEAREST };
        let wrap = |w| match w {
            WrapMode::Repeat => vk::SamplerAddressMode::REPEAT,
            WrapMode::MirroredRepeat => vk::SamplerAddressMode::MIRRORED_REPEAT,
            WrapMode::ClampToEdge => vk::SamplerAddressMode::CLAMP_TO_EDGE,
        };
        let anisotropy = f32::from(desc.anisotropy).min(device.limits().max_anisotropy);
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter(desc.mag))
            .min_filter(filter(desc.min))
            .mipmap_mode(match desc.mip {
                Filter::Linear => vk::SamplerMipmapMode::LINEAR,
                Filter::Nearest => vk::SamplerMipmapMode::NEAREST,
            })
            .address_mode_u(wrap(desc.wrap[0]))
            .address_mode_v(wrap(desc.wrap[1]))
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .anisotropy_enable(anisotropy > 1.0 && desc.min == Filter::Linear)
            .max_anisotropy(anisotropy)
            .max_lod(if desc.mipmaps { vk::LOD_CLAMP_NONE } else { 0.0 });
        // SAFETY: plain creation; destroyed through the retire queue.
        let raw = unsafe { device.raw.create_sampler(&info, None) }.during("vkCreateSampler")?;
        Ok(Self { raw, device: Arc::clone(device) })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        self.device.retire(Garbage::Sampler(self.raw));
    }
}
