//! Materials: factors times textures, with a shading mode.
//! Plain data in linear colours; how it is shaded is the renderer's affair.

use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

use super::lobes::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Sheen, SpecularGlossiness};
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

impl ShadingMode {
    /// How files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pbr => "pbr",
            Self::Reflective => "reflective",
            Self::Refractive => "refractive",
            Self::Unlit => "unlit",
        }
    }
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
    /// Alpha: strength.
    pub specular_texture: Option<TextureUse>,
    /// Tint of the dielectric F0 (KHR_materials_specular).
    pub specular_color: Vec3,
    /// Tint (sRGB).
    pub specular_color_texture: Option<TextureUse>,
    /// Share of transmitted light, 0..1 (KHR_materials_transmission).
    pub transmission: f32,
    /// Red: share.
    pub transmission_texture: Option<TextureUse>,
    /// True when light crosses a volume (KHR_materials_volume, thickness above 0); false: a thin sheet.
    pub has_volume: bool,
    /// Thickness in mesh space for programs that trace no rays; kept for them, not looked at here.
    pub thickness_m: f32,
    /// Green: thickness; kept likewise.
    pub thickness_texture: Option<TextureUse>,
    /// Where volumes overlap, the one with the higher number is there (Schmidt and Budge 2002); equal: the one entered
    /// last. glTF has no place for it: `extras.volumePriority` of the material.
    pub volume_priority: u8,
    /// Colour that white light has after `attenuation_distance_m`.
    pub attenuation_color: Vec3,
    /// Distance of the above in metres; `None`: no attenuation.
    pub attenuation_distance_m: Option<f32>,
    /// How the index of refraction depends on the colour: 20 / Abbe number, at least 0 (KHR_materials_dispersion).
    pub dispersion: f32,
    /// Brushed surfaces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub anisotropy: Option<Anisotropy>,
    /// A clear layer over everything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearcoat: Option<Clearcoat>,
    /// A thin film.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iridescence: Option<Iridescence>,
    /// Cloth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheen: Option<Sheen>,
    /// Leaves and paper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diffuse_transmission: Option<DiffuseTransmission>,
    /// Reflectance and glossiness in place of metalness and roughness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specular_glossiness: Option<SpecularGlossiness>,
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
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            has_volume: false,
            thickness_m: 0.0,
            thickness_texture: None,
            volume_priority: 0,
            attenuation_color: Vec3::ONE,
            attenuation_distance_m: None,
            dispersion: 0.0,
            anisotropy: None,
            clearcoat: None,
            iridescence: None,
            sheen: None,
            diffuse_transmission: None,
            specular_glossiness: None,
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
        let own = [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.occlusion_texture,
            &self.emissive_texture,
            &self.specular_texture,
            &self.specular_color_texture,
            &self.transmission_texture,
            &self.thickness_texture,
        ];
        own.into_iter()
            .chain(self.anisotropy.iter().flat_map(Anisotropy::slots))
            .chain(self.clearcoat.iter().flat_map(Clearcoat::slots))
            .chain(self.iridescence.iter().flat_map(Iridescence::slots))
            .chain(self.sheen.iter().flat_map(Sheen::slots))
            .chain(self.diffuse_transmission.iter().flat_map(DiffuseTransmission::slots))
            .chain(self.specular_glossiness.iter().flat_map(SpecularGlossiness::slots))
            .flatten()
    }

    /// Every place for a texture, to change it or take it off.
    pub fn texture_slots_mut(&mut self) -> impl Iterator<Item = &mut Option<TextureUse>> {
        let own = [
            &mut self.base_color_texture,
            &mut self.metallic_roughness_texture,
            &mut self.normal_texture,
            &mut self.occlusion_texture,
            &mut self.emissive_texture,
            &mut self.specular_texture,
            &mut self.specular_color_texture,
            &mut self.transmission_texture,
            &mut self.thickness_texture,
        ];
        own.into_iter()
            .chain(self.anisotropy.iter_mut().flat_map(Anisotropy::slots_mut))
            .chain(self.clearcoat.iter_mut().flat_map(Clearcoat::slots_mut))
            .chain(self.iridescence.iter_mut().flat_map(Iridescence::slots_mut))
            .chain(self.sheen.iter_mut().flat_map(Sheen::slots_mut))
            .chain(self.diffuse_transmission.iter_mut().flat_map(DiffuseTransmission::slots_mut))
            .chain(self.specular_glossiness.iter_mut().flat_map(SpecularGlossiness::slots_mut))
    }

    /// Whether a lobe scatters light that the smooth glass of [`ShadingMode::Refractive`] does not know.
    pub fn has_scattering_lobe(&self) -> bool {
        self.anisotropy.is_some()
            || self.clearcoat.is_some()
            || self.iridescence.is_some()
            || self.sheen.is_some()
            || self.diffuse_transmission.is_some()
            || self.specular_glossiness.is_some()
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
            && self.sheen.as_ref().is_none_or(|lobe| lobe.color.is_finite())
            && self.diffuse_transmission.as_ref().is_none_or(|lobe| lobe.color.is_finite())
            && self.specular_glossiness.as_ref().is_none_or(|lobe| lobe.specular.is_finite())
            && self.lobe_numbers().all(f32::is_finite)
            && [
                self.metallic,
                self.roughness,
                self.normal_scale,
                self.occlusion_strength,
                self.emissive_strength,
                self.ior,
                self.specular,
                self.transmission,
                self.thickness_m,
                self.dispersion,
                cutoff,
            ]
            .iter()
            .all(|v| v.is_finite())
    }

    fn lobe_numbers(&self) -> impl Iterator<Item = f32> {
        let anisotropy = self.anisotropy.iter().flat_map(|lobe| vec![lobe.strength, lobe.rotation_rad]);
        let clearcoat =
            self.clearcoat.iter().flat_map(|lobe| vec![lobe.factor, lobe.roughness, lobe.normal_scale]);
        let iridescence = self
            .iridescence
            .iter()
            .flat_map(|lobe| vec![lobe.factor, lobe.ior, lobe.thickness_min_nm, lobe.thickness_max_nm]);
        anisotropy
            .chain(clearcoat)
            .chain(iridescence)
            .chain(self.sheen.iter().map(|lobe| lobe.roughness))
            .chain(self.diffuse_transmission.iter().map(|lobe| lobe.factor))
            .chain(self.specular_glossiness.iter().map(|lobe| lobe.glossiness))
    }
}
