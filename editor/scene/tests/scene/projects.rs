//! Projects: what is saved comes back equal, the bytes are the same every time, nothing is lost.

use crate::animation::morphed;
use crate::common::{ARM, LAMP, PLATE, Scene, scene, trs};
use caustica_scene::import::ImportOptions;
use caustica_scene::{
    ClipChoice, Edit, Environment, Local, Material, MaterialEntry, MaterialId, Project, ProjectMeta,
    ProjectProblem, Target, Trs,
};
use glam::{DAffine3, DVec3, Vec3};
use serde_json::{Value, json};

/// A scene with every kind of thing that a project keeps.
pub fn edited(folder: &std::path::Path) -> Scene {
    let mut scene = scene(folder);
    let mut shear = DAffine3::from_translation(DVec3::new(0.1 + 0.2, -0.0, 1e300));
    shear.matrix3.y_axis.x = 0.3;
    let (mesh, _) = scene.document.meshes().next().unwrap();
    let materials: Vec<MaterialId> = scene.document.materials().map(|(id, _)| id).collect();
    let own = MaterialId(scene.document.allocate_id());
    let changed = Material {
        roughness: 0.1,
        emissive: Vec3::new(0.1, 0.2, 0.3),
        ..scene.document.material(materials[1]).unwrap().clone()
    };
    let entry = MaterialEntry::made_here(Material::default());
    let (plate, lamp) = (scene.part(PLATE), scene.part(LAMP));
    let mut lamp_light = scene.document.light_of(lamp).unwrap();
    lamp_light.intensity = 3.5;
    for edit in [
        Edit::SetTransform { target: scene.second.into(), local: Local::Matrix(shear) },
        Edit::SetTransform { target: plate, local: trs(0.1, 0.7, 3.0) },
        Edit::SetVisible { target: scene.part(ARM), visible: false },
        Edit::AddMaterial { material: own, entry: Box::new(entry) },
        Edit::AssignMaterial { target: plate, primitive: 1, material: own },
        Edit::SetMaterial { material: materials[1], value: Box::new(changed) },
        Edit::SetLight { target: lamp, light: lamp_light },
        Edit::SetPrimitiveTransform {
            mesh,
            primitive: 1,
            mesh_from_primitive: DAffine3::from_translation(DVec3::Y),
        },
        Edit::SetEnvironment(Environment::Constant(Vec3::new(0.1, 0.2, 0.3))),
        Edit::SetDefaultCamera(Some(plate)),
        Edit::SetClip { node: scene.second, clip: ClipChoice::Clip(3) },
        Edit::SetVariant { node: scene.second, variant: Some("glowing".into()) },
        Edit::SetLocked { node: scene.second, locked: true },
        Edit::SetRayVisibility { target: plate, camera_visible: false, casts_shadows: true },
        Edit::SetRayVisibility { target: scene.second.into(), camera_visible: true, casts_shadows: false },
    ] {
        scene.document.apply(edit).unwrap();
    }
    scene
}

pub fn meta() -> ProjectMeta {
    let mut meta = ProjectMeta::default();
    meta.view.insert("exposure".into(), json!(1.5));
    meta.render.insert("z".into(), json!({"b": 1, "a": [1, 2]}));
    meta
}

#[test]
fn a_saved_project_comes_back_equal_and_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = edited(folder.path());
    let path = folder.path().join("scene.caustica");
    Project::save(&path, &scene.document, &meta()).unwrap();
    let first = std::fs::read(&path).unwrap();
    let project = Project::load(&path).unwrap();
    assert!(project.warnings.is_empty(), "{:?}", project.warnings);
    assert!(project.document == scene.document);
    assert_eq!(project.meta, meta());
    assert_eq!(project.document.next_id(), scene.document.next_id());
    Project::save(&path, &project.document, &project.meta).unwrap();
    let second = std::fs::read(&path).unwrap();
    assert_eq!(String::from_utf8(first), String::from_utf8(second));
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("\"source\": \"model.gltf\""), "{text}");
    // Single precision is written short.
    assert!(text.contains("0.1,") && !text.contains("0.10000000149"), "{text}");
}

