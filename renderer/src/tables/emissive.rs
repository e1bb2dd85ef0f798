//! Triangles that emit, with an alias table by area times luminance. They are named by (instance, geometry,
//! primitive), so that moving one uploads nothing unless its share of the power changes.

use std::collections::BTreeSet;
use std::sync::Arc;

use caustica_gpu::{Device, Recorder};
use glam::Vec3;

use super::alias;
use super::instances::Instances;
use super::materials::{Materials, emits};
use super::meshes::Meshes;
use super::table::Table;
use crate::error::Result;
use crate::gpu_types::{AliasEntry, EmissiveTriangle};

/// All emissive triangles.
pub(crate) struct Emissive {
    triangles: Table<EmissiveTriangle>,
    alias: Table<AliasEntry>,
    instances: BTreeSet<u32>,
}

impl Emissive {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            triangles: Table::new(device, "emissive triangles"),
            alias: Table::new(device, "emissive alias table"),
            instances: BTreeSet::new(),
        }
    }

    /// Collects every emissive triangle of the visible instances.
    pub(crate) fn rebuild(&mut self, instances: &Instances, materials: &Materials, meshes: &Meshes) {
        let (mut triangles, mut weights) = (Vec::new(), Vec::new());
        self.instances.clear();
        for (slot, entry) in instances.iter() {
            let emitter = entry.instance.materials.iter().any(|id| materials.get(*id).is_some_and(emits));
            if !emitter || !entry.instance.visibility.shown {
                continue;
            }
            // A degenerate emitter is followed too: it may get a size again.
            self.instances.insert(slot);
            if entry.degenerate {
                continue;
            }
            for (geometry, id) in entry.instance.materials.iter().enumerate() {
                let Some(material) = materials.get(*id).filter(|material| emits(material)) else { continue };
                let Ok(mesh) = meshes.get(entry.instance.mesh) else { continue };
                let luminance = f64::from(material.emissive.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
                let place =
                    entry.instance.render_from_mesh * mesh.host.geometries[geometry].mesh_from_primitive;
                let range = &mesh.host.geometries[geometry];
                let indices = &mesh.host.indices[range.first_index as usize..][..range.index_count as usize];
                for (primitive, corner) in indices.chunks_exact(3).enumerate() {
                    let [a, b, c] = [0, 1, 2]
                        .map(|i| place.transform_point3(mesh.host.positions[corner[i] as usize]).as_dvec3());
                    let area = (b - a).cross(c - a).length() * 0.5;
                    if area > 0.0 && area.is_finite() {
                        triangles.push(EmissiveTriangle {
                            instance: slot,
                            geometry: geometry as u32,
                            primitive: primitive as u32,
                            pad0: 0,
                        });
                        weights.push(area * luminance);
                    }
                }
            }
        }
        self.triangles.replace(triangles);
        self.alias.replace(alias::build(&weights));
    }

    /// After transforms changed: areas and so probabilities may have.
    pub(crate) fn follow_transforms(
        &mut self,
        moved: &[u32],
        instances: &Instances,
        materials: &Materials,
        meshes: &Meshes,
    ) {
        if moved.iter().any(|slot| self.instances.contains(slot)) {
            self.rebuild(instances, materials, meshes);
        }
    }

    pub(crate) fn len(&self) -> u32 {
        self.triangles.len() as u32
    }

    pub(crate) fn address(&self) -> u64 {
        self.triangles.address()
    }

    pub(crate) fn alias_address(&self) -> u64 {
        self.alias.address()
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.triangles.is_dirty() || self.alias.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.triangles.flush(recorder)?;
        self.alias.flush(recorder)
    }
}
