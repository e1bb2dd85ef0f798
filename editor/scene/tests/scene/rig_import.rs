//! Skins, morph targets and clips: the shared models against an independent reader, and small files against what
//! was written into them.

use std::path::Path;

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{ChannelPath, Interpolation, MeshData};
use glam::{DAffine3, DVec3, Vec3};
use gltf::animation::util::ReadOutputs;
use serde_json::{Value, json};

use crate::common::{assert_sound, assets};
use crate::gltf_file::{Data, GltfFile, SQUARE};
use crate::oracle::Oracle;

const MODELS: [(&str, usize, usize, usize); 8] = [
    // Joints, morph targets, channels.
    ("gltf/SimpleSkin/glTF-Embedded/SimpleSkin.gltf", 2, 0, 1),
    ("gltf/RiggedSimple/glTF-Binary/RiggedSimple.glb", 2, 0, 3),
    ("gltf/SimpleMorph/glTF/SimpleMorph.gltf", 0, 2, 1),
    ("gltf/AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb", 0, 2, 1),
    ("gltf/AnimatedMorphCube/glTF-Quantized/AnimatedMorphCube.gltf", 0, 2, 1),
    ("gltf/InterpolationTest/glTF-Binary/InterpolationTest.glb", 0, 0, 9),
    ("gltf/AnimatedCube/glTF/AnimatedCube.gltf", 0, 0, 1),
    ("gltf/CesiumMilkTruck/glTF-Binary/CesiumMilkTruck.glb", 0, 0, 2),
];

fn read(path: &Path) -> Imported {
    let imported = load(path, &ImportOptions::default()).unwrap();
    assert_sound(path, &imported);
    imported
}

/// Position, holds and target positions of every corner, in order of the triangles.
type Corner = (Vec3, Vec<(u16, f32)>, Vec<Vec3>);

fn corners(data: &MeshData) -> Vec<Corner> {
    let corner = |&i: &u32| {
        let i = i as usize;
        let holds = data.skin.as_ref().map_or(Vec::new(), |skin| held(skin.joints[i], skin.weights[i]));
        let targets = data.morph.iter().map(|t| t.positions.get(i).copied().unwrap_or_default()).collect();
        (data.positions[i], holds, targets)
    };
    data.indices.iter().map(corner).collect()
}

/// The holds with a weight, in order of the joint.
fn held(joints: [u16; 4], weights: [f32; 4]) -> Vec<(u16, f32)> {
    let mut holds: Vec<_> = joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0).collect();
    holds.sort_by_key(|(joint, _)| *joint);
    holds
}

fn oracle_corners(oracle: &Oracle, mesh: &gltf::Mesh<'_>) -> Vec<Corner> {
    let mut corners = Vec::new();
    for primitive in mesh.primitives() {
        let reader = primitive.reader(|buffer| Some(&oracle.buffers[buffer.index()]));
        let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
        let joints: Vec<[u16; 4]> = reader.read_joints(0).map_or(Vec::new(), |j| j.into_u16().collect());
        let weights: Vec<[f32; 4]> = reader.read_weights(0).map_or(Vec::new(), |w| w.into_f32().collect());
        let targets: Vec<Vec<[f32; 3]>> =
            reader.read_morph_targets().map(|(p, _, _)| p.unwrap().collect()).collect();
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..positions.len() as u32).collect(),
        };
        for i in indices.into_iter().map(|i| i as usize) {
            let holds = if joints.is_empty() { Vec::new() } else { held(joints[i], weights[i]) };
            let targets = targets.iter().map(|t| Vec3::from(t[i])).collect();
            corners.push((Vec3::from(positions[i]), holds, targets));
        }
    }
    corners
}

