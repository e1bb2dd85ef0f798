//! Lobes that a material may have beside metallic-roughness, one a glTF extension.
//! Plain data: factors times textures. A lobe that is absent costs nothing; how it is shaded is the renderer's affair.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::texture::TextureUse;

/// Gives a lobe the lists of its textures.
macro_rules! texture_slots {
    ($lobe:ident: $($slot:ident),*) => {
        impl $lobe {
            pub(super) fn slots(&self) -> Vec<&Option<TextureUse>> {
                vec![$(&self.$slot),*]
            }

            pub(super) fn slots_mut(&mut self) -> Vec<&mut Option<TextureUse>> {
                vec![$(&mut self.$slot),*]
            }
        }
    };
}

/// Brushed surfaces: rougher along one direction (KHR_materials_anisotropy).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Anisotropy {
    /// 0..1: alpha along the direction is mix(roughness^2, 1, strength^2).
    pub strength: f32,
    /// From the tangent, counter-clockwise, radians.
    pub rotation_rad: f32,
    /// Red and green: direction, -1..1; blue: strength.
    pub texture: Option<TextureUse>,
}

texture_slots!(Anisotropy: texture);

/// A clear layer over everything, index 1.5 (KHR_materials_clearcoat).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Clearcoat {
    /// Strength, 0..1.
    pub factor: f32,
    /// Red: strength.
    pub texture: Option<TextureUse>,
    /// Perceptual roughness, 0..1.
    pub roughness: f32,
    /// Green: roughness.
    pub roughness_texture: Option<TextureUse>,
    /// Normal map of the coat alone; without it the coat has the interpolated normal.
    pub normal_texture: Option<TextureUse>,
    /// Scale of that map's x and y.
    pub normal_scale: f32,
}

impl Default for Clearcoat {
    fn default() -> Self {
        Self {
            factor: 0.0,
            texture: None,
            roughness: 0.0,
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

texture_slots!(Clearcoat: texture, roughness_texture, normal_texture);

/// A thin film whose colours change with the angle (KHR_materials_iridescence).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Iridescence {
    /// Strength, 0..1.
    pub factor: f32,
    /// Red: strength.
    pub texture: Option<TextureUse>,
    /// Index of refraction of the film, at least 1.
    pub ior: f32,
    /// Thickness where the texture is 0, nanometres.
    pub thickness_min_nm: f32,
    /// Thickness where the texture is 1, and without one, nanometres.
    pub thickness_max_nm: f32,
    /// Green: thickness, between the two.
    pub thickness_texture: Option<TextureUse>,
}

impl Default for Iridescence {
    fn default() -> Self {
        Self {
            factor: 0.0,
            texture: None,
            ior: 1.3,
            thickness_min_nm: 100.0,
            thickness_max_nm: 400.0,
            thickness_texture: None,
        }
    }
}

texture_slots!(Iridescence: texture, thickness_texture);

/// Fibres that stand up from cloth (KHR_materials_sheen).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Sheen {
    /// Linear colour, 0..1 a channel; black: no sheen.
    pub color: Vec3,
    /// Colour (sRGB).
    pub color_texture: Option<TextureUse>,
    /// Perceptual roughness, 0..1.
    pub roughness: f32,
    /// Alpha: roughness.
    pub roughness_texture: Option<TextureUse>,
}

texture_slots!(Sheen: color_texture, roughness_texture);

/// Light that a leaf or paper lets through scattered (KHR_materials_diffuse_transmission).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DiffuseTransmission {
    /// Share of the diffuse light that passes, 0..1.
    pub factor: f32,
    /// Alpha: share.
    pub texture: Option<TextureUse>,
    /// Linear tint of the light that passes, 0..1 a channel.
    pub color: Vec3,
    /// Tint (sRGB).
    pub color_texture: Option<TextureUse>,
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self { factor: 0.0, texture: None, color: Vec3::ONE, color_texture: None }
    }
}

texture_slots!(DiffuseTransmission: texture, color_texture);

/// The older model that gives the reflectance itself (KHR_materials_pbrSpecularGlossiness). With it, the material's base
/// colour is its diffuse colour; metalness, roughness, index and specular are not looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SpecularGlossiness {
    /// Linear reflectance at normal incidence, 0..1 a channel.
    pub specular: Vec3,
    /// 1 - perceptual roughness, 0..1.
    pub glossiness: f32,
    /// Reflectance (sRGB); alpha: glossiness.
    pub texture: Option<TextureUse>,
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self { specular: Vec3::ONE, glossiness: 1.0, texture: None }
    }
}

texture_slots!(SpecularGlossiness: texture);
