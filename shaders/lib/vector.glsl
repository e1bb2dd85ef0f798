// Small vector and affine-map functions. In: vectors and matrices given as three rows. Out: the same, never NaN from finite input.
// Knows no scene.
#ifndef LIB_VECTOR
#define LIB_VECTOR

const float PI = 3.14159265358979323846;
const float TAU = 6.28318530717958647693;
const float FLOAT_MAX = 3.402823466e38;

// Bit tests: compilers may assume that isnan() is false.
bool is_finite(float x) {
    return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}
bool is_finite(vec3 v) {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}
bool is_finite(vec4 v) {
    return is_finite(v.xyz) && is_finite(v.w);
}

float max_component(vec3 v) {
    return max(max(v.x, v.y), v.z);
}

float luminance(vec3 linear_rgb) {
    return dot(linear_rgb, vec3(0.2126, 0.7152, 0.0722)); // Rec.709
}

// Unit vector along v; `fallback` when v has no direction. Scaled first, so neither tiny nor huge vectors lose theirs.
vec3 normalize_or(vec3 v, vec3 fallback) {
    float scale = max_component(abs(v));
    if (!(scale > 0.0) || !is_finite(scale)) {
        return fallback;
    }
    vec3 scaled = v / scale;
    return scaled * inversesqrt(dot(scaled, scaled));
}

// Length without overflow or underflow of the squares.
float safe_length(vec3 v) {
    float scale = max_component(abs(v));
    if (!(scale > 0.0)) {
        return 0.0;
    }
    return scale * length(v / scale);
}

vec3 transform_vector(vec4 rows[3], vec3 v) {
    return vec3(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}

vec3 transform_point(vec4 rows[3], vec3 p) {
    return transform_vector(rows, p) + vec3(rows[0].w, rows[1].w, rows[2].w);
}

// Rows of the cofactor matrix of the linear part, divided by its largest entry squared: carries normals
// (cross(M a, M b) = cof(M) cross(a, b)), also where the matrix is singular or mirrored.
mat3 cofactor_rows(vec4 rows[3]) {
    float scale = max_component(vec3(
        max_component(abs(rows[0].xyz)), max_component(abs(rows[1].xyz)), max_component(abs(rows[2].xyz))));
    float inverse_scale = scale > 0.0 ? 1.0 / scale : 0.0;
    vec3 r0 = rows[0].xyz * inverse_scale;
    vec3 r1 = rows[1].xyz * inverse_scale;
    vec3 r2 = rows[2].xyz * inverse_scale;
    return mat3(cross(r1, r2), cross(r2, r0), cross(r0, r1)); // stored as columns; v * m takes the dots
}

float determinant_sign(vec4 rows[3]) {
    mat3 cofactors = cofactor_rows(rows);
    return dot(rows[0].xyz, cofactors[0]) < 0.0 ? -1.0 : 1.0;
}

#endif
