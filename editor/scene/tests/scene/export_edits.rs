//! Exports of edited scenes: what was moved, renamed, hidden, shared, made here, and what the program does not know.

use std::path::Path;

use caustica_scene::import::Warning;
use caustica_scene::{
    Camera, Cloud, Document, Edit, Environment, EnvironmentFile, Light, LightKind, Local, Material,
    MaterialEntry, MaterialId, Node, NodeId, NodeKind, Projection, ShapeSource, Target, Trs, export,
};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use serde_json::{Value, json};

use crate::common::{ARM, LAMP, PLATE, Scene, assets, scene, trs};
use crate::export::{exported, json_of, placed, read, worlds};
use crate::export_materials::full_material;
use crate::gltf_file::{GltfFile, SQUARE};

pub fn apply(document: &mut Document, edit: Edit) {
    document.apply(edit).unwrap();
}

fn add_group(document: &mut Document, name: &str, parent: Option<NodeId>, local: Local) -> NodeId {
    let (id, edit) = document.add_edit(Node::new(name, NodeKind::Group).with_local(local), parent);
    apply(document, edit);
    id
}

pub fn add_material(document: &mut Document, value: Material) -> MaterialId {
    let material = MaterialId(document.allocate_id());
    apply(document, Edit::AddMaterial { material, entry: Box::new(MaterialEntry::made_here(value)) });
    material
}

fn set_local(document: &mut Document, target: impl Into<Target>, local: Local) {
    apply(document, Edit::SetTransform { target: target.into(), local });
}

fn messages(warnings: &[Warning]) -> String {
    warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// The scene that the tests share, edited in every way that an instance can be.
fn edited(folder: &Path) -> Scene {
    let mut scene = scene(folder);
    let (lamp, plate, arm) = (scene.part(LAMP), scene.part(PLATE), scene.part(ARM));
    let document = &mut scene.document;
    set_local(document, arm, trs(0.1, 0.7, 1.25));
    apply(document, Edit::Rename { target: plate, name: "Renamed".to_owned() });
    apply(document, Edit::SetVisible { target: arm, visible: false });
    let kind = LightKind::Spot { radius_m: 0.3, range_m: Some(7.7), inner_rad: 0.25, outer_rad: 0.5 };
    let light = Light { color: Vec3::new(4.0, 2.0, 1.0), intensity: 0.1, kind };
    apply(document, Edit::SetLight { target: lamp, light });
    let blue = Material { name: "Blue".to_owned(), base_color: Vec3::Z.extend(1.0), ..Material::default() };
    let material = add_material(document, blue);
    apply(document, Edit::AssignMaterial { target: plate, primitive: 1, material });
    apply(document, Edit::SetEnvironment(Environment::Constant(Vec3::new(0.1, 0.2, 0.3))));
    scene
}

#[test]
fn what_surrounds_the_scene_comes_along() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let file = folder.path().join("sky.exr");
    image::Rgb32FImage::from_fn(4, 2, |x, y| image::Rgb([x as f32 + 0.1, y as f32, 0.3]))
        .save(&file)
        .unwrap();
    let map: std::sync::Arc<_> = caustica_scene::import::load_environment(&file).unwrap().0.into();
    let environment = EnvironmentFile { path: file, rotation_rad: 0.25, scale: 2.0, map: Some(map.clone()) };
    scene.document.apply(Edit::SetEnvironment(Environment::File(environment))).unwrap();
    let mut document = scene.document.clone();
    // The second time there is no file of its own behind the map.
    for name in ["one.glb", "two.gltf"] {
        let (path, done) = exported(&document, folder.path(), name);
        assert!(done.warnings.is_empty(), "{:?}", done.warnings);
        let imported = read(&path);
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
        document = placed(imported);
        let Environment::File(again) = document.effective_environment() else { panic!("{name}") };
        assert_eq!((again.rotation_rad, again.scale), (0.25, 2.0));
        let again = again.map.unwrap();
        assert_eq!((again.width, again.height, &again.rgb), (map.width, map.height, &map.rgb), "{name}");
    }
    scene.document.apply(Edit::SetEnvironment(Environment::DefaultSky)).unwrap();
    let (path, done) = exported(&scene.document, folder.path(), "sky.glb");
    assert!(done.warnings.is_empty(), "{:?}", done.warnings);
    assert_eq!(placed(read(&path)).effective_environment(), Environment::DefaultSky);
    let mut json = json_of(&exported(&document, folder.path(), "three.gltf").0);
    json["scenes"][0]["extras"]["environment"]["bufferView"] = 0.into();
    std::fs::write(folder.path().join("three.gltf"), json.to_string()).unwrap();
    let damaged = read(&folder.path().join("three.gltf"));
    assert!(damaged.warnings.iter().any(|warning| warning.message.contains("map cannot be read")));
}

