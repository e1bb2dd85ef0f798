//! Pointers of `KHR_animation_pointer`: where what channels change stands in the file that is written.
//! In: channels of sources, and the places of everything. Out: targets, and members that pointers need to end somewhere.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::foreign::Sources;
use super::json::{Extensions, Object, Put};
use super::node::Carried;
use super::tree::{Entry, Stands, Tree};
use crate::animation::{Channel, ChannelPath};
use crate::assets::{Camera, Light, Material};
use crate::foreign::{KeptChannel, Pointed};
use crate::ids::{MaterialId, MeshId, NodeId, PrefabId, Target};
use crate::import::gltf::is_read;

/// Name of the extension.
const NAME: &str = "KHR_animation_pointer";
const LIGHTS: &str = "/extensions/KHR_lights_punctual/lights";

/// The places of everything in the file.
pub(super) struct Places<'a> {
    pub tree: &'a Tree,
    pub sources: &'a Sources<'a>,
    pub lights: &'a Carried,
    pub cameras: &'a Carried,
    pub materials: &'a BTreeMap<MaterialId, usize>,
    /// One mesh of the document may be several of the file.
    pub meshes: &'a BTreeMap<MeshId, Vec<usize>>,
}

impl Places<'_> {
    /// The targets of a channel in an instance of its source; none where the file does not have what it changes.
    pub fn targets(&self, channel: &Channel, node: NodeId) -> Vec<Object> {
        let target = Target::part(node, channel.part);
        let own = self.tree.places.get(&target);
        let of_node =
            |path: &str| self.nodes_of(channel, target).into_iter().map(|n| on_node(n, path)).collect();
        let pointer = match channel.path {
            ChannelPath::Translation => return of_node("translation"),
            ChannelPath::Rotation => return of_node("rotation"),
            ChannelPath::Scale => return of_node("scale"),
            ChannelPath::Weights => return of_node("weights"),
            ChannelPath::Visibility => {
                own.map(|place| format!("/nodes/{place}/extensions/KHR_node_visibility/visible"))
            }
            ChannelPath::Light(property) => self.lights.places.get(&target).map(|place| {
                let rest = property.pointer::<Light>();
                format!("/extensions/KHR_lights_punctual/lights/{place}/{rest}")
            }),
            ChannelPath::Camera(property) => self
                .cameras
                .places
                .get(&target)
                .map(|place| format!("/cameras/{place}/{}", property.pointer::<Camera>())),
            ChannelPath::Material(id, property) => self
                .materials
                .get(&id)
                .map(|place| format!("/materials/{place}/{}", property.pointer::<Material>())),
        };
        pointer.map(|pointer| at(&pointer)).into_iter().collect()
    }

    /// The nodes that a channel moves: weights move the nodes of moved primitives too.
    fn nodes_of(&self, channel: &Channel, target: Target) -> Vec<usize> {
        let Some(&own) = self.tree.places.get(&target) else {
            return Vec::new();
        };
        if channel.path != ChannelPath::Weights {
            return vec![own];
        }
        let children = self.tree.entries.get(own).map_or(&[][..], |entry| &entry.children);
        let below = children.iter().flat_map(|child| match self.tree.entries.get(*child) {
            Some(Entry { stands: Stands::Around(_, Some(_)), children, .. }) => children.as_slice(),
            _ => std::slice::from_ref(child),
        });
        let has_weights = |place: &usize| {
            let entry = self.tree.entries.get(*place);
            let is_its = |stands| *place == own || matches!(stands, Stands::ForPrimitive(..));
            entry.is_some_and(|entry| is_its(entry.stands) && entry.mesh.is_some())
        };
        [own].iter().chain(below).copied().filter(has_weights).collect()
    }

    /// The targets of a channel that is not played, in all instances of its source.
    pub fn targets_of_kept(&self, channel: &KeptChannel, id: PrefabId, nodes: &[NodeId]) -> Vec<Object> {
        let prefab = self.sources.source(id);
        let rest = &channel.pointer;
        let numbered = |carried: &Carried, number: usize| carried.numbered.get(&(id, number)).cloned();
        let (list, places): (&str, BTreeSet<usize>) = match channel.of {
            Pointed::File => return vec![at(&format!("/{rest}"))],
            Pointed::Part(part) => {
                let place = |node: &NodeId| self.tree.places.get(&Target::part(*node, part)).copied();
                ("/nodes", nodes.iter().filter_map(place).collect())
            }
            Pointed::Mesh(mesh) => {
                let places = prefab.and_then(|prefab| self.meshes.get(prefab.meshes.get(mesh)?));
                ("/meshes", places.into_iter().flatten().copied().collect())
            }
            Pointed::Material(material) => {
                let place = prefab.and_then(|prefab| self.materials.get(prefab.materials.get(material)?));
                ("/materials", place.into_iter().copied().collect())
            }
            Pointed::Light(number) => {
                let places = numbered(self.lights, number).unwrap_or_default();
                (LIGHTS, places)
            }
            Pointed::Camera(number) => ("/cameras", numbered(self.cameras, number).unwrap_or_default()),
            // They follow those that nodes carry.
            Pointed::SpareLight(number) => {
                let before = self.sources.spare_before(id, |foreign| &foreign.spare_lights);
                (LIGHTS, [self.lights.pool.len() + before + number].into())
            }
            Pointed::SpareCamera(number) => {
                let before = self.sources.spare_before(id, |foreign| &foreign.spare_cameras);
                ("/cameras", [self.cameras.pool.len() + before + number].into())
            }
        };
        places.into_iter().map(|place| at(&format!("{list}/{place}/{rest}"))).collect()
    }
}

