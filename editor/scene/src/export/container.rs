//! The outside of the file: GLB in one, or glTF with a `.bin` beside it. Each file is replaced in one step, the one
//! before goes on as `<name>.bak`. Format: glTF 2.0, section 4.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::json::{Object, Put};
use super::{ExportError, ExportFormat};
use crate::project::atomic;

/// A `.bin` without the `.gltf` of its name may be the buffer of another file.
pub(super) fn refuse_foreign_bin(path: &Path) -> Result<(), ExportError> {
    let beside = path.with_extension("bin");
    match beside.exists() && !path.exists() {
        true => {
            let name = beside.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let reason =
                format!("{name} is there already and may belong to another file; choose another name");
            Err(ExportError::new(path, reason))
        }
        false => Ok(()),
    }
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

/// The file name with everything encoded that a URI must not hold (RFC 3986, section 2.3).
fn uri_of(path: &Path) -> String {
    const ENCODED: &percent_encoding::AsciiSet =
        &percent_encoding::NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~');
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    percent_encoding::utf8_percent_encode(&name, ENCODED).to_string()
}

fn binary(json: &Value, bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut text = serde_json::to_vec(json).map_err(|error| error.to_string())?;
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
