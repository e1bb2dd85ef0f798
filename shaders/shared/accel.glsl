// What the pass that writes instance descriptors reads and writes. Host twins: renderer/src/gpu_types.rs (TlasSlot, DescriptorJob).
#ifndef SHARED_ACCEL
#define SHARED_ACCEL

#include "shared/scene.glsl"

// TlasSlot.blas: nothing stands there.
const uint TLAS_NO_BLAS = 0xffffffffu;

// One a slot of the instance table.
struct TlasSlot {
    uint blas;                  // index into DescriptorJob.blases, or TLAS_NO_BLAS
    uint mask_flags;            // instance mask (8 bits), then VkGeometryInstanceFlagsKHR (8 bits)
    uint place;                 // where the descriptor stands
};

struct DescriptorJob {
    uint64_t instances;         // Instance[], by slot
    uint64_t slots;             // TlasSlot[], by slot
    uint64_t blases;            // uint64_t[]: device addresses, 0 where nothing is built
    uint64_t descriptors;       // InstanceDescriptor[], by place
    uint64_t listed;            // uint[count]: the slots to write; 0: all below count
    uint count;
    uint pad0;
};

// VkAccelerationStructureInstanceKHR.
struct InstanceDescriptor {
    vec4 transform[3];
    uint index_mask;            // custom index (24 bits), mask (8 bits)
    uint offset_flags;          // offset into the hit groups (24 bits), flags (8 bits)
    uint64_t blas;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TlasSlotTable { TlasSlot at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer AddressTable { uint64_t at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) writeonly buffer DescriptorTable { InstanceDescriptor at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer DescriptorJobTable { DescriptorJob job; };

#endif
