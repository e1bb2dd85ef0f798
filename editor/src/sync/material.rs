//! Materials of the document as the renderer wants them. Lobes without strength, and textures that the renderer does not
//! look at, stay behind.

use caustica_renderer::delta;
use caustica_scene as scene;

/// A material. Textures that are gone are left out.
pub fn material_of(
    material: &scene::Material,
    is_there: impl Fn(scene::TextureId) -> bool,
) -> delta::Material {
    let texture = |used: &Option<scene::TextureUse>| {
        used.filter(|used| is_there(used.texture)).map(|used| delta::TextureUse {
            texture: delta::TextureId(used.texture.0),
            tex_coord: used.tex_coord,
            offset: used.offset,
            rotation_rad: used.rotation_rad,
            scale: used.scale,
        })
    };
    let converted = delta::Material {
        mode: match material.mode {
            scene::ShadingMode::Pbr => delta::ShadingMode::Pbr,
            scene::ShadingMode::Reflective => delta::ShadingMode::Reflective,
            scene::ShadingMode::Refractive => delta::ShadingMode::Refractive,
            scene::ShadingMode::Unlit => delta::ShadingMode::Unlit,
        },
        base_color: material.base_color,
        base_color_texture: texture(&material.base_color_texture),
        metallic: material.metallic,
        roughness: material.roughness,
        metallic_roughness_texture: texture(&material.metallic_roughness_texture),
        normal_texture: texture(&material.normal_texture),
        normal_scale: material.normal_scale,
        occlusion_texture: texture(&material.occlusion_texture),
        occlusion_strength: material.occlusion_strength,
        emissive: material.emitted_radiance(),
        emissive_texture: texture(&material.emissive_texture),
        ior: material.ior,
        specular: material.specular,
        specular_color: material.specular_color,
        transmission: material.transmission,
        has_volume: material.has_volume,
        volume_priority: material.volume_priority,
        attenuation_color: material.attenuation_color,
        attenuation_distance_m: material.attenuation_distance_m.unwrap_or(f32::INFINITY),
        lobes: Some(Box::new(lobes_of(material, &texture))).filter(|lobes| !lobes.is_plain()),
        alpha: match material.alpha {
            scene::AlphaMode::Opaque => delta::AlphaMode::Opaque,
            scene::AlphaMode::Mask { cutoff } => delta::AlphaMode::Mask { cutoff },
            scene::AlphaMode::Blend => delta::AlphaMode::Blend,
        },
        double_sided: material.double_sided,
    };
    match (&material.specular_glossiness, material.mode) {
        (Some(lobe), scene::ShadingMode::Pbr) => by_reflectance(converted, lobe),
        _ => converted,
    }
}

/// Specular-glossiness: a dielectric whose reflectance at normal incidence is the colour given. The index is so large that
/// the F0 of its interface is 1 in single precision, which that colour scales.
fn by_reflectance(material: delta::Material, lobe: &scene::SpecularGlossiness) -> delta::Material {
    const INFINITE_IOR: f32 = 1e9;
    delta::Material {
        metallic: 0.0,
        roughness: 1.0 - lobe.glossiness,
        metallic_roughness_texture: None,
        ior: INFINITE_IOR,
        specular: 1.0,
        specular_color: lobe.specular,
        ..material
    }
}

