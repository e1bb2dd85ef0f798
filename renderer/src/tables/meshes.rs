//! Meshes on the device: vertices and indices, or shapes, in device-local memory, one geometry record a primitive.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use caustica_gpu::{Buffer, BufferUse, Device, Location, MemoryUse, Recorder, ResourceId};
use glam::{Affine3A, Vec3};

use super::deformation::DeformationBuffers;
use super::placement::{bounds_of, centre_of, placed, standing};
use super::shapes::{self, ShapeBuffers};
use super::spatial_order::sort_triangles;
use crate::delta::{self, Mesh, MeshId};
use crate::error::{RendererError, Result};
use crate::gpu_types::{self, GEOMETRY_MOVED, GEOMETRY_MOVING, GEOMETRY_SHAPES, Rows, VertexAttributes};
use crate::passes::ShapeBoxes;

/// Offset of `mesh_from_primitive` inside a geometry record; acceleration structure builds read it there.
pub(super) const TRANSFORM_OFFSET: u64 =
    std::mem::offset_of!(gpu_types::Geometry, mesh_from_primitive) as u64;

/// Vertices and indices; a build in the background holds them until it has finished.
pub(crate) struct Vertices {
    pub(crate) positions: Buffer,
    attributes: Buffer,
    pub(crate) indices: Buffer,
}

/// One mesh on the device.
pub(crate) struct GpuMesh {
    pub(crate) vertices: Arc<Vertices>,
    /// Its spheres and boxes; `None`: triangles.
    pub(crate) shapes: Option<Arc<ShapeBuffers>>,
    /// Geometry records, as on the device.
    records: Vec<gpu_types::Geometry>,
    pub(crate) geometries: Buffer,
    /// How it deforms; `None`: rigid.
    pub(super) deformation: Option<Arc<DeformationBuffers>>,
    /// The content, for emissive triangles and statistics.
    pub(crate) host: Arc<Mesh>,
    /// Bounds of each primitive, primitive space.
    bounds: Vec<(Vec3, Vec3)>,
    /// Middle of its bounds, mesh space.
    pub(crate) centre: Vec3,
}

/// Everything that a mesh, or an instance that deforms, has on the device.
pub(crate) struct MeshBuffers<'a> {
    /// Positions, attributes and, where they are its own, indices; or shapes and their boxes.
    pub(crate) vertices: Vec<&'a Buffer>,
    /// Geometry records.
    pub(crate) geometries: &'a Buffer,
}

impl GpuMesh {
    /// Its buffers, to be read back.
    pub(crate) fn buffers(&self) -> MeshBuffers<'_> {
        let Vertices { positions, attributes, indices } = self.vertices.as_ref();
        let vertices = match &self.shapes {
            Some(shapes) => shapes.buffers().to_vec(),
            None => vec![positions, attributes, indices],
        };
        MeshBuffers { vertices, geometries: &self.geometries }
    }

    /// Address of the geometry records.
    pub(crate) fn geometries_address(&self) -> u64 {
        self.geometries.address()
    }

    /// Address of the positions: of a mesh that deforms, at rest.
    pub(super) fn positions_address(&self) -> u64 {
        self.vertices.positions.address()
    }

    /// Address of the vertex attributes: of a mesh that deforms, at rest.
    pub(super) fn attributes_address(&self) -> u64 {
        self.vertices.attributes.address()
    }

    /// A number that no other content of this or another mesh has had.
    pub(super) fn content(&self) -> ResourceId {
        self.vertices.positions.id()
    }

    /// Number of primitives.
    pub(crate) fn geometry_count(&self) -> u32 {
        self.host.geometries.len() as u32
    }

    /// Number of triangles or shapes of all primitives: what a build takes.
    pub(crate) fn element_count(&self) -> u64 {
        self.records.iter().map(|record| u64::from(record.triangle_count)).sum()
    }

    /// Number of triangles of all primitives.
    pub(crate) fn triangle_count(&self) -> u64 {
        if self.shapes.is_some() { 0 } else { self.element_count() }
    }

    /// Input of a BLAS build for geometry `index`.
    pub(crate) fn triangles(&self, index: usize, opaque: bool) -> caustica_gpu::TriangleGeometry {
        let geometry = &self.host.geometries[index];
        caustica_gpu::TriangleGeometry {
            positions: self.vertices.positions.address(),
            vertex_count: self.host.positions.len() as u32,
            indices: self.vertices.indices.address() + u64::from(geometry.first_index) * 4,
            triangle_count: geometry.index_count / 3,
            transform: self.geometries.address() + record_offset(index) + TRANSFORM_OFFSET,
            opaque,
        }
    }

    /// Input of a BLAS build for geometry `index` of a mesh of shapes.
    pub(crate) fn boxes(&self, index: usize, opaque: bool) -> Option<caustica_gpu::BoxGeometry> {
        let geometry = self.host.geometries.get(index)?;
        Some(self.shapes.as_ref()?.input(geometry, opaque))
    }

    /// Bounds of primitive `index` where it stands now, mesh space.
    pub(crate) fn placed_bounds(&self, index: usize) -> (Vec3, Vec3) {
        placed(self.bounds[index], &self.host.geometries[index].mesh_from_primitive)
    }
}

