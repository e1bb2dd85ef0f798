//! The document: node arena, assets, environment, and what changed since the last drain.
//! In: edits (`apply.rs`). Out: references to what is there, world transforms (`propagate.rs`), flat lists of
//! what is placed (`place.rs`). It knows no file and no device.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::DAffine3;

use crate::animation::ClipChoice;
use crate::assets::{Camera, Environment, Light, Material, Mesh, Texture};
use crate::changes::{ChangeSet, Content};
use crate::edit::shown;
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId, Target, TextureId};
use crate::node::{Node, NodeKind, RayVisibility};
use crate::package::MaterialEntry;
use crate::prefab::{PartNode, PartOverride, Prefab};
use crate::transform::Local;

mod apply;
mod apply_animation;
mod apply_instance;
mod apply_prefab;
mod apply_shapes;
mod apply_tree;
mod copies;
mod lock;
mod place;
mod pose;
mod pose_values;
mod propagate;
mod report;
mod surroundings;

pub use copies::Copies;
pub use place::{Placed, Renderable};
pub use pose::Driven;
use pose::Pose;
use surroundings::Surroundings;

/// Documents are merged up to this number: what is made after that has room up to where files are refused.
pub(crate) const MOST_MERGED_ID: u64 = 1 << 62;

/// A scene that is being edited. Cloning is cheap in vertices and texels, which are shared.
/// Equality compares what the user made, not the time that is shown, caches, pending changes or the id counter.
#[derive(Clone, Debug)]
pub struct Document {
    slots: BTreeMap<NodeId, Slot>,
    /// Parts of all instances.
    part_count: usize,
    /// Spheres and boxes of all meshes.
    shape_count: usize,
    roots: Vec<NodeId>,
    prefabs: BTreeMap<PrefabId, Prefab>,
    meshes: BTreeMap<MeshId, Mesh>,
    materials: BTreeMap<MaterialId, MaterialEntry>,
    textures: BTreeMap<TextureId, Texture>,
    environment: Environment,
    default_camera: Option<Target>,
    next_id: u64,
    /// Nodes at whose subtrees a transform or visibility changed; each has its `dirty` flag set.
    dirty: Vec<NodeId>,
    /// The same for parts inside instances.
    dirty_parts: BTreeSet<Target>,
    changes: ChangeSet,
    /// Targets that the reader of the changes knows.
    reported: BTreeSet<Target>,
    /// The time that is shown, seconds; `None`: everything is at rest.
    time_s: Option<f64>,
    /// Instances whose source has clips.
    animated: BTreeSet<NodeId>,
    surroundings: Surroundings,
    /// What the time that is shown says about materials.
    material_pose: BTreeMap<MaterialId, pose::Numbers>,
    /// The poses of instances say something else about materials than when that was made.
    material_pose_stale: bool,
    /// An edit is being undone: what it sets was in the document before, and need not fit what has become of it since.
    restoring: bool,
}

/// A node with what is derived from it.
#[derive(Clone, Debug)]
struct Slot {
    node: Node,
    /// World transform; stale while `dirty`.
    world: DAffine3,
    /// Whether it and everything above is visible; stale while `dirty`.
    shown: bool,
    /// Everything below a dirty node is dirty too.
    dirty: bool,
    parts: PartStates,
}

/// What is derived for the parts of an instance, by index of the part; empty for other nodes.
#[derive(Clone, Debug, Default)]
struct PartStates {
    worlds: Vec<DAffine3>,
    /// Transforms against the instance, so that moving it leaves them alone to the bit; empty without skins.
    in_instance: Vec<DAffine3>,
    shown: Vec<bool>,
    /// The overrides by index instead of by path; those without a part are left out.
    overrides: BTreeMap<u32, PartOverride>,
    /// What the variant of materials chooses, by mesh and primitive.
    varied: BTreeMap<(MeshId, u32), MaterialId>,
    /// What the time that is shown lays over them; instances in the same pose share it.
    pose: Arc<Pose>,
    /// Which parts the scene that is shown does not have; empty where it has all.
    absent: Vec<bool>,
}

