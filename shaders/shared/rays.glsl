// What every ray-tracing stage agrees on: the TLAS, payloads, ray kinds. Host twins of the
// constants: renderer/src/gpu_types/constants.rs.
#ifndef SHARED_RAYS
#define SHARED_RAYS

#extension GL_EXT_ray_tracing : require

layout(set = 0, binding = 0) uniform accelerationStructureEXT scene_tlas;

// SBT offsets of the ray kinds: hit groups and miss shaders stand in this order; the geometry stride is 0.
const uint RAY_SURFACE = 0u;
const uint RAY_SHADOW = 1u;
// Hit groups of meshes of shapes stand so much further: the SBT offset of their instances.
const uint RAY_SHAPES = 2u;

// Hit kinds that shape.rint reports: which shape, and whether the ray leaves it there.
const uint HIT_SPHERE = 0u;
const uint HIT_BOX = 1u;
const uint HIT_LEAVING = 2u;
const uint HIT_KINDS = 4u;          // kinds below this are of shapes

// Bits of the instance masks, one a kind of ray. A hidden instance has none.
const uint MASK_CAMERA = 1u;
const uint MASK_SHADOWS = 2u;
const uint MASK_INDIRECT = 4u;      // reflections and refractions

// Filled by surface.rchit / surface.rmiss. Fixed size, nothing shaded: ray generation does the shading.
struct SurfacePayload {
    float t_m;          // below 0: nothing was hit
    uint instance;
    uint geometry;
    uint primitive;
    vec2 barycentric;   // weights of the second and third vertex; of a shape: the place on it (lib/shape.glsl)
    uint seed;          // in: for stochastic alpha in surface.rahit
};

// Filled by shadow.rmiss (visible) and shadow.rahit (tint of refractive surfaces, alpha).
struct ShadowPayload {
    vec3 transmittance; // in: 1; multiplied by every refractive surface passed
    vec3 optical_depth; // in: 0; absorption x distance: +t where a medium is left, -t where it is entered
    vec3 attenuation_per_m; // in: of the medium at the origin; then of those entered and not left
    int media;          // in: 1 where the ray starts in a medium, else 0; then the number of those
    uint visible;       // in: 0; 1 when nothing opaque was in the way
    uint seed;          // in: for stochastic alpha in shadow.rahit
};

#endif
