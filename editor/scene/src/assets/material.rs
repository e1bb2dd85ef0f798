//! Materials: factors times textures, with a shading mode.
//! Plain data in linear colours; how it is shaded is the renderer's affair.

use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

use super::texture::TextureUse;

/// How a surface answers light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Material {
    /// Shown in the inspector.
    pub name: String,
    /// Shading mode.
    pub mode: ShadingMode,
    /// Linear base colour with alpha.
    pub base_color: Vec4,
    /// Base colour texture (sRGB) with alpha.
    pub base_color_texture: Option<TextureUse>,
    /// Metalness, 0..1.
    pub metallic: f32,
    /// Perceptual roughness, 0..1.
    pub roughness: f32,
    /// Green: roughness, blue: metalness.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Tangent-space normal map.
    pub normal_texture: Option<TextureUse>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Red: ambient occlusion.
    pub occlusion_texture: Option<TextureUse>,
    /// Strength of the occlusion texture, 0..1.
    pub occlusion_strength: f32,
    /// Linear emissive colour, 0..1 a channel.
    pub emissive: Vec3,
    /// Multiplies `emissive` (KHR_materials_emissive_strength); nits taken as radiance 1:1.
    pub emissive_strength: f32,
    /// Emissive texture (sRGB).
    pub emissive_texture: Option<TextureUse>,
    /// Index of refraction, at least 1 (KHR_materials_ior).
    pub ior: f32,
    /// Strength of the dielectric specular lobe, 0..1 (KHR_materials_specular).
    pub specular: f32,
    /// Tint of the dielectric F0 (KHR_materials_specular).
    pub specular_color: Vec3,
    /// Share of transmitted light, 0..1 (KHR_materials_transmission).
    pub transmission: f32,
    /// True when light crosses a volume (KHR_materials_volume, thickness above 0); false: a thin sheet.
    pub has_volume: bool,
    /// Where volumes overlap, the one with the higher number is there (Schmidt and Budge 2002); equal: the one entered
    /// last. glTF has no place for it: `extras.volumePriority` of the material.
    pub volume_priority: u8,
    /// Colour that white light has after `attenuation_distance_m`.
    pub attenuation_color: Vec3,
    /// Distance of the above in metres; `None`: no attenuation.
    pub attenuation_distance_m: Option<f32>,
    /// Alpha mode.
    pub alpha: AlphaMode,
    /// Whether the back of a triangle is drawn.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
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
            emissive_strength: 1.0,
            emissive_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
            has_volume: false,
            volume_priority: 0,
            attenuation_color: Vec3::ONE,
            attenuation_distance_m: None,
            alpha: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

impl Material {
    /// Emitted radiance before the texture: colour times strength.
    pub fn emitted_radiance(&self) -> Vec3 {
        self.emissive * self.emissive_strength
    }

    /// Every texture that the material uses.
    pub fn textures(&self) -> impl Iterator<Item = &TextureUse> {
        [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.occlusion_texture,
            &self.emissive_texture,
        ]
        .into_iter()
        .flatten()
    }

    /// Every texture that the material uses, to change its id.
    pub fn textures_mut(&mut self) -> impl Iterator<Item = &mut TextureUse> {
        [
            &mut self.base_color_texture,
            &mut self.metallic_roughness_texture,
            &mut self.normal_texture,
            &mut self.occlusion_texture,
            &mut self.emissive_texture,
        ]
        .into_iter()
        .flatten()
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let uses_finite = self
            .textures()
            .all(|u| u.offset.is_finite() && u.scale.is_finite() && u.rotation_rad.is_finite());
        let cutoff = match self.alpha {
            AlphaMode::Mask { cutoff } => cutoff,
            AlphaMode::Opaque | AlphaMode::Blend => 0.0,
        };
        uses_finite
            && self.base_color.is_finite()
            && self.emissive.is_finite()
            && self.specular_color.is_finite()
            && self.attenuation_color.is_finite()
            && self.attenuation_distance_m.is_none_or(f32::is_finite)
            && [
                self.metallic,
                self.roughness,
                self.normal_scale,
                self.occlusion_strength,
                self.emissive_strength,
                self.ior,
                self.specular,
                self.transmission,
                cutoff,
            ]
            .iter()
            .all(|v| v.is_finite())
    }
}
