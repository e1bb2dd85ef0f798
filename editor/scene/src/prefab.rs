//! A prefab: the node tree of one imported file, flat and in depth-first order.
//! Instances in the document refer to it and lay overrides over its parts, keyed by [`PartPath`].
//! It knows neither the document nor the format of its file.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use glam::DAffine3;
use serde::{Deserialize, Serialize};

use crate::animation::{Animation, Channel, ChannelPath};
use crate::assets::{Camera, Environment, Light};
use crate::foreign::Foreign;
use crate::ids::{MaterialId, MeshId, TextureId};
use crate::node::RayVisibility;
use crate::package::AssetNames;
use crate::transform::Local;

pub(crate) mod scenes;

pub use scenes::SourceScene;

/// One node of an imported file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartNode {
    /// Name in the file; may be empty.
    pub name: String,
    /// Index of the parent in the same list; `None`: a root. Parents come before children.
    pub parent: Option<u32>,
    /// Transform against the parent.
    pub local: Local,
    /// False: hidden in the file.
    pub visible: bool,
    /// The mesh it places.
    pub mesh: Option<MeshId>,
    /// The light it carries.
    pub light: Option<Light>,
    /// The camera it carries.
    pub camera: Option<Camera>,
    /// Index of the skin that bends its mesh. Its mesh then stands in the space of the instance: only the joints
    /// move it, not the part's own transform (glTF 2.0, section 3.7.3.3).
    pub skin: Option<u32>,
    /// Weights of the morph targets of its mesh; `None`: those of the mesh.
    pub weights: Option<Vec<f32>>,
}

/// Parts that bend the meshes of other parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// Indices of the parts that are joints.
    pub joints: Vec<u32>,
    /// From the space of the mesh to that of the joint when nothing is bent, one a joint.
    pub inverse_bind: Vec<DAffine3>,
}

/// Where a part stands in its source: names from the root, joined by `/`. The n-th further sibling of
/// the same name is marked `#n`; `/`, `#` and `%` inside names are percent-encoded. Reordering
/// differently named siblings, and adding nodes, leave the paths of the others as they were.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PartPath(pub String);

impl fmt::Display for PartPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// What an instance says differently from its prefab about one part; `None` follows the prefab.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartOverride {
    /// Name.
    pub name: Option<String>,
    /// Transform against the parent part.
    pub local: Option<Local>,
    /// Visibility.
    pub visible: Option<bool>,
    /// Materials by index of the primitive.
    pub materials: BTreeMap<u32, MaterialId>,
    /// The light's values; only where the source has a light.
    pub light: Option<Light>,
    /// The camera's values; only where the source has a camera.
    pub camera: Option<Camera>,
    /// Weights of the morph targets.
    pub weights: Option<Vec<f32>>,
    /// Which rays meet it.
    pub ray_visibility: Option<RayVisibility>,
}

impl PartOverride {
    /// Whether nothing differs from the prefab.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.local.is_none_or(|local| local.is_finite())
            && self.light.is_none_or(|light| light.is_finite())
            && self.camera.is_none_or(|camera| camera.is_finite())
            && self.weights.iter().flatten().all(|weight| weight.is_finite())
    }
}

/// An imported file in the document.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prefab {
    /// Shown in the outliner.
    pub name: String,
    /// The file it came from.
    pub source: PathBuf,
    /// Its meshes in the order of the file.
    pub meshes: Vec<MeshId>,
    /// Its materials in the order of the file.
    pub materials: Vec<MaterialId>,
    /// Its textures in the order of import.
    pub textures: Vec<TextureId>,
    /// The environment that the file asks for, in the scene that is shown where none is chosen.
    pub environment: Option<Environment>,
    /// True: the file could not be read; the prefab stands for it so that nothing is lost on save.
    pub missing: bool,
    /// Its clips in the order of the file.
    pub animations: Vec<Arc<Animation>>,
    /// What its file says and the program does not know.
    pub(crate) foreign: Arc<Foreign>,
    /// Names of its assets in its file.
    pub(crate) asset_names: Arc<AssetNames>,
    scenes: Vec<SourceScene>,
    default_scene: usize,
    nodes: Vec<PartNode>,
    // The same for all prefabs of a file.
    subtree_end: Arc<[u32]>,
    segments: Arc<[String]>,
    /// Parts in order of parent and segment.
    by_segment: Arc<[u32]>,
    skins: Vec<Skin>,
    /// Which skins a part is a joint of.
    skins_of_joint: BTreeMap<u32, Vec<u32>>,
    /// Which parts a skin bends.
    parts_of_skin: BTreeMap<u32, Vec<u32>>,
}

