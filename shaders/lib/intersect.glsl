// Rays against analytic shapes, for procedural primitives. In: a ray with any direction but 0, a shape. Out: where its line
// enters and leaves, as multiples of the direction; negative values lie behind the origin, so that rays from inside are told.
#ifndef LIB_INTERSECT
#define LIB_INTERSECT

// Both roots, stable for small and far spheres (Haines, Guenther and Akenine-Moeller, Ray Tracing Gems, chapter 7):
// the discriminant from the nearest point of the line, the smaller root by division instead of a difference.
bool intersect_sphere(vec3 origin, vec3 direction, vec3 centre, float radius, out vec2 t) {
    vec3 from_centre = origin - centre;
    float a = dot(direction, direction);
    float b = -dot(from_centre, direction);
    vec3 nearest = from_centre + (b / a) * direction;
    float discriminant = radius * radius - dot(nearest, nearest);
    t = vec2(0.0);
    if (!(discriminant >= 0.0)) {
        return false;
    }
    float distance_m = length(from_centre);
    float c = (distance_m - radius) * (distance_m + radius);
    float q = b + (b < 0.0 ? -1.0 : 1.0) * sqrt(a * discriminant);
    if (q == 0.0) {
        return true; // touches the sphere at the origin
    }
    t = vec2(c / q, q / a);
    t = vec2(min(t.x, t.y), max(t.x, t.y));
    return true;
}

// Slabs (Kay and Kajiya 1986), each axis decided by itself: a component 0 divides nothing, so that no NaN can arise;
// the box is closed, a ray along a face hits it.
bool intersect_box(vec3 origin, vec3 direction, vec3 low, vec3 high, out vec2 t) {
    const float infinity = uintBitsToFloat(0x7f800000u);
    t = vec2(-infinity, infinity);
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0.0) {
            if (origin[axis] < low[axis] || origin[axis] > high[axis]) {
                return false;
            }
            continue;
        }
        float first = (low[axis] - origin[axis]) / direction[axis];
        float second = (high[axis] - origin[axis]) / direction[axis];
        t = vec2(max(t.x, min(first, second)), min(t.y, max(first, second)));
    }
    return t.x <= t.y;
}

#endif
