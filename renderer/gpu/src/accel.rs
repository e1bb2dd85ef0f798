//! Acceleration structures: sizes, build, refit, compaction. Enters: addresses of vertices, indices, boxes, instances.
//! Leaves: structures. When to do which is the renderer's business.

use std::sync::Arc;

use ash::vk;

use crate::Result;
use crate::buffer::{Buffer, BufferUse, Location};
use crate::context::Device;
use crate::error::Context;
use crate::memory::MemoryUse;
use crate::retire::Garbage;

/// An acceleration structure with its memory.
pub struct AccelStructure {
    pub(crate) raw: vk::AccelerationStructureKHR,
    address: u64,
    buffer: Buffer,
    device: Arc<Device>,
}

impl AccelStructure {
    /// Makes an empty structure of `size` bytes.
    ///
    /// # Errors
    /// [`crate::GpuError::OutOfMemory`] and other refusals of the driver.
    pub fn new(device: &Arc<Device>, name: &str, size: u64, top_level: bool) -> Result<Self> {
        let buffer = Buffer::new(
            device,
            name,
            size,
            BufferUse::AccelStorage,
            Location::Device,
            MemoryUse::AccelerationStructures,
        )?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(buffer.raw)
            .size(size)
            .ty(kind(top_level));
        // SAFETY: the buffer has the usage and size asked for and lives as long as the structure.
        let raw = unsafe { device.accel_fns.create_acceleration_structure(&info, None) }
            .during("vkCreateAccelerationStructureKHR")?;
        device.set_name(raw, name);
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
        // SAFETY: `raw` was just made.
        let address = unsafe { device.accel_fns.get_acceleration_structure_device_address(&info) };
        Ok(Self { raw, address, buffer, device: Arc::clone(device) })
    }

    /// Device address, as instances of a TLAS name it.
    pub fn address(&self) -> u64 {
        self.address
    }

    /// Bytes of memory.
    pub fn size(&self) -> u64 {
        self.buffer.size()
    }
}

impl Drop for AccelStructure {
    fn drop(&mut self) {
        // The structure goes before the buffer it lies in: the queue keeps the order.
        self.device.retire(Garbage::AccelStructure(self.raw));
    }
}

/// One geometry of triangles.
#[derive(Clone, Copy, Debug)]
pub struct TriangleGeometry {
    /// Address of `vertex_count` positions, three floats each.
    pub positions: u64,
    /// Number of positions.
    pub vertex_count: u32,
    /// Address of `triangle_count * 3` 32-bit indices.
    pub indices: u64,
    /// Number of triangles.
    pub triangle_count: u32,
    /// Address of a 3x4 row-major matrix, 16-byte aligned. Always given, so that an update stays legal.
    pub transform: u64,
    /// Opaque: any-hit is never called.
    pub opaque: bool,
}

/// One geometry of boxes, whose shapes an intersection shader knows.
#[derive(Clone, Copy, Debug)]
pub struct BoxGeometry {
    /// Address of `count` boxes of six floats (smallest x, y, z, largest x, y, z), [`BOX_STRIDE`] apart, 8-byte aligned.
    pub boxes: u64,
    /// Number of boxes.
    pub count: u32,
    /// Opaque: any-hit is never called.
    pub opaque: bool,
}

/// Bytes from one box to the next, the size of VkAabbPositionsKHR.
pub const BOX_STRIDE: u64 = 24;

/// Input of a TLAS build.
#[derive(Clone, Copy, Debug)]
pub struct TlasInstances {
    /// Address of `count` instance descriptors of 64 bytes, 16-byte aligned.
    pub descriptors: u64,
    /// Number of instances.
    pub count: u32,
}

/// What is built.
#[derive(Clone, Copy, Debug)]
pub enum AccelGeometry<'a> {
    /// A BLAS of triangles.
    Triangles(&'a [TriangleGeometry]),
    /// A BLAS of boxes.
    Boxes(&'a [BoxGeometry]),
    /// A TLAS.
    Instances(TlasInstances),
}

/// What the structure should be good at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BuildPreference {
    /// Traced often, built once. A BLAS may be compacted and never refitted; a TLAS may be refitted.
    FastTrace,
    /// Rebuilt and refitted often; never compacted.
    FastBuild,
}

