//! What the format forbids beside values: each is repaired or left out with a warning that names it, and the validator
//! refuses no export.

use caustica_scene::import::Imported;
use serde_json::{Value, json};

use crate::export::{exported, json_of, placed, read, validated};
use crate::gltf_file::{Data, GltfFile, SQUARE};

/// A square that node 0 places.
fn square() -> (GltfFile, usize) {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}}]}));
    file.push("nodes", json!({"mesh": 0}));
    (file, position)
}

/// Reads the file, finds a warning at the place with the words, and exports something that is valid.
fn repaired(file: &GltfFile, place: &str, words: &str) -> (Imported, Value) {
    let folder = tempfile::tempdir().unwrap();
    let imported = read(&file.write(folder.path()));
    let said: Vec<String> = imported.warnings.iter().map(|w| format!("{}: {}", w.place, w.message)).collect();
    let is_said = |said: &String| said.starts_with(&format!("{place}: ")) && said.contains(words);
    assert!(words.is_empty() || said.iter().any(is_said), "{said:?}");
    let (path, _) = exported(&placed(imported.clone()), folder.path(), "out.gltf");
    let text = validated(std::slice::from_ref(&path)).unwrap_or_default();
    assert!(!text.contains("error: "), "{text}");
    read(&path);
    (imported, json_of(&path))
}

fn animated(
    path: &str,
    interpolation: &str,
    times: &[f32],
    kind: &str,
    width: usize,
    values: &[f32],
) -> GltfFile {
    let (mut file, _) = square();
    let (input, output) = (file.floats("SCALAR", 1, times), file.floats(kind, width, values));
    let sampler = json!({"input": input, "output": output, "interpolation": interpolation});
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": path}});
    file.push("animations", json!({"samplers": [sampler], "channels": [channel]}));
    file
}

#[test]
fn keys_become_those_of_the_format() {
    let spline =
        animated("translation", "CUBICSPLINE", &[0.0], "VEC3", 3, &[0., 0., 0., 1., 0., 0., 0., 0., 0.]);
    let place = "/animations/0/samplers/0";
    let (imported, written) = repaired(&spline, place, "at least two keys");
    assert_eq!(imported.prefab.animations[0].channels[0].values[..], [1.0, 0.0, 0.0]);
    assert_eq!(written["animations"][0]["samplers"][0]["interpolation"], "STEP");
    let turned = animated("rotation", "LINEAR", &[0., 1.], "VEC4", 4, &[0., 0., 127., 0., 0., 0., 0., 50.]);
    let (imported, _) = repaired(&turned, place, "2 rotations are not of length 1");
    assert_eq!(imported.prefab.animations[0].channels[0].values[..], [0., 0., 1., 0., 0., 0., 0., 1.]);
}

#[test]
fn a_joint_is_named_once() {
    let (mut file, _) = square();
    let joints = file.accessor("VEC4", 6, false, Data::U8(&[0; 24]));
    let weights = file.floats("VEC4", 4, &[0.5, 0.5, 0.0, 0.0].repeat(6));
    file.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    file.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
    let joint = file.push("nodes", json!({"name": "bone"}));
    file.push("skins", json!({"joints": [joint, joint]}));
    file.json["nodes"][0]["skin"] = json!(0);
    let place = "/meshes/0/primitives/0/attributes";
    let (imported, written) = repaired(&file, place, "6 vertices name a joint twice");
    assert_eq!(imported.meshes[0].data.skin.as_ref().unwrap().weights[0], [1.0, 0.0, 0.0, 0.0]);
    let joints = written["skins"][0]["joints"].as_array().unwrap();
    assert!(joints.len() == 2 && joints[0] != joints[1], "{joints:?}");
    repaired(&file, "/skins/0", "names a joint twice");
}

