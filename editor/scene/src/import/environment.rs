//! Environment maps: `.hdr` and `.exr` files in an equirectangular layout.
//! In: a path. Out: linear radiance, finite and not negative, with a warning that counts repairs.

use std::cell::Cell;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Rgb32FImage};

use super::watched::Watched;
use super::{ImportError, Warning, counted, image_guard};
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
    of_bytes(&super::read_model_file(path)?, path)
}

/// The same of bytes that lie in a file.
pub(super) fn of_bytes(bytes: &[u8], path: &Path) -> Result<(RadianceMap, Vec<Warning>), ImportError> {
    let at = Cell::new(0);
    let image = decode(bytes, &at)
        .map_err(|reason| ImportError::new(path, reason).at(format!("byte {}", at.get())))?;
    let (width, height) = image.dimensions();
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
            message: format!(
                "{} 0 now",
                counted(
                    repaired,
                    "value was negative or not finite and is",
                    "values were negative or not finite and are"
                )
            ),
        });
    }
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let map = RadianceMap { name, width, height, rgb };
    Ok((map, warnings))
}

/// Decodes a map; `at` is how far it was read.
fn decode(bytes: &[u8], at: &Cell<u64>) -> Result<Rgb32FImage, String> {
    let words = |error: ImageError| error.to_string();
    let mut reader =
        ImageReader::new(Watched::new(bytes, at)).with_guessed_format().map_err(|error| error.to_string())?;
    let format = reader.format();
    if !matches!(format, Some(ImageFormat::Hdr | ImageFormat::OpenExr)) {
        return Err("it is neither a Radiance HDR nor an OpenEXR image".to_owned());
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_EXTENT_PX);
    limits.max_image_height = Some(MAX_EXTENT_PX);
    limits.max_alloc = Some(MAX_ALLOC_BYTES);
    reader.limits(limits);
    image_guard::guarded(|| {
        let decoder = reader.into_decoder().map_err(words)?;
        image_guard::check_size(&decoder, format, bytes.len())?;
        if decoder.dimensions().0 == 0 || decoder.dimensions().1 == 0 {
            return Err("the image has no texels".to_owned());
        }
        Ok(DynamicImage::from_decoder(decoder).map_err(words)?.into_rgb32f())
    })
}
