// Images of set 0. Every slot of the array holds an image (the default one where nothing else). The TLAS stands in shared/rays.glsl: a stage
// declares only what it can use.
#ifndef SHARED_TEXTURES
#define SHARED_TEXTURES

#extension GL_EXT_nonuniform_qualifier : require

layout(set = 0, binding = 1) uniform sampler2D textures[];
layout(set = 0, binding = 2) uniform sampler2D environment_map;

#endif
