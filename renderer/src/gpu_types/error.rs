//! Host twins of `shaders/shared/error.glsl`.

use bytemuck::{Pod, Zeroable};

use super::Twin;

twins! {
    /// A pixel of the reference, linear radiance.
    struct ReferencePixel, size 24 {
        /// Mean of all samples.
        0 mean: [f32; 3],
        /// Half of the difference of its two streams; 0 where that is not known.
        12 half_difference: [f32; 3],
    }

    /// Sums over the pixels of a block; those of squares are means over the channels.
    struct ErrorBlock, size 64 {
        /// Radiance.
        0 sum: [f32; 3],
        /// Of the reference.
        12 reference_sum: [f32; 3],
        /// Relative variance, the brightness taken from the picture itself.
        24 noise: f32,
        /// Squares of these.
        28 noise_squares: f32,
        /// (x - r)^2.
        32 squared: f32,
        /// (x - r)^2 w, w = 1 / (r^2 + 0.01).
        36 relative: f32,
        /// The same without the noise of the reference.
        40 total: f32,
        /// Variance of the picture, times w.
        44 variance: f32,
        /// (a - p)(b - q) w, of the streams of the picture and of the reference.
        48 bias: f32,
        /// (x - r)^2 w of the means of the block; 0 where it is cut by the edge.
        52 of_means: f32,
        /// The largest (x - r)^2 of a pixel, mean over its channels.
        56 largest_squared: f32,
        /// The largest (x - r)^2 w of a pixel, likewise.
        60 largest_relative: f32,
    }
}
