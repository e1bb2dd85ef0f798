//! What stands between the decoders of images and a damaged file: the size that it claims is doubted before memory is taken, and a
//! decoder that panics is one that refuses.
//! In: what a decoder read of the head, and the bytes of the file. Out: a refusal in words.

use std::panic::{AssertUnwindSafe, catch_unwind};

use image::{ImageDecoder, ImageFormat};

/// Memory for texels that any file may ask for, bytes. Beyond, it has to be large enough to hold them in compressed form.
const FREE_BYTES: u64 = 64 << 20;
/// Most that deflate makes of a byte (RFC 1951: 258 bytes in two bits).
const DEFLATE_RATIO: u64 = 1032;
/// A block of 8 x 8 texels has a bit for its mean value at least.
const JPEG_TEXELS_PER_BYTE: u64 = 8 * 64;
/// A row of 16,384 texels of one value is 8 bytes long in the older of the two encodings.
const HDR_TEXELS_PER_BYTE: u64 = 2048;
/// Of one value, a block of any size is next to nothing: as for deflate and a bit a texel.
const WEBP_TEXELS_PER_BYTE: u64 = 8 * DEFLATE_RATIO;

/// Refuses an image of more texels than its file can hold.
pub(super) fn check_size(
    decoder: &impl ImageDecoder,
    format: Option<ImageFormat>,
    file_bytes: usize,
) -> Result<(), String> {
    let (width, height) = decoder.dimensions();
    let texels = u64::from(width) * u64::from(height);
    let per_byte = match format {
        Some(ImageFormat::Jpeg) => JPEG_TEXELS_PER_BYTE,
        Some(ImageFormat::WebP) => WEBP_TEXELS_PER_BYTE,
        Some(ImageFormat::Hdr) => HDR_TEXELS_PER_BYTE,
        // Half a channel is 16 bits.
        Some(ImageFormat::OpenExr) => DEFLATE_RATIO / 2,
        _ => DEFLATE_RATIO * 8 / u64::from(decoder.original_color_type().bits_per_pixel().max(1)),
    };
    let most = (file_bytes as u64).saturating_mul(per_byte.max(1));
    match decoder.total_bytes() > FREE_BYTES && texels > most {
        true => Err(format!("it claims {width} x {height} texels, which {file_bytes} bytes cannot hold")),
        false => Ok(()),
    }
}

/// Runs a decoder. Those of `image` panic on some damaged files: png 0.18 on a palette of less than a colour, that of Radiance files
/// on nine marks of empty runs in a row.
pub(super) fn guarded<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    // What it had built is dropped with it: nothing half done is seen.
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|panic| {
        let owned = panic.downcast_ref::<String>().map(String::as_str);
        let words = owned.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
        Err(format!("its decoder gave up: {words}"))
    })
}

#[cfg(test)]
mod tests {
    use super::super::environment::load_environment;

    #[test]
    fn a_decoder_that_panics_refuses() {
        let folder = std::env::temp_dir().join(format!("caustica-guard-{}", std::process::id()));
        let empty_runs = [1, 1, 1, 0].repeat(9);
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 9\n\x80\x80\x80\x80".to_vec();
        bytes.extend(empty_runs);
        assert!(std::fs::create_dir_all(&folder).is_ok());
        let path = folder.join("runs.hdr");
        assert!(std::fs::write(&path, bytes).is_ok());
        let error = load_environment(&path).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains("byte ") && error.contains("gave up"), "{error}");
        assert!(std::fs::remove_dir_all(&folder).is_ok());
    }
}
