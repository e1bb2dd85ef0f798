// A sphere or a box of the scene by its ids. In: Scene, instance slot, geometry, primitive; a place on it, or a line that meets it.
// Out: the point, outward normal, tangent, texture coordinates. Unit space: the sphere of radius 1, the box of half extents 1.
// Nothing is taken from the hit but the place: the point lies on the shape whatever the distance of the ray. Knows no material.
#ifndef LIB_SHAPE
#define LIB_SHAPE

#include "shared/scene.glsl"
#include "lib/basis.glsl"
#include "lib/intersect.glsl"
#include "lib/ray_offset.glsl"
#include "lib/vector.glsl"

// Rounding in unit space: 4 of the place (octahedral, normalised), 4 of the roots (discriminant and 1 - |origin|).
const float BOUND_SHAPE = 8.0 * ROUNDING;
// Rounding of the inverse of mesh_from_primitive as line_before takes it, as a multiple of the products of magnitudes.
const float BOUND_INVERSE = 6.0 * ROUNDING;
// Texture coordinates of a sphere change without bound at the poles: closer to the axis than this (squared) they stay as they are.
const float POLE = 1e-10;

struct PlacedShape {
    uint kind;
    vec3 centre;        // primitive space
    vec3 half_extent;
    vec4 mesh_from_primitive[3];
    vec4 render_from_mesh[3];
    bool moved;
    float winding;      // -1: the maps mirror
};

struct ShapePlace {
    vec3 unit;          // on the shape, unit space
    vec3 normal;        // outwards, unit length, unit space; a box has the same in primitive space, a sphere too
};

// Square to sphere and back with the precision of floats (Cigolle et al., JCGT 3(2), 2014).
vec2 shape_encode_direction(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return n.z < 0.0 ? folded : p;
}

vec3 shape_decode_direction(vec2 p) {
    float z = 1.0 - abs(p.x) - abs(p.y);
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return normalize(vec3(z < 0.0 ? folded : p, z));
}

// A place in two floats, as hits carry it. On a box the exponent of x names the face (twice the axis, 1 more on the positive side), its
// mantissa holds the coordinate of the next axis; y is that of the one after.
vec2 shape_encode_place(uint kind, ShapePlace place) {
    if (kind == SHAPE_SPHERE) {
        return shape_encode_direction(place.unit);
    }
    vec3 size = abs(place.normal);
    uint axis = size.x > 0.5 ? 0u : (size.y > 0.5 ? 1u : 2u);
    uint face = 2u * axis + (place.normal[axis] > 0.0 ? 1u : 0u);
    float across = clamp(0.5 + 0.5 * place.unit[(axis + 1u) % 3u], 0.0, 1.0 - 2.0 * ROUNDING);
    return vec2(uintBitsToFloat(floatBitsToUint(1.0 + across) + (face << 23)), place.unit[(axis + 2u) % 3u]);
}

ShapePlace shape_decode_place(uint kind, vec2 place) {
    if (kind == SHAPE_SPHERE) {
        vec3 direction = shape_decode_direction(place);
        return ShapePlace(direction, direction);
    }
    uint bits = floatBitsToUint(place.x);
    uint face = min((bits >> 23) - 127u, 5u);
    uint axis = face >> 1;
    float side = (face & 1u) != 0u ? 1.0 : -1.0;
    ShapePlace result = ShapePlace(vec3(0.0), vec3(0.0));
    result.normal[axis] = side;
    result.unit[axis] = side;
    result.unit[(axis + 1u) % 3u] = 2.0 * (uintBitsToFloat((bits & 0x7fffffu) | 0x3f800000u) - 1.0) - 1.0;
    result.unit[(axis + 2u) % 3u] = place.y;
    return result;
}

