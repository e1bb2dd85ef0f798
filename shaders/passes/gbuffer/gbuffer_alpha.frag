// Pass gbuffer, fragment stage: masked and blended materials. See gbuffer_fragment.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require

#define GBUFFER_COVERAGE
#include "passes/gbuffer/gbuffer_fragment.glsl"
