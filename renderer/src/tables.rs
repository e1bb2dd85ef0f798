//! Set 0: the scene on the device. Enters: a `SceneDelta`. Leaves: tables by address, bindless textures, draw batches,
//! and what the acceleration structures and `needs` want to know. Only what changed is uploaded.

pub(crate) mod alias;
mod deformation;
#[expect(dead_code, reason = "the tables call it once they hold deforming instances")]
mod deforming;
mod draws;
mod emissive;
mod environment;
mod instances;
mod lights;
mod materials;
mod meshes;
mod spatial_order;
mod table;
mod textures;

use std::sync::Arc;

use caustica_gpu::{Access, Device, Recorder, ResourceId, Stage, Use};

pub(crate) use draws::Batch;
pub(crate) use instances::{Instances, Slot};
pub(crate) use materials::{Materials, emits, has_alpha, is_opaque, shows_both_sides, transmits};
pub(crate) use meshes::{Meshes, rows_of};
pub(crate) use spatial_order::order_of;
pub(crate) use table::Table;

use crate::delta::SceneDelta;
use crate::error::Result;
use crate::gpu_types;

use draws::Draws;
use emissive::Emissive;
use environment::EnvironmentTable;
use lights::Lights;
use textures::Textures;

/// What changed on the device by one delta, for the acceleration structures.
#[derive(Debug, Default)]
pub(crate) struct Changed {
    /// Instances were added, removed, or got another mesh, material opacity or visibility.
    pub(crate) structure: bool,
    /// Slots of which the transform changed.
    pub(crate) moved: Vec<u32>,
    /// Meshes that are new or changed.
    pub(crate) meshes: Vec<crate::delta::MeshId>,
}

/// The scene on the device.
pub(crate) struct Tables {
    pub(crate) meshes: Meshes,
    pub(crate) materials: Materials,
    pub(crate) textures: Textures,
    pub(crate) instances: Instances,
    pub(crate) lights: Lights,
    pub(crate) emissive: Emissive,
    pub(crate) environment: EnvironmentTable,
    pub(crate) draws: Draws,
    scene: Table<gpu_types::Scene>,
    /// Stands for every table in the barrier tracker: they are read by address, which no binding shows.
    group: ResourceId,
    geometry_group: ResourceId,
}

impl Tables {
    pub(crate) fn new(device: &Arc<Device>, recorder: &mut Recorder) -> Result<Self> {
        Ok(Self {
            meshes: Meshes::new(device),
            materials: Materials::new(device),
            textures: Textures::new(device, recorder)?,
            instances: Instances::new(device),
            lights: Lights::new(device),
            emissive: Emissive::new(device),
            environment: EnvironmentTable::new(device, recorder)?,
            draws: Draws::new(device),
            scene: Table::new(device, "scene"),
            group: device.new_resource_id(),
            geometry_group: device.new_resource_id(),
        })
    }

