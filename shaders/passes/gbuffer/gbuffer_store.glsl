// The targets of the G-buffer, and how a pixel of it is stored. GBUFFER_IDS_GIVEN: the ids are read from gbuffer_id first.
#ifndef PASS_GBUFFER_STORE
#define PASS_GBUFFER_STORE

#include "lib/gbuffer.glsl"
#include "lib/octahedral.glsl"

#ifdef GBUFFER_IDS_GIVEN
layout(set = 1, binding = 0, rgba32ui) uniform uimage2D gbuffer_id;
#else
layout(set = 1, binding = 0, rgba32ui) uniform writeonly uimage2D gbuffer_id;
#endif
layout(set = 1, binding = 1, rg32ui) uniform writeonly uimage2D gbuffer_normal;
layout(set = 1, binding = 2, rgba16f) uniform writeonly image2D gbuffer_base_color;
layout(set = 1, binding = 3, rg16f) uniform writeonly image2D gbuffer_material;
layout(set = 1, binding = 4, rg32f) uniform writeonly image2D gbuffer_motion;
layout(set = 1, binding = 6, rgba32f) uniform writeonly image2D gbuffer_emissive;

// Everything but the depth.
void store_pixel(ivec2 at, GbufferPixel pixel) {
    imageStore(gbuffer_id, at, pixel.id);
    imageStore(gbuffer_normal, at, uvec4(pixel.normal, 0u, 0u));
    imageStore(gbuffer_base_color, at, pixel.base_color);
    imageStore(gbuffer_material, at, vec4(pixel.material, 0.0, 0.0));
    if (NEEDS_MOTION) {
        imageStore(gbuffer_motion, at, vec4(pixel.motion, 0.0, 0.0));
    }
    if (NEEDS_EMISSION) {
        imageStore(gbuffer_emissive, at, vec4(pixel.emissive, 1.0));
    }
}

void store_background(ivec2 at) {
    imageStore(gbuffer_id, at, uvec4(0u));
    imageStore(gbuffer_normal, at, uvec4(OCTAHEDRAL_NONE));
    imageStore(gbuffer_base_color, at, vec4(0.0));
    imageStore(gbuffer_material, at, vec4(0.0));
    if (NEEDS_MOTION) {
        imageStore(gbuffer_motion, at, vec4(0.0));
    }
    if (NEEDS_EMISSION) {
        imageStore(gbuffer_emissive, at, vec4(0.0));
    }
}

#endif
