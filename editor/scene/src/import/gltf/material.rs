//! Materials: metallic-roughness with its textures and the KHR extensions that the renderer shades.
//! In: JSON. Out: [`Material`] with its shading mode, and warnings about values out of their range, which are held to it.
//! Format: glTF 2.0, section 3.9, and the extensions' texts.

use std::ops::RangeInclusive;

use glam::{Vec2, Vec3, Vec4};

use super::extras;
use super::json::{Fault, Item, POSITIVE, held};
use super::texture::TextureTable;
use crate::assets::{AlphaMode, MAX_RADIANCE, Material, ShadingMode, TextureUse};
use crate::import::short;

mod lobes;

/// Stands for an infinite index of refraction: all light is reflected.
pub(crate) const INFINITE_IOR: f32 = 1e6;

/// Share of something.
const UNIT: RangeInclusive<f32> = 0.0..=1.0;

/// Reads all materials. The textures of extensions are asked for after those of all materials: projects know textures
/// by their order, and older versions asked for the others alone.
pub(super) fn read_all(
    root: &Item<'_>,
    textures: &mut TextureTable,
) -> Result<(Vec<Material>, Vec<Fault>), Fault> {
    let mut reader = Reader { textures, warnings: Vec::new() };
    let items = root.objects("materials")?;
    let mut materials: Vec<Material> =
        items.iter().map(|item| reader.material(item)).collect::<Result<_, _>>()?;
    for (item, material) in items.iter().zip(&mut materials) {
        reader.extensions(item, material)?;
        reader.lobes(item, material)?;
        material.mode = shading_mode(item, material)?;
    }
    Ok((materials, reader.warnings))
}

struct Reader<'a> {
    textures: &'a mut TextureTable,
    warnings: Vec<Fault>,
}

impl Reader<'_> {
    fn material(&mut self, item: &Item<'_>) -> Result<Material, Fault> {
        let mut material = Material {
            name: item.name()?,
            emissive: self.emissive(item)?,
            emissive_texture: self.texture_use(item, "emissiveTexture", true)?,
            alpha: self.alpha(item)?,
            double_sided: item.bool_or("doubleSided", false)?,
            ..Material::default()
        };
        if let Some(pbr) = item.child("pbrMetallicRoughness")? {
            material.base_color = self.base_color(&pbr, "baseColorFactor")?;
            material.base_color_texture = self.texture_use(&pbr, "baseColorTexture", true)?;
            material.metallic = self.within(&pbr, "metallicFactor", 1.0, UNIT)?;
            material.roughness = self.within(&pbr, "roughnessFactor", 1.0, UNIT)?;
            material.metallic_roughness_texture =
                self.texture_use(&pbr, "metallicRoughnessTexture", false)?;
        }
        (material.normal_texture, material.normal_scale) = self.normal_map(item, "normalTexture")?;
        if let Some(occlusion) = item.child("occlusionTexture")? {
            material.occlusion_texture = self.texture_use(item, "occlusionTexture", false)?;
            material.occlusion_strength = self.within(&occlusion, "strength", 1.0, UNIT)?;
        }
        Ok(material)
    }

    /// Extensions that refine what every material has.
    fn extensions(&mut self, item: &Item<'_>, material: &mut Material) -> Result<(), Fault> {
        if let Some(extension) = item.extension("KHR_materials_emissive_strength")? {
            material.emissive_strength =
                self.within(&extension, "emissiveStrength", 1.0, 0.0..=MAX_RADIANCE)?;
        }
        if let Some(extension) = item.extension("KHR_materials_ior")? {
            material.ior = match extension.f32_or("ior", 1.5)? {
                0.0 => INFINITE_IOR,
                _ => self.within(&extension, "ior", 1.5, 1.0..=INFINITE_IOR)?,
            };
        }
        if let Some(extension) = item.extension("KHR_materials_specular")? {
            material.specular = self.within(&extension, "specularFactor", 1.0, UNIT)?;
            material.specular_texture = self.texture_use(&extension, "specularTexture", false)?;
            material.specular_color = self.color(&extension, "specularColorFactor", Vec3::ONE, POSITIVE)?;
            material.specular_color_texture = self.texture_use(&extension, "specularColorTexture", true)?;
        }
        if let Some(extension) = item.extension("KHR_materials_transmission")? {
            material.transmission = self.within(&extension, "transmissionFactor", 0.0, UNIT)?;
            material.transmission_texture = self.texture_use(&extension, "transmissionTexture", false)?;
        }
        if let Some(extension) = item.extension("KHR_materials_volume")? {
            self.volume(&extension, material)?;
        }
        if let Some(Some(priority)) = extras::number(item, "volumePriority", &mut self.warnings) {
            let held = self.held(item, "extras/volumePriority", priority as f32, &(0.0..=255.0));
            material.volume_priority = held as u8;
        }
        Ok(())
    }

    fn volume(&mut self, extension: &Item<'_>, material: &mut Material) -> Result<(), Fault> {
        material.thickness_m = self.within(extension, "thicknessFactor", 0.0, POSITIVE)?;
        material.has_volume = material.thickness_m > 0.0;
        material.thickness_texture = self.texture_use(extension, "thicknessTexture", false)?;
        material.attenuation_color = self.color(extension, "attenuationColor", Vec3::ONE, UNIT)?;
        // Absent means that nothing is attenuated; 0 and less are not allowed and read as absent.
        material.attenuation_distance_m = match extension.f64("attenuationDistance")? {
            Some(distance) if distance as f32 > 0.0 => Some(distance as f32).filter(|d| d.is_finite()),
            Some(distance) => {
                let place = format!("{}/attenuationDistance", extension.place());
                let reason = format!("{distance} has to be above 0; nothing is attenuated");
                self.warnings.push(Fault::new(place, reason));
                None
            }
            None => None,
        };
        Ok(())
    }

    /// A base colour, with alpha.
    fn base_color(&mut self, item: &Item<'_>, key: &str) -> Result<Vec4, Fault> {
        let given = item.f32s_or(key, [1.0; 4])?;
        Ok(Vec4::from(given.map(|channel| self.held(item, key, channel, &UNIT))))
    }

    /// What it emits. Channels above 1 are those of a stronger light, which exports write as
    /// `KHR_materials_emissive_strength`.
    fn emissive(&mut self, item: &Item<'_>) -> Result<Vec3, Fault> {
        let emissive = self.color(item, "emissiveFactor", Vec3::ZERO, POSITIVE)?;
        if emissive.max_element() > 1.0 {
            let reason = format!("{emissive} has to be within 0 and 1; it is taken as a stronger light");
            self.warnings.push(Fault::new(format!("{}/emissiveFactor", item.place()), reason));
        }
        Ok(emissive)
    }

    fn alpha(&mut self, item: &Item<'_>) -> Result<AlphaMode, Fault> {
        Ok(match item.text("alphaMode")? {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask { cutoff: self.within(item, "alphaCutoff", 0.5, POSITIVE)? },
            Some("BLEND") => AlphaMode::Blend,
            Some(other) => return Err(item.fault(format!("alphaMode {} does not exist", short(other)))),
        })
    }

    /// A number held to its range, with a warning where that changes it.
    fn within(
        &mut self,
        item: &Item<'_>,
        key: &str,
        default: f32,
        range: RangeInclusive<f32>,
    ) -> Result<f32, Fault> {
        let given = item.f32_or(key, default)?;
        Ok(self.held(item, key, given, &range))
    }

    /// A linear colour, each channel held to the range.
    fn color(
        &mut self,
        item: &Item<'_>,
        key: &str,
        default: Vec3,
        range: RangeInclusive<f32>,
    ) -> Result<Vec3, Fault> {
        let given = item.f32s_or(key, default.to_array())?;
        Ok(Vec3::from(given.map(|channel| self.held(item, key, channel, &range))))
    }

    fn held(&mut self, item: &Item<'_>, key: &str, given: f32, range: &RangeInclusive<f32>) -> f32 {
        held(item, key, given, range, &mut self.warnings)
    }

    /// A normal map and its scale.
    fn normal_map(&mut self, item: &Item<'_>, key: &str) -> Result<(Option<TextureUse>, f32), Fault> {
        let scale = match item.child(key)? {
            Some(info) => info.f32_or("scale", 1.0)?,
            None => 1.0,
        };
        Ok((self.texture_use(item, key, false)?, scale))
    }

    /// A texture of a material, read as colour (`srgb`) or as data.
    fn texture_use(&mut self, item: &Item<'_>, key: &str, srgb: bool) -> Result<Option<TextureUse>, Fault> {
        let Some(info) = item.child(key)? else {
            return Ok(None);
        };
        let index = info.required_index("index", self.textures.len(), "texture")?;
        let mut tex_coord = info.size("texCoord")?.unwrap_or(0);
        let mut texture_use = TextureUse::new(self.textures.want(index, srgb));
        if let Some(transform) = info.extension("KHR_texture_transform")? {
            texture_use.offset = Vec2::from(transform.f32s_or("offset", [0.0; 2])?);
            texture_use.rotation_rad = transform.f32_or("rotation", 0.0)?;
            texture_use.scale = Vec2::from(transform.f32s_or("scale", [1.0; 2])?);
            tex_coord = transform.size("texCoord")?.unwrap_or(tex_coord);
        }
        if tex_coord > 1 {
            let reason = format!("texture coordinates {tex_coord} are not read; the first ones stand in");
            self.warnings.push(info.fault(reason));
            tex_coord = 0;
        }
        texture_use.tex_coord = tex_coord as u32;
        Ok(Some(texture_use))
    }
}

