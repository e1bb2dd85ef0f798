//! Several scenes in one file: one is chosen for each instance by name, undone, kept in projects, and all are exported.

use std::path::Path;

use caustica_scene::{
    Camera, ClipChoice, Document, Edit, EditError, Environment, Node, NodeId, NodeKind, Project, Target,
    audit,
};
use glam::Vec3;
use serde_json::{Value, json};

use crate::export::{exported, json_of, placed, read};
use crate::gltf_file::{GltfFile, SQUARE};

/// Scenes "day", one without a name, and another "day": a floor that two share, a mesh, lamp and camera that only one
/// has, and a node that none has.
pub fn file() -> GltfFile {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    for name in ["floor", "chair"] {
        file.push("meshes", json!({"name": name, "primitives": [{"attributes": {"POSITION": position}}]}));
    }
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    file.push("nodes", json!({"name": "nowhere", "mesh": 1}));
    file.push("nodes", json!({"name": "floor", "mesh": 0}));
    file.push("nodes", json!({"name": "chair", "mesh": 1, "children": [3, 4]}));
    file.push("nodes", json!({"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}}));
    file.push("nodes", json!({"name": "eye", "camera": 0}));
    file.push("scenes", json!({"name": "day", "nodes": [2, 1], "extras": {"of": "first"}}));
    file.push(
        "scenes",
        json!({"nodes": [1],
        "extras": {"environment": {"constantRadiance": [1.0, 0.5, 0.25]}}}),
    );
    file.push("scenes", json!({"name": "day", "nodes": []}));
    let times = file.floats("SCALAR", 1, &[0.0, 1.0]);
    let places = file.floats("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    file.push(
        "animations",
        json!({"samplers": [{"input": times, "output": places}],
        "channels": [{"sampler": 0, "target": {"node": 3, "path": "translation"}}]}),
    );
    file.json["scene"] = json!(1);
    file
}

fn opened(folder: &Path) -> (Document, NodeId) {
    let document = placed(read(&file().write(folder)));
    let node = document.roots()[0];
    (document, node)
}

fn choose(document: &mut Document, node: NodeId, scene: Option<&str>) -> Edit {
    document.apply(Edit::SetScene { node, scene: scene.map(str::to_owned) }).unwrap()
}

/// Names of what hangs below a target.
fn below(document: &Document, target: Target) -> Vec<String> {
    document.children_of(target).into_iter().map(|child| document.display_name(child)).collect()
}

fn shown(document: &Document) -> [usize; 3] {
    [document.renderables().count(), document.lights().count(), document.cameras().count()]
}

#[test]
fn a_scene_is_chosen_for_an_instance_and_undone() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, node) = opened(folder.path());
    let prefab = document.prefabs().next().unwrap().1;
    assert_eq!(prefab.scene_names(), ["day", "scene 2", "day#2"]);
    assert_eq!((prefab.default_scene(), prefab.nodes().len()), (1, 5));
    assert_eq!((below(&document, node.into()), shown(&document)), (vec!["floor".to_owned()], [1, 0, 0]));
    assert_eq!(document.effective_environment(), Environment::Constant(Vec3::new(1.0, 0.5, 0.25)));
    document.drain_changes();

    let undo = choose(&mut document, node, Some("day"));
    assert_eq!(
        (below(&document, node.into()), shown(&document)),
        (vec!["floor".into(), "chair".into()], [2, 1, 1])
    );
    assert_eq!(document.effective_environment(), Environment::Constant(Vec3::ZERO), "the lamp shines");
    let changes = document.drain_changes();
    let brought = |target: &Target| document.display_name(*target);
    let added: Vec<String> = changes.added.keys().map(brought).collect();
    assert_eq!(added, ["floor", "chair", "lamp", "eye"]);
    assert!(changes.environment);

    document.apply(undo).unwrap();
    assert_eq!((document.scene_of(node), shown(&document)), (None, [1, 0, 0]));
    let changes = document.drain_changes();
    let removed = changes.removed.len();
    assert_eq!((removed, changes.added.len()), (3, 1), "what stays is sent anew");
    choose(&mut document, node, Some("day#2"));
    assert_eq!((below(&document, node.into()), shown(&document)), (Vec::new(), [0, 0, 0]));
    let unknown = document.apply(Edit::SetScene { node, scene: Some("night".into()) }).unwrap_err();
    assert_eq!(unknown, EditError::NoScene("night".into()));
}

#[test]
fn what_is_not_in_the_scene_is_neither_changed_nor_played() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, node) = opened(folder.path());
    let names: Vec<String> =
        document.prefabs().next().unwrap().1.nodes().iter().map(|part| part.name.clone()).collect();
    let part = |name: &str| Target::part(node, names.iter().position(|known| known == name).unwrap() as u32);
    assert!(document.contains(part("floor")) && !document.contains(part("chair")));
    assert!(document.light(part("lamp")).is_none() && document.renderable(part("chair")).is_none());
    document.apply(Edit::SetClip { node, clip: ClipChoice::All }).unwrap();
    document.drain_changes();
    document.set_time(Some(0.5));
    assert_eq!(document.drain_changes().transforms.len(), 0, "the lamp is elsewhere");
    choose(&mut document, node, Some("day"));
    document.drain_changes();
    document.set_time(Some(0.75));
    let moved: Vec<Target> = document.drain_changes().transforms.into_keys().collect();
    assert_eq!(moved, [part("lamp")]);
}

