//! What the program does not look at comes back in an export: names, `extras` and extensions of every kind of object,
//! points and lines, and things that nothing uses. What cannot come back is counted by name.

use std::path::Path;

use caustica_scene::import::Warning;
use caustica_scene::{Edit, Local, Target};
use serde_json::{Value, json};

use crate::export::{exported, json_of, placed, read};
use crate::gltf_file::{Data, GltfFile, SQUARE};

/// A PNG of one white texel.
const TEXEL: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";

fn strange(of: &str) -> Value {
    json!({"of": of})
}

fn acme(of: &str) -> Value {
    json!({"ACME_thing": {"on": of}})
}

/// Something unknown on everything.
pub fn strange_file() -> GltfFile {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    let joints = file.accessor("VEC4", 6, false, Data::U8(&[0; 24]));
    let weights = file.floats("VEC4", 4, &[1.0, 0.0, 0.0, 0.0].repeat(6));
    file.json["extensionsUsed"] = json!(["ACME_thing", "KHR_lights_punctual", "KHR_materials_clearcoat"]);
    let of = |name: &str| (strange(name), acme(name));
    let with = |mut value: Value, name: &str| {
        (value["extras"], value["extensions"]) = of(name);
        value
    };
    file.push("images", with(json!({"uri": TEXEL, "name": "texel"}), "image"));
    file.push("samplers", with(json!({"name": "sampler"}), "sampler"));
    file.push("textures", with(json!({"name": "texture", "source": 0, "sampler": 0}), "texture"));
    let pbr = with(json!({"baseColorTexture": with(json!({"index": 0}), "texture info")}), "pbr");
    let coat = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "extras": strange("coat")}});
    file.push("materials", json!({"name": "m", "pbrMetallicRoughness": pbr, "extensions": coat}));
    let attributes = json!({"POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights});
    let primitive = with(json!({"attributes": attributes, "material": 0}), "primitive");
    file.push("meshes", json!({"name": "placed", "primitives": [primitive]}));
    file.push("meshes", json!({"name": "spare", "primitives": [{"attributes": {"POSITION": position}}]}));
    let lens = with(json!({"yfov": 0.5, "znear": 0.1}), "lens");
    file.push("cameras", with(json!({"name": "eye", "type": "perspective", "perspective": lens}), "camera"));
    file.push(
        "cameras",
        json!({"name": "spare", "type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    let lamp = |name: &str| {
        let mut lamp = with(json!({"name": name, "type": "point"}), name);
        lamp["extras"]["radius"] = json!(0.5);
        lamp
    };
    file.json["extensions"] = json!({"KHR_lights_punctual":
        {"lights": [lamp("lamp"), lamp("twin"), lamp("spare")], "extras": strange("lights")}});
    let carries =
        |light: usize| json!({"KHR_lights_punctual": {"light": light, "extras": strange("carrier")}});
    file.push("nodes", json!({"name": "mesh", "mesh": 0, "skin": 0}));
    file.push("nodes", json!({"name": "joint", "extensions": carries(0)}));
    file.push("nodes", json!({"name": "second", "extensions": carries(1)}));
    file.push("nodes", json!({"name": "camera", "camera": 0}));
    file.push("skins", with(json!({"name": "skin", "joints": [1], "skeleton": 1}), "skin"));
    let times = file.floats("SCALAR", 1, &[0.0, 1.0]);
    let places = file.floats("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    file.push(
        "animations",
        with(
            json!({"name": "clip", "samplers": [{"input": times, "output": places}],
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}),
            "clip",
        ),
    );
    file.push("scenes", with(json!({"name": "stage", "nodes": [0, 1, 2, 3]}), "scene"));
    file.json["scene"] = json!(0);
    file
}

fn messages(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(|warning| warning.message.clone()).collect()
}

/// Exports a file twice; gives the JSON of the second and what was said of the first.
fn through(path: &Path, folder: &Path) -> (Value, Vec<String>) {
    let (once, done) = exported(&placed(read(path)), folder, "once.glb");
    let (twice, _) = exported(&placed(read(&once)), folder, "twice.glb");
    (json_of(&twice), messages(&done.warnings))
}

#[test]
fn names_extras_and_extensions_of_every_object_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = strange_file();
    let (after, said) = through(&file.write(folder.path()), folder.path());
    let before = &file.json;
    let mut compared = 0;
    // Every object of the file that has a name, extras or unknown extensions, wherever it is.
    let mut stack = vec![(String::new(), before)];
    while let Some((place, value)) = stack.pop() {
        if let Some(list) = value.as_array() {
            stack.extend(list.iter().enumerate().map(|(i, inner)| (format!("{place}/{i}"), inner)));
        }
        for (name, inner) in value.as_object().into_iter().flatten() {
            let at = format!("{place}/{name}");
            if name == "name" || name == "extras" || name == "ACME_thing" {
                assert_eq!(after.pointer(&at), Some(inner), "{at}");
                compared += 1;
            } else {
                stack.push((at, inner));
            }
        }
    }
    assert!(compared > 40, "{compared} were compared");
    assert_eq!(after["skins"][0]["skeleton"], json!(1));
    assert_eq!(said, Vec::<String>::new());
}

#[test]
fn lights_of_one_source_keep_their_own_values() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = placed(read(&strange_file().write(folder.path())));
    let node = document.roots()[0];
    let target = Target::part(node, 1);
    let mut light = document.light_of(target).unwrap();
    light.intensity = 7.0;
    document.apply(Edit::SetLight { target, light }).unwrap();
    let (path, _) = exported(&document, folder.path(), "edited.glb");
    let lights = &json_of(&path)["extensions"]["KHR_lights_punctual"]["lights"];
    let names: Vec<&Value> = lights.as_array().unwrap().iter().map(|light| &light["name"]).collect();
    assert_eq!(names, ["lamp", "twin", "spare"]);
    assert_eq!((&lights[0]["intensity"], lights[1].get("intensity")), (&json!(7.0), None));
}

#[test]
fn what_cannot_be_kept_is_counted_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = strange_file();
    let position = file.floats("VEC3", 3, &SQUARE);
    let own = file.floats("SCALAR", 1, &[0.5; 6]);
    for _ in 0..2 {
        let attributes = json!({"POSITION": position, "_OWN": own});
        file.push("meshes", json!({"primitives": [{"attributes": attributes}]}));
    }
    file.push("textures", json!({"source": 0}));
    file.json["nodes"][0]["extensions"] = json!({"MSFT_lod": {"ids": [1]}});
    file.json["materials"][0]["normalTexture"] = json!({"index": 0});
    file.json["nodes"][3]["extensions"] = json!({"KHR_node_visibility": {"visible": true, "extras": 1}});
    let instanced = json!({"attributes": {"TRANSLATION": position, "_ID": own}});
    for _ in 0..2 {
        file.push("nodes", json!({"mesh": 1, "extensions": {"EXT_mesh_gpu_instancing": instanced}}));
    }
    let (_, said) = through(&file.write(folder.path()), folder.path());
    for words in [
        "the attribute _ID of GPU instances is left out (2 times)",
        "the attribute _OWN of triangles is left out (2 times)",
        "a texture that no material has is left out",
        "MSFT_lod, which points into the lists of the file is left out",
        "1 extras or extension is left out with the object that has it",
    ] {
        assert!(said.iter().any(|message| message == words), "{words}: {said:#?}");
    }
}

