// Pass instance_descriptors: one instance descriptor of the TLAS a listed slot. In: instance table, records, BLAS addresses. Out: descriptors.
// A slot without a BLAS gets a null reference and the identity: a number that is not finite never reaches the builder.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/accel.glsl"
#include "shared/frame.glsl"

layout(local_size_x = 64) in;

bool is_finite_row(vec4 row) {
    return !any(isnan(row)) && !any(isinf(row));
}

void main() {
    DescriptorJob job = DescriptorJobTable(push.frame_address).job;
    uint index = gl_GlobalInvocationID.x;
    if (index >= job.count) {
        return;
    }
    uint slot = job.listed != 0ul ? UintTable(job.listed).at[index] : index;
    TlasSlot record = TlasSlotTable(job.slots).at[slot];
    uint64_t blas = record.blas != TLAS_NO_BLAS ? AddressTable(job.blases).at[record.blas] : 0ul;
    vec4 rows[3] = InstanceTable(job.instances).at[slot].render_from_mesh;
    if (blas == 0ul || !is_finite_row(rows[0]) || !is_finite_row(rows[1]) || !is_finite_row(rows[2])) {
        rows = vec4[3](vec4(1.0, 0.0, 0.0, 0.0), vec4(0.0, 1.0, 0.0, 0.0), vec4(0.0, 0.0, 1.0, 0.0));
        blas = 0ul;
    }
    InstanceDescriptor descriptor;
    descriptor.transform = rows;
    descriptor.index_mask = (slot & 0xffffffu) | (record.mask_flags & 0xffu) << 24;
    descriptor.offset_flags = (record.mask_flags >> 8 & 0xffu) << 24;
    descriptor.blas = blas;
    DescriptorTable(job.descriptors).at[record.place] = descriptor;
}