fn on_node(place: usize, path: &str) -> Object {
    let mut target = Object::new();
    target.put("node", place);
    target.put("path", path);
    target
}

fn at(pointer: &str) -> Object {
    let (mut target, mut extensions, mut value) = (Object::new(), Object::new(), Object::new());
    value.put("pointer", pointer);
    extensions.put(NAME, value);
    target.put("path", "pointer");
    target.put("extensions", extensions);
    target
}

/// The pointer of a target.
pub(super) fn pointer_of(target: &Value) -> Option<&str> {
    target.get("extensions")?.get(NAME)?.get("pointer")?.as_str()
}

/// Gives nodes and materials the members that pointers lead through where these were left out, as they say nothing.
pub(super) fn complete(
    pointers: &BTreeSet<String>,
    nodes: &mut [Value],
    materials: &mut [Value],
    used: &mut Extensions,
) {
    if !pointers.is_empty() {
        used.note(NAME);
    }
    for pointer in pointers {
        let Some((place, rest)) = pointer.trim_start_matches('/').split_once('/').and_then(|(list, rest)| {
            let (place, rest) = rest.split_once('/')?;
            let list = match list {
                "nodes" => &mut *nodes,
                "materials" => &mut *materials,
                _ => return None,
            };
            Some((list.get_mut(place.parse::<usize>().ok()?)?, rest))
        }) else {
            continue;
        };
        complete_one(place, rest, used);
    }
}

fn complete_one(object: &mut Value, rest: &str, used: &mut Extensions) {
    let mut at = object;
    let mut in_extensions = false;
    let Some((path, _)) = rest.rsplit_once('/') else { return };
    let mut names = path.split('/').peekable();
    while let Some(name) = names.next() {
        let Some(members) = at.as_object_mut() else { return };
        let may_be_made = match (in_extensions, name) {
            (true, _) => is_read(name),
            // Not for an extension that cannot be made.
            (false, "extensions") => names.peek().is_some_and(|name| is_read(name)),
            (false, _) => name == "pbrMetallicRoughness",
        };
        if !members.contains_key(name) && !may_be_made {
            return;
        }
        if in_extensions {
            used.note(name);
        }
        in_extensions = name == "extensions";
        at = members.entry(name).or_insert_with(|| Value::Object(Object::new()));
    }
}