#[test]
fn morph_weights_are_saved_and_a_time_is_not() {
    let Some((mut document, part, own)) = morphed() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    for (target, weights) in [(part, vec![0.1, 0.7]), (own, vec![0.3, 0.0])] {
        document.apply(Edit::SetMorphWeights { target, weights }).unwrap();
    }
    document.set_time(Some(0.3));
    Project::save(&path, &document, &meta()).unwrap();
    // The model is another's and lies elsewhere.
    let refused = Project::load(&path).unwrap();
    assert_eq!(refused.outside.len(), 1);
    let options = ImportOptions { outside_project: true, ..ImportOptions::default() };
    let project = Project::load_with_progress(&path, &options, &|_, _| ()).unwrap();
    assert!(project.warnings.is_empty() && project.outside.is_empty(), "{:?}", project.warnings);
    assert!(project.document == document);
    assert_eq!(project.document.time(), None);
    let weights = |target| project.document.deform_pose(target).unwrap().weights;
    assert_eq!((weights(part), weights(own)), (vec![0.1, 0.7], vec![0.3, 0.0]));
}

#[test]
fn what_was_not_touched_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    Project::save(&path, &scene(folder.path()).document, &meta()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    for key in ["clip", "rayVisibility", "weights", "overrides", "visible"] {
        assert!(!text.contains(key), "{key}: {text}");
    }
    // One of the two fields is enough in a file written by hand.
    let text = text.replace(
        "\"name\": \"Second\"",
        "\"name\": \"Second\", \"rayVisibility\": {\"castsShadows\": false}",
    );
    std::fs::write(&path, text).unwrap();
    let document = Project::load(&path).unwrap().document;
    let (_, second) = document.nodes().find(|(_, node)| node.name == "Second").unwrap();
    assert!(second.ray_visibility.camera_visible && !second.ray_visibility.casts_shadows);
}

#[test]
fn only_edited_materials_are_saved() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    let count = |scene: &Scene| {
        Project::save(&path, &scene.document, &meta()).unwrap();
        let value: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        value["materials"].as_array().map_or(0, Vec::len)
    };
    assert_eq!(count(&scene(folder.path())), 0);
    assert_eq!(count(&edited(folder.path())), 2);
}

#[test]
fn a_project_can_be_moved_with_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (folder.path().join("old"), folder.path().join("new"));
    std::fs::create_dir(&old).unwrap();
    let scene = edited(&old);
    Project::save(&old.join("scene.caustica"), &scene.document, &meta()).unwrap();
    std::fs::rename(&old, &new).unwrap();
    let project = Project::load(&new.join("scene.caustica")).unwrap();
    assert!(project.warnings.is_empty());
    assert_eq!(project.document.renderables().count(), 2);
}

#[test]
fn a_missing_source_becomes_a_placeholder_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let scene = edited(folder.path());
    let path = folder.path().join("scene.caustica");
    Project::save(&path, &scene.document, &meta()).unwrap();
    let before = std::fs::read_to_string(&path).unwrap();
    let model = folder.path().join("model.gltf");
    let hidden = folder.path().join("hidden.gltf");
    std::fs::rename(&model, &hidden).unwrap();
    let project = Project::load(&path).unwrap();
    assert!(project.document.prefab(scene.prefab).unwrap().missing);
    assert!(project.warnings.iter().any(|w| w.message.contains("model.gltf")));
    assert!(!caustica_scene::audit(&project.document).is_empty());
    Project::save(&path, &project.document, &project.meta).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), before);
    std::fs::rename(&hidden, &model).unwrap();
    assert!(Project::load(&path).unwrap().document == scene.document);
}

#[test]
fn unknown_fields_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let scene = edited(folder.path());
    let path = folder.path().join("scene.caustica");
    Project::save(&path, &scene.document, &meta()).unwrap();
    let mut value: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    value["future"] = json!({"x": [1, 2.5]});
    value["nodes"][0]["colour"] = json!("red");
    value["prefabs"][0]["hash"] = json!(12);
    value["materials"][0]["note"] = json!("mine");
    std::fs::write(&path, serde_json::to_vec(&value).unwrap()).unwrap();
    let project = Project::load(&path).unwrap();
    Project::save(&path, &project.document, &project.meta).unwrap();
    let again: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(again["future"], value["future"]);
    assert_eq!(again["nodes"][0]["colour"], "red");
    assert_eq!(again["prefabs"][0]["hash"], 12);
    assert_eq!(again["materials"][0]["note"], "mine");
}

