// What pass error measures, and against what. Host twins: renderer/src/gpu_types/error.rs.
#ifndef SHARED_ERROR
#define SHARED_ERROR

// Keeps the relative error of dark pixels finite.
const float RELATIVE_EPSILON = 0.01;
// Side of the blocks, pixels.
const uint ERROR_BLOCK_SIDE = 8u;

// A pixel of the reference, linear radiance.
struct ReferencePixel {
    vec3 mean;
    vec3 half_difference;               // half of the difference of its two streams; 0 where that is not known
};

// Sums over the pixels of a block; those of squares are means over the channels.
struct ErrorBlock {
    vec3 sum;                           // radiance
    vec3 reference_sum;
    float noise;                        // relative variance, the brightness taken from the picture itself
    float noise_squares;                // squares of these
    float squared;                      // (x - r)^2
    float relative;                     // (x - r)^2 w, w = 1 / (r^2 + 0.01)
    float total;                        // the same without the noise of the reference
    float variance;                     // of the picture, times w
    float bias;                         // (a - p)(b - q) w, of the streams of the picture and of the reference
    float of_means;                     // (x - r)^2 w of the means of the block; 0 where it is cut by the edge
    float largest_squared;              // the largest (x - r)^2 of a pixel, mean over its channels
    float largest_relative;             // the largest (x - r)^2 w of a pixel, likewise
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer ReferenceTable { ReferencePixel at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer ErrorBlockTable { ErrorBlock at[]; };

#endif
