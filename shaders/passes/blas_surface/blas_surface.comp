// Pass blas_surface: the surface of the boxes around runs of neighbouring triangles. In: a SurfaceJob at frame_address[argument0]. Out: one number a run.
// A refit keeps the tree of the last build: how far these boxes have grown since says how much looser the tree has become.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/blas_surface.glsl"
#include "shared/frame.glsl"
#include "lib/vector.glsl"

layout(local_size_x = 64) in;

float cluster_surface(Geometry geometry, uint cluster) {
    UintTable indices = UintTable(geometry.indices);
    PositionTable positions = PositionTable(geometry.positions);
    uint first = cluster * CLUSTER_TRIANGLES;
    uint end = min(first + CLUSTER_TRIANGLES, geometry.triangle_count);
    vec3 low = vec3(3.402823e38);
    vec3 high = -low;
    for (uint corner = 3u * first; corner < 3u * end; ++corner) {
        vec3 position = transform_point(geometry.mesh_from_primitive, positions.at[indices.at[corner]]);
        low = min(low, position);
        high = max(high, position);
    }
    vec3 size = max(high - low, vec3(0.0));
    return 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
}

void main() {
    SurfaceJob job = SurfaceJobTable(push.frame_address).at[push.argument0];
    Geometry geometry = GeometryTable(job.geometry).at[0];
    uint step = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    for (uint cluster = gl_GlobalInvocationID.x; cluster < job.cluster_count; cluster += step) {
        SurfaceOutput(job.surfaces).at[cluster] = cluster_surface(geometry, cluster);
    }
}
