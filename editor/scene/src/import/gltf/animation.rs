//! Animations: channels with their key frames. What `KHR_animation_pointer` points at is found in `pointer.rs`.
//! In: JSON, checked accessors, materials and the tree. Out: clips whose times grow and whose numbers are finite. A channel
//! that does not hold what it has to is left out with a warning; the rest of the file does not depend on it.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use super::accessor::{Accessors, Component};
use super::foreign::carried;
use super::json::{Fault, Item};
use super::node::Tree;
use crate::animation::{Animation, Channel, ChannelPath, Interpolation};
use crate::assets::{Camera, Light, Material, Mesh};
use crate::foreign::KeptChannel;
use crate::import::short;
use crate::transform::Local;

mod keys;
mod pointer;

/// Reads all animations in the order of the file.
pub(super) fn read_all(
    root: &Item<'_>,
    accessors: &Accessors<'_>,
    meshes: &[Mesh],
    materials: &[Material],
    tree: &mut Tree,
) -> Result<(Vec<Arc<Animation>>, Unplayed), Fault> {
    let mut warnings = Vec::new();
    let mut lost = Vec::new();
    let nodes = root.objects("nodes")?;
    let (lights, cameras) = carried(root)?;
    let reader = Reader { accessors, meshes, materials, nodes, lights, cameras, tree };
    let (mut clips, mut kept) = (Vec::new(), BTreeMap::new());
    for (place, item) in root.objects("animations")?.iter().enumerate() {
        let (clip, unplayed) = reader.read(item, &mut warnings, &mut lost)?;
        clips.push(Arc::new(clip));
        if !unplayed.is_empty() {
            kept.insert(place, unplayed);
        }
    }
    tree.warnings.append(&mut warnings);
    tree.lost.append(&mut lost);
    Ok((clips, kept))
}

/// Channels that can only be kept, by animation.
type Unplayed = BTreeMap<usize, Vec<KeptChannel>>;

struct Reader<'a> {
    accessors: &'a Accessors<'a>,
    meshes: &'a [Mesh],
    materials: &'a [Material],
    nodes: Vec<Item<'a>>,
    lights: Vec<Item<'a>>,
    cameras: Vec<Item<'a>>,
    tree: &'a Tree,
}

/// What a channel of the file changes, once for each part where it is.
type Targets = Vec<(u32, ChannelPath)>;