/// What became of a primitive that was to be moved.
pub(crate) struct MovedPrimitive {
    /// Where it stands.
    pub(crate) map: Affine3A,
    /// It was turned over, or turned back.
    pub(crate) turned_over: bool,
}

/// All meshes, by id.
pub(crate) struct Meshes {
    device: Arc<Device>,
    by_id: BTreeMap<MeshId, GpuMesh>,
    triangle_count: u64,
    /// Primitives that moved in the last frame.
    moved_last_frame: BTreeSet<(MeshId, u32)>,
    /// Records that differ from those on the device.
    dirty: BTreeSet<(MeshId, u32)>,
    /// Primitives of shapes whose boxes are not those of where they stand.
    unboxed: BTreeSet<(MeshId, u32)>,
}

impl Meshes {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            device: Arc::clone(device),
            by_id: BTreeMap::new(),
            triangle_count: 0,
            moved_last_frame: BTreeSet::new(),
            dirty: BTreeSet::new(),
            unboxed: BTreeSet::new(),
        }
    }

    pub(crate) fn get(&self, id: MeshId) -> Result<&GpuMesh> {
        self.by_id.get(&id).ok_or_else(|| RendererError::Unknown { what: "mesh", id: id.0.to_string() })
    }

    /// All meshes in order of id.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (MeshId, &GpuMesh)> {
        self.by_id.iter().map(|(id, mesh)| (*id, mesh))
    }

    /// Uploads a mesh, or its new content. True: it took another's place.
    pub(crate) fn set(&mut self, recorder: &mut Recorder, id: MeshId, mesh: &Arc<Mesh>) -> Result<bool> {
        check(mesh, &self.device)?;
        let deformation = DeformationBuffers::new(&self.device, recorder, mesh)?.map(Arc::new);
        let mut mesh = in_spatial_order(mesh);
        let bounds: Vec<_> = mesh.geometries.iter().map(|geometry| bounds_of(&mesh, geometry)).collect();
        for (geometry, bounds) in mesh.geometries.iter_mut().zip(&bounds) {
            geometry.mesh_from_primitive = standing(&geometry.mesh_from_primitive, *bounds);
        }
        let mesh = Arc::new(mesh);
        let make = |what: &str, size: usize| {
            let name = format!("{} {what}", mesh.name);
            let (usage, kind) = (BufferUse::Geometry, MemoryUse::Geometry);
            Buffer::new(&self.device, &name, size as u64, usage, Location::Device, kind)
        };
        let shapes = ShapeBuffers::new(&self.device, recorder, &mesh)?.map(Arc::new);
        let attributes = attributes_of(&mesh);
        let vertices = Arc::new(Vertices {
            positions: make("positions", mesh.positions.len() * 12)?,
            attributes: make("attributes", size_of_val(attributes.as_slice()))?,
            indices: make("indices", mesh.indices.len() * 4)?,
        });
        recorder.upload(&vertices.positions, 0, bytemuck::cast_slice(&mesh.positions))?;
        recorder.upload(&vertices.attributes, 0, bytemuck::cast_slice(&attributes))?;
        recorder.upload(&vertices.indices, 0, bytemuck::cast_slice(&mesh.indices))?;
        let record = |geometry| record_of(geometry, &vertices, shapes.as_deref());
        let records: Vec<_> = mesh.geometries.iter().map(record).collect();
        let geometries = make("geometries", size_of_val(records.as_slice()))?;
        self.dirty.extend((0..records.len() as u32).map(|geometry| (id, geometry)));
        self.unboxed.extend((0..records.len() as u32).map(|geometry| (id, geometry)));
        let centre = centre_of(&mesh, &bounds);
        let new = GpuMesh { vertices, shapes, records, geometries, deformation, host: mesh, bounds, centre };
        self.triangle_count += new.triangle_count();
        let old = self.by_id.insert(id, new);
        self.triangle_count -= old.as_ref().map_or(0, GpuMesh::triangle_count);
        Ok(old.is_some())
    }

    /// Moves a primitive inside its mesh. Returns where it stands now: nowhere, when single precision ends before.
    ///
    /// # Errors
    /// When there is no such mesh or primitive.
    pub(crate) fn set_primitive(
        &mut self,
        id: MeshId,
        geometry: u32,
        mesh_from_primitive: &Affine3A,
    ) -> Result<MovedPrimitive> {
        let unknown =
            || RendererError::Unknown { what: "primitive of a mesh", id: format!("{}/{geometry}", id.0) };
        let mesh = self.by_id.get_mut(&id).ok_or_else(unknown)?;
        let record = mesh.records.get_mut(geometry as usize).ok_or_else(unknown)?;
        let map = standing(mesh_from_primitive, mesh.bounds[geometry as usize]);
        if !self.moved_last_frame.contains(&(id, geometry)) {
            record.previous_mesh_from_primitive = record.mesh_from_primitive;
        }
        record.mesh_from_primitive = rows_of(&map);
        record.flags = (record.flags & GEOMETRY_SHAPES) | GEOMETRY_MOVED | GEOMETRY_MOVING;
        self.moved_last_frame.insert((id, geometry));
        let host = &mut Arc::make_mut(&mut mesh.host).geometries[geometry as usize];
        let old = std::mem::replace(&mut host.mesh_from_primitive, map);
        mesh.centre = centre_of(&mesh.host, &mesh.bounds);
        self.dirty.insert((id, geometry));
        self.unboxed.insert((id, geometry));
        Ok(MovedPrimitive { map, turned_over: turned(&old) != turned(&map) })
    }

    /// A frame has gone by: primitives that moved in it stand still until they move again.
    pub(crate) fn settle(&mut self) {
        for (id, geometry) in std::mem::take(&mut self.moved_last_frame) {
            let Some(mesh) = self.by_id.get_mut(&id) else { continue };
            let Some(record) = mesh.records.get_mut(geometry as usize) else { continue };
            record.previous_mesh_from_primitive = record.mesh_from_primitive;
            let moved = moved_flag(&mesh.host.geometries[geometry as usize].mesh_from_primitive);
            record.flags = (record.flags & GEOMETRY_SHAPES) | moved;
            self.dirty.insert((id, geometry));
        }
    }

    pub(crate) fn is_dirty(&self) -> bool {
        !self.dirty.is_empty()
    }

    /// Uploads the geometry records that changed.
    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        for (id, geometry) in std::mem::take(&mut self.dirty) {
            let Some(mesh) = self.by_id.get(&id) else { continue };
            let Some(record) = mesh.records.get(geometry as usize) else { continue };
            let offset = record_offset(geometry as usize);
            recorder.upload(&mesh.geometries, offset, bytemuck::bytes_of(record))?;
        }
        Ok(())
    }

    /// Makes the boxes around the shapes that are new or have moved; the records must be uploaded. `group`: stands for the
    /// geometry in the barrier tracker.
    pub(crate) fn make_boxes(
        &mut self,
        recorder: &mut Recorder,
        pass: &ShapeBoxes,
        group: ResourceId,
    ) -> Result<()> {
        let job = |(id, geometry): &(MeshId, u32)| {
            let mesh = self.by_id.get(id)?;
            let range = mesh.host.geometries.get(*geometry as usize)?;
            let record = mesh.geometries.address() + record_offset(*geometry as usize);
            Some(mesh.shapes.as_ref()?.job(range, record)).filter(|job| job.count > 0)
        };
        let jobs: Vec<_> = self.unboxed.iter().filter_map(job).collect();
        pass.record(recorder, &jobs, group)?;
        self.unboxed.clear();
        Ok(())
    }

    /// Whether some mesh holds shapes.
    pub(crate) fn hold_shapes(&self) -> bool {
        self.by_id.values().any(|mesh| mesh.shapes.is_some())
    }

    pub(crate) fn remove(&mut self, id: MeshId) {
        if let Some(old) = self.by_id.remove(&id) {
            self.triangle_count -= old.triangle_count();
        }
    }

    pub(crate) fn triangle_count(&self) -> u64 {
        self.triangle_count
    }
}

