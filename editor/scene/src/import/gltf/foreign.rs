//! What the reader does not know and an export shall say again: `extras` and unknown extensions, as they stand.
//! In: JSON and the tree. Out: [`Foreign`]. Extensions whose values point into the lists of the file are not kept, but
//! counted: an export numbers the lists anew.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::carried::{read_camera, read_light};
use super::check;
use super::extras;
use super::json::{Fault, Item};
use super::material::names_mode;
use super::mesh::Meshes;
use super::node::Tree;
use crate::foreign::{Foreign, Kept, KeptSkin, Unknown};
use crate::import::short;
use crate::prefab::SourceScene;

/// Extensions that hold indices of nodes, meshes, images, accessors or buffer views.
const POINTING: &[&str] = &[
    "CESIUM_primitive_outline",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "EXT_texture_avif",
    "KHR_audio_emitter",
    "KHR_interactivity",
    "KHR_physics_rigid_bodies",
    "MSFT_lod",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
    "MSFT_texture_dds",
];

/// Collects what is kept of a file. `skins`: which of those of the file were read.
pub(super) fn read(
    root: &Item<'_>,
    meshes: &mut Meshes,
    tree: &mut Tree,
    skins: &[Option<u32>],
) -> Result<Foreign, Fault> {
    let mut foreign = Foreign {
        file: unknown(root, &[]),
        variants: match root.extension("KHR_materials_variants")? {
            Some(extension) => {
                let variants = extension.objects("variants")?;
                variants.iter().map(|item| variant(item, &mut tree.warnings)).collect()
            }
            None => Vec::new(),
        },
        instanced: std::mem::take(&mut tree.instanced),
        mappings: std::mem::take(&mut meshes.variants),
        primitives: std::mem::take(&mut meshes.unknown),
        loose: std::mem::take(&mut meshes.loose),
        loose_parts: std::mem::take(&mut tree.loose_parts),
        lost: std::mem::take(&mut meshes.lost),
        ..Foreign::default()
    };
    for what in std::mem::take(&mut tree.lost) {
        *foreign.lost.entry(what).or_default() += 1;
    }
    // Read on its own.
    foreign.file.within.remove("asset");
    if let Some(asset) = root.child("asset")? {
        foreign.copyright = asset.text("copyright")?.map(str::to_owned);
        foreign.asset = unknown(&asset, &[]);
    }
    let scenes = root.objects("scenes")?;
    foreign.scenes = scenes.iter().zip(&tree.scenes).map(|(item, scene)| of_scene(item, scene)).collect();
    foreign.scenes.resize(tree.scenes.len(), Unknown::default());
    for (node, item) in root.objects("nodes")?.iter().enumerate() {
        let part = tree.part_of_node.get(node).copied().flatten();
        if let Some((part, kept)) = part.zip(some_unknown(item, &[])) {
            foreign.parts.insert(part, kept);
        }
    }
    for (mesh, item) in root.objects("meshes")?.iter().enumerate() {
        foreign.meshes.extend(some_unknown(item, named_targets(item)).map(|kept| (mesh, kept)));
    }
    for (material, item) in root.objects("materials")?.iter().enumerate() {
        let mut read = extras::numbers(item, &["volumePriority"]);
        read.extend(names_mode(item).then_some("shadingMode"));
        let kept = some_unknown(item, &read);
        foreign.materials.extend(kept.map(|kept| (material, kept)));
    }
    for (clip, item) in root.objects("animations")?.iter().enumerate() {
        foreign.clips.extend(some_unknown(item, &[]).map(|kept| (clip, kept)));
    }
    for (item, place) in root.objects("skins")?.iter().zip(skins) {
        let Some(place) = *place else { continue };
        let skeleton = item.size("skeleton")?.and_then(|node| tree.part_of_node.get(node).copied().flatten());
        let kept = KeptSkin { name: item.name()?, unknown: unknown(item, &[]), skeleton };
        foreign.skins.insert(place as usize, kept);
    }
    let (lights, cameras) = carried(root)?;
    warn_about_spare(&lights, &cameras, tree);
    foreign.lights = kept_of(&tree.light_of, &lights)?;
    foreign.cameras = kept_of(&tree.camera_of, &cameras)?;
    let values = |items: &[Item<'_>], spare: &[usize]| {
        spare.iter().filter_map(|&place| items.get(place)).map(|item| item.value().clone()).collect()
    };
    foreign.spare_lights = values(&lights, &spare_lights(&lights, tree));
    foreign.spare_cameras = values(&cameras, &spare_cameras(&cameras, tree));
    let cameras_kept = numbers_of(&tree.camera_of).len() + foreign.spare_cameras.len();
    if cameras_kept < cameras.len() {
        let what = "a camera that cannot be used".to_owned();
        foreign.lost.insert(what, cameras.len() - cameras_kept);
    }
    count_pointing(root.value(), &mut foreign.lost);
    Ok(foreign)
}

