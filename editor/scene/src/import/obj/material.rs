//! MTL materials to the document's: factors, maps and `illum`; the rules are in `docs/support.md`.
//! In: the lines of a material. Out: [`Material`]; what cannot be read becomes a warning. OBJ knows no single-sided faces, so all
//! materials are double-sided.

use glam::{Vec3, Vec4};

use super::Warnings;
use super::bake::{Alpha, is_normal_map};
use super::maps::{Image, Maps};
use super::mtl::Source;
use crate::assets::{AlphaMode, MAX_RADIANCE, Material, ShadingMode, TextureUse};

/// A Kd below this share of Ks (of Tf) is nothing beside a mirror (glass).
const BLACK: f32 = 0.05;
/// Smallest Ks of a mirror.
const MIRROR_SPECULAR: f32 = 0.5;
/// Keys that change the picture in other programs and are not read.
const LEFT_OUT: [&str; 5] = ["disp", "decal", "refl", "map_tr", "map_ps"];

/// What faces without a material get: grey and rough.
pub(super) fn default_material() -> Material {
    Material {
        name: "default".to_owned(),
        base_color: Vec4::new(0.8, 0.8, 0.8, 1.0),
        metallic: 0.0,
        double_sided: true,
        ..Material::default()
    }
}

/// Reads a material with the images that it names.
pub(super) fn read(source: &Source, maps: &mut Maps<'_>, warnings: &Warnings) -> Material {
    for key in LEFT_OUT {
        if let Some(rest) = source.rest(&[key]) {
            rest.warn(format!("{key} is left out"), warnings);
        }
    }
    let mut reader = Reader { source, maps, warnings };
    let mut material = Material { name: source.name.clone(), double_sided: true, ..Material::default() };
    let diffuse = reader.color("kd");
    let opacity = reader.opacity();
    material.base_color = diffuse.unwrap_or(Vec3::splat(0.8)).extend(opacity);
    material.ior = index_of_refraction(reader.number("ni"), opacity);
    reader.specular(&mut material);
    reader.emission(&mut material);
    reader.surface(&mut material);
    reader.normals(&mut material);
    reader.base_color(&mut material);
    reader.illumination(&mut material);
    material
}

struct Reader<'a, 'b> {
    source: &'a Source,
    maps: &'a mut Maps<'b>,
    warnings: &'a Warnings,
}

impl Reader<'_, '_> {
    fn color(&self, key: &str) -> Option<Vec3> {
        self.source.color(key, self.warnings)
    }

    fn number(&self, key: &str) -> Option<f32> {
        self.source.number(key, self.warnings)
    }

    fn image(&mut self, keys: &[&str]) -> Option<Image> {
        self.source.rest(keys).and_then(|rest| self.maps.image(rest))
    }

    /// `d`, else 1 - `Tr`.
    fn opacity(&self) -> f32 {
        let transparency = || self.number("tr").map(|share| 1.0 - share);
        self.number("d").or_else(transparency).unwrap_or(1.0).clamp(0.0, 1.0)
    }

    /// A Ks of 0.5 stands for the 4 % that common dielectrics reflect.
    fn specular(&mut self, material: &mut Material) {
        let given = self.color("ks");
        if let Some(image) = self.image(&["map_ks"]) {
            material.specular_color = 2.0 * beside_map(given);
            material.specular_color_texture = Some(self.maps.color(&image));
        } else if let Some(specular) = given {
            let strongest = specular.max_element();
            material.specular = (2.0 * strongest).min(1.0);
            if strongest > 0.0 {
                material.specular_color = specular / strongest;
            }
        }
    }

    fn emission(&mut self, material: &mut Material) {
        let mut emitted = self.color("ke").unwrap_or(Vec3::ZERO);
        if let Some(image) = self.image(&["map_ke"]) {
            emitted = beside_map(Some(emitted));
            material.emissive_texture = Some(self.maps.color(&image));
        }
        let strength = emitted.max_element().max(1.0);
        material.emissive = emitted / strength;
        material.emissive_strength = strength.min(MAX_RADIANCE);
    }

    /// Roughness from Pr, else from Ns; metalness from Pm.
    fn surface(&mut self, material: &mut Material) {
        let (exponent, roughness, metallic) = (self.number("ns"), self.number("pr"), self.number("pm"));
        material.roughness = roughness
            .map(|roughness| roughness.clamp(0.0, 1.0))
            .or_else(|| exponent.map(roughness_of_exponent))
            .unwrap_or(1.0);
        material.metallic = metallic.unwrap_or(0.0).clamp(0.0, 1.0);
        let rough_image = self.image(&["map_pr"]);
        let factor_image = if rough_image.is_none() { self.image(&["map_ns"]) } else { None };
        let metal_image = self.image(&["map_pm"]);
        let factor_of = factor_image.is_some().then_some(exponent.unwrap_or(MOST_EXPONENT));
        if factor_of.is_some()
            || (rough_image.is_some() && material.roughness == 0.0)
            || (rough_image.is_some() && roughness.is_none())
        {
            material.roughness = 1.0;
        }
        if metal_image.is_some() && material.metallic == 0.0 {
            material.metallic = 1.0;
        }
        let first = rough_image.or(factor_image);
        self.warn_of_other_place(first.as_ref(), metal_image.as_ref(), "map_pm");
        material.metallic_roughness_texture =
            self.maps.surface(first.as_ref(), metal_image.as_ref(), factor_of);
    }