fn record_offset(index: usize) -> u64 {
    (index * size_of::<gpu_types::Geometry>()) as u64
}

fn record_of(
    geometry: &delta::Geometry,
    vertices: &Vertices,
    shapes: Option<&ShapeBuffers>,
) -> gpu_types::Geometry {
    let (mesh_from_primitive, moved) =
        (rows_of(&geometry.mesh_from_primitive), moved_flag(&geometry.mesh_from_primitive));
    if let Some(shapes) = shapes {
        let records = shapes.records_address(geometry);
        return gpu_types::Geometry {
            positions: records,
            previous_positions: records,
            triangle_count: geometry.index_count,
            flags: GEOMETRY_SHAPES | moved,
            mesh_from_primitive,
            previous_mesh_from_primitive: mesh_from_primitive,
            ..bytemuck::Zeroable::zeroed()
        };
    }
    gpu_types::Geometry {
        positions: vertices.positions.address(),
        previous_positions: vertices.positions.address(),
        attributes: vertices.attributes.address(),
        indices: vertices.indices.address() + u64::from(geometry.first_index) * 4,
        triangle_count: geometry.index_count / 3,
        flags: moved,
        mesh_from_primitive,
        previous_mesh_from_primitive: mesh_from_primitive,
        ..bytemuck::Zeroable::zeroed()
    }
}

