// Rays that follow a path from surface to surface, for ray generation shaders. In: the surface that is left, a direction. Out: `payload`.
#ifndef LIB_TRACE_SURFACE
#define LIB_TRACE_SURFACE

#include "shared/rays.glsl"
#include "lib/surface.glsl"

layout(location = 0) rayPayloadEXT SurfacePayload payload;

// transmitted: leaves on the far side. Not told by the direction: rounding must not put the ray on the wrong side.
void trace_surface(Surface surface, vec3 direction, bool transmitted, uint seed) {
    float side = transmitted ? -1.0 : 1.0;
    vec3 origin = surface.position + side * surface.offset_m * surface.geometric_normal;
    payload.t_m = -1.0;
    payload.seed = seed;
    traceRayEXT(scene_tlas, gl_RayFlagsNoneEXT, MASK_INDIRECT, RAY_SURFACE, 0, RAY_SURFACE, origin, 0.0, direction, FLOAT_MAX, 0);
}

// Ends a path that carries little by chance, and raises the survivors (Arvo and Kirk 1990): the mean stays. chance_max below 1 ends any path.
bool survives(inout vec3 throughput, float chance_max, float xi) {
    float chance = clamp(max_component(throughput), 0.0, chance_max);
    if (xi >= chance) {
        return false;
    }
    throughput /= chance;
    return true;
}

#endif
