//! Materials and the textures that they use.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::{Lobes, TextureId};

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

/// An 8-bit RGBA image, first row at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Shown in messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba8: Arc<[u8]>,
    /// True: colours are sRGB encoded (base colour, emissive). False: data.
    pub srgb: bool,
    /// How it is sampled.
    pub sampler: Sampler,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// How a surface answers light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ShadingMode {
    /// glTF 2.0, appendix B.
    #[default]
    Pbr,
    /// A perfect mirror tinted by the base colour.
    Reflective,
    /// Smooth glass: exact dielectric Fresnel, tinted by base colour and volume attenuation.
    Refractive,
    /// Base colour as emitted radiance, no lighting (KHR_materials_unlit).
    Unlit,
}

/// glTF alpha modes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Holes where alpha is below the cutoff.
    Mask {
        /// The cutoff.
        cutoff: f32,
    },
    /// Alpha is coverage.
    Blend,
}

/// A material: factors times textures.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Shading mode.
    pub mode: ShadingMode,
    /// Linear base colour with alpha.
    pub base_color: Vec4,
    /// Base colour texture (sRGB) with alpha.
    pub base_color_texture: Option<TextureUse>,
    /// Metalness, 0..1.
    pub metallic: f32,
    /// Perceptual roughness, 0..1; alpha of GGX is its square.
    pub roughness: f32,
    /// Green: roughness, blue: metalness.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Tangent-space normal map.
    pub normal_texture: Option<TextureUse>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Red: ambient occlusion (acts on ambient light without occlusion rays only).
    pub occlusion_texture: Option<TextureUse>,
    /// Strength of the occlusion texture, 0..1.
    pub occlusion_strength: f32,
    /// Emitted radiance (factor times KHR strength), nits taken as radiance 1:1.
    pub emissive: Vec3,
    /// Emissive texture (sRGB).
    pub emissive_texture: Option<TextureUse>,
    /// Index of refraction, at least 1.
    pub ior: f32,
    /// Strength of the dielectric specular lobe, 0..1 (KHR_materials_specular).
    pub specular: f32,
    /// Tint of the dielectric F0 (KHR_materials_specular).
    pub specular_color: Vec3,
    /// Share of transmitted light, 0..1 (KHR_materials_transmission).
    pub transmission: f32,
    /// True when light crosses a volume (KHR_materials_volume, thickness above 0); false: a thin sheet that does not bend light.
    pub has_volume: bool,
    /// Where volumes overlap, the one with the higher number is there; equal: the one entered last.
    pub volume_priority: u8,
    /// Colour that white light has after `attenuation_distance_m`.
    pub attenuation_color: Vec3,
    /// Distance of the above in metres; infinity: no attenuation.
    pub attenuation_distance_m: f32,
    /// Lobes beside these, and textures that few materials have.
    pub lobes: Option<Box<Lobes>>,
    /// Alpha mode.
    pub alpha: AlphaMode,
    /// Whether the back of a triangle is drawn.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            mode: ShadingMode::Pbr,
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
            has_volume: false,
            volume_priority: 0,
            attenuation_color: Vec3::ONE,
            attenuation_distance_m: f32::INFINITY,
            lobes: None,
            alpha: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

impl Material {
    /// Every texture that the material uses.
    pub fn textures(&self) -> impl Iterator<Item = &TextureUse> {
        let own = [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.occlusion_texture,
            &self.emissive_texture,
        ];
        own.into_iter().chain(self.lobes.iter().flat_map(|lobes| lobes.textures())).flatten()
    }
}
