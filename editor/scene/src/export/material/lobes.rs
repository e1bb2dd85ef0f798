//! Extensions that add a lobe to a material: one is written where the material has the lobe, whatever its strength.

use super::{MaterialWriter, Object, Put, SpecularGlossiness, numbers};
use crate::assets::Material;

impl MaterialWriter<'_, '_> {
    /// Every lobe that the material has.
    pub(super) fn lobes(&mut self, object: &mut Object, material: &Material) {
        if let Some(lobe) = &material.anisotropy {
            let mut value = Object::new();
            value.put_number("anisotropyStrength", lobe.strength, 0.0);
            value.put_number("anisotropyRotation", lobe.rotation_rad, 0.0);
            self.put_texture(&mut value, "anisotropyTexture", &lobe.texture);
            self.used.put(object, "KHR_materials_anisotropy", value);
        }
        if let Some(lobe) = &material.clearcoat {
            let mut value = Object::new();
            value.put_number("clearcoatFactor", lobe.factor, 0.0);
            self.put_texture(&mut value, "clearcoatTexture", &lobe.texture);
            value.put_number("clearcoatRoughnessFactor", lobe.roughness, 0.0);
            self.put_texture(&mut value, "clearcoatRoughnessTexture", &lobe.roughness_texture);
            self.put_map(
                &mut value,
                "clearcoatNormalTexture",
                &lobe.normal_texture,
                "scale",
                lobe.normal_scale,
            );
            self.used.put(object, "KHR_materials_clearcoat", value);
        }
        if let Some(lobe) = &material.iridescence {
            let mut value = Object::new();
            value.put_number("iridescenceFactor", lobe.factor, 0.0);
            self.put_texture(&mut value, "iridescenceTexture", &lobe.texture);
            value.put_number("iridescenceIor", lobe.ior, 1.3);
            value.put_number("iridescenceThicknessMinimum", lobe.thickness_min_nm, 100.0);
            value.put_number("iridescenceThicknessMaximum", lobe.thickness_max_nm, 400.0);
            self.put_texture(&mut value, "iridescenceThicknessTexture", &lobe.thickness_texture);
            self.used.put(object, "KHR_materials_iridescence", value);
        }
        if let Some(lobe) = &material.sheen {
            let mut value = Object::new();
            value.put_numbers("sheenColorFactor", lobe.color, [0.0; 3]);
            self.put_texture(&mut value, "sheenColorTexture", &lobe.color_texture);
            value.put_number("sheenRoughnessFactor", lobe.roughness, 0.0);
            self.put_texture(&mut value, "sheenRoughnessTexture", &lobe.roughness_texture);
            self.used.put(object, "KHR_materials_sheen", value);
        }
        if let Some(lobe) = &material.diffuse_transmission {
            let mut value = Object::new();
            value.put_number("diffuseTransmissionFactor", lobe.factor, 0.0);
            self.put_texture(&mut value, "diffuseTransmissionTexture", &lobe.texture);
            value.put_numbers("diffuseTransmissionColorFactor", lobe.color, [1.0; 3]);
            self.put_texture(&mut value, "diffuseTransmissionColorTexture", &lobe.color_texture);
            self.used.put(object, "KHR_materials_diffuse_transmission", value);
        }
        if let Some(lobe) = &material.specular_glossiness {
            self.specular_glossiness(object, material, lobe);
        }
    }

    /// The base colour is the diffuse colour; metallic-roughness beside it is for programs that do not know the extension.
    fn specular_glossiness(&mut self, object: &mut Object, material: &Material, lobe: &SpecularGlossiness) {
        let mut value = Object::new();
        value.put("diffuseFactor", numbers(&material.base_color.to_array()));
        self.put_texture(&mut value, "diffuseTexture", &material.base_color_texture);
        value.put_numbers("specularFactor", lobe.specular, [1.0; 3]);
        value.put_number("glossinessFactor", lobe.glossiness, 1.0);
        self.put_texture(&mut value, "specularGlossinessTexture", &lobe.texture);
        self.used.put(object, "KHR_materials_pbrSpecularGlossiness", value);
    }
}
