//! Skins and clips of placed prefabs. A clip of a source is one clip of the file, with channels for every instance of it.
//! In: the tree with its places. Out: their JSON, and bytes in the buffer, once for all instances.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::buffer::{Buffer, Use};
use super::foreign::Sources;
use super::json::{Extensions, Object, Put};
use super::pointer::{Places, pointer_of};
use super::tree::Tree;
use crate::animation::{Animation, Channel, ChannelPath, ClipChoice, Interpolation};
use crate::document::Document;
use crate::foreign::{KeptChannel, Numbers};
use crate::ids::{NodeId, PrefabId, Target};
use crate::prefab::{Prefab, Skin};

/// Places of the skins of each instance. A skin of which not all joints are in the file is left out.
pub(super) fn skin_places(document: &Document, tree: &Tree) -> BTreeMap<(NodeId, u32), usize> {
    let written = |&(node, prefab): &(NodeId, PrefabId)| {
        let skins = (0..).zip(document.prefab(prefab).map_or(&[][..], Prefab::skins));
        let is_whole =
            move |skin: &Skin| skin.joints.iter().all(|&j| tree.places.contains_key(&Target::part(node, j)));
        skins.filter(move |(_, skin)| is_whole(skin)).map(move |(number, _)| (node, number))
    };
    tree.instances.iter().flat_map(written).zip(0..).collect()
}

/// The skins of all instances.
pub(super) fn skins(
    places: &BTreeMap<(NodeId, u32), usize>,
    tree: &Tree,
    sources: &Sources<'_>,
    (buffer, nodes): (&mut Buffer, &mut Vec<Value>),
    used: &mut Extensions,
) -> Vec<Value> {
    let mut in_order: Vec<(usize, (NodeId, u32))> =
        places.iter().map(|(skin, place)| (*place, *skin)).collect();
    in_order.sort_unstable();
    let mut list = Vec::new();
    for (_, (node, number)) in in_order {
        let Some((id, prefab)) = tree.prefab_of(node).and_then(|id| Some((id, sources.source(id)?))) else {
            continue;
        };
        let Some(skin) = prefab.skins().get(number as usize) else { continue };
        let mut object = Object::new();
        let kept = prefab.foreign.skins.get(&(number as usize));
        object.put_text("name", kept.map_or("", |kept| &kept.name));
        let matrices: Vec<[f32; 16]> =
            skin.inverse_bind.iter().map(|m| glam::DMat4::from(*m).as_mat4().to_cols_array()).collect();
        object.put("inverseBindMatrices", buffer.floats(&matrices, false, Use::Other));
        let joints =
            skin.joints.iter().filter_map(|&part| tree.places.get(&Target::part(node, part)).copied());
        object.put("joints", apart(joints, nodes));
        let skeleton = kept.and_then(|kept| tree.places.get(&Target::part(node, kept.skeleton?)));
        if let Some(skeleton) = skeleton {
            object.put("skeleton", *skeleton);
        }
        sources.put(&mut object, kept.map(|kept| (id, &kept.unknown)), Object::new(), used);
        list.push(Value::Object(object));
    }
    list
}

/// The joints of a skin, each once: for one that is there twice a node below it, which lies as it does.
fn apart(joints: impl Iterator<Item = usize>, nodes: &mut Vec<Value>) -> Vec<usize> {
    let mut seen = BTreeSet::new();
    let mut one = |joint: usize| {
        if seen.insert(joint) {
            return joint;
        }
        let twin = nodes.len();
        if let Some(node) = nodes.get_mut(joint).and_then(Value::as_object_mut) {
            let children = node.entry("children").or_insert_with(|| Value::Array(Vec::new()));
            children.as_array_mut().into_iter().for_each(|children| children.push(twin.into()));
        }
        let mut object = Object::new();
        object.put("name", format!("joint {joint} again"));
        nodes.push(Value::Object(object));
        twin
    };
    joints.map(&mut one).collect()
}

/// Parts of an instance whose transforms clips move.
pub(super) fn moved_parts(
    document: &Document,
    node: NodeId,
    prefab: PrefabId,
) -> impl Iterator<Item = Target> {
    let clips = document.prefab(prefab).map_or(&[][..], |prefab| &prefab.animations);
    let channels = clips.iter().flat_map(|clip| &clip.channels);
    channels
        .filter(|channel| channel.path.is_transform())
        .map(move |channel| Target::part(node, channel.part))
}

/// The clips of the file.
#[derive(Default)]
pub(super) struct Clips {
    pub list: Vec<Value>,
    /// Where channels point.
    pub pointers: BTreeSet<String>,
    /// Channels that change nothing that is in the file.
    pub left_out: usize,
}

