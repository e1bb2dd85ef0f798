//! The nodes of the file in depth-first order. In: a document. Out: who stands where, and which mesh each places.
//! Walks deep trees without recursion; knows no JSON.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DQuat, Quat};

use super::animation::moved_parts;
use super::mesh::{MeshKey, Meshes};
use super::shear;
use crate::document::Document;
use crate::ids::{MeshId, NodeId, PrefabId, Target};
use crate::import::gltf::unit_rotation;
use crate::node::NodeKind;
use crate::transform::Local;

/// Fine enough that no rounding to single precision falls between two lengths, and far enough for what is rounded.
const LENGTH_STEP: f64 = 1.0 / (1 << 27) as f64;
const MOST_STEPS: i32 = 32;

/// What a node of the file stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stands {
    /// A node or part.
    For(Target),
    /// One primitive of its mesh that was moved inside the mesh, for which glTF has no word.
    ForPrimitive(Target, u32),
    /// Half of the transform, with shear, of the node or primitive that is its only child.
    Around(Target, Option<u32>),
}

impl Stands {
    fn target(self) -> Target {
        match self {
            Self::For(target) | Self::ForPrimitive(target, _) | Self::Around(target, _) => target,
        }
    }
}

/// One node of the file.
pub(super) struct Entry {
    pub stands: Stands,
    pub children: Vec<usize>,
    pub mesh: Option<MeshKey>,
    /// Parts that are written as GPU instances of its mesh.
    pub instances: Vec<Target>,
}

/// All nodes of the file.
#[derive(Default)]
pub(super) struct Tree {
    pub entries: Vec<Entry>,
    pub roots: Vec<usize>,
    /// Places of nodes and parts.
    pub places: BTreeMap<Target, usize>,
    /// Places of the nodes around those that have shear.
    around: BTreeMap<Target, usize>,
    /// Parts whose transforms clips move: each is one node with translation, rotation and scale.
    pub moving: BTreeSet<Target>,
    /// The only root, when it places a file as it is: its parts are the roots, those that are not shown too.
    pub whole: Option<(NodeId, PrefabId)>,
    /// Instances of prefabs in order.
    pub instances: Vec<(NodeId, PrefabId)>,
}

impl Tree {
    pub fn of(document: &Document, meshes: &Meshes<'_>) -> Self {
        let mut tree = Self { whole: whole_file(document), ..Self::default() };
        let tops: Vec<Target> = match tree.whole {
            Some((node, prefab)) => {
                tree.add_instance(document, node, prefab);
                let roots = document.prefab(prefab).into_iter().flat_map(|prefab| prefab.children(None));
                let roots = roots.map(|part| Target::part(node, part));
                let (absent, present): (Vec<_>, Vec<_>) = roots.partition(|root| document.is_absent(*root));
                present.into_iter().chain(absent).collect()
            }
            None => document.roots().iter().copied().map(Target::node).collect(),
        };
        let mut stack: Vec<(Stands, Option<usize>)> =
            tops.into_iter().rev().map(|target| (Stands::For(target), None)).collect();
        while let Some((stands, mut parent)) = stack.pop() {
            if let Stands::For(target @ Target { part: None, .. }) = stands
                && let Some(prefab) = document.prefab_of(target.node)
            {
                tree.add_instance(document, target.node, prefab);
            }
            if let Some(around) = tree.around(document, stands) {
                parent = Some(tree.push(document, around, parent));
            }
            let place = tree.push(document, stands, parent);
            let Some(entry) = tree.entries.get_mut(place) else { continue };
            match stands {
                Stands::For(target) => {
                    stack.extend(below(document, meshes, target, entry).map(|s| (s, Some(place))));
                }
                Stands::ForPrimitive(target, primitive) => {
                    entry.mesh = key(document, meshes, target, false, |p| p == primitive);
                }
                Stands::Around(..) => {}
            }
        }
        tree
    }

