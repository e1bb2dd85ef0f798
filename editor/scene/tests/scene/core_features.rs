//! Parts of the core of glTF that few models have, each in a file of its own.

use std::path::Path;

use caustica_scene::Projection;
use caustica_scene::import::{ImportOptions, Imported, load};
use glam::{Vec2, Vec4};
use serde_json::{Value, json};

use crate::gltf_file::{Data, GltfFile, SQUARE};

fn read(file: &GltfFile) -> Imported {
    let folder = tempfile::tempdir().unwrap();
    load(&file.write(folder.path()), &ImportOptions::default()).unwrap()
}

fn messages(imported: &Imported) -> Vec<(&str, &str)> {
    imported.warnings.iter().map(|w| (w.place.as_str(), w.message.as_str())).collect()
}

#[test]
fn lists_strips_and_fans_are_the_same_surface_and_the_rest_is_named() {
    let mut file = GltfFile::new();
    let corners = file.floats("VEC3", 3, &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    let mut primitives = Vec::new();
    let orders: [&[u8]; 7] =
        [&[0], &[0, 1], &[0, 1], &[0, 1], &[0, 1, 2, 0, 2, 3], &[1, 2, 0, 3], &[0, 1, 2, 3]];
    for (mode, order) in orders.iter().enumerate() {
        let indices = file.accessor("SCALAR", order.len(), false, Data::U8(order));
        primitives.push(json!({"attributes": {"POSITION": corners}, "indices": indices, "mode": mode}));
    }
    file.push("meshes", json!({"primitives": primitives}));
    file.push("nodes", json!({"mesh": 0}));
    let imported = read(&file);
    let mesh = &imported.meshes[0];
    assert_eq!(mesh.primitives.len(), 3);
    for primitive in &mesh.primitives {
        let indices = &mesh.data.indices[primitive.first_index as usize..][..primitive.index_count as usize];
        let area = |[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|&i| mesh.data.positions[i as usize]);
            (b - a).cross(c - a).z / 2.0
        };
        assert_eq!(indices.as_chunks::<3>().0.iter().map(area).sum::<f32>(), 1.0);
    }
    let said = "4 primitives of points or lines are not rendered and only kept for exports";
    assert_eq!(messages(&imported), [("/meshes/0", said)]);
}

#[test]
fn of_several_scenes_the_default_one_comes_first() {
    let mut file = GltfFile::new();
    for name in ["first", "second", "third"] {
        let node = file.push("nodes", json!({"name": name}));
        file.push("scenes", json!({"nodes": [node]}));
    }
    let orders = [["second", "first", "third"], ["first", "second", "third"]];
    for (chosen, order) in [json!(1), Value::Null].into_iter().zip(orders) {
        file.json["scene"] = chosen;
        if file.json["scene"].is_null() {
            file.json.as_object_mut().unwrap().remove("scene");
        }
        let imported = read(&file);
        let names: Vec<&str> = imported.prefab.nodes().iter().map(|node| node.name.as_str()).collect();
        assert_eq!(names, order);
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    }
}

#[test]
fn second_texture_coordinates_colours_and_sparse_positions_are_read() {
    let mut file = GltfFile::new();
    let uv: Vec<f32> = (0..12).map(|i| i as f32).collect();
    let colors = [255, 0, 51, 0, 0, 255, 0, 0].repeat(3);
    let sparse = file.sparse(6, &[1, 2, 3, 4, 5], &SQUARE[3..]);
    let attributes = json!({
        "POSITION": sparse,
        "TEXCOORD_1": file.floats("VEC2", 2, &uv),
        "COLOR_0": file.accessor("VEC4", 6, true, Data::U8(&colors)),
    });
    file.push("meshes", json!({"primitives": [{"attributes": attributes}]}));
    file.push("nodes", json!({"mesh": 0}));
    let data = read(&file).meshes[0].data.clone();
    for (place, &index) in data.indices.iter().enumerate() {
        let index = index as usize;
        assert_eq!(data.positions[index].to_array(), SQUARE[place * 3..place * 3 + 3]);
        assert_eq!(data.tex_coords1[index], Vec2::new(uv[place * 2], uv[place * 2 + 1]));
        let color =
            if place % 2 == 0 { Vec4::new(1.0, 0.0, 0.2, 0.0) } else { Vec4::new(0.0, 1.0, 0.0, 0.0) };
        assert!(data.colors[index].abs_diff_eq(color, 1e-6), "{}", data.colors[index]);
    }
}

#[test]
fn parallel_cameras_keep_their_size_and_shape() {
    let mut file = GltfFile::new();
    // They may see from where they are on.
    for near in [0.5, 0.0] {
        let lens = json!({"xmag": 4, "ymag": 2, "znear": near, "zfar": 50});
        file.push("cameras", json!({"type": "orthographic", "orthographic": lens}));
    }
    file.push("nodes", json!({"camera": 0}));
    file.push("nodes", json!({"camera": 1}));
    let prefab = read(&file).prefab;
    for (node, near_m) in prefab.nodes().iter().zip([0.5, 0.0]) {
        let camera = node.camera.unwrap();
        assert!(matches!(camera.projection, Projection::Orthographic { ymag_m } if ymag_m == 2.0));
        assert_eq!((camera.aspect, camera.near_m, camera.far_m), (Some(2.0), near_m, Some(50.0)));
    }
}

#[test]
fn unknown_required_extensions_are_refused_by_name() {
    let mut file = GltfFile::new();
    file.json["extensionsRequired"] = json!(["KHR_texture_transform", "ACME_a", "ACME_b"]);
    let folder = tempfile::tempdir().unwrap();
    let error = load(&file.write(folder.path()), &ImportOptions::default()).unwrap_err();
    assert_eq!(error.place, "/extensionsRequired");
    assert!(error.reason.contains("requires ACME_a, ACME_b,"), "{error}");
    assert!(Path::new(&error.file).ends_with("file.gltf"));
}