/// A variant of materials as it stands; a name that is no text is left out.
fn variant(item: &Item<'_>, warnings: &mut Vec<Fault>) -> Value {
    let mut value = item.value().clone();
    if let Err(fault) = item.text("name") {
        warnings.push(Fault::new(fault.place, format!("{}; it is called by its number", fault.reason)));
        value.as_object_mut().and_then(|members| members.shift_remove("name"));
    }
    value
}

/// The lists of lights and of cameras.
pub(super) fn carried<'a>(root: &Item<'a>) -> Result<(Vec<Item<'a>>, Vec<Item<'a>>), Fault> {
    let lights = match root.extension("KHR_lights_punctual")? {
        Some(extension) => extension.objects("lights")?,
        None => Vec::new(),
    };
    Ok((lights, root.objects("cameras")?))
}

fn of_scene(item: &Item<'_>, scene: &SourceScene) -> Unknown {
    unknown(item, if scene.environment.is_some() { &["environment"] } else { &[] })
}

/// Names of targets that a mesh has: an array.
fn named_targets(mesh: &Item<'_>) -> &'static [&'static str] {
    let names = mesh.get("extras").and_then(|extras| extras.raw("targetNames"));
    if names.is_some_and(Value::is_array) { &["targetNames"] } else { &[] }
}

/// What is kept of the lights or cameras that parts carry. `carried`: by part.
fn kept_of(carried: &BTreeMap<u32, usize>, items: &[Item<'_>]) -> Result<BTreeMap<u32, Kept>, Fault> {
    let numbers = numbers_of(carried);
    let mut kept = BTreeMap::new();
    for (&part, index) in carried {
        let Some((item, &number)) = items.get(*index).zip(numbers.get(index)) else { continue };
        let size = if item.text("type")? == Some("directional") { "angle" } else { "radius" };
        kept.insert(
            part,
            Kept { number, name: item.name()?, unknown: unknown(item, &extras::numbers(item, &[size])) },
        );
    }
    Ok(kept)
}

/// Places of the lights that no part carries.
pub(super) fn spare_lights(lights: &[Item<'_>], tree: &Tree) -> Vec<usize> {
    let carried = numbers_of(&tree.light_of);
    (0..lights.len()).filter(|place| !carried.contains_key(place)).collect()
}

/// Places of the cameras that no part carries and that can be used.
pub(super) fn spare_cameras(cameras: &[Item<'_>], tree: &Tree) -> Vec<usize> {
    let carried = numbers_of(&tree.camera_of);
    let usable = |item: &Item<'_>| matches!(read_camera(item, &mut Vec::new()), Ok(Some(_)));
    let spare =
        cameras.iter().enumerate().filter(|(place, item)| !carried.contains_key(place) && usable(item));
    spare.map(|(place, _)| place).collect()
}

/// What is wrong with lights and cameras that no node carries: exports have them as they stand.
fn warn_about_spare(lights: &[Item<'_>], cameras: &[Item<'_>], tree: &mut Tree) {
    let mut found = Vec::new();
    for light in spare_lights(lights, tree).into_iter().filter_map(|place| lights.get(place)) {
        let read = read_light(light, None, &mut found);
        found.extend(read.err());
    }
    for camera in spare_cameras(cameras, tree).into_iter().filter_map(|place| cameras.get(place)) {
        let read = read_camera(camera, &mut found);
        found.extend(read.err());
    }
    let said = "no node carries it, so that exports have it as it stands";
    tree.warnings
        .extend(found.into_iter().map(|fault| Fault::new(fault.place, format!("{}; {said}", fault.reason))));
}

/// The numbers that [`Kept`] gives to what parts carry, by place in the file.
pub(super) fn numbers_of(carried: &BTreeMap<u32, usize>) -> BTreeMap<usize, usize> {
    let mut numbers = BTreeMap::new();
    for &index in carried.values() {
        let next = numbers.len();
        numbers.entry(index).or_insert(next);
    }
    numbers
}

/// What is unknown about an object, if there is anything. `read`: the keys of its `extras` that are read.
fn some_unknown(item: &Item<'_>, read: &[&str]) -> Option<Unknown> {
    Some(unknown(item, read)).filter(|unknown| !unknown.is_empty())
}

/// What is unknown about an object and the objects in it.
pub(super) fn unknown(item: &Item<'_>, read: &[&str]) -> Unknown {
    item.value().as_object().map(|object| of_object(object, read)).unwrap_or_default()
}

fn of_object(object: &Map<String, Value>, read: &[&str]) -> Unknown {
    let is_kept = |name: &str| !check::is_read(name) && !POINTING.contains(&name);
    let extensions = || object.get("extensions").and_then(Value::as_object).into_iter().flatten();
    let extensions = || extensions().filter(|(_, value)| value.is_object());
    let known = extensions().filter(|(name, _)| check::is_read(name));
    let known = known.map(|(name, value)| (format!("extensions/{name}"), value));
    let members = object.iter().filter(|(name, _)| !["extras", "extensions"].contains(&name.as_str()));
    let members = members.map(|(name, value)| (name.clone(), value));
    let within = members.chain(known).filter_map(|(name, value)| Some((name, value.as_object()?)));
    let within = within.map(|(name, inner)| (name, of_object(inner, &[])));
    Unknown {
        extras: object.get("extras").and_then(|extras| without(extras, read)),
        extensions: filtered(extensions(), is_kept),
        within: within.filter(|(_, inner)| !inner.is_empty()).collect(),
    }
}

/// `extras` may be any value; `None` when nothing is left of an object.
fn without(extras: &Value, read: &[&str]) -> Option<Value> {
    let Some(object) = extras.as_object() else {
        return Some(extras.clone());
    };
    let left = filtered(object, |key| !read.contains(&key));
    let emptied = left.is_empty() && !object.is_empty();
    (!emptied).then_some(Value::Object(left))
}

fn filtered<'a>(
    members: impl IntoIterator<Item = (&'a String, &'a Value)>,
    keep: impl Fn(&str) -> bool,
) -> Map<String, Value> {
    let kept = members.into_iter().filter(|(name, _)| keep(name));
    kept.map(|(name, value)| (name.clone(), value.clone())).collect()
}

/// Counts the extensions that point into the lists, wherever they are.
fn count_pointing(value: &Value, lost: &mut BTreeMap<String, usize>) {
    let mut stack = vec![value];
    while let Some(value) = stack.pop() {
        match value {
            Value::Array(items) => stack.extend(items),
            Value::Object(members) => {
                for (name, inner) in members.iter().filter(|(name, _)| *name != "extras") {
                    let pointing = name.as_str() == "extensions";
                    for (name, value) in inner.as_object().filter(|_| pointing).into_iter().flatten() {
                        if !value.is_object() {
                            *lost
                                .entry(format!("the extension {}, which is no object,", short(name)))
                                .or_default() += 1;
                        }
                        if POINTING.contains(&name.as_str()) {
                            *lost
                                .entry(format!("{name}, which points into the lists of the file"))
                                .or_default() += 1;
                        }
                    }
                    stack.push(inner);
                }
            }
            _ => {}
        }
    }
}
