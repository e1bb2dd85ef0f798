// Shadow rays: nothing opaque was in the way. In: nothing. Out: ShadowPayload.visible.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/scene.glsl"
#include "shared/rays.glsl"

layout(location = 1) rayPayloadInEXT ShadowPayload payload;

void main() {
    payload.visible = 1u;
}