    fn add_instance(&mut self, document: &Document, node: NodeId, prefab: PrefabId) {
        self.instances.push((node, prefab));
        self.moving.extend(moved_parts(document, node, prefab));
    }

    /// Adds a node without content; returns its place.
    fn push(&mut self, document: &Document, stands: Stands, parent: Option<usize>) -> usize {
        let place = self.entries.len();
        match (parent.and_then(|parent| self.entries.get_mut(parent)), stands.target()) {
            (Some(parent), _) => parent.children.push(place),
            (None, target) if document.is_absent(target) => {}
            (None, _) => self.roots.push(place),
        }
        match stands {
            Stands::For(target) => _ = self.places.insert(target, place),
            Stands::Around(target, None) => _ = self.around.insert(target, place),
            Stands::ForPrimitive(..) | Stands::Around(..) => {}
        }
        self.entries.push(Entry { stands, children: Vec::new(), mesh: None, instances: Vec::new() });
        place
    }

    /// What has to stand around something with shear.
    fn around(&self, document: &Document, stands: Stands) -> Option<Stands> {
        let (target, primitive) = match stands {
            Stands::For(target) if !self.moving.contains(&target) => (target, None),
            Stands::ForPrimitive(target, primitive) => (target, Some(primitive)),
            Stands::For(_) | Stands::Around(..) => return None,
        };
        shear::two_nodes(&local_of(document, target, primitive)).map(|_| Stands::Around(target, primitive))
    }

    /// The place of the outermost node that stands for a target.
    pub fn top_of(&self, target: Target) -> Option<usize> {
        self.around.get(&target).or_else(|| self.places.get(&target)).copied()
    }

    /// The prefab of an instance.
    pub fn prefab_of(&self, node: NodeId) -> Option<PrefabId> {
        self.instances.iter().find(|(instance, _)| *instance == node).map(|(_, prefab)| *prefab)
    }

    /// The prefabs that are placed, in order.
    pub fn prefabs(&self) -> Vec<PrefabId> {
        let mut seen = BTreeSet::new();
        self.instances.iter().map(|(_, prefab)| *prefab).filter(|prefab| seen.insert(*prefab)).collect()
    }
}

/// The transform of a node or part, or of a primitive in its mesh.
pub(super) fn local_of(document: &Document, target: Target, primitive: Option<u32>) -> Local {
    let Some(primitive) = primitive else { return document.local(target).unwrap_or_default() };
    let mesh = document.mesh_of(target).and_then(|id| document.mesh(id));
    let placed = mesh.and_then(|mesh| mesh.primitives.get(primitive as usize));
    placed.map_or_else(Local::default, |placed| Local::from_affine(placed.mesh_from_primitive))
}

/// The only root, when it places a file as it is: then its parts are the roots, and a model that is opened and exported
/// gets no node more.
fn whole_file(document: &Document) -> Option<(NodeId, PrefabId)> {
    let [root] = document.roots() else { return None };
    let node = document.node(*root)?;
    let plain = node.visible && node.children.is_empty() && node.local == Local::default();
    let prefab = node.prefab().filter(|id| document.prefab(*id).is_some_and(|p| !p.nodes().is_empty()))?;
    plain.then_some((*root, prefab))
}

/// Gives an entry its mesh; returns what hangs below it, the last first.
fn below(
    document: &Document,
    meshes: &Meshes<'_>,
    target: Target,
    entry: &mut Entry,
) -> impl Iterator<Item = Stands> + use<> {
    let moved = moved_primitives(document, meshes, target);
    entry.mesh = key(document, meshes, target, true, |p| !moved.contains(&p));
    let mut children = document.children_of(target);
    if let Some(count) = gpu_instances(document, meshes, target) {
        entry.instances = children.drain(..count).collect();
        entry.mesh = entry.instances.first().and_then(|first| key(document, meshes, *first, true, |_| true));
    }
    let primitives = moved.into_iter().map(move |primitive| Stands::ForPrimitive(target, primitive));
    children.into_iter().rev().map(Stands::For).chain(primitives.rev())
}

