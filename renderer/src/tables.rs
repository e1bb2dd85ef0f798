//! Set 0: the scene on the device. Enters: a `SceneDelta`. Leaves: tables by address, bindless textures, draw batches,
//! and what the acceleration structures and `needs` want to know. Only what changed is uploaded.

pub(crate) mod alias;
mod apply;
mod deformation;
mod deforming;
mod draws;
mod emissive;
mod environment;
mod ggx_albedo;
mod instances;
mod lights;
mod lobes;
mod materials;
mod meshes;
mod met;
mod placement;
mod residency;
mod seen;
mod shapes;
mod sheen;
mod snapshot;
mod spatial_order;
mod table;
mod textures;

use std::collections::BTreeSet;
use std::sync::Arc;

use caustica_gpu::{Access, Device, Recorder, ResourceId, Stage, Use};

pub(crate) use draws::Batch;
pub(crate) use instances::{Instances, Slot, is_degenerate};
pub(crate) use materials::{Materials, emits, has_alpha, is_opaque, shows_both_sides, transmits};
pub(crate) use meshes::{MeshBuffers, Meshes, rows_of};
pub(crate) use met::changes_image;
pub use sheen::albedo_table as sheen_albedo_table;
pub(crate) use snapshot::Snapshot;
pub(crate) use spatial_order::order_of;
pub(crate) use table::{Download, Table};

use crate::delta::{Camera, InstanceId, MeshId};
use crate::error::Result;
use crate::gpu_types;
use crate::passes::ScenePasses;

use deforming::Deforming;
use draws::Draws;
use emissive::Emissive;
use environment::EnvironmentTable;
use lights::Lights;
use textures::Textures;

/// What changed on the device, for the acceleration structures.
#[derive(Debug, Default)]
pub(crate) struct Changed {
    /// Everything is to be looked at anew, after an error.
    pub(crate) all: bool,
    /// Slots that are new or free, or of another mesh, material or visibility.
    pub(crate) slots: BTreeSet<u32>,
    /// Slots that were taken, given up or given to another mesh: nothing there stands where it stood.
    pub(crate) reused: BTreeSet<u32>,
    /// Slots of which the transform changed.
    pub(crate) moved: Vec<u32>,
    /// Meshes with new content.
    pub(crate) meshes: BTreeSet<MeshId>,
    /// Meshes with primitives that moved.
    pub(crate) reshaped: BTreeSet<MeshId>,
    /// Instances whose vertices were evaluated anew.
    pub(crate) deformed: Vec<InstanceId>,
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
    pub(crate) deforming: Deforming,
    scene: Table<gpu_types::Scene>,
    /// Filled when the first view asks for it.
    ggx_albedo: Table<f32>,
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
            deforming: Deforming::new(device),
            scene: Table::new(device, "scene"),
            ggx_albedo: Table::new(device, "GGX albedo"),
            group: device.new_resource_id(),
            geometry_group: device.new_resource_id(),
        })
    }

    /// A frame has gone by: what moved in it has its present place as its previous one.
    pub(crate) fn settle(&mut self) {
        self.instances.settle();
        self.meshes.settle();
        self.deforming.settle();
    }

    /// Uploads every changed entry and evaluates every new pose; adds the instances that changed shape to `changed`.
    ///
    /// # Errors
    /// When memory runs out.
    pub(crate) fn flush(
        &mut self,
        recorder: &mut Recorder,
        passes: &ScenePasses,
        changed: &mut Changed,
    ) -> Result<()> {
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
        if self.meshes.is_dirty() {
            recorder.declare(&[Use::Group(self.geometry_group, Stage::Transfer, Access::TransferWrite)]);
            self.meshes.flush(recorder)?;
        }
        self.meshes.make_boxes(recorder, &passes.shape_boxes, self.geometry_group)?;
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
        changed.deformed.extend(self.deforming.record(recorder, &passes.deform, self.geometry_group)?);
        Ok(())
    }

    /// Gives textures the room that is left once everything has been at rest for some frames. True: the picture is another.
    ///
    /// # Errors
    /// When memory runs out.
    pub(crate) fn settle_textures(
        &mut self,
        recorder: &mut Recorder,
        at_rest: bool,
        views: &[(Camera, [u32; 2])],
    ) -> Result<bool> {
        self.textures.note(at_rest);
        if !self.textures.may_settle() {
            return Ok(false);
        }
        recorder.declare(&[Use::Group(self.geometry_group, Stage::Transfer, Access::TransferWrite)]);
        let seen_px = seen::sizes_px(self, views);
        let pixels = views.iter().map(|(_, extent)| u64::from(extent[0]) * u64::from(extent[1])).max();
        let read_back_bytes = pixels.unwrap_or(0) * size_of::<gpu_types::AccumulatorPixel>() as u64;
        self.textures.settle(recorder, &seen_px, read_back_bytes)
    }

    /// Uploads the table of what rough interfaces reflect at once, where it is not there yet.
    ///
    /// # Errors
    /// When memory runs out.
    pub(crate) fn provide_ggx_albedo(&mut self, recorder: &mut Recorder) -> Result<()> {
        if self.ggx_albedo.len() == 0 {
            self.ggx_albedo.replace(ggx_albedo::table());
            recorder.declare(&[Use::Group(self.group, Stage::Transfer, Access::TransferWrite)]);
        }
        self.ggx_albedo.flush(recorder)
    }

    /// Device address of that table; 0: it is not there.
    pub(crate) fn ggx_albedo_address(&self) -> u64 {
        self.ggx_albedo.address()
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

    /// The uses of a copy of the tables back to the host.
    pub(crate) fn download_uses(&self) -> [Use<'static>; 2] {
        [self.group, self.geometry_group].map(|id| Use::Group(id, Stage::Transfer, Access::TransferRead))
    }

    /// The use of the vertices as input of acceleration structure builds.
    pub(crate) fn build_input(&self) -> Use<'static> {
        Use::Group(self.geometry_group, Stage::AccelBuild, Access::BuildInput)
    }

    /// A copy of what a build in the background reads: of a mesh, or of an instance of it that deforms.
    pub(crate) fn snapshot(
        &self,
        recorder: &mut Recorder,
        mesh: MeshId,
        deforming: Option<InstanceId>,
    ) -> Result<Snapshot> {
        let mesh = self.meshes.get(mesh)?;
        let posed = deforming.and_then(|id| self.deforming.get(id));
        if let Some(shapes) = &mesh.shapes {
            return Snapshot::of_shapes(recorder, shapes, self.geometry_group);
        }
        let (records, positions) = match posed {
            Some(posed) => (&posed.geometries, Some(&posed.positions)),
            None => (&mesh.geometries, None),
        };
        Snapshot::of_triangles(recorder, &mesh.vertices, records, positions, self.geometry_group)
    }

    /// Records the copy of the `Scene` record back to the host.
    pub(crate) fn download_scene(&self, recorder: &mut Recorder) -> Result<Download> {
        self.scene.download(recorder)
    }

    /// What all shaders begin with, as the tables are now.
    pub(crate) fn record(&self) -> gpu_types::Scene {
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
            material_lobes: self.materials.lobes_address(),
            sheen_albedo: self.materials.sheen_albedo_address(),
            light_count: self.lights.len(),
            emissive_count: self.emissive.len(),
            environment_width,
            environment_height,
            environment_radiance: self.environment.radiance(),
            environment_rotation_rad: self.environment.rotation_rad(),
            emissive_power: self.emissive.power(),
            pad0: 0,
        }
    }
}
