//! The properties of materials: factors of glTF 2.0 and of its extensions, and the transforms of textures.
//! A lobe that a clip changes is there with its defaults where the material has none. A thickness that changes does not
//! make a sheet a volume.

use super::{ABOVE_ZERO, ANY, Animated, INDEX, POSITIVE, Row, UNIT, four, one, row, three, two};
use crate::assets::{AlphaMode, MAX_RADIANCE, Material};

const RADIANCE: (f32, f32) = (0.0, MAX_RADIANCE);

/// The rows of factors, then three for the transform of each texture (`KHR_texture_transform`).
macro_rules! properties {
    ([$($factors:tt)*] $($pointer:literal: |$material:ident| $slot:expr;)*) => {
        &[
            $($factors)*
            $(
                row(concat!($pointer, "/extensions/KHR_texture_transform/offset"), ANY, |$material| {
                    two(&mut $slot.as_mut()?.offset)
                }),
                row(concat!($pointer, "/extensions/KHR_texture_transform/rotation"), ANY, |$material| {
                    one(&mut $slot.as_mut()?.rotation_rad)
                }),
                row(concat!($pointer, "/extensions/KHR_texture_transform/scale"), ANY, |$material| {
                    two(&mut $slot.as_mut()?.scale)
                }),
            )*
        ]
    };
}

