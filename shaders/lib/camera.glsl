// The camera as rays and the way back to pixels. In: Frame and a position on the image in pixels (x right, y down, 0 at the upper left corner).
// Out: render space. Camera space: x right, y up, looking along -z.
#ifndef LIB_CAMERA
#define LIB_CAMERA

#include "shared/frame.glsl"
#include "lib/vector.glsl"

struct CameraRay {
    vec3 origin;
    vec3 direction; // unit
    float t_min_m;  // where the near plane is passed
};

// The point of the pixel that this frame samples.
vec2 camera_sample_position(Frame frame, uvec2 pixel) {
    return vec2(pixel) + 0.5 + frame.jitter_px;
}

CameraRay camera_ray(Frame frame, vec2 position_px) {
    vec2 ndc = 2.0 * position_px / vec2(frame.extent_px) - 1.0;
    vec2 offset = vec2(ndc.x, -ndc.y) * frame.half_extent;
    CameraRay ray;
    if ((frame.flags & FRAME_ORTHOGRAPHIC) != 0u) {
        ray.origin = transform_point(frame.render_from_camera, vec3(offset, 0.0));
        ray.direction = normalize_or(transform_vector(frame.render_from_camera, vec3(0.0, 0.0, -1.0)), vec3(0.0, 0.0, -1.0));
        ray.t_min_m = frame.near_m;
        return ray;
    }
    vec3 through = vec3(offset, -1.0);
    ray.origin = transform_point(frame.render_from_camera, vec3(0.0));
    ray.direction = normalize_or(transform_vector(frame.render_from_camera, through), vec3(0.0, 0.0, -1.0));
    ray.t_min_m = frame.near_m * length(through);
    return ray;
}

// Width of a pixel's cone: at the camera (x, metres) and its growth per metre (y).
vec2 camera_cone(Frame frame) {
    float size = 2.0 * frame.half_extent.y / float(frame.extent_px.y);
    return (frame.flags & FRAME_ORTHOGRAPHIC) != 0u ? vec2(size, 0.0) : vec2(0.0, size);
}

// Distance in front of the camera, along its axis, from reverse depth with the far plane at infinity. Perspective only; depth > 0.
float camera_distance_from_depth(Frame frame, float depth) {
    return frame.near_m / depth;
}

// Point on the image (pixels) of a clip-space position; far outside every image where it lies behind the camera.
vec2 camera_position_from_clip(Frame frame, vec4 clip) {
    const vec2 nowhere = vec2(-1e6);
    if (clip.w <= 0.0) {
        return nowhere;
    }
    vec2 position = (clip.xy / clip.w * 0.5 + 0.5) * vec2(frame.extent_px);
    return is_finite(position.x) && is_finite(position.y) ? position : nowhere;
}

// Motion in pixels: where the point is now less where it was, both without jitter.
vec2 camera_motion(Frame frame, vec4 clip, vec4 previous_clip) {
    return camera_position_from_clip(frame, clip) - camera_position_from_clip(frame, previous_clip);
}

#endif
