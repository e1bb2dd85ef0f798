//! Spheres and boxes on the device: their records, and the boxes that BLASes are built from, which pass `shape_boxes`
//! makes on the device. Enters: the shapes of a mesh. Leaves: addresses, bounds, and a refusal in words.

use std::sync::Arc;

use caustica_gpu::{BoxGeometry, Buffer, BufferUse, Device, Location, MemoryUse, Recorder};
use glam::{DVec3, Vec3};

use super::spatial_order::order_of;
use crate::delta::{self, Mesh, ShapeKind};
use crate::error::{RendererError, Result};
use crate::gpu_types::{SHAPE_BOX, SHAPE_SPHERE, Shape, ShapeBox, ShapeBoxJob};

/// The shapes of one mesh. Each geometry has a run of them.
pub(crate) struct ShapeBuffers {
    records: Buffer,
    /// `ShapeBox` a shape, mesh space; written on the device.
    pub(crate) boxes: Buffer,
}

impl ShapeBuffers {
    /// Uploads the shapes of a mesh; `None` for one of triangles. The boxes are still to be made.
    ///
    /// # Errors
    /// When memory runs out.
    pub(crate) fn new(device: &Arc<Device>, recorder: &mut Recorder, mesh: &Mesh) -> Result<Option<Self>> {
        if mesh.shapes.is_empty() {
            return Ok(None);
        }
        let make = |what: &str, stride: usize| {
            let name = format!("{} {what}", mesh.name);
            let (usage, kind) = (BufferUse::Geometry, MemoryUse::Geometry);
            let size = (mesh.shapes.len() * stride) as u64;
            Buffer::new(device, &name, size, usage, Location::Device, kind)
        };
        let records: Vec<Shape> = mesh.shapes.iter().map(record_of).collect();
        let buffers = Self {
            records: make("shapes", size_of::<Shape>())?,
            boxes: make("shape boxes", size_of::<ShapeBox>())?,
        };
        recorder.upload(&buffers.records, 0, bytemuck::cast_slice(&records))?;
        Ok(Some(buffers))
    }

    /// Address of the records of a geometry.
    pub(super) fn records_address(&self, geometry: &delta::Geometry) -> u64 {
        self.records.address() + u64::from(geometry.first_index) * size_of::<Shape>() as u64
    }

    /// Records and boxes, to be read back.
    pub(super) fn buffers(&self) -> [&Buffer; 2] {
        [&self.records, &self.boxes]
    }

    fn boxes_address(&self, geometry: &delta::Geometry) -> u64 {
        self.boxes.address() + u64::from(geometry.first_index) * size_of::<ShapeBox>() as u64
    }

    /// What pass `shape_boxes` is to do for a geometry whose record lies at `record`.
    pub(super) fn job(&self, geometry: &delta::Geometry, record: u64) -> ShapeBoxJob {
        let (boxes, count) = (self.boxes_address(geometry), geometry.index_count);
        ShapeBoxJob { geometry: record, boxes, count, pad0: 0 }
    }

    /// Input of a BLAS build for a geometry.
    pub(super) fn input(&self, geometry: &delta::Geometry, opaque: bool) -> BoxGeometry {
        BoxGeometry { boxes: self.boxes_address(geometry), count: geometry.index_count, opaque }
    }
}

fn record_of(shape: &delta::Shape) -> Shape {
    Shape {
        centre: shape.centre.to_array(),
        kind: match shape.kind {
            ShapeKind::Sphere => SHAPE_SPHERE,
            ShapeKind::Box => SHAPE_BOX,
        },
        half_extent: half_extent(shape).to_array(),
    }
}

/// Half of the box around a shape, primitive space.
fn half_extent(shape: &delta::Shape) -> Vec3 {
    match shape.kind {
        ShapeKind::Sphere => Vec3::splat(shape.half_extent.x),
        ShapeKind::Box => shape.half_extent,
    }
}

/// Bounds of a shape, primitive space.
pub(super) fn bounds_of(shape: &delta::Shape) -> (Vec3, Vec3) {
    let reach = half_extent(shape);
    (shape.centre - reach, shape.centre + reach)
}

