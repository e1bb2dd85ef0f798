// What the scene needs, as specialisation constants: a false one removes its branch from the pipeline.
// Host twin: renderer/src/needs.rs (constant ids in the same order). Defaults are the general variant.
#ifndef SHARED_NEEDS
#define SHARED_NEEDS

layout(constant_id = 0) const bool NEEDS_LIGHTS = true;              // punctual lights
layout(constant_id = 1) const bool NEEDS_EMISSIVE_LIGHTS = true;     // emissive triangles
layout(constant_id = 2) const bool NEEDS_ENVIRONMENT = true;         // an environment that is not black
layout(constant_id = 3) const bool NEEDS_ENVIRONMENT_MAP = true;     // the environment is a map
layout(constant_id = 4) const bool NEEDS_TEXTURES = true;            // any material uses a texture
layout(constant_id = 5) const bool NEEDS_NORMAL_MAPS = true;         // any material uses a normal map
layout(constant_id = 6) const bool NEEDS_REFLECTION = true;          // any surface traces its specular lobe
layout(constant_id = 7) const bool NEEDS_REFRACTION = true;          // any surface transmits
layout(constant_id = 8) const bool NEEDS_EMISSION = true;            // any material emits or is unlit
layout(constant_id = 9) const bool NEEDS_SHADOW_RAYS = true;         // false in the raster pipeline
layout(constant_id = 10) const bool NEEDS_MOTION = true;             // motion vectors are read
layout(constant_id = 11) const bool NEEDS_SHAPES = true;             // some mesh holds spheres or boxes instead of triangles
layout(constant_id = 12) const bool NEEDS_LOBES = true;              // some material has lobes beside metallic-roughness
layout(constant_id = 13) const bool NEEDS_RAY_DEPTH = false;         // the ray depth is shown
layout(constant_id = 14) const bool NEEDS_DENOISING = true;          // light may be denoised over time
layout(constant_id = 15) const bool NEEDS_KNOWN_SHADOWS = false;     // shadow rays are left out where the frames before tell what they meet

#endif
