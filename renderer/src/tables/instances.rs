//! Instances: stable slots, transforms with their predecessors, and the material of every (instance, geometry).

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use caustica_gpu::{Device, Recorder};
use glam::{Affine3A, Mat3A, Vec3A};

use super::materials::Materials;
use super::meshes::{Meshes, rows_of};
use super::table::{Download, Table};
use crate::delta::{Instance, InstanceId, MaterialId, MeshId, Visibility};
use crate::error::{RendererError, Result};
use crate::gpu_types::{self, INSTANCE_MIRRORED, Rows};

/// What the host knows of one instance.
pub(crate) struct Slot {
    pub(crate) id: InstanceId,
    pub(crate) instance: Instance,
    /// Not finite or singular: no acceleration structure, not drawn.
    pub(crate) degenerate: bool,
    material_base: u32,
    geometry_count: u32,
}

impl Slot {
    /// Whether any ray can meet it.
    fn is_met(&self) -> bool {
        self.instance.visibility.shown && !self.degenerate
    }
}

/// All instances, by slot.
pub(crate) struct Instances {
    table: Table<gpu_types::Instance>,
    material_slots: Table<u32>,
    by_id: BTreeMap<InstanceId, u32>,
    slots: Vec<Option<Slot>>,
    free_slots: Vec<u32>,
    /// Free ranges of material slots, by their length.
    free_ranges: BTreeMap<u32, Vec<u32>>,
    moved_last_frame: BTreeSet<u32>,
    /// How many (instance, geometry) pairs have a material.
    uses: BTreeMap<MaterialId, u32>,
    /// What rays can meet.
    met: Met,
    /// Materials that came into use, or out of it, since they were last asked for.
    newly_used: BTreeSet<MaterialId>,
}

