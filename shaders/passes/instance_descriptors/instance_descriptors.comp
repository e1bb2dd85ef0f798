// Pass instance_descriptors: what the TLAS is built from. In: an InstanceDescriptorJob at frame_address. Out: one descriptor a slot that is dirty.
// An instance without a BLAS gets the identity and no reference; so does one whose transform is not finite, which the host never asks for:
// one NaN in a TLAS takes its neighbours with it.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

#include "shared/frame.glsl"
#include "shared/instance_descriptors.glsl"
#include "lib/vector.glsl"

InstanceDescriptor describe(InstanceDescriptorJob job, uint slot, TlasSlot entry) {
    InstanceDescriptor descriptor;
    descriptor.render_from_mesh = InstanceTable(job.instances).at[slot].render_from_mesh;
    descriptor.index_mask = (slot & 0xffffffu) | entry.mask_flags << 24;
    descriptor.offset_flags = (entry.mask_flags >> 16 & 0xffu) | entry.mask_flags >> 8 << 24;
    descriptor.blas = entry.blas != TLAS_NO_BLAS ? AddressTable(job.blases).at[entry.blas] : 0ul;
    vec4 rows[3] = descriptor.render_from_mesh;
    if (descriptor.blas == 0ul || !(is_finite(rows[0]) && is_finite(rows[1]) && is_finite(rows[2]))) {
        descriptor.render_from_mesh = vec4[3](vec4(1.0, 0.0, 0.0, 0.0), vec4(0.0, 1.0, 0.0, 0.0), vec4(0.0, 0.0, 1.0, 0.0));
        descriptor.blas = 0ul;
    }
    return descriptor;
}

void main() {
    InstanceDescriptorJob job = DescriptorJobTable(push.frame_address).job;
    uint step = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    for (uint i = gl_GlobalInvocationID.x; i < job.count; i += step) {
        uint slot = job.dirty != 0ul ? UintTable(job.dirty).at[i] : i;
        TlasSlot entry = TlasSlotTable(job.slots).at[slot];
        DescriptorOutput(job.descriptors).at[entry.place] = describe(job, slot, entry);
    }
}
