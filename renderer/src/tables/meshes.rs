//! Meshes on the device: vertices and indices in device-local memory, one geometry record a primitive.

use std::collections::BTreeMap;
use std::sync::Arc;

use caustica_gpu::{Buffer, BufferUse, Device, Location, MemoryUse, Recorder, ResourceId};
use glam::{Affine3A, Vec3};

use super::deformation::DeformationBuffers;
use super::spatial_order::sort_triangles;
use crate::delta::{Mesh, MeshId};
use crate::error::{RendererError, Result};
use crate::gpu_types::{self, GEOMETRY_MOVED, Rows, VertexAttributes};

/// Offset of `mesh_from_primitive` inside a geometry record; acceleration structure builds read it there.
pub(super) const TRANSFORM_OFFSET: u64 =
    std::mem::offset_of!(gpu_types::Geometry, mesh_from_primitive) as u64;

/// One mesh on the device.
pub(crate) struct GpuMesh {
    positions: Buffer,
    attributes: Buffer,
    pub(crate) indices: Buffer,
    geometries: Buffer,
    /// How it deforms; `None`: rigid.
    pub(super) deformation: Option<Arc<DeformationBuffers>>,
    /// The content, for emissive triangles and statistics.
    pub(crate) host: Arc<Mesh>,
    /// Middle of its bounds, mesh space.
    pub(crate) centre: Vec3,
}

impl GpuMesh {
    /// Address of the geometry records.
    pub(crate) fn geometries_address(&self) -> u64 {
        self.geometries.address()
    }

    /// Address of the positions: of a mesh that deforms, at rest.
    pub(super) fn positions_address(&self) -> u64 {
        self.positions.address()
    }

    /// Address of the vertex attributes: of a mesh that deforms, at rest.
    pub(super) fn attributes_address(&self) -> u64 {
        self.attributes.address()
    }

    /// A number that no other content of this or another mesh has had.
    pub(super) fn content(&self) -> ResourceId {
        self.positions.id()
    }

    /// Number of primitives.
    pub(crate) fn geometry_count(&self) -> u32 {
        self.host.geometries.len() as u32
    }

    /// Input of a BLAS build for geometry `index`.
    pub(crate) fn triangles(&self, index: usize, opaque: bool) -> caustica_gpu::TriangleGeometry {
        let geometry = &self.host.geometries[index];
        caustica_gpu::TriangleGeometry {
            positions: self.positions.address(),
            vertex_count: self.host.positions.len() as u32,
            indices: self.indices.address() + u64::from(geometry.first_index) * 4,
            triangle_count: geometry.index_count / 3,
            transform: self.geometries.address()
                + index as u64 * size_of::<gpu_types::Geometry>() as u64
                + TRANSFORM_OFFSET,
            opaque,
        }
    }
}

/// All meshes, by id.
pub(crate) struct Meshes {
    device: Arc<Device>,
    by_id: BTreeMap<MeshId, GpuMesh>,
}