fn assert_same_corners(found: &[Corner], expected: &[Corner], name: &str) {
    assert_eq!(found.len(), expected.len(), "{name}");
    for (a, b) in found.iter().zip(expected) {
        assert_eq!((a.0, &a.2), (b.0, &b.2), "{name}");
        assert_eq!(a.1.len(), b.1.len(), "{name}");
        for ((joint, weight), (expected_joint, expected)) in a.1.iter().zip(&b.1) {
            assert_eq!(joint, expected_joint, "{name}");
            assert!((weight - expected).abs() < 1e-6, "{name}: {weight} {expected}");
        }
    }
}

#[test]
fn models_are_what_the_gltf_crate_reads() {
    for (name, joints, targets, channels) in MODELS {
        let Some(path) = assets(name) else { continue };
        let imported = read(&path);
        let prefab = &imported.prefab;
        assert_eq!(prefab.skins().iter().map(|skin| skin.joints.len()).sum::<usize>(), joints, "{name}");
        assert_eq!(imported.meshes.iter().map(|m| m.data.morph.len()).max().unwrap(), targets, "{name}");
        assert_eq!(prefab.animations.iter().map(|a| a.channels.len()).sum::<usize>(), channels, "{name}");
        let told = |word: &str| imported.warnings.iter().any(|warning| warning.message.contains(word));
        assert!(!told("animation") && !told("skin") && !told("morph"), "{name}: {:?}", imported.warnings);
        if name.contains("Quantized") {
            // The gltf crate refuses the extension.
            continue;
        }
        let oracle = Oracle::open(&path);
        for (mesh, expected) in imported.meshes.iter().zip(oracle.document.meshes()) {
            assert_same_corners(&corners(&mesh.data), &oracle_corners(&oracle, &expected), name);
            let mut weights = expected.weights().map_or(Vec::new(), <[f32]>::to_vec);
            weights.resize(mesh.data.morph.len(), 0.0);
            assert_eq!(mesh.default_weights, weights, "{name}");
        }
        assert_same_skins(&imported, &oracle, name);
        assert_same_clips(&imported, &oracle, name);
    }
}

fn assert_same_skins(imported: &Imported, oracle: &Oracle, name: &str) {
    for (skin, expected) in imported.prefab.skins().iter().zip(oracle.document.skins()) {
        let parts: Vec<u32> = expected.joints().map(|node| oracle.part(node.index()).unwrap()).collect();
        assert_eq!(skin.joints, parts, "{name}");
        let reader = expected.reader(|buffer| Some(&oracle.buffers[buffer.index()]));
        for (matrix, expected) in skin.inverse_bind.iter().zip(reader.read_inverse_bind_matrices().unwrap()) {
            let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.translation];
            assert_eq!(columns.map(|c| c.to_array()), expected.map(|c| [c[0], c[1], c[2]].map(f64::from)));
        }
    }
    for (node, skin) in oracle.document.nodes().filter_map(|node| Some((node.index(), node.skin()?))) {
        let part = oracle.part(node).unwrap();
        assert_eq!(imported.prefab.nodes()[part as usize].skin, Some(skin.index() as u32), "{name}");
    }
}

fn assert_same_clips(imported: &Imported, oracle: &Oracle, name: &str) {
    for (clip, expected) in imported.prefab.animations.iter().zip(oracle.document.animations()) {
        assert_eq!(clip.name, expected.name().unwrap_or_default());
        let mut longest = 0.0_f32;
        for (channel, expected) in clip.channels.iter().zip(expected.channels()) {
            assert_eq!(Some(channel.part), oracle.part(expected.target().node().index()), "{name}");
            let reader = expected.reader(|buffer| Some(&oracle.buffers[buffer.index()]));
            let times: Vec<f32> = reader.read_inputs().unwrap().collect();
            let (path, values): (_, Vec<f32>) = match reader.read_outputs().unwrap() {
                ReadOutputs::Translations(values) => (ChannelPath::Translation, values.flatten().collect()),
                ReadOutputs::Scales(values) => (ChannelPath::Scale, values.flatten().collect()),
                ReadOutputs::Rotations(values) => {
                    (ChannelPath::Rotation, values.into_f32().flatten().collect())
                }
                ReadOutputs::MorphTargetWeights(values) => {
                    (ChannelPath::Weights, values.into_f32().collect())
                }
            };
            let read = (channel.path, &channel.times_s[..], &channel.values[..]);
            assert_eq!(read, (path, &times[..], &values[..]), "{name}");
            longest = longest.max(*times.last().unwrap());
        }
        assert_eq!(clip.duration_s, f64::from(longest), "{name}");
    }
}

