//! Nodes: names, transforms with all digits, and what each carries. In: the tree. Out: their JSON, and lights and cameras.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DQuat, DVec3};
use serde_json::Value;

use super::buffer::{Buffer, Use};
use super::foreign::Sources;
use super::json::{Extensions, Object, Pool, Put, number, numbers, wide};
use super::mesh::MeshKey;
use super::shear;
use super::tree::{Entry, Stands, Tree, local_of, single_precision};
use crate::assets::{Camera, Light, LightKind, Projection};
use crate::document::Document;
use crate::ids::{NodeId, PrefabId, Target};
use crate::import::gltf::unit_rotation;
use crate::node::{NodeKind, RayVisibility};
use crate::transform::{Local, Trs};

/// Farthest distance of parallel cameras that have none, as the format wants one, metres.
const FAR_M: f32 = 1e6;

/// Lights, or cameras, in the making.
#[derive(Default)]
pub(super) struct Carried {
    pub pool: Pool,
    /// By who carries them.
    pub places: BTreeMap<Target, usize>,
    /// By source and number in it.
    pub numbered: BTreeMap<(PrefabId, usize), BTreeSet<usize>>,
}

/// Writes nodes.
pub(super) struct NodeWriter<'a> {
    pub document: &'a Document,
    pub sources: &'a Sources<'a>,
    pub buffer: &'a mut Buffer,
    pub used: &'a mut Extensions,
    /// Places of the meshes in the file.
    pub meshes: &'a BTreeMap<MeshKey, usize>,
    /// Places of the skins of each instance.
    pub skins: &'a BTreeMap<(NodeId, u32), usize>,
    /// Parts whose transform a clip moves: they must not have a matrix.
    pub moving: &'a BTreeSet<Target>,
    pub lights: Carried,
    pub cameras: Carried,
    /// What is said otherwise than in the document: the place and why.
    pub warnings: Vec<(String, &'static str)>,
}