/// A mesh of a triangle, points and lines, and one of points alone.
pub fn loose_file() -> GltfFile {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    let colors = file.accessor("VEC3", 6, true, Data::U8(&[0, 51, 255].repeat(6)));
    let own = file.accessor("SCALAR", 6, false, Data::U8(&[1, 2, 3, 4, 5, 6]));
    let order = file.accessor("SCALAR", 4, false, Data::U16(&[0, 1, 1, 2]));
    file.push("materials", json!({"name": "wire"}));
    let morph = json!([{"POSITION": position}]);
    let points = json!({"mode": 0, "attributes": {"POSITION": position, "COLOR_0": colors, "_OWN": own},
        "extras": {"of": "points"}, "targets": morph});
    let lines = json!({"mode": 1, "attributes": {"POSITION": position}, "indices": order, "material": 0,
        "targets": morph});
    let triangles = json!({"attributes": {"POSITION": position}, "targets": morph});
    file.push("meshes", json!({"name": "mixed", "primitives": [points, triangles, lines]}));
    file.push("meshes", json!({"name": "dust", "primitives": [points], "weights": [0.5]}));
    file.push("nodes", json!({"name": "mixed", "mesh": 0}));
    file.push("nodes", json!({"name": "dust", "mesh": 1, "translation": [1.0, 0.0, 0.0]}));
    file
}

