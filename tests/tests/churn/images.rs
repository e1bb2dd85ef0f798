//! Images of two ways to the same scene. Enters: the parts of a sample set. Leaves: whether they are the same to the bit,
//! or within their noise, which is judged by how the parts differ: so rare bright samples are in their own error. (The half
//! difference of the streams would be too small at edges when there are few samples: both are jittered along one sequence.)

use caustica_renderer::Accumulated;

/// Parts that an image is rendered in, two samples each: one a stream.
pub const PARTS: u64 = 16;
/// Samples of a part.
pub const PART_SAMPLES: u64 = 2;

/// A channel of a pixel may be off by so many standard errors. By chance Student's t with 30 degrees of freedom (16 parts of
/// two images) passes 8 once in 1.6e8 values; an image of 64 x 48 has 9216, so that one in 17,000 fails. Seeds are fixed: a
/// test that passes once passes always.
const MOST_DEVIATIONS: f64 = 8.0;
/// The mean over all pixels may be off by so many: one channel in 150,000 by chance.
const MOST_DEVIATIONS_OF_MEAN: f64 = 4.5;
/// Below this share of the value the difference is rounding.
const ROUNDING: f64 = 1e-5;

/// An image as the parts of its sample set.
pub struct Image(pub Vec<Accumulated>);

impl Image {
    /// A channel of a pixel: its mean, and the variance of the mean.
    fn value(&self, pixel: usize, channel: usize) -> (f64, f64) {
        let count = self.0.len() as f64;
        let mean: f64 = self.0.iter().map(|part| f64::from(part.mean[pixel][channel])).sum();
        let mean = mean / count;
        let squares = self.0.iter().map(|part| (f64::from(part.mean[pixel][channel]) - mean).powi(2));
        (mean, squares.sum::<f64>() / (count * (count - 1.0)))
    }

    fn pixels(&self) -> usize {
        self.0.first().map_or(0, |part| part.mean.len())
    }

    /// Standard deviation of the green channel over the image.
    pub fn spread(&self) -> f64 {
        let count = self.pixels() as f64;
        let green: Vec<f64> = (0..self.pixels()).map(|pixel| self.value(pixel, 1).0).collect();
        let mean = green.iter().sum::<f64>() / count;
        (green.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
    }
}

/// Number of pixels that are not the same to the bit in every part.
pub fn differing(a: &Image, b: &Image) -> usize {
    let same = |pixel: usize| {
        let bits = |part: &Accumulated| part.mean[pixel].map(f32::to_bits);
        a.0.iter().zip(&b.0).all(|(p, q)| bits(p) == bits(q))
    };
    (0..a.pixels()).filter(|pixel| !same(*pixel)).count()
}

/// How far two images are apart, in standard errors.
#[derive(Debug)]
pub struct Distance {
    /// The channel of a pixel that is worst.
    pub largest: f64,
    /// The mean over all pixels of the channel that is worst.
    pub of_mean: f64,
}

impl Distance {
    /// Whether noise alone explains it.
    pub fn is_noise(&self) -> bool {
        self.largest < MOST_DEVIATIONS && self.of_mean < MOST_DEVIATIONS_OF_MEAN
    }
}

/// Compares two images of independent random numbers. Where they share some the error is smaller than this says.
pub fn distance(a: &Image, b: &Image) -> Distance {
    let mut distance = Distance { largest: 0.0, of_mean: 0.0 };
    for channel in 0..3 {
        let (mut sum, mut variance) = (0.0, 0.0);
        for pixel in 0..a.pixels() {
            let ((p, p_variance), (q, q_variance)) = (a.value(pixel, channel), b.value(pixel, channel));
            let error = (p_variance + q_variance).sqrt() + ROUNDING * (p.abs() + q.abs()) + 1e-9;
            distance.largest = distance.largest.max((p - q).abs() / error);
            sum += p - q;
            variance += p_variance + q_variance;
        }
        distance.of_mean = distance.of_mean.max(sum.abs() / (variance.sqrt() + 1e-9));
    }
    distance
}
