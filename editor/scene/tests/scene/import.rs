//! Imports every model of the shared assets, valid and invalid, and compares with an independent reader.

use std::path::{Path, PathBuf};

use crate::common::{Numbers, assert_sound, assets};

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{
    AlphaMode, ClipChoice, Document, Edit, Environment, LightKind, Local, ShadingMode, Wrap,
};
use glam::Vec3;

fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if extensions.contains(&extension.as_str()) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The required extensions of a file, read without the importer.
fn required_extensions(path: &Path) -> Vec<String> {
    let bytes = std::fs::read(path).unwrap();
    let json = if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        &bytes[20..20 + length]
    } else {
        &bytes[..]
    };
    let json: serde_json::Value = serde_json::from_slice(json).unwrap();
    let required = json["extensionsRequired"].as_array().cloned();
    let names = required.unwrap_or_default().into_iter();
    names.map(|name| name.as_str().unwrap().to_owned()).collect()
}

#[test]
fn every_valid_gltf_loads_or_is_refused_by_name() {
    let Some(folder) = assets("gltf") else { return };
    let refused = ["ACME_gizmo"];
    let files = files(&folder, &["gltf", "glb"]);
    assert!(files.len() > 40, "{} files", files.len());
    for path in files {
        let required = required_extensions(&path);
        let reason = required.iter().find(|name| refused.contains(&name.as_str()));
        match (load(&path, &ImportOptions::default()), reason) {
            (Ok(imported), None) => {
                assert_sound(&path, &imported);
                assert!(imported.textures.iter().all(|t| !t.placeholder), "{}", path.display());
                for warning in &imported.warnings {
                    println!("{warning}");
                }
                let mut document = Document::new();
                document.add_imported(imported).unwrap();
            }
            (Err(error), Some(name)) => {
                assert!(error.to_string().contains(name.as_str()), "{error}");
            }
            (Ok(_), Some(name)) => panic!("{} loaded without {name}", path.display()),
            (Err(error), None) => panic!("{error}"),
        }
    }
}

#[test]
fn every_valid_obj_loads() {
    let Some(folder) = assets("obj") else { return };
    for path in files(&folder, &["obj"]) {
        let imported = load(&path, &ImportOptions::default()).unwrap();
        assert_sound(&path, &imported);
        assert!(!imported.meshes.is_empty(), "{}", path.display());
        for warning in &imported.warnings {
            println!("{warning}");
        }
    }
}

#[test]
fn invalid_files_are_refused_or_warned_about_and_never_panic() {
    let Some(folder) = assets("invalid") else {
        return;
    };
    let manifest = std::fs::read_to_string(folder.join("manifest.tsv")).unwrap();
    let mut count = 0;
    for line in manifest.lines().skip(1) {
        let columns: Vec<&str> = line.split('\t').collect();
        let path = folder.parent().unwrap().join(columns[0]);
        let result = load(&path, &ImportOptions::default());
        match &result {
            Ok(imported) => {
                assert_sound(&path, imported);
                println!("{}: loaded, {} warnings", columns[0], imported.warnings.len());
            }
            Err(error) => {
                // That there is nothing to show has no place.
                let placed = !error.place.is_empty() || error.reason.contains("no triangle");
                assert!(placed && error.file == path && !error.reason.is_empty(), "{error}");
                println!("{error}");
            }
        }
        let complained = !matches!(&result, Ok(imported) if imported.warnings.is_empty());
        assert!(complained || columns[1] != "refuse", "{line}");
        count += 1;
    }
    assert!(count > 50);
}

/// Triangles of a mesh by the gltf crate, as sorted corner positions. Only lists are compared.
fn oracle_triangles(mesh: &gltf::Mesh<'_>, buffers: &[gltf::buffer::Data]) -> Option<Vec<[[u32; 3]; 3]>> {
    let mut triangles = Vec::new();
    for primitive in mesh.primitives() {
        if primitive.mode() != gltf::mesh::Mode::Triangles {
            return None;
        }
        let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
        let positions: Vec<[f32; 3]> = reader.read_positions()?.collect();
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..positions.len() as u32).collect(),
        };
        for corner in indices.chunks_exact(3) {
            triangles
                .push([corner[0], corner[1], corner[2]].map(|i| positions[i as usize].map(f32::to_bits)));
        }
    }
    triangles.sort_unstable();
    Some(triangles)
}

