//! Images of materials: PNG, JPEG, WebP and KTX 2 to 8-bit RGBA, with limits, and the checker that stands in for a bad one.
//! In: bytes. Out: texels, first row at the top, colours as encoded in the file.

use std::io::Cursor;
use std::sync::Arc;

use image::{DynamicImage, ImageDecoder as _, ImageFormat, ImageReader, Limits};

use super::{basis, image_guard};

/// Side of the stand-in image in texels, and of its squares.
const CHECKER_PX: u32 = 16;
const CHECKER_SQUARE_PX: u32 = 4;

/// Texels of an image.
#[derive(Clone, Debug)]
pub(super) struct Pixels {
    pub width: u32,
    pub height: u32,
    pub rgba8: Arc<[u8]>,
    pub placeholder: bool,
    /// The file has the four channels of print (CMYK), which glTF does not know.
    pub of_print: bool,
    /// The PNG or JPEG that they were read from.
    pub encoded: Option<Arc<[u8]>>,
}

/// Decodes an image of a format that is found by its first bytes; deeper channels are reduced to 8 bits.
pub(super) fn decode(bytes: Vec<u8>, max_extent_px: u32) -> Result<Pixels, String> {
    if bytes.starts_with(basis::MAGIC) {
        return basis::decode(&bytes, max_extent_px);
    }
    let mut reader =
        ImageReader::new(Cursor::new(&bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    let of_print = reader.format() == Some(ImageFormat::Jpeg) && jpeg_channels(&bytes) == Some(4);
    // What every program reads is kept as it is for exports.
    let is_plain = match reader.format() {
        Some(ImageFormat::Png) => true,
        Some(ImageFormat::Jpeg) => !of_print,
        Some(ImageFormat::WebP) => false,
        Some(other) => return Err(format!("{other:?} images are not supported here")),
        None => return Err("it is neither PNG, JPEG, WebP nor KTX 2".to_owned()),
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(max_extent_px);
    limits.max_image_height = Some(max_extent_px);
    // Decoded at up to 16 bits a channel, with room for the decoder's own copy.
    limits.max_alloc = Some(u64::from(max_extent_px).pow(2) * 16);
    reader.limits(limits);
    let format = reader.format();
    let image = image_guard::guarded(|| {
        let decoder = reader.into_decoder().map_err(|error| error.to_string())?;
        image_guard::check_size(&decoder, format, bytes.len())?;
        let image = DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?;
        Ok(image.into_rgba8())
    })?;
    let (width, height) = image.dimensions();
    if width == 0 || height == 0 {
        return Err("it has no texels".to_owned());
    }
    let encoded = is_plain.then(|| bytes.into());
    Ok(Pixels { width, height, rgba8: image.into_raw().into(), placeholder: false, of_print, encoded })
}

/// What the texels of an image take once they are decoded, bytes, as its head says; 0 where [`decode`] refuses it by its head.
pub(super) fn texel_bytes(bytes: &[u8], max_extent_px: u32) -> u64 {
    let size = match bytes.starts_with(basis::MAGIC) {
        true => basis::dimensions(bytes),
        false => image_guard::guarded(|| {
            let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
            let reader = reader.map_err(|error| error.to_string())?;
            let format = reader.format();
            let decoder = reader.into_decoder().map_err(|error| error.to_string())?;
            image_guard::check_size(&decoder, format, bytes.len())?;
            Ok(decoder.dimensions())
        }),
    };
    let size = size.ok().filter(|(width, height)| *width.max(height) <= max_extent_px);
    size.map_or(0, |(width, height)| u64::from(width) * u64::from(height) * 4)
}

/// How many channels a JPEG has (ITU-T T.81, annex B).
fn jpeg_channels(bytes: &[u8]) -> Option<u8> {
    let mut at = 2;
    loop {
        let marker = *bytes.get(at + 1).filter(|_| bytes.get(at) == Some(&0xff))?;
        match marker {
            0xff => at += 1,
            // Frame headers, among tables whose numbers lie between theirs.
            0xc0..=0xcf if !matches!(marker, 0xc4 | 0xc8 | 0xcc) => return bytes.get(at + 9).copied(),
            _ => at += 2 + usize::from(u16::from_be_bytes([*bytes.get(at + 2)?, *bytes.get(at + 3)?])),
        }
    }
}

/// A checker in magenta and black, seen at once.
pub(super) fn placeholder() -> Pixels {
    let texel = |i: u32| {
        let square = (i % CHECKER_PX / CHECKER_SQUARE_PX) + (i / CHECKER_PX / CHECKER_SQUARE_PX);
        if square.is_multiple_of(2) { [255, 0, 255, 255] } else { [0, 0, 0, 255] }
    };
    Pixels {
        width: CHECKER_PX,
        height: CHECKER_PX,
        rgba8: (0..CHECKER_PX * CHECKER_PX).flat_map(texel).collect(),
        placeholder: true,
        of_print: false,
        encoded: None,
    }
}
