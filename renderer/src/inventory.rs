//! What is on the device, by id instead of by slot and address, so that two renderers can be compared whatever way they
//! took to their scene. Enters: tables and structures, read back. Leaves: plain data. For tests and for reports of faults.

use std::collections::{BTreeMap, BTreeSet};

use caustica_gpu::Frames;

use crate::accel::Accel;
use crate::delta::{InstanceId, MaterialId, MeshId, TextureId};
use crate::error::{RendererError, Result};
use crate::gpu_types::{self, EmissiveTriangle, InstanceDescriptor, NO_TEXTURE, TextureUse};
use crate::tables::{Download, Tables};

/// Probabilities may differ by this share: they are sums in the order of the slots.
const PDF_TOLERANCE: f32 = 1e-5;

/// The scene on the device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inventory {
    /// Instances.
    pub instances: BTreeMap<InstanceId, InstanceEntry>,
    /// Materials without their texture slots, and the textures they use, in the order of the record.
    pub materials: BTreeMap<MaterialId, (gpu_types::Material, Vec<Option<TextureId>>)>,
    /// Geometry records of every mesh, addresses taken out.
    pub meshes: BTreeMap<MeshId, Vec<gpu_types::Geometry>>,
    /// Lights in the order of their table.
    pub lights: Vec<gpu_types::Light>,
    /// Emissive triangles (instance, geometry, primitive) with the probability of drawing them.
    pub emissive: BTreeMap<(InstanceId, u32, u32), f32>,
    /// Raster draws: batch in words, instances.
    pub draws: BTreeMap<String, BTreeSet<InstanceId>>,
    /// Keys of all BLASes in words.
    pub blases: BTreeSet<String>,
}

/// One instance on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceEntry {
    /// Its record, addresses and table offsets taken out.
    pub record: gpu_types::Instance,
    /// Its material for each geometry.
    pub materials: Vec<MaterialId>,
    /// Its descriptor in the TLAS, custom index and address taken out.
    pub descriptor: InstanceDescriptor,
    /// Key of the BLAS that the descriptor names; `None`: a null reference.
    pub blas: Option<String>,
    /// Digest of its own vertices when it deforms.
    pub vertices: Option<u64>,
}

impl Inventory {
    /// What differs, in words; empty when the two are the same scene.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut found = Vec::new();
        compare("instance", &self.instances, &other.instances, &mut found);
        compare("material", &self.materials, &other.materials, &mut found);
        compare("mesh", &self.meshes, &other.meshes, &mut found);
        compare("draw", &self.draws, &other.draws, &mut found);
        if self.lights != other.lights {
            found.push(format!("lights: {:?} and {:?}", self.lights, other.lights));
        }
        if self.blases != other.blases {
            found.push(format!("BLASes: {:?}", self.blases.symmetric_difference(&other.blases)));
        }
        for key in self.emissive.keys().chain(other.emissive.keys()) {
            let (a, b) = (self.emissive.get(key), other.emissive.get(key));
            let same = a.zip(b).is_some_and(|(a, b)| (a - b).abs() <= PDF_TOLERANCE * a.max(*b));
            if !same {
                found.push(format!("emissive triangle {key:?}: {a:?} and {b:?}"));
            }
        }
        found
    }
}

fn compare<K: Ord + std::fmt::Debug, V: PartialEq + std::fmt::Debug>(
    what: &str,
    a: &BTreeMap<K, V>,
    b: &BTreeMap<K, V>,
    found: &mut Vec<String>,
) {
    let keys: BTreeSet<&K> = a.keys().chain(b.keys()).collect();
    for key in keys {
        if a.get(key) != b.get(key) {
            found.push(format!("{what} {key:?}: {:?} and {:?}", a.get(key), b.get(key)));
        }
    }
}