#[test]
fn edits_of_instances_are_in_the_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = edited(folder.path());
    let (path, _) = exported(&scene.document, folder.path(), "edited.glb");
    let again = placed(read(&path));
    let (before, after) = (worlds(&scene.document), worlds(&again));
    assert_eq!(before, after[1..], "below the node that places the file");

    let at = |name: &str| after.iter().position(|(found, _)| found == name).unwrap() as u32 - 1;
    let instance = again.roots()[0];
    let part = |name| Target::part(instance, at(name));
    assert_eq!(again.visible(part("Arm")), Some(false));
    let light = again.light_of(part("Lamp")).unwrap();
    assert_eq!(light.kind, scene.document.light_of(scene.part(LAMP)).unwrap().kind);
    assert!((light.radiant() - Vec3::new(0.4, 0.2, 0.1)).abs().max_element() < 1e-7, "{light:?}");
    assert_eq!(light.color.max_element(), 1.0, "the format wants colours up to 1");
    assert_eq!(again.effective_environment(), Environment::Constant(Vec3::new(0.1, 0.2, 0.3)));
    let materials = again.renderable(part("Renamed")).unwrap().materials;
    let names: Vec<&str> = materials.iter().map(|id| again.material(*id).unwrap().name.as_str()).collect();
    assert_eq!(names, ["Red", "Blue"]);
    let (other, _) = exported(&again, folder.path(), "again.glb");
    assert!(std::fs::read(path).unwrap() == std::fs::read(other).unwrap(), "a second export is the same");
}

#[test]
fn doubles_survive_to_the_last_digit() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = Document::new();
    let third = Trs {
        translation: DVec3::new(1.0 / 3.0, 4.503_599_627_370_497e15, -5e-324),
        rotation: DQuat::from_euler(glam::EulerRot::XYZ, 0.1, 0.2, 0.3).normalize(),
        scale: DVec3::new(1.0 + f64::EPSILON, -1e-17, 0.1 + 0.2),
    };
    let top = add_group(&mut document, "third", None, Local::Trs(third));
    add_group(&mut document, "deep", Some(top), trs(1e-3, 2.0, 0.7));
    for name in ["a.glb", "a.gltf"] {
        let (path, _) = exported(&document, folder.path(), name);
        let nodes = read(&path).prefab.nodes().to_vec();
        let locals = ["third", "deep"].map(|name| {
            let of_name = |(_, node): &(NodeId, &Node)| node.name == name;
            document.nodes().find(of_name).unwrap().1.local
        });
        assert_eq!(nodes.iter().map(|node| node.local).collect::<Vec<_>>(), locals, "{name}");
        assert_eq!(worlds(&document), worlds(&placed(read(&path)))[1..], "{name}");
    }
}