    /// Takes a delta in; the caller uploads with [`Self::flush`] in the same frame.
    ///
    /// # Errors
    /// When the delta names what is not there, or memory runs out.
    pub(crate) fn apply(&mut self, recorder: &mut Recorder, delta: &SceneDelta) -> Result<Changed> {
        let mut changed = Changed::default();
        if !delta.meshes.is_empty() || !delta.textures.is_empty() {
            recorder.declare(&[Use::Group(self.geometry_group, Stage::Transfer, Access::TransferWrite)]);
        }
        for (id, mesh) in &delta.meshes {
            self.meshes.set(recorder, *id, mesh)?;
            changed.meshes.push(*id);
        }
        for (id, texture) in &delta.textures {
            self.textures.set(recorder, *id, texture)?;
        }
        for id in &delta.removed_textures {
            self.textures.remove(*id);
        }
        let mut flipped = false;
        for (id, material) in &delta.materials {
            flipped |= self.materials.set(*id, material, &self.textures);
        }
        for id in &delta.removed_materials {
            self.materials.remove(*id);
        }
        for id in &delta.removed_instances {
            self.instances.remove(*id);
        }
        for (id, instance) in &delta.instances {
            self.instances.set(*id, instance, &self.meshes, &self.materials)?;
        }
        for (id, transform) in &delta.transforms {
            changed.moved.extend(self.instances.set_transform(*id, *transform)?);
        }
        for id in &delta.removed_meshes {
            self.meshes.remove(*id);
        }
        self.lights.apply(delta);
        if let Some(environment) = &delta.environment {
            self.environment.set(recorder, environment)?;
        }
        if !delta.meshes.is_empty() {
            self.instances.follow_meshes(&changed.meshes, &self.meshes)?;
        }
        let instances_changed = !delta.instances.is_empty() || !delta.removed_instances.is_empty();
        changed.structure = instances_changed || flipped || !delta.meshes.is_empty();
        if changed.structure || !delta.materials.is_empty() {
            self.draws.rebuild(&self.instances, &self.materials, &self.meshes);
            self.emissive.rebuild(&self.instances, &self.materials, &self.meshes);
        } else if !changed.moved.is_empty() {
            self.emissive.follow_transforms(&changed.moved, &self.instances, &self.materials, &self.meshes);
            self.draws.follow_mirrored(&changed.moved, &self.instances, &self.materials, &self.meshes);
        }
        Ok(changed)
    }

    /// Makes the previous transforms of what moved in the last frame equal to the present ones.
    pub(crate) fn settle_transforms(&mut self) {
        self.instances.settle();
    }

    /// Uploads every changed entry.
    ///
    /// # Errors
    /// When memory runs out.
    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        let waits = [
            self.instances.is_dirty(),
            self.materials.is_dirty(),
            self.lights.is_dirty(),
            self.emissive.is_dirty(),
            self.environment.is_dirty(),
            self.draws.is_dirty(),
        ];
        if waits.contains(&true) {
            recorder.declare(&[Use::Group(self.group, Stage::Transfer, Access::TransferWrite)]);
        }
        self.instances.flush(recorder)?;
        self.materials.flush(recorder)?;
        self.lights.flush(recorder)?;
        self.emissive.flush(recorder)?;
        self.environment.flush(recorder)?;
        self.draws.flush(recorder)?;
        let record = self.record();
        if self.scene.get(0) != Some(&record) {
            recorder.declare(&[Use::Group(self.group, Stage::Transfer, Access::TransferWrite)]);
            self.scene.set(0, record);
            self.scene.flush(recorder)?;
        }
        Ok(())
    }

    /// Device address of the `Scene` record.
    pub(crate) fn address(&self) -> u64 {
        self.scene.address()
    }

    /// The uses that every pass of the scene declares: tables, geometry and textures, read in `stage`.
    pub(crate) fn uses(&self, stage: Stage) -> [Use<'static>; 2] {
        [
            Use::Group(self.group, stage, Access::StorageRead),
            Use::Group(self.geometry_group, stage, Access::StorageRead),
        ]
    }

    /// The use of the vertices as input of acceleration structure builds.
    pub(crate) fn build_input(&self) -> Use<'static> {
        Use::Group(self.geometry_group, Stage::AccelBuild, Access::BuildInput)
    }

    fn record(&self) -> gpu_types::Scene {
        let (environment_width, environment_height) = self.environment.grid();
        gpu_types::Scene {
            instances: self.instances.address(),
            material_slots: self.instances.material_slots_address(),
            materials: self.materials.address(),
            lights: self.lights.address(),
            light_alias: self.lights.alias_address(),
            emissive_triangles: self.emissive.address(),
            emissive_alias: self.emissive.alias_address(),
            environment_alias: self.environment.alias_address(),
            draw_instances: self.draws.address(),
            light_count: self.lights.len(),
            emissive_count: self.emissive.len(),
            environment_width,
            environment_height,
            environment_radiance: self.environment.radiance(),
            environment_rotation_rad: self.environment.rotation_rad(),
        }
    }
}
