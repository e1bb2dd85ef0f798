// What pass `deform` reads for one instance of a mesh that deforms. Host twins: renderer/src/gpu_types.rs (DeformJob, MorphUse, JointInfluences).
#ifndef SHARED_DEFORM
#define SHARED_DEFORM

#include "shared/scene.glsl"

// One instance. Its vertices are made anew from those of the mesh at rest.
struct DeformJob {
    uint64_t rest_positions;        // PositionTable
    uint64_t rest_attributes;       // AttributeTable
    uint64_t influences;            // InfluenceTable; 0: no joint moves it
    uint64_t joints;                // RowTable: three rows a joint, mesh space at rest to mesh space as posed
    uint64_t targets;               // MorphUse[target_count]: those with a weight
    uint64_t positions;             // PositionOutput: of the last evaluation, then of this one
    uint64_t previous_positions;    // PositionOutput: takes over what `positions` held; 0: not wanted
    uint64_t attributes;            // AttributeOutput
    uint vertex_count;
    uint target_count;
};

// A morph target with its weight. Each list holds vec3[vertex_count], or its address is 0: no offsets.
struct MorphUse {
    uint64_t positions;
    uint64_t normals;
    uint64_t tangents;
    float weight;
    uint pad0;
};

// The joints that move a vertex, the heaviest first. All weights 0: it stays where it is.
struct JointInfluences {
    uint joints_01;                 // the first in the low half
    uint joints_23;
    vec4 weights;                   // sum 1
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer DeformJobTable { DeformJob at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer MorphTable { MorphUse at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer InfluenceTable { JointInfluences at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RowTable { vec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer PositionOutput { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer AttributeOutput { VertexAttributes at[]; };

#endif
