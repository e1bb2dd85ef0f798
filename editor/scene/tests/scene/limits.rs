//! What is there in great numbers: nodes of a document, prefabs of one source, warnings of one kind, depth of `extras`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use caustica_scene::import::{ImportOptions, load};
use caustica_scene::{
    Document, Edit, EditError, Local, Node, NodeId, NodeKind, Project, ProjectMeta, Subtree, export,
};
use serde_json::{Value, json};

/// A file of one triangle that so many nodes place, with these members too.
fn write(folder: &Path, nodes: usize, members: Value) -> PathBuf {
    let buffer = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let list: Vec<Value> = (0..nodes).map(|i| json!({"name": i.to_string(), "mesh": 0})).collect();
    let mut file = json!({"asset": {"version": "2.0"}, "nodes": list,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": buffer}]});
    file.as_object_mut().unwrap().extend(members.as_object().unwrap().clone());
    let path = folder.join("many.gltf");
    std::fs::write(&path, file.to_string()).unwrap();
    path
}

/// A document with the file as a prefab that nothing places, and the edit that places it so many times.
fn crowd(source: &Path, count: usize) -> (Document, Edit) {
    let mut document = Document::new();
    let prefab = document.add_imported(load(source, &ImportOptions::default()).unwrap()).unwrap();
    let node = |document: &mut Document| {
        (NodeId(document.allocate_id()), Node::new("", NodeKind::instance_of(prefab)))
    };
    let top = NodeId(document.allocate_id());
    let mut nodes = vec![(top, Node::new("all", NodeKind::Group))];
    for _ in 0..count {
        let (id, node) = node(&mut document);
        nodes.push((id, Node { parent: Some(top), ..node }));
    }
    (document, Edit::AddNode { parent: None, index: 0, subtree: Subtree { nodes } })
}

#[test]
fn the_nodes_of_all_instances_of_a_document_are_limited() {
    let folder = tempfile::tempdir().unwrap();
    let source = write(folder.path(), 20_000, json!({}));
    let (mut document, edit) = crowd(&source, 200);
    let before = document.clone();
    let refused = document.apply(Edit::batch("many", vec![edit]));
    assert_eq!(refused, Err(EditError::TooManyNodes { count: 4_000_201 }));
    assert!(document == before, "the document stays as it was");
    // What is taken away no longer counts.
    let (mut document, edit) = crowd(&source, 100);
    let undo = document.apply(edit.clone()).unwrap();
    document.apply(undo).unwrap();
    document.apply(edit).unwrap();
    let other = document.clone();
    let merged = document.merge_edit(&other, "twice").unwrap();
    assert_eq!(document.apply(merged.edit), Err(EditError::TooManyNodes { count: 4_000_202 }));
    assert!(document == other, "the document stays as it was");
}

#[test]
fn a_project_of_more_nodes_than_a_document_has_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let source = write(folder.path(), 20_000, json!({}));
    let mut document = Document::new();
    let prefab = document.add_imported(load(&source, &ImportOptions::default()).unwrap()).unwrap();
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    let path = folder.path().join("p.caustica.json");
    Project::save(&path, &document, &ProjectMeta::default()).unwrap();
    let mut project: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let nodes = project["nodes"].as_array_mut().unwrap();
    for id in 0..1000 {
        let node = json!({"id": 1_000_000 + id, "name": "n", "prefab": nodes[0]["prefab"]});
        nodes.push(node);
    }
    std::fs::write(&path, project.to_string()).unwrap();
    let error = Project::load(&path).unwrap_err().to_string();
    assert!(error.contains("p.caustica.json") && error.contains("20021001 nodes"), "{error}");
}

#[test]
fn prefabs_of_one_source_share_what_was_read_and_warn_once() {
    let folder = tempfile::tempdir().unwrap();
    let source = write(folder.path(), 1, json!({"extensionsUsed": ["X_none"]}));
    let mut document = Document::new();
    for _ in 0..3 {
        document.add_imported(load(&source, &ImportOptions::default()).unwrap()).unwrap();
    }
    let path = folder.path().join("p.caustica.json");
    Project::save(&path, &document, &ProjectMeta::default()).unwrap();
    let project = Project::load(&path).unwrap();
    assert!(project.document == document);
    let meshes: Vec<_> = project.document.meshes().map(|(_, mesh)| &mesh.data).collect();
    assert!(meshes.len() == 3 && meshes.iter().all(|data| Arc::ptr_eq(data, meshes[0])));
    assert_eq!(project.warnings.len(), 1, "{:?}", project.warnings);
}

#[test]
fn a_file_is_known_again_until_it_changes() {
    let folder = tempfile::tempdir().unwrap();
    let read = |members: Value| load(&write(folder.path(), 2, members), &ImportOptions::default()).unwrap();
    let mut document = Document::new();
    let prefab = document.add_imported(read(json!({}))).unwrap();
    let (material, value) = document.materials().next().map(|(id, value)| (id, value.clone())).unwrap();
    let value = Box::new(caustica_scene::Material { roughness: 0.25, ..value });
    document.apply(Edit::SetMaterial { material, value }).unwrap();
    let before = document.clone();
    assert_eq!(
        document.prefabs_of(&read(json!({}))),
        [(prefab, true)],
        "an edit of the scene is none of the file"
    );
    assert_eq!(document.prefabs_of(&read(json!({"materials": [{}]}))), [(prefab, false)]);
    assert!(document == before);
}

#[test]
fn warnings_of_one_kind_are_summed_up_after_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let each = |make: fn(usize) -> Value| (0..50).map(make).collect::<Vec<_>>();
    let members = json!({"images": each(|i| json!({"uri": format!("none{i}.png")})), "textures": each(|i| json!({"source": i})),
        "materials": each(|i| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}}))});
    let imported = load(&write(folder.path(), 1, members), &ImportOptions::default()).unwrap();
    let said: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(said.len(), 11, "{said:?}");
    assert!(said[9].contains("/images/9: the image cannot be read"), "{}", said[9]);
    assert!(said[10].ends_with("/images/9: and 40 more like it, the last at /images/49"), "{}", said[10]);
}