#[test]
fn triangles_are_those_that_the_gltf_crate_reads() {
    let Some(folder) = assets("gltf") else { return };
    let mut compared = 0;
    for path in files(&folder, &["gltf", "glb"]) {
        let (Ok(imported), Ok(document)) = (load(&path, &ImportOptions::default()), gltf::Gltf::open(&path))
        else {
            continue;
        };
        let blob = document.blob.clone();
        let Ok(buffers) = gltf::import_buffers(&document, path.parent(), blob) else {
            continue;
        };
        for (mesh, oracle) in imported.meshes.iter().zip(document.meshes()) {
            let Some(mut expected) = oracle_triangles(&oracle, &buffers) else {
                continue;
            };
            let degenerate = |t: &[[u32; 3]; 3]| {
                let [p, q, r] = t.map(|p| Vec3::from(p.map(f32::from_bits)).as_dvec3());
                let longest = (q - p).length().max((r - p).length());
                (q - p).cross(r - p).length() <= 1e-12 * longest * longest
            };
            expected.retain(|t| !degenerate(t));
            let (corners, _) = mesh.data.indices.as_chunks::<3>();
            let position = |i: u32| mesh.data.positions[i as usize].to_array().map(f32::to_bits);
            let mut found: Vec<_> = corners.iter().map(|t| t.map(position)).collect();
            found.retain(|t| !degenerate(t));
            found.sort_unstable();
            assert!(found == expected, "{}: mesh {}", path.display(), mesh.name);
            compared += 1;
        }
    }
    assert!(compared > 60, "{compared} meshes");
}

#[test]
fn generated_tangents_agree_with_those_of_the_file() {
    let Some(folder) = assets("gltf/NormalTangentMirrorTest") else {
        return;
    };
    let path = files(&folder, &["gltf", "glb"]).remove(0);
    let given = load(&path, &ImportOptions::default()).unwrap();
    // The same file with its tangents renamed away: they have to be generated.
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.windows(9).position(|w| w == b"\"TANGENT\"").expect("the file has tangents");
    bytes[at + 1..at + 8].copy_from_slice(b"_ANGENT");
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.glb");
    std::fs::write(&copy, bytes).unwrap();
    let generated = load(&copy, &ImportOptions::default()).unwrap();
    let (mut same, mut total) = (0, 0);
    for (a, b) in given.meshes.iter().zip(&generated.meshes) {
        for (&i, &j) in a.data.indices.iter().zip(&b.data.indices) {
            let (s, t) = (a.data.tangents[i as usize], b.data.tangents[j as usize]);
            total += 1;
            same += usize::from(s.w == t.w && s.truncate().dot(t.truncate()) > 0.9);
        }
    }
    assert!(total > 100 && same as f64 > 0.98 * f64::from(total), "{same} of {total}");
}

#[test]
fn node_transforms_keep_double_precision() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.gltf");
    let json = r#"{"asset":{"version":"2.0"},"nodes":[
        {"translation":[1234567.000000001,0.1,-3e-9],"children":[1]},
        {"matrix":[1,0,0,0, 0.5,1,0,0, 0,0,1,0, 6371000.123456789,0,0,1]},
        {"matrix":[0,2,0,0, -2,0,0,0, 0,0,2,0, 0.1,0,0,1]}]}"#;
    std::fs::write(&path, json).unwrap();
    let imported = load(&path, &ImportOptions::default()).unwrap();
    let nodes = imported.prefab.nodes();
    assert_eq!(nodes[0].local.translation().to_array(), [1_234_567.000_000_001, 0.1, -3e-9]);
    assert!(matches!(nodes[1].local, Local::Matrix(m) if m.translation.x == 6_371_000.123_456_789));
    assert!(
        matches!(nodes[2].local, Local::Trs(trs) if trs.scale.abs_diff_eq(glam::DVec3::splat(2.0), 1e-12))
    );
}

