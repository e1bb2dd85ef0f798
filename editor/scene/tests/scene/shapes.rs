//! Spheres and boxes in a document: edits and their undo, projects that hold the description alone, files that are missing.

use std::path::Path;

use caustica_scene::import::load_shapes;
use caustica_scene::{
    Cloud, Document, Edit, EditError, Local, Material, MeshId, NodeId, Project, ProjectMeta, SCHEMA_VERSION,
    Severity, ShapeFile, ShapeSource, Target, audit,
};
use glam::{DAffine3, DVec3, Vec3};
use serde_json::Value;

fn ball(radius_m: f32) -> ShapeSource {
    ShapeSource::Sphere { centre: Vec3::ZERO, radius_m }
}

fn cloud(count: u32) -> ShapeSource {
    ShapeSource::Cloud(Cloud { count, ..Cloud::default() })
}

fn add(document: &mut Document, name: &str, source: ShapeSource) -> (NodeId, MeshId) {
    let (node, edit) =
        document.add_shapes_edit(name, source, &[Material::default()], Local::default()).unwrap();
    document.apply(edit).unwrap();
    (node, document.mesh_of(node.into()).unwrap())
}

fn with_one_of_each() -> (Document, [MeshId; 3]) {
    let mut document = Document::new();
    let half_extent_m = Vec3::new(1.0, 2.0, 3.0);
    let (_, sphere) = add(&mut document, "ball", ball(0.5));
    let (_, cuboid) = add(&mut document, "block", ShapeSource::Box { centre: Vec3::X, half_extent_m });
    let (_, many) = add(&mut document, "cloud", cloud(1001));
    (document, [sphere, cuboid, many])
}

/// Applies an edit, undoes it and does it again; each time the document is exactly as it was.
fn there_and_back(document: &mut Document, edit: Edit) {
    let before = document.clone();
    let undo = document.apply(edit).unwrap();
    let after = document.clone();
    assert!(before != after);
    let redo = document.apply_back(undo).unwrap();
    assert!(*document == before, "undone");
    let undo = document.apply_back(redo).unwrap();
    assert!(*document == after, "done again");
    document.apply_back(undo).unwrap();
    assert!(*document == before, "undone again");
}

#[test]
fn every_edit_of_shapes_is_undone_exactly() {
    let (mut document, [sphere, cuboid, many]) = with_one_of_each();
    let moved = DAffine3::from_translation(DVec3::Y);
    let place = |mesh| Edit::SetPrimitiveTransform { mesh, primitive: 1, mesh_from_primitive: moved };
    document.apply(place(many)).unwrap();
    let (_, added) =
        document.add_shapes_edit("more", cloud(10), &[Material::default()], Local::default()).unwrap();
    there_and_back(&mut document, added);
    for (mesh, source) in [
        (sphere, ball(2.0)),
        (many, cloud(7)),
        (many, cloud(0)),
        (sphere, ShapeSource::Box { centre: Vec3::ZERO, half_extent_m: Vec3::ONE }),
    ] {
        there_and_back(&mut document, Edit::SetShapes { mesh, source: Box::new(source) });
    }
    let node = document.nodes().find(|(id, _)| document.mesh_of((*id).into()) == Some(many)).unwrap().0;
    document.apply(Edit::RemoveNode { node }).unwrap();
    // With the place of its second primitive.
    there_and_back(&mut document, Edit::RemoveMesh { mesh: many });
    assert!(matches!(document.apply(Edit::RemoveMesh { mesh: cuboid }), Err(EditError::InUse { .. })));
}

#[test]
fn shapes_that_do_not_fit_are_refused() {
    let (mut document, [sphere, ..]) = with_one_of_each();
    let before = document.clone();
    let set = |mesh, source| Edit::SetShapes { mesh, source: Box::new(source) };
    assert!(matches!(document.apply(set(sphere, ball(-1.0))), Err(EditError::NoShapes(_))));
    assert!(matches!(document.apply(set(sphere, cloud(5))), Err(EditError::OtherShapes)));
    assert!(matches!(document.apply(set(MeshId(999), ball(1.0))), Err(EditError::NoAsset(_))));
    assert!(document == before);
}

#[test]
fn drags_of_one_mesh_join_and_changes_name_it() {
    let (mut document, [sphere, _, many]) = with_one_of_each();
    let set = |mesh, source| Edit::SetShapes { mesh, source: Box::new(source) };
    assert!(set(many, cloud(5)).same_gesture(&set(many, cloud(6))));
    assert!(!set(many, cloud(5)).same_gesture(&set(sphere, ball(1.0))));
    assert_eq!(set(many, cloud(5)).describe(&document), "reshaped cloud");
    document.drain_changes();
    document.apply(set(many, cloud(12))).unwrap();
    let changes = document.drain_changes();
    assert_eq!(changes.meshes.iter().copied().collect::<Vec<_>>(), [many]);
    assert!(changes.added.is_empty() && changes.instances.is_empty());
    let counts: Vec<u32> = document.mesh(many).unwrap().primitives.iter().map(|p| p.index_count).collect();
    assert_eq!(counts, [6, 6]);
}

