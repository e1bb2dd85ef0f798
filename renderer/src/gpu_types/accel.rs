//! Twins of `shaders/shared/accel.glsl`.

use super::Rows;

twins! {
    /// What the instance descriptor of one slot is made of, beside its transform.
    struct TlasSlot, size 12 {
        /// Index into [`DescriptorJob::blases`], or [`TLAS_NO_BLAS`].
        0 blas: u32,
        /// Instance mask (8 bits), then VkGeometryInstanceFlagsKHR (8 bits).
        4 mask_flags: u32,
        /// Where the descriptor stands.
        8 place: u32,
    }

    /// What one run of the pass `instance_descriptors` works on, by device address.
    struct DescriptorJob, size 48 {
        /// [`super::Instance`] by slot.
        0 instances: u64,
        /// [`TlasSlot`] by slot.
        8 slots: u64,
        /// `u64[]`: addresses of BLASes by number, 0 where nothing is built.
        16 blases: u64,
        /// [`InstanceDescriptor`] by place.
        24 descriptors: u64,
        /// `u32[count]`: the slots to write; 0: all below `count`.
        32 listed: u64,
        /// Number of slots.
        40 count: u32,
        /// Zero.
        44 pad0: u32,
    }

    /// VkAccelerationStructureInstanceKHR.
    struct InstanceDescriptor, size 64 {
        /// Mesh space to render space.
        0 transform: Rows,
        /// Custom index (24 bits), mask (8 bits).
        48 index_mask: u32,
        /// Offset into the hit groups (24 bits), flags (8 bits).
        52 offset_flags: u32,
        /// Device address of the BLAS; 0: inactive.
        56 blas: u64,
    }
}

/// [`TlasSlot::blas`]: nothing stands there.
pub const TLAS_NO_BLAS: u32 = 0xffff_ffff;
