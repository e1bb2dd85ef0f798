// Pass gbuffer, fragment stage: body of the four variants. GBUFFER_COVERAGE: masked and blended materials; GBUFFER_EMISSIVE: a sixth target.
// In: instance slot, primitive, pixel. Out: the targets of lib/gbuffer.glsl.
#define SURFACE_GRADIENTS

#include "lib/gbuffer.glsl"

layout(location = 0) flat in uint in_instance_slot;

layout(location = 0) out uvec4 out_id;
layout(location = 1) out uvec2 out_normal;
layout(location = 2) out vec4 out_base_color;
layout(location = 3) out vec2 out_material;
layout(location = 4) out vec2 out_motion;
#ifdef GBUFFER_EMISSIVE
layout(location = 5) out vec4 out_emissive;
#endif

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    GbufferPixel result = gbuffer_pixel(frame, scene, pixel, in_instance_slot, push.argument0, uint(gl_PrimitiveID));
#ifdef GBUFFER_COVERAGE
    // Stochastic for blended materials: over the samples the mean is the coverage, in any order of the draws.
    Sequence sequence = sequence_begin(frame.seed, pixel, frame.sample_index);
    if (coverage_threshold(sequence_seed(sequence), in_instance_slot, push.argument0, uint(gl_PrimitiveID)) >= result.coverage) {
        discard;
    }
#endif
    out_id = result.id;
    out_normal = result.normal;
    out_base_color = result.base_color;
    out_material = result.material;
    out_motion = result.motion;
#ifdef GBUFFER_EMISSIVE
    out_emissive = vec4(result.emissive, 1.0);
#endif
}
