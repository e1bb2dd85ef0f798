// Errors relative to brightness: relMSE = mean((x - r)^2 / (r^2 + 0.01)). CPU twins: renderer/src/measure (noise.rs, split.rs).
#ifndef LIB_RELATIVE_ERROR
#define LIB_RELATIVE_ERROR

#include "shared/error.glsl"

float mean_of_channels(vec3 value) {
    return (value.r + value.g + value.b) / 3.0;
}

// Variance of the mean of two streams relative to its brightness, of which a b is the unbiased square. In: the mean, half the difference.
float relative_variance(vec3 mean, vec3 half_difference) {
    vec3 product = (mean + half_difference) * (mean - half_difference);
    // Where one stream alone has seen what is bright, the product says that the pixel is black.
    vec3 square = max(product, 0.25 * mean * mean);
    return mean_of_channels(half_difference * half_difference / (square + RELATIVE_EPSILON));
}

vec3 reference_weight(vec3 reference) {
    return 1.0 / (reference * reference + RELATIVE_EPSILON);
}

#endif
