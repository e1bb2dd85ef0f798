//! The outside of a glTF file: plain JSON, or the chunks of a `.glb`.
//! In: bytes. Out: JSON and the binary chunk. Format: glTF 2.0, section 4.

use std::ops::Range;

use serde_json::Value;

use super::json::Fault;
use crate::deep;
use crate::import::{UTF16, is_utf16};

const MAGIC: &[u8] = b"glTF";
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;

/// The parts of a file.
pub(super) struct Container {
    pub json: Value,
    /// Where the binary chunk is in the file, if it has one.
    pub binary: Option<Range<usize>>,
}

/// Takes a file apart. `is_glb`: its name ends like that of a binary file.
pub(super) fn read(bytes: &[u8], is_glb: bool) -> Result<Container, Fault> {
    if is_glb || bytes.starts_with(MAGIC) {
        return read_binary(bytes);
    }
    Ok(Container { json: parse(bytes)?, binary: None })
}

fn read_binary(bytes: &[u8]) -> Result<Container, Fault> {
    let fault = |at: usize, reason: String| Err(Fault::new(format!("byte {at}"), reason));
    if bytes.get(..4) != Some(MAGIC) {
        return fault(0, "it does not begin with \"glTF\", so it is no binary glTF".to_owned());
    }
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return fault(bytes.len(), format!("it ends within its header of {HEADER_BYTES} bytes"));
    };
    if version != 2 {
        return fault(4, format!("it is binary glTF version {version}; version 2 is read"));
    }
    let length = length as usize;
    if length > bytes.len() {
        let reason = format!("its header says {length} bytes, but there are {}: it was cut off", bytes.len());
        return fault(8, reason);
    }
    let (mut json, mut binary) = (None, None);
    let mut at = HEADER_BYTES;
    while at < length {
        let (Some(size), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) else {
            return fault(at, "the header of a chunk is cut off".to_owned());
        };
        let start = at + CHUNK_HEADER_BYTES;
        let end = start.checked_add(size as usize).filter(|&end| end <= length);
        let Some(end) = end else {
            return fault(at, format!("the chunk says {size} bytes and reaches past the end"));
        };
        match kind {
            CHUNK_JSON if json.is_none() => json = Some(start..end),
            _ if json.is_none() => {
                return fault(at, "its first chunk is not JSON".to_owned());
            }
            CHUNK_BIN if binary.is_none() => binary = Some(start..end),
            _ => {}
        }
        at = end;
    }
    let Some(json) = json.and_then(|range| bytes.get(range)) else {
        return fault(HEADER_BYTES, "it has no JSON chunk".to_owned());
    };
    Ok(Container { json: parse(json)?, binary })
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(four.try_into().ok()?))
}

fn parse(bytes: &[u8]) -> Result<Value, Fault> {
    if bytes.starts_with(b"\xEF\xBB\xBF") {
        let reason = "the JSON begins with a byte order mark, which glTF forbids; save it without one";
        return Err(Fault::new("line 1 column 1", reason));
    }
    if is_utf16(bytes) {
        return Err(Fault::new("line 1 column 1", format!("it {UTF16}")));
    }
    let json: Value = deep::parse(bytes).map_err(|error| {
        let place = format!("line {} column {}", error.line(), error.column());
        let reason = error.to_string().replace(&format!(" at {place}"), "");
        Fault::new(place, format!("not valid JSON: {reason}"))
    })?;
    match json.is_object() {
        true => Ok(json),
        false => Err(Fault::new("line 1 column 1", "the JSON is no object, so it is no glTF")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_of_the_json_names_its_place_once() {
        let fault = parse(b"{\n1}").err();
        assert_eq!(fault, Some(Fault::new("line 2 column 1", "not valid JSON: key must be a string")));
    }
}
