//! How noisy a picture is, told by itself: its samples are two independent streams, whose difference has the variance of their mean.
//! In: the two streams. Out: the error that samples would still take away, with an interval. It knows nothing of bias.

use serde::Serialize;

use super::error::RELATIVE_EPSILON;
use crate::renderer::Accumulated;

/// Standard errors in an interval that holds 95 of 100.
pub(super) const STANDARD_ERRORS: f64 = 1.96;
/// Part of the relative noise that the estimate may be off by, as noise that is not symmetrical hides in the brightness that it is
/// measured by. It falls as fast as the noise itself (`tests/tests/noise.rs`).
const SKEW: f64 = 0.5;

/// Where one stream alone has seen what is bright, the product of both says that the pixel is black; its square is taken for at least this part of
/// the square of the mean.
const LEAST_SQUARE: f64 = 0.25;

/// A number with the interval that holds the true one in 95 of 100 cases.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The most likely one.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Estimate {
    fn map(self, to: impl Fn(f64) -> f64) -> Self {
        let (a, b) = (to(self.low), to(self.high));
        Self { value: to(self.value), low: a.min(b), high: a.max(b) }
    }
}

/// The noise of a picture: sqrt(relMSE) of it against what more and more samples lead to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise(Estimate);

impl Noise {
    /// The noise of what was accumulated; `None` where a stream has no sample, or nothing of the picture is finite.
    ///
    /// relMSE is the mean over pixels and channels of d^2 / (a b + 0.01): a and b are the means of the streams and d half of their
    /// difference. E\[d^2\] is the variance of (a + b) / 2, E\[a b\] the square of the true value. The error of the picture
    /// itself has the same distribution as d, so that the interval is for the ratio of two such means.
    pub fn of(image: &Accumulated) -> Option<Self> {
        if image.samples < 2 {
            return None;
        }
        let pixels = image.mean.iter().zip(&image.half_difference).map(|(mean, half)| {
            let terms = mean.iter().zip(half).map(|(mean, half)| {
                let (mean, half) = (f64::from(*mean), f64::from(*half));
                let product = (mean + half) * (mean - half);
                half * half / (product.max(mean * mean * LEAST_SQUARE) + RELATIVE_EPSILON)
            });
            terms.sum::<f64>() / 3.0
        });
        let (sum, squares) = pixels.fold((0.0, 0.0), |(sum, squares), one| (sum + one, squares + one * one));
        Self::of_sums(sum, squares, image.mean.len() as f64)
    }

    /// Of the sum of the pixels' terms of relMSE, and that of their squares.
    pub(super) fn of_sums(sum: f64, squares: f64, pixels: f64) -> Option<Self> {
        let rel_mse = sum / pixels;
        if !rel_mse.is_finite() {
            return None;
        }
        if rel_mse == 0.0 {
            return Some(Self(Estimate { value: 0.0, low: 0.0, high: 0.0 }));
        }
        // The variance of each pixel's square is at most its own square in the mean; that of a ratio is twice that.
        let variance = 2.0 * squares / (sum * sum);
        let width = (STANDARD_ERRORS * STANDARD_ERRORS * variance + SKEW * SKEW * rel_mse).sqrt();
        let of_rel_mse =
            Estimate { value: rel_mse, low: rel_mse * (-width).exp(), high: rel_mse * width.exp() };
        Some(Self(of_rel_mse.map(f64::sqrt)))
    }

    /// sqrt(relMSE): 0.01 is 1 %.
    pub fn error(&self) -> Estimate {
        self.0
    }

    /// 1 / (relMSE x seconds): how much a second buys.
    pub fn efficiency(&self, seconds: f64) -> Estimate {
        self.0.map(|error| (error * error * seconds).recip())
    }

    /// How many more seconds it takes to reach an error, as relMSE falls with the samples; 0 where it is reached.
    pub fn seconds_to(&self, target: f64, seconds: f64) -> Estimate {
        self.0.map(|error| (seconds * ((error / target).powi(2) - 1.0)).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    fn picture(half: f32, samples: u64) -> Accumulated {
        let count = 100;
        Accumulated {
            extent: [10, 10],
            samples,
            mean: vec![[1.0; 3]; count],
            half_difference: vec![[half; 3]; count],
        }
    }

    #[test]
    fn noise_is_told_by_the_difference_of_the_streams() {
        let noise = Noise::of(&picture(0.1, 64)).unwrap();
        let error = noise.error();
        assert!((error.value - 0.1 / (0.99_f64 + 0.01).sqrt()).abs() < 1e-7, "{error:?}");
        assert!(error.low < error.value && error.value < error.high);
        let seconds = noise.seconds_to(0.05, 10.0);
        assert!(
            (seconds.value - 30.0).abs() < 1e-4 && seconds.low < 30.0 && seconds.high > 30.0,
            "{seconds:?}"
        );
        assert_eq!(noise.seconds_to(1.0, 10.0).high, 0.0);
        assert!((noise.efficiency(10.0).value - 10.0).abs() < 1e-4);
        assert_eq!(Noise::of(&picture(0.0, 64)).unwrap().error().high, 0.0);
        assert_eq!(Noise::of(&picture(0.1, 1)), None);
    }
}