PlacedShape shape_fetch(Scene scene, uint instance_slot, uint geometry_index, uint primitive) {
    Instance instance = InstanceTable(scene.instances).at[instance_slot];
    Geometry geometry = GeometryTable(instance.geometries).at[geometry_index];
    Shape record = ShapeTable(geometry.positions).at[primitive];
    PlacedShape shape;
    shape.kind = record.kind;
    shape.centre = record.centre;
    shape.half_extent = record.half_extent;
    shape.mesh_from_primitive = geometry.mesh_from_primitive;
    shape.render_from_mesh = instance.render_from_mesh;
    shape.moved = (geometry.flags & GEOMETRY_MOVED) != 0u;
    shape.winding = (instance.flags & INSTANCE_MIRRORED) != 0u ? -1.0 : 1.0;
    if (shape.moved) {
        shape.winding *= determinant_sign(geometry.mesh_from_primitive);
    }
    return shape;
}

// A map whose determinant is below this share of the product of its rows is singular: the rest is rounding.
const float SINGULAR = 8.0 * ROUNDING;

// Takes a line to the space before an affine map; its parameter stays. False where the map is singular.
bool line_before(vec4 rows[3], inout vec3 origin, inout vec3 direction) {
    float scale = max_component(vec3(
        max_component(abs(rows[0].xyz)), max_component(abs(rows[1].xyz)), max_component(abs(rows[2].xyz))));
    if (!(scale > 0.0)) {
        return false;
    }
    mat3 cofactors = cofactor_rows(rows); // of rows / scale; the inverse is its transpose / determinant / scale
    float determinant = dot(rows[0].xyz / scale, cofactors[0]);
    float largest = length(rows[0].xyz / scale) * length(rows[1].xyz / scale) * length(rows[2].xyz / scale);
    vec3 from = origin - vec3(rows[0].w, rows[1].w, rows[2].w);
    origin = cofactors * from / determinant / scale;
    direction = cofactors * direction / determinant / scale;
    return abs(determinant) > SINGULAR * largest && is_finite(origin) && is_finite(direction);
}

// Takes a line from primitive space to unit space. Its direction gets the largest component 1: distances are `speed` times as large there.
// False for a shape without size.
bool line_in_unit_space(vec3 centre, vec3 half_extent, inout vec3 origin, inout vec3 direction, out float speed) {
    origin = (origin - centre) / half_extent;
    direction /= half_extent;
    speed = max_component(abs(direction));
    direction /= speed;
    return is_finite(origin) && is_finite(direction) && is_finite(speed);
}

ShapePlace sphere_line_place(vec3 origin, vec3 direction, bool leaving) {
    float a = dot(direction, direction);
    vec3 nearest = origin - (dot(origin, direction) / a) * direction;
    float rest = max(1.0 - dot(nearest, nearest), 0.0);
    vec3 place = nearest + (leaving ? sqrt(rest / a) : -sqrt(rest / a)) * direction;
    place = normalize_or(place, vec3(0.0, 0.0, 1.0));
    return ShapePlace(place, place);
}

ShapePlace box_line_place(vec3 origin, vec3 direction, bool leaving) {
    float chosen = leaving ? FLOAT_MAX : -FLOAT_MAX;
    int axis = 0;
    for (int i = 0; i < 3; ++i) {
        if (direction[i] != 0.0) {
            float t = ((leaving == (direction[i] > 0.0) ? 1.0 : -1.0) - origin[i]) / direction[i];
            if (leaving ? t < chosen : t > chosen) {
                chosen = t;
                axis = i;
            }
        }
    }
    vec3 at = origin + chosen * direction;
    ShapePlace place = ShapePlace(is_finite(at) ? clamp(at, -1.0, 1.0) : vec3(0.0), vec3(0.0));
    place.normal[axis] = leaving == (direction[axis] > 0.0) ? 1.0 : -1.0;
    place.unit[axis] = place.normal[axis];
    return place;
}

