//! What a pointer of `KHR_animation_pointer` means: nodes, meshes, materials, lights and cameras, by their places in
//! the file. In: the pointer. Out: what channels change, or nothing where that cannot be animated.

use super::super::check;
use super::super::foreign::{numbers_of, spare_cameras, spare_lights};
use super::super::json::{Fault, Item};
use super::{Reader, Targets};
use crate::animation::{ChannelPath, Property};
use crate::assets::{Camera, Light, Material};
use crate::foreign::{KeptChannel, Pointed};
use crate::ids::MaterialId;

const LIGHTS: &str = "/extensions/KHR_lights_punctual/lights/";

impl Reader<'_> {
    /// `None`: it cannot be animated. None in the list: nothing in the scene has it.
    pub(super) fn pointed_at(&self, pointer: &str) -> Result<Option<Targets>, Fault> {
        if let Some((node, rest)) = split(pointer, "/nodes/") {
            let path = match rest {
                "translation" => ChannelPath::Translation,
                "rotation" => ChannelPath::Rotation,
                "scale" => ChannelPath::Scale,
                "weights" => ChannelPath::Weights,
                "extensions/KHR_node_visibility/visible" => ChannelPath::Visibility,
                _ => return Ok(None),
            };
            let is_there = self.nodes.get(node).is_some();
            let parts = is_there.then(|| self.parts(path, |index, _| Ok(index == node)));
            return parts.transpose();
        }
        if let Some((mesh, "weights")) = split(pointer, "/meshes/") {
            return self
                .parts(ChannelPath::Weights, |_, node| Ok(node.size("mesh")? == Some(mesh)))
                .map(Some);
        }
        if let Some((material, rest)) = split(pointer, "/materials/") {
            let property = Property::find::<Material>(rest).filter(|_| material < self.materials.len());
            let id = MaterialId(material as u64);
            return Ok(property.map(|property| vec![(0, ChannelPath::Material(id, property))]));
        }
        if let Some((light, rest)) = split(pointer, LIGHTS) {
            let Some(property) = Property::find::<Light>(rest) else { return Ok(None) };
            let is_it = |node: &Item<'_>| match node.extension("KHR_lights_punctual")? {
                Some(extension) => Ok(extension.size("light")? == Some(light)),
                None => Ok(false),
            };
            return self.parts(ChannelPath::Light(property), |_, node| is_it(node)).map(Some);
        }
        if let Some((camera, rest)) = split(pointer, "/cameras/") {
            let Some(property) = Property::find::<Camera>(rest) else { return Ok(None) };
            let is_it = |node: &Item<'_>| Ok(node.size("camera")? == Some(camera));
            return self.parts(ChannelPath::Camera(property), |_, node| is_it(node)).map(Some);
        }
        Ok(None)
    }

    /// A channel of a pointer that cannot be played, for an export to write it again; `None` where it points at nothing
    /// that an export has.
    pub(super) fn unplayed(
        &self,
        sampler: &Item<'_>,
        target: &Item<'_>,
    ) -> Result<Option<KeptChannel>, Fault> {
        let extension = target.extension("KHR_animation_pointer")?;
        let pointer = match extension.filter(|_| target.raw("path").is_some_and(|path| path == "pointer")) {
            Some(extension) => extension.text("pointer")?.unwrap_or_default(),
            None => return Ok(None),
        };
        let Some((of, rest)) = self.place_of(pointer) else { return Ok(None) };
        if self.read_times(sampler)?.is_err() {
            return Ok(None);
        }
        Ok(Some(KeptChannel {
            of,
            pointer: rest.to_owned(),
            interpolation: sampler.text("interpolation")?.map(str::to_owned),
            input: self.accessors.numbers(sampler.required_size("input")?, false)?,
            output: self.accessors.numbers(sampler.required_size("output")?, false)?,
        }))
    }

    /// What a pointer points into, and what follows.
    fn place_of<'p>(&self, pointer: &'p str) -> Option<(Pointed, &'p str)> {
        if let Some((node, rest)) = split(pointer, "/nodes/") {
            return Some((Pointed::Part(self.tree.part_of_node.get(node).copied().flatten()?), rest));
        }
        if let Some((mesh, rest)) = split(pointer, "/meshes/") {
            return (mesh < self.meshes.len()).then_some((Pointed::Mesh(mesh), rest));
        }
        if let Some((material, rest)) = split(pointer, "/materials/") {
            return (material < self.materials.len()).then_some((Pointed::Material(material), rest));
        }
        if let Some((light, rest)) = split(pointer, LIGHTS) {
            let carried = numbers_of(&self.tree.light_of).get(&light).copied();
            let spare = || spare_lights(&self.lights, self.tree).iter().position(|&place| place == light);
            let of = carried.map(Pointed::Light).or_else(|| spare().map(Pointed::SpareLight));
            return Some((of?, rest));
        }
        if let Some((camera, rest)) = split(pointer, "/cameras/") {
            let carried = numbers_of(&self.tree.camera_of).get(&camera).copied();
            let spare = || spare_cameras(&self.cameras, self.tree).iter().position(|&place| place == camera);
            let of = carried.map(Pointed::Camera).or_else(|| spare().map(Pointed::SpareCamera));
            return Some((of?, rest));
        }
        let rest = pointer.strip_prefix("/extensions/")?;
        let is_kept = !check::is_read(rest.split('/').next()?);
        is_kept.then_some((Pointed::File, pointer.strip_prefix('/')?))
    }

    /// The parts of the scene whose nodes are wanted, each with the path.
    fn parts(
        &self,
        path: ChannelPath,
        is_wanted: impl Fn(usize, &Item<'_>) -> Result<bool, Fault>,
    ) -> Result<Targets, Fault> {
        let mut targets = Targets::new();
        for (index, (node, part)) in self.nodes.iter().zip(&self.tree.part_of_node).enumerate() {
            if let Some(part) = part
                && is_wanted(index, node)?
            {
                targets.push((*part, path));
            }
        }
        targets.sort_unstable();
        Ok(targets)
    }
}

/// The number behind a prefix, and what follows it. A number has no sign and no zeros before it (RFC 6901, section 4).
fn split<'a>(pointer: &'a str, prefix: &str) -> Option<(usize, &'a str)> {
    let (number, rest) = pointer.strip_prefix(prefix)?.split_once('/')?;
    let place = number.parse::<usize>().ok()?;
    (place.to_string() == number).then_some((place, rest))
}