impl Animated for Material {
    const PROPERTIES: &'static [Row<Self>] = properties! {
        [
            row("pbrMetallicRoughness/baseColorFactor", POSITIVE, |material| four(&mut material.base_color)),
            row("pbrMetallicRoughness/metallicFactor", UNIT, |material| one(&mut material.metallic)),
            row("pbrMetallicRoughness/roughnessFactor", UNIT, |material| one(&mut material.roughness)),
            row("normalTexture/scale", ANY, |material| one(&mut material.normal_scale)),
            row("occlusionTexture/strength", UNIT, |material| one(&mut material.occlusion_strength)),
            row("emissiveFactor", POSITIVE, |material| three(&mut material.emissive)),
            row("alphaCutoff", POSITIVE, |material| match &mut material.alpha {
                AlphaMode::Mask { cutoff } => one(cutoff),
                AlphaMode::Opaque | AlphaMode::Blend => None,
            }),
            row("extensions/KHR_materials_emissive_strength/emissiveStrength", RADIANCE, |material| {
                one(&mut material.emissive_strength)
            }),
            row("extensions/KHR_materials_ior/ior", INDEX, |material| one(&mut material.ior)),
            row("extensions/KHR_materials_specular/specularFactor", UNIT, |material| {
                one(&mut material.specular)
            }),
            row("extensions/KHR_materials_specular/specularColorFactor", POSITIVE, |material| {
                three(&mut material.specular_color)
            }),
            row("extensions/KHR_materials_transmission/transmissionFactor", UNIT, |material| {
                one(&mut material.transmission)
            }),
            row("extensions/KHR_materials_volume/thicknessFactor", POSITIVE, |material| {
                one(&mut material.thickness_m)
            }),
            row("extensions/KHR_materials_volume/attenuationColor", UNIT, |material| {
                three(&mut material.attenuation_color)
            }),
            row("extensions/KHR_materials_volume/attenuationDistance", ABOVE_ZERO, |material| {
                one(material.attenuation_distance_m.get_or_insert(1.0))
            }),
            row("extensions/KHR_materials_dispersion/dispersion", POSITIVE, |material| {
                one(&mut material.dispersion)
            }),
            row("extensions/KHR_materials_anisotropy/anisotropyStrength", UNIT, |material| {
                one(&mut material.anisotropy.get_or_insert_default().strength)
            }),
            row("extensions/KHR_materials_anisotropy/anisotropyRotation", ANY, |material| {
                one(&mut material.anisotropy.get_or_insert_default().rotation_rad)
            }),
            row("extensions/KHR_materials_clearcoat/clearcoatFactor", UNIT, |material| {
                one(&mut material.clearcoat.get_or_insert_default().factor)
            }),
            row("extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", UNIT, |material| {
                one(&mut material.clearcoat.get_or_insert_default().roughness)
            }),
            row("extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale", ANY, |material| {
                one(&mut material.clearcoat.get_or_insert_default().normal_scale)
            }),
            row("extensions/KHR_materials_iridescence/iridescenceFactor", UNIT, |material| {
                one(&mut material.iridescence.get_or_insert_default().factor)
            }),
            row("extensions/KHR_materials_iridescence/iridescenceIor", INDEX, |material| {
                one(&mut material.iridescence.get_or_insert_default().ior)
            }),
            row("extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", POSITIVE, |material| {
                one(&mut material.iridescence.get_or_insert_default().thickness_min_nm)
            }),
            row("extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", POSITIVE, |material| {
                one(&mut material.iridescence.get_or_insert_default().thickness_max_nm)
            }),
            row("extensions/KHR_materials_sheen/sheenColorFactor", UNIT, |material| {
                three(&mut material.sheen.get_or_insert_default().color)
            }),
            row("extensions/KHR_materials_sheen/sheenRoughnessFactor", UNIT, |material| {
                one(&mut material.sheen.get_or_insert_default().roughness)
            }),
            row("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", UNIT, |material| {
                one(&mut material.diffuse_transmission.get_or_insert_default().factor)
            }),
            row("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", UNIT, |material| {
                three(&mut material.diffuse_transmission.get_or_insert_default().color)
            }),
            // The base colour is the diffuse colour of this model.
            row("extensions/KHR_materials_pbrSpecularGlossiness/diffuseFactor", POSITIVE, |material| {
                material.specular_glossiness.as_ref()?;
                four(&mut material.base_color)
            }),
            row("extensions/KHR_materials_pbrSpecularGlossiness/specularFactor", UNIT, |material| {
                three(&mut material.specular_glossiness.as_mut()?.specular)
            }),
            row("extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor", UNIT, |material| {
                one(&mut material.specular_glossiness.as_mut()?.glossiness)
            }),
        ]
        "pbrMetallicRoughness/baseColorTexture": |material| material.base_color_texture;
        "pbrMetallicRoughness/metallicRoughnessTexture": |material| material.metallic_roughness_texture;
        "normalTexture": |material| material.normal_texture;
        "occlusionTexture": |material| material.occlusion_texture;
        "emissiveTexture": |material| material.emissive_texture;
        "extensions/KHR_materials_specular/specularTexture": |material| material.specular_texture;
        "extensions/KHR_materials_specular/specularColorTexture": |material| material.specular_color_texture;
        "extensions/KHR_materials_transmission/transmissionTexture": |material| material.transmission_texture;
        "extensions/KHR_materials_volume/thicknessTexture": |material| material.thickness_texture;
        "extensions/KHR_materials_anisotropy/anisotropyTexture": |material| material.anisotropy.as_mut()?.texture;
        "extensions/KHR_materials_clearcoat/clearcoatTexture": |material| material.clearcoat.as_mut()?.texture;
        "extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture": |material| material.clearcoat.as_mut()?.roughness_texture;
        "extensions/KHR_materials_clearcoat/clearcoatNormalTexture": |material| material.clearcoat.as_mut()?.normal_texture;
        "extensions/KHR_materials_iridescence/iridescenceTexture": |material| material.iridescence.as_mut()?.texture;
        "extensions/KHR_materials_iridescence/iridescenceThicknessTexture": |material| material.iridescence.as_mut()?.thickness_texture;
        "extensions/KHR_materials_sheen/sheenColorTexture": |material| material.sheen.as_mut()?.color_texture;
        "extensions/KHR_materials_sheen/sheenRoughnessTexture": |material| material.sheen.as_mut()?.roughness_texture;
        "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionTexture": |material| material.diffuse_transmission.as_mut()?.texture;
        "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture": |material| material.diffuse_transmission.as_mut()?.color_texture;
        "extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture": |material| material.base_color_texture;
        "extensions/KHR_materials_pbrSpecularGlossiness/specularGlossinessTexture": |material| material.specular_glossiness.as_mut()?.texture;
    };
}
