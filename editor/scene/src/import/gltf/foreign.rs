//! What the reader does not know and an export shall say again: `extras` and unknown extensions, as they stand.
//! In: JSON and the tree. Out: [`Foreign`]. Extensions whose values point into the lists of the file are not kept:
//! an export numbers the lists anew.

use serde_json::{Map, Value};

use super::check;
use super::json::{Fault, Item};
use super::mesh::Meshes;
use super::node::{Tree, chosen_scene};
use crate::foreign::{Foreign, Unknown};

/// Extensions that hold indices of nodes, meshes, images or buffer views.
const POINTING: &[&str] = &[
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "KHR_audio_emitter",
    "KHR_interactivity",
    "KHR_physics_rigid_bodies",
    "MSFT_lod",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
];

/// Collects what is kept of a file.
pub(super) fn read(root: &Item<'_>, meshes: &mut Meshes, tree: &mut Tree) -> Result<Foreign, Fault> {
    let mut foreign = Foreign {
        file: unknown(root, &[]),
        variants: match root.extension("KHR_materials_variants")? {
            Some(extension) => extension.objects("variants")?.iter().map(Item::value).cloned().collect(),
            None => Vec::new(),
        },
        instanced: std::mem::take(&mut tree.instanced),
        mappings: std::mem::take(&mut meshes.variants),
        ..Foreign::default()
    };
    if let Some(asset) = root.child("asset")? {
        foreign.copyright = asset.text("copyright")?.map(str::to_owned);
        foreign.asset = unknown(&asset, &[]);
    }
    if let Some(scene) = chosen_scene(root)? {
        let own = scene.get("extras").and_then(|extras| extras.get("environment"));
        let is_ours = own.is_some_and(|environment| environment.get("constantRadiance").is_some());
        foreign.scene = unknown(&scene, if is_ours { &["environment"] } else { &[] });
    }
    for (node, item) in root.objects("nodes")?.iter().enumerate() {
        let part = tree.part_of_node.get(node).copied().flatten();
        if let Some((part, kept)) = part.zip(some_unknown(item, &[])) {
            foreign.parts.insert(part, kept);
        }
    }
    for (mesh, item) in root.objects("meshes")?.iter().enumerate() {
        foreign.meshes.extend(some_unknown(item, &["targetNames"]).map(|kept| (mesh, kept)));
    }
    for (material, item) in root.objects("materials")?.iter().enumerate() {
        let kept = some_unknown(item, &["volumePriority", "shadingMode"]);
        foreign.materials.extend(kept.map(|kept| (material, kept)));
    }
    Ok(foreign)
}

/// What is unknown about an object, if there is anything. `read`: the keys of its `extras` that are read.
fn some_unknown(item: &Item<'_>, read: &[&str]) -> Option<Unknown> {
    Some(unknown(item, read)).filter(|unknown| !unknown.is_empty())
}

fn unknown(item: &Item<'_>, read: &[&str]) -> Unknown {
    let is_kept = |name: &str| !check::is_read(name) && !POINTING.contains(&name);
    let extensions = item.raw("extensions").and_then(Value::as_object);
    Unknown {
        extras: item.raw("extras").and_then(|extras| without(extras, read)),
        extensions: filtered(extensions.into_iter().flatten(), is_kept),
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
