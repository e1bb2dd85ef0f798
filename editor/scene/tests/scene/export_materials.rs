//! Exports of materials: every number and texture, and shading modes for which glTF has no word.

use std::path::Path;

use caustica_scene::import::Imported;
use caustica_scene::{
    AlphaMode, Anisotropy, Clearcoat, DiffuseTransmission, Edit, Iridescence, Material, ShadingMode, Sheen,
    SpecularGlossiness, TextureId, TextureUse,
};
use glam::{Vec2, Vec3, Vec4};
use serde_json::json;

use crate::common::{PLATE, scene};
use crate::export::{exported, placed, read};
use crate::export_edits::{add_material, apply};
use crate::gltf_file::{GltfFile, SQUARE};

/// A square with a texture and a material in which every number is another than what is read without it.
pub fn full_material(folder: &Path) -> (Imported, Material) {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    let uv = file.floats("VEC2", 2, &[0.5; 12]);
    let attributes = json!({"POSITION": position, "TEXCOORD_0": uv, "TEXCOORD_1": uv});
    file.push("meshes", json!({"primitives": [{"attributes": attributes, "material": 0}]}));
    file.push("materials", json!({"emissiveTexture": {"index": 0}}));
    file.push("textures", json!({}));
    file.push("nodes", json!({"mesh": 0}));
    file.push("scenes", json!({"nodes": [0]}));
    let mut imported = read(&file.write(folder));
    imported.textures[0].placeholder = false;
    let plain = TextureUse::new(TextureId(0));
    let turned = TextureUse {
        tex_coord: 1,
        offset: Vec2::new(0.1, 0.2),
        rotation_rad: 0.3,
        scale: Vec2::ONE * 2.0,
        ..plain
    };
    let material = Material {
        name: "full".to_owned(),
        mode: ShadingMode::Pbr,
        base_color: Vec4::new(0.1, 0.2, 0.3, 0.4),
        metallic: 0.5,
        roughness: 0.6,
        normal_scale: 0.7,
        occlusion_strength: 0.8,
        emissive: Vec3::new(0.9, 0.1, 0.2),
        emissive_strength: 12.3,
        ior: 1.33,
        specular: 0.45,
        specular_color: Vec3::new(1.5, 0.6, 0.7),
        transmission: 0.35,
        has_volume: true,
        thickness_m: 0.25,
        volume_priority: 200,
        attenuation_color: Vec3::new(0.3, 0.2, 0.1),
        attenuation_distance_m: Some(0.15),
        dispersion: 0.05,
        anisotropy: Some(Anisotropy { strength: 0.1, rotation_rad: 1.1, texture: None }),
        clearcoat: Some(Clearcoat { factor: 0.2, roughness: 0.3, normal_scale: 0.4, ..Clearcoat::default() }),
        iridescence: Some(Iridescence {
            factor: 0.1,
            ior: 1.7,
            thickness_min_nm: 50.0,
            thickness_max_nm: 250.0,
            ..Iridescence::default()
        }),
        sheen: Some(Sheen { color: Vec3::new(0.2, 0.3, 0.4), roughness: 0.5, ..Sheen::default() }),
        diffuse_transmission: Some(DiffuseTransmission {
            factor: 0.6,
            color: Vec3::new(0.7, 0.8, 0.9),
            ..DiffuseTransmission::default()
        }),
        alpha: AlphaMode::Mask { cutoff: 0.3 },
        double_sided: true,
        ..Material::default()
    };
    let mut material = material;
    for (number, slot) in material.texture_slots_mut().enumerate() {
        *slot = Some(if number.is_multiple_of(2) { plain } else { turned });
    }
    imported.materials[0] = material.clone();
    (imported, material)
}

#[test]
fn every_part_of_a_material_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let (mut imported, mut full) = full_material(folder.path());
    let (path, _) = exported(&placed(imported.clone()), folder.path(), "full.glb");
    let read_back = || {
        let mut again = read(&path).materials.remove(0);
        // One texture here is two in the file: a colour, and data.
        again.texture_slots_mut().flatten().for_each(|texture_use| texture_use.texture = TextureId(0));
        again
    };
    assert_eq!(read_back(), full);

    // The older model goes without a metallic-roughness texture.
    full.specular_glossiness = Some(SpecularGlossiness {
        specular: Vec3::new(0.1, 0.2, 0.3),
        glossiness: 0.4,
        texture: full.base_color_texture,
    });
    full.metallic_roughness_texture = None;
    imported.materials[0] = full.clone();
    exported(&placed(imported), folder.path(), "full.glb");
    assert_eq!(read_back(), full);
}

#[test]
fn shading_modes_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let target = scene.part(PLATE);
    let glass = Material {
        mode: ShadingMode::Refractive,
        transmission: 1.0,
        roughness: 0.0,
        metallic: 0.0,
        has_volume: true,
        ior: 1.52,
        attenuation_distance_m: Some(0.1),
        volume_priority: 7,
        ..Material::default()
    };
    let cases = [
        Material { mode: ShadingMode::Reflective, roughness: 0.4, ..Material::default() },
        Material { mode: ShadingMode::Refractive, ior: 2.417, ..Material::default() },
        Material { mode: ShadingMode::Pbr, ..glass.clone() },
        Material { mode: ShadingMode::Unlit, ..Material::default() },
        glass,
    ];
    for case in cases {
        let material = add_material(&mut scene.document, case.clone());
        apply(&mut scene.document, Edit::AssignMaterial { target, primitive: 0, material });
        let (path, _) = exported(&scene.document, folder.path(), "modes.glb");
        let again = read(&path).materials.pop().unwrap();
        assert_eq!((again.mode, again.ior), (case.mode, case.ior));
        assert_eq!((again.volume_priority, again.has_volume), (case.volume_priority, case.has_volume));
        if case.mode == ShadingMode::Reflective {
            assert_eq!((again.metallic, again.roughness), (1.0, 0.0), "a mirror in other programs too");
        }
        if case.mode == ShadingMode::Refractive {
            assert!(again.transmission == 1.0 && again.metallic == 0.0, "glass in other programs too");
        }
    }
}
