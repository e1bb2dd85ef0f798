//! Compressed geometry and images: equal to what they were before, or refused in words.

use std::path::{Path, PathBuf};

use caustica_scene::import::{ImportError, ImportOptions, Imported, load};
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh as DracoMesh,
    MeshEncoder, PointAttribute, PointIndex,
};
use glam::{DAffine3, DVec3, Vec3};
use serde_json::{Value, json};

use crate::common::{Numbers, assert_sound, assets};
use crate::gltf_file::{Data, GltfFile, SQUARE};

/// Reads a file that has to be sound.
pub fn read(path: &Path) -> Imported {
    let imported = load(path, &ImportOptions::default()).unwrap();
    assert_sound(path, &imported);
    imported
}

/// Corners with their normals in the world, each triangle beginning with its smallest corner, in order.
fn triangles(imported: &Imported) -> Vec<[(DVec3, Vec3); 3]> {
    let nodes = imported.prefab.nodes();
    let mut worlds: Vec<DAffine3> = Vec::new();
    let mut triangles = Vec::new();
    let rounded = |p: DVec3| (p * 1000.0).round().to_array().map(|v| v as i64);
    for node in nodes {
        let above = node.parent.map_or(DAffine3::IDENTITY, |parent| worlds[parent as usize]);
        let world = above * node.local.to_affine();
        worlds.push(world);
        let Some(mesh) = node.mesh else { continue };
        let data = &imported.meshes[mesh.0 as usize].data;
        let corner = |&i: &u32| {
            let normal = world.transform_vector3(data.normals[i as usize].as_dvec3()).normalize();
            (world.transform_point3(data.positions[i as usize].as_dvec3()), normal.as_vec3())
        };
        for indices in data.indices.as_chunks::<3>().0 {
            let [a, b, c] = indices.each_ref().map(corner);
            let turned = [[a, b, c], [b, c, a], [c, a, b]];
            triangles.extend(turned.into_iter().min_by_key(|t| t.map(|(p, _)| rounded(p))));
        }
    }
    triangles.sort_by_key(|t| t.map(|(p, _)| rounded(p)));
    triangles
}

fn assert_same_triangles(a: &Imported, b: &Imported, tolerance: f64) {
    let (a, b) = (triangles(a), triangles(b));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!(a.0.distance(b.0) <= tolerance, "{} and {}", a.0, b.0);
        assert!(a.1.distance(b.1) <= 0.02, "{} and {}", a.1, b.1);
    }
}

#[test]
fn compressed_boxes_equal_the_plain_one() {
    let Some(folder) = assets("gltf") else { return };
    let plain = read(&folder.join("Box/glTF/Box.gltf"));
    // Draco stored 11 bits a coordinate, meshoptimizer 14.
    let draco = read(&folder.join("Box/glTF-Draco/Box.gltf"));
    assert_same_triangles(&plain, &draco, 1e-3);
    assert!(draco.warnings.is_empty(), "{:?}", draco.warnings);
    let meshopt = read(&folder.join("BoxMeshopt/BoxMeshopt.glb"));
    assert_same_triangles(&plain, &meshopt, 1e-4);
    assert!(meshopt.warnings.is_empty(), "{:?}", meshopt.warnings);
}

/// A view with these bytes.
fn view(file: &mut GltfFile, bytes: &[u8]) -> Value {
    let accessor = file.accessor("SCALAR", bytes.len(), false, Data::U8(bytes));
    let view = file.json["accessors"][accessor]["bufferView"].clone();
    file.json["accessors"].as_array_mut().unwrap().pop();
    view
}

const GRID: usize = 24;

/// A bent grid: positions, normals, texture coordinates and joints.
struct Grid {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    tex_coords: Vec<[f32; 2]>,
    joints: Vec<[u8; 4]>,
    indices: Vec<u32>,
}

fn grid() -> Grid {
    let places = || (0..GRID * GRID).map(|i| ((i % GRID) as f32, (i / GRID) as f32));
    let normal = |(x, _): (f32, f32)| Vec3::new(-(x * 0.3).cos() * 0.3, 0.0, 1.0).normalize().to_array();
    let cells = (0..(GRID - 1) * (GRID - 1)).map(|i| (i / (GRID - 1) * GRID + i % (GRID - 1)) as u32);
    let next = GRID as u32;
    Grid {
        positions: places().map(|(x, y)| [x, y, (x * 0.3).sin()]).collect(),
        normals: places().map(normal).collect(),
        tex_coords: places().map(|(x, y)| [x / 23.0, y / 23.0]).collect(),
        joints: places().map(|(x, y)| [x as u8, y as u8, 0, 0]).collect(),
        indices: cells.flat_map(|i| [i, i + 1, i + next, i + next, i + 1, i + next + 1]).collect(),
    }
}

