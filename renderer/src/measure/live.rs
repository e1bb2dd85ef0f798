//! What pass error has found, as figures. Enters: sums of blocks. Leaves: the noise of a picture and its difference from the reference.

use serde::Serialize;

use super::error::{kept_of, luminance};
use super::noise::Noise;
use super::split::Split;
use crate::gpu_types::{ERROR_BLOCK_SIDE, ErrorBlock};

/// The error of a view's picture, measured on the device while it is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LiveError {
    /// Samples of the picture.
    pub samples: u64,
    /// Which picture it is of: that after so many resets.
    pub resets: u64,
    /// What the two streams tell; `None`: there is one sample alone, or nothing finite. Of frames that share their past it means nothing.
    pub noise: Option<Noise>,
    /// `None`: there is no reference of this size.
    pub against: Option<Against>,
}

/// Differences from a reference, as [`super::ErrorMetrics`] has them; FLIP is measured on the host alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Against {
    /// Root of the mean squared difference, radiance.
    pub rmse: f64,
    /// The same without the 0.1 % of pixels with the largest error; at most one of each block of 8 x 8 is left out, so that it may be
    /// larger than that of the host.
    pub rmse_trimmed: f64,
    /// mean((x - r)^2 / (r^2 + 0.01)).
    pub rel_mse: f64,
    /// The same without the 0.1 % of pixels with the largest error, likewise.
    pub rel_mse_trimmed: f64,
    /// The same of the means of blocks of 8 x 8 pixels; NaN where the picture is smaller than a block.
    pub block_rel_mse: f64,
    /// Mean luminance by that of the reference.
    pub luminance_ratio: f64,
    /// The same by channel.
    pub channel_ratios: [f64; 3],
    /// Noise and bias.
    pub split: Split,
}

impl LiveError {
    /// Of the sums of all blocks of a picture, row by row.
    pub(crate) fn of(
        blocks: &[ErrorBlock],
        extent: [u32; 2],
        (samples, resets): (u64, u64),
        has_reference: bool,
    ) -> Self {
        let pixels = extent.map(f64::from).iter().product::<f64>();
        let sum = |of: fn(&ErrorBlock) -> f32| blocks.iter().map(|block| f64::from(of(block))).sum::<f64>();
        let noise =
            (samples >= 2).then(|| Noise::of_sums(sum(|b| b.noise), sum(|b| b.noise_squares), pixels));
        let against = has_reference.then(|| {
            let sums = |of: fn(&ErrorBlock) -> [f32; 3]| {
                blocks.iter().map(of).fold([0.0; 3], |all, one| [0, 1, 2].map(|i| all[i] + f64::from(one[i])))
            };
            let (found, expected) = (sums(|b| b.sum), sums(|b| b.reference_sum));
            let whole = extent.map(|side| f64::from(side / ERROR_BLOCK_SIDE)).iter().product::<f64>();
            let bias: Vec<f64> = blocks.iter().map(|block| f64::from(block.bias)).collect();
            let (squared, relative) = (sum(|b| b.squared), sum(|b| b.relative));
            let kept = kept_of(pixels as usize);
            let trimmed = |sum: f64, largest: fn(&ErrorBlock) -> f32| {
                let mut largest: Vec<f64> = blocks.iter().map(|block| f64::from(largest(block))).collect();
                largest.sort_unstable_by(|a, b| b.total_cmp(a));
                (sum - largest.iter().take(pixels as usize - kept).sum::<f64>()) / kept as f64
            };
            Against {
                rmse: (squared / pixels).sqrt(),
                rmse_trimmed: trimmed(squared, |b| b.largest_squared).sqrt(),
                rel_mse: relative / pixels,
                rel_mse_trimmed: trimmed(relative, |b| b.largest_relative),
                block_rel_mse: sum(|b| b.of_means) / whole,
                luminance_ratio: luminance(found) / luminance(expected),
                channel_ratios: [0, 1, 2].map(|i| found[i] / expected[i]),
                split: Split::of_sums(sum(|b| b.total), sum(|b| b.variance), &bias, pixels),
            }
        });
        Self { samples, resets, noise: noise.flatten(), against }
    }
}
