// A triangle of the scene by its ids. In: Scene, instance slot, geometry, primitive. Out: corners in mesh space, attributes between them.
// Vertices come from buffers, never from the hit (the position fetch of some drivers is wrong beyond geometry 0). Knows no material.
#ifndef LIB_TRIANGLE
#define LIB_TRIANGLE

#include "shared/scene.glsl"
#include "lib/ray_offset.glsl"
#include "lib/vector.glsl"

// Where a ray or a pixel met the scene.
struct Hit {
    uint instance;
    uint geometry;
    uint primitive;
    vec2 barycentric;   // weights of the second and third vertex
};

struct Triangle {
    vec3 v0;            // mesh space
    vec3 v1;
    vec3 v2;
    vec3 vertex_error;  // bound on the rounding of moved vertices, per axis
    uvec3 index;
    uint64_t attributes;
    vec4 render_from_mesh[3];
    vec4 mesh_from_primitive[3];
    bool moved;
    float winding;      // -1: the front is the clockwise side
};

struct Attributes {
    vec3 normal;        // render space, on the front side, not normalised; 0 where the vertices cancel
    vec3 tangent;       // render space, not normalised
    float handedness;
    vec2 uv[2];
    vec4 color;
};

Triangle triangle_fetch(Scene scene, uint instance_slot, uint geometry_index, uint primitive) {
    Instance instance = InstanceTable(scene.instances).at[instance_slot];
    Geometry geometry = GeometryTable(instance.geometries).at[geometry_index];
    UintTable indices = UintTable(geometry.indices);
    PositionTable positions = PositionTable(geometry.positions);
    Triangle triangle;
    triangle.index = uvec3(indices.at[3u * primitive], indices.at[3u * primitive + 1u], indices.at[3u * primitive + 2u]);
    triangle.v0 = positions.at[triangle.index.x];
    triangle.v1 = positions.at[triangle.index.y];
    triangle.v2 = positions.at[triangle.index.z];
    triangle.vertex_error = vec3(0.0);
    triangle.attributes = geometry.attributes;
    triangle.render_from_mesh = instance.render_from_mesh;
    triangle.mesh_from_primitive = geometry.mesh_from_primitive;
    triangle.moved = (geometry.flags & GEOMETRY_MOVED) != 0u;
    triangle.winding = (instance.flags & INSTANCE_MIRRORED) != 0u ? -1.0 : 1.0;
    if (triangle.moved) {
        vec3 largest = max(max(abs(triangle.v0), abs(triangle.v1)), abs(triangle.v2));
        vec4 rows[3] = geometry.mesh_from_primitive;
        triangle.vertex_error = BOUND_MOVED * vec3(dot(abs(rows[0]), vec4(largest, 1.0)),
            dot(abs(rows[1]), vec4(largest, 1.0)), dot(abs(rows[2]), vec4(largest, 1.0)));
        triangle.v0 = transform_point(rows, triangle.v0);
        triangle.v1 = transform_point(rows, triangle.v1);
        triangle.v2 = transform_point(rows, triangle.v2);
        triangle.winding *= determinant_sign(rows);
    }
    return triangle;
}

SurfacePoint triangle_point(Triangle triangle, vec2 barycentric) {
    return surface_point(triangle.render_from_mesh, triangle.v0, triangle.v1, triangle.v2, triangle.vertex_error,
        triangle.winding, barycentric);
}

// Where the point was in the last frame: render space.
vec3 triangle_previous_position(Scene scene, uint instance_slot, uint geometry_index, Triangle triangle, vec2 barycentric) {
    Instance instance = InstanceTable(scene.instances).at[instance_slot];
    Geometry geometry = GeometryTable(instance.geometries).at[geometry_index];
    vec3 v0 = triangle.v0;
    vec3 v1 = triangle.v1;
    vec3 v2 = triangle.v2;
    if ((geometry.flags & GEOMETRY_MOVING) != 0u) {
        PositionTable positions = PositionTable(geometry.previous_positions);
        v0 = transform_point(geometry.previous_mesh_from_primitive, positions.at[triangle.index.x]);
        v1 = transform_point(geometry.previous_mesh_from_primitive, positions.at[triangle.index.y]);
        v2 = transform_point(geometry.previous_mesh_from_primitive, positions.at[triangle.index.z]);
    }
    vec3 mesh_position = v0 + barycentric.x * (v1 - v0) + barycentric.y * (v2 - v0);
    return transform_point(instance.previous_render_from_mesh, mesh_position);
}