#[test]
fn extras_of_any_depth_are_read_and_exported_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let path =
        write(folder.path(), 1, json!({"extras": {"a": "HERE"}, "extensions": {"X_none": {"a": ["HERE"]}}}));
    let deep = format!("{}{{\"b\":\"]\\\"\"}}{}", "[".repeat(5000), "]".repeat(5000));
    let text = std::fs::read_to_string(&path).unwrap().replace("\"HERE\"", &deep);
    std::fs::write(&path, text).unwrap();
    let mut document = Document::new();
    let prefab = document.add_imported(load(&path, &ImportOptions::default()).unwrap()).unwrap();
    let (_, edit) = document.instantiate_edit(prefab, None, Local::default());
    document.apply(edit).unwrap();
    for name in ["out.gltf", "out.glb"] {
        let out = folder.path().join(name);
        export(&document, &out).unwrap();
        let bytes = std::fs::read(&out).unwrap();
        let text: String = String::from_utf8_lossy(&bytes).chars().filter(|c| !c.is_whitespace()).collect();
        assert_eq!(text.matches(&deep).count(), 2, "{name}");
        load(&out, &ImportOptions::default()).unwrap();
    }
}

#[test]
fn images_of_the_same_bytes_are_decoded_once_and_counted_before() {
    let folder = tempfile::tempdir().unwrap();
    let options = ImportOptions::default();
    image::RgbaImage::from_pixel(64, 32, image::Rgba([1, 2, 3, 4]))
        .save(folder.path().join("a.png"))
        .unwrap();
    let images: Vec<Value> = ["a.png", "./a.png", "a.png"].iter().map(|uri| json!({"uri": uri})).collect();
    let textures: Vec<Value> = (0..3).map(|i| json!({"source": i})).collect();
    let color = |i: usize| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}, "normalTexture": {"index": i}});
    let materials: Vec<Value> = (0..3).map(color).collect();
    let path =
        write(folder.path(), 1, json!({"images": images, "textures": textures, "materials": materials}));
    let imported = load(&path, &options).unwrap();
    assert_eq!(imported.textures.len(), 6, "three as colour, three as data");
    let first = &imported.textures[0].rgba8;
    assert!(imported.textures.iter().all(|texture| Arc::ptr_eq(&texture.rgba8, first)));
    assert_eq!(imported.textures.iter().filter(|texture| texture.srgb).count(), 3);
    let bytes = 64 * 32 * 4;
    assert!(load(&path, &ImportOptions { max_image_bytes: bytes, ..options.clone() }).is_ok());
    let refused =
        load(&path, &ImportOptions { max_image_bytes: bytes - 1, ..options }).unwrap_err().to_string();
    assert!(refused.contains("/images/0: with the images before it, decoded, it becomes"), "{refused}");
}

#[test]
fn an_image_that_cannot_be_one_is_a_checker_and_counts_nothing() {
    let folder = tempfile::tempdir().unwrap();
    // A head of KTX 2 that claims the largest sides there are, and the first bytes of a PNG that claims more than it can hold.
    let mut ktx = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    ktx.extend([0, 1, u32::MAX, u32::MAX, 0, 0, 1, 1, 1].into_iter().flat_map(u32::to_le_bytes));
    ktx.resize(216, 0);
    std::fs::write(folder.path().join("a.ktx2"), ktx).unwrap();
    let mut png = Vec::new();
    image::RgbaImage::new(1, 1)
        .write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)
        .unwrap();
    for at in [16, 20] {
        png[at..at + 4].copy_from_slice(&65000_u32.to_be_bytes());
    }
    std::fs::write(folder.path().join("b.png"), png).unwrap();
    let images = json!([{"uri": "a.ktx2"}, {"uri": "b.png"}]);
    let textures = json!([{"source": 0}, {"source": 1}]);
    let of = |i: usize| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}});
    let members = json!({"images": images, "textures": textures, "materials": [of(0), of(1)]});
    let imported = load(&write(folder.path(), 1, members), &ImportOptions::default()).unwrap();
    let said: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
    for index in 0..2 {
        let place = format!("/images/{index}: the image cannot be read");
        assert!(said.iter().any(|words| words.contains(&place)), "{place}: {said:?}");
    }
}
