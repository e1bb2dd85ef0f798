//! Environment maps: `.hdr` and `.exr` files in an equirectangular layout.
//! In: a path. Out: linear radiance, finite and not negative, with a warning that counts repairs.

use std::path::Path;

use image::{ImageFormat, ImageReader, Limits};

use super::{ImportError, Warning};
use crate::assets::RadianceMap;

/// Widest and highest map that is read.
const MAX_EXTENT_PX: u32 = 16_384;
/// Largest memory for decoding, bytes: four 32-bit channels and a working copy.
const MAX_ALLOC_BYTES: u64 = 8 << 30;

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
    let image = reader.decode().map_err(|error| fail(error.to_string()))?.into_rgb32f();
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