/// A square with joints, weights and a clip that moves the second joint; what a test changes, it changes before
/// the file is written.
pub fn rig() -> GltfFile {
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    let joints = file.accessor("VEC4", 6, false, Data::U8(&[0, 1, 0, 0].repeat(6)));
    let weights = file.floats("VEC4", 4, &[0.25, 0.75, 0.0, 0.0].repeat(6));
    let times = file.floats("SCALAR", 1, &[0.0, 1.0]);
    let moves = file.floats("VEC3", 3, &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    file.push(
        "meshes",
        json!({"primitives": [{"attributes":
            {"POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights}}]}),
    );
    file.push("nodes", json!({"name": "body", "mesh": 0, "skin": 0}));
    file.push("nodes", json!({"name": "hip", "children": [2]}));
    file.push("nodes", json!({"name": "knee"}));
    file.push("skins", json!({"joints": [1, 2]}));
    file.push(
        "animations",
        json!({"samplers": [{"input": times, "output": moves}],
            "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}]}),
    );
    file
}

#[test]
fn joints_and_weights_come_in_every_form() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = rig();
    let second = file.accessor("VEC4", 6, false, Data::U16(&[1, 0, 0, 0].repeat(6)));
    let bytes = file.accessor("VEC4", 6, true, Data::U8(&[51, 204, 0, 0].repeat(6)));
    let shorts = file.accessor("VEC4", 6, true, Data::U16(&[0, 0, 0, 65535].repeat(6)));
    file.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(bytes);
    let data = read(&file.write(folder.path())).meshes.remove(0).data;
    let skin = data.skin.as_ref().unwrap();
    assert_eq!((skin.joints[0], skin.joints.len()), ([1, 0, 0, 0], 6));
    assert!((skin.weights[5][0] - 0.8).abs() < 1e-6 && (skin.weights[5][1] - 0.2).abs() < 1e-6);
    // A second set counts too, what it says of the same joint is added, and a joint of weight 0 is tidied away.
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_1"] = json!(second);
    attributes["WEIGHTS_1"] = json!(shorts);
    let data = read(&file.write(folder.path())).meshes.remove(0).data;
    let skin = data.skin.as_ref().unwrap();
    assert_eq!(skin.joints[0], [0, 1, 0, 0]);
    assert!((skin.weights[0][0] - 0.6).abs() < 1e-6 && (skin.weights[0][1] - 0.4).abs() < 1e-6);
}

#[test]
fn more_than_four_joints_are_cut_to_the_strongest_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = rig();
    for _ in 0..6 {
        file.push("nodes", json!({}));
    }
    file.json["skins"][0]["joints"] = json!([1, 2, 3, 4, 5, 6, 7, 8]);
    let (first, second) = ([0, 1, 2, 3].repeat(6), [4, 5, 6, 7].repeat(6));
    let sets = [
        ("JOINTS_0", file.accessor("VEC4", 6, false, Data::U8(&first))),
        ("WEIGHTS_0", file.floats("VEC4", 4, &[0.3, 0.1, 0.05, 0.05].repeat(6))),
        ("JOINTS_1", file.accessor("VEC4", 6, false, Data::U8(&second))),
        ("WEIGHTS_1", file.floats("VEC4", 4, &[0.2, 0.2, 0.1, 0.0].repeat(6))),
    ];
    for (name, accessor) in sets {
        file.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }
    let imported = read(&file.write(folder.path()));
    let skin = imported.meshes[0].data.skin.as_ref().unwrap();
    assert_eq!(skin.joints[0], [0, 4, 5, 1]);
    assert!((skin.weights[0][0] - 0.375).abs() < 1e-6);
    assert!(imported.warnings.iter().any(|w| w.message.contains("6 vertices have more than 4 joints")));
}

#[test]
fn vertices_without_weights_are_held_by_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = rig();
    let mut weights = [0.25, 0.75, 0.0, 0.0].repeat(6);
    weights[..4].fill(0.0);
    (weights[4], weights[8]) = (f32::NAN, -1.0);
    let accessor = file.floats("VEC4", 4, &weights);
    file.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(accessor);
    // A second primitive without joints shares the mesh.
    file.json["meshes"][0]["primitives"]
        .as_array_mut()
        .unwrap()
        .insert(0, json!({"attributes": {"POSITION": 0}}));
    let imported = read(&file.write(folder.path()));
    let skin = imported.meshes[0].data.skin.as_ref().unwrap();
    assert_eq!(skin.weights.len(), 12);
    assert!(skin.weights[..7].iter().all(|weights| *weights == [0.0; 4]));
    assert_eq!(skin.weights[7..9], [[1.0, 0.0, 0.0, 0.0]; 2]);
    assert_eq!((skin.joints[7], skin.joints[9]), ([1, 0, 0, 0], [1, 0, 0, 0]));
    let told = |text: &str| imported.warnings.iter().any(|w| w.message.contains(text));
    assert!(told("1 vertices have no joint") && told("2 weights are negative or not finite"));
}

#[test]
fn morph_targets_follow_their_vertices_and_faces() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = GltfFile::new();
    let position = file.floats("VEC3", 3, &SQUARE);
    // Only corner 4, at (1, 1, 0), is lifted.
    let lifted = file.sparse(6, &[4], &[0.0, 0.0, 1.0]);
    file.push(
        "meshes",
        json!({"weights": [0.5], "extras": {"targetNames": ["lift", 7]}, "primitives": [
            {"attributes": {"POSITION": position}},
            {"attributes": {"POSITION": position}, "targets": [{"POSITION": lifted}]}]}),
    );
    file.push("nodes", json!({"mesh": 0, "weights": [0.25]}));
    file.push("nodes", json!({"mesh": 0}));
    let imported = read(&file.write(folder.path()));
    let mesh = &imported.meshes[0];
    let target = &mesh.data.morph[0];
    assert_eq!((target.name.as_str(), &mesh.default_weights), ("lift", &vec![0.5]));
    assert_eq!(imported.prefab.nodes()[0].weights, Some(vec![0.25]));
    assert_eq!(imported.prefab.nodes()[1].weights, None);
    // The first primitive has no targets: zeros stand for it.
    assert_eq!(target.positions[..6], [Vec3::ZERO; 6]);
    let deltas: Vec<Vec3> = (0..6).map(|i| if i == 4 { Vec3::Z } else { Vec3::ZERO }).collect();
    assert_eq!(target.positions[6..], deltas);
    // Without normals in the file every face is flat, also the morphed one: it goes through (1, 0, 0), (1, 1, 1)
    // and (0, 1, 0), so that its normal is (0, 1, 0) x ... = (-1, -1, 1) / sqrt 3.
    let lifted = Vec3::new(-1.0, -1.0, 1.0).normalize() - Vec3::Z;
    assert_eq!(target.normals[..9], [Vec3::ZERO; 9]);
    assert!(target.normals[9..].iter().all(|d| (*d - lifted).length() < 1e-6), "{:?}", target.normals);
    assert!(target.tangents.is_empty());
    let told =
        imported.warnings.iter().any(|w| w.message.contains("differ in their number of morph targets"));
    assert!(told, "{:?}", imported.warnings);
}

#[test]
fn what_bends_a_vertex_follows_it_when_tangents_split_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = rig();
    // An indexed square whose halves have mirrored texture coordinates, so that two vertices are doubled.
    let corner = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let position: Vec<f32> = corner.iter().flat_map(|[x, y]| [*x, *y, 0.0]).collect();
    let uv: Vec<f32> = corner.iter().flat_map(|[x, y]| [(x + y - 1.0_f32).abs(), *y]).collect();
    let lift: Vec<f32> = (0..4).flat_map(|i| [0.0, 0.0, i as f32 + 1.0]).collect();
    let accessors = [
        ("POSITION", file.floats("VEC3", 3, &position)),
        ("NORMAL", file.floats("VEC3", 3, &[0.0, 0.0, 1.0].repeat(4))),
        ("TEXCOORD_0", file.floats("VEC2", 2, &uv)),
        ("JOINTS_0", file.accessor("VEC4", 4, false, Data::U8(&[0, 1, 0, 0].repeat(4)))),
        ("WEIGHTS_0", {
            let weights: Vec<f32> =
                (0..4).flat_map(|i| [0.1 * i as f32, 1.0 - 0.1 * i as f32, 0.0, 0.0]).collect();
            file.floats("VEC4", 4, &weights)
        }),
    ];
    let attributes: serde_json::Map<String, Value> =
        accessors.into_iter().map(|(name, accessor)| (name.to_owned(), json!(accessor))).collect();
    let lift = file.floats("VEC3", 3, &lift);
    let indices = file.accessor("SCALAR", 6, false, Data::U16(&[0, 1, 2, 1, 3, 2]));
    file.push("images", json!({"uri": "absent.png"}));
    file.push("textures", json!({"source": 0}));
    file.push("materials", json!({"normalTexture": {"index": 0}}));
    file.json["meshes"] = json!([{"primitives": [{"attributes": attributes, "indices": indices, "material": 0,
        "targets": [{"POSITION": lift, "TANGENT": lift}]}]}]);
    let imported = read(&file.write(folder.path()));
    let data = &imported.meshes[0].data;
    assert!(data.positions.len() > 4, "{} vertices", data.positions.len());
    for (i, p) in data.positions.iter().enumerate() {
        let number = p.x + 2.0 * p.y;
        assert_eq!(data.morph[0].positions[i], Vec3::new(0.0, 0.0, number + 1.0));
        let skin = data.skin.as_ref().unwrap();
        let holds = held(skin.joints[i], skin.weights[i]);
        let of_first = holds.iter().find(|(joint, _)| *joint == 0).map_or(0.0, |(_, weight)| *weight);
        assert!((of_first - 0.1 * number).abs() < 1e-6, "{p} {holds:?}");
    }
    // The base got tangents of its own: the deltas of the file do not go with them.
    assert!(data.morph[0].tangents.is_empty());
}

#[test]
fn whole_numbers_are_read_as_the_format_says() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = rig();
    let turns = file.accessor("VEC4", 2, true, Data::I16(&[0, 0, 0, 32767, 0, -32767, 0, 0]));
    file.json["animations"][0]["samplers"][0]["output"] = json!(turns);
    file.json["animations"][0]["samplers"][0]["interpolation"] = json!("STEP");
    file.json["animations"][0]["channels"][0]["target"]["path"] = json!("rotation");
    let imported = read(&file.write(folder.path()));
    let channel = &imported.prefab.animations[0].channels[0];
    assert_eq!(channel.values[..], [0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0]);
    assert_eq!((channel.part, channel.interpolation), (2, Interpolation::Step));
    assert_eq!(imported.prefab.skins()[0].inverse_bind, [DAffine3::IDENTITY; 2]);
}

#[test]
fn matrices_keep_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = rig();
    let mut columns =
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.5, 0.25, 3.0, 1.0].repeat(2);
    columns[31] = 2.0;
    let matrices = file.floats("MAT4", 16, &columns);
    file.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
    let imported = read(&file.write(folder.path()));
    let expected = DAffine3::from_translation(DVec3::new(-1.5, 0.25, 3.0));
    assert_eq!(imported.prefab.skins()[0].inverse_bind, [expected; 2]);
    assert!(imported.warnings.iter().any(|w| w.message.contains("last row")));
}