#[test]
fn ten_thousand_levels_load() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep.gltf");
    let nodes: Vec<String> = (0..10_000)
        .map(|i| match i {
            9_999 => r#"{"translation":[0,0,1]}"#.to_owned(),
            _ => format!(r#"{{"translation":[0,0,1],"children":[{}]}}"#, i + 1),
        })
        .collect();
    let json = format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{}]}}"#, nodes.join(","));
    std::fs::write(&path, json).unwrap();
    let imported = load(&path, &ImportOptions::default()).unwrap();
    assert_eq!(imported.prefab.nodes().len(), 10_000);
}

/// Whatever a file holds, playing it gives finite numbers.
fn play(imported: Imported) {
    let mut document = Document::new();
    let prefab = document.add_imported(imported).unwrap();
    let (node, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    for clip in [ClipChoice::First, ClipChoice::All] {
        document.apply(Edit::SetClip { node, clip }).unwrap();
        for time_s in [0.0, 0.3, 1e9, -1.0, f64::NAN] {
            document.set_time(Some(time_s));
            document.drain_changes();
            for placed in document.renderables() {
                let Some(pose) = document.deform_pose(placed.target) else { continue };
                assert!(pose.joint_matrices.iter().all(|matrix| matrix.is_finite()));
                assert!(pose.weights.iter().all(|weight| weight.is_finite()));
            }
        }
    }
}

#[test]
fn files_with_random_damage_never_panic() {
    let Some(folder) = assets("") else { return };
    let small = [
        "gltf/Box/glTF-Binary/Box.glb",
        "gltf/Box/glTF-Embedded/Box.gltf",
        "gltf/Triangle/glTF-Embedded/Triangle.gltf",
        "gltf/BoxInterleaved/glTF-Binary/BoxInterleaved.glb",
        "gltf/SimpleSkin/glTF-Embedded/SimpleSkin.gltf",
        "gltf/RiggedSimple/glTF-Binary/RiggedSimple.glb",
        "gltf/SimpleMorph/glTF/SimpleMorph.gltf",
        "gltf/AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb",
        "gltf/InterpolationTest/glTF-Binary/InterpolationTest.glb",
        "gltf/BoxTextured/glTF-Binary/BoxTextured.glb",
        "obj/concave/concave.obj",
        "obj/box-objects-groups-materials/box-objects-groups-materials.obj",
        "obj/box-negative-indices/box-negative-indices.obj",
    ];
    let scratch = tempfile::tempdir().unwrap();
    let mut numbers = Numbers(9);
    let (mut loaded, mut refused) = (0, 0);
    for name in small {
        let Ok(good) = std::fs::read(folder.join(name)) else {
            println!("skipped: {name} is absent");
            continue;
        };
        let path = scratch.path().join(Path::new(name).file_name().unwrap());
        for _ in 0..300 {
            let mut bad = good.clone();
            for _ in 0..=numbers.below(4) {
                let at = numbers.below(bad.len());
                match numbers.below(4) {
                    0 => bad[at] = numbers.below(256) as u8,
                    // Another digit keeps JSON and OBJ readable and their numbers wrong.
                    1 => bad[at] = b"0123456789-./ "[numbers.below(14)],
                    2 => {
                        let digit = (at..bad.len()).find(|&i| bad[i].is_ascii_digit());
                        bad[digit.unwrap_or(at)] = b'0' + numbers.below(10) as u8;
                    }
                    _ => bad.truncate(at.max(1)),
                }
            }
            std::fs::write(&path, &bad).unwrap();
            match load(&path, &ImportOptions::default()) {
                Ok(imported) => {
                    assert_sound(&path, &imported);
                    play(imported);
                    loaded += 1;
                }
                Err(error) => {
                    assert!(!error.reason.is_empty());
                    refused += 1;
                }
            }
        }
    }
    println!("{loaded} loaded, {refused} refused");
    assert!(loaded > 100 && refused > 100, "{loaded} loaded, {refused} refused");
}

#[test]
fn environments_load_finite_and_not_negative() {
    let Some(folder) = assets("env") else { return };
    for path in files(&folder, &["hdr", "exr"]) {
        let (map, warnings) = caustica_scene::import::load_environment(&path).unwrap();
        assert_eq!(map.rgb.len(), map.width as usize * map.height as usize);
        let good = |v: &f32| v.is_finite() && *v >= 0.0;
        assert!(map.rgb.iter().flatten().all(good), "{}", path.display());
        println!("{}: {}x{} {warnings:?}", path.display(), map.width, map.height);
    }
    let other = folder.join("../README.md");
    assert!(caustica_scene::import::load_environment(&other).is_err());
}

#[test]
fn obj_materials_keep_what_mtl_says() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = "newmtl glass\nKd 0.1 0.1 0.1\nNi 1.33\nd 0.2\nillum 7\n\
               newmtl lamp\nKd 0 0 0\nKe 5 2.5 0\nNi 1\n\
               newmtl leaf\nKd 1 1 1\nd 0.5\nmap_Kd absent.png\n";
    std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no a\nusemtl glass\nf 1 2 3 4\n\
               usemtl lamp\nf 1 2 3\no b\nusemtl leaf\nf 1 2 4\n";
    let path = folder.path().join("m.obj");
    std::fs::write(&path, obj).unwrap();
    let imported = load(&path, &ImportOptions::default()).unwrap();
    assert_sound(&path, &imported);
    let shape: Vec<_> = imported.meshes.iter().map(|m| (m.name.as_str(), m.primitives.len())).collect();
    assert_eq!(shape, [("a", 2), ("b", 1)]);
    assert_eq!(imported.meshes[0].triangle_count(), 3);
    let [glass, lamp, leaf] = &imported.materials[..] else { panic!("three materials") };
    assert_eq!((glass.mode, glass.ior), (ShadingMode::Refractive, 1.33));
    assert_eq!((lamp.emitted_radiance(), lamp.ior), (Vec3::new(5.0, 2.5, 0.0), 1.5));
    assert_eq!(leaf.alpha, AlphaMode::Blend);
    assert!(imported.textures[0].placeholder);
    assert!(imported.warnings[0].to_string().contains("absent.png"));
}

