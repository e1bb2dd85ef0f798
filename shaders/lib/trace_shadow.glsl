// Shadow rays of ray generation shaders: light_visibility() for lib/direct_light.glsl. In: a segment. Out: the share of light that passes.
#ifndef LIB_TRACE_SHADOW
#define LIB_TRACE_SHADOW

#include "shared/rays.glsl"
#include "shared/needs.glsl"
#include "lib/vector.glsl"

layout(location = 1) rayPayloadEXT ShadowPayload shadow_payload;

vec3 light_visibility(vec3 origin, vec3 direction, float t_max_m, uint seed) {
    if (!NEEDS_SHADOW_RAYS || !(t_max_m > 0.0)) {
        return vec3(1.0); // t_max_m is 0 on the light itself
    }
    shadow_payload.transmittance = vec3(1.0);
    shadow_payload.optical_depth = vec3(0.0);
    shadow_payload.visible = 0u;
    shadow_payload.seed = seed;
    const uint flags = gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT;
    traceRayEXT(scene_tlas, flags, MASK_SHADOWS, RAY_SHADOW, 0, RAY_SHADOW, origin, 0.0, direction, t_max_m, 1);
    if (shadow_payload.visible == 0u) {
        return vec3(0.0);
    }
    return shadow_payload.transmittance * exp(-max(shadow_payload.optical_depth, vec3(0.0)));
}

#endif
