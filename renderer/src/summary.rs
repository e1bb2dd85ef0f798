//! What the scene on the device holds, kept up to date for `needs`. Enters: a delta that the tables have taken in. Leaves: a
//! `SceneSummary`. Its work is that of the change: a part of the scene that the delta does not name is not looked at.

use crate::delta::SceneDelta;
use crate::needs::{SceneSummary, SurfaceTally};
use crate::tables::Tables;

/// The summary and what it is made of.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    scene: SceneSummary,
    surfaces: SurfaceTally,
}

impl Summary {
    /// What the scene holds.
    pub(crate) fn scene(&self) -> &SceneSummary {
        &self.scene
    }

    /// Follows a delta. `afresh`: the one before may be in by half, so that everything is looked at.
    pub(crate) fn follow(&mut self, delta: &SceneDelta, tables: &mut Tables, afresh: bool) {
        let scene = &mut self.scene;
        // A move alone can give an emitter a size, or take it.
        scene.emissive_triangles = tables.emissive.len();
        if afresh || !(delta.lights.is_empty() && delta.removed_lights.is_empty()) {
            scene.lights = tables.lights.len();
            scene.all_lights_hard = tables.lights.all_hard();
        }
        if afresh || delta.environment.is_some() {
            scene.environment = tables.environment.shines();
            scene.environment_map = tables.environment.is_map() && scene.environment;
        }
        if afresh || !(delta.meshes.is_empty() && delta.removed_meshes.is_empty()) {
            scene.shapes = tables.meshes.hold_shapes();
        }
        let mut touched = tables.instances.take_newly_used();
        touched.extend(delta.materials.iter().map(|(id, _)| *id));
        if afresh {
            self.surfaces = SurfaceTally::default();
            touched.extend(tables.instances.materials_in_use());
        }
        if !touched.is_empty() {
            for id in touched {
                let material = tables.materials.get(id).filter(|_| tables.instances.uses_material(id));
                self.surfaces.set(id, material);
            }
            self.scene.surfaces = self.surfaces.summary();
        }
    }
}
