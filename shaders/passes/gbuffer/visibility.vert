// Pass gbuffer, vertex stage. In: an index, the instance of the draw. Out: clip position; everything else is rebuilt from the triangle.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/frame.glsl"
#include "lib/vector.glsl"

layout(location = 0) flat out uint out_instance_slot;

invariant gl_Position;

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uint slot = UintTable(scene.draw_instances).at[gl_InstanceIndex];
    Instance instance = InstanceTable(scene.instances).at[slot];
    Geometry geometry = GeometryTable(instance.geometries).at[push.argument0];
    vec3 position = PositionTable(geometry.positions).at[gl_VertexIndex];
    if ((geometry.flags & GEOMETRY_MOVED) != 0u) {
        position = transform_point(geometry.mesh_from_primitive, position);
    }
    gl_Position = frame.clip_from_render * vec4(transform_point(instance.render_from_mesh, position), 1.0);
    out_instance_slot = slot;
}