/// Nodes, a part and a primitive with shear.
fn sheared(folder: &Path) -> Document {
    let mut scene = scene(folder);
    let plate = scene.part(PLATE);
    let mesh = scene.document.mesh_of(plate).unwrap();
    let document = &mut scene.document;
    let matrix = DMat3::from_cols(DVec3::new(1.0, 0.1, 0.0), DVec3::new(0.3, 1.0, 1.0 / 7.0), DVec3::Z * 3.0);
    let sheared = DAffine3::from_mat3_translation(matrix, DVec3::splat(1.0 / 9.0));
    let top = add_group(document, "sheared", None, Local::Matrix(sheared));
    add_group(document, "deep", Some(top), trs(1e-3, 2.0, 0.7));
    set_local(document, plate, Local::Matrix(sheared));
    apply(document, Edit::SetPrimitiveTransform { mesh, primitive: 1, mesh_from_primitive: sheared });
    scene.document
}

/// A node below a sheared one, and a sheared primitive: where they are is the same, in nodes that the format allows.
#[test]
fn shear_becomes_two_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let document = sheared(folder.path());
    let (path, done) = exported(&document, folder.path(), "file.glb");
    assert!(
        messages(&done.warnings).contains("node \"sheared\": its matrix has shear"),
        "{:?}",
        done.warnings
    );
    let nodes = json_of(&path)["nodes"].as_array().unwrap().clone();
    assert!(nodes.iter().all(|node| node.get("matrix").is_none()), "{nodes:#?}");
    assert_eq!(
        nodes
            .iter()
            .filter(|node| node["name"].as_str().is_some_and(|name| name.contains("(shear)")))
            .count(),
        4
    );
    let again = placed(read(&path));
    let by_name = |document: &Document, name: &str| -> DAffine3 {
        let (_, world) = worlds(document).into_iter().find(|(own, _)| own == name).unwrap();
        DAffine3::from_cols_array(&world)
    };
    for name in ["deep", "sheared", "Plate"] {
        let (before, after) = (by_name(&document, name), by_name(&again, name));
        assert!(before.abs_diff_eq(after, 1e-14), "{name}: {before:?} {after:?}");
    }
}

#[test]
fn deep_trees_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = Document::new();
    let mut above = None;
    for depth in 0..3000 {
        above = Some(add_group(&mut document, &depth.to_string(), above, trs(0.001, 0.001, 1.0)));
    }
    let (path, done) = exported(&document, folder.path(), "deep.glb");
    assert_eq!((done.nodes, read(&path).prefab.nodes().len()), (3000, 3000));
}

/// How often the bytes of each buffer view are named: (views, accessors).
fn sizes(file: &Value) -> (usize, usize) {
    (file["bufferViews"].as_array().unwrap().len(), file["accessors"].as_array().unwrap().len())
}

#[test]
fn shared_meshes_stay_shared() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let (path, done) = exported(&scene.document, folder.path(), "two.glb");
    let file = json_of(&path);
    assert_eq!((done.meshes, done.nodes), (1, 13), "{file}");
    let by_nodes = file["nodes"].as_array().unwrap().iter().filter(|node| node["mesh"] == 0).count();
    assert_eq!(by_nodes, 2, "two instances place one mesh");
    let before = sizes(&file);

    // Another material is another mesh in glTF, of the same vertices.
    let target = scene.part(PLATE);
    let material = add_material(&mut scene.document, Material::default());
    apply(&mut scene.document, Edit::AssignMaterial { target, primitive: 0, material });
    let (path, done) = exported(&scene.document, folder.path(), "two.glb");
    assert_eq!((done.meshes, sizes(&json_of(&path))), (2, before));
}

#[test]
fn gpu_instances_stay_instances_until_one_is_edited() {
    let Some(model) = assets("gltf/SimpleInstancing/glTF/SimpleInstancing.gltf") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut document = placed(read(&model));
    let (path, done) = exported(&document, folder.path(), "many.glb");
    assert_eq!(done.nodes, json_of(&model)["nodes"].as_array().unwrap().len());
    assert!(worlds(&document)[1..] == worlds(&placed(read(&path)))[1..], "the file alone has another name");

    let instance = document.roots()[0];
    set_local(&mut document, Target::part(instance, 5), trs(0.25, 0.1, 1.0));
    let (path, done) = exported(&document, folder.path(), "edited.glb");
    assert_eq!((done.nodes, done.meshes), (126, 1), "nodes that share a mesh");
    assert!(worlds(&document)[1..] == worlds(&placed(read(&path)))[1..], "the file alone has another name");
}

