//! Textures: texels with a sampler, and how a material uses one.
//! Plain data; knows no image format and no device.

use std::sync::Arc;

use glam::Vec2;
use serde::{Deserialize, Serialize};

use crate::ids::TextureId;

/// How a texture is addressed outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second tile mirrored.
    MirroredRepeat,
    /// The border texel goes on.
    ClampToEdge,
}

/// How a texture is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Sampler {
    /// Addressing in u.
    pub wrap_u: Wrap,
    /// Addressing in v.
    pub wrap_v: Wrap,
    /// Linear (true) or nearest (false) filtering when magnified.
    pub mag_linear: bool,
    /// Linear (true) or nearest (false) filtering when minified.
    pub min_linear: bool,
    /// Linear (true) or nearest (false) choice between mip levels.
    pub mip_linear: bool,
    /// False: only the base level is sampled.
    pub mipmaps: bool,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            mag_linear: true,
            min_linear: true,
            mip_linear: true,
            mipmaps: true,
        }
    }
}

/// An 8-bit RGBA image with its sampler, first row at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Shown in messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height * 4` bytes; shared by textures of the same image.
    pub rgba8: Arc<[u8]>,
    /// True: colours are sRGB encoded (base colour, emissive). False: data.
    pub srgb: bool,
    /// How it is sampled.
    pub sampler: Sampler,
    /// True: the image could not be read and a checker stands in for it.
    pub placeholder: bool,
    /// The PNG or JPEG that it was read from, for exports; `None`: there is none.
    pub encoded: Option<Arc<[u8]>>,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureUse {
    /// Which texture.
    pub texture: TextureId,
    /// 0 or 1: which texture coordinates.
    pub tex_coord: u32,
    /// KHR_texture_transform: offset, in texture units.
    pub offset: Vec2,
    /// KHR_texture_transform: counter-clockwise rotation, radians.
    pub rotation_rad: f32,
    /// KHR_texture_transform: scale.
    pub scale: Vec2,
}

impl TextureUse {
    /// The texture on the first texture coordinates, untransformed.
    pub fn new(texture: TextureId) -> Self {
        Self { texture, tex_coord: 0, offset: Vec2::ZERO, rotation_rad: 0.0, scale: Vec2::ONE }
    }
}
