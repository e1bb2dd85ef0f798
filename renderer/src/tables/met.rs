//! Whether a delta changes what any ray can meet: what is hidden or has no size may come, change and go, and others stay as they are.
//! Asked before the delta is applied.

use glam::Affine3A;

use super::{Tables, is_degenerate};
use crate::delta::{Instance, InstanceId, MaterialId, SceneDelta, TextureId, Visibility};

/// True: the image is another, as far as one can tell without rendering it.
pub(crate) fn changes_image(delta: &SceneDelta, tables: &Tables) -> bool {
    delta.render_origin_changed
        || !delta.lights.is_empty()
        || !delta.removed_lights.is_empty()
        || delta.environment.is_some()
        || instances_change(delta, tables)
        || assets_change(delta, tables)
}

fn instances_change(delta: &SceneDelta, tables: &Tables) -> bool {
    let entry = |id: &InstanceId| tables.instances.slot_of(*id).and_then(|slot| tables.instances.get(slot));
    let met = |id: &InstanceId| tables.instances.is_met(*id);
    let will_be_met = |new: &Instance| new.visibility.shown && !is_degenerate(&new.render_from_mesh);
    let moves = |id: &InstanceId, map: &Affine3A| {
        entry(id).is_none_or(|entry| {
            let solid = !(entry.degenerate && is_degenerate(map));
            solid && entry.instance.visibility.shown && entry.instance.render_from_mesh != *map
        })
    };
    let shows = |id: &InstanceId, new: &Visibility| {
        entry(id).is_none_or(|entry| {
            let old = entry.instance.visibility;
            !entry.degenerate && (old.shown || new.shown) && old != *new
        })
    };
    delta.instances.iter().any(|(id, new)| met(id) || will_be_met(new))
        || delta.removed_instances.iter().any(met)
        || delta.transforms.iter().any(|(id, map)| moves(id, map))
        || delta.visibility.iter().any(|(id, new)| shows(id, new))
        || delta.poses.iter().any(|(id, pose)| met(id) && !tables.deforming.is_in_pose(*id, pose))
}

/// Only what a met instance uses counts: one that comes with its assets counts itself.
fn assets_change(delta: &SceneDelta, tables: &Tables) -> bool {
    let mut meshes =
        delta.meshes.iter().map(|(id, _)| id).chain(delta.primitive_transforms.iter().map(|(id, ..)| id));
    let repainted = |(id, new): &(MaterialId, _)| {
        tables.instances.met_materials().contains_key(id) && tables.materials.get(*id) != Some(new)
    };
    let textured = |id: &TextureId| {
        let materials = tables.instances.met_materials().keys();
        let uses = |material: &MaterialId| {
            tables
                .materials
                .get(*material)
                .is_some_and(|found| found.textures().any(|used| used.texture == *id))
        };
        materials.into_iter().any(uses)
    };
    meshes.any(|id| tables.instances.meets_mesh(*id))
        || delta.materials.iter().any(repainted)
        || delta.textures.iter().any(|(id, _)| textured(id))
        || delta.removed_textures.iter().any(textured)
}