impl PartStates {
    fn is_absent(&self, part: u32) -> bool {
        self.absent.get(part as usize).copied().unwrap_or(false)
    }
}

impl Default for Document {
    fn default() -> Self {
        Self::new()
    }
}

impl PartialEq for Document {
    fn eq(&self, other: &Self) -> bool {
        self.roots == other.roots
            && self.slots.len() == other.slots.len()
            && self.slots.iter().zip(&other.slots).all(|((a, x), (b, y))| a == b && x.node == y.node)
            && self.prefabs == other.prefabs
            && self.meshes == other.meshes
            && self.materials == other.materials
            && self.textures == other.textures
            && self.environment == other.environment
            && self.default_camera == other.default_camera
    }
}

impl Document {
    /// An empty document.
    pub fn new() -> Self {
        Self {
            slots: BTreeMap::new(),
            part_count: 0,
            shape_count: 0,
            roots: Vec::new(),
            prefabs: BTreeMap::new(),
            meshes: BTreeMap::new(),
            materials: BTreeMap::new(),
            textures: BTreeMap::new(),
            environment: Environment::Auto,
            default_camera: None,
            next_id: 1,
            dirty: Vec::new(),
            dirty_parts: BTreeSet::new(),
            changes: ChangeSet { environment: true, structure: true, ..ChangeSet::default() },
            reported: BTreeSet::new(),
            time_s: None,
            animated: BTreeSet::new(),
            surroundings: Surroundings::default(),
            material_pose: BTreeMap::new(),
            material_pose_stale: false,
            restoring: false,
        }
    }

    /// A number that no id of this document has had or will have.
    pub fn allocate_id(&mut self) -> u64 {
        let id = self.next_id;
        self.next_id = self.next_id.saturating_add(1);
        id
    }

    /// The number that [`Self::allocate_id`] gives next; projects keep it.
    pub fn next_id(&self) -> u64 {
        self.next_id
    }

    /// Makes sure that no id up to and including `id` is given out again.
    pub fn reserve_ids_up_to(&mut self, id: u64) {
        self.next_id = self.next_id.max(id.saturating_add(1));
    }

    /// Nodes without a parent, in the order of the outliner.
    pub fn roots(&self) -> &[NodeId] {
        &self.roots
    }

    /// A node.
    pub fn node(&self, id: NodeId) -> Option<&Node> {
        self.slots.get(&id).map(|slot| &slot.node)
    }

    /// All nodes in order of id.
    pub fn nodes(&self) -> impl Iterator<Item = (NodeId, &Node)> {
        self.slots.iter().map(|(id, slot)| (*id, &slot.node))
    }

    /// Number of nodes, parts of instances not counted.
    pub fn node_count(&self) -> usize {
        self.slots.len()
    }

    /// A prefab.
    pub fn prefab(&self, id: PrefabId) -> Option<&Prefab> {
        self.prefabs.get(&id)
    }

    /// All prefabs in order of id.
    pub fn prefabs(&self) -> impl Iterator<Item = (PrefabId, &Prefab)> {
        self.prefabs.iter().map(|(id, prefab)| (*id, prefab))
    }

    /// The prefab that a node instances.
    pub(crate) fn prefab_of(&self, node: NodeId) -> Option<PrefabId> {
        self.node(node)?.prefab()
    }

    /// A mesh.
    pub fn mesh(&self, id: MeshId) -> Option<&Mesh> {
        self.meshes.get(&id)
    }

    /// All meshes in order of id.
    pub fn meshes(&self) -> impl Iterator<Item = (MeshId, &Mesh)> {
        self.meshes.iter().map(|(id, mesh)| (*id, mesh))
    }

    /// A material.
    pub fn material(&self, id: MaterialId) -> Option<&Material> {
        self.materials.get(&id).map(|entry| &*entry.value)
    }

