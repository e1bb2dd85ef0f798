// Pass gbuffer, fragment stage: what is seen, masked and blended materials. In: instance slot, primitive, pixel. Out: ids where there is coverage.
#version 460
#extension GL_GOOGLE_include_directive : require

#define SURFACE_GRADIENTS
#define GBUFFER_COVERAGE

#include "lib/gbuffer.glsl"

layout(location = 0) flat in uint in_instance_slot;

layout(location = 0) out uvec4 out_id;

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    uint primitive = uint(gl_PrimitiveID);
    float coverage = gbuffer_pixel(frame, scene, pixel, in_instance_slot, push.argument0, primitive).coverage;
    // Stochastic for blended materials: over the samples the mean is the coverage, in any order of the draws.
    Sequence sequence = sequence_begin(frame.seed, pixel, frame.sample_index);
    if (coverage_threshold(sequence_seed(sequence), in_instance_slot, push.argument0, primitive) >= coverage) {
        discard;
    }
    out_id = uvec4(in_instance_slot + 1u, push.argument0, primitive, 0u);
}
