//! Values that the format forbids: each is named in a warning, and what is exported is sound. Extras of other programs are
//! no fault of a file.

use std::path::Path;

use caustica_scene::import::Imported;
use caustica_scene::{AlphaMode, Environment, LightKind, Projection};
use glam::{Vec3, Vec4};
use serde_json::{Value, json};

use crate::export::{exported, json_of, placed, read, validated};
use crate::gltf_file::{GltfFile, SQUARE};

fn said(imported: &Imported) -> Vec<(String, String)> {
    let of = |w: &caustica_scene::import::Warning| (w.place.clone(), w.message.clone());
    imported.warnings.iter().map(of).collect()
}

/// Whether a warning at a place has these words.
fn is_said(imported: &Imported, place: &str, words: &str) -> bool {
    said(imported).iter().any(|(at, message)| at == place && message.contains(words))
}

/// Exports, has the file validated where that can be, and reads it again.
fn again(imported: Imported, folder: &Path, name: &str) -> (Value, Imported) {
    let (path, _) = exported(&placed(imported), folder, name);
    if let Some(text) = validated(std::slice::from_ref(&path)) {
        assert!(!text.contains("error: "), "{text}");
    }
    (json_of(&path), read(&path))
}

/// A square with these materials, lights and cameras, each carried by a node.
fn file(materials: &[Value], lights: &[Value], cameras: &[Value]) -> GltfFile {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    file.json["accessors"][0]["min"] = json!([0, 0, 0]);
    file.json["accessors"][0]["max"] = json!([1, 1, 0]);
    for (place, material) in materials.iter().enumerate() {
        file.push("materials", material.clone());
        let primitives = json!([{"attributes": {"POSITION": position}, "material": place}]);
        file.push("meshes", json!({"primitives": primitives}));
        file.push("nodes", json!({"mesh": place}));
    }
    for (place, camera) in cameras.iter().enumerate() {
        file.push("cameras", camera.clone());
        file.push("nodes", json!({"camera": place}));
    }
    if !lights.is_empty() {
        file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
        for place in 0..lights.len() {
            file.push("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": place}}}));
        }
    }
    let extensions = ["KHR_lights_punctual", "KHR_materials_unlit", "KHR_materials_volume"];
    file.json["extensionsUsed"] = json!(extensions);
    file
}

#[test]
fn extras_of_other_programs_are_kept_and_never_refused() {
    let lights = [
        json!({"type": "point", "extras": {"radius": "big", "own": 1}}),
        json!({"type": "directional", "extras": {"angle": 1e300}}),
        json!({"type": "spot", "spot": {}, "extras": {"radius": -2}}),
    ];
    let material = json!({"extras": {"volumePriority": "high", "shadingMode": "toon"}});
    for environment in [
        json!({"sky": 1, "name": "studio.hdr"}),
        json!({"sky": false}),
        json!({"constantRadiance": "red"}),
        json!({"bufferView": 99}),
        json!({"bufferView": 0, "rotationRad": "east"}),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let mut file = file(std::slice::from_ref(&material), &lights, &[]);
        file.json["meshes"][0]["extras"] = json!({"targetNames": "none"});
        let extras = json!({"environment": environment, "other": [1]});
        file.push("scenes", json!({"nodes": [0, 1, 2, 3], "extras": extras}));
        let imported = read(&file.write(folder.path()));
        let kept = "only kept for exports";
        assert!(is_said(&imported, "/scenes/0/extras/environment", kept), "{:?}", said(&imported));
        let light = |place| format!("/extensions/KHR_lights_punctual/lights/{place}/extras");
        assert!(is_said(&imported, &format!("{}/radius", light(0)), "a text; it is not read, only kept"));
        assert!(is_said(&imported, &format!("{}/angle", light(1)), kept));
        assert!(is_said(&imported, &format!("{}/radius", light(2)), "-2 has to be at least 0"));
        assert!(is_said(&imported, "/materials/0/extras/volumePriority", kept));
        assert_eq!((imported.prefab.environment.as_ref(), imported.warnings.len()), (None, 5));

        let (written, _) = again(imported, folder.path(), "out.glb");
        assert_eq!(written["scenes"][0]["extras"], extras);
        assert_eq!(written["materials"][0]["extras"], material["extras"]);
        assert_eq!(written["meshes"][0]["extras"], json!({"targetNames": "none"}));
        let lamps = &written["extensions"]["KHR_lights_punctual"]["lights"];
        assert_eq!((&lamps[0]["extras"], &lamps[1]["extras"]), (&lights[0]["extras"], &lights[1]["extras"]));
    }
}