// Where the camera's line meets the triangle: barycentrics in which the pixel's point is rebuilt; not clamped.
vec2 triangle_line_barycentric(Triangle triangle, vec3 origin, vec3 direction) {
    return line_barycentric(origin, direction, transform_point(triangle.render_from_mesh, triangle.v0),
        transform_point(triangle.render_from_mesh, triangle.v1), transform_point(triangle.render_from_mesh, triangle.v2));
}

// Twice the area in render space: square metres.
float triangle_double_area(Triangle triangle) {
    vec3 edge1 = transform_vector(triangle.render_from_mesh, triangle.v1 - triangle.v0);
    vec3 edge2 = transform_vector(triangle.render_from_mesh, triangle.v2 - triangle.v0);
    return safe_length(cross(edge1, edge2));
}

vec4 unpack_color(VertexAttributes vertex) {
    return vec4(unpackHalf2x16(vertex.color_rg), unpackHalf2x16(vertex.color_ba));
}

// Turns a vertex normal of the primitive into render space: cofactors carry it, the winding gives them the sign of the inverse transpose.
vec3 triangle_render_normal(Scene scene, uint instance_slot, Triangle triangle, vec3 normal) {
    Instance instance = InstanceTable(scene.instances).at[instance_slot];
    vec3 mesh_normal = triangle.moved ? normal * cofactor_rows(triangle.mesh_from_primitive) : normal;
    return triangle.winding * transform_vector(instance.normal_from_mesh, mesh_normal);
}

Attributes triangle_attributes(Scene scene, uint instance_slot, Triangle triangle, vec2 barycentric) {
    AttributeTable table = AttributeTable(triangle.attributes);
    VertexAttributes a = table.at[triangle.index.x];
    VertexAttributes b = table.at[triangle.index.y];
    VertexAttributes c = table.at[triangle.index.z];
    // As a + u (b - a) + v (c - a): equal values at the corners come out exactly.
    float u = barycentric.x;
    float v = barycentric.y;
    vec3 tangent = a.tangent.xyz + u * (b.tangent.xyz - a.tangent.xyz) + v * (c.tangent.xyz - a.tangent.xyz);
    if (triangle.moved) {
        tangent = transform_vector(triangle.mesh_from_primitive, tangent);
    }
    Attributes attributes;
    attributes.normal = triangle_render_normal(scene, instance_slot, triangle, a.normal + u * (b.normal - a.normal) + v * (c.normal - a.normal));
    attributes.tangent = transform_vector(triangle.render_from_mesh, tangent);
    attributes.handedness = (a.tangent.w < 0.0 ? -1.0 : 1.0) * triangle.winding; // a mirrored frame changes hands
    attributes.uv = vec2[2](a.tex_coord0 + u * (b.tex_coord0 - a.tex_coord0) + v * (c.tex_coord0 - a.tex_coord0),
        a.tex_coord1 + u * (b.tex_coord1 - a.tex_coord1) + v * (c.tex_coord1 - a.tex_coord1));
    vec4 color = unpack_color(a);
    attributes.color = color + u * (unpack_color(b) - color) + v * (unpack_color(c) - color);
    return attributes;
}

// Twice the area of the triangle in each set of texture coordinates.
vec2 triangle_double_uv_area(Triangle triangle) {
    AttributeTable table = AttributeTable(triangle.attributes);
    VertexAttributes a = table.at[triangle.index.x];
    VertexAttributes b = table.at[triangle.index.y];
    VertexAttributes c = table.at[triangle.index.z];
    mat2 first = mat2(b.tex_coord0 - a.tex_coord0, c.tex_coord0 - a.tex_coord0);
    mat2 second = mat2(b.tex_coord1 - a.tex_coord1, c.tex_coord1 - a.tex_coord1);
    return abs(vec2(determinant(first), determinant(second)));
}

#endif