    /// A material with what its source says.
    pub fn material_entry(&self, id: MaterialId) -> Option<&MaterialEntry> {
        self.materials.get(&id)
    }

    /// All materials in order of id.
    pub fn materials(&self) -> impl Iterator<Item = (MaterialId, &Material)> {
        self.materials.iter().map(|(id, entry)| (*id, &*entry.value))
    }

    /// A texture.
    pub fn texture(&self, id: TextureId) -> Option<&Texture> {
        self.textures.get(&id)
    }

    /// All textures in order of id.
    pub fn textures(&self) -> impl Iterator<Item = (TextureId, &Texture)> {
        self.textures.iter().map(|(id, texture)| (*id, texture))
    }

    /// The environment as it was set; see [`Self::effective_environment`] for what surrounds the scene.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// The camera that renders when none is named, if one was chosen and is still there.
    pub fn default_camera(&self) -> Option<Target> {
        self.default_camera.filter(|&target| self.camera(target).is_some())
    }

    /// The choice of camera as it was made, also when that camera is gone.
    pub(crate) fn chosen_camera(&self) -> Option<Target> {
        self.default_camera
    }

    /// Whether the node, or the part inside its instance, is in the document, and in the scene that the instance shows.
    pub fn contains(&self, target: Target) -> bool {
        match target.part {
            None => self.slots.contains_key(&target.node),
            Some(_) => self.part(target).is_some() && !self.is_absent(target),
        }
    }

    /// The part as its prefab has it, without overrides.
    pub fn part(&self, target: Target) -> Option<&PartNode> {
        self.prefab(self.node(target.node)?.prefab()?)?.node(target.part?)
    }

    /// What the instance says differently about a part.
    pub fn part_override(&self, target: Target) -> Option<&PartOverride> {
        let slot = self.slots.get(&target.node)?;
        slot.parts.overrides.get(&target.part?)
    }

    /// Name of a node or part, overrides included; may be empty.
    pub fn name(&self, target: Target) -> Option<&str> {
        if target.part.is_none() {
            return self.node(target.node).map(|node| node.name.as_str());
        }
        let part = self.part(target)?;
        let renamed = self.part_override(target).and_then(|o| o.name.as_deref());
        Some(renamed.unwrap_or(&part.name))
    }

    /// A name to show: the own one, else that of the mesh, else what it is with its number.
    pub fn display_name(&self, target: Target) -> String {
        let own = self.name(target).unwrap_or_default();
        if !own.is_empty() {
            return own.to_owned();
        }
        let mesh = self.mesh_of(target).and_then(|id| self.mesh(id));
        match (mesh, target.part) {
            (Some(mesh), _) if !mesh.name.is_empty() => mesh.name.clone(),
            (_, Some(part)) => format!("part {part}"),
            (_, None) => shown("", "node", target.node.0),
        }
    }

    /// Transform against the parent, overrides included: what the document says, also while a time is shown
    /// (see [`Self::posed_local`]).
    pub fn local(&self, target: Target) -> Option<Local> {
        if target.part.is_none() {
            return self.node(target.node).map(|node| node.local);
        }
        let part = self.part(target)?;
        let moved = self.part_override(target).and_then(|o| o.local);
        Some(moved.unwrap_or(part.local))
    }

    /// The own visibility of a node or part, overrides included; parents may still hide it.
    pub fn visible(&self, target: Target) -> Option<bool> {
        if target.part.is_none() {
            return self.node(target.node).map(|node| node.visible);
        }
        let part = self.part(target)?;
        let set = self.part_override(target).and_then(|o| o.visible);
        Some(set.unwrap_or(part.visible))
    }

    /// Which rays meet the mesh of a node or part, overrides included.
    pub fn ray_visibility(&self, target: Target) -> Option<RayVisibility> {
        if target.part.is_none() {
            return self.node(target.node).map(|node| node.ray_visibility);
        }
        self.part(target)?;
        Some(self.part_override(target).and_then(|o| o.ray_visibility).unwrap_or_default())
    }