/// Why a list of parts is not a tree in depth-first order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("part {part} does not follow its parent in depth-first order")]
pub struct PartOrderError {
    /// Index of the part at fault.
    pub part: usize,
}

impl Prefab {
    /// A prefab without parts.
    pub fn new(name: impl Into<String>, source: impl Into<PathBuf>) -> Self {
        Self { name: name.into(), source: source.into(), ..Self::default() }
    }

    /// The parts, parents before children, every subtree in one run.
    pub fn nodes(&self) -> &[PartNode] {
        &self.nodes
    }

    /// Part by index.
    pub fn node(&self, part: u32) -> Option<&PartNode> {
        self.nodes.get(part as usize)
    }

    /// Replaces the parts.
    ///
    /// # Errors
    /// When the list is not in depth-first order.
    pub fn set_nodes(&mut self, nodes: Vec<PartNode>) -> Result<(), PartOrderError> {
        self.subtree_end = subtree_ends(&nodes)?.into();
        self.segments = path_segments(&nodes).into();
        self.nodes = nodes;
        let mut by_segment: Vec<u32> = (0..self.nodes.len() as u32).collect();
        by_segment.sort_unstable_by(|a, b| self.parent_and_segment(*a).cmp(&self.parent_and_segment(*b)));
        self.by_segment = by_segment.into();
        self.index_skins();
        Ok(())
    }

    /// The skins that parts name.
    pub fn skins(&self) -> &[Skin] {
        &self.skins
    }

    /// Replaces the skins.
    pub fn set_skins(&mut self, skins: Vec<Skin>) {
        self.skins = skins;
        self.index_skins();
    }

    /// The skin that bends the mesh of a part.
    pub fn skin_of(&self, part: u32) -> Option<&Skin> {
        let node = self.node(part)?;
        node.mesh?;
        self.skins.get(node.skin? as usize)
    }

