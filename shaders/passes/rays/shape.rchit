// Rays that look for a surface and meet a sphere or a box: the hit's ids and place. In: built-ins. Out: SurfacePayload. Shades nothing.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/rays.glsl"
#include "shared/frame.glsl"
#include "passes/rays/shape_hit.glsl"

layout(location = 0) rayPayloadInEXT SurfacePayload payload;

void main() {
    payload.t_m = gl_HitTEXT;
    payload.instance = gl_InstanceCustomIndexEXT;
    payload.geometry = gl_GeometryIndexEXT;
    payload.primitive = gl_PrimitiveID;
    payload.barycentric = shape_hit_place(SceneTable(FrameTable(push.frame_address).frame.scene).scene, gl_HitKindEXT);
}
