//! How far a picture is from a reference, on the host: the oracle for what the device measures live, and what `caustica report` says.
//! In: two pictures of one size, linear radiance. Out: numbers. What is not finite counts as black, and is counted.

use serde::Serialize;

use crate::error::{RendererError, Result};

/// Keeps the relative error of dark pixels finite: relMSE = mean((x - r)^2 / (r^2 + this)).
pub const RELATIVE_EPSILON: f64 = 0.01;
/// Share of the pixels, those with the largest error, that the trimmed forms leave out.
const TRIMMED_SHARE: f64 = 0.001;
/// Side of the blocks whose means are compared: what is left there is mostly bias, pixels.
pub(super) const BLOCK: usize = 8;
/// Luminance of linear Rec.709.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Linear Rec.709 radiance, row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Radiance<'a> {
    extent: [u32; 2],
    pixels: &'a [[f32; 3]],
}

impl<'a> Radiance<'a> {
    /// Width and height in pixels, and the pixels.
    ///
    /// # Errors
    /// When there are not `width * height` of them, or none.
    pub fn new(extent: [u32; 2], pixels: &'a [[f32; 3]]) -> Result<Self> {
        let expected = extent[0] as usize * extent[1] as usize;
        match pixels.len() == expected && expected > 0 {
            true => Ok(Self { extent, pixels }),
            false => Err(RendererError::Picture(format!(
                "{} pixels are no picture of {} x {}",
                pixels.len(),
                extent[0],
                extent[1]
            ))),
        }
    }

    /// Width and height, pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// The pixels.
    pub fn pixels(&self) -> &'a [[f32; 3]] {
        self.pixels
    }

    /// Means of blocks of 8 x 8 pixels; what is over at the right and below is left out.
    fn blocks(&self) -> Vec<[f64; 3]> {
        let [width, height] = self.extent.map(|side| side as usize);
        let mut blocks = Vec::with_capacity((width / BLOCK) * (height / BLOCK));
        for y in (0..height / BLOCK * BLOCK).step_by(BLOCK) {
            for x in (0..width / BLOCK * BLOCK).step_by(BLOCK) {
                let rows = (y..y + BLOCK).flat_map(|row| self.pixels[row * width + x..][..BLOCK].iter());
                let sum = rows.fold([0.0; 3], |sum, pixel| add(sum, finite(*pixel)));
                blocks.push(sum.map(|channel| channel / (BLOCK * BLOCK) as f64));
            }
        }
        blocks
    }
}

/// The error of a picture against a reference, without regard to how it is seen ([`crate::flip_ldr`] for that).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorMetrics {
    /// Root of the mean squared difference, radiance.
    pub rmse: f64,
    /// The same without the 0.1 % of pixels with the largest error.
    pub rmse_trimmed: f64,
    /// mean((x - r)^2 / (r^2 + 0.01)) over pixels and channels.
    pub rel_mse: f64,
    /// The same without the 0.1 % of pixels with the largest error.
    pub rel_mse_trimmed: f64,
    /// relMSE of the means of blocks of 8 x 8 pixels: mostly bias; NaN where the picture is smaller than a block.
    pub block_rel_mse: f64,
    /// Mean luminance by that of the reference.
    pub luminance_ratio: f64,
    /// The same by channel.
    pub channel_ratios: [f64; 3],
    /// Pixels with a channel that is not finite.
    pub non_finite: u64,
}

impl ErrorMetrics {
    /// Compares a picture with a reference.
    ///
    /// # Errors
    /// When their sizes differ.
    pub fn of(reference: &Radiance<'_>, picture: &Radiance<'_>) -> Result<Self> {
        same_size(reference.extent, picture.extent)?;
        let pairs = || reference.pixels.iter().zip(picture.pixels).map(|(r, x)| (finite(*r), finite(*x)));
        let [rmse, rmse_trimmed] = means(pairs().map(|(r, x)| squared(r, x, |_| 1.0))).map(f64::sqrt);
        let [rel_mse, rel_mse_trimmed] = means(pairs().map(|(r, x)| squared(r, x, relative)));
        let blocks: Vec<f64> = reference
            .blocks()
            .into_iter()
            .zip(picture.blocks())
            .map(|(r, x)| squared(r, x, relative))
            .collect();
        let [expected, found] = [reference, picture]
            .map(|image| image.pixels.iter().fold([0.0; 3], |sum, pixel| add(sum, finite(*pixel))));
        Ok(Self {
            rmse,
            rmse_trimmed,
            rel_mse,
            rel_mse_trimmed,
            block_rel_mse: blocks.iter().sum::<f64>() / blocks.len() as f64,
            luminance_ratio: luminance(found) / luminance(expected),
            channel_ratios: [0, 1, 2].map(|channel| found[channel] / expected[channel]),
            non_finite: picture.pixels.iter().filter(|pixel| !pixel.iter().all(|c| c.is_finite())).count()
                as u64,
        })
    }
}