/// A glTF file with one triangle and these materials and extra members.
fn triangle_file(folder: &Path, members: &str) -> PathBuf {
    let path = folder.join("t.gltf");
    let buffer = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},{members},
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:;base64,{buffer}"}}]}}"#
    );
    std::fs::write(&path, json).unwrap();
    path
}

#[test]
fn materials_get_the_shading_mode_that_fits() {
    let folder = tempfile::tempdir().unwrap();
    let glass = |roughness: f32, more: &str| {
        format!(
            r#"{{"pbrMetallicRoughness":{{"metallicFactor":0,"roughnessFactor":{roughness}}},
            "extensions":{{"KHR_materials_transmission":{{"transmissionFactor":1}}{more}}}}}"#
        )
    };
    let materials = [
        r#"{"extensions":{"KHR_materials_unlit":{}}}"#.to_owned(),
        glass(0.0, ""),
        glass(0.0, r#","KHR_materials_volume":{"thicknessFactor":0.1,"attenuationDistance":0.5}"#),
        glass(0.3, ""),
        r#"{"pbrMetallicRoughness":{"roughnessFactor":0}}"#.to_owned(),
        r#"{"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}}}"#.to_owned(),
    ];
    let path = triangle_file(folder.path(), &format!(r#""materials":[{}]"#, materials.join(",")));
    let imported = load(&path, &ImportOptions::default()).unwrap();
    let modes: Vec<ShadingMode> = imported.materials.iter().map(|m| m.mode).collect();
    use ShadingMode::{Pbr, Refractive, Unlit};
    assert_eq!(modes, [Unlit, Refractive, Refractive, Pbr, Pbr, Pbr]);
    let volumes: Vec<bool> = imported.materials.iter().map(|m| m.has_volume).collect();
    assert_eq!(volumes, [false, false, true, false, false, false]);
    assert_eq!(imported.materials[2].attenuation_distance_m, Some(0.5));
    assert_eq!(imported.materials[5].emitted_radiance(), Vec3::new(8.0, 4.0, 0.0));
}

#[test]
fn extras_give_lights_a_size_and_the_scene_an_environment() {
    let folder = tempfile::tempdir().unwrap();
    let members = r#""materials":[{}],"scene":0,
      "scenes":[{"nodes":[0,1,2],"extras":{"environment":{"constantRadiance":[0.1,0.2,0.3]}}}],
      "nodes":[{"extensions":{"KHR_lights_punctual":{"light":0}}},
               {"extensions":{"KHR_lights_punctual":{"light":1}}},
               {"extensions":{"KHR_lights_punctual":{"light":2}},"extras":{"radius":0.5}}],
      "extensions":{"KHR_lights_punctual":{"lights":[
        {"type":"directional","extras":{"angle":2.0}},
        {"type":"point","intensity":3,"range":7},
        {"type":"spot","spot":{"innerConeAngle":0.1,"outerConeAngle":0.2}}]}}"#;
    let path = triangle_file(folder.path(), members);
    let imported = load(&path, &ImportOptions::default()).unwrap();
    let kinds: Vec<LightKind> = imported.prefab.nodes().iter().map(|n| n.light.unwrap().kind).collect();
    let angular_radius_rad = 1.0_f32.to_radians();
    assert_eq!(kinds[0], LightKind::Directional { angular_radius_rad });
    assert_eq!(kinds[1], LightKind::Point { radius_m: 0.0, range_m: Some(7.0) });
    let spot = LightKind::Spot { radius_m: 0.5, range_m: None, inner_rad: 0.1, outer_rad: 0.2 };
    assert_eq!(kinds[2], spot);
    let mut document = Document::new();
    let prefab = document.add_imported(imported).unwrap();
    assert_eq!(document.effective_environment(), Environment::DefaultSky);
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    let wished = Environment::Constant(Vec3::new(0.1, 0.2, 0.3));
    assert_eq!(document.effective_environment(), wished);
}

#[test]
fn lamps_that_cannot_be_are_held_to_what_can_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let members = r#""materials":[{}],"scene":0,"scenes":[{"nodes":[0,1,2]}],
      "nodes":[{"extensions":{"KHR_lights_punctual":{"light":0}}},
               {"extensions":{"KHR_lights_punctual":{"light":1}}},
               {"extensions":{"KHR_lights_punctual":{"light":2}}}],
      "extensions":{"KHR_lights_punctual":{"lights":[
        {"type":"directional","extras":{"angle":360.0}},
        {"type":"point","intensity":-5},
        {"type":"spot","spot":{"innerConeAngle":0.9,"outerConeAngle":0.5}}]}}"#;
    let imported = load(&triangle_file(folder.path(), members), &ImportOptions::default()).unwrap();
    let found: Vec<&str> = imported.warnings.iter().map(|warning| warning.message.as_str()).collect();
    assert_eq!(
        found,
        [
            "a sun of 360 degrees; 180 are taken",
            "-5 has to be at least 0; 0 is taken",
            "0.9 has to be within 0 and 0.5; 0.5 is taken",
        ]
    );
}

#[test]
fn one_image_read_as_colour_and_as_data_is_two_textures() {
    let folder = tempfile::tempdir().unwrap();
    let members = r#""materials":[{"emissiveTexture":{"index":0},"occlusionTexture":{"index":0},
        "normalTexture":{"index":0,"texCoord":1,"scale":0.5},
        "pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{
          "offset":[0.25,0.5],"rotation":1.5,"scale":[2,3]}}}}}],
      "textures":[{"source":0,"sampler":0}],"images":[{"uri":"absent%20here.png"}],
      "samplers":[{"wrapS":33071,"wrapT":33648,"magFilter":9728,"minFilter":9984}]"#;
    let path = triangle_file(folder.path(), members);
    let imported = load(&path, &ImportOptions::default()).unwrap();
    let srgb: Vec<bool> = imported.textures.iter().map(|t| t.srgb).collect();
    assert_eq!(srgb, [true, false], "colours first, then data");
    let sampler = imported.textures[0].sampler;
    assert_eq!((sampler.wrap_u, sampler.wrap_v), (Wrap::ClampToEdge, Wrap::MirroredRepeat));
    assert!(!sampler.mag_linear && !sampler.min_linear && !sampler.mip_linear && sampler.mipmaps);
    let material = &imported.materials[0];
    let base = material.base_color_texture.unwrap();
    assert_eq!(
        (base.offset.to_array(), base.rotation_rad, base.scale.to_array()),
        ([0.25, 0.5], 1.5, [2.0, 3.0])
    );
    assert_eq!(base.texture, material.emissive_texture.unwrap().texture);
    assert_eq!(material.normal_texture.unwrap().tex_coord, 1);
    assert!(
        imported.warnings.iter().any(|w| w.place == "/images/0" && w.message.contains("absent here.png"))
    );
}