impl NodeWriter<'_> {
    /// All nodes of the tree.
    pub fn write(&mut self, tree: &Tree) -> Vec<Value> {
        tree.entries.iter().map(|entry| Value::Object(self.node(entry))).collect()
    }

    fn node(&mut self, entry: &Entry) -> Object {
        let mut node = Object::new();
        match entry.stands {
            Stands::For(target) => self.put_target(&mut node, target, entry),
            Stands::ForPrimitive(target, primitive) => {
                self.put_place(&mut node, target, Some(primitive));
                self.put_mesh(&mut node, entry, target);
            }
            Stands::Around(target, primitive) => {
                node.put("name", format!("{} (shear)", self.document.display_name(target)));
                if let Some([outer, _]) = shear::two_nodes(&local_of(self.document, target, primitive)) {
                    put_local(&mut node, &outer.into());
                }
            }
        }
        node.put_filled("children", entry.children.clone());
        node
    }

    fn put_target(&mut self, node: &mut Object, target: Target, entry: &Entry) {
        node.put_text("name", self.document.name(target).unwrap_or_default());
        self.put_place(node, target, None);
        self.put_mesh(node, entry, target);
        if let Some(camera) = self.document.camera_of(target) {
            let place = self.carried(target, camera_of(&camera), false);
            node.put("camera", place);
        }
        let prefab = self.document.prefab_of(target.node);
        let unknown = target.part.zip(prefab).and_then(|(part, prefab)| self.sources.part(prefab, part));
        if let Some(light) = self.document.light_of(target) {
            if !light.radiant().is_finite() {
                self.warn(target, "its light is held to the largest number that there is");
            }
            // Sizes in the node's own extras would be read where the light has none.
            let speaks = unknown.is_some_and(|(_, unknown)| unknown.extras.is_some());
            let mut value = Object::new();
            value.put("light", self.carried(target, light_of(&light, speaks), true));
            self.used.put(node, "KHR_lights_punctual", value);
        }
        if self.document.visible(target) == Some(false) {
            let mut value = Object::new();
            value.put("visible", false);
            self.used.put(node, "KHR_node_visibility", value);
        }
        if !entry.instances.is_empty() {
            let attributes = self.instance_attributes(&entry.instances);
            let mut value = Object::new();
            value.put("attributes", attributes);
            self.used.put(node, "EXT_mesh_gpu_instancing", value);
        }
        if self.document.ray_visibility(target).is_some_and(|rays| rays != RayVisibility::default()) {
            self.warn(target, "which rays meet it is left out, glTF has no word for that");
        }
        self.sources.put(node, unknown, Object::new(), self.used);
    }

    /// The place of a light or camera in its list, with what its source says of it. Two of a source stay two, also where
    /// they say the same.
    fn carried(&mut self, target: Target, mut object: Object, is_light: bool) -> usize {
        let kept = if is_light { self.sources.light(target) } else { self.sources.camera(target) };
        let extras = object.remove("extras");
        let mut own_extras = extras.and_then(|extras| extras.as_object().cloned()).unwrap_or_default();
        if let Some((_, kept)) = kept {
            object.put_text("name", &kept.name);
            // What another program means by the word stays as long as there is nothing to say: it is read as nothing.
            let theirs = kept.unknown.extras.as_ref().and_then(Value::as_object);
            own_extras.retain(|key, value| {
                value.as_f64() != Some(0.0) || theirs.is_none_or(|theirs| !theirs.contains_key(key))
            });
        }
        let unknown = kept.map(|(prefab, kept)| (prefab, &kept.unknown));
        self.sources.put(&mut object, unknown, own_extras, self.used);
        let carried = if is_light { &mut self.lights } else { &mut self.cameras };
        let number = kept.map(|(prefab, kept)| (prefab, kept.number));
        let owner = match number {
            Some((prefab, number)) => format!("{} {number} ", prefab.0),
            None => String::new(),
        };
        let place = carried.pool.place_of(object, &owner);
        carried.places.insert(target, place);
        if let Some(number) = number {
            carried.numbered.entry(number).or_default().insert(place);
        }
        place
    }

    fn put_place(&mut self, node: &mut Object, target: Target, primitive: Option<u32>) {
        let local = local_of(self.document, target, primitive);
        let two = shear::two_nodes(&local);
        if primitive.is_none() && self.moving.contains(&target) {
            if two.is_some() {
                self.warn(target, "a clip moves it, so that the shear of its matrix is left out");
            }
            put_local(node, &local.nearest_trs().into());
        } else if let Some([_, inner]) = two {
            self.warn(target, "its matrix has shear, which no node of glTF can hold: it becomes two nodes");
            put_local(node, &inner.into());
        } else {
            put_local(node, &local);
        }
    }

    /// The mesh with its weights and skin.
    fn put_mesh(&mut self, node: &mut Object, entry: &Entry, target: Target) {
        let Some((key, place)) = entry.mesh.as_ref().and_then(|key| Some((key, self.meshes.get(key)?)))
        else {
            return;
        };
        node.put("mesh", *place);
        let owner = entry.instances.first().copied().unwrap_or(target);
        let count = self.document.mesh(key.mesh).map_or(0, |mesh| mesh.data.morph.len());
        if let Some(mut weights) = own_weights(self.document, owner).filter(|_| count > 0) {
            weights.resize(count, 0.0);
            node.put("weights", numbers(&weights));
        }
        let skin = self.document.part(target).and_then(|part| part.skin);
        let skin = skin.and_then(|skin| self.skins.get(&(target.node, skin)));
        if let (Some(skin), Stands::For(_)) = (skin, entry.stands) {
            node.put("skin", *skin);
            let moved = |mesh: &crate::assets::Mesh| {
                mesh.primitives.iter().any(|p| p.mesh_from_primitive != DAffine3::IDENTITY)
            };
            if self.document.mesh(key.mesh).is_some_and(moved) {
                self.warn(target, "a skin bends its mesh, so that its moved primitives are put back");
            }
        }
    }

    fn instance_attributes(&mut self, instances: &[Target]) -> Object {
        let trs = |target: &Target| self.document.local(*target).unwrap_or_default().nearest_trs();
        let most = DVec3::splat(f32::MAX.into());
        let single = |v: DVec3| v.clamp(-most, most).as_vec3().to_array();
        let list: Vec<Trs> = instances.iter().map(trs).collect();
        let mut attributes = Object::new();
        let translations: Vec<[f32; 3]> = list.iter().map(|trs| single(trs.translation)).collect();
        attributes.put("TRANSLATION", self.buffer.floats(&translations, false, Use::Other));
        if list.iter().any(|trs| trs.rotation != DQuat::IDENTITY) {
            let rotations: Vec<[f32; 4]> = list
                .iter()
                .map(|trs| single_precision(trs.rotation).unwrap_or_default().to_array())
                .collect();
            attributes.put("ROTATION", self.buffer.floats(&rotations, false, Use::Other));
        }
        if list.iter().any(|trs| trs.scale != DVec3::ONE) {
            let scales: Vec<[f32; 3]> = list.iter().map(|trs| single(trs.scale)).collect();
            attributes.put("SCALE", self.buffer.floats(&scales, false, Use::Other));
        }
        attributes
    }

    fn warn(&mut self, target: Target, reason: &'static str) {
        self.warnings.push((self.document.display_name(target), reason));
    }
}