/// Build anew or refit in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuildMode {
    /// From nothing.
    Build,
    /// In place; the counts and active states must be those of the last build.
    Refit,
}

/// Memory that a build needs.
#[derive(Clone, Copy, Debug)]
pub struct BuildSizes {
    /// Bytes of the structure.
    pub structure: u64,
    /// Bytes of scratch for a build.
    pub build_scratch: u64,
    /// Bytes of scratch for a refit.
    pub refit_scratch: u64,
}

/// One build or refit, as the recorder and the background take it.
#[derive(Clone, Copy)]
pub struct AccelBuild<'a> {
    /// The structure to fill.
    pub target: &'a AccelStructure,
    /// From what.
    pub geometry: AccelGeometry<'a>,
    /// Good at what; as given to [`Device::build_sizes`].
    pub preference: BuildPreference,
    /// Build or refit; a BLAS made with [`BuildPreference::FastTrace`] cannot be refitted.
    pub mode: BuildMode,
    /// Address of the scratch memory, aligned to the device's limit.
    pub scratch: u64,
}

impl Device {
    /// Asks how much memory a build needs.
    pub fn build_sizes(&self, geometry: AccelGeometry<'_>, preference: BuildPreference) -> BuildSizes {
        let geometries = vulkan_geometries(geometry);
        let counts = primitive_counts(geometry);
        let info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(kind(matches!(geometry, AccelGeometry::Instances(_))))
            .flags(build_flags(geometry, preference))
            .geometries(&geometries);
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: one count a geometry.
        unsafe {
            self.accel_fns.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &info,
                &counts,
                &mut sizes,
            );
        }
        BuildSizes {
            structure: sizes.acceleration_structure_size,
            build_scratch: sizes.build_scratch_size,
            refit_scratch: sizes.update_scratch_size,
        }
    }
}

/// Records builds that may run side by side. The caller has placed barriers and keeps scratch regions apart.
pub(crate) fn record_builds(device: &Device, command: vk::CommandBuffer, builds: &[AccelBuild<'_>]) {
    let geometries: Vec<_> = builds.iter().map(|build| vulkan_geometries(build.geometry)).collect();
    let ranges: Vec<Vec<_>> = builds
        .iter()
        .map(|build| {
            primitive_counts(build.geometry)
                .into_iter()
                .map(|count| vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count))
                .collect()
        })
        .collect();
    let infos: Vec<_> = builds
        .iter()
        .zip(&geometries)
        .map(|(build, geometries)| {
            let refit = build.mode == BuildMode::Refit;
            let source = if refit { build.target.raw } else { vk::AccelerationStructureKHR::null() };
            vk::AccelerationStructureBuildGeometryInfoKHR::default()
                .ty(kind(matches!(build.geometry, AccelGeometry::Instances(_))))
                .flags(build_flags(build.geometry, build.preference))
                .mode(if refit {
                    vk::BuildAccelerationStructureModeKHR::UPDATE
                } else {
                    vk::BuildAccelerationStructureModeKHR::BUILD
                })
                .src_acceleration_structure(source)
                .dst_acceleration_structure(build.target.raw)
                .geometries(geometries)
                .scratch_data(vk::DeviceOrHostAddressKHR { device_address: build.scratch })
        })
        .collect();
    let range_slices: Vec<&[_]> = ranges.iter().map(Vec::as_slice).collect();
    // SAFETY: structures, scratch and inputs are alive and large enough (build_sizes); barriers were placed.
    unsafe { device.accel_fns.cmd_build_acceleration_structures(command, &infos, &range_slices) };
}

/// Records the copy of a BLAS into one of its compacted size. The caller has placed barriers.
pub(crate) fn record_compaction(
    device: &Device,
    command: vk::CommandBuffer,
    from: &AccelStructure,
    to: &AccelStructure,
) {
    let info = vk::CopyAccelerationStructureInfoKHR::default()
        .src(from.raw)
        .dst(to.raw)
        .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
    // SAFETY: both live until the work has finished; `to` has the size that the device named for `from`.
    unsafe { device.accel_fns.cmd_copy_acceleration_structure(command, &info) };
}

