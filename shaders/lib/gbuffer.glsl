// The G-buffer: what a camera ray or a fragment writes, and how later passes read it back as a Surface.
// In: pixel, instance slot, geometry (of a shape seen from inside with GBUFFER_BACK), primitive. Out: the values of all targets. Raster and camera rays share this code, so they agree.
// The point is where the pixel's line meets the triangle or shape: nothing depends on interpolation or on the precision of the depth target.
#ifndef LIB_GBUFFER
#define LIB_GBUFFER

#include "shared/frame.glsl"
#include "lib/camera.glsl"
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"

struct GbufferPixel {
    uvec4 id;           // instance slot + 1, geometry | GBUFFER_BACK, primitive, material
    uvec2 normal;       // octahedral: shading, geometric; on the camera's side
    vec4 base_color;    // a: occlusion
    vec2 material;      // metallic, roughness
    vec2 motion;        // pixels, current minus previous
    vec3 emissive;
    float depth;        // reverse
#ifdef GBUFFER_COVERAGE
    float coverage;     // 0..1
#endif
};

#ifdef SURFACE_GRADIENTS
vec4 gbuffer_uv_gradient(vec2 edge1, vec2 edge2, vec2 right, vec2 down) {
    return vec4(edge1 * right.x + edge2 * right.y, edge1 * down.x + edge2 * down.y);
}

// Change of a shape's texture coordinates from here to where a line meets the tangent plane.
vec2 gbuffer_shape_uv_step(PlacedShape shape, ShapePlace place, CameraRay ray) {
    vec3 origin = ray.origin;
    vec3 direction = ray.direction;
    float speed;
    if (!shape_line(shape, origin, direction, speed)) {
        return vec2(0.0);
    }
    vec3 along = origin + (dot(place.unit - origin, place.normal) / dot(direction, place.normal)) * direction - place.unit;
    return is_finite(along) ? shape_uv_step(shape.kind, place, along) : vec2(0.0);
}

TexturePoint gbuffer_texture_point(Frame frame, vec2 position_px, Element element, Attributes attributes) {
    CameraRay right_ray = camera_ray(frame, position_px + vec2(1.0, 0.0));
    CameraRay down_ray = camera_ray(frame, position_px + vec2(0.0, 1.0));
    if (element.is_shape) {
        vec4 gradient = vec4(gbuffer_shape_uv_step(element.shape, element.place, right_ray),
            gbuffer_shape_uv_step(element.shape, element.place, down_ray));
        return TexturePoint(attributes.uv, vec4[2](gradient, gradient));
    }
    Triangle triangle = element.triangle;
    vec2 line_at = element.line_at;
    vec2 right = triangle_line_barycentric(triangle, right_ray.origin, right_ray.direction) - line_at;
    vec2 down = triangle_line_barycentric(triangle, down_ray.origin, down_ray.direction) - line_at;
    AttributeTable table = AttributeTable(triangle.attributes);
    VertexAttributes a = table.at[triangle.index.x];
    VertexAttributes b = table.at[triangle.index.y];
    VertexAttributes c = table.at[triangle.index.z];
    TexturePoint point;
    point.uv = attributes.uv;
    point.uv_gradient = vec4[2](
        gbuffer_uv_gradient(b.tex_coord0 - a.tex_coord0, c.tex_coord0 - a.tex_coord0, right, down),
        gbuffer_uv_gradient(b.tex_coord1 - a.tex_coord1, c.tex_coord1 - a.tex_coord1, right, down));
    return point;
}

GbufferPixel gbuffer_pixel(Frame frame, Scene scene, uvec2 pixel, uint instance_slot, uint geometry, uint primitive) {
    vec2 position_px = camera_sample_position(frame, pixel);
    CameraRay ray = camera_ray(frame, position_px);
    Element element = element_on_line(scene, instance_slot, geometry, primitive, ray.origin, ray.direction);
    SurfacePoint point = element_point(element);
    Attributes attributes = element_attributes(scene, instance_slot, element);
    TexturePoint textures_at = gbuffer_texture_point(frame, position_px, element, attributes);
    uint geometry_index = geometry & ~GBUFFER_BACK;
    uint material_slot = material_index(scene, instance_slot, geometry_index);
    Material material = MaterialTable(scene.materials).at[material_slot];
    bool front = element.is_shape ? geometry == geometry_index : dot(point.normal, ray.direction) < 0.0;
    Surface surface = surface_shade(scene, material, point, front, attributes, textures_at, -ray.direction);

    vec4 clip = frame.clip_from_render_unjittered * vec4(point.position, 1.0);
    vec3 previous = element_previous_position(scene, instance_slot, geometry_index, element);
    GbufferPixel result;
    result.id = uvec4(instance_slot + 1u, geometry_index | (front ? 0u : GBUFFER_BACK), primitive, material_slot);
    result.normal = uvec2(octahedral_encode(surface.shading_normal), octahedral_encode(surface.geometric_normal));
    result.base_color = vec4(surface.base_color, surface.occlusion);
    result.material = vec2(surface.metallic, surface.roughness);
    result.motion = camera_motion(frame, clip, frame.previous_clip_from_render * vec4(previous, 1.0));
    result.emissive = surface.emissive;
    result.depth = clip.w > 0.0 ? clip.z / clip.w : 0.0;
#ifdef GBUFFER_COVERAGE
    result.coverage = material_coverage(material, material_base_color(material, textures_at, attributes.color).a);
#endif
    return result;
}
#else
// The surface of a pixel from its targets; id.x > 0.
Surface surface_from_gbuffer(Frame frame, Scene scene, uvec2 pixel, uvec4 id, uvec2 normal, vec4 base_color, vec2 metallic_roughness) {
    CameraRay ray = camera_ray(frame, camera_sample_position(frame, pixel));
    Element element = element_on_line(scene, id.x - 1u, id.y, id.z, ray.origin, ray.direction);
    SurfacePoint point = element_point(element);
    Material material = MaterialTable(scene.materials).at[id.w];
    Surface surface;
    surface.position = point.position;
    surface.offset_m = point.offset_m;
    surface.view = -ray.direction;
    surface.front = (id.y & GBUFFER_BACK) == 0u;
    surface.geometric_normal = surface.front ? point.normal : -point.normal;
    surface.shading_normal = consistent_normal(octahedral_decode(normal.x), surface.geometric_normal, surface.view);
    surface_set_material(surface, material, base_color.rgb, metallic_roughness);
    surface.occlusion = base_color.a;
    surface.emissive = vec3(0.0);
    if (material_has_lobes(material)) {
        Attributes attributes = element_attributes(scene, id.x - 1u, element);
        vec2 cone = camera_cone(frame);
        float width_m = cone.x + cone.y * length(point.position - ray.origin);
        TexturePoint textures_at = cone_texture_point(element, attributes, dot(point.normal, ray.direction), width_m);
        surface_add_lobes(surface, scene, material_lobes(scene, material), point.normal, attributes, textures_at);
    }
    return surface;
}
#endif

#endif
