//! Reads tables and structures back and takes slots and addresses out of them. A pointer to what is gone, or a copy on the
//! device that is older than the host's, is an error in words.

use std::collections::BTreeMap;

use bytemuck::Pod;
use caustica_gpu::{Frames, Recorder};

use super::{EnvironmentEntry, InstanceEntry, Inventory, MaterialEntry, MeshEntry, Place};
use crate::accel::Accel;
use crate::delta::{InstanceId, MeshId};
use crate::error::{RendererError, Result};
use crate::gpu_types::{
    self, AliasEntry, EmissiveTriangle, Geometry, InstanceDescriptor, NO_TEXTURE, TextureUse,
};
use crate::tables::{Download, MeshBuffers, Slot, Tables};

/// Reads everything back. Waits for the device.
pub(crate) fn take(tables: &Tables, accel: &Accel, frames: &mut Frames) -> Result<Inventory> {
    let mut recorder = frames.begin()?;
    recorder.declare(&tables.download_uses());
    recorder.declare(&accel.download_uses());
    let downloads = Downloads::record(&mut recorder, tables, accel)?;
    frames.submit(recorder, None)?;
    frames.finish()?;

    let mut inventory = Inventory::default();
    downloads.check_scene(tables)?;
    downloads.add_instances(tables, accel, &mut inventory)?;
    downloads.add_materials(tables, &mut inventory)?;
    downloads.add_emissive(tables, &mut inventory)?;
    downloads.add_draws(tables, &mut inventory)?;
    downloads.add_environment(tables, &mut inventory);
    inventory.meshes = downloads.meshes.iter().map(|(id, mesh)| (*id, mesh.read())).collect();
    inventory.lights = downloads.lights.read();
    inventory.blases = accel.keys().collect();
    Ok(inventory)
}

/// Copies on their way to the host.
struct Downloads {
    scene: Download,
    instances: Download,
    material_slots: Download,
    materials: (Download, Download),
    lights: Download,
    emissive: (Download, Download),
    environment: Download,
    draws: Download,
    descriptors: Download,
    blas_addresses: Download,
    meshes: BTreeMap<MeshId, MeshDownload>,
    posed: BTreeMap<InstanceId, MeshDownload>,
}

/// Geometry records, then what holds vertices.
struct MeshDownload {
    geometries: Download,
    vertices: Vec<Download>,
}

impl MeshDownload {
    fn record(recorder: &mut Recorder, buffers: &MeshBuffers<'_>) -> Result<Self> {
        let vertices = buffers.vertices.iter().map(|buffer| Download::of(recorder, buffer));
        Ok(Self {
            vertices: vertices.collect::<Result<_>>()?,
            geometries: Download::of(recorder, buffers.geometries)?,
        })
    }

    fn read(&self) -> MeshEntry {
        let plain = |record: Geometry| Geometry {
            positions: 0,
            previous_positions: 0,
            attributes: 0,
            indices: 0,
            ..record
        };
        let geometries: Vec<Geometry> = self.geometries.read();
        let vertices = self.vertices.iter().fold(DIGEST_OF_NOTHING, |sum, list| digest(sum, &list.read()));
        MeshEntry { geometries: geometries.into_iter().map(plain).collect(), vertices }
    }
}

impl Downloads {
    fn record(recorder: &mut Recorder, tables: &Tables, accel: &Accel) -> Result<Self> {
        let mut meshes = BTreeMap::new();
        for (id, mesh) in tables.meshes.iter() {
            meshes.insert(id, MeshDownload::record(recorder, &mesh.buffers())?);
        }
        let mut posed = BTreeMap::new();
        for (id, deforming) in tables.deforming.iter() {
            posed.insert(id, MeshDownload::record(recorder, &deforming.buffers())?);
        }
        Ok(Self {
            scene: tables.download_scene(recorder)?,
            instances: tables.instances.download(recorder)?,
            material_slots: tables.instances.download_material_slots(recorder)?,
            materials: tables.materials.download(recorder)?,
            lights: tables.lights.download(recorder)?,
            emissive: tables.emissive.download(recorder)?,
            environment: tables.environment.download(recorder)?,
            draws: tables.draws.download(recorder)?,
            descriptors: accel.download_descriptors(recorder)?,
            blas_addresses: accel.download_addresses(recorder)?,
            meshes,
            posed,
        })
    }

