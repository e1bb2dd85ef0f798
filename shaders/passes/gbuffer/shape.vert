// Pass gbuffer, vertex stage of spheres and boxes. In: SHAPE_VERTICES a shape, the instance of the draw. Out: the box around the shape, its faces
// turned inwards: with back faces culled every pixel of it is met once, from inside too, and the near plane cuts nothing off that is seen.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/frame.glsl"
#include "lib/vector.glsl"

layout(location = 0) flat out uvec2 out_instance_shape;

invariant gl_Position;

// Corner of two triangles a face, in half extents.
vec3 box_corner(uint vertex) {
    const vec2 corners[6] = vec2[6](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0));
    uint axis = vertex / 12u;
    float side = vertex % 12u < 6u ? -1.0 : 1.0;
    vec2 corner = corners[vertex % 6u];
    vec3 position;
    position[axis] = side;
    position[(axis + 1u) % 3u] = -side * corner.x;
    position[(axis + 2u) % 3u] = corner.y;
    return position;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uint slot = UintTable(scene.draw_instances).at[gl_InstanceIndex];
    Instance instance = InstanceTable(scene.instances).at[slot];
    Geometry geometry = GeometryTable(instance.geometries).at[push.argument0];
    uint primitive = uint(gl_VertexIndex) / SHAPE_VERTICES;
    Shape shape = ShapeTable(geometry.positions).at[primitive];
    vec3 position = shape.centre + shape.half_extent * box_corner(uint(gl_VertexIndex) % SHAPE_VERTICES);
    if ((geometry.flags & GEOMETRY_MOVED) != 0u) {
        position = transform_point(geometry.mesh_from_primitive, position);
    }
    gl_Position = frame.clip_from_render * vec4(transform_point(instance.render_from_mesh, position), 1.0);
    out_instance_shape = uvec2(slot, primitive);
}
