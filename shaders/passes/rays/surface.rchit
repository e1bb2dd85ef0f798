// Rays that look for a surface: the hit's ids and place. In: built-ins. Out: SurfacePayload. Shades nothing.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/scene.glsl"
#include "shared/rays.glsl"

layout(location = 0) rayPayloadInEXT SurfacePayload payload;
hitAttributeEXT vec2 barycentric;

void main() {
    payload.t_m = gl_HitTEXT;
    payload.instance = gl_InstanceCustomIndexEXT;
    payload.geometry = gl_GeometryIndexEXT;
    payload.primitive = gl_PrimitiveID;
    payload.barycentric = barycentric;
}
