//! FLIP: the difference between two pictures as somebody sees it who flips between them. In: linear radiance.
//! Out: the mean difference from 0 to 1, and a map. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images"
//! (HPG 2020), and "Visualizing Errors in Rendered High Dynamic Range Images" (Eurographics short papers 2021).

use rayon::prelude::*;

use super::error::{self, Radiance, same_size};
use crate::error::Result;

mod color;
mod filter;

use color::{lab_of_hunt, opponent_of, rgb_of_opponent};
use filter::{Kernel, convolve};

/// Pixels in a degree of the field of view: 0.7 m in front of a screen of 3840 pixels and 0.7 m.
const PIXELS_PER_DEGREE: f32 = 67.020_64;
/// Exponent of the colour difference.
const COLOR_EXPONENT: f32 = 0.7;
/// A colour difference of this share of the largest is seen as [`PERCEIVED_AT_KNEE`].
const KNEE: f32 = 0.4;
const PERCEIVED_AT_KNEE: f32 = 0.95;
/// Exponent of the difference of edges and points.
const FEATURE_EXPONENT: f32 = 0.5;
/// Of the tone curve whose result is that of the brightest exposure (ACES, as fitted by Narkowicz, with its usual pre-exposure of 0.6):
/// (c0 x^2 + c1 x + c2) / (c3 x^2 + c4 x + c5).
const ACES: [f32; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// Value of the tone curve at which the brightest and the median pixel stand in the first and in the last exposure.
const BRIGHT: f32 = 0.85;

/// What is seen of a difference.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean of the map.
    pub mean: f64,
    /// From 0, none, to 1, the largest, for every pixel.
    pub map: Vec<f32>,
}

impl Flip {
    fn of_map(map: Vec<f32>) -> Self {
        let sum: f64 = map.iter().map(|value| f64::from(*value)).sum();
        Self { mean: sum / map.len() as f64, map }
    }
}

/// FLIP of the pictures as a screen shows them: times `exposure`, clipped to 0 to 1.
///
/// # Errors
/// When their sizes differ.
pub fn flip_ldr(reference: &Radiance<'_>, picture: &Radiance<'_>, exposure: f32) -> Result<Flip> {
    same_size(reference.extent(), picture.extent())?;
    let shown = |image: &Radiance<'_>| -> Vec<[f32; 3]> {
        image.pixels().iter().map(|pixel| pixel.map(|c| shown(c * exposure))).collect()
    };
    Ok(Flip::of_map(difference(reference.extent(), &shown(reference), &shown(picture))))
}

/// HDR-FLIP: the largest of FLIP over exposures, from the one that shows the brightest pixel of the reference to the one that
/// shows its median pixel. `None` where more than half of the reference is black: it has no median exposure.
///
/// # Errors
/// When their sizes differ.
pub fn flip_hdr(reference: &Radiance<'_>, picture: &Radiance<'_>) -> Result<Option<Flip>> {
    same_size(reference.extent(), picture.extent())?;
    let Some((start, stop)) = exposures(reference) else { return Ok(None) };
    let count = (stop - start).ceil().max(2.0);
    let of_exposure = |step: u32| {
        let exposure = (start + (stop - start) * step as f32 / (count - 1.0)).exp2();
        let toned = |image: &Radiance<'_>| -> Vec<[f32; 3]> {
            image.pixels().iter().map(|pixel| pixel.map(|c| shown(tone(c.max(0.0) * exposure)))).collect()
        };
        difference(reference.extent(), &toned(reference), &toned(picture))
    };
    let largest = |mut most: Vec<f32>, other: Vec<f32>| {
        most.iter_mut().zip(other).for_each(|(most, value)| *most = most.max(value));
        most
    };
    let nothing = || vec![0.0; reference.pixels().len()];
    let map = (0..count as u32).into_par_iter().map(of_exposure).reduce(nothing, largest);
    Ok(Some(Flip::of_map(map)))
}

/// What is not finite is black, as elsewhere.
fn shown(value: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 }
}

fn tone(x: f32) -> f32 {
    let [c0, c1, c2, c3, c4, c5] = ACES;
    (c0 * x * x + c1 * x + c2) / (c3 * x * x + c4 * x + c5)
}