#[test]
fn surroundings_of_this_program_are_held_to_their_range() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = GltfFile::new();
    let extras = json!({"environment": {"constantRadiance": [1, -2, 0.5]}});
    file.push("scenes", json!({"extras": extras}));
    let imported = read(&file.write(folder.path()));
    assert_eq!(imported.prefab.environment, Some(Environment::Constant(Vec3::new(1.0, 0.0, 0.5))));
    assert!(is_said(&imported, "/scenes/0/extras/environment/constantRadiance", "at least 0"));
}

#[test]
fn colours_and_factors_out_of_range_are_held_and_named() {
    let color = json!({"baseColorFactor": [2, -1, 0.5, 1]});
    let glossy = json!({"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.5, 0.5, 3, 1]}});
    let materials = [
        json!({"pbrMetallicRoughness": color, "emissiveFactor": [-1, 0, 2], "alphaMode": "MASK", "alphaCutoff": -1}),
        json!({"pbrMetallicRoughness": color, "extensions": {"KHR_materials_unlit": {}}}),
        json!({"extensions": {"KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0}}}),
        json!({"extensions": glossy}),
    ];
    let folder = tempfile::tempdir().unwrap();
    let imported = read(&file(&materials, &[], &[]).write(folder.path()));
    for (place, words) in [
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", "2 has to be within 0 and 1; 1 is taken"),
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", "-1 has to be within 0 and 1; 0 is taken"),
        ("/materials/1/pbrMetallicRoughness/baseColorFactor", "2 has to be within 0 and 1; 1 is taken"),
        ("/materials/0/emissiveFactor", "-1 has to be at least 0"),
        ("/materials/0/emissiveFactor", "taken as a stronger light"),
        ("/materials/0/alphaCutoff", "-1 has to be at least 0; 0 is taken"),
        (
            "/materials/2/extensions/KHR_materials_volume/attenuationDistance",
            "0 has to be above 0; nothing is attenuated",
        ),
        (
            "/materials/3/extensions/KHR_materials_pbrSpecularGlossiness/diffuseFactor",
            "3 has to be within 0 and 1; 1 is taken",
        ),
    ] {
        assert!(is_said(&imported, place, words), "{place}: {words}: {:?}", said(&imported));
    }
    let held = Vec4::new(1.0, 0.0, 0.5, 1.0);
    assert_eq!([imported.materials[0].base_color, imported.materials[1].base_color], [held; 2]);
    assert_eq!(imported.materials[0].alpha, AlphaMode::Mask { cutoff: 0.0 });
    let before = imported.materials.clone();
    let (_, after) = again(imported, folder.path(), "out.glb");
    assert!(after.warnings.is_empty(), "{:?}", said(&after));
    assert_eq!(after.materials[0].emitted_radiance(), before[0].emitted_radiance());
    assert_eq!(after.materials[1..], before[1..]);
}

#[test]
fn base_colours_of_edits_that_an_export_holds_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let scene = crate::common::scene(folder.path());
    let mut document = scene.document;
    let red = document.prefab(scene.prefab).unwrap().materials[0];
    let mut material = document.material(red).unwrap().clone();
    material.base_color = Vec4::new(3.0, 0.5, 0.5, 1.0);
    document.apply(caustica_scene::Edit::SetMaterial { material: red, value: Box::new(material) }).unwrap();
    let (_, done) = exported(&document, folder.path(), "out.glb");
    let named =
        |w: &caustica_scene::import::Warning| w.place == "material \"Red\"" && w.message.contains("held");
    assert!(done.warnings.iter().any(named), "{:?}", done.warnings);
}

#[test]
fn lights_out_of_range_are_named_and_exported_sound() {
    let right_angle = std::f64::consts::FRAC_PI_2;
    let spot = |outer: f64| json!({"type": "spot", "spot": {"innerConeAngle": 0, "outerConeAngle": outer}});
    let lights = [
        spot(right_angle),
        spot(3.0),
        spot(0.0),
        json!({"type": "point", "range": 0, "color": [2, 0, -1]}),
        json!({"type": "point", "range": -1}),
        json!({"type": "point", "range": -1}),
    ];
    let folder = tempfile::tempdir().unwrap();
    let mut file = file(&[], &lights, &[]);
    let nodes = file.json["nodes"].as_array_mut().unwrap();
    nodes.pop();
    let first = nodes[0].clone();
    nodes.push(first);
    let imported = read(&file.write(folder.path()));
    let light = |rest: &str| format!("/extensions/KHR_lights_punctual/lights/{rest}");
    for (place, words) in [
        ("1/spot/outerConeAngle", "3 has to be within"),
        ("2/spot/outerConeAngle", "0 has to be within"),
        ("3/range", "0 has to be above 0; it is left out"),
        ("3/color", "taken as a stronger light"),
        ("3/color", "-1 has to be at least 0; 0 is taken"),
        ("4/range", "-1 has to be above 0; it is left out"),
        ("5/range", "no node carries it, so that exports have it as it stands"),
    ] {
        assert!(is_said(&imported, &light(place), words), "{place}: {words}: {:?}", said(&imported));
    }
    assert_eq!(imported.warnings.len(), 7, "{:?}", said(&imported));
    let LightKind::Spot { outer_rad, .. } = imported.prefab.nodes()[0].light.unwrap().kind else { panic!() };
    assert_eq!(outer_rad, std::f32::consts::FRAC_PI_2);
    let before: Vec<_> = imported.prefab.nodes().iter().map(|part| part.light).collect();
    let (path, _) = exported(&placed(imported), folder.path(), "out.glb");
    let written = json_of(&path);
    let lamps = &written["extensions"]["KHR_lights_punctual"]["lights"];
    assert_eq!(lamps[0]["spot"]["outerConeAngle"], json!(right_angle));
    assert_eq!(lamps[1]["spot"]["outerConeAngle"], json!(right_angle));
    let back = read(&path);
    assert_eq!(back.prefab.nodes()[0].light, before[0]);
    file.json["extensions"]["KHR_lights_punctual"]["lights"].as_array_mut().unwrap().pop();
    again(read(&file.write(folder.path())), folder.path(), "out2.glb");
}

#[test]
fn cameras_out_of_range_are_named_and_exported_sound() {
    let perspective = |near: f64, far: f64| json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": near, "zfar": far}});
    let orthographic = |xmag: f64, near: f64, far: f64| json!({"type": "orthographic", "orthographic": {"xmag": xmag, "ymag": 1, "znear": near, "zfar": far}});
    let cameras = [
        perspective(1.0, 0.5),
        perspective(1.0, 1.0),
        orthographic(1.0, 3.0, 2.0),
        orthographic(-2.0, 0.0, 0.005),
        perspective(-1.0, 10.0),
        json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 1, "aspectRatio": 0}}),
    ];
    let folder = tempfile::tempdir().unwrap();
    let imported = read(&file(&[], &[], &cameras).write(folder.path()));
    for (place, words) in [
        ("/cameras/0/perspective/zfar", "0.5 has to be above znear, 1"),
        ("/cameras/1/perspective/zfar", "1 has to be above znear, 1"),
        ("/cameras/2/orthographic/zfar", "2 has to be above znear, 3"),
        ("/cameras/3/orthographic/xmag", "mirrors the picture"),
        ("/cameras/4/perspective/znear", "-1 has to be above 0; 0.01 is taken"),
        ("/cameras/5/perspective/aspectRatio", "0 has to be above 0"),
    ] {
        assert!(is_said(&imported, place, words), "{place}: {words}: {:?}", said(&imported));
    }
    assert_eq!(imported.warnings.len(), 6, "{:?}", said(&imported));
    let before: Vec<_> = imported.prefab.nodes().iter().filter_map(|part| part.camera).collect();
    assert_eq!((before[0].far_m, before[3].aspect), (None, Some(2.0)));
    assert!(matches!(before[3].projection, Projection::Orthographic { ymag_m: 1.0 }));
    assert!(before[3].far_m > Some(before[3].near_m), "{:?}", before[3]);
    let (_, after) = again(imported, folder.path(), "out.glb");
    assert!(after.warnings.is_empty(), "{:?}", said(&after));
    let after: Vec<_> = after.prefab.nodes().iter().filter_map(|part| part.camera).collect();
    assert_eq!((after.len(), after[3]), (6, before[3]));
}

#[test]
fn a_place_said_twice_and_instances_without_direction_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = file(&[json!({})], &[], &[]);
    let turns = file.floats("VEC4", 4, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    file.json["nodes"][0]["matrix"] = json!([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]);
    file.json["nodes"][0]["translation"] = json!([1, 2, 3]);
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": turns}}});
    file.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let imported = read(&file.write(folder.path()));
    assert!(is_said(&imported, "/nodes/0", "a matrix and translation too; the matrix counts"));
    let place = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/ROTATION";
    assert!(is_said(&imported, place, "1 value is of length 0"), "{:?}", said(&imported));
    assert_eq!(imported.warnings.len(), 2);
    again(imported, folder.path(), "out.glb");
}

/// A node that a clip moves, with keys at these times.
fn moved(times: &[f32], interpolation: &str, path: &str, width: usize, values: &[f32]) -> GltfFile {
    let mut file = GltfFile::new();
    file.push("nodes", json!({"name": "it"}));
    let input = file.floats("SCALAR", 1, times);
    file.json["accessors"][input]["min"] = json!([times[0]]);
    file.json["accessors"][input]["max"] = json!([times[times.len() - 1]]);
    let output = file.floats(&format!("VEC{width}"), width, values);
    let sampler = json!({"input": input, "output": output, "interpolation": interpolation});
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": path}});
    file.push("animations", json!({"samplers": [sampler], "channels": [channel]}));
    file
}

#[test]
fn clips_that_begin_before_zero_play_the_same_from_zero_on() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let line = [0.0, 0.0, 0.0, 2.0, 4.0, 0.0, 8.0, 0.0, 0.0];
    let turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half];
    let cubic: Vec<f32> = (0..27).map(|i| ((i * 7) % 11) as f32 - 5.0).collect();
    let cases = [
        (&[-1.0, 1.0, 3.0][..], "LINEAR", "translation", 3, &line[..], 3),
        (&[-1.0, 1.0, 3.0], "STEP", "translation", 3, &line, 3),
        (&[-2.0, -1.0, 3.0], "CUBICSPLINE", "translation", 3, &cubic, 2),
        (&[-1.0, 3.0], "LINEAR", "rotation", 4, &turn, 2),
        (&[-1.0, 0.0, 3.0], "LINEAR", "translation", 3, &line, 2),
        (&[-3.0, -2.0, -1.0], "LINEAR", "translation", 3, &line, 1),
    ];
    for (number, (times, interpolation, path, width, values, keys)) in cases.into_iter().enumerate() {
        let folder = tempfile::tempdir().unwrap();
        let file = moved(times, interpolation, path, width, values);
        let imported = read(&file.write(folder.path()));
        let words = format!("begin at {} s; what is before 0 is left out", times[0]);
        assert!(is_said(&imported, "/animations/0/channels/0", &words), "{:?}", said(&imported));
        let channel = imported.prefab.animations[0].channels[0].clone();
        assert_eq!((channel.times_s[0], channel.times_s.len()), (0.0, keys), "case {number}");
        let whole =
            caustica_scene::Channel { times_s: times.into(), values: values.into(), ..channel.clone() };
        for step in 0..40 {
            let time_s = f64::from(step) * 0.1;
            let (cut, uncut) = (channel.sample(time_s).unwrap(), whole.sample(time_s).unwrap());
            let numbers = |sample: &caustica_scene::Sample| match sample {
                caustica_scene::Sample::Translation(v) => v.extend(0.0),
                caustica_scene::Sample::Rotation(q) => glam::DVec4::from_array(q.to_array()),
                other => panic!("{other:?}"),
            };
            let apart = (numbers(&cut) - numbers(&uncut)).length();
            assert!(apart < 1e-5, "case {number} at {time_s}: {cut:?} {uncut:?}");
        }
        let (_, after) = again(imported, folder.path(), "out.glb");
        assert!(after.warnings.is_empty(), "{:?}", said(&after));
        assert_eq!(after.prefab.animations[0].channels[0], channel);
    }
}
