//! Textures of `KHR_texture_basisu`: KTX 2 files with ETC1S or UASTC blocks, to 8-bit RGBA.
//! In: bytes. Out: the texels of the largest level; smaller ones are made anew from it, as for any other image.
//! Formats: KTX 2.0, sections 3 to 5; Khronos Data Format 1.3, chapters 23 (ASTC) and 25 (UASTC). The decoders were
//! compared with those of Basis Universal 1.16, bit for bit.

use ruzstd::decoding::FrameDecoder;

use super::image::Pixels;

mod bits;
mod container;
mod etc1s;
mod uastc;

pub(super) use container::MAGIC;
use container::{Container, Encoding};

/// Texels along an edge of a block.
const BLOCK_PX: usize = 4;

/// Texels of a block, row by row.
type Block = [[u8; 4]; BLOCK_PX * BLOCK_PX];

/// An image that is filled block by block, cut at its right and lower edge.
struct Canvas {
    width: usize,
    height: usize,
    rgba8: Vec<u8>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        // Zeros take no memory until they are written to.
        Self { width, height, rgba8: vec![0; width * height * 4] }
    }

    /// Blocks in a row, and rows of blocks.
    fn blocks(&self) -> (usize, usize) {
        (self.width.div_ceil(BLOCK_PX), self.height.div_ceil(BLOCK_PX))
    }

    /// Calls `write` with each texel of a block that is inside of the image.
    fn fill(&mut self, column: usize, row: usize, block: &Block, write: fn(&mut [u8; 4], [u8; 4])) {
        for (y, texels) in (row * BLOCK_PX..self.height).zip(block.as_chunks::<BLOCK_PX>().0) {
            let start = (y * self.width + column * BLOCK_PX) * 4;
            let end = (y + 1) * self.width * 4;
            let line = self.rgba8.get_mut(start..end).unwrap_or_default();
            for (to, from) in line.as_chunks_mut::<4>().0.iter_mut().zip(texels) {
                write(to, *from);
            }
        }
    }
}

/// Decodes the largest level.
///
/// # Errors
/// In words, for what is no KTX 2 file, not Basis Universal, no plain 2D texture, too large, or damaged.
pub(super) fn decode(bytes: &[u8], max_extent_px: u32) -> Result<Pixels, String> {
    let Container { width, height, encoding, global, level } = Container::read(bytes)?;
    if width > max_extent_px || height > max_extent_px {
        return Err(format!("it has {width} x {height} texels, at most {max_extent_px} a side are read"));
    }
    let canvas = Canvas::new(width as usize, height as usize);
    let rgba8 = match encoding {
        Encoding::Etc1s => etc1s::decode(global, level, canvas),
        Encoding::Uastc => uastc::decode(level, canvas),
        Encoding::UastcZstandard => uastc::decode(&inflate(level, &canvas)?, canvas),
    }?;
    Ok(Pixels { width, height, rgba8: rgba8.into(), placeholder: false, of_print: false, encoded: None })
}

/// Width and height of the largest level.
pub(super) fn dimensions(bytes: &[u8]) -> Result<(u32, u32), String> {
    Container::read(bytes).map(|container| (container.width, container.height))
}

/// Zstandard, into exactly the bytes that the blocks of the image have.
fn inflate(level: &[u8], canvas: &Canvas) -> Result<Vec<u8>, String> {
    let (columns, rows) = canvas.blocks();
    let mut blocks = vec![0; columns * rows * uastc::BLOCK_BYTES];
    let mut decoder = FrameDecoder::new();
    decoder.set_max_window_size(blocks.len().next_power_of_two().max(1 << 20) as u64);
    let length = decoder
        .decode_all(level, &mut blocks)
        .map_err(|error| format!("its Zstandard stream cannot be read: {error}"))?;
    blocks.truncate(length);
    Ok(blocks)
}

#[cfg(test)]
mod tests;