#[test]
fn other_files_and_newer_versions_are_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    let load = |text: &str| {
        std::fs::write(&path, text).unwrap();
        Project::load(&path).unwrap_err()
    };
    let newer = load(r#"{"caustica": 99}"#);
    assert!(matches!(newer.problem, ProjectProblem::Newer { found: 99 }));
    assert!(newer.to_string().contains("newer version"), "{newer}");
    assert!(matches!(load("{}").problem, ProjectProblem::NotAProject));
    for version in ["\"2\"", "1.5", "-1", "null", "0"] {
        let problem = load(&format!("{{\"caustica\": {version}}}"));
        let words = format!("the field \"caustica\" is {version}, which is no version number");
        assert!(problem.to_string().contains(&words), "{problem}");
    }
    for spent in [
        r#"{"caustica": 2, "nextId": 18446744073709551615}"#,
        r#"{"caustica": 2, "nodes": [{"id": 18446744073709551615, "name": ""}]}"#,
    ] {
        assert!(load(spent).to_string().contains("leaves no room"), "{}", load(spent));
    }
    assert!(matches!(load("no").problem, ProjectProblem::Json(_)));
    let marked = load("\u{feff}{\"caustica\": 2}").to_string();
    assert!(marked.contains("begins with a byte order mark"), "{marked}");
    let wide: Vec<u8> = "{\"caustica\": 2}".encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(folder.path().join("wide.caustica"), wide).unwrap();
    let wide = Project::load(&folder.path().join("wide.caustica")).unwrap_err().to_string();
    assert!(wide.contains("UTF-16"), "{wide}");
    let twice = r#"{"caustica":1,"nodes":[{"id":1,"name":"a"},{"id":1,"name":"b"}]}"#;
    assert!(matches!(load(twice).problem, ProjectProblem::Broken(_)));
    let orphan = r#"{"caustica":1,"nodes":[{"id":1,"name":"a","parent":7}]}"#;
    assert!(load(orphan).to_string().contains("node 1"));
    for (node, words) in [
        (
            r#""light":{"color":[1,1,1],"intensity":1,"kind":{"point":{"radius_m":0,"range_m":null}}},
            "camera":{"projection":{"perspective":{"yfov_rad":1}},"near_m":0.1,"far_m":null,"aspect":null}"#,
            "has light and camera",
        ),
        (
            r#""local":{"matrix":[1,0,0,0,1,0,0,0,1,0,0,0],"translation":[1,0,0]}"#,
            "a matrix beside translation",
        ),
    ] {
        let both = load(&format!(r#"{{"caustica":2,"nodes":[{{"id":1,"name":"a",{node}}}]}}"#));
        assert!(both.to_string().contains(words) && both.to_string().contains("node 1"), "{both}");
    }
    let dark = load(r#"{"caustica":2,"environment":{"kind":"constant","radiance":[1e39,-1,0]}}"#);
    let said = "/environment/radiance/0: it is larger than single precision can hold; /environment/radiance/1: -1 is below 0";
    assert!(dark.to_string().contains(said), "{dark}");
}

#[test]
fn what_is_wrong_in_a_project_is_named_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    let chair = |field: &str| format!(r#"[{{"id":1,"name":"a"}},{{"id":7,"name":"Chair",{field}}}]"#);
    let node = "/nodes/1";
    let whom = " (node 7 \"Chair\"): ";
    let place = |inside: &str| format!("{node}{inside}{whom}");
    let paint = r#"[{"id":3,"value":{"name":"Paint","volume_priority":65536}}]"#;
    let cases = [
        (
            "nodes",
            chair(r#""local":{"matrix":[1,0,0,0,1,0,0,0,1,0,0,0,1]}"#),
            place("/local/matrix"),
            "13 values",
        ),
        ("nodes", chair(r#""local":{"matrix":[1,0,0]}"#), place("/local/matrix"), "3 values, expected 12"),
        ("nodes", chair(r#""clip":7"#), place("/clip"), "it is integer \"7\", expected a name or an object"),
        ("nodes", chair(r#""visible":"no""#), place("/visible"), "expected true or false"),
        (
            "nodes",
            chair(r#""clip":{"clip":-1}"#),
            place("/clip/clip"),
            "expected a whole number from 0 to 4294967295",
        ),
        ("nodes", chair(r#""parent":70"#), place(""), "its parent, node 70,"),
        ("nodes", "{}".to_owned(), "/nodes: ".to_owned(), "expected a list"),
        (
            "materials",
            paint.to_owned(),
            "/materials/0/value/volume_priority (material 3 \"Paint\"): ".to_owned(),
            "from 0 to 255",
        ),
        ("nextId", "-1".to_owned(), "/nextId: ".to_owned(), "from 0 to"),
        ("nextId", "18446744073709551615".to_owned(), "/nextId: ".to_owned(), "leaves no room"),
        (
            "environment",
            r#"{"kind":"file"}"#.to_owned(),
            "/environment: ".to_owned(),
            "missing field \"path\"",
        ),
    ];
    for version in [1, 2] {
        for (field, value, place, reason) in &cases {
            let text = format!("{{\"caustica\":{version},\n\"{field}\":{value}}}");
            std::fs::write(&path, text).unwrap();
            let said = Project::load(&path).unwrap_err().to_string();
            assert!(said.starts_with(&*path.to_string_lossy()), "{said}");
            assert!(said.contains(place) && said.contains(reason), "{said}; not {place}{reason}");
            let is_json = said.contains("not a valid project");
            assert_eq!(is_json, said.contains(" at line 2 column "), "{said}");
        }
    }
    std::fs::write(&path, format!("{{\"caustica\":2,\"nodes\":{}}}", chair(r#""id":8"#))).unwrap();
    let twice = Project::load(&path).unwrap_err().to_string();
    assert!(twice.contains("/nodes/1 (node 8 \"Chair\"): duplicate field \"id\" at line 1"), "{twice}");
}

#[test]
fn rotations_that_are_none_are_put_right_with_a_word() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    let text = r#"{"caustica":2,"nodes":[
        {"id":1,"name":"still","local":{"rotation":[0,0,0,0],"translation":[1,2,3]}},
        {"id":2,"name":"long","local":{"rotation":[0,0,0,2]}},
        {"id":3,"name":"sound","local":{"rotation":[0,0,0.6,0.8]}}]}"#;
    std::fs::write(&path, text).unwrap();
    let project = Project::load(&path).unwrap();
    let rotations = project.document.nodes().map(|(_, node)| node.local.nearest_trs().rotation.to_array());
    let unturned = [0.0, 0.0, 0.0, 1.0];
    assert_eq!(rotations.collect::<Vec<_>>(), [unturned, unturned, [0.0, 0.0, 0.6, 0.8]]);
    let words: Vec<String> = project.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(words.len(), 2, "{words:?}");
    assert!(words[0].contains("node 1 \"still\"") && words[0].contains("has no length"), "{words:?}");
    assert!(words[1].contains("node 2 \"long\"") && words[1].contains("not of length 1"), "{words:?}");
}

/// Else whoever asks for the place of each node of a deep tree walks up to the root each time.
#[test]
fn places_are_known_once_a_project_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = edited(folder.path());
    let path = folder.path().join("scene.caustica");
    Project::save(&path, &scene.document, &ProjectMeta::default()).unwrap();
    let mut read = Project::load(&path).unwrap().document;
    assert_eq!(read.update_transforms(), 0);
    scene.document.mark_all_added("again");
    assert_eq!(scene.document.update_transforms(), 0);
    assert!(!read.drain_changes().added.is_empty(), "all of it is told of as new");
}

#[test]
fn ids_stay_unique_after_loading() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.caustica");
    // A file written by hand, without nextId and without the ids of what the prefab brings.
    let text = r#"{"caustica":1,
        "prefabs":[{"id":1,"name":"m","source":"model.gltf"},{"id":2,"name":"n","source":"model.gltf","meshes":[3]}],
        "nodes":[{"id":41,"name":"a","prefab":1},{"id":42,"name":"b","prefab":2,"local":{"translation":[1,2,3]}}]}"#;
    crate::common::model(folder.path());
    std::fs::write(&path, text).unwrap();
    let project = Project::load(&path).unwrap();
    assert!(project.warnings.is_empty(), "{:?}", project.warnings);
    let mut document = project.document;
    assert_eq!(document.renderables().count(), 2);
    assert_eq!(document.meshes().count(), 2);
    let fresh = document.allocate_id();
    assert!(fresh > 42 && document.textures().all(|(id, _)| id.0 < fresh));
    let target = Target::node(caustica_scene::NodeId(42));
    let trs = Trs::from_translation(DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(document.local(target), Some(Local::Trs(trs)));
}