fn attribute<const N: usize>(
    kind: GeometryAttributeType,
    data: DataType,
    values: &[[u8; N]],
    width: u8,
) -> PointAttribute {
    let mut attribute = PointAttribute::new();
    attribute.init(kind, width, data, false, values.len());
    attribute.buffer_mut().write(0, values.as_flattened());
    attribute
}

fn float_bytes<const N: usize, const B: usize>(values: &[[f32; N]]) -> Vec<[u8; B]> {
    let bytes = |value: &[f32; N]| value.map(f32::to_le_bytes).as_flattened().try_into().unwrap();
    values.iter().map(bytes).collect()
}

/// The grid by Draco. `speed` 10 stores triangles one after the other, lower ones walk over the surface.
fn draco_grid(grid: &Grid, speed: i32) -> Vec<u8> {
    let mut mesh = DracoMesh::new();
    let (float, none) = (DataType::Float32, GeometryAttributeType::Generic);
    mesh.add_attribute(attribute(
        GeometryAttributeType::Position,
        float,
        &float_bytes::<3, 12>(&grid.positions),
        3,
    ));
    mesh.add_attribute(attribute(
        GeometryAttributeType::Normal,
        float,
        &float_bytes::<3, 12>(&grid.normals),
        3,
    ));
    mesh.add_attribute(attribute(
        GeometryAttributeType::TexCoord,
        float,
        &float_bytes::<2, 8>(&grid.tex_coords),
        2,
    ));
    mesh.add_attribute(attribute(none, DataType::Uint8, &grid.joints, 4));
    let faces = grid.indices.as_chunks::<3>().0;
    mesh.set_num_faces(faces.len());
    for (i, face) in (0..).zip(faces) {
        mesh.set_face(FaceIndex(i), face.map(PointIndex));
    }
    let mut options = EncoderOptions::new();
    options.set_global_int("encoding_speed", speed);
    options.set_global_int("decoding_speed", speed);
    for (attribute, bits) in [(0, 16), (1, 12), (2, 14)] {
        options.set_attribute_quantization(attribute, bits);
    }
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut stream = EncoderBuffer::new();
    encoder.encode(&options, &mut stream).unwrap();
    stream.data().to_vec()
}

