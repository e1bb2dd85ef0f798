//! Takes a delta into the tables: first what instances refer to, then the instances, then what follows for those that the
//! delta does not name. Its work is that of the change; a mesh that is replaced or a material that becomes another kind
//! costs one walk over the instances.

use std::collections::BTreeSet;

use caustica_gpu::{Access, Recorder, Stage, Use};

use super::materials::MaterialChange;
use super::{Changed, Slot, Tables};
use crate::delta::{InstanceId, MaterialId, MeshId, SceneDelta};
use crate::error::Result;

/// Meshes and materials whose instances must be looked at, though the delta does not name them.
#[derive(Debug, Default)]
struct Others {
    /// Replaced, or with a primitive that was turned over.
    meshes: BTreeSet<MeshId>,
    /// Of another kind than before.
    materials: BTreeSet<MaterialId>,
    /// They began or ended to shine.
    shining: BTreeSet<MaterialId>,
}

impl Tables {
    /// Takes a delta in and adds to `changed`; the caller uploads with [`Self::flush`] in the same frame.
    ///
    /// # Errors
    /// When the delta names what is not there, or memory runs out.
    pub(crate) fn apply(
        &mut self,
        recorder: &mut Recorder,
        delta: &SceneDelta,
        changed: &mut Changed,
    ) -> Result<()> {
        let mut others = Others::default();
        self.apply_meshes(recorder, delta, changed, &mut others)?;
        self.apply_materials(recorder, delta, &mut others)?;
        let mut redrawn = self.apply_instances(delta, changed)?;
        self.follow_others(&others, changed, &mut redrawn)?;
        self.follow_shine(&others.shining);
        // Last: a pose is for the mesh as it is now.
        for (id, pose) in &delta.poses {
            self.deforming.set_pose(*id, pose)?;
        }
        for id in &delta.removed_meshes {
            self.meshes.remove(*id);
        }
        self.lights.apply(delta);
        if let Some(environment) = &delta.environment {
            self.environment.set(recorder, environment)?;
        }
        for slot in redrawn {
            self.draws.follow(slot, &self.instances, &self.materials, &self.meshes);
            self.emissive.follow(slot, &self.instances, &self.materials);
        }
        if !delta.removed_instances.is_empty() {
            self.instances.tidy();
            self.draws.tidy();
        }
        self.emissive.update(&self.instances, &self.materials, &self.meshes);
        Ok(())
    }

    fn apply_meshes(
        &mut self,
        recorder: &mut Recorder,
        delta: &SceneDelta,
        changed: &mut Changed,
        others: &mut Others,
    ) -> Result<()> {
        if !delta.meshes.is_empty() || !delta.textures.is_empty() {
            recorder.declare(&[Use::Group(self.geometry_group, Stage::Transfer, Access::TransferWrite)]);
        }
        for (id, mesh) in &delta.meshes {
            if self.meshes.set(recorder, *id, mesh)? {
                others.meshes.insert(*id);
            }
            changed.meshes.insert(*id);
        }
        for (id, geometry, map) in &delta.primitive_transforms {
            let moved = self.meshes.set_primitive(*id, *geometry, map)?;
            if moved.turned_over {
                others.meshes.insert(*id);
            }
            self.deforming.set_primitive(*id, *geometry, &moved.map);
            changed.reshaped.insert(*id);
            if self.emissive.places(*id, &self.instances) {
                self.emissive.mark_stale();
            }
        }
        Ok(())
    }

    fn apply_materials(
        &mut self,
        recorder: &mut Recorder,
        delta: &SceneDelta,
        others: &mut Others,
    ) -> Result<()> {
        for (id, texture) in &delta.textures {
            self.textures.set(*id, texture)?;
        }
        for id in &delta.removed_textures {
            self.textures.remove(*id);
        }
        if !delta.textures.is_empty() {
            self.textures.fit_new(recorder)?;
        }
        for (id, material) in &delta.materials {
            match self.materials.set(*id, material, &self.textures) {
                MaterialChange::Values => {}
                MaterialChange::Emission => self.emissive.mark_stale(),
                MaterialChange::Shine => _ = others.shining.insert(*id),
                MaterialChange::Kind => {
                    others.materials.insert(*id);
                }
            }
        }
        for id in &delta.removed_materials {
            self.materials.remove(*id);
        }
        Ok(())
    }

