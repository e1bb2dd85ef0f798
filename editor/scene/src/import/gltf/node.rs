//! The node tree, in double precision.
//! In: JSON. Out: parts in depth-first order, those of the default scene first. Deep trees are walked without recursion.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::accessor::Accessors;
use super::carried::{read_camera, read_light};
use super::foreign::carried;
use super::json::{Fault, Item};
use super::mesh::{Meshes, read_weights};
use crate::assets::{Light, Mesh};
use crate::foreign::LooseMesh;
use crate::ids::MeshId;
use crate::node::MAX_NODES;
use crate::prefab::{PartNode, SourceScene};
use crate::transform::{Local, Trs};

mod instances;

/// A rotation this close to unit length is left as it is, bit for bit.
const UNIT_TOLERANCE: f64 = 1e-14;

/// The tree of a file.
#[derive(Default)]
pub(super) struct Tree {
    pub parts: Vec<PartNode>,
    /// Index of the part that a node of the file became.
    pub part_of_node: Vec<Option<u32>>,
    /// The scenes of the file; one of all roots where it has none.
    pub scenes: Vec<SourceScene>,
    pub default_scene: usize,
    /// Which light of the file a part carries.
    pub light_of: BTreeMap<u32, usize>,
    /// Which camera likewise.
    pub camera_of: BTreeMap<u32, usize>,
    /// Meshes of nothing but points and lines, by the part that places them.
    pub loose_parts: BTreeMap<u32, usize>,
    /// What of parts cannot be kept, in words.
    pub lost: Vec<String>,
    /// How many GPU instances follow a part that has some.
    pub instanced: BTreeMap<u32, u32>,
    pub warnings: Vec<Fault>,
}

/// Reads all nodes: those of the default scene, else of the first, then those of the others, then those of none.
pub(super) fn read_scenes(
    root: &Item<'_>,
    accessors: &Accessors<'_>,
    meshes: &Meshes,
) -> Result<Tree, Fault> {
    let nodes = root.objects("nodes")?;
    let children: Vec<Vec<usize>> =
        nodes.iter().map(|node| node.indices("children", nodes.len(), "node")).collect::<Result<_, _>>()?;
    let (lights, cameras) = carried(root)?;
    let items = root.objects("scenes")?;
    let default_scene = root.index("scene", items.len(), "scene")?.unwrap_or(0);
    let part_of_node = vec![None; nodes.len()];
    let tree = Tree { default_scene, part_of_node, ..Tree::default() };
    let reader = Reader { accessors, meshes: &meshes.list, loose: &meshes.loose, lights, cameras };
    let mut walk = Walk { reader, nodes, children, tree };
    let mut scenes = vec![SourceScene::default(); items.len()];
    let others = (0..items.len()).filter(|&place| place != default_scene);
    for place in std::iter::once(default_scene).chain(others) {
        if let (Some(item), Some(scene)) = (items.get(place), scenes.get_mut(place)) {
            *scene = walk.scene(item, place == default_scene)?;
        }
    }
    let mut all = SourceScene::default();
    for node in roots_of(&walk.children) {
        if walk.part_of(node).is_none() {
            all.roots.push(walk.subtree(node, false)?);
        }
    }
    if scenes.is_empty() {
        scenes.push(all);
    }
    walk.tree.scenes = scenes;
    Ok(walk.tree)
}

/// Reads node by node.
struct Walk<'a> {
    reader: Reader<'a>,
    nodes: Vec<Item<'a>>,
    children: Vec<Vec<usize>>,
    tree: Tree,
}