fn moved_flag(map: &Affine3A) -> u32 {
    if *map == Affine3A::IDENTITY { 0 } else { GEOMETRY_MOVED }
}

fn turned(map: &Affine3A) -> bool {
    map.matrix3.determinant() < 0.0
}

/// Three rows of an affine map.
pub(crate) fn rows_of(map: &Affine3A) -> Rows {
    let m = map.matrix3;
    let t = map.translation;
    [
        [m.x_axis.x, m.y_axis.x, m.z_axis.x, t.x],
        [m.x_axis.y, m.y_axis.y, m.z_axis.y, t.y],
        [m.x_axis.z, m.y_axis.z, m.z_axis.z, t.z],
    ]
}

/// The mesh with the triangles or shapes of each geometry in spatial order.
fn in_spatial_order(mesh: &Mesh) -> Mesh {
    // What deforms is on the device alone.
    let mut sorted = Mesh { deformation: None, ..mesh.clone() };
    for geometry in &mesh.geometries {
        let range = geometry.first_index as usize..(geometry.first_index + geometry.index_count) as usize;
        if mesh.shapes.is_empty() {
            sort_triangles(&mesh.positions, &mut sorted.indices[range]);
        } else {
            shapes::sort_shapes(&mut sorted.shapes[range]);
        }
    }
    sorted
}

