//! A scene with everything that a delta can tell of: a box of two primitives with a texture, a skinned and morphed body
//! that two skins bend and one part places without a skin, a lamp, a clip.

use std::path::PathBuf;
use std::sync::Arc;

use caustica_renderer::delta::{InstanceId, SceneDelta};
use caustica_scene::import::Imported;
use caustica_scene::{
    Animation, Channel, ChannelPath, Document, Edit, Environment, Interpolation, Light, LightKind, Local,
    Material, MaterialId, Mesh, MeshData, MeshId, MorphTarget, NodeId, PartNode, Prefab, PrefabId, Primitive,
    Sampler, Skin, SkinData, Target, Texture, TextureId, TextureUse,
};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

use super::super::{Sync, instance_id};

pub const BOX: u32 = 0;
pub const BODY: u32 = 1;
/// Placed by another skin, of more joints than the mesh names.
pub const TWIN: u32 = 2;
/// The same mesh without a skin.
pub const STATUE: u32 = 3;
pub const JOINT: u32 = 4;
pub const LAMP: u32 = 7;

/// A document, what the renderer holds of it, and the instance.
pub struct Rig {
    pub document: Document,
    pub sync: Sync,
    pub prefab: PrefabId,
    pub node: NodeId,
}

impl Rig {
    /// Not synced yet.
    pub fn unsynced() -> Self {
        Self::of(imported(body()))
    }

    /// One instance of a file, not synced yet.
    pub fn of(imported: Imported) -> Self {
        let mut document = Document::new();
        // What shines or not makes no difference to the surroundings.
        document.apply(Edit::SetEnvironment(Environment::Constant(Vec3::ONE))).unwrap();
        let prefab = document.add_imported(imported).unwrap();
        let (node, edit) = document.instantiate_edit(prefab, None, Local::default());
        document.apply(edit).unwrap();
        Self { document, sync: Sync::new(), prefab, node }
    }

    /// Synced once.
    pub fn new() -> Self {
        let mut rig = Self::unsynced();
        rig.delta();
        rig
    }

    /// Applies an edit; gives what it makes of the renderer, and what undoes it.
    pub fn apply(&mut self, edit: Edit) -> (SceneDelta, Edit) {
        let undo = self.document.apply(edit).unwrap();
        (self.delta(), undo)
    }

    pub fn delta(&mut self) -> SceneDelta {
        self.sync.delta(&mut self.document, DVec3::ZERO)
    }

    pub fn part(&self, part: u32) -> Target {
        Target::part(self.node, part)
    }

    pub fn id(&self, part: u32) -> InstanceId {
        instance_id(self.part(part))
    }

    pub fn mesh_of(&self, part: u32) -> MeshId {
        self.document.mesh_of(self.part(part)).unwrap()
    }
}

/// A triangle for each primitive, the primitives one after the other.
fn triangles(count: u32) -> MeshData {
    let vertices = count as usize * 3;
    MeshData {
        positions: [Vec3::ZERO, Vec3::X, Vec3::Y].repeat(count as usize),
        normals: vec![Vec3::Z; vertices],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); vertices],
        tex_coords0: vec![Vec2::ZERO; vertices],
        indices: (0..count * 3).collect(),
        ..MeshData::default()
    }
}

fn mesh(name: &str, data: MeshData, materials: &[u64]) -> Mesh {
    let primitive = |(index, material): (u32, &u64)| Primitive {
        first_index: index * 3,
        index_count: 3,
        material: MaterialId(*material),
        mesh_from_primitive: DAffine3::IDENTITY,
    };
    Mesh::new(name.to_owned(), Arc::new(data), (0..).zip(materials).map(primitive).collect())
}

/// Its last vertex follows joint 1, so that poses have two.
pub fn body() -> MeshData {
    let whole = [1.0, 0.0, 0.0, 0.0];
    MeshData {
        skin: Some(SkinData { joints: vec![[0; 4], [0; 4], [1, 0, 0, 0]], weights: vec![whole; 3] }),
        morph: vec![MorphTarget {
            name: String::from("smile"),
            positions: vec![Vec3::Z; 3],
            ..MorphTarget::default()
        }],
        ..triangles(1)
    }
}

pub fn imported(body: MeshData) -> Imported {
    let part = |name: &str, parent: Option<u32>| PartNode {
        name: name.to_owned(),
        parent,
        visible: true,
        ..PartNode::default()
    };
    let placed =
        |name: &str, mesh: u64, skin| PartNode { mesh: Some(MeshId(mesh)), skin, ..part(name, None) };
    let light =
        Light { color: Vec3::ONE, intensity: 2.0, kind: LightKind::Point { radius_m: 0.0, range_m: None } };
    let mut prefab = Prefab::new("rig", PathBuf::from("rig.gltf"));
    let nodes = vec![
        placed("box", 0, None),
        placed("body", 1, Some(0)),
        placed("twin", 1, Some(1)),
        placed("statue", 1, None),
        part("hip", None),
        part("knee", Some(JOINT)),
        part("toe", Some(JOINT + 1)),
        PartNode { light: Some(light), ..part("lamp", None) },
    ];
    prefab.set_nodes(nodes).unwrap();
    let skin = |joints: &[u32]| Skin {
        joints: joints.to_vec(),
        inverse_bind: vec![DAffine3::IDENTITY; joints.len()],
    };
    prefab.set_skins(vec![skin(&[JOINT, JOINT + 1]), skin(&[JOINT + 1, JOINT + 2, JOINT])]);
    prefab.animations = vec![Arc::new(Animation::new("walk", vec![moves(JOINT), moves(BOX)]))];
    let texture = Texture {
        name: String::from("white"),
        width: 1,
        height: 1,
        rgba8: vec![255; 4].into(),
        srgb: true,
        sampler: Sampler::default(),
        placeholder: false,
        encoded: None,
    };
    let textured =
        Material { base_color_texture: Some(TextureUse::new(TextureId(0))), ..Material::default() };
    Imported {
        prefab,
        meshes: vec![mesh("box", triangles(2), &[0, 1]), mesh("body", body, &[0])],
        materials: vec![Material::default(), textured],
        textures: vec![texture],
        warnings: Vec::new(),
    }
}

/// One metre along X in two seconds.
fn moves(part: u32) -> Channel {
    Channel {
        part,
        path: ChannelPath::Translation,
        interpolation: Interpolation::Linear,
        times_s: [0.0, 2.0].into(),
        values: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0].into(),
    }
}

/// The lists of a delta that hold anything, with their lengths.
pub fn filled(delta: &SceneDelta) -> Vec<(&'static str, usize)> {
    let lists = [
        ("meshes", delta.meshes.len()),
        ("removed meshes", delta.removed_meshes.len()),
        ("textures", delta.textures.len()),
        ("removed textures", delta.removed_textures.len()),
        ("materials", delta.materials.len()),
        ("removed materials", delta.removed_materials.len()),
        ("instances", delta.instances.len()),
        ("transforms", delta.transforms.len()),
        ("visibility", delta.visibility.len()),
        ("primitives", delta.primitive_transforms.len()),
        ("poses", delta.poses.len()),
        ("removed instances", delta.removed_instances.len()),
        ("lights", delta.lights.len()),
        ("removed lights", delta.removed_lights.len()),
        ("environment", usize::from(delta.environment.is_some())),
        ("origin", usize::from(delta.render_origin_changed)),
    ];
    lists.into_iter().filter(|(_, length)| *length > 0).collect()
}
