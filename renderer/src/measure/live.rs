//! What pass error has found, as figures. Enters: sums of blocks. Leaves: the noise of a picture and its difference from the reference.

use serde::Serialize;

use super::error::luminance;
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

/// Differences from a reference, as [`super::ErrorMetrics`] has them; the trimmed forms and FLIP are measured on the host alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Against {
    /// Root of the mean squared difference, radiance.
    pub rmse: f64,
    /// mean((x - r)^2 / (r^2 + 0.01)).
    pub rel_mse: f64,
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
            Against {
                rmse: (sum(|b| b.squared) / pixels).sqrt(),
                rel_mse: sum(|b| b.relative) / pixels,
                block_rel_mse: sum(|b| b.of_means) / whole,
                luminance_ratio: luminance(found) / luminance(expected),
                channel_ratios: [0, 1, 2].map(|i| found[i] / expected[i]),
                split: Split::of_sums(sum(|b| b.total), sum(|b| b.variance), &bias, pixels),
            }
        });
        Self { samples, resets, noise: noise.flatten(), against }
    }
}
