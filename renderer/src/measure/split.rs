//! The error of a picture against a reference, in two parts: noise, which falls with the samples, and bias, which stays.
//! In: pictures of two halves whose noise is independent, the reference one of them. Out: numbers.

use serde::Serialize;

use super::error::{BLOCK, relative, same_size};
use super::noise::{Estimate, STANDARD_ERRORS};
use crate::error::Result;
use crate::renderer::Accumulated;

/// What the two halves of a picture are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halves {
    /// The two streams of one run: the picture is their mean, which has half of the variance of each.
    Streams,
    /// Two runs that differ in their random numbers alone; either is the picture. For pictures whose samples share their past.
    Runs,
}

/// An error in its parts, each as sqrt(relMSE), relMSE = mean((x - r)^2 / (r^2 + 0.01)); 0.01 is 1 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Split {
    /// Both, without the reference's own noise where that is known: total^2 = noise^2 + bias^2.
    pub total: f64,
    /// What more samples take away.
    pub noise: f64,
    /// What stays, with the interval that holds it in 95 of 100 cases.
    pub bias: Estimate,
}

impl Split {
    /// Splits the error of a picture.
    ///
    /// With halves a and b of the picture, p and q of the reference, E\[(a - p)(b - q)\] is the square of the bias, as the noise of
    /// all four is independent (but for that of the weights, which makes a bias of 0 one of 2.4 times the square of the reference's noise), and E\[(a - b)^2\] is twice the variance of one half. A reference without halves of its own
    /// (`half_difference` of 0) has its noise counted as bias.
    ///
    /// # Errors
    /// When the sizes differ.
    pub fn of(reference: &Accumulated, picture: &Accumulated, halves: Halves) -> Result<Self> {
        same_size(reference.extent, picture.extent)?;
        let width = picture.extent[0] as usize;
        let columns = width.div_ceil(BLOCK);
        // Neighbours err together where light was filtered: the spread is that of blocks.
        let mut blocks = vec![0.0; columns * (picture.extent[1] as usize).div_ceil(BLOCK)];
        let (mut noise, mut total) = (0.0, 0.0);
        for (at, ((x, d), (r, e))) in pixels(picture).zip(pixels(reference)).enumerate() {
            let terms = |i: usize| {
                let (x, d, r, e) = (f64::from(x[i]), f64::from(d[i]), f64::from(r[i]), f64::from(e[i]));
                let weight = relative(r) / 3.0;
                let variance = if halves == Halves::Streams { d * d } else { 2.0 * d * d };
                let product = (x + d - r) * (x - d - r);
                [
                    (product + variance - e * e) * weight,
                    variance * weight,
                    (x + d - r - e) * (x - d - r + e) * weight,
                ]
            };
            let [t, n, b] = [terms(0), terms(1), terms(2)]
                .into_iter()
                .filter(|terms| terms.iter().all(|term| term.is_finite()))
                .fold([0.0; 3], |sum, terms| [0, 1, 2].map(|i| sum[i] + terms[i]));
            total += t;
            noise += n;
            if let Some(block) = blocks.get_mut(at / width / BLOCK * columns + at % width / BLOCK) {
                *block += b;
            }
        }
        Ok(Self::of_sums(total, noise, &blocks, picture.mean.len() as f64))
    }

    /// Of the sums of the pixels' terms, those of the bias by blocks.
    pub(super) fn of_sums(total: f64, noise: f64, blocks: &[f64], count: f64) -> Self {
        let bias = blocks.iter().sum::<f64>() / count;
        let mean = bias * count / blocks.len() as f64;
        let squares = blocks.iter().map(|block| (block - mean).powi(2)).sum::<f64>();
        let width = STANDARD_ERRORS * squares.sqrt() / count;
        let root = |rel_mse: f64| rel_mse.max(0.0).sqrt();
        let bias = Estimate { value: root(bias), low: root(bias - width), high: root(bias + width) };
        Self { total: root(total / count), noise: root(noise / count), bias }
    }
}

impl Accumulated {
    /// Two pictures that differ in their random numbers alone as the halves of one ([`Halves::Runs`]).
    pub fn of_runs(extent: [u32; 2], [a, b]: [&[[f32; 3]]; 2]) -> Self {
        let of = |combine: fn(f32, f32) -> f32| {
            a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|i| combine(a[i], b[i]))).collect()
        };
        Self { extent, samples: 2, mean: of(|a, b| (a + b) * 0.5), half_difference: of(|a, b| (a - b) * 0.5) }
    }
}

/// The mean of every pixel, and half of the difference of its halves.
fn pixels(image: &Accumulated) -> impl Iterator<Item = (&[f32; 3], &[f32; 3])> {
    image.mean.iter().zip(&image.half_difference)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    /// Values of a half of a picture, from -1 to 1, of variance 1/3.
    fn noise(half: u64, at: u64) -> f32 {
        let mut x = (half << 32 | at).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ x >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((x ^ x >> 29) >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    /// 160 x 120 pixels around `value`, the noise of each half times `amount`.
    fn picture(value: f32, amount: f32, seed: u64) -> Accumulated {
        let half = |half, at| noise(seed * 2 + half, at) * amount;
        let both = |at: u64| [0, 1, 2].map(|c| (half(0, at * 3 + c), half(1, at * 3 + c)));
        let count = 160 * 120;
        Accumulated {
            extent: [160, 120],
            samples: 2,
            mean: (0..count).map(|at| both(at).map(|(a, b)| value + (a + b) / 2.0)).collect(),
            half_difference: (0..count).map(|at| both(at).map(|(a, b)| (a - b) / 2.0)).collect(),
        }
    }

    #[test]
    fn noise_and_bias_are_told_apart() {
        let reference = picture(1.0, 0.05, 7);
        let variance = 0.3_f64.powi(2) / 3.0;
        for (halves, share) in [(Halves::Streams, 0.5), (Halves::Runs, 1.0)] {
            for shift in [0.0, 0.05] {
                let found = Split::of(&reference, &picture(1.0 + shift, 0.3, 3), halves).unwrap();
                let (noise, bias) = ((variance * share).sqrt(), f64::from(shift));
                assert!((found.noise / noise - 1.0).abs() < 0.05, "{halves:?} {shift} {found:?}");
                assert!(
                    found.bias.low <= bias * 1.05 && bias <= found.bias.high,
                    "{halves:?} {shift} {found:?}"
                );
                assert!(found.bias.high < bias + 0.03, "{halves:?} {shift} {found:?}");
                assert!(shift == 0.0 || found.bias.low > 0.03, "{halves:?} {shift} {found:?}");
                let parts = found.noise.powi(2) + found.bias.value.powi(2);
                assert!((found.total.powi(2) / parts - 1.0).abs() < 0.05, "{halves:?} {shift} {found:?}");
            }
        }
        let small = Accumulated { extent: [1, 1], ..picture(1.0, 0.0, 1) };
        assert!(Split::of(&reference, &small, Halves::Streams).is_err());
    }
}