/// The clips of all prefabs that are placed.
pub(super) fn clips(places: &Places<'_>, buffer: &mut Buffer, used: &mut Extensions) -> Clips {
    let mut clips = Clips::default();
    for id in places.tree.prefabs() {
        let Some(prefab) = places.sources.source(id) else { continue };
        let instances = places.tree.instances.iter().filter(|(_, prefab)| *prefab == id);
        let nodes: Vec<NodeId> = instances.map(|(node, _)| *node).collect();
        for (number, clip) in prefab.animations.iter().enumerate() {
            let kept = prefab.foreign.channels.get(&number).map_or(&[][..], Vec::as_slice);
            let mut writer =
                ClipWriter { places, buffer, clips: &mut clips, channels: Vec::new(), samplers: Vec::new() };
            writer.write(clip, kept, id, &nodes);
            let (channels, samplers) = (writer.channels, writer.samplers);
            // A clip that moves nothing is not allowed.
            if channels.is_empty() {
                continue;
            }
            let mut object = Object::new();
            object.put_text("name", &clip.name);
            object.put("channels", channels);
            object.put("samplers", samplers);
            let unknown = prefab.foreign.clips.get(&number).map(|unknown| (id, unknown));
            places.sources.put(&mut object, unknown, Object::new(), used);
            clips.list.push(Value::Object(object));
        }
    }
    clips
}

/// Whether the file plays otherwise than the scene does: a reader plays the first clip, or all.
pub(super) fn plays_otherwise(document: &Document, tree: &Tree) -> bool {
    let animated = |(node, prefab): &(NodeId, PrefabId)| {
        document.prefab(*prefab).filter(|prefab| prefab.is_animated()).map(|_| document.clip_of(*node))
    };
    let choices: Vec<ClipChoice> = tree.instances.iter().filter_map(animated).collect();
    let sources = tree.prefabs().into_iter().filter_map(|id| document.prefab(id));
    choices.iter().any(|choice| *choice != ClipChoice::First)
        || sources.filter(|prefab| prefab.is_animated()).count() > 1
}

/// Writes one clip.
struct ClipWriter<'a> {
    places: &'a Places<'a>,
    buffer: &'a mut Buffer,
    clips: &'a mut Clips,
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl ClipWriter<'_> {
    fn write(&mut self, clip: &Animation, kept: &[KeptChannel], id: PrefabId, nodes: &[NodeId]) {
        for channel in &clip.channels {
            let targets = nodes.iter().flat_map(|node| self.places.targets(channel, *node)).collect();
            self.push(targets, |buffer| write_sampler(channel, buffer));
        }
        for channel in kept {
            let targets = self.places.targets_of_kept(channel, id, nodes);
            self.push(targets, |buffer| {
                let mut object = Object::new();
                object.put("input", buffer.numbers(&channel.input, true, Use::Other));
                if let Some(interpolation) = &channel.interpolation {
                    object.put("interpolation", interpolation.as_str());
                }
                object.put("output", buffer.numbers(&channel.output, false, Use::Other));
                object
            });
        }
    }

    /// Channels with one sampler. What several parts or instances share is changed once.
    fn push(&mut self, targets: Vec<Object>, sampler: impl FnOnce(&mut Buffer) -> Object) {
        if targets.is_empty() {
            self.clips.left_out += 1;
        }
        let before = self.channels.len();
        for target in targets.into_iter().map(Value::Object) {
            let is_there = |channel: &Value| channel.get("target") == Some(&target);
            if let Some(pointer) = pointer_of(&target) {
                self.clips.pointers.insert(pointer.to_owned());
                if self.channels.iter().any(is_there) {
                    continue;
                }
            }
            let mut object = Object::new();
            object.put("sampler", self.samplers.len());
            object.put("target", target);
            self.channels.push(Value::Object(object));
        }
        if self.channels.len() > before {
            self.samplers.push(Value::Object(sampler(self.buffer)));
        }
    }
}

fn write_sampler(channel: &Channel, buffer: &mut Buffer) -> Object {
    let mut object = Object::new();
    let times: Vec<[f32; 1]> = channel.times_s.iter().map(|&time_s| [time_s]).collect();
    object.put("input", buffer.floats(&times, true, Use::Other));
    match channel.interpolation {
        Interpolation::Step => object.put("interpolation", "STEP"),
        Interpolation::Linear => {}
        Interpolation::CubicSpline => object.put("interpolation", "CUBICSPLINE"),
    }
    let sets = if channel.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let width = match channel.path {
        ChannelPath::Weights => 1,
        _ => channel.values.len() / (channel.times_s.len() * sets).max(1),
    };
    let values = &channel.values;
    let place = match width {
        _ if channel.path == ChannelPath::Visibility => buffer.numbers(&truths(values), false, Use::Other),
        2 => buffer.floats(values.as_chunks::<2>().0, false, Use::Other),
        3 => buffer.floats(values.as_chunks::<3>().0, false, Use::Other),
        4 => buffer.floats(values.as_chunks::<4>().0, false, Use::Other),
        _ => buffer.floats(values.as_chunks::<1>().0, false, Use::Other),
    };
    object.put("output", place);
    object
}

/// True and false, which the format wants as bytes.
fn truths(values: &[f32]) -> Numbers {
    let bytes: Vec<u8> = values.iter().map(|value| u8::from(*value != 0.0)).collect();
    Numbers { component: 5121, kind: "SCALAR", normalized: false, count: bytes.len(), bytes: bytes.into() }
}
