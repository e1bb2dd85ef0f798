//! A small glTF file with one of everything that can be edited: two primitives in a mesh, a skin, morph targets, an
//! animation, a lamp, a plate that shines, glass, and holes from a texture.

use std::f32::consts::FRAC_PI_4;
use std::path::{Path, PathBuf};

use caustica_renderer::delta::Mesh;
use caustica_tests::scene::{cube, quad};
use glam::{Quat, Vec3};
use serde_json::{Value, json};

/// Rings of the tube between its ends.
const RINGS: u16 = 8;

/// Writes the file and its texture into a folder; returns its path.
pub fn write(folder: &Path) -> PathBuf {
    write_version(folder, "model.gltf", true)
}

/// Writes the file as someone else has edited it: a primitive, a morph target, a texture, the last material and the last
/// node are gone.
pub fn write_edited(folder: &Path) -> PathBuf {
    write_version(folder, "edited.gltf", false)
}

fn write_version(folder: &Path, name: &str, whole: bool) -> PathBuf {
    let mut file = File::default();
    let mut pair = vec![file.primitive(&cube(0.5), Vec3::ZERO, 0)];
    pair.extend(whole.then(|| file.primitive(&cube(0.4), Vec3::X * 0.7, 1)));
    let weights = if whole { vec![0.25, 0.0] } else { vec![0.25] };
    let meshes = json!([
        {"name": "Pair", "primitives": pair},
        {"name": "Tube", "primitives": [file.tube(2)]},
        {"name": "Flag", "weights": weights, "primitives": [file.flag(3, weights.len())]},
        {"name": "Plate", "primitives": [file.primitive(&quad(0.8, 0.6), Vec3::ZERO, if whole { 4 } else { 2 })]},
    ]);
    let bind = file.inverse_bind();
    let animations = json!([{"name": "Wave", "channels": [], "samplers": []}]);
    let mut json = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_transmission", "KHR_materials_volume",
            "KHR_materials_ior", "KHR_materials_emissive_strength"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 3.0, "color": [1.0, 0.8, 0.6], "extras": {"radius": 0.1}}]}},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": "Rig", "children": if whole { vec![1, 2, 3, 4, 5, 8] } else { vec![1, 2, 3, 4, 5] }},
            {"name": "Pair", "mesh": 0, "translation": [-0.9, 0.3, 0.0]},
            {"name": "Tube", "mesh": 1, "skin": 0},
            {"name": "Flag", "mesh": 2, "translation": [0.8, 0.6, 0.2]},
            {"name": "Plate", "mesh": 3, "translation": [0.0, 1.6, -0.4]},
            {"name": "Hip", "children": [6]},
            {"name": "Knee", "translation": [0.0, 0.5, 0.0], "children": [7]},
            {"name": "Toe", "translation": [0.0, 0.5, 0.0]},
            {"name": "Lamp", "translation": [0.3, 1.8, 1.0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "skins": [{"joints": [5, 6, 7], "inverseBindMatrices": bind}],
        "materials": materials(),
        "meshes": meshes,
        "animations": animations,
    });
    if whole {
        json["textures"] = json!([{"source": 0}]);
        json["images"] = json!([{"uri": "holes.png"}]);
        json["materials"][3]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
    } else if let Some(materials) = json["materials"].as_array_mut() {
        materials.pop();
    }
    json["animations"][0] = file.animation(weights.len());
    json["accessors"] = Value::Array(file.accessors);
    json["bufferViews"] = Value::Array(file.views);
    let buffer = format!("{name}.bin");
    json["buffers"] = json!([{"uri": buffer, "byteLength": file.bytes.len()}]);
    std::fs::write(folder.join(buffer), &file.bytes).expect("a buffer is written");
    write_holes(&folder.join("holes.png"));
    let path = folder.join(name);
    std::fs::write(&path, json.to_string()).expect("a file is written");
    path
}

fn materials() -> Value {
    json!([
        {"name": "Paint", "pbrMetallicRoughness":
            {"baseColorFactor": [0.7, 0.2, 0.1, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.3}},
        {"name": "Glass", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0}, "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.4},
            "KHR_materials_volume": {"thicknessFactor": 0.1}}},
        {"name": "Skin", "pbrMetallicRoughness":
            {"baseColorFactor": [0.3, 0.6, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9}},
        {"name": "Lace", "alphaMode": "MASK", "doubleSided": true, "pbrMetallicRoughness":
            {"metallicFactor": 0.0, "roughnessFactor": 0.8}},
        {"name": "Glow", "emissiveFactor": [1.0, 0.8, 0.5],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}},
            "pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0}},
    ])
}

/// A checkerboard of 8 x 8 texels, every second one a hole.
fn write_holes(path: &Path) {
    let texel = |i: u32| [200, 210, 255, if (i % 8 + i / 8).is_multiple_of(2) { 255 } else { 0 }];
    let rgba: Vec<u8> = (0..64).flat_map(texel).collect();
    image::save_buffer(path, &rgba, 8, 8, image::ExtendedColorType::Rgba8).expect("a texture is written");
}

