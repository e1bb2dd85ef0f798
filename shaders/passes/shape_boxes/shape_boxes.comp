// Pass shape_boxes: the boxes around spheres and boxes where mesh_from_primitive has placed them. In: a ShapeBoxJob (entry argument0 of the
// list at frame_address). Out: one box a shape, rounded outwards, so that a ray that meets the shape meets the box.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

#include "shared/frame.glsl"
#include "shared/shape_boxes.glsl"
#include "lib/ray_offset.glsl"

// Far more than the rounding of this pass and of line_before, and nothing beside the size of the box.
const float MARGIN = 64.0 * ROUNDING;

// A row of the map: how far the shape reaches along one axis of mesh space, and the middle of it.
vec2 extent_along(vec4 row, Shape shape) {
    float middle = dot(row.xyz, shape.centre) + row.w;
    vec3 axes = row.xyz * shape.half_extent;
    // The image of a sphere reaches as far as the row is long; that of a box, as far as its corner.
    float reach = shape.kind == SHAPE_SPHERE ? safe_length(axes) : dot(abs(axes), vec3(1.0));
    float magnitude = reach + dot(abs(row.xyz), abs(shape.centre)) + abs(row.w);
    return vec2(middle, reach + MARGIN * magnitude);
}

ShapeBox box_around(vec4 rows[3], Shape shape) {
    vec2 x = extent_along(rows[0], shape);
    vec2 y = extent_along(rows[1], shape);
    vec2 z = extent_along(rows[2], shape);
    vec3 middle = vec3(x.x, y.x, z.x);
    vec3 reach = vec3(x.y, y.y, z.y);
    // Past the largest float there is nothing to be met; what is not finite never reaches a builder.
    return is_finite(middle - reach) && is_finite(middle + reach) ? ShapeBox(middle - reach, middle + reach)
        : ShapeBox(vec3(0.0), vec3(0.0));
}

void main() {
    ShapeBoxJob job = ShapeBoxJobTable(push.frame_address).at[push.argument0];
    Geometry geometry = GeometryTable(job.geometry).at[0];
    uint step = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    for (uint i = gl_GlobalInvocationID.x; i < job.count; i += step) {
        ShapeBoxOutput(job.boxes).at[i] = box_around(geometry.mesh_from_primitive, ShapeTable(geometry.positions).at[i]);
    }
}
