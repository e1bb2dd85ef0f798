// Rays that look for a surface: nothing was met. In: nothing. Out: SurfacePayload.t_m below 0.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/scene.glsl"
#include "shared/rays.glsl"

layout(location = 0) rayPayloadInEXT SurfacePayload payload;

void main() {
    payload.t_m = -1.0;
}