/// A file with the grid by Draco; `None`: as it is.
fn grid_file(grid: &Grid, draco: Option<&[u8]>) -> GltfFile {
    let mut file = GltfFile::new();
    let joints = grid.joints.as_flattened();
    let weights = [1.0_f32, 0.0, 0.0, 0.0].repeat(GRID * GRID);
    let attributes = json!({
        "POSITION": file.floats("VEC3", 3, grid.positions.as_flattened()),
        "NORMAL": file.floats("VEC3", 3, grid.normals.as_flattened()),
        "TEXCOORD_0": file.floats("VEC2", 2, grid.tex_coords.as_flattened()),
        "JOINTS_0": file.accessor("VEC4", GRID * GRID, false, Data::U8(joints)),
        "WEIGHTS_0": file.floats("VEC4", 4, &weights),
    });
    let indices: Vec<u16> = grid.indices.iter().map(|&i| i as u16).collect();
    let indices = file.accessor("SCALAR", indices.len(), false, Data::U16(&indices));
    let mut primitive = json!({"attributes": attributes, "indices": indices});
    if let Some(stream) = draco {
        let view = view(&mut file, stream);
        primitive["extensions"] = json!({"KHR_draco_mesh_compression": {"bufferView": view,
            "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "JOINTS_0": 3}}});
        for accessor in [0, 1, 2, 3, indices] {
            file.json["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
        }
    }
    file.push("meshes", json!({"primitives": [primitive]}));
    file.push("nodes", json!({"mesh": 0}));
    file
}

/// Rounded position, normal, texture coordinates and joints.
type Vertex = ([i64; 3], Vec3, [f32; 2], [u16; 4]);

/// Vertices in an order that does not depend on the encoder.
fn vertices(imported: &Imported) -> Vec<Vertex> {
    let data = &imported.meshes[0].data;
    let joints = data.skin.as_ref().map(|skin| skin.joints.clone()).unwrap_or_default();
    let vertex = |i: usize| {
        let place = data.positions[i].to_array().map(|v| (v * 100.0).round() as i64);
        (place, data.normals[i], data.tex_coords0[i].to_array(), joints[i])
    };
    let mut vertices: Vec<Vertex> = (0..data.positions.len()).map(vertex).collect();
    vertices.sort_by_key(|vertex| vertex.0);
    vertices
}

#[test]
fn draco_gives_back_every_attribute() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid();
    let plain = read(&grid_file(&grid, None).write(folder.path()));
    for speed in [0, 3, 5, 10] {
        let stream = draco_grid(&grid, speed);
        let imported = read(&grid_file(&grid, Some(&stream)).write(folder.path()));
        assert_same_triangles(&plain, &imported, 1e-3);
        let (a, b) = (vertices(&plain), vertices(&imported));
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            assert_eq!((a.0, a.3), (b.0, b.3), "speed {speed}");
            assert!(a.1.distance(b.1) < 0.01, "speed {speed}: {} and {}", a.1, b.1);
            assert!((a.2[0] - b.2[0]).abs() < 1e-3 && (a.2[1] - b.2[1]).abs() < 1e-3, "speed {speed}");
        }
    }
}

/// What is done to a file.
type Change = fn(&mut Value);

fn refused(file: &GltfFile) -> ImportError {
    let folder = tempfile::tempdir().unwrap();
    load(&file.write(folder.path()), &ImportOptions::default()).unwrap_err()
}

#[test]
fn draco_that_does_not_fit_its_accessors_is_refused() {
    let grid = grid();
    let stream = draco_grid(&grid, 3);
    let place = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let cases: &[(&str, Change)] = &[
        ("ceiling", |json| json["accessors"][5]["count"] = json!(300)),
        ("vertices", |json| json["accessors"][5]["count"] = json!(30_000)),
        ("ceiling", |json| json["accessors"][0]["count"] = json!(20)),
        ("accessors have", |json| (0..4).for_each(|i| json["accessors"][i]["count"] = json!(90_000))),
        ("type or count", |json| json["accessors"][2]["count"] = json!(20)),
        ("type or count", |json| json["accessors"][1]["type"] = json!("VEC2")),
        ("mode 4", |json| json["meshes"][0]["primitives"][0]["mode"] = json!(5)),
        ("becomes", |json| (0..4).for_each(|i| json["accessors"][i]["count"] = json!(16_000_000))),
    ];
    for (part, change) in cases {
        let mut file = grid_file(&grid, Some(&stream));
        change(&mut file.json);
        let error = refused(&file);
        assert_eq!(error.place, place, "{error}");
        assert!(error.reason.contains(part), "{part}: {error}");
    }
    let mut file = grid_file(&grid, Some(&stream));
    file.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["NORMAL"] =
        json!(9);
    assert!(refused(&file).reason.contains("no attribute 9"));
}

/// Plain vertices beside compressed ones are for programs that cannot decompress, and as good.
#[test]
fn plain_vertices_beside_draco_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid();
    let plain = read(&grid_file(&grid, None).write(folder.path()));
    let mut file = grid_file(&grid, Some(b"not Draco at all"));
    for (accessor, view) in file.json["accessors"].as_array_mut().unwrap().iter_mut().zip(0..) {
        accessor["bufferView"] = json!(view);
    }
    assert_eq!(read(&file.write(folder.path())).meshes, plain.meshes);
}

/// A square whose positions and indices are compressed, and the places of their views.
fn meshopt_square(name: &str) -> GltfFile {
    let mut file = GltfFile::new();
    let corners: Vec<[f32; 3]> = SQUARE.as_chunks::<3>().0.to_vec();
    let corners = meshopt::encode_vertex_buffer_level(&corners, 2, Some(0)).unwrap();
    let indices = meshopt::encode_index_sequence(&[0, 1, 2, 3, 4, 5], 6).unwrap();
    let streams = [view(&mut file, &corners), view(&mut file, &indices)];
    let [corners, indices] =
        streams.map(|view| file.json["bufferViews"][view.as_u64().unwrap() as usize].clone());
    let compressed = |stream: &Value, stride: usize, mode: &str| {
        json!({"buffer": 1, "byteLength": 6 * stride, "extensions": {name: {"buffer": 0,
            "byteOffset": stream["byteOffset"], "byteLength": stream["byteLength"], "byteStride": stride,
            "count": 6, "mode": mode, "filter": "NONE"}}})
    };
    file.json["bufferViews"] =
        json!([compressed(&corners, 12, "ATTRIBUTES"), compressed(&indices, 2, "INDICES")]);
    file.json["accessors"] = json!([
        {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 6},
        {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 6}]);
    file.json["extensionsRequired"] = json!([name]);
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}));
    file.push("nodes", json!({"mesh": 0}));
    file
}