/// Refuses a mesh that would read out of bounds or that the device cannot take.
fn check(mesh: &Mesh, device: &Device) -> Result<()> {
    shapes::check(mesh)?;
    let n = mesh.positions.len();
    let refuse = |what: &str, asked: usize, limit: u64| {
        Err(RendererError::Limit {
            what: format!("mesh '{}': {what}", mesh.name),
            asked: asked as u64,
            limit,
        })
    };
    for (what, len) in [("normals", mesh.normals.len()), ("tangents", mesh.tangents.len())] {
        if len != n {
            return refuse(what, len, n as u64);
        }
    }
    for (what, len) in [
        ("texture coordinates 0", mesh.tex_coords0.len()),
        ("texture coordinates 1", mesh.tex_coords1.len()),
        ("colours", mesh.colors.len()),
    ] {
        if len != 0 && len != n {
            return refuse(what, len, n as u64);
        }
    }
    if let Some(index) = mesh.indices.iter().max().filter(|index| **index as usize >= n) {
        return refuse("vertex index", *index as usize, n as u64);
    }
    for geometry in mesh.geometries.iter().filter(|_| mesh.shapes.is_empty()) {
        let end = geometry.first_index as usize + geometry.index_count as usize;
        if end > mesh.indices.len() || !geometry.index_count.is_multiple_of(3) {
            return refuse("end of a primitive", end, mesh.indices.len() as u64);
        }
    }
    let limits = device.limits();
    if mesh.geometries.len() as u64 > limits.max_geometries {
        return refuse("primitives", mesh.geometries.len(), limits.max_geometries);
    }
    for (what, len) in [("triangles", mesh.indices.len() / 3), ("shapes", mesh.shapes.len())] {
        if len as u64 > limits.max_primitives {
            return refuse(what, len, limits.max_primitives);
        }
    }
    Ok(())
}

fn attributes_of(mesh: &Mesh) -> Vec<VertexAttributes> {
    let at = |list: &[glam::Vec2], i: usize| list.get(i).map_or([0.0, 0.0], |uv| uv.to_array());
    (0..mesh.positions.len())
        .map(|i| {
            let color = mesh.colors.get(i).copied().unwrap_or(glam::Vec4::ONE);
            VertexAttributes {
                normal: mesh.normals.get(i).copied().unwrap_or(Vec3::Z).to_array(),
                tangent: mesh.tangents.get(i).copied().unwrap_or(glam::Vec4::X).to_array(),
                tex_coord0: at(&mesh.tex_coords0, i),
                tex_coord1: at(&mesh.tex_coords1, i),
                color_rg: pack_half(color.x, color.y),
                color_ba: pack_half(color.z, color.w),
            }
        })
        .collect()
}

/// `packHalf2x16` of GLSL.
fn pack_half(low: f32, high: f32) -> u32 {
    u32::from(half_bits(low)) | (u32::from(half_bits(high)) << 16)
}

/// IEEE 754 binary16 of a float, rounded to nearest even; too large becomes the largest finite half.
fn half_bits(value: f32) -> u16 {
    const LARGEST: f32 = 65504.0;
    let sign = ((value.to_bits() >> 16) & 0x8000) as u16;
    let magnitude = if value.is_nan() { 0.0 } else { value.abs().min(LARGEST) };
    // Adding a power of two whose last bit is the last bit of the half rounds in the float unit (to nearest even).
    let exponent = ((magnitude.to_bits() >> 23) as i32 - 127).clamp(-14, 15);
    let step = f32::from_bits(((exponent - 10 + 23 + 127) as u32) << 23) * 1.5;
    let rounded = ((magnitude + step) - step).min(LARGEST);
    let bits = rounded.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    if rounded == 0.0 {
        sign
    } else if exponent < -14 {
        sign | (rounded * 16_777_216.0) as u16
    } else {
        sign | (((exponent + 15) as u16) << 10) | ((bits >> 13) & 0x3ff) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_rounded_to_nearest() {
        for (value, bits) in [
            (0.0, 0x0000),
            (1.0, 0x3c00),
            (-2.0, 0xc000),
            (0.5, 0x3800),
            (65504.0, 0x7bff),
            (1e9, 0x7bff),
            (6.103_515_6e-5, 0x0400),
            (5.960_464_5e-8, 0x0001),
            (1.000_976_6, 0x3c01),
            (0.333_333_34, 0x3555),
        ] {
            assert_eq!(half_bits(value), bits, "{value}");
        }
    }
}
