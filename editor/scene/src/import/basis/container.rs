//! The outside of a KTX 2 file: sizes, how it is compressed, and where its data lie.
//! In: bytes. Out: the largest level. Mip levels and key-value data are not looked at. Format: KTX 2.0, section 3.

/// First bytes of a file.
pub(in crate::import) const MAGIC: &[u8] = b"\xABKTX 20\xBB\r\n\x1A\n";

// Places of the numbers of the header, bytes.
const WIDTH: usize = 20;
const HEIGHT: usize = 24;
const DEPTH: usize = 28;
const LAYERS: usize = 32;
const FACES: usize = 36;
const SCHEME: usize = 44;
const DESCRIPTOR: usize = 48;
const GLOBAL: usize = 64;
const FIRST_LEVEL: usize = 80;
/// The colour model in the data format descriptor.
const MODEL: usize = 12;

/// How the texels are encoded.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// ETC1S blocks in the codes of BasisLZ.
    Etc1s,
    Uastc,
    UastcZstandard,
}

/// The largest level of a plain texture.
pub(super) struct Container<'a> {
    pub width: u32,
    pub height: u32,
    pub encoding: Encoding,
    /// What all levels share.
    pub global: &'a [u8],
    pub level: &'a [u8],
}

impl<'a> Container<'a> {
    pub fn read(file: &'a [u8]) -> Result<Self, String> {
        if !file.starts_with(MAGIC) {
            return Err("it is no KTX 2 file".to_owned());
        }
        let word = |at: usize| {
            let bytes = file.get(at..at.saturating_add(4)).and_then(|bytes| bytes.first_chunk::<4>());
            bytes.map(|bytes| u32::from_le_bytes(*bytes)).ok_or("its KTX 2 header is cut off")
        };
        let section = |at: usize| {
            let long = |at: usize| Ok::<_, &str>(u64::from(word(at)?) | u64::from(word(at + 4)?) << 32);
            let (start, length) = (long(at)?, long(at + 8)?);
            let range = usize::try_from(start).ok().zip(usize::try_from(start.saturating_add(length)).ok());
            range
                .and_then(|(start, end)| file.get(start..end))
                .ok_or("a section of its KTX 2 file is cut off")
        };
        let (width, height) = (word(WIDTH)?, word(HEIGHT)?);
        if width == 0 || height == 0 || word(DEPTH)? > 0 || word(LAYERS)? > 0 || word(FACES)? != 1 {
            return Err("only plain two-dimensional KTX 2 textures are read".to_owned());
        }
        let model = word((word(DESCRIPTOR)? as usize).saturating_add(MODEL))? & 0xff;
        let encoding = match (model, word(SCHEME)?) {
            (163, 1) => Encoding::Etc1s,
            (166, 0) => Encoding::Uastc,
            (166, 2) => Encoding::UastcZstandard,
            (model, scheme) => {
                return Err(format!(
                    "of KTX 2 only Basis Universal is read, ETC1S (color model 163, supercompression 1) or UASTC (166, 0 \
                     or 2); it has {model}, {scheme}"
                ));
            }
        };
        Ok(Self { width, height, encoding, global: section(GLOBAL)?, level: section(FIRST_LEVEL)? })
    }
}
