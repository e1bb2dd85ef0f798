// One primitive of the scene, triangle or shape, where a ray or the line of a pixel meets it. In: Scene and a Hit, or ids and a line.
// Out: point, attributes, texture density, place in the last frame. Scenes without shapes lose every branch here (NEEDS_SHAPES).
#ifndef LIB_ELEMENT
#define LIB_ELEMENT

#include "shared/needs.glsl"
#include "lib/shape.glsl"
#include "lib/triangle.glsl"

struct Element {
    bool is_shape;
    Triangle triangle;
    vec2 line_at;       // barycentrics of the line, not clamped; only of element_on_line
    vec2 barycentric;   // weights of the second and third vertex
    PlacedShape shape;
    ShapePlace place;
};

bool is_shape(Scene scene, uint instance_slot, uint geometry) {
    if (!NEEDS_SHAPES) {
        return false;
    }
    Instance instance = InstanceTable(scene.instances).at[instance_slot];
    return (GeometryTable(instance.geometries).at[geometry].flags & GEOMETRY_SHAPES) != 0u;
}

// What a ray has met.
Element element_fetch(Scene scene, Hit hit) {
    Element element;
    element.is_shape = is_shape(scene, hit.instance, hit.geometry);
    if (element.is_shape) {
        element.shape = shape_fetch(scene, hit.instance, hit.geometry, hit.primitive);
        element.place = shape_decode_place(element.shape.kind, hit.barycentric);
    } else {
        element.triangle = triangle_fetch(scene, hit.instance, hit.geometry, hit.primitive);
        element.barycentric = hit.barycentric;
    }
    return element;
}

// What the line of a pixel meets, from the ids of the G-buffer. Of a shape that was seen from inside (geometry | GBUFFER_BACK), where the
// line leaves it.
Element element_on_line(Scene scene, uint instance_slot, uint geometry, uint primitive, vec3 origin, vec3 direction) {
    uint index = geometry & ~GBUFFER_BACK;
    Element element;
    element.is_shape = is_shape(scene, instance_slot, index);
    if (element.is_shape) {
        element.shape = shape_fetch(scene, instance_slot, index, primitive);
        element.place = shape_line_place(element.shape, origin, direction, (geometry & GBUFFER_BACK) != 0u);
    } else {
        element.triangle = triangle_fetch(scene, instance_slot, index, primitive);
        element.line_at = triangle_line_barycentric(element.triangle, origin, direction);
        element.barycentric = clamp_barycentric(element.line_at);
    }
    return element;
}

SurfacePoint element_point(Element element) {
    if (element.is_shape) {
        return shape_point(element.shape, element.place);
    }
    return triangle_point(element.triangle, element.barycentric);
}

Attributes element_attributes(Scene scene, uint instance_slot, Element element) {
    if (!element.is_shape) {
        return triangle_attributes(scene, instance_slot, element.triangle, element.barycentric);
    }
    vec2 uv = shape_uv(element.shape.kind, element.place);
    Attributes attributes;
    attributes.normal = shape_point(element.shape, element.place).normal;
    attributes.tangent = shape_render_vector(element.shape, shape_tangent(element.shape.kind, element.place));
    attributes.handedness = element.shape.winding;
    attributes.uv = vec2[2](uv, uv);
    attributes.color = vec4(1.0);
    return attributes;
}

// Area of each set of texture coordinates a square metre; infinite or NaN where a triangle is degenerate.
vec2 element_uv_density(Element element) {
    if (element.is_shape) {
        return vec2(shape_uv_density(element.shape, element.place));
    }
    return triangle_double_uv_area(element.triangle) / triangle_double_area(element.triangle);
}

// Where the point was in the last frame: render space.
vec3 element_previous_position(Scene scene, uint instance_slot, uint geometry, Element element) {
    uint index = geometry & ~GBUFFER_BACK;
    if (element.is_shape) {
        return shape_previous_position(scene, instance_slot, index, element.shape, element.place);
    }
    return triangle_previous_position(scene, instance_slot, index, element.triangle, element.barycentric);
}

#endif
