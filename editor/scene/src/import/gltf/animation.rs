//! Animations: channels with their key frames.
//! In: JSON, checked accessors and the tree. Out: clips whose times grow and whose numbers are finite. A channel
//! that does not hold what it has to is left out with a warning; the rest of the file does not depend on it.

use std::collections::HashSet;
use std::sync::Arc;

use super::accessor::{Accessors, Component};
use super::json::{Fault, Item};
use super::node::Tree;
use crate::animation::{Animation, Channel, ChannelPath, Interpolation};
use crate::assets::Mesh;
use crate::transform::Local;

/// Reads all animations in the order of the file.
pub(super) fn read_all(
    root: &Item<'_>,
    accessors: &Accessors<'_>,
    meshes: &[Mesh],
    tree: &mut Tree,
) -> Result<Vec<Arc<Animation>>, Fault> {
    let mut warnings = Vec::new();
    let reader = Reader { accessors, meshes, tree };
    let mut clips = Vec::new();
    for item in root.objects("animations")? {
        clips.push(Arc::new(reader.read(&item, &mut warnings)?));
    }
    tree.warnings.append(&mut warnings);
    Ok(clips)
}

struct Reader<'a> {
    accessors: &'a Accessors<'a>,
    meshes: &'a [Mesh],
    tree: &'a Tree,
}

impl Reader<'_> {
    fn read(&self, item: &Item<'_>, warnings: &mut Vec<Fault>) -> Result<Animation, Fault> {
        let samplers = item.objects("samplers")?;
        let mut channels = Vec::new();
        let mut seen = HashSet::new();
        for channel in item.objects("channels")? {
            let index = channel.required_index("sampler", samplers.len(), "sampler")?;
            let Some((sampler, target)) = samplers.get(index).zip(channel.child("target")?) else {
                warnings.push(channel.fault("it has no target; it was left out"));
                continue;
            };
            match self.read_channel(sampler, &target)? {
                Ok(Some(read)) if !seen.insert((read.part, read.path)) => {
                    warnings.push(channel.fault("another channel moves the same; it was left out"));
                }
                Ok(Some(read)) => {
                    self.warn_about_matrix(&channel, &read, warnings);
                    channels.push(read);
                }
                Ok(None) => {}
                Err(reason) => warnings.push(channel.fault(format!("{reason}; it was left out"))),
            }
        }
        Ok(Animation::new(item.name()?, channels))
    }

    fn warn_about_matrix(&self, item: &Item<'_>, channel: &Channel, warnings: &mut Vec<Fault>) {
        let part = self.tree.parts.get(channel.part as usize);
        let sheared = part.is_some_and(|part| matches!(part.local, Local::Matrix(_)));
        if sheared && channel.path != ChannelPath::Weights {
            warnings.push(item.fault("its node has a matrix with shear, which is dropped while it plays"));
        }
    }

    /// A channel; `None` without a node, which moves nothing; or why it cannot be played, in words.
    fn read_channel(
        &self,
        sampler: &Item<'_>,
        target: &Item<'_>,
    ) -> Result<Result<Option<Channel>, String>, Fault> {
        let path = target.text("path")?.unwrap_or_default();
        let path = match path {
            "translation" => ChannelPath::Translation,
            "rotation" => ChannelPath::Rotation,
            "scale" => ChannelPath::Scale,
            "weights" => ChannelPath::Weights,
            "pointer" => {
                let extension = target.extension("KHR_animation_pointer")?;
                let pointer = extension.and_then(|e| e.text("pointer").ok().flatten()).unwrap_or_default();
                return Ok(Err(format!("KHR_animation_pointer is not played ({pointer})")));
            }
            other => return Ok(Err(format!("path {other:?} does not exist"))),
        };
        let Some(node) = target.size("node")? else {
            return Ok(Ok(None));
        };
        let Some(part) = self.tree.part_of_node.get(node).copied().flatten() else {
            return Ok(Err(format!("node {node} is not in the scene")));
        };
        let interpolation = match sampler.text("interpolation")? {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => return Ok(Err(format!("interpolation {other:?} does not exist"))),
        };
        let width = match path {
            ChannelPath::Translation | ChannelPath::Scale => 3,
            ChannelPath::Rotation => 4,
            ChannelPath::Weights => self.target_count(part),
        };
        if width == 0 {
            return Ok(Err(format!("the mesh of node {node} has no morph targets")));
        }
        let (times_s, values) = (self.read_times(sampler)?, self.read_values(sampler, path)?);
        let channel = match (times_s, values) {
            (Ok(times_s), Ok(values)) => Channel { part, path, interpolation, times_s, values },
            (Err(reason), _) | (_, Err(reason)) => return Ok(Err(reason)),
        };
        Ok(sound(&channel, width).map(|()| Some(channel)))
    }

    fn target_count(&self, part: u32) -> usize {
        let mesh = self.tree.parts.get(part as usize).and_then(|part| part.mesh);
        mesh.and_then(|mesh| self.meshes.get(mesh.0 as usize)).map_or(0, |mesh| mesh.data.morph.len())
    }

    fn read_times(&self, sampler: &Item<'_>) -> Result<Result<Vec<f32>, String>, Fault> {
        let index = sampler.required_size("input")?;
        let accessor = self.accessors.get(index)?;
        if accessor.component != Component::F32 || accessor.width != 1 {
            return Ok(Err(format!("accessor {index} of its times has no single floats")));
        }
        let times_s: Vec<f32> = self.accessors.floats::<1>(index, 0.0)?.into_iter().flatten().collect();
        let grow = times_s.array_windows::<2>().all(|[a, b]| a < b);
        Ok(match grow && times_s.iter().all(|time_s| time_s.is_finite()) {
            true => Ok(times_s),
            false => Err(format!("the times in accessor {index} do not grow")),
        })
    }

    fn read_values(&self, sampler: &Item<'_>, path: ChannelPath) -> Result<Result<Vec<f32>, String>, Fault> {
        let index = sampler.required_size("output")?;
        let accessor = self.accessors.get(index)?;
        let wanted = match path {
            ChannelPath::Translation | ChannelPath::Scale => 3,
            ChannelPath::Rotation => 4,
            ChannelPath::Weights => 1,
        };
        if accessor.is_matrix || accessor.width != wanted || accessor.component == Component::U32 {
            return Ok(Err(format!("accessor {index} of its values has the wrong type")));
        }
        let values = self.accessors.floats::<4>(index, 0.0)?;
        let values: Vec<f32> = values.iter().flat_map(|value| value.iter().take(wanted)).copied().collect();
        Ok(match values.iter().all(|value| value.is_finite()) {
            true => Ok(values),
            false => Err(format!("a value in accessor {index} is not finite")),
        })
    }
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