impl Reader<'_> {
    fn read(
        &self,
        item: &Item<'_>,
        warnings: &mut Vec<Fault>,
        lost: &mut Vec<String>,
    ) -> Result<(Animation, Vec<KeptChannel>), Fault> {
        let samplers = item.objects("samplers")?;
        let (mut channels, mut kept) = (Vec::new(), Vec::new());
        let mut seen = HashSet::new();
        for channel in item.objects("channels")? {
            let index = channel.required_index("sampler", samplers.len(), "sampler")?;
            let Some((sampler, target)) = samplers.get(index).zip(channel.child("target")?) else {
                warnings.push(channel.fault("it has no target; it was left out"));
                continue;
            };
            match self.read_channel(sampler, &target, warnings)? {
                // Nothing in the scene has what it changes.
                Ok(read) if read.is_empty() => match self.unplayed(sampler, &target)? {
                    Some(unplayed) => {
                        warnings.extend(begins_early(&channel, &unplayed));
                        kept.push(unplayed);
                    }
                    None => lost.push(format!(
                        "a channel of the clip \"{}\" that moves nothing",
                        short(&item.name()?)
                    )),
                },
                Ok(read) => {
                    for mut read in read {
                        if !seen.insert((read.part, read.path)) {
                            warnings.push(channel.fault("another channel moves the same; it was left out"));
                            continue;
                        }
                        self.warn_about(&channel, &read, warnings);
                        let first_s = read.times_s.first().copied().filter(|first_s| *first_s < 0.0);
                        if let Some(first_s) = first_s {
                            let numbers = read.times_s.len() + read.values.len();
                            self.accessors.take(numbers, size_of::<f32>(), channel.place())?;
                            read.begin_at_zero();
                            let reason =
                                format!("its times begin at {first_s} s; what is before 0 is left out");
                            warnings.push(channel.fault(reason));
                        }
                        channels.push(read);
                    }
                }
                Err(reason) => {
                    let unplayed = self.unplayed(sampler, &target)?;
                    let what =
                        if unplayed.is_some() { "it is only kept for exports" } else { "it was left out" };
                    warnings.push(channel.fault(format!("{reason}; {what}")));
                    warnings.extend(unplayed.iter().filter_map(|unplayed| begins_early(&channel, unplayed)));
                    kept.extend(unplayed);
                }
            }
        }
        Ok((Animation::new(item.name()?, channels), kept))
    }

    fn warn_about(&self, item: &Item<'_>, channel: &Channel, warnings: &mut Vec<Fault>) {
        let part = self.tree.parts.get(channel.part as usize);
        let sheared = part.is_some_and(|part| matches!(part.local, Local::Matrix(_)));
        if sheared && channel.path.is_transform() {
            warnings.push(item.fault("its node has a matrix with shear, which is dropped while it plays"));
        }
        let (least, largest) = match channel.path {
            ChannelPath::Light(property) => property.range::<Light>(),
            ChannelPath::Camera(property) => property.range::<Camera>(),
            ChannelPath::Material(_, property) => property.range::<Material>(),
            _ => return,
        };
        // The tangents of a spline are no values.
        let is_value = channel.interpolation != Interpolation::CubicSpline;
        if is_value && channel.values.iter().any(|value| !(least..=largest).contains(value)) {
            let largest = if largest == f32::MAX { "any number".to_owned() } else { largest.to_string() };
            warnings.push(item.fault(format!("its values are held to {least} to {largest}")));
        }
    }

    /// Channels for all that one of the file changes, none where that is nothing; or why it cannot be played, in words.
    fn read_channel(
        &self,
        sampler: &Item<'_>,
        target: &Item<'_>,
        warnings: &mut Vec<Fault>,
    ) -> Result<Result<Vec<Channel>, String>, Fault> {
        let targets = match self.targets(target)? {
            Ok(targets) => targets,
            Err(reason) => return Ok(Err(reason)),
        };
        let Some(&(part, path)) = targets.first() else {
            return Ok(Ok(Vec::new()));
        };
        let interpolation = match sampler.text("interpolation")? {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => return Ok(Err(format!("interpolation {:?} does not exist", short(other)))),
        };
        if path == ChannelPath::Visibility && interpolation != Interpolation::Step {
            return Ok(Err("visibility has steps only".to_owned()));
        }
        let width = self.width(part, path);
        if width == 0 {
            let reason = match path {
                ChannelPath::Weights => "its mesh has no morph targets",
                _ => "what it points at has no such property",
            };
            return Ok(Err(reason.to_owned()));
        }
        let (times_s, values) = (self.read_times(sampler)?, self.read_values(sampler, path, width)?);
        let (times_s, values) = match (times_s, values) {
            (Ok(times_s), Ok(values)) => (times_s, values),
            (Err(reason), _) | (_, Err(reason)) => return Ok(Err(reason)),
        };
        let mut channel = Channel { part, path, interpolation, times_s, values };
        if let Err(reason) = sound(&channel, width) {
            return Ok(Err(reason));
        }
        for reason in keys::repair(&mut channel) {
            warnings.push(sampler.fault(reason));
        }
        self.accessors.take(targets.len(), size_of::<Channel>(), target.place())?;
        // Another node of the same mesh, light or camera has the same widths.
        Ok(Ok(targets.into_iter().map(|(part, path)| Channel { part, path, ..channel.clone() }).collect()))
    }

    /// What a channel changes; none without a node, as then nothing moves.
    fn targets(&self, target: &Item<'_>) -> Result<Result<Targets, String>, Fault> {
        let path = match target.text("path")?.unwrap_or_default() {
            "translation" => ChannelPath::Translation,
            "rotation" => ChannelPath::Rotation,
            "scale" => ChannelPath::Scale,
            "weights" => ChannelPath::Weights,
            "pointer" => {
                let extension = target.extension("KHR_animation_pointer")?;
                let pointer = match &extension {
                    Some(extension) => extension.text("pointer")?.unwrap_or_default(),
                    None => "",
                };
                let targets = self.pointed_at(pointer)?;
                return Ok(
                    targets.ok_or_else(|| format!("what {:?} points at cannot be animated", short(pointer)))
                );
            }
            other => return Ok(Err(format!("path {:?} does not exist", short(other)))),
        };
        let Some(node) = target.size("node")? else {
            return Ok(Ok(Vec::new()));
        };
        let part = self.tree.part_of_node.get(node).copied().flatten();
        Ok(part.map(|part| vec![(part, path)]).ok_or_else(|| format!("node {node} is not in the scene")))
    }

    /// Numbers in one value; 0: there is no such thing.
    fn width(&self, part: u32, path: ChannelPath) -> usize {
        let node = self.tree.parts.get(part as usize);
        match path {
            ChannelPath::Translation | ChannelPath::Scale => 3,
            ChannelPath::Rotation => 4,
            ChannelPath::Weights => self.target_count(part),
            ChannelPath::Visibility => 1,
            ChannelPath::Light(property) => {
                node.and_then(|node| node.light).map_or(0, |l| property.width_in(&l))
            }
            ChannelPath::Camera(property) => {
                node.and_then(|node| node.camera).map_or(0, |c| property.width_in(&c))
            }
            ChannelPath::Material(id, property) => {
                self.materials.get(id.0 as usize).map_or(0, |material| property.width_in(material))
            }
        }
    }

    fn target_count(&self, part: u32) -> usize {
        let mesh = self.tree.parts.get(part as usize).and_then(|part| part.mesh);
        mesh.and_then(|mesh| self.meshes.get(mesh.0 as usize)).map_or(0, |mesh| mesh.data.morph.len())
    }

    fn read_times(&self, sampler: &Item<'_>) -> Result<Result<Arc<[f32]>, String>, Fault> {
        let index = sampler.required_size("input")?;
        let accessor = self.accessors.get(index)?;
        if accessor.component != Component::F32 || accessor.width != 1 {
            return Ok(Err(format!("accessor {index} of its times has no single floats")));
        }
        let times_s = self.accessors.flat_floats(index)?;
        let grow = times_s.array_windows::<2>().all(|[a, b]| a < b);
        Ok(match grow && times_s.iter().all(|time_s| time_s.is_finite()) {
            true => Ok(times_s),
            false => Err(format!("the times in accessor {index} do not grow")),
        })
    }

    /// The numbers of all keys; the weights of morph targets are single ones.
    fn read_values(
        &self,
        sampler: &Item<'_>,
        path: ChannelPath,
        width: usize,
    ) -> Result<Result<Arc<[f32]>, String>, Fault> {
        let index = sampler.required_size("output")?;
        let accessor = self.accessors.get(index)?;
        let wanted = if path == ChannelPath::Weights { 1 } else { width };
        if accessor.is_matrix || accessor.width != wanted || accessor.component == Component::U32 {
            return Ok(Err(format!("accessor {index} of its values has the wrong type")));
        }
        let values = self.accessors.flat_floats(index)?;
        Ok(match values.iter().all(|value| value.is_finite()) {
            true => Ok(values),
            false => Err(format!("a value in accessor {index} is not finite")),
        })
    }
}

