//! Variants of materials (KHR_materials_variants): chosen for an instance, kept by name.

use crate::common::{PLATE, Scene, scene};
use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{Edit, EditError, MaterialId, Target, audit};

fn materials(scene: &Scene, target: Target) -> Vec<MaterialId> {
    scene.document.renderable(target).unwrap().materials
}

fn choose(variant: &str) -> impl Fn(&Scene) -> Edit {
    move |scene| Edit::SetVariant { node: scene.first, variant: Some(variant.to_owned()) }
}

#[test]
fn a_variant_is_that_of_one_instance_and_gives_way_to_overrides() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let prefab = scene.document.prefab(scene.prefab).unwrap();
    assert_eq!(prefab.variants(), ["plain", "glowing"]);
    let [red, glow] = prefab.materials[..] else { panic!("two materials") };
    let (plate, other) = (scene.part(PLATE), Target::part(scene.second, PLATE));
    scene.document.drain_changes();
    let undo = scene.document.apply(choose("glowing")(&scene)).unwrap();
    let changes = scene.document.drain_changes();
    assert_eq!(changes.instances.keys().collect::<Vec<_>>(), [&plate], "only what shows it");
    assert_eq!(materials(&scene, plate), [glow, glow]);
    assert_eq!(materials(&scene, other), [red, glow]);
    scene.document.apply(Edit::AssignMaterial { target: plate, primitive: 0, material: red }).unwrap();
    assert_eq!(materials(&scene, plate), [red, glow], "an override says more");
    scene.document.apply(undo).unwrap();
    assert_eq!(scene.document.variant_of(scene.first), None);
    let unknown = scene.document.apply(choose("blue")(&scene)).unwrap_err();
    assert_eq!(unknown, EditError::NoVariant("blue".into()));
}

#[test]
fn a_variant_that_the_source_has_lost_is_kept_and_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    scene.document.apply(choose("glowing")(&scene)).unwrap();
    let reload = |scene: &mut Scene, imported: Imported| {
        let edit = scene.document.reload_edit(scene.prefab, imported).unwrap();
        scene.document.apply(edit).unwrap()
    };
    let path = folder.path().join("other.gltf");
    let text = std::fs::read_to_string(folder.path().join("model.gltf")).unwrap();
    std::fs::write(&path, text.replace("glowing", "dull")).unwrap();
    let undo = reload(&mut scene, load(&path, &ImportOptions::default()).unwrap());
    let own = scene.document.mesh(scene.document.mesh_of(scene.part(PLATE)).unwrap()).unwrap();
    let own: Vec<MaterialId> = own.primitives.iter().map(|primitive| primitive.material).collect();
    assert_eq!(materials(&scene, scene.part(PLATE)), own);
    assert_eq!(scene.document.variant_of(scene.first), Some("glowing"));
    assert!(audit(&scene.document).iter().any(|finding| finding.message.contains("shown in glowing")));
    scene.document.apply(undo).unwrap();
    let glow = scene.document.prefab(scene.prefab).unwrap().materials[1];
    assert_eq!(materials(&scene, scene.part(PLATE)), [glow, glow]);
}

#[test]
fn two_variants_of_one_name_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let path = folder.path().join("twins.gltf");
    let text = std::fs::read_to_string(folder.path().join("model.gltf")).unwrap();
    std::fs::write(&path, text.replace(r#""name":"plain""#, r#""name":"glowing""#)).unwrap();
    let edit = scene.document.reload_edit(scene.prefab, load(&path, &ImportOptions::default()).unwrap());
    scene.document.apply(edit.unwrap()).unwrap();
    let prefab = scene.document.prefab(scene.prefab).unwrap();
    assert_eq!(prefab.variants(), ["glowing", "glowing#2"]);
    let [red, glow] = prefab.materials[..] else { panic!("two materials") };
    let plate = scene.part(PLATE);
    for (variant, chosen) in [("glowing", [red, glow]), ("glowing#2", [glow, glow])] {
        scene.document.apply(choose(variant)(&scene)).unwrap();
        assert_eq!(materials(&scene, plate), chosen, "{variant}");
    }
    let exported = caustica_scene::export(&scene.document, &folder.path().join("out.glb")).unwrap();
    let again = load(&exported.files[0], &ImportOptions::default()).unwrap();
    assert_eq!(again.prefab.variants(), ["glowing", "glowing#2"], "as the source names them");
}

#[test]
fn variants_of_one_name_in_several_sources_are_one_in_exports() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string({
        crate::common::model(folder.path());
        folder.path().join("model.gltf")
    });
    let text = text.unwrap();
    let names = |first: &str, second: &str| {
        text.replace(r#"[{"name":"plain"},{"name":"glowing"}]"#, &format!("[{first},{second}]"))
    };
    let mut document = caustica_scene::Document::new();
    for (file, text) in [
        ("a.gltf", names(r#"{"name":"red"}"#, r#"{"name":"blue"}"#)),
        ("b.gltf", names(r#"{"name":"blue","extras":1}"#, r#"{"name":"red"}"#)),
        ("c.gltf", names(r#"{"name":"red"}"#, r#"{"name":"red"}"#)),
        ("d.gltf", names(r#"{"name":"blue"}"#, "{}")),
    ] {
        let path = folder.path().join(file);
        std::fs::write(&path, text).unwrap();
        let prefab = document.add_imported(load(&path, &ImportOptions::default()).unwrap()).unwrap();
        let (_, edit) = document.instantiate_edit(prefab, None, Default::default());
        document.apply(edit).unwrap();
    }
    let exported = caustica_scene::export(&document, &folder.path().join("out.glb")).unwrap();
    let lost = |message: &str| message.contains("the variant \"blue\"") && message.starts_with("b: ");
    assert!(exported.warnings.iter().any(|warning| lost(&warning.message)), "{:?}", exported.warnings);
    let again = load(&exported.files[0], &ImportOptions::default()).unwrap();
    assert_eq!(again.prefab.variants(), ["red", "blue", "red#2", "variant 2"]);
    let mut one = caustica_scene::Document::new();
    let prefab = one.add_imported(again).unwrap();
    let (node, edit) = one.instantiate_edit(prefab, None, Default::default());
    one.apply(edit).unwrap();
    let glows = |document: &caustica_scene::Document, node| {
        let plates = document.renderables().filter(|plate| plate.target.node == node);
        let glows = |material: MaterialId| document.material(material).unwrap().name == "Glow";
        plates.map(|plate| glows(plate.materials[0])).collect::<Vec<bool>>()
    };
    for (variant, expected) in [
        ("red", [false, true, false, false]),
        ("blue", [true, false, false, false]),
        ("red#2", [false, false, true, false]),
        ("variant 2", [false, false, false, true]),
    ] {
        one.apply(Edit::SetVariant { node, variant: Some(variant.to_owned()) }).unwrap();
        assert_eq!(glows(&one, node), expected, "{variant}");
        // In the scene itself each instance is asked for the name.
        let roots = document.roots().to_vec();
        let mut shown = Vec::new();
        for node in roots {
            let choice = Edit::SetVariant { node, variant: Some(variant.to_owned()) };
            let undo = document.apply(choice).ok();
            shown.extend(glows(&document, node));
            undo.map(|undo| document.apply(undo).unwrap());
        }
        assert_eq!(shown, expected, "{variant}");
    }
}
