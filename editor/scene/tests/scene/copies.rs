//! An instance made unique, and another document merged: nothing that was there changes, and a project holds both.

use crate::common::{PLATE, Scene, scene, trs};
use caustica_scene::{
    Copies, Document, Edit, EditError, Material, MaterialId, Project, ProjectMeta, Renderable, ShapeSource,
    Target,
};
use glam::Vec3;

fn saved_and_read(document: &Document, folder: &std::path::Path) -> Document {
    let path = folder.join("scene.caustica.json");
    Project::save(&path, document, &ProjectMeta::default()).unwrap();
    let project = Project::load(&path).unwrap();
    assert!(project.warnings.is_empty(), "{:?}", project.warnings);
    project.document
}

fn materials_of(document: &Document, target: Target) -> Vec<MaterialId> {
    document.renderable(target).unwrap().materials
}

#[test]
fn a_unique_instance_goes_its_own_way() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let plate = scene.part(PLATE);
    let other = Target::part(scene.second, PLATE);
    let glow = scene.document.prefab(scene.prefab).unwrap().materials[1];
    let document = &mut scene.document;
    for edit in [
        Edit::SetTransform { target: plate, local: trs(0.5, 0.1, 2.0) },
        Edit::AssignMaterial { target: plate, primitive: 0, material: glow },
    ] {
        document.apply(edit).unwrap();
    }
    let (before, seen) = (document.clone(), document.renderable(plate).unwrap());
    let edit = document.make_unique_edit(scene.first).unwrap().edit;
    let undo = document.apply(edit).unwrap();
    let renderable = document.renderable(plate).unwrap();
    assert_eq!(renderable.world_from_mesh, seen.world_from_mesh);
    assert_ne!(renderable.mesh, seen.mesh);
    let copies = renderable.materials.clone();
    assert!(copies.iter().all(|id| !seen.materials.contains(id)), "none is shared any more");
    assert_eq!(copies[0], copies[1], "the override names the copy of what it named");
    let dark = Material { base_color: glam::Vec4::ZERO, ..Material::default() };
    document.apply(Edit::SetMaterial { material: copies[1], value: Box::new(dark.clone()) }).unwrap();
    assert_ne!(document.material(materials_of(document, other)[1]), Some(&dark));
    assert!(saved_and_read(document, folder.path()) == *document);
    document
        .apply(Edit::SetMaterial {
            material: copies[1],
            value: Box::new(before.material(glow).unwrap().clone()),
        })
        .unwrap();
    document.apply(undo).unwrap();
    assert!(*document == before);
    document.apply(Edit::RemoveNode { node: scene.second }).unwrap();
    assert_eq!(document.make_unique_edit(scene.first), Err(EditError::OnlyInstance));
    let wrong = document.make_unique_edit(scene.light).unwrap_err();
    assert!(matches!(wrong, EditError::WrongKind { .. }), "{wrong:?}");
}

/// What is placed, without ids.
fn places(document: &Document, wanted: impl Fn(&Renderable) -> bool) -> Vec<String> {
    let place = |r: Renderable| {
        let mesh = document.mesh(r.mesh).unwrap();
        let materials: Vec<_> = r.materials.iter().map(|id| &document.material(*id).unwrap().name).collect();
        format!("{} {:?} {materials:?} {}", mesh.name, r.world_from_mesh, r.visible)
    };
    let mut places: Vec<String> = document.renderables().filter(wanted).map(place).collect();
    places.sort();
    places
}

#[test]
fn a_merged_document_stands_beside_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let below = folder.path().join("other");
    std::fs::create_dir(&below).unwrap();
    let Scene { mut document, .. } = scene(folder.path());
    let mut other = scene(&below);
    let own = Material { name: "own".into(), ..Material::default() };
    let shapes = ShapeSource::Sphere { centre: Vec3::ZERO, radius_m: 1.0 };
    let (_, add) = other.document.add_shapes_edit("ball", shapes, &[own], trs(1.0, 0.0, 1.0)).unwrap();
    other.document.apply(add).unwrap();
    let hide = Edit::SetVisible { target: other.part(PLATE), visible: false };
    other.document.apply(hide).unwrap();
    let before = document.clone();
    let Copies { node: top, edit, .. } = document.merge_edit(&other.document, "more").unwrap();
    let undo = document.apply(edit).unwrap();
    document.update_transforms();
    let new = |r: &Renderable| document.is_within(r.target, top.into());
    assert_eq!(places(&document, new), places(&other.document, |_| true));
    assert_eq!(places(&document, |r| !new(r)), places(&before, |_| true));
    assert_eq!(document.node_count(), before.node_count() + other.document.node_count() + 1);
    assert!(saved_and_read(&document, folder.path()) == document);
    document.apply(undo).unwrap();
    assert!(document == before);
    let mut far = other.document.clone();
    far.reserve_ids_up_to(1 << 62);
    let full = document.merge_edit(&far, "far").unwrap_err();
    assert!(full.to_string().contains("every id is already in the scene"), "{full}");
    assert!(saved_and_read(&far, folder.path()) == far, "what is near the end can be saved and read");
    let nothing = document.merge_edit(&Document::new(), "nothing").unwrap_err();
    assert!(nothing.to_string().contains("nothing in nothing"), "{nothing}");
}
