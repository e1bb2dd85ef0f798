//! Projects whose sources change or go: what was edited follows the names in them, waits for what is gone, and is never lost.

use std::path::{Path, PathBuf};

use crate::projects::meta;
use caustica_scene::import::{ImportOptions, load};
use caustica_scene::{
    Document, Edit, Finding, Local, Material, MaterialId, PrefabId, Project, ProjectMeta, Severity, audit,
};
use serde_json::{Value, json};

/// A model of one triangle for each of these materials, each with a texture of its own.
fn write_model(folder: &Path, materials: &[&str]) -> PathBuf {
    let positions: Vec<u8> =
        [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("triangle.bin"), &positions).unwrap();
    for name in materials {
        let shade = name.bytes().fold(0, u8::wrapping_add);
        let file = folder.join(format!("{name}.png"));
        image::RgbaImage::from_pixel(2, 2, image::Rgba([shade, 0, 0, 255])).save(file).unwrap();
    }
    let each = |make: fn(usize, &str) -> Value| -> Vec<Value> {
        materials.iter().enumerate().map(|(at, name)| make(at, name)).collect()
    };
    let model = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "triangle.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]}],
        "images": each(|_, name| json!({"uri": format!("{name}.png"), "name": name})),
        "textures": each(|at, _| json!({"source": at})),
        "materials": each(|at, name| json!({"name": name,
            "pbrMetallicRoughness": {"baseColorTexture": {"index": at}}})),
        "meshes": each(|at, name| json!({"name": name,
            "primitives": [{"attributes": {"POSITION": 0}, "material": at}]})),
        "nodes": each(|at, name| json!({"name": name, "mesh": at})),
        "scenes": [{"nodes": (0..materials.len()).collect::<Vec<_>>()}],
        "scene": 0
    });
    let path = folder.join("model.gltf");
    std::fs::write(&path, model.to_string()).unwrap();
    path
}

fn named(document: &Document, name: &str) -> Vec<(MaterialId, Material)> {
    let all = document.materials().filter(|(_, material)| material.name == name);
    all.map(|(id, material)| (id, material.clone())).collect()
}

/// A project of the model with "b" made smooth and its mesh moved, saved in the folder.
struct Edited {
    folder: tempfile::TempDir,
    path: PathBuf,
    document: Document,
    prefab: PrefabId,
}

fn edited() -> Edited {
    let folder = tempfile::tempdir().unwrap();
    let model = write_model(folder.path(), &["a", "b", "c"]);
    let mut document = Document::new();
    let prefab = document.add_imported(load(&model, &ImportOptions::default()).unwrap()).unwrap();
    let (_, place) = document.instantiate_edit(prefab, None, Local::default());
    let (material, value) = named(&document, "b").remove(0);
    let value = Box::new(Material { roughness: 0.125, ..value });
    let (mesh, _) = document.meshes().find(|(_, mesh)| mesh.name == "b").unwrap();
    let mesh_from_primitive = glam::DAffine3::from_translation(glam::DVec3::X);
    for edit in [
        place,
        Edit::SetMaterial { material, value },
        Edit::SetPrimitiveTransform { mesh, primitive: 0, mesh_from_primitive },
    ] {
        document.apply(edit).unwrap();
    }
    let path = folder.path().join("scene.caustica.json");
    Project::save(&path, &document, &meta()).unwrap();
    Edited { folder, path, document, prefab }
}

/// The one material of this name is edited, and its texture is that of the same name.
fn assert_edited(document: &Document, name: &str) {
    let found = named(document, name);
    let [(_, material)] = &found[..] else { panic!("{} of {name}", found.len()) };
    assert_eq!(material.roughness, 0.125, "{name}");
    let texture = document.texture(material.base_color_texture.unwrap().texture).unwrap();
    assert_eq!(texture.name, name);
    assert!(!texture.placeholder);
}

fn moved(document: &Document) -> Vec<&str> {
    let moved = document
        .meshes()
        .filter(|(_, mesh)| mesh.primitives[0].mesh_from_primitive != glam::DAffine3::IDENTITY);
    moved.map(|(_, mesh)| mesh.name.as_str()).collect()
}

#[test]
fn edits_follow_the_names_in_a_source_that_changed() {
    let Edited { folder, path, .. } = edited();
    write_model(folder.path(), &["d", "c", "b", "a"]);
    let project = Project::load(&path).unwrap();
    assert!(project.warnings.is_empty(), "{:?}", project.warnings);
    assert_edited(&project.document, "b");
    assert_eq!(moved(&project.document), ["b"]);
    for name in ["a", "c", "d"] {
        assert_eq!(named(&project.document, name)[0].1.roughness, 1.0, "{name}");
    }
}

