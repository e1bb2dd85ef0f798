//! What is on the device, by id instead of by slot and address, so that two renderers can be compared whatever way they
//! took to their scene. Enters: tables and structures, read back. Leaves: plain data. For tests and for reports of faults.

mod read;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;

pub(crate) use read::take;

use crate::delta::{InstanceId, MaterialId, MeshId, TextureId};
use crate::gpu_types::{self, InstanceDescriptor};

/// Probabilities may differ by this share: they are sums in the order of the slots, of areas that may be off by 1e-5.
const PDF_TOLERANCE: f32 = 5e-5;

/// The scene on the device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inventory {
    /// Instances.
    pub instances: BTreeMap<InstanceId, InstanceEntry>,
    /// Materials.
    pub materials: BTreeMap<MaterialId, MaterialEntry>,
    /// Meshes, at rest those that deform.
    pub meshes: BTreeMap<MeshId, MeshEntry>,
    /// Textures.
    pub textures: BTreeSet<TextureId>,
    /// Lights in the order of their table.
    pub lights: Vec<gpu_types::Light>,
    /// Emissive triangles (instance, geometry, primitive) with the probability of drawing them.
    pub emissive: BTreeMap<(InstanceId, u32, u32), f32>,
    /// What surrounds the scene.
    pub environment: EnvironmentEntry,
    /// Raster draws: batch in words, instances.
    pub draws: BTreeMap<String, BTreeSet<InstanceId>>,
    /// Keys of all BLASes in words.
    pub blases: BTreeSet<String>,
    /// Where everything lies. The one thing that depends on the way to the scene: [`Self::differences`] leaves it out.
    pub layout: Layout,
}

/// One material on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialEntry {
    /// Its record, texture slots and index of the lobes taken out.
    pub record: gpu_types::Material,
    /// Its lobes, texture slots taken out.
    pub lobes: Option<gpu_types::MaterialLobes>,
    /// Textures, in the order of the records.
    pub textures: Vec<Option<TextureId>>,
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
    /// Its own vertices when it deforms.
    pub posed: Option<MeshEntry>,
}

/// Vertices and primitives on the device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshEntry {
    /// Geometry records, addresses taken out.
    pub geometries: Vec<gpu_types::Geometry>,
    /// Digest of positions, attributes and indices, or of shapes and their boxes.
    pub vertices: u64,
}

/// The environment on the device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnvironmentEntry {
    /// Columns and rows of the map; zero: the same radiance from everywhere.
    pub grid: [u32; 2],
    /// Radiance, or the scale of the map.
    pub radiance: [f32; 3],
    /// Turn of the map, radians; 0 without one.
    pub rotation_rad: f32,
    /// Digest of the alias table of the map; 0 without one.
    pub probabilities: u64,
}

/// Slots, places and numbers. After the renderer was emptied and filled in order of id it is that of a new renderer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Where each instance lies.
    pub instances: BTreeMap<InstanceId, Place>,
    /// Instance slots, free ones among them.
    pub slot_count: u32,
    /// Entries of the table of materials by (instance, geometry), free ones among them.
    pub material_slot_count: u32,
    /// Slots of the materials.
    pub materials: BTreeMap<MaterialId, u32>,
    /// Slots of the textures.
    pub textures: BTreeMap<TextureId, u32>,
    /// First entry and instances, in order, of every raster draw.
    pub draws: BTreeMap<String, (u32, Vec<InstanceId>)>,
    /// Emissive triangles in the order of their table.
    pub emissive: Vec<(InstanceId, u32, u32)>,
}

/// Where an instance lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Its slot.
    pub slot: u32,
    /// First of its entries in the table of materials by (instance, geometry).
    pub material_base: u32,
    /// Place of its descriptor among those that the TLAS is built from.
    pub descriptor: u32,
    /// Number of its BLAS.
    pub blas: Option<u32>,
}

impl Inventory {
    /// What differs, in words; empty when the two are the same scene, wherever it lies.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut found = Vec::new();
        compare_maps("instance", &self.instances, &other.instances, &mut found);
        compare_maps("material", &self.materials, &other.materials, &mut found);
        compare_maps("mesh", &self.meshes, &other.meshes, &mut found);
        compare_maps("draw", &self.draws, &other.draws, &mut found);
        compare("textures", &self.textures, &other.textures, &mut found);
        compare("lights", &self.lights, &other.lights, &mut found);
        compare("environment", &self.environment, &other.environment, &mut found);
        compare("BLASes", &self.blases, &other.blases, &mut found);
        let keys: BTreeSet<_> = self.emissive.keys().chain(other.emissive.keys()).collect();
        for key in keys {
            let (a, b) = (self.emissive.get(key), other.emissive.get(key));
            let near = |a: &f32, b: &f32| (a - b).abs() <= PDF_TOLERANCE * a.max(*b);
            if !a.zip(b).is_some_and(|(a, b)| near(a, b)) {
                compare(&format!("emissive triangle {key:?}"), &a, &b, &mut found);
            }
        }
        found
    }
}

fn compare_maps<K: Ord + Debug, V: PartialEq + Debug>(
    what: &str,
    a: &BTreeMap<K, V>,
    b: &BTreeMap<K, V>,
    found: &mut Vec<String>,
) {
    let keys: BTreeSet<&K> = a.keys().chain(b.keys()).collect();
    for key in keys {
        compare(&format!("{what} {key:?}"), &a.get(key), &b.get(key), found);
    }
}

fn compare<V: PartialEq + Debug>(what: &str, a: &V, b: &V, found: &mut Vec<String>) {
    if a == b {
        return;
    }
    let (a, b) = (format!("{a:?}"), format!("{b:?}"));
    // What is no number equals nothing, but reads the same.
    let Some(first) = a.bytes().zip(b.bytes()).position(|(a, b)| a != b).or((a != b).then_some(0)) else {
        return;
    };
    // Some of what is the same, to know where it is, and what differs.
    let cut = |text: &str| text.chars().skip(first.saturating_sub(160)).take(260).collect::<String>();
    found.push(format!("{what}: {} and {}", cut(&a), cut(&b)));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn emitter(pdf: f32) -> Inventory {
        let key = (InstanceId { node: 3, part: 0 }, 0, 7);
        Inventory { emissive: [(key, pdf)].into(), ..Inventory::default() }
    }

    #[test]
    fn differences_are_named_and_rounding_is_none() {
        assert_eq!(emitter(0.25).differences(&emitter(0.25 * (1.0 + 1e-6))), Vec::<String>::new());
        assert_eq!(emitter(f32::NAN).differences(&emitter(f32::NAN)), Vec::<String>::new());
        let found = emitter(0.25).differences(&emitter(0.26));
        assert!(found.len() == 1 && found[0].contains("node: 3") && found[0].contains("0.26"), "{found:?}");
        assert_eq!(emitter(0.25).differences(&Inventory::default()).len(), 1);
        let lit = Inventory { textures: [TextureId(9)].into(), ..Inventory::default() };
        assert_eq!(lit.differences(&Inventory::default()), ["textures: {TextureId(9)} and {}"]);
    }

    #[test]
    fn where_it_lies_is_no_difference() {
        let moved =
            Inventory { layout: Layout { slot_count: 5, ..Layout::default() }, ..Inventory::default() };
        assert!(moved.differences(&Inventory::default()).is_empty());
        assert_ne!(moved.layout, Layout::default());
    }
}