    /// The parts whose meshes are bent by a part.
    pub(crate) fn bent_by(&self, joint: u32) -> impl Iterator<Item = u32> + '_ {
        let skins = self.skins_of_joint.get(&joint).into_iter().flatten();
        skins.filter_map(|skin| self.parts_of_skin.get(skin)).flatten().copied()
    }

    fn index_skins(&mut self) {
        (self.skins_of_joint, self.parts_of_skin) = Default::default();
        for (skin, joint) in
            self.skins.iter().zip(0..).flat_map(|(s, i)| s.joints.iter().map(move |&j| (i, j)))
        {
            let skins = self.skins_of_joint.entry(joint).or_default();
            // A skin may name a joint twice.
            if skins.last() != Some(&skin) {
                skins.push(skin);
            }
        }
        for (part, node) in (0..).zip(&self.nodes) {
            if let Some(skin) = node.skin {
                self.parts_of_skin.entry(skin).or_default().push(part);
            }
        }
    }

    /// Whether anything in it can move by itself.
    pub fn is_animated(&self) -> bool {
        self.animations.iter().any(|clip| !clip.channels.is_empty())
    }

    /// Puts other ids in place of the materials that clips change.
    pub(crate) fn map_animated_materials(&mut self, map: impl Fn(MaterialId) -> MaterialId) {
        let changes_material = |channel: &Channel| matches!(channel.path, ChannelPath::Material(..));
        for clip in self.animations.iter_mut().filter(|clip| clip.channels.iter().any(changes_material)) {
            for channel in &mut Arc::make_mut(clip).channels {
                if let ChannelPath::Material(material, _) = &mut channel.path {
                    *material = map(*material);
                }
            }
        }
    }

    /// The meshes that its file has or once had.
    pub(crate) fn all_meshes(&self) -> impl Iterator<Item = MeshId> + '_ {
        let gone = self.asset_names.meshes.gone.iter().map(|(id, _)| MeshId(*id));
        self.meshes.iter().copied().chain(gone)
    }

    /// Puts other mesh ids in place.
    pub(crate) fn map_meshes(&mut self, map: impl Fn(MeshId) -> MeshId) {
        for mesh in self.nodes.iter_mut().filter_map(|node| node.mesh.as_mut()) {
            *mesh = map(*mesh);
        }
    }

    /// One past the last part of the subtree of `part`, which is the run `part..end`.
    pub fn subtree_end(&self, part: u32) -> u32 {
        self.subtree_end.get(part as usize).copied().unwrap_or(part.saturating_add(1))
    }

    /// Children of a part, or the roots for `None`, in order.
    pub fn children(&self, parent: Option<u32>) -> impl Iterator<Item = u32> + '_ {
        let (first, end) = match parent {
            Some(part) => (part.saturating_add(1), self.subtree_end(part)),
            None => (0, self.nodes.len() as u32),
        };
        std::iter::successors((first < end).then_some(first), move |&child| {
            let next = self.subtree_end(child);
            (next < end).then_some(next)
        })
    }

    /// The path of a part in its source.
    pub fn path_of(&self, part: u32) -> Option<PartPath> {
        let mut names = Vec::new();
        let mut at = Some(part);
        while let Some(index) = at {
            names.push(self.segments.get(index as usize)?.as_str());
            at = self.nodes.get(index as usize)?.parent;
        }
        names.reverse();
        Some(PartPath(names.join("/")))
    }

    /// The part at a path, if the source still has it.
    pub fn part_at(&self, path: &PartPath) -> Option<u32> {
        let mut at = None;
        for segment in path.0.split('/') {
            let wanted = (at, Some(segment));
            let found = self.by_segment.binary_search_by(|part| self.parent_and_segment(*part).cmp(&wanted));
            at = Some(*self.by_segment.get(found.ok()?)?);
        }
        at
    }

    /// No two parts have both in common.
    fn parent_and_segment(&self, part: u32) -> (Option<u32>, Option<&str>) {
        let parent = self.node(part).and_then(|node| node.parent);
        (parent, self.segments.get(part as usize).map(String::as_str))
    }
}

fn subtree_ends(nodes: &[PartNode]) -> Result<Vec<u32>, PartOrderError> {
    let mut ends: Vec<u32> = (1..=nodes.len() as u32).collect();
    let mut open: Vec<u32> = Vec::new();
    for (part, node) in nodes.iter().enumerate() {
        while open.last().copied() != node.parent {
            let Some(closed) = open.pop() else {
                return Err(PartOrderError { part });
            };
            if let Some(end) = ends.get_mut(closed as usize) {
                *end = part as u32;
            }
        }
        open.push(part as u32);
    }
    for still_open in open {
        if let Some(end) = ends.get_mut(still_open as usize) {
            *end = nodes.len() as u32;
        }
    }
    Ok(ends)
}

fn path_segments(nodes: &[PartNode]) -> Vec<String> {
    let mut seen: HashMap<(Option<u32>, &str), u32> = HashMap::new();
    nodes
        .iter()
        .map(|node| {
            let count = seen.entry((node.parent, node.name.as_str())).or_insert(0);
            let nth = *count;
            *count += 1;
            let name = node.name.replace('%', "%25").replace('/', "%2F").replace('#', "%23");
            if nth == 0 { name } else { format!("{name}#{nth}") }
        })
        .collect()
}
