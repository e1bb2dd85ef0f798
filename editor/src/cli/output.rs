//! Images as files. PNG is the tone-mapped image, encoded to sRGB once; EXR is scene-linear radiance in 32-bit floats
//! with what is known of the run in its attributes.

use std::path::Path;

use anyhow::{Context, bail};
use exr::prelude::{
    AttributeValue, Blocks, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder,
    SpecificChannels, Text, WritableImage,
};

use crate::whole_file;

/// Whole rows, which every reader takes.
const ENCODING: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

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
fn srgb_byte(linear: f32) -> u8 {
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
    let size = (extent[0] as usize, extent[1] as usize);
    let channels = SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| {
        let [r, g, b] = radiance.get(at.y() * size.0 + at.x()).copied().unwrap_or([0.0; 3]);
        (r, g, b)
    });
    let mut attributes = LayerAttributes::named("");
    attributes.layer_name = None;
    attributes.software_name = Some(Text::from(concat!("caustica ", env!("CARGO_PKG_VERSION"))));
    let mut note = |name: &str, value: AttributeValue| {
        attributes.other.insert(Text::from(name), value);
    };
    note("caustica.samples", AttributeValue::Text(Text::from(metadata.samples.to_string().as_str())));
    note(
        "caustica.sampleOffset",
        AttributeValue::Text(Text::from(metadata.sample_offset.to_string().as_str())),
    );
    note("caustica.seconds", AttributeValue::F64(metadata.seconds));
    // EXR texts hold Latin-1 only.
    let device = Text::new_or_none(&metadata.device).unwrap_or_else(|| Text::from("unknown"));
    note("caustica.device", AttributeValue::Text(device));
    note("caustica.pipeline", AttributeValue::Text(Text::from(metadata.pipeline)));
    note("caustica.sampler", AttributeValue::Text(Text::from(metadata.sampler)));
    note("caustica.seed", AttributeValue::Text(Text::from(metadata.seed.to_string().as_str())));
    let layer = Layer::new(size, attributes, ENCODING, channels);
    let image = Image::from_layer(layer);
    replace(path, |path| Ok(image.write().to_file(path)?))
}

fn make_folder(path: &Path) -> anyhow::Result<()> {
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