/// What the material has beside metallic-roughness, as far as its mode shows it.
fn lobes_of(
    material: &scene::Material,
    texture: &impl Fn(&Option<scene::TextureUse>) -> Option<delta::TextureUse>,
) -> delta::Lobes {
    let mut lobes = delta::Lobes::default();
    match material.mode {
        scene::ShadingMode::Reflective | scene::ShadingMode::Unlit => return lobes,
        scene::ShadingMode::Refractive | scene::ShadingMode::Pbr => lobes.dispersion = material.dispersion,
    }
    if material.mode == scene::ShadingMode::Refractive {
        return lobes;
    }
    lobes.transmission_texture =
        texture(&material.transmission_texture).filter(|_| material.transmission > 0.0);
    match &material.specular_glossiness {
        Some(lobe) => {
            lobes.glossiness = Some(lobe.glossiness);
            lobes.specular_color_texture = texture(&lobe.texture);
        }
        None => {
            lobes.specular_texture = texture(&material.specular_texture);
            lobes.specular_color_texture = texture(&material.specular_color_texture);
        }
    }
    if let Some(lobe) = material.anisotropy.as_ref().filter(|lobe| lobe.strength > 0.0) {
        lobes.anisotropy = lobe.strength;
        lobes.anisotropy_rotation_rad = lobe.rotation_rad;
        lobes.anisotropy_texture = texture(&lobe.texture);
    }
    if let Some(lobe) = material.clearcoat.as_ref().filter(|lobe| lobe.factor > 0.0) {
        lobes.clearcoat = lobe.factor;
        lobes.clearcoat_texture = texture(&lobe.texture);
        lobes.clearcoat_roughness = lobe.roughness;
        lobes.clearcoat_roughness_texture = texture(&lobe.roughness_texture);
        lobes.clearcoat_normal_texture = texture(&lobe.normal_texture);
        lobes.clearcoat_normal_scale = lobe.normal_scale;
    }
    if let Some(lobe) = material.iridescence.as_ref().filter(|lobe| lobe.factor > 0.0) {
        lobes.iridescence = lobe.factor;
        lobes.iridescence_texture = texture(&lobe.texture);
        lobes.iridescence_ior = lobe.ior;
        lobes.iridescence_thickness_min_nm = lobe.thickness_min_nm;
        lobes.iridescence_thickness_max_nm = lobe.thickness_max_nm;
        lobes.iridescence_thickness_texture = texture(&lobe.thickness_texture);
    }
    if let Some(lobe) = material.sheen.as_ref().filter(|lobe| lobe.color.max_element() > 0.0) {
        lobes.sheen_color = lobe.color;
        lobes.sheen_color_texture = texture(&lobe.color_texture);
        lobes.sheen_roughness = lobe.roughness;
        lobes.sheen_roughness_texture = texture(&lobe.roughness_texture);
    }
    if let Some(lobe) = material.diffuse_transmission.as_ref().filter(|lobe| lobe.factor > 0.0) {
        lobes.diffuse_transmission = lobe.factor;
        lobes.diffuse_transmission_texture = texture(&lobe.texture);
        lobes.diffuse_transmission_color = lobe.color;
        lobes.diffuse_transmission_color_texture = texture(&lobe.color_texture);
    }
    lobes
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use glam::Vec3;

    fn sent(material: &scene::Material) -> delta::Material {
        material_of(material, |id| id.0 != 13)
    }

    #[test]
    fn plain_materials_and_lobes_without_strength_bring_no_record() {
        let texture = Some(scene::TextureUse::new(scene::TextureId(1)));
        let material = scene::Material {
            clearcoat: Some(scene::Clearcoat { texture, ..Default::default() }),
            sheen: Some(scene::Sheen { color_texture: texture, ..Default::default() }),
            thickness_texture: texture,
            transmission_texture: texture,
            ..Default::default()
        };
        let sent = sent(&material);
        assert!(sent.lobes.is_none());
        assert_eq!(sent.textures().count(), 0, "textures that nothing looks at are not uploaded");
    }

    #[test]
    fn lobes_are_sent_with_their_textures_and_without_those_that_are_gone() {
        let texture = |id| Some(scene::TextureUse::new(scene::TextureId(id)));
        let material = scene::Material {
            specular_texture: texture(1),
            clearcoat: Some(scene::Clearcoat {
                factor: 0.5,
                texture: texture(2),
                roughness_texture: texture(13),
                ..Default::default()
            }),
            ..Default::default()
        };
        let lobes = sent(&material).lobes.unwrap();
        assert_eq!(lobes.clearcoat, 0.5);
        assert!(lobes.clearcoat_roughness_texture.is_none());
        let used: Vec<u64> = sent(&material).textures().map(|used| used.texture.0).collect();
        assert_eq!(used, [1, 2]);
        let unlit = scene::Material { mode: scene::ShadingMode::Unlit, ..material };
        assert!(sent(&unlit).lobes.is_none());
    }

    #[test]
    fn specular_glossiness_is_a_dielectric_of_that_reflectance() {
        let lobe =
            scene::SpecularGlossiness { specular: Vec3::new(0.2, 0.4, 0.6), glossiness: 0.75, texture: None };
        let material = scene::Material { specular_glossiness: Some(lobe), ..Default::default() };
        let sent = sent(&material);
        assert_eq!((sent.metallic, sent.roughness, sent.specular), (0.0, 0.25, 1.0));
        assert_eq!(sent.specular_color, Vec3::new(0.2, 0.4, 0.6));
        let interface = (sent.ior - 1.0) / (sent.ior + 1.0);
        assert_eq!(interface * interface, 1.0, "F0 is the colour itself");
        assert_eq!(sent.lobes.unwrap().glossiness, Some(0.75));
    }
}
