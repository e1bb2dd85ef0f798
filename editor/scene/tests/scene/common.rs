//! A small scene that the tests share: one prefab of four parts, placed twice, beside nodes of every kind.

use std::path::Path;

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{
    Camera, Document, Light, LightKind, Local, Node, NodeId, NodeKind, PrefabId, Target, Trs,
};
use glam::{DQuat, DVec3, Vec3};

/// Two triangles with two materials below a turned node, a lamp and a camera.
const MODEL: &str = r#"{"asset":{"version":"2.0"},
 "extensionsUsed":["KHR_lights_punctual"],
 "extensions":{"KHR_lights_punctual":{"lights":[
   {"type":"point","intensity":100,"color":[1,0.5,0.25],"extras":{"radius":0.25}}]}},
 "nodes":[
  {"name":"Root","translation":[1,0,0],"children":[1,2]},
  {"name":"Arm","rotation":[0,0,0.6,0.8],"children":[3]},
  {"name":"Lamp","translation":[0,3,0],"extensions":{"KHR_lights_punctual":{"light":0}}},
  {"name":"Plate","scale":[2,2,2],"mesh":0,"camera":0}],
 "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}],
 "materials":[{"name":"Red","pbrMetallicRoughness":{"baseColorFactor":[0.8,0.1,0.1,1]}},
  {"name":"Glow","emissiveFactor":[1,1,1]}],
 "meshes":[{"name":"Plates","primitives":[
  {"attributes":{"POSITION":0},"material":0},{"attributes":{"POSITION":0},"material":1}]}],
 "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
 "bufferViews":[{"buffer":0,"byteLength":36}],
 "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

/// Writes the model into a folder and imports it.
pub fn model(folder: &Path) -> Imported {
    let path = folder.join("model.gltf");
    std::fs::write(&path, MODEL).unwrap();
    load(&path, &ImportOptions::default()).unwrap()
}

/// The scene and the ids of what is in it.
pub struct Scene {
    pub document: Document,
    pub prefab: PrefabId,
    pub group: NodeId,
    pub first: NodeId,
    pub second: NodeId,
    pub light: NodeId,
    pub camera: NodeId,
}

impl Scene {
    /// Part `k` of the first instance.
    pub fn part(&self, k: u32) -> Target {
        Target::part(self.first, k)
    }
}

/// Parts of the model in depth-first order.
pub const ARM: u32 = 1;
pub const PLATE: u32 = 2;
pub const LAMP: u32 = 3;

pub fn trs(x: f64, angle_rad: f64, scale: f64) -> Local {
    Local::Trs(Trs {
        translation: DVec3::new(x, 0.5, -2.0),
        rotation: DQuat::from_rotation_y(angle_rad),
        scale: DVec3::new(scale, 1.0, 2.0),
    })
}

/// Builds the scene.
pub fn scene(folder: &Path) -> Scene {
    let mut document = Document::new();
    let prefab = document.add_imported(model(folder)).unwrap();
    let mut add = |node: Node, parent| {
        let (id, edit) = document.add_edit(node, parent);
        document.apply(edit).unwrap();
        id
    };
    let group = add(Node::new("Group", NodeKind::Group).with_local(trs(10.0, 0.3, 1.5)), None);
    let instance = || NodeKind::Prefab { prefab, overrides: Default::default() };
    let first = add(Node::new("First", instance()), Some(group));
    let second = add(Node::new("Second", instance()).with_local(trs(-3.0, 1.0, 1.0)), None);
    let light =
        Light { color: Vec3::ONE, intensity: 2.0, kind: LightKind::Directional { angular_radius_rad: 0.01 } };
    let light = add(Node::new("Sun", NodeKind::Light(light)), Some(group));
    let camera = add(Node::new("Eye", NodeKind::Camera(Camera::default())), None);
    Scene { document, prefab, group, first, second, light, camera }
}