#[test]
fn moved_primitives_get_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let mesh = scene.document.mesh_of(scene.part(PLATE)).unwrap();
    let mesh_from_primitive = DAffine3::from_translation(DVec3::new(0.0, 0.0, 2.5));
    apply(&mut scene.document, Edit::SetPrimitiveTransform { mesh, primitive: 1, mesh_from_primitive });
    let (path, done) = exported(&scene.document, folder.path(), "moved.glb");
    assert_eq!((done.meshes, done.nodes), (2, 15));
    let again = placed(read(&path));
    let (low, high) = scene.document.bounds().unwrap();
    let (found_low, found_high) = again.bounds().unwrap();
    assert!((low - found_low).length() < 1e-12 && (high - found_high).length() < 1e-12);
}

#[test]
fn a_rig_that_is_placed_twice_has_two_skins() {
    let Some(model) = assets("gltf/SimpleSkin/glTF-Embedded/SimpleSkin.gltf") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut document = placed(read(&model));
    let (prefab, _) = document.prefabs().next().unwrap();
    let (_, edit) = document.instantiate_edit(prefab, None, trs(5.0, 0.0, 1.0));
    apply(&mut document, edit);
    let (path, done) = exported(&document, folder.path(), "rigs.glb");
    let again = read(&path);
    let original = read(&model);
    assert_eq!((again.prefab.skins().len(), done.meshes), (2, 1));
    let [first, second] = again.prefab.skins() else { panic!("two skins") };
    assert_eq!(first.inverse_bind, original.prefab.skins()[0].inverse_bind);
    assert_eq!(first.inverse_bind, second.inverse_bind);
    let below = |part: u32| again.prefab.node(part).unwrap().parent;
    assert!(first.joints.iter().zip(&second.joints).all(|(a, b)| a != b && below(*a) != below(*b)));
    let channels = |clip: &caustica_scene::Animation| clip.channels.len();
    let (clips, before) = (&again.prefab.animations, &original.prefab.animations);
    assert_eq!((clips.len(), channels(&clips[0])), (1, 2 * channels(&before[0])));
    assert_eq!(clips[0].channels[0].values, before[0].channels[0].values);
}

