//! Lobes of a material beside metallic-roughness, and textures that few materials have.

use glam::Vec3;

use super::TextureUse;

/// Everything that most materials go without: it lies in a table of its own on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobes {
    /// Alpha: strength of the dielectric specular lobe.
    pub specular_texture: Option<TextureUse>,
    /// Tint of the dielectric F0 (sRGB); with `glossiness` the reflectance (sRGB) and, in alpha, the glossiness.
    pub specular_color_texture: Option<TextureUse>,
    /// Red: share of transmitted light.
    pub transmission_texture: Option<TextureUse>,
    /// Specular-glossiness model: the material's base colour is its diffuse colour, `specular_color` its reflectance at
    /// normal incidence, and this 1 - roughness. `None`: metallic-roughness.
    pub glossiness: Option<f32>,
    /// Anisotropy, 0..1: alpha along the direction is mix(alpha, 1, strength^2).
    pub anisotropy: f32,
    /// From the tangent, counter-clockwise, radians.
    pub anisotropy_rotation_rad: f32,
    /// Red and green: direction, -1..1; blue: strength.
    pub anisotropy_texture: Option<TextureUse>,
    /// Strength of the clear coat, 0..1.
    pub clearcoat: f32,
    /// Red: strength.
    pub clearcoat_texture: Option<TextureUse>,
    /// Perceptual roughness of the coat, 0..1.
    pub clearcoat_roughness: f32,
    /// Green: roughness.
    pub clearcoat_roughness_texture: Option<TextureUse>,
    /// Tangent-space normal map of the coat.
    pub clearcoat_normal_texture: Option<TextureUse>,
    /// Scale of that map's x and y.
    pub clearcoat_normal_scale: f32,
    /// 20 / Abbe number; 0: the index is the same for all colours.
    pub dispersion: f32,
    /// Strength of the thin film, 0..1.
    pub iridescence: f32,
    /// Red: strength.
    pub iridescence_texture: Option<TextureUse>,
    /// Index of refraction of the film, at least 1.
    pub iridescence_ior: f32,
    /// Thickness where the texture is 0, nanometres.
    pub iridescence_thickness_min_nm: f32,
    /// Thickness where the texture is 1, and without one, nanometres.
    pub iridescence_thickness_max_nm: f32,
    /// Green: thickness.
    pub iridescence_thickness_texture: Option<TextureUse>,
    /// Linear colour of the sheen, 0..1 a channel.
    pub sheen_color: Vec3,
    /// Colour (sRGB).
    pub sheen_color_texture: Option<TextureUse>,
    /// Perceptual roughness of the sheen, 0..1.
    pub sheen_roughness: f32,
    /// Alpha: roughness.
    pub sheen_roughness_texture: Option<TextureUse>,
    /// Share of the diffuse light that passes, 0..1.
    pub diffuse_transmission: f32,
    /// Alpha: share.
    pub diffuse_transmission_texture: Option<TextureUse>,
    /// Linear tint of that light, 0..1 a channel.
    pub diffuse_transmission_color: Vec3,
    /// Tint (sRGB).
    pub diffuse_transmission_color_texture: Option<TextureUse>,
}

impl Default for Lobes {
    fn default() -> Self {
        Self {
            specular_texture: None,
            specular_color_texture: None,
            transmission_texture: None,
            glossiness: None,
            anisotropy: 0.0,
            anisotropy_rotation_rad: 0.0,
            anisotropy_texture: None,
            clearcoat: 0.0,
            clearcoat_texture: None,
            clearcoat_roughness: 0.0,
            clearcoat_roughness_texture: None,
            clearcoat_normal_texture: None,
            clearcoat_normal_scale: 1.0,
            dispersion: 0.0,
            iridescence: 0.0,
            iridescence_texture: None,
            iridescence_ior: 1.3,
            iridescence_thickness_min_nm: 100.0,
            iridescence_thickness_max_nm: 400.0,
            iridescence_thickness_texture: None,
            sheen_color: Vec3::ZERO,
            sheen_color_texture: None,
            sheen_roughness: 0.0,
            sheen_roughness_texture: None,
            diffuse_transmission: 0.0,
            diffuse_transmission_texture: None,
            diffuse_transmission_color: Vec3::ONE,
            diffuse_transmission_color_texture: None,
        }
    }
}

impl Lobes {
    /// Whether nothing here differs from a material without it.
    pub fn is_plain(&self) -> bool {
        self.specular_texture.is_none()
            && self.specular_color_texture.is_none()
            && self.transmission_texture.is_none()
            && self.glossiness.is_none()
            && [self.anisotropy, self.clearcoat, self.dispersion, self.iridescence, self.diffuse_transmission]
                .iter()
                .all(|strength| *strength <= 0.0)
            && self.sheen_color.max_element() <= 0.0
    }

    /// Every texture, in the order of the record on the device.
    pub fn textures(&self) -> [&Option<TextureUse>; 13] {
        [
            &self.specular_texture,
            &self.specular_color_texture,
            &self.transmission_texture,
            &self.anisotropy_texture,
            &self.clearcoat_texture,
            &self.clearcoat_roughness_texture,
            &self.clearcoat_normal_texture,
            &self.iridescence_texture,
            &self.iridescence_thickness_texture,
            &self.sheen_color_texture,
            &self.sheen_roughness_texture,
            &self.diffuse_transmission_texture,
            &self.diffuse_transmission_color_texture,
        ]
    }
}
