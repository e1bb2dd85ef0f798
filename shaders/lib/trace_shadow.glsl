// Shadow rays of ray generation shaders: light_visibility() for lib/direct_light.glsl. In: a segment, the medium in which it starts. Out: the share
// of light that passes. Where volumes overlap, all of them absorb. A volume in which the ray starts without the caller's knowing (the camera's)
// absorbs as far as to where the ray leaves it.
#ifndef LIB_TRACE_SHADOW
#define LIB_TRACE_SHADOW

#include "shared/rays.glsl"
#include "shared/needs.glsl"
#include "lib/media.glsl"
#include "lib/vector.glsl"

layout(location = 1) rayPayloadEXT ShadowPayload shadow_payload;

vec3 light_visibility(Scene scene, vec3 origin, vec3 direction, float t_max_m, uint medium, uint seed) {
    if (!NEEDS_SHADOW_RAYS || !(t_max_m > 0.0)) {
        return medium_transmittance(scene, medium, t_max_m); // t_max_m is 0 on the light itself
    }
    shadow_payload.transmittance = vec3(1.0);
    shadow_payload.optical_depth = vec3(0.0);
    shadow_payload.attenuation_per_m = medium == MEDIUM_AIR ? vec3(0.0) : MaterialTable(scene.materials).at[medium].attenuation_per_m;
    shadow_payload.media = medium == MEDIUM_AIR ? 0 : 1;
    shadow_payload.visible = 0u;
    shadow_payload.seed = seed;
    const uint flags = gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT;
    traceRayEXT(scene_tlas, flags, MASK_SHADOWS, RAY_SHADOW, 0, RAY_SHADOW, origin, 0.0, direction, t_max_m, 1);
    if (shadow_payload.visible == 0u) {
        return vec3(0.0);
    }
    // What is still open holds the end. The count tells, as a sum of what came and went may not be 0 again.
    vec3 depth = shadow_payload.optical_depth;
    if (shadow_payload.media > 0) {
        depth += shadow_payload.attenuation_per_m * min(t_max_m, LONGEST_M);
    }
    return shadow_payload.transmittance * exp(-max(depth, vec3(0.0)));
}

#endif
