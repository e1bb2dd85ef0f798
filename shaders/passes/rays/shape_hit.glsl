// What intersection and hit shaders share for shapes: the ray in unit space, the place of a hit. In: built-ins, a PlacedShape.
#ifndef PASS_SHAPE_HIT
#define PASS_SHAPE_HIT

#include "lib/shape.glsl"

// The ray in unit space, its direction scaled; distances are `speed` times as large. False where it meets nothing.
bool shape_object_ray(PlacedShape shape, out vec3 origin, out vec3 direction, out float speed) {
    origin = gl_ObjectRayOriginEXT;
    direction = gl_ObjectRayDirectionEXT;
    speed = 1.0;
    return (!shape.moved || line_before(shape.mesh_from_primitive, origin, direction))
        && line_in_unit_space(shape.centre, shape.half_extent, origin, direction, speed);
}

// The place of the hit that an any-hit or closest-hit shader runs for, as Hit carries it.
vec2 shape_hit_place(Scene scene, uint hit_kind) {
    PlacedShape shape = shape_fetch(scene, gl_InstanceCustomIndexEXT, gl_GeometryIndexEXT, gl_PrimitiveID);
    vec3 origin;
    vec3 direction;
    float speed;
    shape_object_ray(shape, origin, direction, speed);
    bool leaving = (hit_kind & HIT_LEAVING) != 0u;
    return shape_encode_place(shape.kind, unit_line_place(shape.kind, origin, direction, leaving));
}

#endif
