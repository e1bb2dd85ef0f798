//! Materials: metallic-roughness, and each extension that says something other than its absence.
//! In: a [`Material`]. Out: its JSON, which import reads back as the same material. What the shading mode does not look at
//! is written so that other programs show the same.

use glam::{Vec3, Vec4};

use super::foreign::Sources;
use super::json::{Extensions, Object, Put, number, numbers};
use super::texture::Textures;
use crate::assets::{AlphaMode, MAX_RADIANCE, Material, ShadingMode, SpecularGlossiness, TextureUse};
use crate::import::gltf::{INFINITE_IOR, is_smooth_glass};

mod lobes;

/// Thickness of volumes that have none, metres: any above 0 says that there is a volume.
const SOME_THICKNESS_M: f32 = 1.0;

/// Writes materials.
pub(super) struct MaterialWriter<'a, 'b> {
    pub textures: &'a mut Textures<'b>,
    pub used: &'a mut Extensions,
    pub sources: &'a Sources<'a>,
}

impl MaterialWriter<'_, '_> {
    /// A material, and what of its `extras` is ours.
    pub fn write(&mut self, source: &Material) -> (Object, Object) {
        let material = &as_shown(source);
        let mut object = Object::new();
        object.put_text("name", &material.name);
        object.put_filled("pbrMetallicRoughness", self.metallic_roughness(material));
        self.put_map(&mut object, "normalTexture", &material.normal_texture, "scale", material.normal_scale);
        let strength = material.occlusion_strength;
        self.put_map(&mut object, "occlusionTexture", &material.occlusion_texture, "strength", strength);
        self.put_texture(&mut object, "emissiveTexture", &material.emissive_texture);
        object.put_numbers("emissiveFactor", material.emissive, [0.0; 3]);
        match material.alpha {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { cutoff } => {
                object.put("alphaMode", "MASK");
                object.put_number("alphaCutoff", cutoff, 0.5);
            }
            AlphaMode::Blend => object.put("alphaMode", "BLEND"),
        }
        if material.double_sided {
            object.put("doubleSided", true);
        }
        self.extensions(&mut object, material);
        self.lobes(&mut object, material);
        (object, own_extras(source, material))
    }

    fn metallic_roughness(&mut self, material: &Material) -> Object {
        let mut pbr = Object::new();
        pbr.put_numbers("baseColorFactor", material.base_color, [1.0; 4]);
        self.put_texture(&mut pbr, "baseColorTexture", &material.base_color_texture);
        pbr.put_number("metallicFactor", material.metallic, 1.0);
        pbr.put_number("roughnessFactor", material.roughness, 1.0);
        self.put_texture(&mut pbr, "metallicRoughnessTexture", &material.metallic_roughness_texture);
        pbr
    }

    /// Extensions that refine what every material has.
    fn extensions(&mut self, object: &mut Object, material: &Material) {
        if material.mode == ShadingMode::Unlit {
            self.used.put(object, "KHR_materials_unlit", Object::new());
        }
        let mut strength = Object::new();
        strength.put_number("emissiveStrength", material.emissive_strength, 1.0);
        self.put_extension(object, "KHR_materials_emissive_strength", strength);
        let mut index = Object::new();
        // 0 stands for an infinite index.
        index.put_number("ior", if material.ior >= INFINITE_IOR { 0.0 } else { material.ior }, 1.5);
        self.put_extension(object, "KHR_materials_ior", index);
        let mut specular = Object::new();
        specular.put_number("specularFactor", material.specular, 1.0);
        self.put_texture(&mut specular, "specularTexture", &material.specular_texture);
        specular.put_numbers("specularColorFactor", material.specular_color, [1.0; 3]);
        self.put_texture(&mut specular, "specularColorTexture", &material.specular_color_texture);
        self.put_extension(object, "KHR_materials_specular", specular);
        let mut transmission = Object::new();
        transmission.put_number("transmissionFactor", material.transmission, 0.0);
        self.put_texture(&mut transmission, "transmissionTexture", &material.transmission_texture);
        self.put_extension(object, "KHR_materials_transmission", transmission);
        let mut volume = Object::new();
        volume.put_number("thicknessFactor", thickness_m(material), 0.0);
        self.put_texture(&mut volume, "thicknessTexture", &material.thickness_texture);
        volume.put_numbers("attenuationColor", material.attenuation_color, [1.0; 3]);
        if let Some(distance_m) = material.attenuation_distance_m {
            volume.put("attenuationDistance", number(distance_m));
        }
        self.put_extension(object, "KHR_materials_volume", volume);
        let mut dispersion = Object::new();
        dispersion.put_number("dispersion", material.dispersion, 0.0);
        self.put_extension(object, "KHR_materials_dispersion", dispersion);
    }