/// Reads everything back. Waits for the device.
pub(crate) fn take(tables: &Tables, accel: &Accel, frames: &mut Frames) -> Result<Inventory> {
    let mut recorder = frames.begin()?;
    recorder.declare(&tables.download_uses());
    recorder.declare(&accel.download_uses());
    let instances = tables.instances.download(&mut recorder)?;
    let material_slots = tables.instances.download_material_slots(&mut recorder)?;
    let materials = tables.materials.download(&mut recorder)?;
    let lights = tables.lights.download(&mut recorder)?;
    let emissive = tables.emissive.download(&mut recorder)?;
    let draws = tables.draws.download(&mut recorder)?;
    let descriptors = accel.download_descriptors(&mut recorder)?;
    let mut meshes = BTreeMap::new();
    for (id, mesh) in tables.meshes.iter() {
        meshes.insert(id, Download::of(&mut recorder, &mesh.geometries)?);
    }
    frames.submit(recorder, None)?;
    frames.finish()?;

    let mut inventory = Inventory::default();
    let material_slots: Vec<u32> = material_slots.read();
    let descriptors: Vec<InstanceDescriptor> = descriptors.read();
    let records: Vec<gpu_types::Instance> = instances.read();
    for (slot, entry) in tables.instances.iter() {
        let record = at(&records, slot, "instance record")?;
        let first = record.material_base as usize;
        let used = material_slots.get(first..first + record.geometry_count as usize).unwrap_or_default();
        let place = accel.place_of(slot);
        let descriptor = at(&descriptors, place, "instance descriptor")?;
        if descriptor.index_mask & 0x00ff_ffff != slot {
            return Err(fault(format!(
                "descriptor {place} names slot {}",
                descriptor.index_mask & 0x00ff_ffff
            )));
        }
        let materials = used.iter().map(|index| tables.materials.id_of(*index).ok_or_else(unknown_material));
        inventory.instances.insert(
            entry.id,
            InstanceEntry {
                record: gpu_types::Instance { geometries: 0, material_base: 0, ..record },
                materials: materials.collect::<Result<_>>()?,
                descriptor: InstanceDescriptor {
                    blas: 0,
                    index_mask: descriptor.index_mask & 0xff00_0000,
                    ..descriptor
                },
                blas: accel.key_at(descriptor.blas),
                vertices: None,
            },
        );
        if descriptor.blas != 0 && accel.key_at(descriptor.blas).is_none() {
            return Err(fault(format!("the descriptor of {:?} names a BLAS that is gone", entry.id)));
        }
    }
    let records: Vec<gpu_types::Material> = materials.read();
    for (id, index) in tables.materials.ids() {
        let mut record = at(&records, index, "material")?;
        let textures = [
            &mut record.base_color_texture,
            &mut record.metallic_roughness_texture,
            &mut record.normal_texture,
            &mut record.occlusion_texture,
            &mut record.emissive_texture,
        ]
        .map(|used: &mut TextureUse| {
            let slot = std::mem::replace(&mut used.texture, NO_TEXTURE);
            tables.textures.id_of(slot)
        });
        inventory.materials.insert(id, (record, textures.to_vec()));
    }
    for (id, download) in meshes {
        let records: Vec<gpu_types::Geometry> = download.read();
        let plain = |record: gpu_types::Geometry| gpu_types::Geometry {
            positions: 0,
            previous_positions: 0,
            attributes: 0,
            indices: 0,
            ..record
        };
        inventory.meshes.insert(id, records.into_iter().map(plain).collect());
    }
    inventory.lights = lights.read();
    let id_of = |slot: u32| {
        let entry = tables.instances.get(slot);
        entry.map(|entry| entry.id).ok_or_else(|| fault(format!("slot {slot} is free and named")))
    };
    let (triangles, pdfs): (Vec<EmissiveTriangle>, Vec<gpu_types::AliasEntry>) =
        (emissive.0.read(), emissive.1.read());
    for (triangle, alias) in triangles.iter().zip(&pdfs) {
        let key = (id_of(triangle.instance)?, triangle.geometry, triangle.primitive);
        inventory.emissive.insert(key, alias.pdf);
    }
    let slots: Vec<u32> = draws.read();
    for batch in tables.draws.batches() {
        let first = batch.first_instance as usize;
        let run = slots.get(first..first + batch.instance_count as usize).unwrap_or_default();
        let ids = run.iter().map(|slot| id_of(*slot)).collect::<Result<_>>()?;
        inventory.draws.insert(format!("{:?}", batch.key), ids);
    }
    inventory.blases = accel.keys().collect();
    Ok(inventory)
}

fn at<T: Copy>(list: &[T], index: u32, what: &str) -> Result<T> {
    list.get(index as usize).copied().ok_or_else(|| fault(format!("there is no {what} {index}")))
}

fn unknown_material() -> RendererError {
    fault(String::from("an instance names a material that is gone"))
}

fn fault(what: String) -> RendererError {
    RendererError::Unknown { what: "state of the tables:", id: what }
}
