// Error-bounded points on surfaces and spawn points beside them: no scene-dependent epsilon.
// In: a point of mesh space with its error, or a triangle and barycentrics, and render_from_mesh. Out: the point in render space, the unit normal, and an offset along
// it that is larger than what the rounding of this code and of the traversal can add up to. Works for singular and mirrored matrices.
// Source: NVIDIA, "Solving Self-Intersection Artifacts in DirectX Raytracing" (developer blog, 2023): the same three bounds
// (reconstruction and intersection, mesh to render space, render to mesh space), here with the inverse written as cofactors / determinant,
// so that the determinant cancels.
#ifndef LIB_RAY_OFFSET
#define LIB_RAY_OFFSET

#include "lib/vector.glsl"

// Half a unit in the last place of 1 (2^-24), and the multiples that the bounds take of it.
const float ROUNDING = 5.9604644775390625e-8;
const float BOUND_VERTEX = ROUNDING;            // on |v0|
const float BOUND_LINEAR = 3.0 * ROUNDING;      // on |linear part| |p|
const float BOUND_EXTENT = 6.0 * ROUNDING;      // on the extent of the edges: 3 in the source; intersection after Moeller and Trumbore, as
                                                // software traversal may have it, was seen to need more
const float BOUND_TRANSFORM = 2.0 * ROUNDING;   // on the translation and on the way back
const float BOUND_MOVED = 8.0 * ROUNDING;       // vertices moved by mesh_from_primitive: once by the BLAS build, once here

// Share of a segment between two spawn points at which a shadow ray ends: the rounding of t, direction and length, four units at most.
const float SEGMENT_END = 1.0 - 8.0 * ROUNDING;

struct SurfacePoint {
    vec3 position;      // on the surface, render space
    vec3 normal;        // unit, geometric, on the side from which the vertices run counter-clockwise; of a shape: outwards
    float offset_m;     // distance along the normal that clears the surface
};

// A point of mesh space carried to render space. mesh_normal: unit, or 0 where there is none. mesh_distance: bound on how far off its plane
// reconstruction and intersection may see the point, mesh space. winding: -1 where the normal is to be turned over, else 1.
SurfacePoint carried_point(vec4 render_from_mesh[3], vec3 mesh_position, vec3 mesh_normal, float mesh_distance, float winding) {
    // Translation last: it is the largest term far from the origin.
    precise vec3 turned = transform_vector(render_from_mesh, mesh_position);
    vec3 translation = vec3(render_from_mesh[0].w, render_from_mesh[1].w, render_from_mesh[2].w);
    precise vec3 position = turned + translation;

    mat3 cofactors = cofactor_rows(render_from_mesh); // of render_from_mesh / its largest entry
    vec3 turned_normal = mesh_normal * cofactors;
    float normal_length = length(turned_normal);

    SurfacePoint point;
    point.position = position;
    point.normal = winding * normalize_or(turned_normal, vec3(0.0, 1.0, 0.0));

    // Render space: the way there, and the rounding of the spawn point itself.
    vec3 absolute = abs(mesh_position);
    vec3 turned_bound = vec3(dot(abs(render_from_mesh[0].xyz), absolute), dot(abs(render_from_mesh[1].xyz), absolute),
        dot(abs(render_from_mesh[2].xyz), absolute));
    vec3 render_error = BOUND_LINEAR * turned_bound + BOUND_TRANSFORM * abs(translation) + BOUND_TRANSFORM * abs(position);
    float offset = dot(render_error, abs(point.normal));

    // Both bounds in mesh space are taken along the mesh normal and carried over: a plane's distance d there is
    // d |det| / |cof n| here, and the inverse matrix is cof^T / det, so its determinant drops out of the second.
    if (normal_length > 0.0) {
        float determinant = abs(dot(render_from_mesh[0].xyz, cofactors[0])); // of render_from_mesh / (that entry)^2
        mat3 absolute_cofactors = mat3(abs(cofactors[0]), abs(cofactors[1]), abs(cofactors[2]));
        vec3 back_error = BOUND_TRANSFORM * (absolute_cofactors * (abs(position) + abs(translation)));
        offset += (mesh_distance * determinant + dot(back_error, abs(mesh_normal))) / normal_length;
    }
    point.offset_m = offset;
    return point;
}

// barycentric: weights of v1 and v2. vertex_error: bound on the error of the vertices themselves (0 unless they were moved).
// winding: -1 where the front of the triangle is its clockwise side (mirrored), else 1.
SurfacePoint surface_point(vec4 render_from_mesh[3], vec3 v0, vec3 v1, vec3 v2, vec3 vertex_error, float winding, vec2 barycentric) {
    precise vec3 edge1 = v1 - v0;
    precise vec3 edge2 = v2 - v0;
    precise vec3 along = edge1 * barycentric.x + edge2 * barycentric.y;
    precise vec3 mesh_position = v0 + along;

    // Directions are scaled to 1 before products are taken: squares of very small edges would vanish.
    float edge_scale = max(max_component(abs(edge1)), max_component(abs(edge2)));
    vec3 mesh_normal = edge_scale > 0.0 ? cross(edge1 / edge_scale, edge2 / edge_scale) : vec3(0.0);
    mesh_normal = normalize_or(mesh_normal, vec3(0.0));

    // Mesh space: reconstruction of the point and intersection.
    vec3 extents = abs(edge1) + abs(edge2) + abs(abs(edge1) - abs(edge2));
    vec3 mesh_error = BOUND_VERTEX * abs(v0) + BOUND_EXTENT * max_component(extents) + vertex_error;
    return carried_point(render_from_mesh, mesh_position, mesh_normal, dot(mesh_error, abs(mesh_normal)), winding);
}

// Start of a ray that leaves the point in `direction`: on the side of the surface that the direction points to.
vec3 spawn_position(vec3 position, vec3 normal, float offset_m, vec3 direction) {
    return position + (dot(direction, normal) < 0.0 ? -offset_m : offset_m) * normal;
}

// Barycentrics (weights of v1, v2) of the point in which a ray's line meets the triangle's plane, from signed volumes; not clamped.
// Middle of the triangle where the line lies in the plane.
vec2 line_barycentric(vec3 origin, vec3 direction, vec3 v0, vec3 v1, vec3 v2) {
    vec3 a = v0 - origin;
    vec3 b = v1 - origin;
    vec3 c = v2 - origin;
    float u = dot(direction, cross(c, b));
    float v = dot(direction, cross(a, c));
    float w = dot(direction, cross(b, a));
    float sum = u + v + w;
    vec2 barycentric = vec2(v, w) / sum;
    return is_finite(barycentric.x) && is_finite(barycentric.y) ? barycentric : vec2(1.0 / 3.0);
}

// The nearest barycentrics (not the nearest point) within the triangle.
vec2 clamp_barycentric(vec2 barycentric) {
    vec3 weights = max(vec3(1.0 - barycentric.x - barycentric.y, barycentric), 0.0);
    return weights.yz / (weights.x + weights.y + weights.z); // the sum is at least 1
}

#endif