/// A square with everything on it that the program does not know.
fn strange(folder: &Path, packet: &str) -> Value {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    file.json["asset"] =
        json!({"version": "2.0", "copyright": format!("CC0 {packet}"), "extras": {"by": "hand"}});
    file.json["extensionsUsed"] = json!(["KHR_xmp_json_ld", "ACME_thing", "KHR_materials_variants"]);
    file.json["extensions"] = json!({"KHR_xmp_json_ld": {"packets": [{"dc:title": packet}]},
        "KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}});
    file.json["extras"] = json!([1, 2]);
    let variants = json!({"mappings": [{"material": 1, "variants": [1]}, {"material": 0, "variants": [0]}]});
    file.push(
        "meshes",
        json!({"extras": {"of": "mesh", "targetNames": []}, "primitives": [{"attributes": {"POSITION": position},
            "material": 0, "extensions": {"KHR_materials_variants": variants}}]}),
    );
    file.push("materials", json!({"extras": {"of": "material", "volumePriority": 3}}));
    file.push("materials", json!({"name": "night", "extensions": {"ACME_thing": {"glow": 0.1}}}));
    file.push(
        "nodes",
        json!({"mesh": 0, "extras": {"of": "node"}, "extensions": {"KHR_xmp_json_ld": {"packet": 0}}}),
    );
    file.push(
        "scenes",
        json!({"nodes": [0], "extras": {"of": "scene",
        "environment": {"constantRadiance": [1.0, 0.5, 0.25]}}}),
    );
    file.json["scene"] = json!(0);
    file.write(folder);
    file.json
}

#[test]
fn what_is_not_known_is_said_again() {
    let folder = tempfile::tempdir().unwrap();
    let source = strange(folder.path(), "square");
    let imported = read(&folder.path().join("file.gltf"));
    let acme = imported.warnings.iter().find(|warning| warning.message.contains("ACME_thing")).unwrap();
    assert!(acme.message.contains("kept for exports"), "{acme}");
    let (path, _) = exported(&placed(imported), folder.path(), "once.glb");
    let (path, _) = exported(&placed(read(&path)), folder.path(), &format!("twice{}", ".gltf"));
    let file = json_of(&path);
    for pointer in [
        "/asset/copyright",
        "/asset/extras",
        "/extensions",
        "/extras",
        "/materials/0/extras",
        "/materials/1/extensions",
        "/nodes/0/extras",
        "/nodes/0/extensions",
        "/scenes/0/extras",
        "/meshes/0/primitives/0/extensions",
    ] {
        assert_eq!(file.pointer(pointer).unwrap(), source.pointer(pointer).unwrap(), "{pointer}");
    }
    assert_eq!(file["meshes"][0]["extras"], json!({"of": "mesh"}));
    let used = ["ACME_thing", "KHR_materials_variants", "KHR_xmp_json_ld"];
    assert_eq!(file["extensionsUsed"], json!(used));
    assert_eq!(file.get("extensionsRequired"), None);
}

#[test]
fn two_sources_do_not_mix_what_is_not_known() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let mut document = Document::new();
    for (folder, name) in folders.iter().zip(["one", "two"]) {
        strange(folder.path(), name);
        let prefab = document.add_imported(read(&folder.path().join("file.gltf"))).unwrap();
        let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
        apply(&mut document, edit);
    }
    let (path, done) = exported(&document, folders[0].path(), "both.glb");
    let file = json_of(&path);
    assert_eq!(file["asset"]["copyright"], "CC0 one; CC0 two");
    assert_eq!(file["extensions"]["KHR_xmp_json_ld"]["packets"], json!([{"dc:title": "one"}]));
    let with_packet = |node: &&Value| node["extensions"]["KHR_xmp_json_ld"]["packet"] == 0;
    let nodes = file["nodes"].as_array().unwrap();
    assert_eq!(nodes.iter().filter(with_packet).count(), 1, "the packet of the other is not there");
    assert!(messages(&done.warnings).contains("KHR_xmp_json_ld is left out"), "{:?}", done.warnings);
    let variants = &file["extensions"]["KHR_materials_variants"]["variants"];
    assert_eq!(variants.as_array().unwrap().len(), 2);
    let second = &file["meshes"][1]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"][0];
    assert_eq!(second, &json!({"material": 3, "variants": [1]}), "those of one name are one");
}

/// Scenes that no shared model is like, for the validator.
pub fn samples(folder: &Path) -> Vec<Document> {
    let (full, _) = full_material(folder);
    let mut moved = edited(folder).document;
    let mesh = moved.meshes().next().unwrap().0;
    let mesh_from_primitive = DAffine3::from_translation(DVec3::Z);
    apply(&mut moved, Edit::SetPrimitiveTransform { mesh, primitive: 0, mesh_from_primitive });
    let sphere = ShapeSource::Sphere { centre: Vec3::Y, radius_m: 0.5 };
    let (_, edit) = moved.add_shapes_edit("ball", sphere, &[], trs(1.0, 1.0, 1.0)).unwrap();
    apply(&mut moved, edit);
    let (_, edit) =
        moved.add_shapes_edit("dust", ShapeSource::Cloud(Cloud::default()), &[], Local::default()).unwrap();
    apply(&mut moved, edit);
    let camera = Camera { projection: Projection::Orthographic { ymag_m: 2.0 }, ..Camera::default() };
    let (_, edit) = moved.add_edit(Node::new("parallel", NodeKind::Camera(camera)), None);
    apply(&mut moved, edit);
    let strange_folder = folder.join("strange");
    std::fs::create_dir(&strange_folder).unwrap();
    strange(&strange_folder, "packet");
    let mut samples = vec![
        placed(full),
        moved,
        sheared(folder),
        placed(read(&strange_folder.join("file.gltf"))),
        Document::new(),
    ];
    let files = [crate::kept::strange_file(), crate::kept::loose_file(), crate::scenes::file()];
    for (number, file) in files.iter().enumerate() {
        let folder = folder.join(format!("file-{number}"));
        std::fs::create_dir(&folder).unwrap();
        samples.push(placed(read(&file.write(&folder))));
    }
    samples.push(crate::animation_pointer::every_channel().place().0);
    samples
}

#[test]
fn shapes_become_triangles_or_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = Document::new();
    let mut add = |name: &str, source| {
        let (_, edit) = document.add_shapes_edit(name, source, &[], Local::default()).unwrap();
        document.apply(edit).unwrap();
    };
    add("ball", ShapeSource::Sphere { centre: Vec3::Y, radius_m: 0.5 });
    add("dust", ShapeSource::Cloud(Cloud { count: 20_000, ..Cloud::default() }));
    let (path, done) = exported(&document, folder.path(), "shapes.glb");
    let text = messages(&done.warnings);
    assert!(text.contains("node \"ball\": 1 sphere or box is written as triangles"), "{text}");
    assert!(text.contains("node \"dust\": 20000 spheres and boxes are left out"), "{text}");
    let again = placed(read(&path));
    let (low, high) = again.bounds().unwrap();
    assert!((low - DVec3::new(-0.5, 0.5, -0.5)).length() < 1e-6, "{low}");
    assert!((high - DVec3::new(0.5, 1.5, 0.5)).length() < 1e-6, "{high}");
}

