// Pass show_surface, in place of post: the triangles and shapes themselves. In: gbuffer_id, the scene. Out: `display`, linear, 0..1.
// argument0: SHOW_WIREFRAME or SHOW_BARYCENTRIC.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#define SURFACE_GRADIENTS

layout(local_size_x = 8, local_size_y = 8) in;

#include "lib/gbuffer.glsl"

layout(set = 1, binding = 0) uniform utexture2D gbuffer_id;
layout(set = 1, binding = 1, rgba16f) uniform writeonly image2D display;

// Lines of the net on a sphere: around it, and from pole to pole. A box shows its edges.
const vec2 SPHERE_CELLS = vec2(24.0, 12.0);

struct Lines {
    vec3 coordinates;   // weights of the corners; of a shape texture coordinates and 0
    float distance_px;  // to the nearest edge, along the image
};

// Distance of a value from 0 in pixels, by its change to the right and down. Exact for planes seen from afar.
float pixels_from_zero(float value, vec2 change) {
    return abs(value) / length(change);
}

Lines triangle_lines(Element element, CameraRay right_ray, CameraRay down_ray) {
    vec2 right = triangle_line_barycentric(element.triangle, right_ray.origin, right_ray.direction) - element.line_at;
    vec2 down = triangle_line_barycentric(element.triangle, down_ray.origin, down_ray.direction) - element.line_at;
    Lines lines;
    vec2 at = element.barycentric;
    lines.coordinates = vec3(1.0 - at.x - at.y, at);
    vec3 change_right = vec3(-right.x - right.y, right);
    vec3 change_down = vec3(-down.x - down.y, down);
    lines.distance_px = FLOAT_MAX;
    for (int i = 0; i < 3; ++i) {
        float distance_px = pixels_from_zero(lines.coordinates[i], vec2(change_right[i], change_down[i]));
        lines.distance_px = min(lines.distance_px, distance_px);
    }
    return lines;
}

Lines shape_lines(Element element, CameraRay right_ray, CameraRay down_ray) {
    vec2 cells = element.shape.kind == SHAPE_SPHERE ? SPHERE_CELLS : vec2(1.0);
    vec2 uv = shape_uv(element.shape.kind, element.place);
    vec2 right = gbuffer_shape_uv_step(element.shape, element.place, right_ray);
    vec2 down = gbuffer_shape_uv_step(element.shape, element.place, down_ray);
    vec2 from_line = uv * cells - round(uv * cells);
    Lines lines;
    lines.coordinates = vec3(uv, 0.0);
    lines.distance_px = min(pixels_from_zero(from_line.x, cells.x * vec2(right.x, down.x)),
        pixels_from_zero(from_line.y, cells.y * vec2(right.y, down.y)));
    return lines;
}

vec3 show_element(Frame frame, Scene scene, uvec2 pixel, uvec4 id) {
    vec2 position_px = camera_sample_position(frame, pixel);
    CameraRay ray = camera_ray(frame, position_px);
    Element element = element_on_line(scene, id.x - 1u, id.y, id.z, ray.origin, ray.direction);
    CameraRay right_ray = camera_ray(frame, position_px + vec2(1.0, 0.0));
    CameraRay down_ray = camera_ray(frame, position_px + vec2(0.0, 1.0));
    Lines lines = element.is_shape ? shape_lines(element, right_ray, down_ray) : triangle_lines(element, right_ray, down_ray);
    if (push.argument0 == SHOW_BARYCENTRIC) {
        return lines.coordinates;
    }
    // Half a pixel on each side of the edge, faded over one: both of its triangles draw their half.
    float line = is_finite(lines.distance_px) ? clamp(1.0 - lines.distance_px, 0.0, 1.0) : 0.0;
    float facing = abs(dot(element_point(element).normal, ray.direction));
    return mix(vec3(0.02 + 0.1 * facing), vec3(0.8), line);
}

void main() {
    Frame frame = FrameTable(push.frame_address).frame;
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.extent_px))) {
        return;
    }
    uvec4 id = texelFetch(gbuffer_id, ivec2(pixel), 0);
    vec3 color = id.x == 0u ? vec3(0.0) : show_element(frame, SceneTable(frame.scene).scene, pixel, id);
    imageStore(display, ivec2(pixel), vec4(is_finite(color) ? clamp(color, 0.0, 1.0) : vec3(1.0, 0.0, 1.0), 1.0));
}