    /// The record that all shaders begin with names the tables as they are.
    fn check_scene(&self, tables: &Tables) -> Result<()> {
        let found: Vec<gpu_types::Scene> = self.scene.read();
        match found.as_slice() {
            [] => Ok(()),
            [scene, ..] if *scene == tables.record() => Ok(()),
            _ => Err(fault(String::from("the scene's record is older than its tables"))),
        }
    }

    fn add_instances(&self, tables: &Tables, accel: &Accel, inventory: &mut Inventory) -> Result<()> {
        let lists = Lists {
            descriptors: self.descriptors.read(),
            addresses: self.blas_addresses.read(),
            records: self.instances.read(),
            material_slots: self.material_slots.read(),
        };
        inventory.layout.slot_count = tables.instances.slot_count();
        inventory.layout.material_slot_count = lists.material_slots.len() as u32;
        for slot in 0..tables.instances.slot_count() {
            let descriptor = lists.descriptor_of(slot, accel)?;
            let Some(entry) = tables.instances.get(slot) else {
                if descriptor.blas != 0 {
                    return Err(fault(format!("slot {slot} is free and in the TLAS")));
                }
                continue;
            };
            let (place, found) = lists.instance(slot, entry, tables, accel)?;
            let posed = self.posed.get(&entry.id).map(MeshDownload::read);
            inventory.layout.instances.insert(entry.id, place);
            inventory.instances.insert(entry.id, InstanceEntry { posed, ..found });
        }
        Ok(())
    }

    fn add_materials(&self, tables: &Tables, inventory: &mut Inventory) -> Result<()> {
        let records: Vec<gpu_types::Material> = self.materials.0.read();
        let lobe_records: Vec<gpu_types::MaterialLobes> = self.materials.1.read();
        for (id, index) in tables.materials.ids() {
            let mut record = at(&records, index, "material")?;
            let own = std::mem::take(&mut record.lobes).checked_sub(1);
            let mut lobes = own.map(|index| at(&lobe_records, index, "record of lobes")).transpose()?;
            let textures = [
                &mut record.base_color_texture,
                &mut record.metallic_roughness_texture,
                &mut record.normal_texture,
                &mut record.occlusion_texture,
                &mut record.emissive_texture,
            ]
            .into_iter()
            .chain(lobes.iter_mut().flat_map(gpu_types::MaterialLobes::textures_mut))
            .map(|used: &mut TextureUse| {
                let slot = std::mem::replace(&mut used.texture, NO_TEXTURE);
                tables.textures.id_of(slot)
            })
            .collect();
            inventory.materials.insert(id, MaterialEntry { record, lobes, textures });
            inventory.layout.materials.insert(id, index);
        }
        inventory.layout.textures = tables.textures.ids().collect();
        inventory.textures = inventory.layout.textures.keys().copied().collect();
        Ok(())
    }

    fn add_emissive(&self, tables: &Tables, inventory: &mut Inventory) -> Result<()> {
        let triangles: Vec<EmissiveTriangle> = self.emissive.0.read();
        let alias: Vec<AliasEntry> = self.emissive.1.read();
        for (triangle, alias) in triangles.iter().zip(&alias) {
            let key = (id_in(tables, triangle.instance)?, triangle.geometry, triangle.primitive);
            inventory.emissive.insert(key, alias.pdf);
            inventory.layout.emissive.push(key);
        }
        Ok(())
    }

    fn add_draws(&self, tables: &Tables, inventory: &mut Inventory) -> Result<()> {
        let slots: Vec<u32> = self.draws.read();
        for batch in tables.draws.batches() {
            let first = batch.first_instance as usize;
            let run = slots.get(first..first + batch.instance_count as usize).unwrap_or_default();
            let ids: Vec<InstanceId> = run.iter().map(|slot| id_in(tables, *slot)).collect::<Result<_>>()?;
            let key = format!("{:?}", batch.key);
            inventory.draws.insert(key.clone(), ids.iter().copied().collect());
            inventory.layout.draws.insert(key, (batch.first_instance, ids));
        }
        Ok(())
    }