impl Meshes {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self { device: Arc::clone(device), by_id: BTreeMap::new() }
    }

    pub(crate) fn get(&self, id: MeshId) -> Result<&GpuMesh> {
        self.by_id.get(&id).ok_or_else(|| RendererError::Unknown { what: "mesh", id: id.0.to_string() })
    }

    /// Uploads a mesh, or its new content.
    pub(crate) fn set(&mut self, recorder: &mut Recorder, id: MeshId, mesh: &Arc<Mesh>) -> Result<()> {
        check(mesh, &self.device)?;
        let deformation = DeformationBuffers::new(&self.device, recorder, mesh)?.map(Arc::new);
        let mesh = &Arc::new(in_spatial_order(mesh));
        let make = |what: &str, size: usize| {
            let name = format!("{} {what}", mesh.name);
            Buffer::new(
                &self.device,
                &name,
                size as u64,
                BufferUse::Geometry,
                Location::Device,
                MemoryUse::Geometry,
            )
        };
        let attributes = attributes_of(mesh);
        let positions = make("positions", mesh.positions.len() * 12)?;
        let attribute_buffer = make("attributes", size_of_val(attributes.as_slice()))?;
        let indices = make("indices", mesh.indices.len() * 4)?;
        recorder.upload(&positions, 0, bytemuck::cast_slice(&mesh.positions))?;
        recorder.upload(&attribute_buffer, 0, bytemuck::cast_slice(&attributes))?;
        recorder.upload(&indices, 0, bytemuck::cast_slice(&mesh.indices))?;
        let records: Vec<_> = mesh
            .geometries
            .iter()
            .map(|geometry| gpu_types::Geometry {
                positions: positions.address(),
                previous_positions: positions.address(),
                attributes: attribute_buffer.address(),
                indices: indices.address() + u64::from(geometry.first_index) * 4,
                triangle_count: geometry.index_count / 3,
                flags: if geometry.mesh_from_primitive == Affine3A::IDENTITY { 0 } else { GEOMETRY_MOVED },
                mesh_from_primitive: rows_of(&geometry.mesh_from_primitive),
                previous_mesh_from_primitive: rows_of(&geometry.mesh_from_primitive),
                ..bytemuck::Zeroable::zeroed()
            })
            .collect();
        let geometries = make("geometries", size_of_val(records.as_slice()))?;
        recorder.upload(&geometries, 0, bytemuck::cast_slice(&records))?;
        let host = Arc::clone(mesh);
        let centre = centre_of(&host);
        self.by_id.insert(
            id,
            GpuMesh {
                positions,
                attributes: attribute_buffer,
                indices,
                geometries,
                deformation,
                host,
                centre,
            },
        );
        Ok(())
    }

    pub(crate) fn remove(&mut self, id: MeshId) {
        self.by_id.remove(&id);
    }

    pub(crate) fn triangle_count(&self) -> u64 {
        self.by_id.values().map(|mesh| mesh.host.indices.len() as u64 / 3).sum()
    }
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

/// Middle of the bounds of all primitives, mesh space.
fn centre_of(mesh: &Mesh) -> Vec3 {
    let placed = mesh.geometries.iter().flat_map(|geometry| {
        let range = geometry.first_index as usize..(geometry.first_index + geometry.index_count) as usize;
        let place = geometry.mesh_from_primitive;
        mesh.indices[range].iter().map(move |i| place.transform_point3(mesh.positions[*i as usize]))
    });
    let bounds = placed.fold(None, |bounds: Option<(Vec3, Vec3)>, p| {
        Some(bounds.map_or((p, p), |(low, high)| (low.min(p), high.max(p))))
    });
    bounds.map_or(Vec3::ZERO, |(low, high)| (low + high) * 0.5)
}

/// The mesh with the triangles of each geometry in spatial order.
fn in_spatial_order(mesh: &Mesh) -> Mesh {
    let mut sorted = mesh.clone();
    for geometry in &mesh.geometries {
        let range = geometry.first_index as usize..(geometry.first_index + geometry.index_count) as usize;
        sort_triangles(&mesh.positions, &mut sorted.indices[range]);
    }
    sorted
}

/// Refuses a mesh that would read out of bounds or that the device cannot take.
fn check(mesh: &Mesh, device: &Device) -> Result<()> {
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
    for geometry in &mesh.geometries {
        let end = geometry.first_index as usize + geometry.index_count as usize;
        if end > mesh.indices.len() || !geometry.index_count.is_multiple_of(3) {
            return refuse("end of a primitive", end, mesh.indices.len() as u64);
        }
    }
    let limits = device.limits();
    if mesh.geometries.len() as u64 > limits.max_geometries {
        return refuse("primitives", mesh.geometries.len(), limits.max_geometries);
    }
    if mesh.indices.len() as u64 / 3 > limits.max_primitives {
        return refuse("triangles", mesh.indices.len() / 3, limits.max_primitives);
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