impl Instances {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            table: Table::new(device, "instances"),
            material_slots: Table::new(device, "material slots"),
            by_id: BTreeMap::new(),
            slots: Vec::new(),
            free_slots: Vec::new(),
            free_ranges: BTreeMap::new(),
            moved_last_frame: BTreeSet::new(),
            uses: BTreeMap::new(),
            met: Met::default(),
            newly_used: BTreeSet::new(),
        }
    }

    /// Adds an instance, or changes it. Returns its slot.
    pub(crate) fn set(
        &mut self,
        id: InstanceId,
        instance: &Instance,
        meshes: &Meshes,
        materials: &Materials,
    ) -> Result<u32> {
        let mesh = meshes.get(instance.mesh)?;
        let count = mesh.geometry_count();
        check_materials(instance, count)?;
        let indices: Vec<u32> =
            instance.materials.iter().map(|m| materials.index(*m)).collect::<Result<_>>()?;
        let known = self.by_id.get(&id).copied();
        let (slot, old) = match known {
            Some(slot) => (slot, self.slots[slot as usize].take()),
            None => (self.free_slots.pop().unwrap_or(self.slots.len() as u32), None),
        };
        if slot as usize >= self.slots.len() {
            self.slots.resize_with(slot as usize + 1, || None);
        }
        for id in &instance.materials {
            let count = self.uses.entry(*id).or_default();
            *count += 1;
            if *count == 1 {
                self.newly_used.insert(*id);
            }
        }
        let material_base = match old {
            Some(old) => {
                self.met.count(&old, -1);
                self.release(&old.instance.materials);
                if old.geometry_count == count {
                    old.material_base
                } else {
                    self.free_range(old.material_base, old.geometry_count);
                    self.take_range(count)
                }
            }
            None => self.take_range(count),
        };
        for (i, index) in indices.into_iter().enumerate() {
            self.material_slots.set(material_base as usize + i, index);
        }
        let previous =
            known.and_then(|_| self.table.get(slot as usize)).map(|record| record.render_from_mesh);
        let transform = &instance.render_from_mesh;
        let degenerate = is_degenerate(transform);
        let mut record = gpu_types::Instance {
            geometries: mesh.geometries_address(),
            material_base,
            geometry_count: count,
            ..bytemuck::Zeroable::zeroed()
        };
        place(&mut record, transform, previous);
        if previous.is_some_and(|previous| previous != record.render_from_mesh) {
            self.moved_last_frame.insert(slot);
        }
        self.table.set(slot as usize, record);
        self.by_id.insert(id, slot);
        let entry = Slot { id, instance: instance.clone(), degenerate, material_base, geometry_count: count };
        self.met.count(&entry, 1);
        self.slots[slot as usize] = Some(entry);
        Ok(slot)
    }

    /// Refuses what an instance has become under a mesh with another number of geometries.
    pub(crate) fn check_materials(&self, slot: u32, meshes: &Meshes) -> Result<()> {
        let Some(entry) = self.get(slot) else { return Ok(()) };
        check_materials(&entry.instance, meshes.get(entry.instance.mesh)?.geometry_count())
    }

    /// Moves an instance. Returns its slot, and whether it is drawn differently: mirrored or degenerate, or no longer.
    ///
    /// # Errors
    /// When the id is not in the table.
    pub(crate) fn set_transform(&mut self, id: InstanceId, transform: Affine3A) -> Result<(u32, bool)> {
        let degenerate = is_degenerate(&transform);
        let mut was_degenerate = degenerate;
        let slot = self.change(id, |entry| {
            was_degenerate = std::mem::replace(&mut entry.degenerate, degenerate);
            entry.instance.render_from_mesh = transform;
        })?;
        let mut record = self.table.get(slot as usize).copied().unwrap_or(bytemuck::Zeroable::zeroed());
        let (previous, old_flags) = (record.render_from_mesh, record.flags);
        place(&mut record, &transform, Some(previous));
        self.table.set(slot as usize, record);
        self.moved_last_frame.insert(slot);
        Ok((slot, record.flags != old_flags || degenerate != was_degenerate))
    }

    /// Changes who sees an instance. Returns its slot.
    ///
    /// # Errors
    /// When the id is not in the table.
    pub(crate) fn set_visibility(&mut self, id: InstanceId, visibility: Visibility) -> Result<u32> {
        self.change(id, |entry| entry.instance.visibility = visibility)
    }

    fn change(&mut self, id: InstanceId, change: impl FnOnce(&mut Slot)) -> Result<u32> {
        let unknown = || RendererError::Unknown { what: "instance", id: format!("{}/{}", id.node, id.part) };
        let slot = *self.by_id.get(&id).ok_or_else(unknown)?;
        let entry = self.slots.get_mut(slot as usize).and_then(Option::as_mut).ok_or_else(unknown)?;
        let before = entry.is_met();
        change(entry);
        match (before, entry.is_met()) {
            (false, true) => self.met.add(&entry.instance, 1),
            (true, false) => self.met.add(&entry.instance, -1),
            _ => {}
        }
        Ok(slot)
    }

    /// Takes an instance out. Returns the slot that it leaves.
    pub(crate) fn remove(&mut self, id: InstanceId) -> Option<u32> {
        let slot = self.by_id.remove(&id)?;
        if let Some(old) = self.slots[slot as usize].take() {
            self.met.count(&old, -1);
            self.free_range(old.material_base, old.geometry_count);
            self.release(&old.instance.materials);
        }
        self.table.set(slot as usize, bytemuck::Zeroable::zeroed());
        self.moved_last_frame.remove(&slot);
        self.free_slots.push(slot);
        Some(slot)
    }

    /// Forgets every slot once no instance is left, so that a scene loaded afresh lies as in a new renderer.
    pub(crate) fn tidy(&mut self) {
        if self.by_id.is_empty() {
            self.table.clear();
            self.material_slots.clear();
            self.slots.clear();
            self.free_slots.clear();
            self.free_ranges.clear();
        }
    }

    fn release(&mut self, materials: &[MaterialId]) {
        for id in materials {
            if let Some(count) = self.uses.get_mut(id) {
                *count -= 1;
                if *count == 0 {
                    self.uses.remove(id);
                    self.newly_used.insert(*id);
                }
            }
        }
    }

    /// Points an instance at its geometry records.
    pub(crate) fn set_geometries(&mut self, slot: u32, geometries: u64) {
        let record = self.table.get(slot as usize).copied();
        if let Some(record) = record.filter(|record| record.geometries != geometries) {
            self.table.set(slot as usize, gpu_types::Instance { geometries, ..record });
        }
    }

    /// A frame has gone by: what moved in it stands still until it moves again.
    pub(crate) fn settle(&mut self) {
        for slot in std::mem::take(&mut self.moved_last_frame) {
            if let Some(record) = self.table.get(slot as usize).copied() {
                let previous_render_from_mesh = record.render_from_mesh;
                self.table.set(slot as usize, gpu_types::Instance { previous_render_from_mesh, ..record });
            }
        }
    }

    /// Slots in use with their instance.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, &Slot)> {
        self.slots.iter().enumerate().filter_map(|(i, slot)| slot.as_ref().map(|slot| (i as u32, slot)))
    }

    pub(crate) fn get(&self, slot: u32) -> Option<&Slot> {
        self.slots.get(slot as usize).and_then(Option::as_ref)
    }

    pub(crate) fn slot_of(&self, id: InstanceId) -> Option<u32> {
        self.by_id.get(&id).copied()
    }

    /// Every material in use, once.
    pub(crate) fn materials_in_use(&self) -> impl Iterator<Item = MaterialId> {
        self.uses.keys().copied()
    }

    /// Whether any ray can meet an instance.
    pub(crate) fn is_met(&self, id: InstanceId) -> bool {
        self.slot_of(id).and_then(|slot| self.get(slot)).is_some_and(Slot::is_met)
    }

    /// Whether any ray can meet an instance of a mesh.
    pub(crate) fn meets_mesh(&self, mesh: MeshId) -> bool {
        self.met.meshes.contains_key(&mesh)
    }

    /// The materials that rays can meet.
    pub(crate) fn met_materials(&self) -> &BTreeMap<MaterialId, i64> {
        &self.met.materials
    }

    /// Whether some instance has a material.
    pub(crate) fn uses_material(&self, id: MaterialId) -> bool {
        self.uses.contains_key(&id)
    }

    /// Materials that came into use, or out of it, since the last call.
    pub(crate) fn take_newly_used(&mut self) -> BTreeSet<MaterialId> {
        std::mem::take(&mut self.newly_used)
    }

    /// Where an instance was in the last frame.
    pub(crate) fn previous_transform(&self, slot: u32) -> Option<&Rows> {
        self.table.get(slot as usize).map(|record| &record.previous_render_from_mesh)
    }

    pub(crate) fn is_mirrored(&self, slot: u32) -> bool {
        self.table.get(slot as usize).is_some_and(|record| record.flags & INSTANCE_MIRRORED != 0)
    }

    /// Number of slots, free ones among them.
    pub(crate) fn slot_count(&self) -> u32 {
        self.slots.len() as u32
    }

    /// Number of instances.
    pub(crate) fn len(&self) -> usize {
        self.by_id.len()
    }

    pub(crate) fn address(&self) -> u64 {
        self.table.address()
    }

    pub(crate) fn material_slots_address(&self) -> u64 {
        self.material_slots.address()
    }

    /// Records the copy of the table back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<Download> {
        self.table.download(recorder)
    }

    /// Records the copy of the material slots back to the host.
    pub(crate) fn download_material_slots(&self, recorder: &mut Recorder) -> Result<Download> {
        self.material_slots.download(recorder)
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.table.is_dirty() || self.material_slots.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.table.flush(recorder)?;
        self.material_slots.flush(recorder)
    }

    fn take_range(&mut self, count: u32) -> u32 {
        let free = self.free_ranges.get_mut(&count).and_then(Vec::pop);
        free.unwrap_or_else(|| {
            let start = self.material_slots.len() as u32;
            if count > 0 {
                self.material_slots.set((start + count) as usize - 1, 0);
            }
            start
        })
    }

    fn free_range(&mut self, start: u32, count: u32) {
        self.free_ranges.entry(count).or_default().push(start);
    }
}