    /// An extension that says nothing is left out.
    fn put_extension(&mut self, object: &mut Object, name: &str, value: Object) {
        if !value.is_empty() {
            self.used.put(object, name, value);
        }
    }

    /// A texture with a number of its own that is 1 where it is absent.
    fn put_map(
        &mut self,
        object: &mut Object,
        key: &str,
        map: &Option<TextureUse>,
        factor: &str,
        value: f32,
    ) {
        if let Some(mut info) = map.as_ref().and_then(|map| self.info(map)) {
            info.put_number(factor, value, 1.0);
            object.put(key, info);
        }
    }

    fn put_texture(&mut self, object: &mut Object, key: &str, texture: &Option<TextureUse>) {
        if let Some(info) = texture.as_ref().and_then(|texture| self.info(texture)) {
            object.put(key, info);
        }
    }

    fn info(&mut self, texture: &TextureUse) -> Option<Object> {
        let mut info = Object::new();
        info.put("index", self.textures.place(texture.texture, self.sources, self.used)?);
        if texture.tex_coord != 0 {
            info.put("texCoord", texture.tex_coord);
        }
        let mut transform = Object::new();
        transform.put_numbers("offset", texture.offset, [0.0; 2]);
        transform.put_number("rotation", texture.rotation_rad, 0.0);
        transform.put_numbers("scale", texture.scale, [1.0; 2]);
        self.put_extension(&mut info, "KHR_texture_transform", transform);
        Some(info)
    }
}

/// What import does not read from the values: the mode where they say another one, and what glTF has no word for.
fn own_extras(source: &Material, written: &Material) -> Object {
    let mut extras = Object::new();
    let read_as = match is_smooth_glass(written) {
        true => ShadingMode::Refractive,
        false => ShadingMode::Pbr,
    };
    if source.mode != ShadingMode::Unlit && source.mode != read_as {
        extras.put("shadingMode", source.mode.name());
    }
    if source.volume_priority != 0 {
        extras.put("volumePriority", source.volume_priority);
    }
    extras
}

/// The material with values that show the same in programs that know no shading modes, and within the ranges of glTF.
fn as_shown(source: &Material) -> Material {
    let mut material = source.clone();
    match source.mode {
        ShadingMode::Reflective => {
            (material.metallic, material.roughness) = (1.0, 0.0);
            material.metallic_roughness_texture = None;
            material.specular_glossiness = None;
        }
        ShadingMode::Refractive if !is_smooth_glass(source) => {
            (material.metallic, material.roughness, material.transmission) = (0.0, 0.0, 1.0);
            (material.metallic_roughness_texture, material.transmission_texture) = (None, None);
            (material.specular, material.specular_color) = (1.0, Vec3::ONE);
            (material.specular_texture, material.specular_color_texture) = (None, None);
            (material.anisotropy, material.clearcoat, material.iridescence) = (None, None, None);
            (material.sheen, material.diffuse_transmission, material.specular_glossiness) =
                (None, None, None);
        }
        ShadingMode::Refractive | ShadingMode::Pbr | ShadingMode::Unlit => {}
    }
    material.base_color = material.base_color.clamp(Vec4::ZERO, Vec4::ONE);
    // A colour above 1 is a colour with more strength.
    let brightest = material.emissive.max_element();
    if brightest > 1.0 {
        material.emissive /= brightest;
        material.emissive_strength *= brightest;
    }
    material.emissive_strength = material.emissive_strength.min(MAX_RADIANCE);
    material
}

fn thickness_m(material: &Material) -> f32 {
    match material.has_volume {
        true if material.thickness_m > 0.0 => material.thickness_m,
        true => SOME_THICKNESS_M,
        false => 0.0,
    }
}
