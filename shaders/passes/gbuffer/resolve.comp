// Pass gbuffer.resolve: from the ids of the rasterised surfaces to the G-buffer, once a pixel however often it was drawn over.
// In: gbuffer_id as visibility.frag left it. Out: all targets. The same function serves gbuffer.rgen.
#version 460
#extension GL_GOOGLE_include_directive : require
#define SURFACE_GRADIENTS
#define GBUFFER_IDS_GIVEN

#include "passes/gbuffer/gbuffer_store.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    ivec2 at = ivec2(pixel);
    uvec4 id = imageLoad(gbuffer_id, at);
    if (id.x == 0u) {
        store_background(at);
        return;
    }
    store_pixel(at, gbuffer_pixel(frame, SceneTable(frame.scene).scene, pixel, id.x - 1u, id.y, id.z));
}
