// Direct light of one pixel, shared by the passes shadow and raster_light. In: the G-buffer. Out: diffuse light without the base colour's factor and
// specular light divided by brdf_specular_albedo; the shading pass multiplies both back. a: 1 where a surface was lit, else 0.
#ifndef PASS_LIGHT_PIXEL
#define PASS_LIGHT_PIXEL

#extension GL_EXT_samplerless_texture_functions : require

#include "lib/gbuffer.glsl"
#include "lib/direct_light.glsl"
#include "lib/scatter.glsl"

layout(set = 1, binding = 0) uniform utexture2D gbuffer_id;
layout(set = 1, binding = 1) uniform utexture2D gbuffer_normal;
layout(set = 1, binding = 2) uniform texture2D gbuffer_base_color;
layout(set = 1, binding = 3) uniform texture2D gbuffer_material;
layout(set = 1, binding = 4, rgba32f) uniform writeonly image2D direct_diffuse;
layout(set = 1, binding = 5, rgba32f) uniform writeonly image2D direct_specular;

#ifdef SHADOWS_ARE_REMEMBERED
// Before light is drawn for it.
void surface_found(Frame frame, uvec2 pixel, Surface surface);
#endif

void light_pixel(uvec2 pixel) {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    ivec2 at = ivec2(pixel);
    vec4 diffuse = vec4(0.0);
    vec4 specular = vec4(0.0);
    uvec4 id = texelFetch(gbuffer_id, at, 0);
    if (id.x != 0u) {
        Surface surface = surface_from_gbuffer(frame, scene, pixel, id, texelFetch(gbuffer_normal, at, 0).xy,
            texelFetch(gbuffer_base_color, at, 0), texelFetch(gbuffer_material, at, 0).xy);
#ifdef SHADOWS_ARE_REMEMBERED
        surface_found(frame, pixel, surface);
#endif
        bool lobe_traced = frame.max_depth > 0u && surface_reflects(frame, surface);
        Sequence sequence = sequence_begin(frame.seed, pixel, frame.sample_index);
        // The camera is taken to be in air, unless it sees the inside of a volume.
        uint medium = surface_interface(scene, surface, id.w, media_outside()).before;
        Receiver receiver = receiver_begin(surface, medium, lobe_traced, sequence, 0u, 0u);
        DirectLight light = direct_light(scene, receiver, frame.light_samples, frame.shadow_rays);
        diffuse = vec4(light.diffuse, 1.0);
        specular = vec4(demodulate(light.specular, brdf_specular_albedo(receiver.brdf, receiver.v.z)), 1.0);
    }
    imageStore(direct_diffuse, at, diffuse);
    imageStore(direct_specular, at, specular);
}

#endif