/// How many instances that rays can meet have a mesh or a material; what none has is not listed.
#[derive(Default)]
struct Met {
    meshes: BTreeMap<MeshId, i64>,
    materials: BTreeMap<MaterialId, i64>,
}

impl Met {
    fn count(&mut self, slot: &Slot, change: i64) {
        if slot.is_met() {
            self.add(&slot.instance, change);
        }
    }

    fn add(&mut self, instance: &Instance, change: i64) {
        add(&mut self.meshes, instance.mesh, change);
        instance.materials.iter().for_each(|id| add(&mut self.materials, *id, change));
    }
}

fn add<K: Ord>(counts: &mut BTreeMap<K, i64>, key: K, change: i64) {
    match counts.entry(key) {
        Entry::Occupied(mut entry) => {
            *entry.get_mut() += change;
            if *entry.get() == 0 {
                entry.remove();
            }
        }
        Entry::Vacant(entry) => {
            entry.insert(change);
        }
    }
}

/// An instance has one material for each geometry of its mesh.
fn check_materials(instance: &Instance, geometry_count: u32) -> Result<()> {
    let found = instance.materials.len();
    if found == geometry_count as usize {
        return Ok(());
    }
    Err(RendererError::Materials { mesh: instance.mesh.0, found, geometry_count })
}

