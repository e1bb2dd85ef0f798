//! Images as files. PNG is the tone-mapped image, encoded to sRGB once; EXR is scene-linear radiance in 32-bit floats
//! with what is known of the run in its attributes.

use std::path::Path;

use anyhow::{Context, bail};

use crate::exr_file::{self, Note};
use crate::whole_file;

/// What is written beside the pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct Metadata {
    pub(super) samples: u64,
    pub(super) sample_offset: u64,
    pub(super) seconds: f64,
    pub(super) device: String,
    pub(super) pipeline: &'static str,
    pub(super) sampler: &'static str,
    pub(super) seed: u32,
}

/// What kind of image a path asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Png,
    Exr,
}

/// Reads the ending of the output's name.
///
/// # Errors
/// When it is neither `.png` nor `.exr`.
pub(super) fn kind_of(path: &Path) -> anyhow::Result<Kind> {
    match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("png") => Ok(Kind::Png),
        Some("exr") => Ok(Kind::Exr),
        _ => bail!("{}: the image must end in .png or .exr", path.display()),
    }
}

/// Writes a PNG of linear, tone-mapped pixels.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn write_png(path: &Path, extent: [u32; 2], display: &[[f32; 4]]) -> anyhow::Result<()> {
    let bytes: Vec<u8> = display.iter().flat_map(|[r, g, b, _]| [*r, *g, *b].map(srgb_byte)).collect();
    let image =
        image::RgbImage::from_raw(extent[0], extent[1], bytes).context("the image is not complete")?;
    replace(path, |path| Ok(image.save_with_format(path, image::ImageFormat::Png)?))
}

/// Writes a file whole, into a folder that is made where it is not there.
fn replace(path: &Path, write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
    make_folder(path)?;
    whole_file::replace(path, write).with_context(|| path.display().to_string())
}

/// Linear 0..1 to the nearest sRGB byte (IEC 61966-2-1).
pub(super) fn srgb_byte(linear: f32) -> u8 {
    let x = if linear.is_finite() { linear.clamp(0.0, 1.0) } else { 0.0 };
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

/// Writes an EXR of radiance.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn write_exr(
    path: &Path,
    extent: [u32; 2],
    radiance: &[[f32; 3]],
    metadata: &Metadata,
) -> anyhow::Result<()> {
    make_folder(path)?;
    let text = |text: &str| Note::Text(text.to_owned());
    let notes = [
        ("caustica.samples", text(&metadata.samples.to_string())),
        ("caustica.sampleOffset", text(&metadata.sample_offset.to_string())),
        ("caustica.seconds", Note::Number(metadata.seconds)),
        ("caustica.device", text(&metadata.device)),
        ("caustica.pipeline", text(metadata.pipeline)),
        ("caustica.sampler", text(metadata.sampler)),
        ("caustica.seed", text(&metadata.seed.to_string())),
    ];
    exr_file::write(path, extent, exr_file::channels_of(["R", "G", "B"], radiance).collect(), notes)
}

/// Makes the folder of a file where it is not there.
///
/// # Errors
/// When it cannot be made.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => std::fs::create_dir_all(folder).with_context(|| folder.display().to_string()),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_follow_the_srgb_curve() {
        for (linear, byte) in
            [(0.0, 0), (1.0, 255), (0.5, 188), (0.215_86, 128), (-1.0, 0), (f32::NAN, 0), (9.0, 255)]
        {
            assert_eq!(srgb_byte(linear), byte, "{linear}");
        }
    }
}