impl Walk<'_> {
    fn part_of(&self, node: usize) -> Option<u32> {
        self.tree.part_of_node.get(node).copied().flatten()
    }

    /// A scene with those of its nodes that were not read yet. `strict`: no node may be in it twice.
    fn scene(&mut self, item: &Item<'_>, strict: bool) -> Result<SourceScene, Fault> {
        let mut scene = SourceScene { name: item.name()?, ..SourceScene::default() };
        let mut seen = BTreeSet::new();
        for node in item.indices("nodes", self.nodes.len(), "node")? {
            let root = match self.part_of(node) {
                None => self.subtree(node, strict)?,
                Some(part) => part,
            };
            let is_root = self.tree.parts.get(root as usize).is_some_and(|part| part.parent.is_none());
            if is_root && seen.insert(root) {
                scene.roots.push(root);
            } else {
                self.twice(node, strict)?;
            }
        }
        Ok(scene)
    }

    /// A node with all below it; gives its part.
    fn subtree(&mut self, node: usize, strict: bool) -> Result<u32, Fault> {
        let top = self.tree.parts.len() as u32;
        let mut stack = vec![(node, None)];
        while let Some((node, parent)) = stack.pop() {
            if self.part_of(node).is_some() {
                self.twice(node, strict)?;
                continue;
            }
            let part = self.tree.parts.len() as u32;
            let (Some(item), Some(place)) = (self.nodes.get(node), self.tree.part_of_node.get_mut(node))
            else {
                continue;
            };
            *place = Some(part);
            self.reader.read_node(item, parent, &mut self.tree)?;
            let below = self.children.get(node).into_iter().flatten().rev();
            stack.extend(below.map(|&child| (child, Some(part))));
        }
        Ok(top)
    }

    fn twice(&mut self, node: usize, strict: bool) -> Result<(), Fault> {
        let Some(item) = self.nodes.get(node) else { return Ok(()) };
        if strict {
            return Err(item.fault("the scene names it twice"));
        }
        self.tree.warnings.push(item.fault("the scenes name it in two places; it is read at the first"));
        Ok(())
    }
}

fn roots_of(children: &[Vec<usize>]) -> Vec<usize> {
    let mut is_child = vec![false; children.len()];
    for &child in children.iter().flatten() {
        if let Some(slot) = is_child.get_mut(child) {
            *slot = true;
        }
    }
    (0..children.len()).filter(|&node| is_child.get(node) == Some(&false)).collect()
}

struct Reader<'a> {
    accessors: &'a Accessors<'a>,
    meshes: &'a [Mesh],
    loose: &'a BTreeMap<usize, LooseMesh>,
    lights: Vec<Item<'a>>,
    cameras: Vec<Item<'a>>,
}