#[test]
fn the_scene_is_kept_in_projects_and_told_of_when_the_source_loses_it() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, node) = opened(folder.path());
    choose(&mut document, node, Some("day"));
    let path = folder.path().join("scene.caustica.json");
    Project::save(&path, &document, &Default::default()).unwrap();
    let loaded = Project::load(&path).unwrap();
    assert_eq!(loaded.document.scene_of(node), Some("day"));
    assert_eq!(shown(&loaded.document), [2, 1, 1]);

    let mut other = file();
    other.json["scenes"].as_array_mut().unwrap().truncate(2);
    other.json["scenes"][0]["name"] = Value::from("night");
    let imported = read(&other.write(folder.path()));
    let prefab = document.prefabs().next().unwrap().0;
    let edit = document.reload_edit(prefab, imported).unwrap();
    document.apply(edit).unwrap();
    assert_eq!((document.scene_of(node), shown(&document)), (Some("day"), [1, 0, 0]));
    assert!(audit(&document).iter().any(|finding| finding.message.contains("show the scene day")));
}

#[test]
fn all_scenes_are_exported() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, node) = opened(folder.path());
    for (scene, index, nodes) in [(None, 1, ["floor"].as_slice()), (Some("day"), 0, &["floor", "chair"])] {
        choose(&mut document, node, scene);
        let (path, done) = exported(&document, folder.path(), "all.glb");
        assert!(done.warnings.is_empty(), "{:?}", done.warnings);
        let file = json_of(&path);
        assert_eq!((&file["scene"], file["scenes"].as_array().unwrap().len()), (&json!(index), 3));
        assert_eq!(file["nodes"].as_array().unwrap().len(), 5, "that of no scene too");
        let names: Vec<&Value> = (0..3).map(|scene| &file["scenes"][scene]["name"]).collect();
        assert_eq!(names, [&json!("day"), &Value::Null, &json!("day")]);
        assert_eq!(file["scenes"][0]["extras"], json!({"of": "first"}));
        assert_eq!(file["animations"][0]["channels"].as_array().unwrap().len(), 1);
        let again = placed(read(&path));
        let top = again.roots()[0];
        let mut found = below(&again, top.into());
        found.sort_by_key(|name| nodes.iter().position(|known| known == name));
        assert_eq!(found, nodes);
        let before = document.effective_environment();
        assert_eq!(again.effective_environment(), before);
    }
}

#[test]
fn scenes_that_are_left_out_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, node) = opened(folder.path());
    let local = crate::common::trs(1.0, 0.0, 1.0);
    document.apply(Edit::SetTransform { target: node.into(), local }).unwrap();
    let (path, done) = exported(&document, folder.path(), "moved.glb");
    let said: Vec<&str> = done.warnings.iter().map(|warning| warning.message.as_str()).collect();
    assert!(said[1].starts_with("2 scenes that are not shown are left out, with 4 nodes"), "{said:?}");
    assert!(said[0].starts_with("1 channel is left out"), "{said:?}");
    let file = json_of(&path);
    assert_eq!((file["nodes"].as_array().unwrap().len(), file.get("animations")), (2, None));
    let again = placed(read(&path));
    assert_eq!(shown(&again), [1, 0, 0]);
}

#[test]
fn a_node_that_two_scenes_place_at_different_depths_is_said() {
    let mut file = GltfFile::new();
    file.push("nodes", json!({"name": "top", "children": [1]}));
    file.push("nodes", json!({"name": "inner"}));
    file.push("scenes", json!({"nodes": [0]}));
    file.push("scenes", json!({"nodes": [1]}));
    let folder = tempfile::tempdir().unwrap();
    let imported = read(&file.write(folder.path()));
    assert_eq!(imported.prefab.nodes().len(), 2);
    assert_eq!(imported.warnings[0].place, "/nodes/1");
    assert!(imported.warnings[0].message.contains("in two places"), "{:?}", imported.warnings);
    let document = placed(imported);
    assert_eq!(below(&document, document.roots()[0].into()), ["top"]);
}

#[test]
fn cameras_of_one_name_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = crate::common::scene(folder.path()).document;
    for name in ["Eye", ""] {
        let (_, edit) = document.add_edit(Node::new(name, NodeKind::Camera(Camera::default())), None);
        document.apply(edit).unwrap();
    }
    let names = document.camera_names();
    assert_eq!(names, ["Plate", "Plate#2", "Eye", "Eye#2", "camera 5"]);
    let targets: Vec<Target> = document.cameras().map(|camera| camera.target).collect();
    for (name, target) in names.iter().zip(targets) {
        assert_eq!(document.find_camera(name).map(|camera| camera.target), Some(target), "{name}");
    }
    assert!(document.find_camera("Plate#3").is_none() && document.find_camera("").is_none());
}