/// Packs one instance descriptor (VkAccelerationStructureInstanceKHR). `transform`: three rows of a 3x4 matrix.
pub fn pack_instance(
    transform: [[f32; 4]; 3],
    custom_index: u32,
    mask: u8,
    flags: u8,
    blas_address: u64,
) -> [u8; 64] {
    let mut bytes = [0_u8; 64];
    for (target, value) in bytes.chunks_exact_mut(4).zip(transform.iter().flatten()) {
        target.copy_from_slice(&value.to_ne_bytes());
    }
    bytes[48..52].copy_from_slice(&((custom_index & 0x00ff_ffff) | (u32::from(mask) << 24)).to_ne_bytes());
    bytes[52..56].copy_from_slice(&(u32::from(flags) << 24).to_ne_bytes());
    bytes[56..64].copy_from_slice(&blas_address.to_ne_bytes());
    bytes
}

fn kind(top_level: bool) -> vk::AccelerationStructureTypeKHR {
    if top_level {
        vk::AccelerationStructureTypeKHR::TOP_LEVEL
    } else {
        vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL
    }
}

fn build_flags(
    geometry: AccelGeometry<'_>,
    preference: BuildPreference,
) -> vk::BuildAccelerationStructureFlagsKHR {
    use vk::BuildAccelerationStructureFlagsKHR as F;
    match (geometry, preference) {
        (AccelGeometry::Instances(_), BuildPreference::FastTrace) => F::PREFER_FAST_TRACE | F::ALLOW_UPDATE,
        (AccelGeometry::Triangles(_) | AccelGeometry::Boxes(_), BuildPreference::FastTrace) => {
            F::PREFER_FAST_TRACE | F::ALLOW_COMPACTION
        }
        (_, BuildPreference::FastBuild) => F::PREFER_FAST_BUILD | F::ALLOW_UPDATE,
    }
}

fn primitive_counts(geometry: AccelGeometry<'_>) -> Vec<u32> {
    match geometry {
        AccelGeometry::Triangles(list) => list.iter().map(|g| g.triangle_count).collect(),
        AccelGeometry::Boxes(list) => list.iter().map(|g| g.count).collect(),
        AccelGeometry::Instances(instances) => vec![instances.count],
    }
}

fn vulkan_geometries(geometry: AccelGeometry<'_>) -> Vec<vk::AccelerationStructureGeometryKHR<'_>> {
    match geometry {
        AccelGeometry::Triangles(list) => list.iter().map(triangles).collect(),
        AccelGeometry::Boxes(list) => list.iter().map(boxes).collect(),
        AccelGeometry::Instances(instances) => {
            let data = vk::AccelerationStructureGeometryInstancesDataKHR::default()
                .data(address(instances.descriptors));
            vec![
                vk::AccelerationStructureGeometryKHR::default()
                    .geometry_type(vk::GeometryTypeKHR::INSTANCES)
                    .geometry(vk::AccelerationStructureGeometryDataKHR { instances: data }),
            ]
        }
    }
}

fn triangles(g: &TriangleGeometry) -> vk::AccelerationStructureGeometryKHR<'static> {
    let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(address(g.positions))
        .vertex_stride(12)
        .max_vertex(g.vertex_count.saturating_sub(1))
        .index_type(vk::IndexType::UINT32)
        .index_data(address(g.indices))
        .transform_data(address(g.transform));
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
        .flags(geometry_flags(g.opaque))
}

fn boxes(g: &BoxGeometry) -> vk::AccelerationStructureGeometryKHR<'static> {
    let aabbs =
        vk::AccelerationStructureGeometryAabbsDataKHR::default().data(address(g.boxes)).stride(BOX_STRIDE);
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::AABBS)
        .geometry(vk::AccelerationStructureGeometryDataKHR { aabbs })
        .flags(geometry_flags(g.opaque))
}

fn geometry_flags(opaque: bool) -> vk::GeometryFlagsKHR {
    if opaque { vk::GeometryFlagsKHR::OPAQUE } else { vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION }
}

fn address(device_address: u64) -> vk::DeviceOrHostAddressConstKHR {
    vk::DeviceOrHostAddressConstKHR { device_address }
}
