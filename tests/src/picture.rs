//! Pictures: comparison with a tolerance, golden images on disk. A picture that fails is written beside the expected
//! one, with their difference, into `target/test-pictures/`.

use caustica_renderer::Accumulated;
use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};

use crate::repository;

/// How far a picture may be from the expected one.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Largest difference of a channel, steps of 255, that counts as equal.
    pub steps: u8,
    /// Share of the pixels that may differ by more.
    pub outliers: f64,
}

/// Folder for pictures that failed.
pub fn failure_folder() -> PathBuf {
    let executable = std::env::current_exe().unwrap_or_default();
    executable.ancestors().nth(3).unwrap_or_else(|| Path::new(".")).join("test-pictures")
}

/// Encodes linear values 0..1 as sRGB bytes, as the PNG writer does.
pub fn srgb_byte(linear: f32) -> u8 {
    let x = f64::from(linear).clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

/// A picture of linear pixels.
///
/// # Panics
/// When there are fewer pixels than `extent` says.
pub fn encode(extent: [u32; 2], pixels: &[[f32; 4]]) -> RgbImage {
    RgbImage::from_fn(extent[0], extent[1], |x, y| {
        let [r, g, b, _] = pixels[(y * extent[0] + x) as usize];
        Rgb([r, g, b].map(srgb_byte))
    })
}

/// Share of the pixels in which a channel differs by more than `steps`, and the largest difference.
pub fn difference(a: &RgbImage, b: &RgbImage, steps: u8) -> (f64, u8) {
    let (mut outliers, mut largest) = (0_usize, 0);
    for (p, q) in a.pixels().zip(b.pixels()) {
        let distance = (0..3).map(|i| p.0[i].abs_diff(q.0[i])).max().unwrap_or(0);
        outliers += usize::from(distance > steps);
        largest = largest.max(distance);
    }
    (outliers as f64 / (a.width() * a.height()).max(1) as f64, largest)
}

/// A picture to be compared to the bit.
pub fn bits(image: &Accumulated) -> Vec<[u32; 3]> {
    image.mean.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

/// Pixels of which a channel differs by more than a share of its value.
pub fn differing(a: &Accumulated, b: &Accumulated, share: f32) -> usize {
    let far = |p: &[f32; 3], q: &[f32; 3]| {
        p.iter().zip(q).any(|(x, y)| (x - y).abs() > share * (x.abs() + y.abs() + 0.01))
    };
    a.mean.iter().zip(&b.mean).filter(|(p, q)| far(p, q)).count()
}

/// Mean of all channels of all pixels.
pub fn mean_of(image: &Accumulated) -> f32 {
    image.mean.iter().flatten().sum::<f32>() / (3.0 * image.mean.len() as f32)
}

/// Mean of (x - r)^2 / (r^2 + 0.01) over all channels (ARCHITECTURE, decision 7).
pub fn rel_mse(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let terms = image.iter().flatten().zip(reference.iter().flatten()).map(|(x, r)| {
        let (x, r) = (f64::from(*x), f64::from(*r));
        (x - r) * (x - r) / (r * r + 0.01)
    });
    terms.sum::<f64>() / (image.len() * 3) as f64
}

/// The largest difference of a channel.
pub fn largest_difference(a: &Accumulated, b: &Accumulated) -> f32 {
    a.mean.iter().flatten().zip(b.mean.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
}

/// Compares a picture with `tests/golden/NAME.png`; with `CAUSTICA_BLESS` set it becomes the golden one.
///
/// # Panics
/// When it differs by more than `tolerance`, or there is no golden picture.
pub fn assert_golden(name: &str, picture: &RgbImage, tolerance: Tolerance) {
    let path = repository().join("tests/golden").join(format!("{name}.png"));
    if std::env::var_os("CAUSTICA_BLESS").is_some() {
        save(&path, picture);
        return;
    }
    let expected = match image::open(&path) {
        Ok(image) => image.to_rgb8(),
        Err(error) => panic!("{}: {error}; CAUSTICA_BLESS=1 makes it from this run", path.display()),
    };
    assert_close(name, picture, &expected, tolerance);
}

/// Compares two pictures.
///
/// # Panics
/// When they differ by more than `tolerance`.
pub fn assert_close(name: &str, picture: &RgbImage, expected: &RgbImage, tolerance: Tolerance) {
    assert_eq!(picture.dimensions(), expected.dimensions(), "{name}: size");
    let (outliers, largest) = difference(picture, expected, tolerance.steps);
    if outliers <= tolerance.outliers {
        return;
    }
    let folder = failure_folder();
    let contrast = RgbImage::from_fn(picture.width(), picture.height(), |x, y| {
        let (p, q) = (picture.get_pixel(x, y), expected.get_pixel(x, y));
        Rgb([0, 1, 2].map(|i| p.0[i].abs_diff(q.0[i]).saturating_mul(8)))
    });
    for (kind, image) in [("actual", picture), ("expected", expected), ("difference x8", &contrast)] {
        save(&folder.join(format!("{name} {kind}.png")), image);
    }
    panic!(
        "{name}: {:.2} % of the pixels differ by more than {} steps (allowed {:.2} %), at most by {largest}; see {}",
        outliers * 100.0,
        tolerance.steps,
        tolerance.outliers * 100.0,
        folder.display()
    );
}

fn save(path: &Path, picture: &RgbImage) {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).expect("a folder for pictures");
    }
    picture.save(path).expect("a PNG on disk");
}