/// The relative error of every pixel, sqrt(mean over channels of (x - r)^2 / (r^2 + 0.01)), for a map.
///
/// # Errors
/// When the sizes differ.
pub fn relative_error_map(reference: &Radiance<'_>, picture: &Radiance<'_>) -> Result<Vec<f32>> {
    same_size(reference.extent, picture.extent)?;
    let pairs = reference.pixels.iter().zip(picture.pixels);
    Ok(pairs.map(|(r, x)| squared(finite(*r), finite(*x), relative).sqrt() as f32).collect())
}

pub(super) fn same_size(reference: [u32; 2], picture: [u32; 2]) -> Result<()> {
    match reference == picture {
        true => Ok(()),
        false => {
            let ([rw, rh], [w, h]) = (reference, picture);
            Err(RendererError::Picture(format!("the picture is {w} x {h}, the reference {rw} x {rh}")))
        }
    }
}

pub(super) fn luminance(rgb: [f64; 3]) -> f64 {
    rgb.iter().zip(LUMINANCE).map(|(channel, weight)| channel * weight).sum()
}

/// Weight of a squared difference where the reference is `r`.
pub(super) fn relative(r: f64) -> f64 {
    (r * r + RELATIVE_EPSILON).recip()
}

/// Mean over the channels of the weighted squared difference.
fn squared(reference: [f64; 3], picture: [f64; 3], weight: impl Fn(f64) -> f64) -> f64 {
    let terms = reference.iter().zip(picture).map(|(&r, x)| (x - r) * (x - r) * weight(r));
    terms.sum::<f64>() / 3.0
}

/// The mean, and that of all but the largest.
fn means(errors: impl Iterator<Item = f64>) -> [f64; 2] {
    let mut errors: Vec<f64> = errors.collect();
    let all = errors.iter().sum::<f64>() / errors.len() as f64;
    errors.sort_unstable_by(f64::total_cmp);
    let kept = kept_of(errors.len());
    let trimmed = errors.iter().take(kept).sum::<f64>() / kept as f64;
    [all, trimmed]
}

/// Pixels of so many that a trimmed form keeps.
pub(super) fn kept_of(pixels: usize) -> usize {
    ((pixels as f64 * (1.0 - TRIMMED_SHARE)).round_ties_even() as usize).max(1)
}

fn finite(pixel: [f32; 3]) -> [f64; 3] {
    pixel.map(|channel| if channel.is_finite() { f64::from(channel) } else { 0.0 })
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    #[test]
    fn a_known_difference_has_known_errors() {
        let reference = vec![[1.0, 2.0, 0.0]; 2000];
        let mut picture = reference.clone();
        // Two pixels in 2000 are the 0.1 % that the trimmed forms leave out.
        picture[7] = [4.0, 2.0, 0.0];
        picture[9] = [1.0, f32::NAN, 0.0];
        let [reference, picture] =
            [&reference, &picture].map(|pixels| Radiance::new([50, 40], pixels).unwrap());
        let found = ErrorMetrics::of(&reference, &picture).unwrap();
        assert!((found.rmse - ((9.0 + 4.0) / 6000.0_f64).sqrt()).abs() < 1e-12, "{found:?}");
        let rel_mse = (9.0 / 1.01 + 4.0 / 4.01) / 6000.0;
        assert!((found.rel_mse - rel_mse).abs() < 1e-12, "{found:?}");
        assert_eq!((found.rmse_trimmed, found.rel_mse_trimmed, found.non_finite), (0.0, 0.0, 1));
        // Both lie in the second block of the first row, of 6 x 5.
        let block = ((3.0_f64 / 64.0).powi(2) / 1.01 / 3.0, (2.0_f64 / 64.0).powi(2) / 4.01 / 3.0);
        let expected = (block.0 + block.1) / 30.0;
        assert!((found.block_rel_mse - expected).abs() < 1e-12, "{found:?} {expected}");
        assert!((found.channel_ratios[0] - 2003.0 / 2000.0).abs() < 1e-12);
        assert_eq!(found.channel_ratios[1], 3998.0 / 4000.0);
        assert!(Radiance::new([3, 3], &[[0.0; 3]; 8]).is_err());
        let other = Radiance::new([1, 1], &[[0.0; 3]]).unwrap();
        assert!(ErrorMetrics::of(&reference, &other).unwrap_err().to_string().contains("1 x 1"));
    }
}
