//! Materials: metallic-roughness with its textures and the KHR extensions that the renderer shades.
//! In: JSON. Out: [`Material`] with its shading mode. Format: glTF 2.0, section 3.9, and the extensions' texts.

use glam::{Vec2, Vec3, Vec4};

use super::json::{Fault, Item};
use super::texture::TextureTable;
use crate::assets::{AlphaMode, Material, ShadingMode, TextureUse};

/// Share of transmitted light above which a material may count as glass.
const GLASS_TRANSMISSION: f32 = 0.5;
/// Roughness up to which glass counts as smooth.
const SMOOTH_ROUGHNESS: f32 = 0.05;
/// Emissive strength is cut here, far above every real light, so that a sum of samples stays finite.
const MAX_EMISSIVE_STRENGTH: f32 = 1e15;

/// Reads all materials.
pub(super) fn read_all(root: &Item<'_>, textures: &mut TextureTable) -> Result<Vec<Material>, Fault> {
    root.objects("materials")?.iter().map(|item| read(item, textures)).collect()
}

fn read(item: &Item<'_>, textures: &mut TextureTable) -> Result<Material, Fault> {
    let mut material = Material {
        name: item.name()?,
        emissive: Vec3::from(item.f32s_or("emissiveFactor", [0.0; 3])?).max(Vec3::ZERO),
        emissive_texture: texture_use(item, "emissiveTexture", true, textures)?,
        alpha: read_alpha(item)?,
        double_sided: item.bool_or("doubleSided", false)?,
        ..Material::default()
    };
    if let Some(pbr) = item.child("pbrMetallicRoughness")? {
        material.base_color = Vec4::from(pbr.f32s_or("baseColorFactor", [1.0; 4])?).max(Vec4::ZERO);
        material.base_color_texture = texture_use(&pbr, "baseColorTexture", true, textures)?;
        material.metallic = pbr.f32_or("metallicFactor", 1.0)?.clamp(0.0, 1.0);
        material.roughness = pbr.f32_or("roughnessFactor", 1.0)?.clamp(0.0, 1.0);
        material.metallic_roughness_texture = texture_use(&pbr, "metallicRoughnessTexture", false, textures)?;
    }
    if let Some(normal) = item.child("normalTexture")? {
        material.normal_texture = texture_use(item, "normalTexture", false, textures)?;
        material.normal_scale = normal.f32_or("scale", 1.0)?;
    }
    if let Some(occlusion) = item.child("occlusionTexture")? {
        material.occlusion_texture = texture_use(item, "occlusionTexture", false, textures)?;
        material.occlusion_strength = occlusion.f32_or("strength", 1.0)?.clamp(0.0, 1.0);
    }
    read_extensions(item, &mut material)?;
    Ok(material)
}

fn read_alpha(item: &Item<'_>) -> Result<AlphaMode, Fault> {
    Ok(match item.text("alphaMode")? {
        None | Some("OPAQUE") => AlphaMode::Opaque,
        Some("MASK") => AlphaMode::Mask { cutoff: item.f32_or("alphaCutoff", 0.5)? },
        Some("BLEND") => AlphaMode::Blend,
        Some(other) => return Err(item.fault(format!("alphaMode {other} does not exist"))),
    })
}

fn read_extensions(item: &Item<'_>, material: &mut Material) -> Result<(), Fault> {
    if let Some(extension) = item.extension("KHR_materials_emissive_strength")? {
        let strength = extension.f32_or("emissiveStrength", 1.0)?;
        material.emissive_strength = strength.clamp(0.0, MAX_EMISSIVE_STRENGTH);
    }
    if let Some(extension) = item.extension("KHR_materials_ior")? {
        // 0 stands for an infinite index in the extension: all light is reflected.
        let ior = extension.f32_or("ior", 1.5)?;
        material.ior = if ior == 0.0 { 1e6 } else { ior.max(1.0) };
    }
    if let Some(extension) = item.extension("KHR_materials_specular")? {
        material.specular = extension.f32_or("specularFactor", 1.0)?.clamp(0.0, 1.0);
        let tint = extension.f32s_or("specularColorFactor", [1.0; 3])?;
        material.specular_color = Vec3::from(tint).max(Vec3::ZERO);
    }
    let mut textured = false;
    if let Some(extension) = item.extension("KHR_materials_transmission")? {
        let share = extension.f32_or("transmissionFactor", 0.0)?;
        material.transmission = share.clamp(0.0, 1.0);
        textured = extension.get("transmissionTexture").is_some();
    }
    if let Some(extension) = item.extension("KHR_materials_volume")? {
        material.has_volume = extension.f32_or("thicknessFactor", 0.0)? > 0.0;
        let color = extension.f32s_or("attenuationColor", [1.0; 3])?;
        material.attenuation_color = Vec3::from(color).clamp(Vec3::ZERO, Vec3::ONE);
        // Absent means that nothing is attenuated; 0 and less are not allowed and read as absent.
        material.attenuation_distance_m = match extension.f64("attenuationDistance")? {
            Some(distance) if distance > 0.0 && (distance as f32).is_finite() => Some(distance as f32),
            _ => None,
        };
    }
    if let Some(extras) = item.get("extras")
        && extras.get("volumePriority").is_some()
    {
        material.volume_priority = extras.f32_or("volumePriority", 0.0)?.clamp(0.0, 255.0) as u8;
    }
    let smooth = material.roughness <= SMOOTH_ROUGHNESS && material.metallic_roughness_texture.is_none();
    if item.extension("KHR_materials_unlit")?.is_some() {
        material.mode = ShadingMode::Unlit;
    } else if material.transmission > GLASS_TRANSMISSION && smooth && !textured {
        material.mode = ShadingMode::Refractive;
    }
    Ok(())
}

/// A texture of a material; colours (`srgb`) are base colour and emissive.
fn texture_use(
    item: &Item<'_>,
    key: &str,
    srgb: bool,
    textures: &mut TextureTable,
) -> Result<Option<TextureUse>, Fault> {
    let Some(info) = item.child(key)? else {
        return Ok(None);
    };
    let index = info.required_index("index", textures.len(), "texture")?;
    let mut tex_coord = info.size("texCoord")?.unwrap_or(0);
    let mut texture_use = TextureUse::new(textures.want(index, srgb));
    if let Some(transform) = info.extension("KHR_texture_transform")? {
        texture_use.offset = Vec2::from(transform.f32s_or("offset", [0.0; 2])?);
        texture_use.rotation_rad = transform.f32_or("rotation", 0.0)?;
        texture_use.scale = Vec2::from(transform.f32s_or("scale", [1.0; 2])?);
        tex_coord = transform.size("texCoord")?.unwrap_or(tex_coord);
    }
    // Meshes carry two sets; a third one falls back to the first.
    texture_use.tex_coord = if tex_coord > 1 { 0 } else { tex_coord as u32 };
    Ok(Some(texture_use))
}