/// Base-2 logarithms of the first and the last exposure.
fn exposures(reference: &Radiance<'_>) -> Option<(f32, f32)> {
    let luminance = |pixel: &[f32; 3]| -> f32 {
        let sum = error::luminance(pixel.map(f64::from));
        if sum.is_finite() { sum.max(0.0) as f32 } else { 0.0 }
    };
    let mut values: Vec<f32> = reference.pixels().iter().map(luminance).collect();
    values.sort_unstable_by(f32::total_cmp);
    let (most, middle) = (*values.last()?, values.len() / 2);
    let median = match values.len() % 2 {
        1 => *values.get(middle)?,
        _ => (values.get(middle.checked_sub(1)?)? + values.get(middle)?) * 0.5,
    };
    // Where the tone curve has the value BRIGHT.
    let [a, b, c] = [0, 1, 2].map(|i| ACES[i] - BRIGHT * ACES[i + 3]);
    let bright = (-b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let bright = bright.max((-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a));
    (median > 0.0).then(|| ((bright / most).log2(), (bright / median).log2()))
}

/// The map of LDR-FLIP of two pictures in linear 0 to 1.
fn difference(extent: [u32; 2], reference: &[[f32; 3]], picture: &[[f32; 3]]) -> Vec<f32> {
    let [reference, picture] = [reference, picture].map(|image| Seen::new(extent, image));
    let largest = largest_color_difference();
    let knee = KNEE * largest;
    let colors = reference.colors.iter().zip(&picture.colors).map(|(r, x)| {
        let difference = hyab(*r, *x).powf(COLOR_EXPONENT);
        match difference < knee {
            true => difference * PERCEIVED_AT_KNEE / knee,
            false => PERCEIVED_AT_KNEE + (difference - knee) / (largest - knee) * (1.0 - PERCEIVED_AT_KNEE),
        }
    });
    let features = reference.features.iter().zip(&picture.features).map(|(r, x)| {
        let most = (r[0] - x[0]).abs().max((r[1] - x[1]).abs());
        (most * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT)
    });
    colors.zip(features).map(|(color, feature)| color.powf(1.0 - feature)).collect()
}

/// A picture as it is seen.
struct Seen {
    /// L*a*b* after the eye's filter, adapted as Hunt found it.
    colors: Vec<[f32; 3]>,
    /// Strength of edges and of points.
    features: Vec<[f32; 2]>,
}

impl Seen {
    fn new(extent: [u32; 2], image: &[[f32; 3]]) -> Self {
        let opponent: Vec<[f32; 3]> = image.iter().map(|rgb| opponent_of(*rgb)).collect();
        let plane = |channel: usize| -> Vec<f32> { opponent.iter().map(|pixel| pixel[channel]).collect() };
        let blurred = [0, 1, 2].map(|channel| {
            let plane = plane(channel);
            let mut sum = vec![0.0; plane.len()];
            for (weight, kernel) in filter::contrast_sensitivity(channel, PIXELS_PER_DEGREE) {
                let part = convolve(extent, &plane, &kernel, &kernel);
                sum.iter_mut().zip(part).for_each(|(sum, value)| *sum += weight * value);
            }
            sum
        });
        let colors = (0..image.len()).map(|at| {
            let rgb = rgb_of_opponent([0, 1, 2].map(|channel| blurred[channel][at]));
            lab_of_hunt(rgb.map(|c| c.clamp(0.0, 1.0)))
        });
        let colors = colors.collect();
        let gray: Vec<f32> = opponent.iter().map(|pixel| (pixel[0] + 16.0) / 116.0).collect();
        let (smooth, edge, point) = filter::features(PIXELS_PER_DEGREE);
        let strength = |kernel: &Kernel| -> Vec<f32> {
            let across = convolve(extent, &gray, kernel, &smooth);
            let down = convolve(extent, &gray, &smooth, kernel);
            across.iter().zip(down).map(|(x, y)| x.hypot(y)).collect()
        };
        let features = strength(&edge).into_iter().zip(strength(&point)).map(|(edge, point)| [edge, point]);
        Self { colors, features: features.collect() }
    }
}

/// The distance of two colours (Abasi et al. 2020): in lightness, and in the plane of colours.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Between green and blue, which no two colours of a screen exceed.
fn largest_color_difference() -> f32 {
    hyab(lab_of_hunt([0.0, 1.0, 0.0]), lab_of_hunt([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    const EXTENT: [u32; 2] = [96, 64];

    /// Slopes and a checker of bright and dark, and the same with noise.
    fn pictures() -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let mut state = 1_u64;
        let mut unit = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let places = (0..EXTENT[1]).flat_map(|y| (0..EXTENT[0]).map(move |x| (x, y)));
        places
            .map(|(x, y)| {
                let checker = if (x / 8 + y / 8) % 2 == 1 { 4.0 } else { 0.1 };
                let [width, height] = EXTENT.map(f64::from);
                let pixel = [0.05 + f64::from(x) / width, 0.02 + f64::from(y) / height, checker];
                let factor = (0.7 + 0.6 * unit()) as f32;
                let pixel = pixel.map(|value| value as f32);
                (pixel, pixel.map(|value| value * factor))
            })
            .unzip()
    }

    /// The figures are of `../shared/tools/compare_images.py` (flip_evaluator 1.7) for the same pictures.
    #[test]
    fn it_says_what_the_authors_say() {
        let (reference, picture) = pictures();
        let [reference, picture] =
            [&reference, &picture].map(|pixels| Radiance::new(EXTENT, pixels).unwrap());
        let ldr = flip_ldr(&reference, &picture, 1.0).unwrap();
        assert!((ldr.mean - 0.127_520).abs() < 2e-5, "{}", ldr.mean);
        let hdr = flip_hdr(&reference, &picture).unwrap().unwrap();
        assert!((hdr.mean - 0.076_978).abs() < 2e-5, "{}", hdr.mean);
        assert_eq!(flip_ldr(&reference, &reference, 1.0).unwrap().mean, 0.0);
        assert!(ldr.map.iter().all(|value| (0.0..=1.0).contains(value)));
    }

    #[test]
    fn black_has_no_exposure_and_what_is_not_finite_is_black() {
        let black = vec![[0.0; 3]; 6144];
        let broken = vec![[f32::NAN, f32::INFINITY, -1.0]; 6144];
        let [black, broken] = [&black, &broken].map(|pixels| Radiance::new(EXTENT, pixels).unwrap());
        assert_eq!(flip_hdr(&black, &broken).unwrap(), None);
        assert_eq!(flip_ldr(&black, &broken, 1.0).unwrap().mean, 0.0);
    }
}
