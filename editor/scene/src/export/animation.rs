//! Skins and clips of placed prefabs. A clip of a source is one clip of the file, with channels for every instance of it.
//! In: the tree with its places. Out: their JSON, and bytes in the buffer, once for all instances.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::buffer::{Buffer, Use};
use super::json::{Object, Put};
use super::tree::{Stands, Tree};
use crate::animation::{Animation, Channel, ChannelPath, ClipChoice, Interpolation};
use crate::document::Document;
use crate::ids::{NodeId, PrefabId, Target};
use crate::prefab::{Prefab, Skin};

/// Place of the first skin of each instance.
pub(super) fn first_skins(document: &Document, tree: &Tree) -> BTreeMap<NodeId, usize> {
    let mut next = 0;
    let place = |&(node, prefab): &(NodeId, PrefabId)| {
        let first = next;
        next += document.prefab(prefab).map_or(0, |prefab| prefab.skins().len());
        (node, first)
    };
    tree.instances.iter().map(place).collect()
}

/// The skins of all instances.
pub(super) fn skins(document: &Document, tree: &Tree, buffer: &mut Buffer) -> Vec<Value> {
    let of_instance = |(node, prefab): &(NodeId, PrefabId)| -> Vec<Value> {
        let skins = document.prefab(*prefab).map_or(&[][..], Prefab::skins);
        skins.iter().map(|skin| Value::Object(write_skin(skin, *node, tree, buffer))).collect()
    };
    tree.instances.iter().flat_map(of_instance).collect()
}

fn write_skin(skin: &Skin, node: NodeId, tree: &Tree, buffer: &mut Buffer) -> Object {
    let matrices: Vec<[f32; 16]> =
        skin.inverse_bind.iter().map(|matrix| glam::DMat4::from(*matrix).as_mat4().to_cols_array()).collect();
    let mut object = Object::new();
    object.put("inverseBindMatrices", buffer.floats(&matrices, false, Use::Other));
    let place = |&part: &u32| tree.places.get(&Target::part(node, part)).copied();
    object.put("joints", skin.joints.iter().filter_map(place).collect::<Vec<_>>());
    object
}

/// Parts whose transforms clips move.
pub(super) fn moving(document: &Document, tree: &Tree) -> BTreeSet<Target> {
    let mut moving = BTreeSet::new();
    for &(node, prefab) in &tree.instances {
        let clips = document.prefab(prefab).map_or(&[][..], |prefab| &prefab.animations);
        let channels = clips.iter().flat_map(|clip| &clip.channels);
        let transforms = channels.filter(|channel| channel.path.is_transform());
        moving.extend(transforms.map(|channel| Target::part(node, channel.part)));
    }
    moving
}

/// The clips of all prefabs that are placed.
pub(super) fn clips(document: &Document, tree: &Tree, buffer: &mut Buffer) -> Vec<Value> {
    let mut list = Vec::new();
    for id in tree.prefabs() {
        let nodes: Vec<NodeId> =
            tree.instances.iter().filter(|(_, prefab)| *prefab == id).map(|(node, _)| *node).collect();
        let clips = document.prefab(id).map_or(&[][..], |prefab| &prefab.animations);
        // A clip that moves nothing is not allowed.
        for clip in
            clips.iter().filter(|clip| clip.channels.iter().any(|channel| path_name(channel.path).is_some()))
        {
            list.push(Value::Object(write_clip(clip, &nodes, tree, buffer)));
        }
    }
    list
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

fn write_clip(clip: &Animation, nodes: &[NodeId], tree: &Tree, buffer: &mut Buffer) -> Object {
    let (mut channels, mut samplers) = (Vec::new(), Vec::new());
    for channel in &clip.channels {
        let Some(path) = path_name(channel.path) else { continue };
        for node in nodes {
            for place in places(channel, *node, tree) {
                let mut target = Object::new();
                target.put("node", place);
                target.put("path", path);
                let mut object = Object::new();
                object.put("sampler", samplers.len());
                object.put("target", target);
                channels.push(Value::Object(object));
            }
        }
        samplers.push(Value::Object(write_sampler(channel, buffer)));
    }
    let mut object = Object::new();
    object.put_text("name", &clip.name);
    object.put("channels", channels);
    object.put("samplers", samplers);
    object
}

/// The nodes that a channel moves: weights move the nodes of moved primitives too.
fn places(channel: &Channel, node: NodeId, tree: &Tree) -> Vec<usize> {
    let Some(&own) = tree.places.get(&Target::part(node, channel.part)) else {
        return Vec::new();
    };
    if channel.path != ChannelPath::Weights {
        return vec![own];
    }
    let children = tree.entries.get(own).map_or(&[][..], |entry| &entry.children);
    [own]
        .iter()
        .chain(children)
        .copied()
        .filter(|&place| {
            let entry = tree.entries.get(place);
            let is_its = |stands| place == own || matches!(stands, Stands::ForPrimitive(..));
            entry.is_some_and(|entry| is_its(entry.stands) && entry.mesh.is_some())
        })
        .collect()
}

/// `None` for what is left out: its pointer would have to be written anew.
fn path_name(path: ChannelPath) -> Option<&'static str> {
    match path {
        ChannelPath::Translation => Some("translation"),
        ChannelPath::Rotation => Some("rotation"),
        ChannelPath::Scale => Some("scale"),
        ChannelPath::Weights => Some("weights"),
        ChannelPath::Visibility
        | ChannelPath::Light(_)
        | ChannelPath::Camera(_)
        | ChannelPath::Material(..) => None,
    }
}

/// Channels of the placed prefabs that are left out.
pub(super) fn left_out(document: &Document, tree: &Tree) -> usize {
    let clips =
        tree.prefabs().into_iter().filter_map(|id| document.prefab(id)).flat_map(|prefab| &prefab.animations);
    clips.flat_map(|clip| &clip.channels).filter(|channel| path_name(channel.path).is_none()).count()
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
    let place = match channel.path {
        ChannelPath::Translation | ChannelPath::Scale => {
            buffer.floats(channel.values.as_chunks::<3>().0, false, Use::Other)
        }
        ChannelPath::Rotation => buffer.floats(channel.values.as_chunks::<4>().0, false, Use::Other),
        _ => buffer.floats(channel.values.as_chunks::<1>().0, false, Use::Other),
    };
    object.put("output", place);
    object
}
