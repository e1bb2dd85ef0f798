// Pass gbuffer, fragment stage: what is seen, opaque materials. In: instance slot, primitive. Out: ids; resolve.comp makes the G-buffer of them.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "shared/frame.glsl"

layout(location = 0) flat in uint in_instance_slot;

layout(location = 0) out uvec4 out_id;

void main() {
    out_id = uvec4(in_instance_slot + 1u, push.argument0, uint(gl_PrimitiveID), 0u);
}