impl Reader<'_> {
    /// Adds a node, and a part below it for each GPU instance.
    fn read_node(&self, item: &Item<'_>, parent: Option<u32>, tree: &mut Tree) -> Result<(), Fault> {
        let part = tree.parts.len() as u32;
        let named = item.index("mesh", self.meshes.len(), "mesh")?;
        let mesh = named
            .filter(|&mesh| self.meshes.get(mesh).is_some_and(|m| !m.primitives.is_empty()))
            .map(|mesh| MeshId(mesh as u64));
        if let Some(loose) = named.filter(|named| mesh.is_none() && self.loose.contains_key(named)) {
            tree.loose_parts.insert(part, loose);
            let more = [
                (item.raw("weights").is_some(), "the weights of a node of points or lines"),
                (item.raw("skin").is_some(), "the skin of a node of points or lines"),
                (
                    item.extension("EXT_mesh_gpu_instancing")?.is_some(),
                    "the GPU instances of points or lines",
                ),
            ];
            tree.lost.extend(more.into_iter().filter(|(has, _)| *has).map(|(_, what)| what.to_owned()));
        }
        let light = self.read_light_of(item, part, tree)?;
        let camera = match item.index("camera", self.cameras.len(), "camera")? {
            Some(index) => match self.cameras.get(index) {
                Some(camera) => {
                    let read = read_camera(camera, &mut tree.warnings)?;
                    tree.camera_of.extend(read.is_some().then_some((part, index)));
                    read
                }
                None => None,
            },
            None => None,
        };
        let visible = match item.extension("KHR_node_visibility")? {
            Some(extension) => extension.bool_or("visible", true)?,
            None => true,
        };
        let instances = match (mesh, item.extension("EXT_mesh_gpu_instancing")?) {
            (Some(_), Some(extension)) => {
                tree.lost.extend(instances::lost_attributes(&extension)?);
                instances::read(self.accessors, &extension, &mut tree.warnings)?
            }
            _ => None,
        };
        if part as usize + instances.as_ref().map_or(0, Vec::len) >= MAX_NODES {
            return Err(item.fault(format!("more than {MAX_NODES} nodes are not read")));
        }
        let local = read_local(item, &mut tree.warnings)?;
        let target_count =
            mesh.and_then(|mesh| self.meshes.get(mesh.0 as usize)).map(|mesh| mesh.data.morph.len());
        let weights = match target_count {
            Some(count) if count > 0 && item.raw("weights").is_some() => {
                let places = instances.as_ref().map_or(0, Vec::len).saturating_add(1);
                self.accessors.take(count, places.saturating_mul(size_of::<f32>()), item.place())?;
                read_weights(item, count, &mut tree.warnings)?
            }
            _ => None,
        };
        tree.parts.push(PartNode {
            name: item.name()?,
            parent,
            local,
            visible,
            mesh: mesh.filter(|_| instances.is_none()),
            light,
            camera,
            skin: None,
            weights: weights.clone(),
        });
        if let Some(instances) = &instances {
            tree.instanced.insert(part, instances.len() as u32);
        }
        for local in instances.into_iter().flatten() {
            tree.parts.push(PartNode {
                parent: Some(part),
                local: local.into(),
                visible: true,
                mesh,
                weights: weights.clone(),
                ..PartNode::default()
            });
        }
        Ok(())
    }

    fn read_light_of(&self, item: &Item<'_>, part: u32, tree: &mut Tree) -> Result<Option<Light>, Fault> {
        let Some(extension) = item.extension("KHR_lights_punctual")? else {
            return Ok(None);
        };
        let index = extension.required_index("light", self.lights.len(), "light")?;
        tree.light_of.insert(part, index);
        self.lights.get(index).map(|light| read_light(light, Some(item), &mut tree.warnings)).transpose()
    }
}

/// `None` for a rotation without direction.
pub(crate) fn unit(rotation: DQuat) -> Option<DQuat> {
    let length2 = rotation.length_squared();
    if (length2 - 1.0).abs() <= UNIT_TOLERANCE {
        return Some(rotation);
    }
    let usable = length2.is_finite() && length2 > 0.0;
    usable.then(|| rotation / length2.sqrt())
}

fn read_local(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Local, Fault> {
    if let Some(columns) = item.f64s::<16>("matrix")? {
        let matrix = DMat4::from_cols_array(&columns);
        let also = ["translation", "rotation", "scale"].into_iter().filter(|key| item.raw(key).is_some());
        let also: Vec<&str> = also.collect();
        if !also.is_empty() {
            warnings
                .push(item.fault(format!("it has a matrix and {} too; the matrix counts", also.join(", "))));
        }
        let row = matrix.row(3);
        if row.truncate() != DVec3::ZERO || row.w != 1.0 {
            warnings.push(item.fault("the last row of its matrix is not 0 0 0 1 and was ignored"));
        }
        return Ok(Local::from_affine(DAffine3::from_mat4(matrix)));
    }
    let mut trs = Trs::IDENTITY;
    if let Some(translation) = item.f64s::<3>("translation")? {
        trs.translation = translation.into();
    }
    if let Some(rotation) = item.f64s::<4>("rotation")? {
        trs.rotation = unit(DQuat::from_array(rotation)).unwrap_or_else(|| {
            warnings.push(item.fault("its rotation has length 0 and was ignored"));
            DQuat::IDENTITY
        });
    }
    if let Some(scale) = item.f64s::<3>("scale")? {
        trs.scale = scale.into();
    }
    Ok(Local::Trs(trs))
}
