// Pass gbuffer, fragment stage: opaque materials. See gbuffer_fragment.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "passes/gbuffer/gbuffer_fragment.glsl"
