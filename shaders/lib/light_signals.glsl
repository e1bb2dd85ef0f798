// Which signals of light there are to denoise. In: Frame, needs. Direct light is two, diffuse and specular; a path's light is whole, in the first.
#ifndef LIB_LIGHT_SIGNALS
#define LIB_LIGHT_SIGNALS

#include "shared/frame.glsl"
#include "shared/needs.glsl"

// What rays bring to mirrors and through glass.
const bool HAS_REFLECTED = NEEDS_REFLECTION || NEEDS_REFRACTION;

bool has_specular(Frame frame) {
    return (frame.flags & FRAME_PATHS_BEND) == 0u;
}

#endif
