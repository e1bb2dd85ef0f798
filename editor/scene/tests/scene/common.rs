//! A small scene that the tests share: one prefab of four parts, placed twice, beside nodes of every kind.

use std::path::{Path, PathBuf};

use caustica_scene::import::{ImportOptions, Imported, load};
use caustica_scene::{
    Camera, Document, Light, LightKind, Local, MeshData, Node, NodeId, NodeKind, PrefabId, Target, Trs,
};
use glam::{DQuat, DVec3, Vec3, Vec4};

/// A folder or file of the shared assets, or `None` with a note.
pub fn assets(part: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/assets");
    let path = root.join(part).canonicalize();
    if path.is_err() {
        println!("skipped: {part} is absent from {}", root.display());
    }
    path.ok()
}

/// A generator that gives the same numbers everywhere (Knuth's MMIX constants).
pub struct Numbers(pub u64);

impl Numbers {
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % limit
    }
}

/// What [`MeshData`] and the other parts of an import promise.
pub fn assert_sound(path: &Path, imported: &Imported) {
    for mesh in &imported.meshes {
        let data = &mesh.data;
        let count = data.positions.len();
        assert_eq!(data.normals.len(), count, "{}", path.display());
        assert_eq!(data.tangents.len(), count, "{}", path.display());
        assert_eq!(data.tex_coords0.len(), count, "{}", path.display());
        assert!([0, count].contains(&data.tex_coords1.len()), "{}", path.display());
        assert!([0, count].contains(&data.colors.len()), "{}", path.display());
        assert!(data.positions.iter().all(|p| p.is_finite()), "{}", path.display());
        let unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-4;
        assert!(data.normals.iter().all(|&n| unit(n)), "{}", path.display());
        let whole = |t: &Vec4| unit(t.truncate()) && t.w.abs() == 1.0;
        assert!(data.tangents.iter().all(whole), "{}", path.display());
        assert!(data.indices.iter().all(|&i| (i as usize) < count), "{}", path.display());
        let end = mesh.primitives.last().map_or(0, |p| p.first_index + p.index_count);
        assert_eq!(end as usize, data.indices.len(), "{}", path.display());
        assert_deforms_soundly(path, data);
        assert_eq!(mesh.default_weights.len(), data.morph.len(), "{}", path.display());
        for primitive in &mesh.primitives {
            assert!(primitive.index_count > 0, "{}", path.display());
            let material = primitive.material.0 as usize;
            assert!(material < imported.materials.len(), "{}", path.display());
        }
    }
    assert_skins_fit(path, imported);
    for material in &imported.materials {
        assert!(material.is_finite(), "{}", path.display());
        let inside = |id: u64| (id as usize) < imported.textures.len();
        assert!(material.textures().all(|t| inside(t.texture.0)), "{}", path.display());
    }
    for texture in &imported.textures {
        let bytes = texture.width as usize * texture.height as usize * 4;
        assert_eq!(texture.rgba8.len(), bytes, "{}", path.display());
    }
}

fn assert_deforms_soundly(path: &Path, data: &MeshData) {
    let count = data.positions.len();
    if let Some(skin) = &data.skin {
        assert_eq!((skin.joints.len(), skin.weights.len()), (count, count), "{}", path.display());
        for (joints, weights) in skin.joints.iter().zip(&skin.weights) {
            let sum: f32 = weights.iter().sum();
            assert!(sum == 0.0 || (sum - 1.0).abs() < 1e-6, "{}: {weights:?}", path.display());
            let tidy = |(joint, weight): (&u16, &f32)| *weight > 0.0 || (*weight == 0.0 && *joint == 0);
            assert!(joints.iter().zip(weights).all(tidy), "{}: {joints:?} {weights:?}", path.display());
        }
    }
    for target in &data.morph {
        for deltas in [&target.positions, &target.normals, &target.tangents] {
            assert!([0, count].contains(&deltas.len()), "{}", path.display());
            assert!(deltas.iter().all(|d| d.is_finite()), "{}", path.display());
        }
    }
}

fn assert_skins_fit(path: &Path, imported: &Imported) {
    let prefab = &imported.prefab;
    let parts = prefab.nodes().len() as u32;
    for skin in prefab.skins() {
        assert_eq!(skin.joints.len(), skin.inverse_bind.len(), "{}", path.display());
        assert!(skin.joints.iter().all(|&joint| joint < parts), "{}", path.display());
    }
    for (part, node) in (0..).zip(prefab.nodes()) {
        let Some(skin) = prefab.skin_of(part) else { continue };
        let mesh = &imported.meshes[node.mesh.unwrap().0 as usize];
        let joints = &mesh.data.skin.as_ref().unwrap().joints;
        let inside = |&joint: &u16| (joint as usize) < skin.joints.len();
        assert!(joints.iter().flatten().all(inside), "{}", path.display());
    }
    for channel in prefab.animations.iter().flat_map(|clip| &clip.channels) {
        assert!(channel.part < parts && channel.width() > 0, "{}", path.display());
        assert!(channel.times_s.array_windows::<2>().all(|[a, b]| a < b), "{}", path.display());
        assert!(channel.values.iter().all(|value| value.is_finite()), "{}", path.display());
    }
}

/// Two triangles with two materials, which a variant exchanges for one, below a turned node, a lamp and a camera.
const MODEL: &str = r#"{"asset":{"version":"2.0"},
 "extensionsUsed":["KHR_lights_punctual","KHR_materials_variants"],
 "extensions":{"KHR_materials_variants":{"variants":[{"name":"plain"},{"name":"glowing"}]},"KHR_lights_punctual":{"lights":[
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
  {"attributes":{"POSITION":0},"material":0,"extensions":{"KHR_materials_variants":{"mappings":[
   {"material":0,"variants":[0]},{"material":1,"variants":[1]}]}}},{"attributes":{"POSITION":0},"material":1}]}],
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
    let instance = || NodeKind::instance_of(prefab);
    let first = add(Node::new("First", instance()), Some(group));
    let second = add(Node::new("Second", instance()).with_local(trs(-3.0, 1.0, 1.0)), None);
    let light =
        Light { color: Vec3::ONE, intensity: 2.0, kind: LightKind::Directional { angular_radius_rad: 0.01 } };
    let light = add(Node::new("Sun", NodeKind::Light(light)), Some(group));
    let camera = add(Node::new("Eye", NodeKind::Camera(Camera::default())), None);
    Scene { document, prefab, group, first, second, light, camera }
}
