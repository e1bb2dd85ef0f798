//! The filters of FLIP. In: a plane of values. Out: the plane filtered; beyond its edge it goes on as at the edge.

use std::f32::consts::PI;

/// Contrast sensitivity of the three channels of YCxCz: sums of two Gaussians a sqrt(pi / b) exp(-pi^2 x^2 / b) of the distance in
/// degrees: a, b, a, b. (Johnson and Fairchild 2001, as FLIP has them.)
const SENSITIVITY: [[f32; 4]; 3] =
    [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];
/// Width of the features that are seen, degrees.
const FEATURE_WIDTH: f32 = 0.082;

/// Weights for offsets from `-radius` to `radius`.
pub(super) struct Kernel(Vec<f32>);

impl Kernel {
    fn new(radius: usize, weight: impl Fn(f32) -> f32) -> Self {
        let radius = radius as isize;
        Self((-radius..=radius).map(|offset| weight(offset as f32)).collect())
    }

    /// Weights of each sign sum up to 1.
    fn normalized(self) -> Self {
        let sum = |positive: bool| -> f32 {
            let of_sign = self.0.iter().filter(|weight| (**weight > 0.0) == positive);
            of_sign.map(|weight| weight.abs()).sum::<f32>().max(f32::MIN_POSITIVE)
        };
        let (above, below) = (sum(true), sum(false));
        Self(self.0.iter().map(|&weight| weight / if weight > 0.0 { above } else { below }).collect())
    }
}

/// The filter of the eye for a channel: weights that sum up to 1, each with a kernel for rows and columns.
pub(super) fn contrast_sensitivity(channel: usize, pixels_per_degree: f32) -> Vec<(f32, Kernel)> {
    let widest = SENSITIVITY.iter().flat_map(|row| [row[1], row[3]]).fold(0.0, f32::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
    let [a1, b1, a2, b2] = SENSITIVITY[channel];
    let parts = [(a1, b1), (a2, b2)].map(|(a, b)| {
        let kernel = Kernel::new(radius, |offset| (-(PI * offset / pixels_per_degree).powi(2) / b).exp());
        // The sum over the plane is that over a row, squared.
        let sum: f32 = kernel.0.iter().sum();
        (a * (PI / b).sqrt() * sum * sum, kernel.normalized())
    });
    let total: f32 = parts.iter().map(|(weight, _)| weight).sum();
    parts.into_iter().filter(|(weight, _)| *weight > 0.0).map(|(weight, k)| (weight / total, k)).collect()
}

/// A Gaussian, and its first and second derivative, which answer to edges and points.
pub(super) fn features(pixels_per_degree: f32) -> (Kernel, Kernel, Kernel) {
    let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as usize;
    let gauss = |x: f32| (-x * x / (2.0 * deviation * deviation)).exp();
    let smooth = Kernel::new(radius, gauss).normalized();
    let edge = Kernel::new(radius, |x| -x * gauss(x)).normalized();
    let point = Kernel::new(radius, |x| (x * x / (deviation * deviation) - 1.0) * gauss(x)).normalized();
    (smooth, edge, point)
}

/// Filters rows, then columns.
pub(super) fn convolve(extent: [u32; 2], plane: &[f32], across: &Kernel, down: &Kernel) -> Vec<f32> {
    let [width, height] = extent.map(|side| side as usize);
    let mut rows = vec![0.0; plane.len()];
    let radius = across.0.len() / 2;
    let mut padded = vec![0.0; width + 2 * radius];
    for (row, filtered) in plane.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        padded[..radius].fill(row[0]);
        padded[radius..radius + width].copy_from_slice(row);
        padded[radius + width..].fill(row[width - 1]);
        for (offset, weight) in across.0.iter().enumerate() {
            let values = &padded[offset..offset + width];
            filtered.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    let mut both = vec![0.0; plane.len()];
    let radius = down.0.len() / 2;
    for (y, filtered) in both.chunks_exact_mut(width).enumerate() {
        for (offset, weight) in down.0.iter().enumerate() {
            let from = (y + offset).saturating_sub(radius).min(height - 1);
            let values = &rows[from * width..][..width];
            filtered.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    both
}