/// Fills in what follows from the transform.
fn place(record: &mut gpu_types::Instance, transform: &Affine3A, previous: Option<Rows>) {
    record.render_from_mesh = rows_of(transform);
    record.previous_render_from_mesh = previous.unwrap_or(record.render_from_mesh);
    record.normal_from_mesh = rows_of(&Affine3A::from_mat3(cofactor(&transform.matrix3).into()));
    record.flags = if transform.matrix3.determinant() < 0.0 { INSTANCE_MIRRORED } else { 0 };
}

/// The cofactor matrix, scaled so that its largest entry is 1: it turns normals whatever the scale, mirrored and
/// flattened maps too, where the inverse transpose does not exist.
fn cofactor(m: &Mat3A) -> Mat3A {
    // The linear part is scaled first, so that tiny and huge scales neither underflow nor overflow.
    let largest = |m: &Mat3A| m.x_axis.abs().max(m.y_axis.abs()).max(m.z_axis.abs()).max_element();
    let scale = largest(m);
    if !(scale.is_finite() && scale > 0.0) {
        return Mat3A::IDENTITY;
    }
    let (a, b, c) = (m.x_axis / scale, m.y_axis / scale, m.z_axis / scale);
    let result = Mat3A::from_cols(b.cross(c), c.cross(a), a.cross(b));
    let largest = largest(&result);
    if largest > 0.0 {
        Mat3A::from_cols(result.x_axis / largest, result.y_axis / largest, result.z_axis / largest)
    } else {
        result
    }
}

/// A map that no acceleration structure may hold: not finite, or it flattens space. The test does not depend on the
/// scale: it compares the volume with the product of the edges.
pub(crate) fn is_degenerate(map: &Affine3A) -> bool {
    if !map.is_finite() {
        return true;
    }
    let m = map.matrix3;
    let length = |v: Vec3A| v.as_dvec3().length();
    let edges = length(m.x_axis) * length(m.y_axis) * length(m.z_axis);
    let volume = m.x_axis.as_dvec3().cross(m.y_axis.as_dvec3()).dot(m.z_axis.as_dvec3()).abs();
    !(edges > 0.0 && volume > 1e-7 * edges)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    #[test]
    fn normals_stay_perpendicular_under_mirror_and_anisotropy() {
        for scale in [
            Vec3::new(-1.0, 1.0, 1.0),
            Vec3::new(1e-3, 1e3, 1.0),
            Vec3::new(1e-6, 1.0, 1.0),
            Vec3::splat(1e-9),
        ] {
            let map = Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(0.3), Vec3::X);
            let (normal, tangent) =
                (Vec3A::new(1.0, 2.0, -1.0).normalize(), Vec3A::new(2.0, -1.0, 0.0).normalize());
            let n = (cofactor(&map.matrix3) * normal).normalize();
            let t = (map.matrix3 * tangent).normalize();
            assert!(n.dot(t).abs() < 1e-6, "{scale}: {}", n.dot(t));
        }
    }

    #[test]
    fn the_naive_inverse_transpose_fails_where_the_cofactor_holds() {
        let flat = Mat3A::from_diagonal(Vec3::new(1.0, 0.0, 1.0));
        assert!(!flat.inverse().transpose().is_finite());
        assert_eq!(cofactor(&flat) * Vec3A::Y, Vec3A::Y);
    }

    #[test]
    fn degenerate_maps_are_found_at_every_scale() {
        for scale in [1e-12, 1e-3, 1.0, 1e9] {
            assert!(!is_degenerate(&Affine3A::from_scale(Vec3::splat(scale))), "{scale}");
            assert!(is_degenerate(&Affine3A::from_scale(Vec3::new(scale, 0.0, scale))), "{scale}");
        }
        assert!(is_degenerate(&Affine3A::from_translation(Vec3::new(f32::NAN, 0.0, 0.0))));
        assert!(is_degenerate(&Affine3A::from_scale(Vec3::splat(f32::INFINITY))));
    }
}