/// The mesh of the file for some primitives of the mesh of a target, and its points and lines if `loose`; `None` for none.
fn key(
    document: &Document,
    meshes: &Meshes<'_>,
    target: Target,
    loose: bool,
    wanted: impl Fn(u32) -> bool,
) -> Option<MeshKey> {
    let id = document.mesh_of(target).or_else(|| loose_mesh(document, target).filter(|_| loose))?;
    let (mesh, loose) = (meshes.get(id)?, loose && meshes.has_loose(id));
    let with_triangles = (0..).zip(&mesh.primitives).filter(|(_, primitive)| primitive.index_count > 0);
    let primitives: Vec<u32> = with_triangles.map(|(number, _)| number).filter(|p| wanted(*p)).collect();
    let materials = document.materials_of(target, mesh);
    (loose || !primitives.is_empty()).then_some(MeshKey { mesh: id, primitives, materials, loose })
}

/// The mesh of a part that places nothing but points and lines.
fn loose_mesh(document: &Document, target: Target) -> Option<MeshId> {
    let prefab = document.prefab(document.prefab_of(target.node)?)?;
    let place = prefab.foreign.loose_parts.get(&target.part?)?;
    prefab.meshes.get(*place).copied()
}

/// A mesh of a source that no part places, as a whole.
pub(super) fn unplaced(meshes: &Meshes<'_>, id: MeshId) -> Option<MeshKey> {
    let (mesh, loose) = (meshes.get(id)?, meshes.has_loose(id));
    let with_triangles = (0..).zip(&mesh.primitives).filter(|(_, primitive)| primitive.index_count > 0);
    let primitives: Vec<u32> = with_triangles.map(|(number, _)| number).collect();
    let materials = mesh.primitives.iter().map(|primitive| primitive.material).collect();
    (loose || !primitives.is_empty()).then_some(MeshKey { mesh: id, primitives, materials, loose })
}

/// Primitives that get nodes of their own. None of a mesh that a skin bends: the node of such a mesh places nothing.
fn moved_primitives(document: &Document, meshes: &Meshes<'_>, target: Target) -> Vec<u32> {
    let mesh = document.mesh_of(target).and_then(|id| meshes.get(id));
    let Some(mesh) = mesh.filter(|_| document.part(target).is_none_or(|part| part.skin.is_none())) else {
        return Vec::new();
    };
    let moved = (0..).zip(&mesh.primitives).filter(|(_, p)| p.mesh_from_primitive != DAffine3::IDENTITY);
    moved.map(|(number, _)| number).collect()
}

/// How many of the first children are still the GPU instances that they were in the file, and can be written as such
/// without loss: their rotations are single-precision numbers there, made unit ones when they are read.
fn gpu_instances(document: &Document, meshes: &Meshes<'_>, target: Target) -> Option<usize> {
    let NodeKind::Prefab { prefab, .. } = document.node(target.node)?.kind else { return None };
    let part = target.part?;
    let prefab = document.prefab(prefab)?;
    let count = *prefab.foreign.instanced.get(&part).filter(|count| **count > 0)?;
    let as_read = (1..=count).all(|offset| {
        let target = Target::part(target.node, part + offset);
        document.part_override(target).is_none()
            && moved_primitives(document, meshes, target).is_empty()
            && matches!(document.local(target), Some(Local::Trs(trs)) if single_precision(trs.rotation).is_some())
    });
    as_read.then_some(count as usize)
}

/// The rotation in single precision that is read back as this one, to the bit. A file's rotation is a unit one but for
/// rounding, so that it is this one at a length close to 1.
pub(super) fn single_precision(rotation: DQuat) -> Option<Quat> {
    let lengths = (-MOST_STEPS..=MOST_STEPS).map(|step| 1.0 + f64::from(step) * LENGTH_STEP);
    let candidates = lengths.map(|length| (rotation * length).as_quat());
    candidates.into_iter().find(|candidate| unit_rotation(candidate.as_dquat()) == Some(rotation))
}
