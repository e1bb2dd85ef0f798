//! Values of a project that cannot be: numbers out of their range, more shapes than a scene may have, lists without end.

use std::path::Path;

use caustica_scene::{Cloud, Document, Edit, EditError, Local, Project, ProjectMeta, ShapeSource};
use serde_json::{Value, json};

use crate::export::{exported, validated};

fn load(folder: &Path, members: Value) -> Result<Project, String> {
    let path = folder.join("p.caustica.json");
    let mut file = json!({"caustica": 2, "nextId": 1000});
    file.as_object_mut().unwrap().extend(members.as_object().unwrap().clone());
    std::fs::write(&path, file.to_string()).unwrap();
    Project::load(&path).map_err(|error| error.to_string())
}

/// What is said at a place.
fn said(project: &Project, place: &str) -> String {
    let at = project.warnings.iter().filter(|warning| warning.place == place);
    at.map(|warning| warning.message.clone()).collect::<Vec<_>>().join("; ")
}

#[test]
fn values_out_of_range_are_held_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let value = json!({"metallic": 7, "roughness": -3, "ior": 0.2, "transmission": 5, "attenuation_color": [2, 0, 0],
        "attenuation_distance_m": -1, "has_volume": true, "emissive": [-1, 0, 0], "specular": 9, "dispersion": -1,
        "alpha": {"mask": {"cutoff": -1}}, "sheen": {"color": [3, 0, 0]}});
    let light =
        json!({"color": [1, -1, 1], "intensity": -5, "kind": {"point": {"radius_m": -1, "range_m": -2}}});
    let camera = |yfov: f32, near: f32, far: Value, aspect: f32| json!({"projection": {"perspective": {"yfov_rad": yfov}}, "near_m": near, "far_m": far, "aspect": aspect});
    let nodes = json!([{"id": 2, "name": "a", "light": light}, {"id": 3, "name": "b", "camera": camera(-1.0, 0.0, Value::Null, -1.0)},
        {"id": 4, "name": "c", "camera": camera(9.0, 0.5, json!(0.25), 1.0)}]);
    let project =
        load(folder.path(), json!({"materials": [{"id": 1, "value": value}], "nodes": nodes})).unwrap();
    for (place, words) in [
        ("/materials/0/value/metallic", "7 cannot be; 1 is taken"),
        ("/materials/0/value/roughness", "-3 cannot be; 0 is taken"),
        ("/materials/0/value/ior", "0.2 cannot be; 1 is taken"),
        ("/materials/0/value/transmission", "5 cannot be; 1 is taken"),
        ("/materials/0/value/attenuation_color/0", "2 cannot be; 1 is taken"),
        ("/materials/0/value/attenuation_distance_m", "-1 cannot be; it is left out"),
        ("/materials/0/value/emissive/0", "-1 cannot be; 0 is taken"),
        ("/materials/0/value/specular", "9 cannot be; 1 is taken"),
        ("/materials/0/value/dispersion", "-1 cannot be; 0 is taken"),
        ("/materials/0/value/alpha/mask/cutoff", "-1 cannot be; 0 is taken"),
        ("/materials/0/value/sheen/color/0", "3 cannot be; 1 is taken"),
        ("/nodes/0/light/color/1", "-1 cannot be; 0 is taken"),
        ("/nodes/0/light/intensity", "-5 cannot be; 0 is taken"),
        ("/nodes/0/light/kind/point/radius_m", "-1 cannot be; 0 is taken"),
        ("/nodes/0/light/kind/point/range_m", "-2 cannot be; it is left out"),
        ("/nodes/1/camera/projection/perspective/yfov_rad", "-1 cannot be; 0.0001 is taken"),
        ("/nodes/1/camera/near_m", "0 cannot be; 0.01 is taken"),
        ("/nodes/1/camera/aspect", "-1 cannot be; it is left out"),
        ("/nodes/2/camera/far_m", "0.25 cannot be; it is left out"),
    ] {
        assert_eq!(said(&project, place), words, "{place}");
    }
    assert!(
        said(&project, "/nodes/2/camera/projection/perspective/yfov_rad").starts_with("9 cannot be; 3.14")
    );
    assert_eq!(project.warnings.len(), 20, "{:?}", project.warnings);
    let (path, _) = exported(&project.document, folder.path(), "out.gltf");
    let text = validated(&[path]).unwrap_or_default();
    assert!(!text.contains("error: "), "{text}");
    // What was held is in order when it is saved and read again.
    let path = folder.path().join("again.caustica.json");
    Project::save(&path, &project.document, &ProjectMeta::default()).unwrap();
    assert!(Project::load(&path).unwrap().warnings.is_empty());
}

fn cloud(count: u32) -> ShapeSource {
    ShapeSource::Cloud(Cloud { count, ..Cloud::default() })
}

#[test]
fn clouds_are_limited_in_sum_before_they_are_made() {
    let folder = tempfile::tempdir().unwrap();
    let source = json!({"kind": "cloud", "seed": 1, "count": 16_777_216, "distribution": "box", "halfExtentM": [1, 1, 1],
        "radiusM": [0.1, 0.2], "boxes": 0.5});
    let shapes: Vec<Value> =
        (0..30).map(|i| json!({"id": 100 + i, "name": "c", "source": source, "materials": [1, 1]})).collect();
    let refused =
        load(folder.path(), json!({"materials": [{"id": 1, "value": {}}], "shapes": shapes})).unwrap_err();
    assert!(refused.contains("/shapes/2/source/count: with those of the others"), "{refused}");

    let mut document = Document::new();
    let add = |document: &mut Document| {
        let (_, edit) = document.add_shapes_edit("c", cloud(12_000_000), &[], Local::default()).unwrap();
        document.apply(edit)
    };
    let undo = add(&mut document).unwrap();
    add(&mut document).unwrap();
    assert_eq!(add(&mut document), Err(EditError::TooManyShapes { count: 36_000_000 }));
    document.apply(undo).unwrap();
    add(&mut document).unwrap();
    let mesh = document.meshes().map(|(id, _)| id).last().unwrap();
    let fewer = Edit::SetShapes { mesh, source: Box::new(cloud(9_000_000)) };
    document.apply(fewer).unwrap();
    add(&mut document).unwrap();
}

#[test]
fn lists_of_a_project_that_become_too_much_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let ids: Vec<u32> = (2..1_000_000).collect();
    let prefab = json!({"id": 1, "name": "k", "source": "gone.gltf", "materials": ids});
    let refused = load(folder.path(), json!({"nextId": 3_000_000, "prefabs": [prefab]})).unwrap_err();
    assert!(refused.contains("/prefabs: with the other lists of the file it becomes"), "{refused}");
    let nodes: Vec<Value> = (1..60_000).map(|id| json!({"id": id, "name": ""})).collect();
    assert!(load(folder.path(), json!({"nextId": 3_000_000, "nodes": nodes})).is_ok());
}
