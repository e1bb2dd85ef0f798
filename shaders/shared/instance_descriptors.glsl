// What pass `instance_descriptors` reads and writes. Host twins: renderer/src/gpu_types.rs (InstanceDescriptorJob, TlasSlot, InstanceDescriptor).
#ifndef SHARED_INSTANCE_DESCRIPTORS
#define SHARED_INSTANCE_DESCRIPTORS

#include "shared/scene.glsl"

const uint TLAS_NO_BLAS = 0xffffffffu;  // TlasSlot.blas: rays never meet the instance

// What to write.
struct InstanceDescriptorJob {
    uint64_t instances;     // InstanceTable, by slot
    uint64_t slots;         // TlasSlotTable, by slot
    uint64_t blases;        // AddressTable, by BLAS number; 0: not built
    uint64_t descriptors;   // DescriptorOutput, by place
    uint64_t dirty;         // UintTable: count slots; 0: the slots 0..count
    uint count;
    uint pad0;
};

// What the TLAS knows of a slot beside its transform.
struct TlasSlot {
    uint blas;              // number of its BLAS, or TLAS_NO_BLAS
    uint mask_flags;        // bits 0..8: MASK_*, bits 8..16: VkGeometryInstanceFlagsKHR, bits 16..24: SBT offset
    uint place;             // of its descriptor
};

// VkAccelerationStructureInstanceKHR.
struct InstanceDescriptor {
    vec4 render_from_mesh[3];
    uint index_mask;        // bits 0..24: slot, bits 24..32: mask
    uint offset_flags;      // bits 0..24: SBT offset, bits 24..32: flags
    uint64_t blas;          // 0: rays never meet it
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer DescriptorJobTable { InstanceDescriptorJob job; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TlasSlotTable { TlasSlot at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer AddressTable { uint64_t at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) writeonly buffer DescriptorOutput { InstanceDescriptor at[]; };

#endif