/// Puts the shapes of a geometry in spatial order.
pub(super) fn sort_shapes(shapes: &mut [delta::Shape]) {
    let centres: Vec<DVec3> = shapes.iter().map(|shape| shape.centre.as_dvec3()).collect();
    let sorted: Vec<delta::Shape> =
        order_of(&centres).into_iter().filter_map(|i| shapes.get(i as usize).copied()).collect();
    shapes.copy_from_slice(&sorted);
}

/// Refuses a mesh that holds triangles beside its shapes, or shapes of which the size is none. Nothing to say of a mesh
/// without shapes.
///
/// # Errors
/// In words, with the name of the mesh.
pub(super) fn check(mesh: &Mesh) -> Result<()> {
    if mesh.shapes.is_empty() {
        return Ok(());
    }
    fault(mesh).map_or(Ok(()), |reason| Err(RendererError::Shapes { mesh: mesh.name.clone(), reason }))
}

/// What is wrong with the shapes of a mesh, in words.
fn fault(mesh: &Mesh) -> Option<String> {
    if !(mesh.positions.is_empty() && mesh.indices.is_empty()) {
        return Some(String::from("it holds triangles too"));
    }
    if mesh.deformation.is_some() {
        return Some(String::from("shapes follow no skin and no morph targets"));
    }
    let is_size = |size: Vec3| size.is_finite() && size.min_element() >= 0.0;
    if let Some(bad) = mesh.shapes.iter().position(|shape| !is_size(half_extent(shape))) {
        return Some(format!("the size of shape {bad} is negative or no number"));
    }
    if let Some(bad) = mesh.shapes.iter().position(|shape| !shape.centre.is_finite()) {
        return Some(format!("the centre of shape {bad} is no number"));
    }
    let count = mesh.shapes.len() as u64;
    let end = |range: &delta::Geometry| u64::from(range.first_index) + u64::from(range.index_count);
    let past = mesh.geometries.iter().map(end).find(|end| *end > count);
    past.map(|end| format!("a primitive ends at shape {end} of {count}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;

    fn ball(x: f32) -> delta::Shape {
        delta::Shape {
            kind: ShapeKind::Sphere,
            centre: Vec3::X * x,
            half_extent: Vec3::new(0.5, -1.0, f32::NAN),
        }
    }

    fn mesh() -> Mesh {
        let geometry =
            delta::Geometry { first_index: 0, index_count: 3, mesh_from_primitive: Affine3A::IDENTITY };
        Mesh { shapes: [4.0, 0.0, 2.0].map(ball).to_vec(), geometries: vec![geometry], ..Mesh::default() }
    }

    #[test]
    fn only_the_radius_of_a_sphere_counts() {
        assert_eq!(fault(&mesh()), None);
        assert_eq!(record_of(&ball(1.0)).half_extent, [0.5; 3]);
        assert_eq!(bounds_of(&ball(1.0)), (Vec3::new(0.5, -0.5, -0.5), Vec3::new(1.5, 0.5, 0.5)));
    }

    #[test]
    fn wrong_shapes_are_refused_in_words() {
        let refused = |change: fn(&mut Mesh), words: &str| {
            let mut bad = mesh();
            change(&mut bad);
            let reason = fault(&bad).unwrap_or_default();
            assert!(reason.contains(words), "'{reason}' does not say '{words}'");
        };
        refused(|m| m.positions = vec![Vec3::ZERO; 3], "triangles too");
        refused(|m| m.indices = vec![0; 3], "triangles too");
        refused(|m| m.deformation = Some(delta::Deformation::default()), "no skin");
        refused(|m| m.shapes[1].half_extent.x = -1.0, "size of shape 1");
        refused(|m| m.shapes[2].half_extent.x = f32::INFINITY, "size of shape 2");
        refused(|m| m.shapes[0].kind = ShapeKind::Box, "size of shape 0");
        refused(|m| m.shapes[1].centre.y = f32::NAN, "centre of shape 1");
        refused(|m| m.geometries[0].index_count = 4, "ends at shape 4 of 3");
        let none = Mesh { shapes: Vec::new(), positions: vec![Vec3::NAN], ..mesh() };
        assert!(check(&none).is_ok(), "triangles are checked elsewhere");
    }

    #[test]
    fn shapes_are_put_in_spatial_order() {
        let mut shapes = mesh().shapes;
        sort_shapes(&mut shapes);
        assert_eq!(shapes.iter().map(|shape| shape.centre.x).collect::<Vec<_>>(), [0.0, 2.0, 4.0]);
    }
}
