//! Lobes of materials: read under the extensions' names with their defaults, held to their ranges, kept in projects.

use std::path::{Path, PathBuf};

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{
    Anisotropy, Clearcoat, DiffuseTransmission, Edit, Iridescence, Material, Project, ProjectMeta,
    ShadingMode, Sheen, SpecularGlossiness, TextureUse, audit,
};
use glam::{Vec2, Vec3, Vec4};

/// One triangle with these materials, and three textures of images that are not there.
fn file(folder: &Path, materials: &str) -> PathBuf {
    let path = folder.join("lobes.gltf");
    let buffer = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"materials":[{materials}],"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "textures":[{{"source":0}},{{"source":1}},{{"source":2}}],
        "images":[{{"uri":"a.png"}},{{"uri":"b.png"}},{{"uri":"c.png"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "extensionsRequired":["KHR_materials_anisotropy","KHR_materials_clearcoat","KHR_materials_dispersion",
          "KHR_materials_iridescence","KHR_materials_sheen","KHR_materials_diffuse_transmission",
          "KHR_materials_pbrSpecularGlossiness"],
        "buffers":[{{"byteLength":36,"uri":"data:;base64,{buffer}"}}]}}"#
    );
    std::fs::write(&path, json).unwrap();
    path
}

fn material_with(folder: &Path, extension: &str, members: &str) -> (Material, Imported) {
    let text = format!(r#"{{"extensions":{{"KHR_materials_{extension}":{members}}}}}"#);
    let imported = load(&file(folder, &text), &ImportOptions::default()).unwrap();
    (imported.materials[0].clone(), imported)
}

/// Name of the image and whether it was read as colour.
fn image(imported: &Imported, used: &Option<TextureUse>) -> (String, bool) {
    let texture = &imported.textures[used.unwrap().texture.0 as usize];
    (texture.name.clone(), texture.srgb)
}

#[test]
fn an_empty_extension_gives_the_defaults_of_its_text() {
    let folder = tempfile::tempdir().unwrap();
    let read = |extension| material_with(folder.path(), extension, "{}").0;
    let plain = Material::default();
    let expected = [
        ("anisotropy", Material { anisotropy: Some(Anisotropy::default()), ..plain.clone() }),
        ("clearcoat", Material { clearcoat: Some(Clearcoat::default()), ..plain.clone() }),
        ("dispersion", plain.clone()),
        ("iridescence", Material { iridescence: Some(Iridescence::default()), ..plain.clone() }),
        ("sheen", Material { sheen: Some(Sheen::default()), ..plain.clone() }),
        (
            "diffuse_transmission",
            Material { diffuse_transmission: Some(DiffuseTransmission::default()), ..plain.clone() },
        ),
        (
            "pbrSpecularGlossiness",
            Material { specular_glossiness: Some(SpecularGlossiness::default()), ..plain.clone() },
        ),
    ];
    for (extension, expected) in expected {
        assert_eq!(read(extension), expected, "{extension}");
    }
    let film = Iridescence::default();
    assert_eq!((film.ior, film.thickness_min_nm, film.thickness_max_nm), (1.3, 100.0, 400.0));
}

#[test]
fn factors_and_textures_are_read_under_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let (material, imported) = material_with(
        folder.path(),
        "clearcoat",
        r#"{"clearcoatFactor":0.25,"clearcoatRoughnessFactor":0.5,"clearcoatTexture":{"index":0},
        "clearcoatRoughnessTexture":{"index":1,"texCoord":1},"clearcoatNormalTexture":{"index":2,"scale":2.5,
          "extensions":{"KHR_texture_transform":{"offset":[0.5,0.25]}}}}"#,
    );
    let coat = material.clearcoat.unwrap();
    assert_eq!((coat.factor, coat.roughness, coat.normal_scale), (0.25, 0.5, 2.5));
    assert_eq!(coat.roughness_texture.unwrap().tex_coord, 1);
    assert_eq!(coat.normal_texture.unwrap().offset, Vec2::new(0.5, 0.25));
    assert_eq!(image(&imported, &coat.normal_texture), ("c.png".to_owned(), false));

    let (material, imported) = material_with(
        folder.path(),
        "sheen",
        r#"{"sheenColorFactor":[0.1,0.2,0.3],"sheenRoughnessFactor":0.4,"sheenColorTexture":{"index":1},
        "sheenRoughnessTexture":{"index":1}}"#,
    );
    let sheen = material.sheen.unwrap();
    assert_eq!((sheen.color, sheen.roughness), (Vec3::new(0.1, 0.2, 0.3), 0.4));
    assert_eq!(image(&imported, &sheen.color_texture), ("b.png".to_owned(), true));
    assert_eq!(image(&imported, &sheen.roughness_texture), ("b.png".to_owned(), false));

    let (material, imported) = material_with(
        folder.path(),
        "specular",
        r#"{"specularTexture":{"index":0},"specularColorTexture":{"index":1}}"#,
    );
    assert_eq!(image(&imported, &material.specular_texture), ("a.png".to_owned(), false));
    assert_eq!(image(&imported, &material.specular_color_texture), ("b.png".to_owned(), true));

    let members = r#"{"anisotropyStrength":0.5,"anisotropyRotation":1.5,"anisotropyTexture":{"index":0}}"#;
    let brushed = material_with(folder.path(), "anisotropy", members).0.anisotropy.unwrap();
    assert_eq!((brushed.strength, brushed.rotation_rad, brushed.texture.is_some()), (0.5, 1.5, true));
    let members = r#"{"iridescenceFactor":0.5,"iridescenceIor":1.8,"iridescenceThicknessMinimum":50,
        "iridescenceThicknessMaximum":900,"iridescenceThicknessTexture":{"index":0}}"#;
    let film = material_with(folder.path(), "iridescence", members).0.iridescence.unwrap();
    assert_eq!(
        (film.factor, film.ior, film.thickness_min_nm, film.thickness_max_nm),
        (0.5, 1.8, 50.0, 900.0)
    );
    assert_eq!(material_with(folder.path(), "dispersion", r#"{"dispersion":0.36}"#).0.dispersion, 0.36);
}

#[test]
fn specular_glossiness_takes_the_place_of_metallic_roughness() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"{"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1],"metallicRoughnessTexture":{"index":0}},
        "extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.1,0.2,0.3,0.5],
        "specularFactor":[0.4,0.5,0.6],"glossinessFactor":0.75,"specularGlossinessTexture":{"index":1}}}}"#;
    let imported = load(&file(folder.path(), text), &ImportOptions::default()).unwrap();
    let material = &imported.materials[0];
    assert_eq!(material.base_color, Vec4::new(0.1, 0.2, 0.3, 0.5));
    assert!(material.metallic_roughness_texture.is_none());
    let lobe = material.specular_glossiness.clone().unwrap();
    assert_eq!((lobe.specular, lobe.glossiness), (Vec3::new(0.4, 0.5, 0.6), 0.75));
    assert_eq!(image(&imported, &lobe.texture), ("b.png".to_owned(), true));
}