#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl File {
    /// Adds an accessor and returns its number.
    fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()}));
        let view = self.views.len() - 1;
        self.accessors
            .push(json!({"bufferView": view, "componentType": component, "type": kind, "count": count}));
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]]) -> usize {
        self.accessor(kind, 5126, values.len(), bytemuck::cast_slice(values))
    }

    fn points(&mut self, points: &[Vec3]) -> usize {
        let values: Vec<[f32; 3]> = points.iter().map(Vec3::to_array).collect();
        let accessor = self.floats("VEC3", &values);
        let fold =
            |f: fn(Vec3, Vec3) -> Vec3| points.iter().copied().reduce(f).unwrap_or_default().to_array();
        self.accessors[accessor]["min"] = json!(fold(Vec3::min));
        self.accessors[accessor]["max"] = json!(fold(Vec3::max));
        accessor
    }

    fn indices(&mut self, indices: &[u16]) -> usize {
        self.accessor("SCALAR", 5123, indices.len(), bytemuck::cast_slice(indices))
    }

    /// A mesh as one primitive, shifted.
    fn primitive(&mut self, mesh: &Mesh, by: Vec3, material: u32) -> Value {
        let positions: Vec<Vec3> = mesh.positions.iter().map(|p| *p + by).collect();
        let tex_coords: Vec<[f32; 2]> = mesh.tex_coords0.iter().map(|uv| uv.to_array()).collect();
        let indices: Vec<u16> = mesh.indices.iter().map(|i| *i as u16).collect();
        json!({
            "attributes": {
                "POSITION": self.points(&positions),
                "NORMAL": self.points(&mesh.normals),
                "TEXCOORD_0": self.floats("VEC2", &tex_coords),
            },
            "indices": self.indices(&indices),
            "material": material,
        })
    }

    /// A square tube from y = 0 to 1 that three joints hold.
    fn tube(&mut self, material: u32) -> Value {
        let (mut positions, mut normals, mut joints, mut weights) = (vec![], vec![], vec![], vec![]);
        let mut indices = Vec::new();
        for side in 0..4_u16 {
            let turn = Quat::from_rotation_y(f32::from(side) * 2.0 * FRAC_PI_4);
            let first = positions.len() as u16;
            for ring in 0..=RINGS {
                let y = f32::from(ring) / f32::from(RINGS);
                for x in [-0.15, 0.15] {
                    positions.push(turn * Vec3::new(x, y, 0.15));
                    normals.push(turn * Vec3::Z);
                    let share = (2.0 * y).fract();
                    let lower = ((2.0 * y) as u8).min(1);
                    joints.extend([lower, lower + 1, 0, 0]);
                    let upper = if y == 1.0 { 1.0 } else { share };
                    weights.push([1.0 - upper, upper, 0.0, 0.0]);
                }
            }
            for ring in 0..RINGS {
                indices.extend([0, 1, 3, 0, 3, 2].map(|corner| first + 2 * ring + corner));
            }
        }
        let count = positions.len();
        json!({
            "attributes": {
                "POSITION": self.points(&positions),
                "NORMAL": self.points(&normals),
                "JOINTS_0": self.accessor("VEC4", 5121, count, &joints),
                "WEIGHTS_0": self.floats("VEC4", &weights),
            },
            "indices": self.indices(&indices),
            "material": material,
        })
    }

    fn inverse_bind(&mut self) -> usize {
        let down = |y: f32| glam::Mat4::from_translation(Vec3::Y * -y).to_cols_array();
        self.floats("MAT4", &[down(0.0), down(0.5), down(1.0)])
    }

    /// A square with one or two morph targets.
    fn flag(&mut self, material: u32, targets: usize) -> Value {
        let square = quad(0.9, 0.9);
        let mut primitive = self.primitive(&square, Vec3::ZERO, material);
        let lift = [Vec3::ZERO, Vec3::new(0.0, 0.2, 0.4), Vec3::new(0.0, 0.2, 0.4), Vec3::ZERO];
        let pull = [Vec3::ZERO, Vec3::ZERO, Vec3::new(0.3, 0.3, 0.0), Vec3::new(-0.3, 0.3, 0.0)];
        let offsets = [lift, pull].into_iter().take(targets);
        primitive["targets"] = offsets.map(|list| json!({"POSITION": self.points(&list)})).collect();
        primitive
    }

    /// Two seconds in which knee and toe bend, the flag waves and the plate swings.
    fn animation(&mut self, targets: usize) -> Value {
        let times = self.floats("SCALAR", &[[0.0], [1.0], [2.0]]);
        self.accessors[times]["min"] = json!([0.0]);
        self.accessors[times]["max"] = json!([2.0]);
        let turn = |angle_rad: f32| Quat::from_rotation_z(angle_rad).to_array();
        let bend = self.floats("VEC4", &[turn(0.0), turn(0.9), turn(-0.3)]);
        let keys: Vec<[f32; 1]> = [0.25, 0.5, 1.0].iter().flat_map(|key| vec![[*key]; targets]).collect();
        let wave = self.floats("SCALAR", &keys);
        let swing = self.floats("VEC3", &[[0.0, 1.6, -0.4], [0.5, 1.4, 0.0], [-0.4, 1.7, -0.2]]);
        let channel = |sampler: u32, node: u32, path: &str| json!({"sampler": sampler, "target": {"node": node, "path": path}});
        json!({
            "name": "Wave",
            "samplers": [
                {"input": times, "output": bend},
                {"input": times, "output": wave},
                {"input": times, "output": swing},
            ],
            "channels": [
                channel(0, 6, "rotation"),
                channel(0, 7, "rotation"),
                channel(1, 3, "weights"),
                channel(2, 4, "translation"),
            ],
        })
    }
}