#[test]
fn what_was_edited_waits_for_a_source_that_lacks_it() {
    let Edited { folder, path, document, .. } = edited();
    write_model(folder.path(), &["c", "a"]);
    for _ in 0..2 {
        let project = Project::load(&path).unwrap();
        let told = |what: &str| project.warnings.iter().any(|warning| warning.to_string().contains(what));
        assert!(told("(material 6 \"b\")") && told("textures") && told("mesh"), "{:?}", project.warnings);
        assert!(named(&project.document, "c")[0].1.roughness == 1.0);
        Project::save(&path, &project.document, &project.meta).unwrap();
    }
    write_model(folder.path(), &["a", "b", "c"]);
    let again = Project::load(&path).unwrap();
    assert!(again.warnings.is_empty(), "{:?}", again.warnings);
    assert_edited(&again.document, "b");
    assert_eq!(moved(&again.document), ["b"]);
    assert_eq!(named(&again.document, "b")[0].0, named(&document, "b")[0].0, "it has its id again");
}

#[test]
fn moves_that_fit_do_not_take_the_place_of_those_that_do_not() {
    let Edited { folder: _folder, path, .. } = edited();
    let mut file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    file["meshes"][0]["primitives"]["3"] = json!([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 7]);
    std::fs::write(&path, file.to_string()).unwrap();
    for _ in 0..2 {
        let project = Project::load(&path).unwrap();
        assert_eq!(project.warnings.len(), 1, "{:?}", project.warnings);
        assert_eq!(moved(&project.document), ["b"]);
        Project::save(&path, &project.document, &project.meta).unwrap();
        let saved: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let primitives = saved["meshes"][0]["primitives"].as_object().unwrap();
        assert_eq!(primitives.keys().collect::<Vec<_>>(), ["0", "3"]);
    }
}

#[test]
fn a_reload_keeps_what_was_edited_and_is_undone() {
    let Edited { folder, document: before, prefab, .. } = edited();
    let mut document = before.clone();
    let mut undo = Vec::new();
    for materials in [&["c", "a"][..], &["b", "x"]] {
        let model = write_model(folder.path(), materials);
        let imported = load(&model, &ImportOptions::default()).unwrap();
        let edit = document.reload_edit(prefab, imported).unwrap();
        undo.push((document.clone(), document.apply(edit).unwrap()));
        let found = named(&document, "b");
        assert_eq!((found.len(), found[0].1.roughness), (1, 0.125), "{materials:?}");
    }
    assert_edited(&document, "b");
    while let Some((before, edit)) = undo.pop() {
        document.apply(edit).unwrap();
        assert!(document == before);
    }
}

#[test]
fn a_merged_project_brings_what_it_keeps_for_its_sources() {
    let Edited { folder, path, .. } = edited();
    let mut file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    file["nodes"][0]["colour"] = json!("red");
    std::fs::write(&path, file.to_string()).unwrap();
    write_model(folder.path(), &["a"]);
    let other = Project::load(&path).unwrap();
    let mut document = Document::new();
    document.allocate_id();
    let copies = document.merge_edit(&other.document, "other").unwrap();
    let mut meta = ProjectMeta::default();
    meta.keep_of(&other.meta, |id| copies.id_of(id));
    document.apply(copies.edit).unwrap();
    let merged = folder.path().join("merged.caustica.json");
    Project::save(&merged, &document, &meta).unwrap();
    write_model(folder.path(), &["c", "b", "a"]);
    let project = Project::load(&merged).unwrap();
    assert!(project.warnings.is_empty(), "{:?}", project.warnings);
    assert_edited(&project.document, "b");
    assert_eq!(moved(&project.document), ["b"]);
    assert!(std::fs::read_to_string(&merged).unwrap().contains("\"colour\": \"red\""));
}

#[test]
fn a_unique_copy_has_what_is_kept_for_its_source() {
    let Edited { folder, path, prefab, .. } = edited();
    write_model(folder.path(), &["a"]);
    let Project { mut document, mut meta, .. } = Project::load(&path).unwrap();
    let (_, again) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(again).unwrap();
    let (node, _) = document.nodes().last().unwrap();
    let copies = document.make_unique_edit(node).unwrap();
    meta.keep_of(&meta.clone(), |id| copies.id_of(id));
    document.apply(copies.edit).unwrap();
    Project::save(&path, &document, &meta).unwrap();
    write_model(folder.path(), &["a", "b", "c"]);
    let project = Project::load(&path).unwrap();
    assert!(project.warnings.is_empty(), "{:?}", project.warnings);
    assert_eq!(moved(&project.document), ["b", "b"]);
    assert_eq!(named(&project.document, "b").len(), 2);
}