#[test]
fn bounds_hold_the_shapes_where_their_primitives_stand() {
    let (mut document, [sphere, cuboid, _]) = with_one_of_each();
    let bounds = |document: &Document, mesh| document.mesh(mesh).unwrap().bounds.unwrap();
    assert_eq!(bounds(&document, sphere), (DVec3::splat(-0.5), DVec3::splat(0.5)));
    assert_eq!(bounds(&document, cuboid), (DVec3::new(0.0, -2.0, -3.0), DVec3::new(2.0, 2.0, 3.0)));
    let mesh_from_primitive = DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0));
    document.apply(Edit::SetPrimitiveTransform { mesh: sphere, primitive: 0, mesh_from_primitive }).unwrap();
    assert_eq!(bounds(&document, sphere), (DVec3::new(-1.0, -0.5, -0.5), DVec3::new(1.0, 0.5, 0.5)));
}

fn saved(folder: &Path, document: &Document) -> (std::path::PathBuf, Value) {
    let path = folder.join("scene.caustica.json");
    Project::save(&path, document, &ProjectMeta::default()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    (path, serde_json::from_str(&text).unwrap())
}

#[test]
fn a_project_holds_the_description_and_gives_the_same_shapes() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, [_, _, many]) = with_one_of_each();
    let mesh_from_primitive = DAffine3::from_translation(DVec3::Z);
    let edit = Edit::SetPrimitiveTransform { mesh: many, primitive: 1, mesh_from_primitive };
    document.apply(edit).unwrap();
    // A mesh that only undo could bring back is not kept.
    let (gone, _) = add(&mut document, "gone", ball(1.0));
    document.apply(Edit::RemoveNode { node: gone }).unwrap();
    let (path, value) = saved(folder.path(), &document);
    assert_eq!(value["caustica"], SCHEMA_VERSION);
    assert_eq!(value["shapes"].as_array().unwrap().len(), 3);
    assert!(std::fs::metadata(&path).unwrap().len() < 8000, "no shapes are stored");
    let read = Project::load(&path).unwrap();
    assert_eq!(read.warnings, []);
    for (id, mesh) in read.document.meshes() {
        assert_eq!(Some(mesh), document.mesh(id));
    }
    assert_eq!(read.document.meshes().count(), 3);
    assert_eq!(saved(folder.path(), &read.document).1["shapes"], value["shapes"]);
}

#[test]
fn shapes_of_a_file_are_read_again_and_missed_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("balls.xyz");
    std::fs::write(&list, "0 0 0 1\n2 0 0 0.5\n4 0 0 1 2 3\n").unwrap();
    let mut document = Document::new();
    let (node, mesh) = add(&mut document, "balls", ShapeSource::File(load_shapes(&list).unwrap()));
    let (path, value) = saved(folder.path(), &document);
    assert_eq!(value["shapes"][0]["source"]["path"], "balls.xyz");
    let read = Project::load(&path).unwrap();
    assert_eq!(read.document.mesh(mesh), document.mesh(mesh));
    assert_eq!(read.document.mesh(mesh).unwrap().shape_count(), 3);

    std::fs::write(&list, "0 0 0 1\n2 0 0\n").unwrap();
    let broken = Project::load(&path).unwrap();
    let warning = broken.warnings[0].to_string();
    assert!(warning.contains("balls.xyz: line 2: expected 4 numbers"), "{warning}");
    std::fs::remove_file(&list).unwrap();
    let missing = Project::load(&path).unwrap();
    assert_eq!(missing.warnings.len(), 1);
    let warning = missing.warnings[0].to_string();
    assert_eq!(warning.matches("balls.xyz").count(), 1, "{warning}");
    assert!(missing.document.contains(Target::node(node)));
    let findings = audit(&missing.document);
    assert!(
        findings[0].severity == Severity::Error && findings[0].message.contains("balls.xyz"),
        "{findings:?}"
    );
    assert_eq!(saved(folder.path(), &missing.document).1["shapes"], value["shapes"], "kept on save");
}

#[test]
fn shapes_without_a_size_are_found() {
    let mut document = Document::new();
    let shapes =
        [caustica_scene::Shape::sphere(Vec3::ZERO, 0.0), caustica_scene::Shape::sphere(Vec3::X, 1.0)];
    let file = ShapeFile { path: "made.xyz".into(), shapes: Some(shapes.into()) };
    add(&mut document, "points", ShapeSource::File(file));
    add(&mut document, "none", cloud(0));
    let words: Vec<String> = audit(&document).iter().map(ToString::to_string).collect();
    assert!(words[0].contains("points: 1 sphere or box has no size and is not seen"), "{words:?}");
    assert!(words[1].contains("none: there is not one sphere"), "{words:?}");
}