// Where a line of unit space enters the shape and leaves it, as multiples of its direction.
bool unit_line_meets(uint kind, vec3 origin, vec3 direction, out vec2 t) {
    bool met = kind == SHAPE_SPHERE ? intersect_sphere(origin, direction, vec3(0.0), 1.0, t)
        : intersect_box(origin, direction, vec3(-1.0), vec3(1.0), t);
    return met && is_finite(t.x) && is_finite(t.y);
}

// Where a line of unit space enters the shape or leaves it; beside it, the nearest place (rounding at the outline).
ShapePlace unit_line_place(uint kind, vec3 origin, vec3 direction, bool leaving) {
    if (kind == SHAPE_SPHERE) {
        return sphere_line_place(origin, direction, leaving);
    }
    return box_line_place(origin, direction, leaving);
}

// A line of render space in unit space, where distances are `speed` times as large.
bool shape_line(PlacedShape shape, inout vec3 origin, inout vec3 direction, out float speed) {
    return line_before(shape.render_from_mesh, origin, direction)
        && (!shape.moved || line_before(shape.mesh_from_primitive, origin, direction))
        && line_in_unit_space(shape.centre, shape.half_extent, origin, direction, speed);
}

ShapePlace shape_line_place(PlacedShape shape, vec3 origin, vec3 direction, bool leaving) {
    float speed;
    if (!shape_line(shape, origin, direction, speed)) {
        return ShapePlace(vec3(0.0, 0.0, 1.0), vec3(0.0, 0.0, 1.0));
    }
    return unit_line_place(shape.kind, origin, direction, leaving);
}

// |a| x |b| with every product added: bounds the rounding of cross(a, b).
vec3 absolute_cross(vec3 a, vec3 b) {
    vec3 p = abs(a);
    vec3 q = abs(b);
    return p.yzx * q.zxy + p.zxy * q.yzx;
}

// Bound on the distance from its plane, mesh space, of a point that mesh_from_primitive has moved: the way there, and the way back
// through line_before, whose cofactors and determinant are rounded too. normal: of the primitive; normal_length: of normal * cofactors.
float moved_distance(vec4 rows[3], vec3 position, vec3 moved, vec3 moved_normal, vec3 normal, float distance, float normal_length) {
    vec3 translation = vec3(rows[0].w, rows[1].w, rows[2].w);
    vec3 absolute = abs(position);
    vec3 there = BOUND_LINEAR * vec3(dot(abs(rows[0].xyz), absolute), dot(abs(rows[1].xyz), absolute), dot(abs(rows[2].xyz), absolute))
        + BOUND_TRANSFORM * (abs(translation) + abs(moved));
    float scale = max_component(vec3(
        max_component(abs(rows[0].xyz)), max_component(abs(rows[1].xyz)), max_component(abs(rows[2].xyz))));
    vec3 r0 = rows[0].xyz / scale;
    vec3 r1 = rows[1].xyz / scale;
    vec3 r2 = rows[2].xyz / scale;
    vec3 c0 = absolute_cross(r1, r2);
    vec3 c1 = absolute_cross(r2, r0);
    vec3 c2 = absolute_cross(r0, r1);
    vec3 from = abs(moved) + abs(translation);
    vec3 back = (c0 * from.x + c1 * from.y + c2 * from.z) + scale * dot(abs(r0), c0) * absolute;
    float determinant = scale * abs(dot(r0, cross(r1, r2)));
    return dot(there, abs(moved_normal)) + (distance * determinant + BOUND_INVERSE * dot(back, abs(normal))) / normal_length;
}

