//! The bytes behind a glTF file: its binary chunk, data URIs, files beside it.
//! In: JSON and the folder. Out: byte slices by index. Nothing outside the model's folder is opened.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::super::uri::{Location, resolve};
use super::compressed;
use super::json::{Fault, Item};
use crate::import::room::Room;
use crate::import::{refuse_lfs_pointer, require_regular_file};

/// Largest image file that is read, bytes.
const MAX_IMAGE_FILE_BYTES: u64 = 1 << 30;

/// The buffers of a file.
pub(super) struct Buffers {
    file: Vec<u8>,
    list: Vec<Source>,
    room: Room,
}

enum Source {
    /// A range of the model file itself.
    Chunk(Range<usize>),
    Own(Vec<u8>),
    /// The beginning of a file that several buffers may name.
    Shared(Arc<Vec<u8>>, usize),
}

impl Source {
    fn len(&self) -> usize {
        match self {
            Self::Chunk(range) => range.len(),
            Self::Own(bytes) => bytes.len(),
            Self::Shared(bytes, length) => bytes.len().min(*length),
        }
    }
}

impl Buffers {
    /// Reads every buffer; `file` is the whole model file and `binary` the range of its binary chunk.
    pub fn read(
        root: &Item<'_>,
        file: Vec<u8>,
        binary: Option<Range<usize>>,
        folder: &Path,
    ) -> Result<Self, Fault> {
        let items = root.objects("buffers")?;
        let mut files = Files::of(&items, folder)?;
        let mut list = Vec::new();
        for (index, item) in items.iter().enumerate() {
            let length = item.required_size("byteLength")?;
            if is_fallback(item)? {
                list.push(Source::Own(Vec::new()));
                continue;
            }
            let mut source = match (item.text("uri")?, &binary) {
                (Some(uri), _) => files.read(item, uri, folder)?,
                (None, Some(range)) if index == 0 => Source::Chunk(range.clone()),
                (None, _) => return Err(item.fault("it has neither a URI nor a binary chunk")),
            };
            let available = source.len();
            if available < length {
                return Err(
                    item.fault(format!("byteLength is {length}, but there are only {available} bytes"))
                );
            }
            match &mut source {
                Source::Chunk(range) => range.end = range.start + length,
                Source::Own(bytes) => bytes.truncate(length),
                Source::Shared(_, shown) => *shown = length,
            }
            list.push(source);
        }
        let beside: usize = files.read.values().map(|bytes| bytes.len()).sum();
        let room = Room::new(file.len().saturating_add(beside), compressed::stream_bytes(root)?);
        Ok(Self { file, list, room })
    }

    /// What the file may still take in memory.
    pub const fn room(&self) -> &Room {
        &self.room
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
            Some(Source::Shared(bytes, length)) => bytes.get(..*length).unwrap_or(bytes),
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

/// The files that buffers name, each read once.
#[derive(Default)]
struct Files {
    /// How much of each some buffer wants.
    wanted: HashMap<PathBuf, usize>,
    read: HashMap<PathBuf, Arc<Vec<u8>>>,
}

impl Files {
    fn of(items: &[Item<'_>], folder: &Path) -> Result<Self, Fault> {
        let mut files = Self::default();
        for item in items {
            let uri = item.text("uri")?.filter(|uri| !uri.starts_with("data:"));
            if let Some(Ok(Location::File(path))) = uri.map(|uri| resolve(uri, folder)) {
                let most = files.wanted.entry(path).or_default();
                *most = item.required_size("byteLength")?.max(*most);
            }
        }
        Ok(files)
    }

    fn read(&mut self, item: &Item<'_>, uri: &str, folder: &Path) -> Result<Source, Fault> {
        let path = match resolve(uri, folder).map_err(|reason| item.fault(reason))? {
            Location::Data(bytes) => return Ok(Source::Own(bytes)),
            Location::File(path) => path,
        };
        if let Some(known) = self.read.get(&path) {
            return Ok(Source::Shared(Arc::clone(known), usize::MAX));
        }
        let limit = self.wanted.get(&path).copied().unwrap_or_default() as u64;
        let bytes = Arc::new(read_file(&path, limit).map_err(|reason| item.fault(reason))?);
        self.read.insert(path, Arc::clone(&bytes));
        Ok(Source::Shared(bytes, usize::MAX))
    }
}

/// Reads the encoded image behind a URI.
pub(in crate::import) fn read_image_uri(uri: &str, folder: &Path) -> Result<Vec<u8>, String> {
    match resolve(uri, folder)? {
        Location::Data(bytes) => Ok(bytes),
        Location::File(path) => read_file(&path, MAX_IMAGE_FILE_BYTES),
    }
}

/// Longest beginning of a file that tells what it is, bytes.
const HEAD_BYTES: u64 = 64;

/// Reads at most `limit` bytes of a regular file.
pub(in crate::import) fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    require_regular_file(path).map_err(|error| error.to_string())?;
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(limit.max(HEAD_BYTES)).read_to_end(&mut bytes))
        .map_err(|error| format!("{}: {error}", path.display()))?;
    if let Some(reason) = refuse_lfs_pointer(&bytes) {
        return Err(format!("{} {reason}", path.display()));
    }
    bytes.truncate(usize::try_from(limit).unwrap_or(usize::MAX));
    Ok(bytes)
}
