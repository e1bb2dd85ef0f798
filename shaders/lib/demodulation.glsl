// What denoised light is divided by before it is filtered and multiplied with afterwards, so that filters see light and not the material; and where
// the image in a mirror or behind glass seems to be. In: the first surface. Out: factors per channel, metres. Knows no filter.
#ifndef LIB_DEMODULATION
#define LIB_DEMODULATION

#include "lib/brdf.glsl"
#include "lib/surface.glsl"

// Rough lobes show no image: what they reflect moves with the surface.
const float IMAGE_ROUGHNESS_MAX = 0.25;
// The least tint, per channel: light is divided by it, and lobes that it does not know of (coats, sheen) must not be lost.
const float TINT_MIN = 0.04;

// Share of the light that rays bring which reaches the camera, nearly: by reflection and through the surface.
vec3 surface_lobe_tint(Surface surface) {
    vec3 tint = surface.base_color;
    if (surface.mode == MODE_PBR) {
        float v_z = dot(surface.view, surface.shading_normal);
        vec3 passed = surface_transmits(surface) ? surface.base_color * ((1.0 - surface.metallic) * surface.transmission) : vec3(0.0);
        tint = brdf_specular_albedo(surface_brdf(surface), v_z) + passed;
    }
    return max(tint, vec3(TINT_MIN));
}

// Divisor of the light that a surface sends towards a mirror.
vec3 surface_tint(Surface surface) {
    vec3 tint = surface.mode == MODE_PBR ? surface_diffuse_albedo(surface) + surface_lobe_tint(surface) : surface.emissive;
    return max(tint, vec3(TINT_MIN));
}

// Whether the surface shows the image of what its rays meet rather than light of its own.
bool surface_shows_image(Surface surface) {
    bool coated = surface.metallic < 0.5 && !surface_transmits(surface);
    return surface.mode == MODE_REFLECTIVE || surface.mode == MODE_REFRACTIVE
        || (surface.mode == MODE_PBR && !coated && surface.roughness <= IMAGE_ROUGHNESS_MAX);
}

// How far behind the surface the image seems to lie, as a share of the length of the ray: less as the lobe widens (dominant direction of GGX,
// Lagarde and de Rousiers, "Moving Frostbite to PBR", 2014, listing 23, read as a share of the way).
float image_share(Surface surface) {
    if (surface.mode != MODE_PBR) {
        return 1.0;
    }
    float r = surface.roughness;
    return r <= IMAGE_ROUGHNESS_MAX ? (1.0 - r) * (sqrt(1.0 - r) + r) : 0.0;
}

#endif
