//! Environment maps: `.hdr` and `.exr` files in an equirectangular layout.
//! In: a path. Out: linear radiance, finite and not negative, with a warning that counts repairs.

use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::{ImportError, Warning};
use crate::assets::RadianceMap;

/// Widest and highest map that is read.
const MAX_EXTENT_PX: u32 = 16_384;
/// Largest memory for decoding, bytes: four 32-bit channels and a working copy.
const MAX_ALLOC_BYTES: u64 = 8 << 30;

/// Most texels that a byte of a file can stand for. Old Radiance files say a row of up to 16,384 equal texels in 8 bytes;
/// deflate in OpenEXR reaches 1032 bytes a byte, of which a texel has at least 2.
const MOST_TEXELS_A_BYTE: u64 = 2048;

/// Reads an equirectangular environment. Values that are negative or not finite become 0 and are counted.
///
/// # Errors
/// When the file cannot be read, is no HDR or EXR image or is too large.
pub fn load_environment(path: &Path) -> Result<(RadianceMap, Vec<Warning>), ImportError> {
    let fail = |reason: String| ImportError::new(path, reason);
    super::require_regular_file(path)?;
    let mut reader = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .map_err(|error| fail(error.to_string()))?;
    if !matches!(reader.format(), Some(ImageFormat::Hdr | ImageFormat::OpenExr)) {
        return Err(fail("it is neither a Radiance HDR nor an OpenEXR image".to_owned()));
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_EXTENT_PX);
    limits.max_image_height = Some(MAX_EXTENT_PX);
    limits.max_alloc = Some(MAX_ALLOC_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|error| fail(error.to_string()))?;
    let (width, height) = decoder.dimensions();
    let length = std::fs::metadata(path).map_err(|error| fail(error.to_string()))?.len();
    // Before memory is taken for texels that cannot be there.
    if u64::from(width) * u64::from(height) > length.saturating_mul(MOST_TEXELS_A_BYTE) {
        return Err(fail(format!("it claims {width} x {height} texels, which {length} bytes cannot hold")));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(|error| fail(error.to_string()))?.into_rgb32f();
    let (width, height) = image.dimensions();
    if width == 0 || height == 0 {
        return Err(fail("the image has no texels".to_owned()));
    }
    let mut repaired = 0_usize;
    let (texels, _) = image.as_raw().as_chunks::<3>();
    let rgb = texels
        .iter()
        .map(|texel| {
            texel.map(|value| {
                let good = value.is_finite() && value >= 0.0;
                repaired += usize::from(!good);
                if good { value } else { 0.0 }
            })
        })
        .collect();
    let mut warnings = Vec::new();
    if repaired > 0 {
        warnings.push(Warning {
            file: path.to_owned(),
            place: String::new(),
            message: format!("{repaired} values were negative or not finite and are 0 now"),
        });
    }
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let map = RadianceMap { name, width, height, rgb };
    Ok((map, warnings))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    fn refused(name: &str, bytes: &[u8]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        load_environment(&path).unwrap_err().reason
    }

    #[test]
    fn sizes_that_the_bytes_cannot_hold_are_refused() {
        let hdr = |width, height| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
        let within = refused("a.hdr", hdr(MAX_EXTENT_PX, MAX_EXTENT_PX).as_bytes());
        assert!(within.contains("claims 16384 x 16384 texels"), "{within}");
        for (width, height) in [(4_000_000_000_u32, 1_u32), (1, 4_000_000_000), (16_385, 16_385)] {
            let reason = refused("a.hdr", hdr(width, height).as_bytes());
            assert!(!reason.contains("claims"), "the decoder's own limit is met first: {reason}");
        }
    }

    #[test]
    fn sizes_claimed_by_an_openexr_file_are_refused_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small.exr");
        image::Rgb32FImage::new(4, 2).save(&path).unwrap();
        let small = std::fs::read(&path).unwrap();
        assert!(load_environment(&path).is_ok());
        let window = small.windows(10).position(|bytes| bytes == b"dataWindow").unwrap();
        // Name and type, each with a zero, and the length of the value; then the corners.
        let corner = window + b"dataWindow\0box2i\0".len() + 4 + 8;
        let mut large = small.clone();
        for (side, place) in [(MAX_EXTENT_PX, corner), (MAX_EXTENT_PX, corner + 4)] {
            large[place..place + 4].copy_from_slice(&(side as i32 - 1).to_le_bytes());
        }
        let reason = refused("large.exr", &large);
        // The decoder counts the blocks of the file first.
        assert!(["chunk count", "claims"].iter().any(|words| reason.contains(words)), "{reason}");
    }
}
