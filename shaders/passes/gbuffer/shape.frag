// Pass gbuffer, fragment stage of spheres and boxes. In: instance slot and shape whose box covers the pixel. Out: ids and depth where the pixel's line
// meets the shape itself, on the side that a camera ray would meet (gbuffer.rgen).
#version 460
#extension GL_GOOGLE_include_directive : require

#define SURFACE_GRADIENTS
#define GBUFFER_COVERAGE

#include "lib/gbuffer.glsl"

layout(location = 0) flat in uvec2 in_instance_shape;

layout(location = 0) out uvec4 out_id;

// Not a hole; of a blended surface by chance (visibility_alpha.frag).
bool is_covered(Frame frame, Scene scene, Material material, uvec2 pixel, uint geometry) {
    if ((material.flags & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND)) == 0u) {
        return true;
    }
    float coverage = gbuffer_pixel(frame, scene, pixel, in_instance_shape.x, geometry, in_instance_shape.y).coverage;
    uint seed = sequence_seed(sequence_begin(frame.seed, pixel, frame.sample_index));
    return coverage_threshold(seed, in_instance_shape.x, geometry, in_instance_shape.y) < coverage;
}

// Reverse depth of the place where a line of unit space enters or leaves the shape.
float depth_of(Frame frame, PlacedShape shape, vec3 origin, vec3 direction, bool leaving) {
    vec3 position = shape_point(shape, unit_line_place(shape.kind, origin, direction, leaving)).position;
    vec4 clip = frame.clip_from_render_unjittered * vec4(position, 1.0);
    return clip.w > 0.0 ? clamp(clip.z / clip.w, 0.0, 1.0) : 0.0;
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    Scene scene = SceneTable(frame.scene).scene;
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    CameraRay ray = camera_ray(frame, camera_sample_position(frame, pixel));
    PlacedShape shape = shape_fetch(scene, in_instance_shape.x, push.argument0, in_instance_shape.y);
    vec3 origin = ray.origin;
    vec3 direction = ray.direction;
    float speed;
    vec2 t;
    if (!shape_line(shape, origin, direction, speed) || !unit_line_meets(shape.kind, origin, direction, t)) {
        discard;
    }
    Material material = MaterialTable(scene.materials).at[material_index(scene, in_instance_shape.x, push.argument0)];
    uint sides = material_shows_both_sides(material) ? 2u : 1u;
    for (uint side = 0u; side < sides; ++side) {
        uint geometry = push.argument0 | (side == 1u ? GBUFFER_BACK : 0u);
        if (t[side] / speed >= ray.t_min_m && is_covered(frame, scene, material, pixel, geometry)) {
            out_id = uvec4(in_instance_shape.x + 1u, geometry, in_instance_shape.y, 0u);
            gl_FragDepth = depth_of(frame, shape, origin, direction, side == 1u);
            return;
        }
    }
    discard;
}
