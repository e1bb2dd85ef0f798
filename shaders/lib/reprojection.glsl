// Whether a pixel of the last frame saw the surface that is seen now. In: its depth and normal, the surface. Knows no light.
#ifndef LIB_REPROJECTION
#define LIB_REPROJECTION

#include "shared/frame.glsl"

// Normals further apart than this belong to different surfaces (cosine of 25 degrees).
const float SAME_NORMAL = 0.906;
// Depths agree within the footprint of this many pixels, and of 1.5 more where the surface is seen at a slant.
const float DEPTH_PIXELS = 4.0;

// Largest difference of reverse depth between the point seen now and a tap that shows the same surface. Perspective depth is near / distance, so
// a footprint is a share of it; orthographic depth is affine. previous_extent: pixels of the last frame; cosine: of the surface to the view.
float depth_tolerance(Frame frame, ivec2 previous_extent, float depth, float cosine) {
    float pixels = DEPTH_PIXELS + 1.5 / max(cosine, 0.05);
    float size = pixels * 2.0 * frame.half_extent.y / float(min(int(frame.extent_px.y), previous_extent.y));
    if ((frame.flags & FRAME_ORTHOGRAPHIC) == 0u) {
        return min(size, 0.5) * depth;
    }
    mat4 m = frame.previous_clip_from_render;
    return size * length(vec3(m[0].z, m[1].z, m[2].z));
}

#endif
