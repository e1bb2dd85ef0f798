// Pass deform: the vertices of one instance as posed. In: a DeformJob (entry argument0 of the list at frame_address). Out: positions, attributes,
// and the positions of the last evaluation for the motion vectors.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

#include "shared/frame.glsl"
#include "shared/deform.glsl"
#include "lib/deform.glsl"

vec3 offset_of(uint64_t list, uint vertex) {
    return list != 0ul ? PositionTable(list).at[vertex] : vec3(0.0);
}

DeformVertex morphed(DeformJob job, uint vertex, DeformVertex rest) {
    DeformVertex sum = rest;
    for (uint i = 0u; i < job.target_count; ++i) {
        MorphUse target = MorphTable(job.targets).at[i];
        sum = morph_add(sum, DeformVertex(offset_of(target.positions, vertex), offset_of(target.normals, vertex),
            offset_of(target.tangents, vertex)), target.weight);
    }
    return deform_unit(sum, rest);
}

vec4[3] joint_rows(DeformJob job, uint joint) {
    RowTable rows = RowTable(job.joints);
    return vec4[3](rows.at[3u * joint], rows.at[3u * joint + 1u], rows.at[3u * joint + 2u]);
}

DeformVertex skinned(DeformJob job, uint vertex, DeformVertex morphed) {
    if (job.influences == 0ul) {
        return morphed;
    }
    JointInfluences by = InfluenceTable(job.influences).at[vertex];
    if (by.weights.x == 0.0) {
        return morphed;
    }
    vec4 rows[3];
    blend_joints(joint_rows(job, by.joints_01 & 0xffffu), joint_rows(job, by.joints_01 >> 16), joint_rows(job, by.joints_23 & 0xffffu),
        joint_rows(job, by.joints_23 >> 16), by.weights, rows);
    return skin(morphed, rows);
}

void deform(DeformJob job, uint vertex) {
    VertexAttributes attributes = AttributeTable(job.rest_attributes).at[vertex];
    DeformVertex rest = DeformVertex(PositionTable(job.rest_positions).at[vertex], attributes.normal, attributes.tangent.xyz);
    DeformVertex posed = skinned(job, vertex, morphed(job, vertex, rest));
    PositionOutput positions = PositionOutput(job.positions);
    if (job.previous_positions != 0ul) {
        PositionOutput(job.previous_positions).at[vertex] = positions.at[vertex];
    }
    positions.at[vertex] = posed.position;
    attributes.normal = posed.normal;
    attributes.tangent.xyz = posed.tangent;
    AttributeOutput(job.attributes).at[vertex] = attributes;
}

void main() {
    DeformJob job = DeformJobTable(push.frame_address).at[push.argument0];
    // A dispatch has a limited number of groups, a mesh has not.
    uint step = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    for (uint vertex = gl_GlobalInvocationID.x; vertex < job.vertex_count; vertex += step) {
        deform(job, vertex);
    }
}
