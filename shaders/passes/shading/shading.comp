// Pass shading of the raster pipeline: no rays. In: the G-buffer, the direct light of pass raster_light. Out: `shaded`, linear HDR.
// Mirrors, smooth coats and glass show the environment, unblocked: by reflection, glass also by refraction at its first surface.
#version 460
#extension GL_GOOGLE_include_directive : require
#define LIGHT_WITHOUT_RAYS

layout(local_size_x = 8, local_size_y = 8) in;

#include "passes/shading/shading_pixel.glsl"

vec3 light_visibility(Scene scene, vec3 origin, vec3 direction, float t_max_m, uint medium, uint seed) {
    return vec3(1.0);
}

// The environment along one lobe; rough coats have it from pass raster_light.
vec3 environment_lobe(Scene scene, Surface surface, uint material, Sequence sequence, bool reflects) {
    Interface crossing = surface_interface(scene, surface, material, media_outside());
    uint branch = reflects ? 0u : 1u;
    vec2 xi = sample_2d(sequence, sample_dimension(0u, branch, PURPOSE_LOBE, 0u));
    Scatter scatter = scatter_surface(surface, interface_sides(scene, crossing, DISPERSION_NO_CHANNEL), reflects, !reflects, vec3(0.0, xi));
    return scatter.valid ? scatter.weight * environment_radiance(scene, scatter.direction) : vec3(0.0);
}

vec3 shade_pixel(Frame frame, Scene scene, uvec2 pixel, uvec4 id) {
    Surface surface = first_surface(frame, scene, pixel, id);
    vec3 radiance = first_light(surface, pixel);
    Sequence sequence = sequence_begin(frame.seed, pixel, frame.sample_index);
    if (frame.max_depth > 0u && surface_reflects(frame, surface)) {
        radiance += environment_lobe(scene, surface, id.w, sequence, true);
    }
    if (frame.max_depth > 0u && surface_transmits(surface)) {
        radiance += environment_lobe(scene, surface, id.w, sequence, false);
    }
    return radiance;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    uvec4 id = texelFetch(gbuffer_id, ivec2(pixel), 0);
    vec3 radiance = id.x == 0u ? background(frame, scene, pixel) : shade_pixel(frame, scene, pixel, id);
    imageStore(shaded, ivec2(pixel), vec4(radiance, 1.0));
}
