//! Extensions that add a lobe to a material. In: JSON. Out: the lobe, absent where the extension is.

use glam::Vec3;

use super::super::json::{Fault, Item, POSITIVE};
use super::{Reader, UNIT};
use crate::assets::{
    Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Material, Sheen, SpecularGlossiness,
};

impl Reader<'_> {
    /// Every lobe that the material has.
    pub(super) fn lobes(&mut self, item: &Item<'_>, material: &mut Material) -> Result<(), Fault> {
        if let Some(extension) = item.extension("KHR_materials_anisotropy")? {
            material.anisotropy = Some(Anisotropy {
                strength: self.within(&extension, "anisotropyStrength", 0.0, UNIT)?,
                rotation_rad: extension.f32_or("anisotropyRotation", 0.0)?,
                texture: self.texture_use(&extension, "anisotropyTexture", false)?,
            });
        }
        if let Some(extension) = item.extension("KHR_materials_clearcoat")? {
            material.clearcoat = Some(self.clearcoat(&extension)?);
        }
        if let Some(extension) = item.extension("KHR_materials_dispersion")? {
            material.dispersion = self.within(&extension, "dispersion", 0.0, POSITIVE)?;
        }
        if let Some(extension) = item.extension("KHR_materials_iridescence")? {
            material.iridescence = Some(self.iridescence(&extension)?);
        }
        if let Some(extension) = item.extension("KHR_materials_sheen")? {
            material.sheen = Some(Sheen {
                color: self.color(&extension, "sheenColorFactor", Vec3::ZERO, UNIT)?,
                color_texture: self.texture_use(&extension, "sheenColorTexture", true)?,
                roughness: self.within(&extension, "sheenRoughnessFactor", 0.0, UNIT)?,
                roughness_texture: self.texture_use(&extension, "sheenRoughnessTexture", false)?,
            });
        }
        if let Some(extension) = item.extension("KHR_materials_diffuse_transmission")? {
            material.diffuse_transmission = Some(DiffuseTransmission {
                factor: self.within(&extension, "diffuseTransmissionFactor", 0.0, UNIT)?,
                texture: self.texture_use(&extension, "diffuseTransmissionTexture", false)?,
                color: self.color(&extension, "diffuseTransmissionColorFactor", Vec3::ONE, UNIT)?,
                color_texture: self.texture_use(&extension, "diffuseTransmissionColorTexture", true)?,
            });
        }
        if let Some(extension) = item.extension("KHR_materials_pbrSpecularGlossiness")? {
            self.specular_glossiness(&extension, material)?;
        }
        Ok(())
    }

    fn clearcoat(&mut self, extension: &Item<'_>) -> Result<Clearcoat, Fault> {
        let (normal_texture, normal_scale) = self.normal_map(extension, "clearcoatNormalTexture")?;
        Ok(Clearcoat {
            factor: self.within(extension, "clearcoatFactor", 0.0, UNIT)?,
            texture: self.texture_use(extension, "clearcoatTexture", false)?,
            roughness: self.within(extension, "clearcoatRoughnessFactor", 0.0, UNIT)?,
            roughness_texture: self.texture_use(extension, "clearcoatRoughnessTexture", false)?,
            normal_texture,
            normal_scale,
        })
    }

    fn iridescence(&mut self, extension: &Item<'_>) -> Result<Iridescence, Fault> {
        Ok(Iridescence {
            factor: self.within(extension, "iridescenceFactor", 0.0, UNIT)?,
            texture: self.texture_use(extension, "iridescenceTexture", false)?,
            ior: self.within(extension, "iridescenceIor", 1.3, 1.0..=f32::MAX)?,
            thickness_min_nm: self.within(extension, "iridescenceThicknessMinimum", 100.0, POSITIVE)?,
            thickness_max_nm: self.within(extension, "iridescenceThicknessMaximum", 400.0, POSITIVE)?,
            thickness_texture: self.texture_use(extension, "iridescenceThicknessTexture", false)?,
        })
    }

    /// Takes the place of metallic-roughness, which such a file gives for programs that do not know the extension.
    fn specular_glossiness(&mut self, extension: &Item<'_>, material: &mut Material) -> Result<(), Fault> {
        material.base_color = self.base_color(extension, "diffuseFactor")?;
        material.base_color_texture = self.texture_use(extension, "diffuseTexture", true)?;
        material.metallic_roughness_texture = None;
        material.specular_glossiness = Some(SpecularGlossiness {
            specular: self.color(extension, "specularFactor", Vec3::ONE, UNIT)?,
            glossiness: self.within(extension, "glossinessFactor", 1.0, UNIT)?,
            texture: self.texture_use(extension, "specularGlossinessTexture", true)?,
        });
        Ok(())
    }
}