#[test]
fn variants_have_names_and_choose_once() {
    let (mut file, _) = square();
    file.push("materials", json!({}));
    file.push("materials", json!({"name": "other"}));
    let variants = json!([{"name": {"a": 1}}, {"name": "w"}, {"name": 5}]);
    file.json["extensions"] = json!({"KHR_materials_variants": {"variants": variants}});
    file.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    let mappings = json!([{"material": 0, "variants": [0, 0]}, {"material": 1, "variants": [0, 1]}, {"material": 1, "variants": []}]);
    file.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_materials_variants": {"mappings": mappings}});
    let (_, written) =
        repaired(&file, "/extensions/KHR_materials_variants/variants/0/name", "called by its number");
    let primitive =
        &written["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"];
    let chosen: Vec<&Value> =
        primitive.as_array().unwrap().iter().map(|mapping| &mapping["variants"]).collect();
    assert_eq!(chosen, [&json!([0]), &json!([1])]);
    repaired(&file, "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/2", "left out");
}

#[test]
fn points_have_places_and_attributes_of_their_types() {
    let (mut file, position) = square();
    let numbers = file.floats("SCALAR", 1, &[1.0, 2.0, 3.0]);
    let few = file.floats("VEC3", 3, &[1.0, 1.0, 1.0]);
    let primitives = file.json["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives.push(json!({"mode": 0, "attributes": {"POSITION": numbers, "COLOR_0": numbers}}));
    primitives
        .push(json!({"mode": 0, "attributes": {"POSITION": position, "COLOR_0": few, "NORMAL": numbers}}));
    let (_, written) = repaired(&file, "/meshes/0/primitives/1", "POSITION is missing or has the wrong type");
    let points = &written["meshes"][0]["primitives"][1];
    assert_eq!(points["attributes"].as_object().unwrap().keys().collect::<Vec<_>>(), ["POSITION"]);
    repaired(&file, "/meshes/0/primitives/2/attributes/COLOR_0", "it has 1 elements, POSITION has 6");
    repaired(&file, "/meshes/0/primitives/2/attributes/NORMAL", "wrong type");
}

#[test]
fn primitives_of_a_mesh_have_as_many_targets() {
    let (mut file, position) = square();
    let primitives = &mut file.json["meshes"][0]["primitives"];
    primitives[0]["targets"] = json!([{"POSITION": position}]);
    primitives.as_array_mut().unwrap().push(json!({"mode": 0, "attributes": {"POSITION": position}}));
    let (_, written) = repaired(&file, "/meshes/0", "differ in their number of morph targets");
    for primitive in written["meshes"][0]["primitives"].as_array().unwrap() {
        assert_eq!(primitive["targets"].as_array().map(Vec::len), Some(1), "{primitive}");
    }
}

#[test]
fn an_extension_that_is_no_object_is_left_out() {
    let (mut file, _) = square();
    file.json["nodes"][0]["extensions"] = json!({"X_none": 5});
    file.json["extensionsUsed"] = json!(["X_none"]);
    let (imported, written) = repaired(&file, "/extensionsUsed", "X_none is not supported");
    assert!(!written.to_string().contains("X_none"));
    let folder = tempfile::tempdir().unwrap();
    let (_, exported) = exported(&placed(imported), folder.path(), "out.gltf");
    let said = exported
        .warnings
        .iter()
        .any(|w| w.message.contains("the extension X_none, which is no object, is left out"));
    assert!(said, "{:?}", exported.warnings);
}

#[test]
fn numbers_that_overflow_are_written_as_the_largest() {
    let (mut file, _) = square();
    let strength = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 1e14}});
    file.push("materials", json!({"emissiveFactor": [1e38, 0, 0], "extensions": strength}));
    file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "color": [1e38, 0, 0], "intensity": 1e38}]}});
    file.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
    let (imported, written) = repaired(&file, "", "");
    assert!(!written.to_string().contains("null"), "{written}");
    let folder = tempfile::tempdir().unwrap();
    let (_, exported) = exported(&placed(imported), folder.path(), "out.gltf");
    for words in ["its emission of", "its light is held to the largest number"] {
        assert!(
            exported.warnings.iter().any(|w| w.message.contains(words)),
            "{words}: {:?}",
            exported.warnings
        );
    }
}
