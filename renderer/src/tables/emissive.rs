//! Triangles that emit, with an alias table by area times luminance. They are named by (instance, geometry,
//! primitive), so that moving one uploads nothing unless its share of the power changes.

use std::collections::BTreeMap;
use std::sync::Arc;

use caustica_gpu::{Device, Recorder};
use glam::{Affine3A, Mat3, Vec3};

use super::alias;
use super::instances::{Instances, Slot};
use super::materials::{Materials, emits};
use super::meshes::Meshes;
use super::table::{Download, Table};
use crate::error::Result;
use crate::gpu_types::{AliasEntry, EmissiveTriangle};

/// Areas that change by less than this share leave the table as it is: the shader divides by the true area.
const AREA_TOLERANCE: f32 = 1e-5;

/// All emissive triangles.
pub(crate) struct Emissive {
    triangles: Table<EmissiveTriangle>,
    alias: Table<AliasEntry>,
    /// Emitters by slot, with the metric of their transform when the table was made.
    emitters: BTreeMap<u32, Mat3>,
    /// Sum of area times luminance.
    power: f64,
    stale: bool,
}

impl Emissive {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            triangles: Table::new(device, "emissive triangles"),
            alias: Table::new(device, "emissive alias table"),
            emitters: BTreeMap::new(),
            power: 0.0,
            stale: false,
        }
    }

    /// A slot is new, free, or of another mesh, material or visibility.
    pub(crate) fn follow(&mut self, slot: u32, instances: &Instances, materials: &Materials) {
        let was = self.emitters.remove(&slot).is_some();
        let now = instances.get(slot).filter(|entry| is_emitter(entry, materials));
        if let Some(entry) = now {
            self.emitters.insert(slot, metric(&entry.instance.render_from_mesh));
        }
        self.stale |= was || now.is_some();
    }

    /// A transform changed: areas and so probabilities may have. A turn or a shift changes neither.
    pub(crate) fn follow_transform(&mut self, slot: u32, instances: &Instances) {
        let Some(old) = self.emitters.get_mut(&slot) else { return };
        let Some(entry) = instances.get(slot) else { return };
        let now = metric(&entry.instance.render_from_mesh);
        let size = old.x_axis.x.abs().max(old.y_axis.y.abs()).max(old.z_axis.z.abs());
        let differs =
            (now - *old).to_cols_array().iter().any(|d| d.is_nan() || d.abs() > AREA_TOLERANCE * size);
        if differs {
            *old = now;
            self.stale = true;
        }
    }

    /// What emitters emit, or their vertices, changed.
    pub(crate) fn mark_stale(&mut self) {
        self.stale |= !self.emitters.is_empty();
    }

    /// Whether any of the emitters places this mesh.
    pub(crate) fn places(&self, mesh: crate::delta::MeshId, instances: &Instances) -> bool {
        self.emitters.keys().any(|slot| instances.get(*slot).is_some_and(|entry| entry.instance.mesh == mesh))
    }

    /// Collects every emissive triangle anew if that is needed.
    pub(crate) fn update(&mut self, instances: &Instances, materials: &Materials, meshes: &Meshes) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        let (mut triangles, mut weights) = (Vec::new(), Vec::new());
        for slot in self.emitters.keys() {
            // A degenerate emitter is followed too: it may get a size again.
            let Some(entry) = instances.get(*slot).filter(|entry| !entry.degenerate) else { continue };
            collect(*slot, entry, materials, meshes, &mut triangles, &mut weights);
        }
        self.power = weights.iter().sum();
        self.triangles.replace(triangles);
        self.alias.replace(alias::build(&weights));
    }

    pub(crate) fn len(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// Sum of area times luminance, square metres times radiance.
    pub(crate) fn power(&self) -> f32 {
        self.power as f32
    }

    pub(crate) fn address(&self) -> u64 {
        self.triangles.address()
    }

    pub(crate) fn alias_address(&self) -> u64 {
        self.alias.address()
    }

    /// Records the copies of triangles and alias table back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<(Download, Download)> {
        Ok((self.triangles.download(recorder)?, self.alias.download(recorder)?))
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.triangles.is_dirty() || self.alias.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.triangles.flush(recorder)?;
        self.alias.flush(recorder)
    }
}

/// Lengths and angles that the map makes: equal ones give equal areas.
fn metric(map: &Affine3A) -> Mat3 {
    let linear = Mat3::from(map.matrix3);
    linear.transpose() * linear
}

fn is_emitter(entry: &Slot, materials: &Materials) -> bool {
    let shines = entry.instance.materials.iter().any(|id| materials.get(*id).is_some_and(emits));
    shines && entry.instance.visibility.shown
}

fn collect(
    slot: u32,
    entry: &Slot,
    materials: &Materials,
    meshes: &Meshes,
    triangles: &mut Vec<EmissiveTriangle>,
    weights: &mut Vec<f64>,
) {
    let Ok(mesh) = meshes.get(entry.instance.mesh) else { return };
    if mesh.shapes.is_some() {
        return; // shapes shine where rays meet them, but none is drawn as a light
    }
    for (geometry, id) in entry.instance.materials.iter().enumerate() {
        let Some(material) = materials.get(*id).filter(|material| emits(material)) else { continue };
        let luminance = f64::from(material.emissive.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
        let range = &mesh.host.geometries[geometry];
        let [outer, inner] = [entry.instance.render_from_mesh, range.mesh_from_primitive]
            .map(|map| Mat3::from(map.matrix3).as_dmat3());
        let linear = outer * inner;
        let indices = &mesh.host.indices[range.first_index as usize..][..range.index_count as usize];
        for (primitive, corner) in indices.chunks_exact(3).enumerate() {
            // Of edges, not of placed corners: where the triangle stands must not round its area.
            let [a, b, c] = [0, 1, 2].map(|i| mesh.host.positions[corner[i] as usize].as_dvec3());
            let area = (linear * (b - a)).cross(linear * (c - a)).length() * 0.5;
            if area > 0.0 && area.is_finite() {
                let (geometry, primitive) = (geometry as u32, primitive as u32);
                triangles.push(EmissiveTriangle { instance: slot, geometry, primitive, pad0: 0 });
                weights.push(area * luminance);
            }
        }
    }
}
