//! Environment maps: `.hdr` and `.exr` files in an equirectangular layout.
//! In: a path. Out: linear radiance, finite and not negative, with a warning that counts repairs.

use std::cell::Cell;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Rgb32FImage};

use super::watched::Watched;
use super::{ImportError, Warning, counted, image_guard, memory};
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
    let head = with_plain_head(bytes);
    let image = decode(head.as_deref().unwrap_or(bytes), &at)
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

/// The bytes of a Radiance file whose head has the line ends of Windows, which the decoder takes for a part of what they end, with
/// plain ones: up to the line of the size, which follows an empty one. `None` for other files.
fn with_plain_head(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut plain: Vec<u8> = Vec::new();
    let (mut rest, mut ended) = (bytes.strip_prefix(b"#?").filter(|_| bytes.contains(&b'\r'))?, false);
    plain.extend(b"#?");
    loop {
        let (line, after) = rest.split_at(rest.iter().position(|byte| *byte == b'\n')? + 1);
        let content = line.strip_suffix(b"\r\n").or(line.strip_suffix(b"\n"))?;
        plain.extend(content);
        plain.push(b'\n');
        rest = after;
        if ended {
            plain.extend(rest);
            return Some(plain);
        }
        ended = content.is_empty();
    }
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
        // As the decoder gives it, and as three channels.
        let (width, height) = decoder.dimensions();
        let wanted = decoder.total_bytes().saturating_add(u64::from(width) * u64::from(height) * 12);
        if let Some(reason) = memory::refusal(wanted, memory::half_of_machine()) {
            return Err(reason);
        }
        if decoder.dimensions().0 == 0 || decoder.dimensions().1 == 0 {
            return Err("the image has no texels".to_owned());
        }
        Ok(DynamicImage::from_decoder(decoder).map_err(words)?.into_rgb32f())
    })
}