    fn add_environment(&self, tables: &Tables, inventory: &mut Inventory) {
        let is_map = tables.environment.is_map();
        let (columns, rows) = tables.environment.grid();
        inventory.environment = EnvironmentEntry {
            grid: [columns, rows],
            radiance: tables.environment.radiance(),
            rotation_rad: if is_map { tables.environment.rotation_rad() } else { 0.0 },
            probabilities: if is_map { digest(DIGEST_OF_NOTHING, &self.environment.read()) } else { 0 },
        };
    }
}

/// What the device says about instances.
struct Lists {
    descriptors: Vec<InstanceDescriptor>,
    addresses: Vec<u64>,
    records: Vec<gpu_types::Instance>,
    material_slots: Vec<u32>,
}

impl Lists {
    fn descriptor_of(&self, slot: u32, accel: &Accel) -> Result<InstanceDescriptor> {
        at(&self.descriptors, accel.place_of(slot), "instance descriptor")
    }

    fn instance(
        &self,
        slot: u32,
        entry: &Slot,
        tables: &Tables,
        accel: &Accel,
    ) -> Result<(Place, InstanceEntry)> {
        let descriptor = self.descriptor_of(slot, accel)?;
        let number = self.check_descriptor(slot, entry, &descriptor, accel)?;
        let record = at(&self.records, slot, "instance record")?;
        if record.geometries != tables.geometries_of(entry.id, entry.instance.mesh)? {
            return Err(fault(format!("{:?} names geometry that is not its own", entry.id)));
        }
        let first = record.material_base as usize;
        let used = self.material_slots.get(first..first + record.geometry_count as usize).unwrap_or_default();
        let unknown = || fault(format!("{:?} has a material that is gone", entry.id));
        let materials = used.iter().map(|index| tables.materials.id_of(*index).ok_or_else(unknown));
        let place = Place {
            slot,
            material_base: record.material_base,
            descriptor: accel.place_of(slot),
            blas: number,
        };
        let found = InstanceEntry {
            record: gpu_types::Instance { geometries: 0, material_base: 0, ..record },
            materials: materials.collect::<Result<_>>()?,
            descriptor: InstanceDescriptor {
                blas: 0,
                index_mask: descriptor.index_mask & 0xff00_0000,
                ..descriptor
            },
            blas: accel.key_at(descriptor.blas),
            posed: None,
        };
        Ok((place, found))
    }

    /// Returns the number of the BLAS.
    fn check_descriptor(
        &self,
        slot: u32,
        entry: &Slot,
        descriptor: &InstanceDescriptor,
        accel: &Accel,
    ) -> Result<Option<u32>> {
        let named = descriptor.index_mask & 0x00ff_ffff;
        if named != slot {
            return Err(fault(format!("the descriptor of slot {slot} names slot {named}")));
        }
        let number = accel.number_of(slot);
        let built = number.and_then(|number| self.addresses.get(number as usize)).copied().unwrap_or(0);
        let expected = if entry.degenerate { 0 } else { built };
        if descriptor.blas != expected {
            let (id, found) = (entry.id, descriptor.blas);
            return Err(fault(format!("the descriptor of {id:?} names {found:#x} instead of {expected:#x}")));
        }
        if expected != 0 && accel.key_at(expected).is_none() {
            return Err(fault(format!("the descriptor of {:?} names a BLAS that is gone", entry.id)));
        }
        Ok(number)
    }
}

/// FNV-1a, 64 bits (Fowler, Noll and Vo): the offset that it begins with.
const DIGEST_OF_NOTHING: u64 = 0xcbf2_9ce4_8422_2325;

fn digest(before: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(before, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

fn id_in(tables: &Tables, slot: u32) -> Result<InstanceId> {
    let entry = tables.instances.get(slot);
    entry.map(|entry| entry.id).ok_or_else(|| fault(format!("slot {slot} is free and named")))
}

fn at<T: Pod>(list: &[T], index: u32, what: &str) -> Result<T> {
    list.get(index as usize).copied().ok_or_else(|| fault(format!("there is no {what} {index}")))
}

fn fault(reason: String) -> RendererError {
    RendererError::Contradiction { reason }
}