/// Writes a file with a second buffer that has no bytes.
fn with_fallback(file: &GltfFile, folder: &Path, name: &str) -> PathBuf {
    let path = file.write(folder);
    let mut json: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let fallback = json!({"byteLength": 1000, "extensions": {name: {"fallback": true}}});
    json["buffers"].as_array_mut().unwrap().push(fallback);
    std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
    path
}

#[test]
fn meshopt_views_are_read_under_both_names() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let imported = read(&with_fallback(&meshopt_square(name), folder.path(), name));
        let data = &imported.meshes[0].data;
        let positions = data.indices.iter().map(|&i| data.positions[i as usize]);
        assert_eq!(positions.flat_map(|p| p.to_array()).collect::<Vec<_>>(), SQUARE);
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    }
}

#[test]
fn meshopt_views_that_lie_are_refused() {
    let name = "EXT_meshopt_compression";
    let place = "/bufferViews/0/extensions/EXT_meshopt_compression";
    let cases: &[(&str, &str, Change)] = &[
        (place, "elements", |view| view["extensions"]["EXT_meshopt_compression"]["count"] = json!(7)),
        (place, "not in buffer", |view| {
            view["extensions"]["EXT_meshopt_compression"]["byteLength"] = json!(7000)
        }),
        (place, "not in buffer", |view| view["extensions"]["EXT_meshopt_compression"]["buffer"] = json!(4)),
        (place, "byteStride", |view| view["byteStride"] = json!(16)),
        (place, "WORDS", |view| view["extensions"]["EXT_meshopt_compression"]["mode"] = json!("WORDS")),
        (place, "filter", |view| {
            view["extensions"]["EXT_meshopt_compression"]["filter"] = json!("OCTAHEDRAL")
        }),
        (place, "stream", |view| {
            view["byteLength"] = json!(12 * 600);
            view["extensions"]["EXT_meshopt_compression"]["count"] = json!(600);
        }),
        ("/bufferViews/0", "becomes", |view| {
            view["byteLength"] = json!(12 * 60_000_000);
            view["extensions"]["EXT_meshopt_compression"]["count"] = json!(60_000_000);
        }),
        ("/bufferViews/0", "past the end of buffer 1", |view| {
            view.as_object_mut().unwrap().remove("extensions");
        }),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (place, part, change) in cases {
        let mut file = meshopt_square(name);
        change(&mut file.json["bufferViews"][0]);
        let error = load(&with_fallback(&file, folder.path(), name), &ImportOptions::default()).unwrap_err();
        assert_eq!(&error.place, place, "{error}");
        assert!(error.reason.contains(part), "{part}: {error}");
    }
}

/// Changes a few bytes of a file beside a model and reads the model, again and again: an answer, never a panic.
pub fn check_damaged(model: &Path, data: &Path, rounds: usize) {
    let mut numbers = Numbers(12);
    let sound = std::fs::read(data).unwrap();
    let mut noticed = 0;
    for _ in 0..rounds {
        let mut bytes = sound.clone();
        for _ in 0..=numbers.below(5) {
            let at = numbers.below(bytes.len());
            bytes[at] = numbers.below(256) as u8;
        }
        std::fs::write(data, bytes).unwrap();
        match load(model, &ImportOptions::default()) {
            Ok(imported) => {
                assert_sound(model, &imported);
                noticed += usize::from(!imported.warnings.is_empty());
            }
            Err(error) => {
                assert!(!error.reason.is_empty());
                noticed += 1;
            }
        }
    }
    assert!(noticed > rounds / 20, "{noticed} of {rounds} changes of {} were noticed", data.display());
}

#[test]
fn damaged_draco_ends_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid();
    for speed in [0, 5, 10] {
        let model = grid_file(&grid, Some(&draco_grid(&grid, speed))).write(folder.path());
        check_damaged(&model, &folder.path().join("data.bin"), 500);
    }
}