/// What `extras.shadingMode` of an exported material says where the rest would be read as another mode.
fn mode_of_name(name: &str) -> Option<ShadingMode> {
    [ShadingMode::Pbr, ShadingMode::Reflective, ShadingMode::Refractive]
        .into_iter()
        .find(|mode| mode.name() == name)
}

/// Whether a material with these values is smooth glass, which has a mode of its own with the exact Fresnel equations:
/// a whole dielectric that lets all light pass, unspread. Whatever is partly something else stays what it is.
pub(crate) fn is_smooth_glass(material: &Material) -> bool {
    let values = (material.metallic, material.roughness, material.transmission, material.specular);
    let textures = [
        &material.metallic_roughness_texture,
        &material.transmission_texture,
        &material.specular_texture,
        &material.specular_color_texture,
    ];
    values == (0.0, 0.0, 1.0, 1.0)
        && material.specular_color == Vec3::ONE
        && textures.iter().all(|texture| texture.is_none())
        && !material.has_scattering_lobe()
}

/// The mode that `extras` name.
fn named_mode(item: &Item<'_>) -> Option<ShadingMode> {
    let named = item.get("extras").and_then(|extras| extras.text("shadingMode").ok().flatten());
    named.and_then(mode_of_name)
}

/// Whether they name one.
pub(super) fn names_mode(item: &Item<'_>) -> bool {
    named_mode(item).is_some()
}

/// Smooth glass is told by its values, the rest by name.
fn shading_mode(item: &Item<'_>, material: &Material) -> Result<ShadingMode, Fault> {
    Ok(if item.extension("KHR_materials_unlit")?.is_some() {
        ShadingMode::Unlit
    } else if let Some(named) = named_mode(item) {
        named
    } else if is_smooth_glass(material) {
        ShadingMode::Refractive
    } else {
        ShadingMode::Pbr
    })
}
