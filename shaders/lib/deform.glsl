// One vertex that follows a pose: morph targets, then joints (glTF 2.0, 3.7.2.2 and 3.7.3.3). In: the vertex at rest, offsets, joint matrices
// as three rows. Out: the vertex as posed, never NaN from finite input; what nothing moves stays the same to the bit. Knows no buffer.
#ifndef LIB_DEFORM
#define LIB_DEFORM

#include "lib/vector.glsl"

struct DeformVertex {
    vec3 position;      // mesh space
    vec3 normal;        // unit
    vec3 tangent;       // unit
};

// A direction of length 1. An unchanged one is not rounded again; one that vanished or overflowed is what it was before.
vec3 turned_direction(vec3 turned, vec3 before) {
    return turned == before || !is_finite(turned) ? before : normalize_or(turned, before);
}

// Adds a share of one target's offsets; the sum of all goes through `deform_unit`.
DeformVertex morph_add(DeformVertex sum, DeformVertex offset, float weight) {
    return DeformVertex(sum.position + weight * offset.position, sum.normal + weight * offset.normal,
        sum.tangent + weight * offset.tangent);
}

// Directions back to length 1.
DeformVertex deform_unit(DeformVertex sum, DeformVertex before) {
    return DeformVertex(is_finite(sum.position) ? sum.position : before.position, turned_direction(sum.normal, before.normal),
        turned_direction(sum.tangent, before.tangent));
}

// Weighted mean of four joints: the first, and shares of the way to the others. Joints that agree come out exactly, whatever the weights.
void blend_joints(vec4 a[3], vec4 b[3], vec4 c[3], vec4 d[3], vec4 weights, out vec4 rows[3]) {
    for (uint r = 0u; r < 3u; ++r) {
        rows[r] = a[r] + weights.y * (b[r] - a[r]) + weights.z * (c[r] - a[r]) + weights.w * (d[r] - a[r]);
    }
}

// Moves a vertex by the blend of its joints. Normals go by the cofactors, which hold for uneven, flattened and mirrored blends. Their sign is
// kept: where a blend mirrors, the corners of the triangle run the other way round, and the normal stays on the side from which they run
// counter-clockwise. Against that normal the handedness is what it was: (cof(M) n) x (M t) points as M (n x t) does, whatever M.
DeformVertex skin(DeformVertex vertex, vec4 rows[3]) {
    DeformVertex moved;
    moved.position = transform_point(rows, vertex.position);
    moved.normal = vertex.normal * cofactor_rows(rows);
    moved.tangent = transform_vector(rows, vertex.tangent);
    return deform_unit(moved, vertex);
}

#endif