#[test]
fn points_and_lines_are_kept_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = loose_file().write(folder.path());
    let imported = read(&path);
    let kept = "not rendered and only kept for exports";
    let (two, one) = ("2 primitives of points or lines are", "1 primitive of points or lines is");
    assert_eq!(messages(&imported.warnings), [format!("{two} {kept}"), format!("{one} {kept}")]);
    assert_eq!(placed(imported).renderables().count(), 1, "points are not rendered");

    let (file, said) = through(&path, folder.path());
    assert_eq!(said, Vec::<String>::new());
    let modes = |mesh: usize| -> Vec<u64> {
        let primitives = file["meshes"][mesh]["primitives"].as_array().unwrap();
        primitives.iter().map(|primitive| primitive["mode"].as_u64().unwrap_or(4)).collect()
    };
    assert_eq!((modes(0), modes(1)), (vec![4, 0, 1], vec![0]));
    assert_eq!((&file["nodes"][0]["mesh"], &file["nodes"][1]["mesh"]), (&json!(0), &json!(1)));
    assert_eq!(file["meshes"][1]["weights"], json!([0.5]));
    let points = &file["meshes"][1]["primitives"][0];
    assert_eq!(points["extras"], json!({"of": "points"}));
    assert_eq!(points["targets"].as_array().unwrap().len(), 1);
    let lines = &file["meshes"][0]["primitives"][2];
    let of_lines = lines["material"].as_u64().unwrap() as usize;
    assert_eq!(file["materials"][of_lines]["name"], "wire");
    let accessor = |index: &Value| &file["accessors"][index.as_u64().unwrap() as usize];
    assert_eq!(accessor(&lines["indices"])["count"], 4);
    let position = accessor(&points["attributes"]["POSITION"]);
    assert_eq!((&position["min"], &position["max"]), (&json!([0.0, 0.0, 0.0]), &json!([1.0, 1.0, 0.0])));
    let own = accessor(&points["attributes"]["_OWN"]);
    let view = &file["bufferViews"][own["bufferView"].as_u64().unwrap() as usize];
    assert_eq!((&own["componentType"], &view["byteStride"]), (&json!(5121), &json!(4)), "padded");
}

#[test]
fn the_bytes_of_points_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = loose_file().write(folder.path());
    let (written, _) = exported(&placed(read(&path)), folder.path(), "once.gltf");
    let (file, bytes) = (json_of(&written), std::fs::read(folder.path().join("once.bin")).unwrap());
    let numbers = |index: &Value, size: usize| -> Vec<u8> {
        let accessor = &file["accessors"][index.as_u64().unwrap() as usize];
        let view = &file["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let start = view["byteOffset"].as_u64().unwrap() as usize;
        let stride = view["byteStride"].as_u64().map_or(size, |stride| stride as usize);
        let count = accessor["count"].as_u64().unwrap() as usize;
        (0..count).flat_map(|i| bytes[start + i * stride..][..size].to_vec()).collect()
    };
    let attributes = &file["meshes"][1]["primitives"][0]["attributes"];
    assert_eq!(numbers(&attributes["_OWN"], 1), [1, 2, 3, 4, 5, 6]);
    let floats: Vec<u8> = SQUARE.iter().flat_map(|value| value.to_le_bytes()).collect();
    assert_eq!(numbers(&attributes["POSITION"], 12), floats);
    let color: Vec<u8> = [0.0_f32, 0.2, 1.0].repeat(6).iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(numbers(&attributes["COLOR_0"], 12), color, "as floats");
}

#[test]
fn a_moved_instance_keeps_its_points() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = placed(read(&loose_file().write(folder.path())));
    let prefab = document.prefabs().next().unwrap().0;
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    let (path, _) = exported(&document, folder.path(), "both.glb");
    let file = json_of(&path);
    let places = |mesh: u64| {
        let nodes = file["nodes"].as_array().unwrap().iter();
        nodes.filter(|node| node["mesh"].as_u64() == Some(mesh)).count()
    };
    assert_eq!((places(0), places(1)), (2, 2), "two instances share the meshes");
}

#[test]
fn names_and_extras_of_what_variants_choose_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = loose_file();
    file.json["extensionsUsed"] = json!(["KHR_materials_variants", "ACME_thing"]);
    file.json["extensions"] = json!({"KHR_materials_variants": {"variants": [{"name": "bare"}]}});
    let mapping = json!({"material": 0, "variants": [0], "name": "first",
        "extras": strange("mapping"), "extensions": acme("mapping")});
    for primitive in file.json["meshes"][0]["primitives"].as_array_mut().unwrap() {
        primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": [mapping]}});
    }
    let (after, said) = through(&file.write(folder.path()), folder.path());
    for primitive in after["meshes"][0]["primitives"].as_array().unwrap() {
        assert_eq!(primitive["extensions"]["KHR_materials_variants"]["mappings"], json!([mapping]));
    }
    assert_eq!(after["extensionsUsed"], json!(["ACME_thing", "KHR_materials_variants"]));
    assert_eq!(said, Vec::<String>::new());
}