SurfacePoint shape_point(PlacedShape shape, ShapePlace place) {
    precise vec3 reach = shape.half_extent * place.unit;
    precise vec3 position = shape.centre + reach;
    vec3 normal = place.normal;
    vec3 error = BOUND_VERTEX * (abs(shape.centre) + abs(position)) + BOUND_SHAPE * shape.half_extent;
    float distance = dot(error, abs(normal));
    if (shape.moved) {
        vec4 rows[3] = shape.mesh_from_primitive;
        precise vec3 moved = transform_point(rows, position);
        vec3 turned = normal * cofactor_rows(rows);
        float turned_length = length(turned);
        if (turned_length > 0.0) {
            vec3 moved_normal = turned / turned_length;
            distance = moved_distance(rows, position, moved, moved_normal, normal, distance, turned_length);
            normal = moved_normal;
        }
        position = moved;
    }
    return carried_point(shape.render_from_mesh, position, normal, distance, shape.winding);
}

// Where the place was in the last frame: render space.
vec3 shape_previous_position(Scene scene, uint instance_slot, uint geometry_index, PlacedShape shape, ShapePlace place) {
    Instance instance = InstanceTable(scene.instances).at[instance_slot];
    Geometry geometry = GeometryTable(instance.geometries).at[geometry_index];
    vec3 position = shape.centre + shape.half_extent * place.unit;
    if ((geometry.flags & GEOMETRY_MOVING) != 0u) {
        position = transform_point(geometry.previous_mesh_from_primitive, position);
    } else if (shape.moved) {
        position = transform_point(geometry.mesh_from_primitive, position);
    }
    return transform_point(instance.previous_render_from_mesh, position);
}

// A direction of unit space in render space.
vec3 shape_render_vector(PlacedShape shape, vec3 v) {
    vec3 vector = shape.half_extent * v;
    if (shape.moved) {
        vector = transform_vector(shape.mesh_from_primitive, vector);
    }
    return transform_vector(shape.render_from_mesh, vector);
}

// Direction in which the first texture coordinate grows, unit space: east on a sphere (not normalised, 0 at the poles), to the right on the
// face of a box as seen from outside with +Y up (-Z up on top, +Z up below).
vec3 shape_tangent(uint kind, ShapePlace place) {
    if (kind == SHAPE_SPHERE) {
        return vec3(place.unit.z, 0.0, -place.unit.x);
    }
    vec3 n = place.normal;
    return abs(n.y) > 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(n.z, 0.0, -n.x);
}

// Sphere: longitude from +Z over +X, and angle from +Y, both as shares. Box: 0..1 a face, from its upper left corner.
vec2 shape_uv(uint kind, ShapePlace place) {
    if (kind == SHAPE_SPHERE) {
        vec3 p = place.unit;
        float across = length(p.xz);
        float turn = across > 0.0 ? atan(p.x, p.z) / TAU : 0.0;
        return vec2(turn < 0.0 ? turn + 1.0 : turn, atan(across, p.y) / PI);
    }
    vec3 right = shape_tangent(kind, place);
    return 0.5 + 0.5 * vec2(dot(place.unit, right), -dot(place.unit, cross(place.normal, right)));
}

// How the texture coordinates change along a tangential step of unit space.
vec2 shape_uv_step(uint kind, ShapePlace place, vec3 along) {
    vec3 right = shape_tangent(kind, place);
    if (kind == SHAPE_SPHERE) {
        float across2 = max(dot(right, right), POLE);
        return vec2(dot(along, right) / (TAU * across2), -along.y / (PI * sqrt(across2)));
    }
    return 0.5 * vec2(dot(along, right), -dot(along, cross(place.normal, right)));
}

// Area of texture coordinates a square metre of render space.
float shape_uv_density(PlacedShape shape, ShapePlace place) {
    vec3 right = shape_tangent(shape.kind, place);
    float density = shape.kind == SHAPE_SPHERE ? 1.0 / (TAU * PI * sqrt(max(dot(right, right), POLE))) : 0.25;
    mat3 unit_from_local = basis_around(place.normal);
    vec3 edge1 = shape_render_vector(shape, unit_from_local[0]);
    vec3 edge2 = shape_render_vector(shape, unit_from_local[1]);
    return density / safe_length(cross(edge1, edge2));
}

#endif
