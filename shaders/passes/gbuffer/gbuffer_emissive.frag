// Pass gbuffer, fragment stage: opaque materials, with the emissive target. See gbuffer_fragment.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require

#define GBUFFER_EMISSIVE
#include "passes/gbuffer/gbuffer_fragment.glsl"