    /// Which clips an instance plays; the default for what is no instance.
    pub fn clip_of(&self, node: NodeId) -> ClipChoice {
        match self.node(node).map(|node| &node.kind) {
            Some(NodeKind::Prefab { clip, .. }) => *clip,
            _ => ClipChoice::default(),
        }
    }

    /// What a target hangs below: a part's parent part, or the instance for its topmost parts.
    pub fn parent_of(&self, target: Target) -> Option<Target> {
        match target.part {
            None => self.node(target.node)?.parent.map(Target::node),
            Some(_) => Some(Target { node: target.node, part: self.part(target)?.parent }),
        }
    }

    /// What hangs below a target: the parts of an instance first, then its child nodes.
    pub fn children_of(&self, target: Target) -> Vec<Target> {
        let Some(node) = self.node(target.node) else {
            return Vec::new();
        };
        let prefab = node.prefab().and_then(|id| self.prefab(id));
        let parts = prefab
            .into_iter()
            .flat_map(|prefab| prefab.children(target.part))
            .map(|part| Target::part(target.node, part))
            .filter(|&part| target.part.is_some() || !self.is_absent(part));
        let nodes = match target.part {
            None => node.children.as_slice(),
            Some(_) => &[],
        };
        parts.chain(nodes.iter().copied().map(Target::node)).collect()
    }

    /// Whether `target` is `above` or hangs somewhere below it.
    pub fn is_within(&self, target: Target, above: Target) -> bool {
        std::iter::successors(Some(target), |&t| self.parent_of(t)).any(|t| t == above)
    }

    /// The mesh that a target places.
    pub fn mesh_of(&self, target: Target) -> Option<MeshId> {
        match target.part {
            Some(_) => self.part(target)?.mesh,
            None => match self.node(target.node)?.kind {
                NodeKind::Mesh { mesh, .. } => Some(mesh),
                _ => None,
            },
        }
    }

    /// The light that a target is, overrides included.
    pub fn light_of(&self, target: Target) -> Option<Light> {
        match target.part {
            Some(_) => {
                let source = self.part(target)?.light?;
                let set = self.part_override(target).and_then(|o| o.light);
                Some(set.unwrap_or(source))
            }
            None => match self.node(target.node)?.kind {
                NodeKind::Light(light) => Some(light),
                _ => None,
            },
        }
    }

    /// The camera that a target is, overrides included.
    pub fn camera_of(&self, target: Target) -> Option<Camera> {
        match target.part {
            Some(_) => {
                let source = self.part(target)?.camera?;
                let set = self.part_override(target).and_then(|o| o.camera);
                Some(set.unwrap_or(source))
            }
            None => match self.node(target.node)?.kind {
                NodeKind::Camera(camera) => Some(camera),
                _ => None,
            },
        }
    }

    /// What a target brings into the picture.
    pub fn content_of(&self, target: Target) -> Content {
        match target.part {
            Some(_) if self.is_absent(target) => Content::default(),
            Some(_) => self.part(target).map(part_content).unwrap_or_default(),
            None => self.node(target.node).map(|node| node_content(&node.kind)).unwrap_or_default(),
        }
    }
}

/// The prefab that a node instances.
fn prefab_of<'a>(prefabs: &'a BTreeMap<PrefabId, Prefab>, slot: &Slot) -> Option<&'a Prefab> {
    prefabs.get(&slot.node.prefab()?)
}

fn node_content(kind: &NodeKind) -> Content {
    Content {
        mesh: matches!(kind, NodeKind::Mesh { .. }),
        light: matches!(kind, NodeKind::Light(_)),
        camera: matches!(kind, NodeKind::Camera(_)),
    }
}

fn part_content(part: &PartNode) -> Content {
    Content { mesh: part.mesh.is_some(), light: part.light.is_some(), camera: part.camera.is_some() }
}