    /// `norm` is a normal map; `bump` is one where it is bluish, else heights.
    fn normals(&mut self, material: &mut Material) {
        if let Some(image) = self.image(&["norm", "map_kn"]) {
            material.normal_texture = Some(self.maps.normals(&image));
            material.normal_scale = image.map.bump;
        } else if let Some(image) = self.image(&["map_bump", "bump"]) {
            if image.pixels.placeholder {
                return;
            }
            material.normal_texture = Some(if is_normal_map(&image.pixels) {
                material.normal_scale = image.map.bump;
                self.maps.normals(&image)
            } else {
                self.maps.heights(&image)
            });
        }
    }

    /// Kd, map_Kd and map_d, and the alpha mode that they ask for.
    fn base_color(&mut self, material: &mut Material) {
        let color = self.image(&["map_kd"]);
        if color.is_some() {
            let opacity = material.base_color.w;
            material.base_color = beside_map(Some(material.base_color.truncate())).extend(opacity);
        }
        let opacity = self.image(&["map_d"]).filter(|image| !image.pixels.placeholder);
        self.warn_of_other_place(color.as_ref(), opacity.as_ref(), "map_d");
        let (texture, alpha): (Option<TextureUse>, _) = match (&color, &opacity) {
            (color, Some(opacity)) => {
                let (texture, alpha) = self.maps.with_opacity(color.as_ref(), opacity);
                (Some(texture), alpha)
            }
            (Some(color), None) => (Some(self.maps.color(color)), Alpha::Full),
            (None, None) => (None, Alpha::Full),
        };
        material.base_color_texture = texture;
        material.alpha = match alpha {
            Alpha::Full if material.base_color.w == 1.0 => AlphaMode::Opaque,
            Alpha::Holes if material.base_color.w == 1.0 => AlphaMode::Mask { cutoff: 0.5 },
            _ => AlphaMode::Blend,
        };
    }

    /// Two images in one texture lie on the surface in one way.
    fn warn_of_other_place(&self, first: Option<&Image>, second: Option<&Image>, key: &str) {
        if let (Some(first), Some(second), Some(rest)) = (first, second, self.source.rest(&[key]))
            && !first.map.lies_like(&second.map)
        {
            let text = format!(
                "its -s, -o and -clamp differ from those of {}, which are taken for both",
                first.map.file
            );
            rest.warn(text, self.warnings);
        }
    }

    /// The mirrors and glasses among the illumination models.
    fn illumination(&mut self, material: &mut Material) {
        let Some(model) = self.number("illum").map(|model| model as i32) else {
            return;
        };
        let diffuse = material.base_color.truncate().max_element();
        let opacity = material.base_color.w;
        let specular = self.color("ks").unwrap_or(Vec3::ZERO);
        let filter = self.color("tf");
        let clear = filter.is_some_and(|filter| diffuse <= BLACK * filter.max_element());
        match model {
            3 | 5
                if material.base_color_texture.is_none()
                    && specular.max_element() > MIRROR_SPECULAR
                    && diffuse <= BLACK * specular.max_element() =>
            {
                material.mode = ShadingMode::Reflective;
                material.base_color = specular.extend(1.0);
                material.alpha = AlphaMode::Opaque;
            }
            4 | 6 | 7 | 9 if opacity < 1.0 || clear => {
                material.mode = ShadingMode::Refractive;
                material.transmission = 1.0;
                material.has_volume = true;
                material.roughness = 0.0;
                material.base_color = filter.unwrap_or(Vec3::ONE).min(Vec3::ONE).extend(1.0);
                material.alpha = AlphaMode::Opaque;
            }
            _ => {}
        }
    }
}

/// Exporters write black beside a map; multiplied it would hide the map.
fn beside_map(factor: Option<Vec3>) -> Vec3 {
    factor.filter(|&factor| factor != Vec3::ZERO).unwrap_or(Vec3::ONE)
}

/// Exporters write 1 where they mean nothing; an opaque surface of index 1 would reflect nothing.
fn index_of_refraction(given: Option<f32>, opacity: f32) -> f32 {
    match given {
        Some(index) if opacity < 1.0 || index > 1.0 => index.clamp(1.0, 10.0),
        _ => 1.5,
    }
}

/// Largest exponent that MTL speaks of; what a map without Ns is a factor of.
const MOST_EXPONENT: f32 = 1000.0;

/// From the Blinn-Phong exponent: alpha^2 = 2 / (Ns + 2), and alpha is the square of the roughness.
pub(super) fn roughness_of_exponent(exponent: f32) -> f32 {
    (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25)
}
