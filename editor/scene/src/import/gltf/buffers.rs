//! The bytes behind a glTF file: its binary chunk, data URIs, files beside it.
//! In: JSON and the folder. Out: byte slices by index. Nothing outside the model's folder is opened.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use super::super::uri::{Location, resolve};
use super::compressed;
use super::json::{Fault, Item};
use crate::import::require_regular_file;

/// Largest image file that is read, bytes.
const MAX_IMAGE_FILE_BYTES: u64 = 1 << 30;
/// What compressed data may become: this many bytes, and more when the file has more.
const MIN_DECODED_BYTES: usize = 256 << 20;
/// Most bytes that a byte of the file may become.
const MAX_DECODED_RATIO: usize = 64;

/// The buffers of a file.
pub(super) struct Buffers {
    file: Vec<u8>,
    list: Vec<Source>,
    /// Bytes that compressed data may still become.
    decoded_left: usize,
}

enum Source {
    /// A range of the model file itself.
    Chunk(Range<usize>),
    Own(Vec<u8>),
}

impl Buffers {
    /// Reads every buffer; `file` is the whole model file and `binary` the range of its binary chunk.
    pub fn read(
        root: &Item<'_>,
        file: Vec<u8>,
        binary: Option<Range<usize>>,
        folder: &Path,
    ) -> Result<Self, Fault> {
        let mut list = Vec::new();
        for (index, item) in root.objects("buffers")?.iter().enumerate() {
            let length = item.required_size("byteLength")?;
            if is_fallback(item)? {
                list.push(Source::Own(Vec::new()));
                continue;
            }
            let source = match (item.text("uri")?, &binary) {
                (Some(uri), _) => Source::Own(read_uri(item, uri, folder, length)?),
                (None, Some(range)) if index == 0 => Source::Chunk(range.clone()),
                (None, _) => return Err(item.fault("it has neither a URI nor a binary chunk")),
            };
            let available = match &source {
                Source::Chunk(range) => range.len(),
                Source::Own(bytes) => bytes.len(),
            };
            if available < length {
                return Err(
                    item.fault(format!("byteLength is {length}, but there are only {available} bytes"))
                );
            }
            list.push(match source {
                Source::Chunk(range) => Source::Chunk(range.start..range.start + length),
                Source::Own(mut bytes) => {
                    bytes.truncate(length);
                    Source::Own(bytes)
                }
            });
        }
        let bytes = list.iter().map(|source| match source {
            Source::Chunk(range) => range.len(),
            Source::Own(bytes) => bytes.len(),
        });
        let decoded_left = bytes.sum::<usize>().saturating_mul(MAX_DECODED_RATIO).max(MIN_DECODED_BYTES);
        Ok(Self { file, list, decoded_left })
    }

    /// Says that compressed data is about to become so many bytes; refused when it is too much for the file.
    pub fn claim(&mut self, bytes: usize) -> Result<(), String> {
        self.decoded_left = self.decoded_left.checked_sub(bytes).ok_or_else(|| {
            format!(
                "its compressed data becomes {bytes} bytes, more than the {} that a file of this size may still have",
                self.decoded_left
            )
        })?;
        Ok(())
    }

    /// Adds bytes that were decoded; returns the index of the buffer.
    pub fn push(&mut self, bytes: Vec<u8>) -> usize {
        self.list.push(Source::Own(bytes));
        self.list.len() - 1
    }

    /// The bytes of a buffer; none for an index that does not exist.
    pub fn bytes(&self, index: usize) -> &[u8] {
        match self.list.get(index) {
            Some(Source::Chunk(range)) => self.file.get(range.clone()).unwrap_or(&[]),
            Some(Source::Own(bytes)) => bytes,
            None => &[],
        }
    }
}

/// Whether a buffer is only there for programs that cannot decompress; it may have no bytes at all.
fn is_fallback(item: &Item<'_>) -> Result<bool, Fault> {
    match compressed::extension(item)? {
        Some(extension) => extension.bool_or("fallback", false),
        None => Ok(false),
    }
}

fn read_uri(item: &Item<'_>, uri: &str, folder: &Path, length: usize) -> Result<Vec<u8>, Fault> {
    match resolve(uri, folder).map_err(|reason| item.fault(reason))? {
        Location::Data(bytes) => Ok(bytes),
        Location::File(path) => read_file(&path, length as u64).map_err(|reason| item.fault(reason)),
    }
}

/// Reads the encoded image behind a URI.
pub(in crate::import) fn read_image_uri(uri: &str, folder: &Path) -> Result<Vec<u8>, String> {
    match resolve(uri, folder)? {
        Location::Data(bytes) => Ok(bytes),
        Location::File(path) => read_file(&path, MAX_IMAGE_FILE_BYTES),
    }
}

/// Reads at most `limit` bytes of a regular file.
pub(in crate::import) fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    require_regular_file(path).map_err(|error| error.to_string())?;
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(limit).read_to_end(&mut bytes))
        .map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(bytes)
}
