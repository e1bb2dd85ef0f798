// What pass `shape_boxes` reads and writes. Host twins: renderer/src/gpu_types.rs (ShapeBoxJob, ShapeBox).
#ifndef SHARED_SHAPE_BOXES
#define SHARED_SHAPE_BOXES

#include "shared/scene.glsl"

// One geometry of a mesh of shapes.
struct ShapeBoxJob {
    uint64_t geometry;      // GeometryTable: its record
    uint64_t boxes;         // ShapeBoxOutput: one a shape
    uint count;
    uint pad0;
};

// VkAabbPositionsKHR, mesh space.
struct ShapeBox {
    vec3 low;
    vec3 high;
};

layout(buffer_reference, scalar, buffer_reference_align = 8) writeonly buffer ShapeBoxOutput { ShapeBox at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer ShapeBoxJobTable { ShapeBoxJob at[]; };

#endif
