//! The outside of the file: GLB in one, or glTF with a `.bin` beside it. Each file is replaced in one step, the one
//! before goes on as `<name>.bak`. Format: glTF 2.0, section 4.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::json::{Object, Put};
use super::{ExportError, ExportFormat};
use crate::deep;
use crate::import::{Location, resolve};
use crate::project::atomic;

/// A `.bin` that is there is replaced only where this program has written it with the `.gltf` of that name, and no source of the
/// scene reads it.
pub(super) fn refuse_foreign_bin<'a>(
    path: &Path,
    sources: impl Iterator<Item = &'a Path>,
) -> Result<(), ExportError> {
    let beside = path.with_extension("bin");
    if !beside.exists() {
        return Ok(());
    }
    let name = beside.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let refuse = |why: &str| Err(ExportError::new(path, format!("{name} {why}; choose another name")));
    if !is_own(path, &beside) {
        return refuse("is there already and may belong to another file");
    }
    let real = beside.canonicalize().unwrap_or(beside);
    let mut readers = sources.filter(|source| buffers_of(source).contains(&real));
    match readers.next() {
        Some(source) => refuse(&format!("is read by {}, a source of this scene", source.display())),
        None => Ok(()),
    }
}

/// The text of a `.gltf`, where it is one.
fn json_of(path: &Path) -> Option<Value> {
    path.extension().filter(|ending| ending.eq_ignore_ascii_case("gltf"))?;
    deep::parse(&std::fs::read(path).ok().filter(|bytes| !bytes.is_empty())?).ok()
}

fn uris_of(json: &Value) -> Vec<&str> {
    let buffers = json.get("buffers").and_then(Value::as_array).into_iter().flatten();
    buffers.filter_map(|buffer| buffer.get("uri")?.as_str()).collect()
}

/// Whether this program wrote a file with this buffer alone.
fn is_own(path: &Path, beside: &Path) -> bool {
    let Some(json) = json_of(path) else { return false };
    let generator = json.pointer("/asset/generator").and_then(Value::as_str);
    generator.is_some_and(|name| name.starts_with("Caustica")) && uris_of(&json) == [uri_of(beside)]
}

/// The files that a `.gltf` has its buffers in, links followed.
fn buffers_of(source: &Path) -> Vec<PathBuf> {
    let (Some(json), Some(folder)) = (json_of(source), source.parent()) else { return Vec::new() };
    let file = |uri: &&str| match resolve(uri, folder).ok()? {
        Location::File(path) => path.canonicalize().ok(),
        Location::Data(_) => None,
    };
    uris_of(&json).iter().filter(|uri| !uri.starts_with("data:")).filter_map(file).collect()
}

/// Writes the file and returns every path that was written.
pub(super) fn write(
    path: &Path,
    format: ExportFormat,
    mut json: Object,
    bytes: Vec<u8>,
) -> Result<Vec<PathBuf>, ExportError> {
    let beside = path.with_extension("bin");
    let separate = format == ExportFormat::Gltf && !bytes.is_empty();
    if !bytes.is_empty() {
        let mut buffer = Object::new();
        if separate {
            buffer.put("uri", uri_of(&beside));
        }
        buffer.put("byteLength", bytes.len());
        json.put("buffers", vec![Value::Object(buffer)]);
    }
    let json = Value::Object(json);
    match format {
        ExportFormat::Glb => {
            let whole = binary(&json, &bytes).map_err(|reason| ExportError::new(path, reason))?;
            replace(path, &whole)?;
            Ok(vec![path.to_owned()])
        }
        ExportFormat::Gltf => {
            let text = serde_json::to_string_pretty(&json)
                .map(deep::written)
                .map_err(|error| ExportError::new(path, error.to_string()))?;
            // First the bytes: a reader that finds the new JSON finds them too.
            if separate {
                replace(&beside, &bytes)?;
            }
            replace(path, (text + "\n").as_bytes())?;
            Ok([Some(path.to_owned()), separate.then_some(beside)].into_iter().flatten().collect())
        }
    }
}

fn replace(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    atomic::write(path, bytes).map_err(|error| ExportError::new(path, format!("cannot be written: {error}")))
}

/// The file name with everything encoded that a URI must not hold (RFC 3986, section 2.3). A name with a colon would read as an address
/// or a drive once it is decoded, and so begins with the folder that it is in (section 4.2).
fn uri_of(path: &Path) -> String {
    const ENCODED: &percent_encoding::AsciiSet =
        &percent_encoding::NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~');
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let here = if name.contains(':') { "./" } else { "" };
    format!("{here}{}", percent_encoding::utf8_percent_encode(&name, ENCODED))
}

fn binary(json: &Value, bytes: &[u8]) -> Result<Vec<u8>, String> {
    let text = serde_json::to_string(json).map_err(|error| error.to_string())?;
    let mut text = deep::written(text).into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunks: &[(&[u8; 4], &[u8])] = match bytes.is_empty() {
        true => &[(b"JSON", &text)],
        false => &[(b"JSON", &text), (b"BIN\0", bytes)],
    };
    let length = 12 + chunks.iter().map(|(_, chunk)| 8 + chunk.len()).sum::<usize>();
    let too_large = || format!("it would take {length} bytes and GLB ends at 4 GiB: export it as .gltf");
    let mut file = Vec::with_capacity(length);
    file.extend(b"glTF");
    file.extend(2_u32.to_le_bytes());
    file.extend(u32::try_from(length).map_err(|_| too_large())?.to_le_bytes());
    for (kind, chunk) in chunks {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(*kind);
        file.extend(*chunk);
    }
    Ok(file)
}
