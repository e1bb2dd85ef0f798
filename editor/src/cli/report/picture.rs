//! The images of a report: pictures as FLIP sees them, and maps of their errors. Enters: radiance. Leaves: PNGs.

use std::io::Cursor;

use anyhow::Context;
use caustica_renderer::{Accumulated, Radiance, flip_ldr, relative_error_map};
use rayon::prelude::*;

use super::run::Measured;
use super::{Report, Row};
use crate::cli::output::srgb_byte;

/// Decades of the relative error that a map shows, up to 100 %.
const DECADES: f32 = 3.0;
/// Colour map "magma" (van der Walt and Smith, 2015) at eleven places, dark to bright.
const MAGMA: [[u8; 3]; 11] = [
    [0x00, 0x00, 0x04],
    [0x14, 0x0e, 0x36],
    [0x3b, 0x0f, 0x70],
    [0x64, 0x1a, 0x80],
    [0x8c, 0x29, 0x81],
    [0xb7, 0x37, 0x79],
    [0xde, 0x49, 0x68],
    [0xf7, 0x70, 0x5c],
    [0xfe, 0x9f, 0x6d],
    [0xfe, 0xcf, 0x92],
    [0xfc, 0xfd, 0xbf],
];

/// An image of the report.
pub(super) struct Shown {
    /// What it shows.
    pub(super) title: String,
    /// Its name in the folder.
    pub(super) file: String,
    pub(super) png: Vec<u8>,
}

/// The reference, then of each choice its picture, the map of its relative error and that of FLIP.
pub(super) fn all(
    report: &Report,
    reference: &Accumulated,
    measured: &[Measured],
    exposure: f32,
) -> anyhow::Result<Vec<Shown>> {
    let shown = |title: &str, file: String, extent, bytes| -> anyhow::Result<Shown> {
        Ok(Shown { title: title.to_owned(), file, png: png(extent, bytes)? })
    };
    let extent = reference.extent;
    let as_seen = |image: &Accumulated| -> Vec<u8> {
        image.mean.iter().flatten().map(|value| srgb_byte(value * exposure)).collect()
    };
    let mut images = vec![shown("reference", "reference.png".to_owned(), extent, as_seen(reference))?];
    let of_row = |(row, measured): (&Row, &Measured)| -> anyhow::Result<[Shown; 3]> {
        let name = &row.name;
        let [truth, seen] =
            [reference, &measured.picture].map(|image| Radiance::new(image.extent, &image.mean));
        let (truth, seen) = (truth?, seen?);
        let relative = relative_error_map(&truth, &seen)?;
        let relative = relative.iter().flat_map(|error| magma(error.log10() / DECADES + 1.0));
        let flip = flip_ldr(&truth, &seen, exposure)?.map;
        let flip = flip.iter().flat_map(|difference| magma(*difference));
        Ok([
            shown(name, format!("{name}.png"), extent, as_seen(&measured.picture))?,
            shown("relative error", format!("{name}-error.png"), extent, relative.collect())?,
            shown("FLIP", format!("{name}-flip.png"), extent, flip.collect())?,
        ])
    };
    let rows = report.pipelines.par_iter().zip(measured).map(of_row);
    images.extend(rows.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten());
    Ok(images)
}

fn png(extent: [u32; 2], bytes: Vec<u8>) -> anyhow::Result<Vec<u8>> {
    let image =
        image::RgbImage::from_raw(extent[0], extent[1], bytes).context("the image is not complete")?;
    let mut png = Vec::new();
    image.write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png)?;
    Ok(png)
}

/// The colour of a value from 0 to 1.
fn magma(value: f32) -> [u8; 3] {
    let last = MAGMA.len() - 1;
    let at = if value.is_finite() { value.clamp(0.0, 1.0) * last as f32 } else { 0.0 };
    let low = (at as usize).min(last - 1);
    let share = at - low as f32;
    let mix = |a: u8, b: u8| (f32::from(a) + share * (f32::from(b) - f32::from(a))).round() as u8;
    [0, 1, 2].map(|i| mix(MAGMA[low][i], MAGMA[low + 1][i]))
}

/// The colours of the maps as a CSS gradient.
pub(super) fn gradient() -> String {
    let stops = MAGMA.map(|[r, g, b]| format!("rgb({r},{g},{b})"));
    format!("linear-gradient(to right,{})", stops.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_run_from_dark_to_bright() {
        assert_eq!((magma(0.0), magma(1.0), magma(9.0)), (MAGMA[0], MAGMA[10], MAGMA[10]));
        assert_eq!((magma(0.5), magma(f32::NAN)), (MAGMA[5], MAGMA[0]));
        let luma = |[r, g, b]: [u8; 3]| 2 * u32::from(r) + 7 * u32::from(g) + u32::from(b);
        assert!(
            (1_u8..=100).all(|i| luma(magma(f32::from(i) / 100.0)) >= luma(magma(f32::from(i - 1) / 100.0)))
        );
    }
}