#[test]
fn what_cannot_be_written_is_said_with_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let fails = |name: &str, reason: &str| {
        let error = export(&scene.document, &folder.path().join(name)).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(reason), "{error}");
    };
    fails("scene.obj", "neither .glb nor .gltf");
    fails("absent/scene.glb", "cannot be written");
    fails("model.gltf", "is a source of this scene");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing but the source is there");
    std::fs::write(folder.path().join("taken.bin"), "of another").unwrap();
    fails("taken.gltf", "taken.bin is there already");
    // A file of this name does not make the buffer ours: it may be that of another one.
    std::fs::write(folder.path().join("taken.gltf"), "{}").unwrap();
    fails("taken.gltf", "taken.bin is there already");
    assert_eq!(std::fs::read(folder.path().join("taken.bin")).unwrap(), b"of another");
    // What was exported may be exported again, but not once the scene reads it.
    let own = folder.path().join("own.gltf");
    export(&scene.document, &own).unwrap();
    export(&scene.document, &own).unwrap();
    let copy = folder.path().join("copy.gltf");
    std::fs::copy(&own, &copy).unwrap();
    let imported = read(&copy);
    let error = export(&placed(imported), &own).unwrap_err().to_string();
    assert!(error.contains("own.bin is read by") && error.contains("copy.gltf"), "{error}");
}

#[test]
fn an_image_without_a_file_is_written_as_png() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}, "material": 0}]}));
    file.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    file.push("textures", json!({"source": 0}));
    file.push("images", json!({"uri": "absent.png"}));
    file.push("nodes", json!({"mesh": 0}));
    let mut imported = read(&file.write(folder.path()));
    let (path, done) = exported(&placed(imported.clone()), folder.path(), "missing.glb");
    assert!(messages(&done.warnings).contains("absent.png"), "{:?}", done.warnings);
    assert_eq!(json_of(&path).get("images"), None, "no checker is baked in");

    imported.textures[0].placeholder = false;
    let (path, done) = exported(&placed(imported.clone()), folder.path(), "made.gltf");
    assert!(done.warnings.is_empty() && path.with_extension("bin").is_file());
    assert_eq!(read(&path).textures[0].rgba8, imported.textures[0].rgba8);
}