#[test]
fn paths_of_other_machines_stay_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica.json");
    let sources = [
        "C:\\models\\a.glb",
        "\\\\host\\share\\a.glb",
        "//host/a.glb",
        "http://host/a.glb",
        "/Users/b/a.glb",
    ];
    let skies = ["d:/sky.hdr", "//host/sky.hdr", "https://host/sky.hdr", "E:\\sky.exr", "/Users/b/sky.hdr"];
    for (source, sky) in sources.iter().zip(skies) {
        let text = json!({"caustica": 2, "prefabs": [{"id": 1, "name": "m", "source": source}],
            "environment": {"kind": "file", "path": sky}});
        std::fs::write(&path, text.to_string()).unwrap();
        let project = Project::load(&path).unwrap();
        assert_eq!(project.warnings.len(), 2, "{:?}", project.warnings);
        let elsewhere = folder.path().join("deep/er");
        std::fs::create_dir_all(&elsewhere).unwrap();
        for path in [path.clone(), elsewhere.join("scene.caustica.json")] {
            Project::save(&path, &project.document, &project.meta).unwrap();
            let saved: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
            assert_eq!(saved["prefabs"][0]["source"], *source);
            assert_eq!(saved["environment"]["path"], sky);
        }
    }
}

#[test]
fn surroundings_that_are_missing_are_an_error_and_addresses_are_shown_as_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica.json");
    let text = json!({"caustica": 2, "prefabs": [{"id": 1, "name": "m", "source": "http://host/a.glb"}],
        "environment": {"kind": "file", "path": "absent.hdr"}});
    std::fs::write(&path, text.to_string()).unwrap();
    let findings = audit(&Project::load(&path).unwrap().document);
    let errors: Vec<&Finding> = findings.iter().filter(|found| found.severity == Severity::Error).collect();
    let [source, sky] = errors[..] else { panic!("{findings:?}") };
    assert!(source.message.contains("http://host/a.glb could not be read"), "{source}");
    assert!(sky.about().starts_with("scene \"environment\": "), "{sky}");
    assert!(sky.message.contains("absent.hdr could not be read"), "{sky}");
}

#[test]
fn materials_of_primitives_that_a_mesh_lacks_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let scene = crate::common::scene(folder.path());
    let path = folder.path().join("scene.caustica.json");
    Project::save(&path, &scene.document, &Default::default()).unwrap();
    let mut value: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let red = scene.document.prefab(scene.prefab).unwrap().materials[0].0;
    let nodes = value["nodes"].as_array_mut().unwrap();
    let first = nodes.iter_mut().find(|node| node["name"] == "First").unwrap();
    first["overrides"] = json!({"Root/Arm/Plate": {"materials": {"1": red, "7": red}}, "Root/Lamp": {"materials": {"0": red}}});
    std::fs::write(&path, value.to_string()).unwrap();
    let project = Project::load(&path).unwrap();
    let words: Vec<String> = audit(&project.document).iter().map(ToString::to_string).collect();
    let said = |words_of: &str| {
        words.iter().any(|word| word.starts_with("warning: First") && word.contains(words_of))
    };
    assert!(said("primitives 7 of Root/Arm/Plate, whose mesh has 2 primitives"), "{words:?}");
    assert!(said("primitives 0 of Root/Lamp, whose mesh has 0 primitives"), "{words:?}");
    assert_eq!(words.len(), 2, "{words:?}");
}

#[cfg(unix)]
#[test]
fn a_folder_may_be_reached_through_a_link() {
    let Edited { folder, document, .. } = edited();
    let links = tempfile::tempdir().unwrap();
    let link = links.path().join("link");
    std::os::unix::fs::symlink(folder.path(), &link).unwrap();
    let path = link.join("scene.caustica.json");
    Project::save(&path, &document, &meta()).unwrap();
    let saved: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(saved["prefabs"][0]["source"], "model.gltf");
    let project = Project::load(&path).unwrap();
    assert!(project.warnings.is_empty() && project.outside.is_empty(), "{:?}", project.warnings);
}