    /// Returns the slots that are drawn differently from now on.
    fn apply_instances(&mut self, delta: &SceneDelta, changed: &mut Changed) -> Result<BTreeSet<u32>> {
        let mut redrawn = BTreeSet::new();
        for id in &delta.removed_instances {
            changed.reused.extend(self.instances.remove(*id));
            self.deforming.remove(*id);
        }
        redrawn.extend(&changed.reused);
        for (id, instance) in &delta.instances {
            self.deforming.set(*id, instance, &self.meshes)?;
            let old = self.instances.slot_of(*id).and_then(|slot| self.instances.get(slot));
            let takes_place = old.is_none_or(|old| old.instance.mesh != instance.mesh);
            let slot = self.instances.set(*id, instance, &self.meshes, &self.materials)?;
            changed.reused.extend(takes_place.then_some(slot));
            self.instances.set_geometries(slot, self.geometries_of(*id, instance.mesh)?);
            redrawn.insert(slot);
        }
        for (id, visibility) in &delta.visibility {
            redrawn.insert(self.instances.set_visibility(*id, *visibility)?);
        }
        changed.slots.extend(&redrawn);
        for (id, transform) in &delta.transforms {
            let (slot, turned) = self.instances.set_transform(*id, *transform)?;
            changed.moved.push(slot);
            self.emissive.follow_transform(slot, &self.instances);
            if turned {
                redrawn.insert(slot);
            }
        }
        Ok(redrawn)
    }

    fn follow_others(
        &mut self,
        others: &Others,
        changed: &mut Changed,
        redrawn: &mut BTreeSet<u32>,
    ) -> Result<()> {
        if others.meshes.is_empty() && others.materials.is_empty() {
            return Ok(());
        }
        for (_, entry) in
            self.instances.iter().filter(|(_, entry)| others.meshes.contains(&entry.instance.mesh))
        {
            self.deforming.follow_mesh(entry.id, &entry.instance, &self.meshes)?;
        }
        let named = |entry: &Slot| {
            others.meshes.contains(&entry.instance.mesh)
                || entry.instance.materials.iter().any(|id| others.materials.contains(id))
        };
        let found: Vec<(u32, InstanceId, MeshId)> = self
            .instances
            .iter()
            .filter(|(_, entry)| named(entry))
            .map(|(slot, entry)| (slot, entry.id, entry.instance.mesh))
            .collect();
        for (slot, id, mesh) in found {
            self.instances.check_materials(slot, &self.meshes)?;
            self.instances.set_geometries(slot, self.geometries_of(id, mesh)?);
            changed.slots.insert(slot);
            redrawn.insert(slot);
        }
        Ok(())
    }

    /// Rays meet what begins or ends to shine as before: the emitters alone are others.
    fn follow_shine(&mut self, materials: &BTreeSet<MaterialId>) {
        if materials.is_empty() {
            return;
        }
        for (slot, entry) in self.instances.iter() {
            if entry.instance.materials.iter().any(|id| materials.contains(id)) {
                self.emissive.follow(slot, &self.instances, &self.materials);
            }
        }
    }

    /// Address of the geometry records of an instance: its own when it deforms, else those of its mesh.
    pub(crate) fn geometries_of(&self, id: InstanceId, mesh: MeshId) -> Result<u64> {
        match self.deforming.get(id) {
            Some(deforming) => Ok(deforming.geometries_address()),
            None => Ok(self.meshes.get(mesh)?.geometries_address()),
        }
    }
}