/// A warning where what is only kept for exports begins before 0.
fn begins_early(item: &Item<'_>, unplayed: &KeptChannel) -> Option<Fault> {
    let first = unplayed.input.bytes.first_chunk::<4>().filter(|_| unplayed.input.component == 5126)?;
    let first_s = f32::from_le_bytes(*first);
    let reason = format!("its times begin at {first_s} s, before 0; exports have them as they stand");
    (first_s < 0.0).then(|| item.fault(reason))
}

/// Whether there is a value of `width` numbers for each time, and rotations have a direction.
fn sound(channel: &Channel, width: usize) -> Result<(), String> {
    let sets = if channel.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let (keys, per_key) = (channel.times_s.len(), sets * width);
    if keys.checked_mul(per_key) != Some(channel.values.len()) {
        let found = channel.values.len();
        return Err(format!("it has {found} numbers for {keys} keys of {per_key}"));
    }
    let value = |key: &[f32]| {
        key.get(per_key / sets * (sets / 2)..).unwrap_or(&[]).iter().take(width).any(|v| *v != 0.0)
    };
    let turned = channel.path != ChannelPath::Rotation || channel.values.chunks_exact(per_key).all(value);
    if turned { Ok(()) } else { Err("a rotation has length 0".to_owned()) }
}