#[cfg(unix)]
#[test]
fn a_name_that_is_no_text_is_refused_when_it_would_be_written() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let model = write_model(folder.path(), &["a"]);
    let odd = folder.path().join(std::ffi::OsStr::from_bytes(b"m\xff.gltf"));
    std::fs::rename(model, &odd).unwrap();
    let mut document = Document::new();
    document.add_imported(load(&odd, &ImportOptions::default()).unwrap()).unwrap();
    let path = folder.path().join("scene.caustica.json");
    let refused = Project::save(&path, &document, &meta()).unwrap_err().to_string();
    assert!(refused.contains("UTF-8") && !path.exists(), "{refused}");
}

#[test]
fn unknown_fields_are_kept_at_any_depth() {
    let Edited { folder: _folder, path, prefab, .. } = edited();
    let mut file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let at = |file: &mut Value, pointer: &str, value: Value| {
        let (inside, field) = pointer.rsplit_once('/').unwrap();
        file.pointer_mut(inside).unwrap()[field] = value;
    };
    let light = json!({"color": [1, 1, 1], "intensity": 2, "kind": {"point": {"radius_m": 0.1, "range_m": null, "blink": 3}}});
    at(&mut file, "/nodes/0/local", json!({"translation": [1, 2, 3], "pivot": [0.1, 0.5, 1]}));
    at(&mut file, "/nodes/0/overrides", json!({"a": {"visible": false, "tint": {"of": [1, 2]}}}));
    file["nodes"].as_array_mut().unwrap().push(json!({"id": 100, "name": "lamp", "light": light}));
    at(&mut file, "/materials/0/value/fuzz", json!(0.25));
    at(&mut file, "/meshes/0/note", json!("moved"));
    at(
        &mut file,
        "/environment",
        json!({"kind": "constant", "radiance": [0.1, 0.1, 0.1], "fog": {"density": 1}}),
    );
    at(&mut file, "/note", json!([1, {"a": null}]));
    std::fs::write(&path, file.to_string()).unwrap();
    let Project { mut document, meta, warnings, .. } = Project::load(&path).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let saved = |document: &Document| -> Value {
        Project::save(&path, document, &meta).unwrap();
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap()
    };
    let same = |file: &Value, saved: &Value, pointer: &str| {
        assert!(file.pointer(pointer).is_some(), "{pointer}");
        assert_eq!(file.pointer(pointer), saved.pointer(pointer), "{pointer}");
    };
    let first = saved(&document);
    for pointer in [
        "/nodes/0/local/pivot",
        "/nodes/0/overrides/a/tint",
        "/nodes/1/light/kind/point/blink",
        "/materials/0/value/fuzz",
        "/meshes/0/note",
        "/environment/fog",
        "/note",
    ] {
        same(&file, &first, pointer);
    }
    // What they belonged to may change or go.
    let (lamp, _) = document.nodes().find(|(_, node)| node.name == "lamp").unwrap();
    let mut light = document.light_of(lamp.into()).unwrap();
    light.kind = caustica_scene::LightKind::Directional { angular_radius_rad: 0.0 };
    document.apply(Edit::SetLight { target: lamp.into(), light }).unwrap();
    let placed = document.nodes().find(|(_, node)| node.prefab() == Some(prefab)).unwrap().0;
    document.apply(Edit::SetTransform { target: placed.into(), local: Local::default() }).unwrap();
    let second = saved(&document);
    assert_eq!(second.pointer("/nodes/1/light/kind").unwrap().as_object().unwrap().len(), 1);
    let again = Project::load(&path).unwrap();
    assert!(again.warnings.is_empty() && again.document == document, "{:?}", again.warnings);
}

#[test]
fn what_is_named_and_not_there_is_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica.json");
    let text = json!({"caustica": 2, "camera": {"node": 9}, "nodes": [
        {"id": 1, "name": "plate", "mesh": 7, "materials": [8]},
        {"id": 2, "name": "group"},
    ]});
    std::fs::write(&path, text.to_string()).unwrap();
    let project = Project::load(&path).unwrap();
    let words: String = project.warnings.iter().map(|warning| format!("{warning}\n")).collect();
    for part in ["node 1 \"plate\"", "mesh 7", "material 8", "camera", "node 9"] {
        assert!(words.contains(part), "{part}: {words}");
    }
    Project::save(&path, &project.document, &project.meta).unwrap();
    let saved: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!((&saved["camera"]["node"], &saved["nodes"][0]["mesh"]), (&json!(9), &json!(7)));
    let round = r#"{"caustica":2,"nodes":[{"id":1,"name":"a","parent":2},{"id":2,"name":"b","parent":1}]}"#;
    std::fs::write(&path, round).unwrap();
    let error = Project::load(&path).unwrap_err().to_string();
    assert!(error.contains("(node 1 \"a\"): its parent, node 2"), "{error}");
}
