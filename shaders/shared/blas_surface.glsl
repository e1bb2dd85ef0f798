// What pass `blas_surface` reads and writes. Host twin: renderer/src/gpu_types.rs (SurfaceJob).
#ifndef SHARED_BLAS_SURFACE
#define SHARED_BLAS_SURFACE

#include "shared/scene.glsl"

const uint CLUSTER_TRIANGLES = 32u;

// One geometry of a BLAS.
struct SurfaceJob {
    uint64_t geometry;      // GeometryTable: its record
    uint64_t surfaces;      // SurfaceOutput: square metres a cluster, mesh space
    uint cluster_count;
    uint pad0;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer SurfaceOutput { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer SurfaceJobTable { SurfaceJob at[]; };

#endif