/// Weights of a node or part where it has its own.
fn own_weights(document: &Document, target: Target) -> Option<Vec<f32>> {
    if target.part.is_some() {
        let set = document.part_override(target).and_then(|o| o.weights.clone());
        return set.or_else(|| document.part(target)?.weights.clone());
    }
    match &document.node(target.node)?.kind {
        NodeKind::Mesh { weights, .. } => Some(weights.clone()).filter(|weights| !weights.is_empty()),
        _ => None,
    }
}

/// Translation, rotation and scale where they are read back to the bit, else a matrix.
fn put_local(node: &mut Object, local: &Local) {
    let all = |values: &[f64]| -> Value { values.iter().copied().map(wide).collect() };
    match local {
        Local::Trs(trs) if unit_rotation(trs.rotation) == Some(trs.rotation) => {
            if trs.translation != DVec3::ZERO {
                node.put("translation", all(&trs.translation.to_array()));
            }
            if trs.rotation != DQuat::IDENTITY {
                node.put("rotation", all(&trs.rotation.to_array()));
            }
            if trs.scale != DVec3::ONE {
                node.put("scale", all(&trs.scale.to_array()));
            }
        }
        other => {
            let affine = other.to_affine();
            let columns = [affine.x_axis, affine.y_axis, affine.z_axis].map(|axis| axis.extend(0.0));
            let columns = [columns[0], columns[1], columns[2], affine.translation.extend(1.0)];
            node.put("matrix", all(&columns.map(|column| column.to_array()).concat()));
        }
    }
}

/// KHR_lights_punctual with its size in `extras`; `always`: also where it is 0.
fn light_of(light: &Light, always: bool) -> Object {
    let mut object = Object::new();
    // A colour above 1 is a colour with more strength.
    let brightest = light.color.max_element().max(1.0);
    object.put_numbers("color", light.color / brightest, [1.0; 3]);
    object.put_number("intensity", light.intensity * brightest, 1.0);
    let mut size = |key: &str, value: f64| {
        let mut extras = Object::new();
        if value != 0.0 || always {
            extras.put(key, value);
        }
        object.put_filled("extras", extras);
    };
    match light.kind {
        LightKind::Point { radius_m, range_m } => {
            size("radius", radius_m.into());
            object.put("type", "point");
            put_some(&mut object, "range", range_m);
        }
        LightKind::Spot { radius_m, range_m, inner_rad, outer_rad } => {
            size("radius", radius_m.into());
            object.put("type", "spot");
            put_some(&mut object, "range", range_m);
            let mut spot = Object::new();
            // The inner angle has to be less than the outer one.
            let inner_rad = if inner_rad < outer_rad { inner_rad } else { outer_rad.next_down().max(0.0) };
            spot.put("innerConeAngle", number(inner_rad));
            // The nearest single to a right angle is a little more than one.
            spot.put("outerConeAngle", at_most(outer_rad, std::f64::consts::FRAC_PI_2));
            object.put("spot", spot);
        }
        LightKind::Directional { angular_radius_rad } => {
            size("angle", (f64::from(angular_radius_rad) * 2.0).to_degrees());
            object.put("type", "directional");
        }
    }
    object
}

/// A number as written, and no more than `most`, which is read back as the same single.
fn at_most(value: f32, most: f64) -> Value {
    if f64::from(value) > most { Value::from(most) } else { number(value) }
}

fn put_some(object: &mut Object, key: &str, value: Option<f32>) {
    if let Some(value) = value {
        object.put(key, number(value));
    }
}

fn camera_of(camera: &Camera) -> Object {
    let (mut object, mut lens) = (Object::new(), Object::new());
    let kind = match camera.projection {
        Projection::Perspective { yfov_rad } => {
            put_some(&mut lens, "aspectRatio", camera.aspect);
            lens.put("yfov", number(yfov_rad));
            put_some(&mut lens, "zfar", camera.far_m);
            "perspective"
        }
        Projection::Orthographic { ymag_m } => {
            // Exact in double precision, so that dividing gives the same ratio again.
            lens.put("xmag", f64::from(camera.aspect.unwrap_or(1.0)) * f64::from(ymag_m));
            lens.put("ymag", f64::from(ymag_m));
            lens.put("zfar", number(camera.far_m.unwrap_or(FAR_M.max(camera.near_m * 2.0))));
            "orthographic"
        }
    };
    lens.put("znear", number(camera.near_m));
    object.put("type", kind);
    object.put(kind, lens);
    object
}
