//! MTL materials to the document's: Kd, Ks, Ke, Ni, d, Ns, map_Kd, and Pm/Pr where they are given.
//! In: what tobj read. Out: materials and textures; what cannot be read becomes a warning. OBJ knows no
//! single-sided faces, so all materials are double-sided.

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec3, Vec4};

use crate::assets::{AlphaMode, Material, Sampler, ShadingMode, Texture, TextureUse};
use crate::ids::TextureId;
use crate::import::gltf::buffers::read_file;
use crate::import::image::{decode, placeholder};
use crate::import::{ImportOptions, uri};

/// Largest image file that is read, bytes.
const MAX_IMAGE_FILE_BYTES: u64 = 1 << 30;

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

/// Reads all materials with the images that they name.
pub(super) fn read_all(
    materials: &[tobj::Material],
    folder: &Path,
    options: &ImportOptions,
    warn: &dyn Fn(String, String),
) -> (Vec<Material>, Vec<Texture>) {
    let mut textures: Vec<Texture> = Vec::new();
    let mut known: HashMap<&str, TextureId> = HashMap::new();
    let read = materials
        .iter()
        .map(|source| {
            let mut material = read(source);
            let place = format!("material {}", source.name);
            let others = [&source.normal_texture, &source.dissolve_texture, &source.specular_texture];
            if others.into_iter().any(Option::is_some) {
                let text = "of its images only map_Kd is read".to_owned();
                warn(place.clone(), text);
            }
            let file = source.diffuse_texture.as_deref().map(file_name);
            if let Some(file) = file.filter(|file| !file.is_empty()) {
                let id = *known.entry(file).or_insert_with(|| {
                    let texture = read_texture(file, folder, options, &place, warn);
                    textures.push(texture);
                    TextureId(textures.len() as u64 - 1)
                });
                material.base_color_texture = Some(TextureUse::new(id));
                // Exporters write a black Kd beside a map; multiplied it would hide the map.
                if material.base_color.truncate() == Vec3::ZERO {
                    material.base_color = Vec3::ONE.extend(material.base_color.w);
                }
            }
            material
        })
        .collect();
    (read, textures)
}

/// The name after the options of a map line (`-s 1 1 1 wood.png`).
fn file_name(text: &str) -> &str {
    let text = text.trim();
    if text.starts_with('-') { text.split_whitespace().next_back().unwrap_or("") } else { text }
}

fn read_texture(
    file: &str,
    folder: &Path,
    options: &ImportOptions,
    place: &str,
    warn: &dyn Fn(String, String),
) -> Texture {
    let pixels = uri::beside(file, folder)
        .and_then(|path| read_file(&path, MAX_IMAGE_FILE_BYTES))
        .and_then(|bytes| decode(bytes, options.max_image_extent_px))
        .unwrap_or_else(|reason| {
            let text = format!("{file} cannot be read ({reason}); a checker stands in");
            warn(place.to_owned(), text);
            placeholder()
        });
    Texture {
        name: file.to_owned(),
        width: pixels.width,
        height: pixels.height,
        rgba8: pixels.rgba8,
        srgb: true,
        sampler: Sampler::default(),
        placeholder: pixels.placeholder,
        encoded: pixels.encoded,
    }
}

fn read(source: &tobj::Material) -> Material {
    let color = |value: Option<[f32; 3]>| value.map(Vec3::from).filter(|v| v.is_finite());
    let number = |value: Option<f32>| value.filter(|v| v.is_finite());
    let extra = |key: &str| {
        let text = source.unknown_param.get(key)?;
        number(text.trim().parse().ok())
    };
    let diffuse = color(source.diffuse).unwrap_or(Vec3::splat(0.8)).max(Vec3::ZERO);
    let opacity = number(source.dissolve).unwrap_or(1.0).clamp(0.0, 1.0);
    let mut material = Material {
        name: source.name.clone(),
        base_color: diffuse.extend(opacity),
        metallic: extra("Pm").unwrap_or(0.0).clamp(0.0, 1.0),
        roughness: roughness(number(source.shininess), extra("Pr")),
        ior: index_of_refraction(number(source.optical_density), opacity),
        double_sided: true,
        ..Material::default()
    };
    if let Some(specular) = color(source.specular) {
        // A Ks of 0.5 stands for the 4 % that common dielectrics reflect.
        let strongest = specular.max_element().max(0.0);
        material.specular = (2.0 * strongest).min(1.0);
        if strongest > 0.0 {
            material.specular_color = (specular / strongest).max(Vec3::ZERO);
        }
    }
    if let Some(emissive) = color(source.emissive) {
        let strength = emissive.max_element().max(1.0);
        material.emissive = emissive.max(Vec3::ZERO) / strength;
        material.emissive_strength = strength;
    }
    let specular = color(source.specular).unwrap_or(Vec3::ZERO);
    match source.illumination_model {
        // Mirrors: all reflection, no diffuse part.
        Some(3 | 5) if diffuse.max_element() == 0.0 && specular.max_element() > 0.5 => {
            material.mode = ShadingMode::Reflective;
            material.base_color = specular.extend(1.0);
        }
        // Glass: transparent with refraction.
        Some(4 | 6 | 7 | 9) if opacity < 1.0 => {
            material.mode = ShadingMode::Refractive;
            material.transmission = 1.0;
            material.has_volume = true;
            material.roughness = 0.0;
            material.base_color = Vec4::ONE;
        }
        _ if opacity < 1.0 => material.alpha = AlphaMode::Blend,
        _ => {}
    }
    material
}

/// Exporters write 1 where they mean nothing; an opaque surface of index 1 would reflect nothing.
fn index_of_refraction(given: Option<f32>, opacity: f32) -> f32 {
    match given {
        Some(index) if opacity < 1.0 || index > 1.0 => index.clamp(1.0, 10.0),
        _ => 1.5,
    }
}

/// From the Blinn-Phong exponent: alpha^2 = 2 / (Ns + 2), and alpha is the square of the roughness.
fn roughness(shininess: Option<f32>, given: Option<f32>) -> f32 {
    match (given, shininess) {
        (Some(given), _) => given.clamp(0.0, 1.0),
        (None, Some(exponent)) => (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25),
        (None, None) => 1.0,
    }
}