#[test]
fn values_out_of_their_range_are_held_to_it_with_a_warning_that_names_the_field() {
    let folder = tempfile::tempdir().unwrap();
    let (material, imported) = material_with(folder.path(), "clearcoat", r#"{"clearcoatFactor":1.5}"#);
    assert_eq!(material.clearcoat.unwrap().factor, 1.0);
    let warning = imported.warnings.iter().find(|w| w.place.ends_with("clearcoatFactor")).unwrap();
    assert_eq!(warning.place, "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor");
    assert_eq!(warning.message, "1.5 has to be within 0 and 1; 1 is taken");
    let (material, imported) = material_with(folder.path(), "dispersion", r#"{"dispersion":-1}"#);
    assert_eq!(material.dispersion, 0.0);
    assert!(imported.warnings.iter().any(|w| w.message == "-1 has to be at least 0; 0 is taken"));
    let text = r#"{"extensions":{"KHR_materials_sheen":{"sheenRoughnessFactor":"soft"}}}"#;
    let error = load(&file(folder.path(), text), &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("KHR_materials_sheen/sheenRoughnessFactor"), "{error}");
    let text = r#"{"extensions":{"KHR_materials_sheen":{"sheenColorTexture":{"index":9}}}}"#;
    let error = load(&file(folder.path(), text), &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("there is no texture 9"), "{error}");
}

#[test]
fn smooth_glass_has_its_mode_only_where_it_is_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let mode = |[metallic, roughness, transmission]: [f32; 3], more: &str| {
        let text = format!(
            r#"{{"pbrMetallicRoughness":{{"metallicFactor":{metallic},"roughnessFactor":{roughness}}},
            "extensions":{{"KHR_materials_transmission":{{"transmissionFactor":{transmission}}}{more}}}}}"#
        );
        load(&file(folder.path(), &text), &ImportOptions::default()).unwrap().materials[0].mode
    };
    let glass = [0.0, 0.0, 1.0];
    assert_eq!(mode(glass, ""), ShadingMode::Refractive);
    assert_eq!(mode(glass, r#","KHR_materials_dispersion":{"dispersion":1}"#), ShadingMode::Refractive);
    for lobe in [
        r#","KHR_materials_clearcoat":{"clearcoatFactor":1}"#,
        r#","KHR_materials_iridescence":{"iridescenceFactor":1}"#,
        r#","KHR_materials_specular":{"specularFactor":0.9}"#,
        r#","KHR_materials_specular":{"specularColorFactor":[1,1,0.9]}"#,
    ] {
        assert_eq!(mode(glass, lobe), ShadingMode::Pbr, "{lobe}");
    }
    // A metal lets no light pass, part of a surface may be no glass, and rough glass is not smooth.
    for values in [[1.0, 0.0, 1.0], [0.01, 0.0, 1.0], [0.0, 0.0, 0.99], [0.0, 0.0, 0.51], [0.0, 0.01, 1.0]] {
        assert_eq!(mode(values, ""), ShadingMode::Pbr, "{values:?}");
    }
}

#[test]
fn a_project_keeps_lobes_and_the_audit_looks_at_them() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"{"extensions":{"KHR_materials_sheen":{"sheenColorFactor":[1,1,1],"sheenColorTexture":{"index":0}}}}"#;
    let imported = load(&file(folder.path(), text), &ImportOptions::default()).unwrap();
    let mut document = caustica_scene::Document::new();
    document.add_imported(imported).unwrap();
    let (id, old) = document.materials().next().map(|(id, value)| (id, value.clone())).unwrap();
    let own = old.sheen.as_ref().and_then(|sheen| sheen.color_texture).unwrap().texture;
    let value = Material {
        dispersion: 0.4,
        clearcoat: Some(Clearcoat {
            factor: 0.5,
            texture: Some(TextureUse::new(own)),
            ..Clearcoat::default()
        }),
        iridescence: Some(Iridescence { factor: 7.0, ..Iridescence::default() }),
        ..old
    };
    document.apply(Edit::SetMaterial { material: id, value: Box::new(value.clone()) }).unwrap();
    let findings: Vec<String> = audit(&document).iter().map(ToString::to_string).collect();
    assert!(
        findings.iter().any(|f| f.contains("iridescence is 7, outside of what is physical")),
        "{findings:?}"
    );

    let path = folder.path().join("scene.caustica");
    Project::save(&path, &document, &ProjectMeta::default()).unwrap();
    let again = Project::load(&path).unwrap();
    let held = Iridescence { factor: 1.0, ..Iridescence::default() };
    let held = Material { iridescence: Some(held), ..value.clone() };
    assert_eq!(again.document.material(id), Some(&held));
    let is_said = again.warnings.iter().any(|w| w.place == "/materials/0/value/iridescence/factor");
    assert!(is_said, "{:?}", again.warnings);

    let broken = Material { sheen: Some(Sheen { roughness: f32::NAN, ..Sheen::default() }), ..value };
    assert!(document.apply(Edit::SetMaterial { material: id, value: Box::new(broken) }).is_err());
}
