//! URIs inside a model file: data URIs are decoded, relative ones become paths below the model's folder.
//! It refuses everything that reaches above that folder or names a host, in words.

use std::path::{Path, PathBuf};

use percent_encoding::percent_decode_str;

use super::short;

/// Longest path that is looked for, bytes.
const MOST_NAME_BYTES: usize = 4096;

/// Where the bytes of a URI are.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Location {
    /// In the URI itself.
    Data(Vec<u8>),
    /// In a file.
    File(PathBuf),
}

/// Finds out where the bytes of a URI are; `folder` is that of the model.
pub(crate) fn resolve(uri: &str, folder: &Path) -> Result<Location, String> {
    if let Some((scheme, data)) = uri.split_once(':')
        && scheme.eq_ignore_ascii_case("data")
    {
        return decode_data(data).map(Location::Data);
    }
    if is_address(uri) {
        let (scheme, uri) = (short(uri.split(':').next().unwrap_or_default()), short(uri));
        return Err(format!("\"{uri}\" names a {scheme} address; only files beside the model are read"));
    }
    let decoded = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| format!("\"{}\" is not UTF-8 after percent decoding", short(uri)))?;
    beside(&decoded, folder).map(Location::File)
}

/// A path as written in a file, relative to `folder` and not above it.
pub(super) fn beside(name: &str, folder: &Path) -> Result<PathBuf, String> {
    below(name, folder, folder)
}

/// A path as written in a file, relative to `folder`, which is `root` or below it, and not above `root`.
pub(super) fn below(name: &str, folder: &Path, root: &Path) -> Result<PathBuf, String> {
    if name.is_empty() || name.contains('\0') {
        return Err("the file name is empty or holds a zero byte".to_owned());
    }
    // Where a backslash parts no names, it may be in one; else it is what other systems write for a slash.
    let literal = folder.join(name);
    if !cfg!(windows)
        && name.contains('\\')
        && !name.contains('/')
        && literal.is_file()
        && !leads_out(&literal, root)
    {
        return Ok(literal);
    }
    let name = name.replace('\\', "/");
    let shown = short(&name);
    if name.len() > MOST_NAME_BYTES {
        return Err(format!("\"{shown}\" is longer than any file name"));
    }
    let drive = name.as_bytes().get(1) == Some(&b':');
    if name.starts_with('/') || drive {
        return Err(format!("\"{shown}\" is an absolute path; only files beside the model are read"));
    }
    let between = folder.strip_prefix(root).map_err(|_| format!("\"{shown}\" is not beside the model"))?;
    let between: Vec<String> =
        between.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    let mut parts: Vec<&str> = between.iter().map(String::as_str).collect();
    for part in name.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                if parts.pop().is_none() {
                    return Err(format!(
                        "\"{shown}\" reaches above the folder of the model, which is not allowed"
                    ));
                }
            }
            part => parts.push(part),
        }
    }
    let path = parts.iter().fold(root.to_owned(), |path, part| path.join(part));
    if leads_out(&path, root) {
        return Err(format!(
            "\"{shown}\" is a link that leads out of the folder of the model, which is not allowed"
        ));
    }
    Ok(path)
}

/// Whether a file that is there lies outside of a folder once links are followed.
pub(crate) fn leads_out(path: &Path, folder: &Path) -> bool {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) => !path.starts_with(folder),
        _ => false,
    }
}

/// Whether a text begins with the scheme of an address, such as `http:`. A single letter is a drive.
pub(crate) fn is_address(text: &str) -> bool {
    text.split_once(':').is_some_and(|(scheme, _)| {
        scheme.len() > 1
            && scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'))
    })
}

fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (header, body) = data.split_once(',').ok_or("the data URI has no comma and so no data")?;
    let body: Vec<u8> = percent_decode_str(body).collect();
    let is_base64 = header.rsplit_once(';').is_some_and(|(_, end)| end.eq_ignore_ascii_case("base64"));
    if is_base64 { decode_base64(&body) } else { Ok(body) }
}

/// RFC 4648, section 4; padding may be missing, white space is skipped.
fn decode_base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count, mut padding) = (0_u32, 0_u32, 0);
    for &byte in text {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => {
                padding += 1;
                continue;
            }
            b' ' | b'\t' | b'\r' | b'\n' => continue,
            _ => return Err("the data URI is not base64".to_owned()),
        };
        if padding > 0 {
            return Err("the data URI goes on after its padding".to_owned());
        }
        bits = (bits << 6) | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    // Six left-over bits are a lone character, which encodes no byte.
    if count >= 6 || padding > 2 {
        return Err("the data URI ends in the middle of a byte".to_owned());
    }
    Ok(bytes)
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn base64() {
        assert_eq!(decode_base64(b"aGVsbG8="), Ok(b"hello".to_vec()));
        assert_eq!(decode_base64(b"aGVsbG8"), Ok(b"hello".to_vec()));
        assert_eq!(decode_base64(b""), Ok(vec![]));
        assert!(decode_base64(b"a").is_err());
        assert!(decode_base64(b"a?==").is_err());
        assert!(decode_base64(b"aG=s").is_err());
    }

    #[test]
    fn schemes_ignore_case_and_long_names_are_cut() {
        let folder = Path::new("models");
        assert_eq!(resolve("DATA:;BASE64,aGVsbG8=", folder), Ok(Location::Data(b"hello".to_vec())));
        assert_eq!(resolve("data:,a%20b", folder), Ok(Location::Data(b"a b".to_vec())));
        let long = "x".repeat(100_000);
        for bad in [long.clone(), format!("http://host/{long}"), format!("/{long}"), format!("{long}:y")] {
            let said = resolve(&bad, folder).unwrap_err();
            assert!(said.len() < 300 && said.contains("x\u{2026}"), "{said}");
        }
    }

    #[test]
    fn from_a_folder_below_a_path_reaches_up_to_that_of_the_model() {
        let (root, library) = (Path::new("models"), Path::new("models/sub/mtl"));
        let file = |name| below(name, library, root);
        assert_eq!(file("a.png"), Ok("models/sub/mtl/a.png".into()));
        assert_eq!(file("..\\..\\a.png"), Ok("models/a.png".into()));
        for bad in ["../../../a.png", "/a.png", "../../../models/a.png"] {
            assert!(file(bad).is_err(), "{bad}");
        }
        assert!(below("a.png", Path::new("elsewhere"), root).is_err());
    }

    #[test]
    fn paths_stay_beside_the_model() {
        let folder = Path::new("models");
        let file = |uri| resolve(uri, folder);
        assert_eq!(file("tex/a%20b.png"), Ok(Location::File("models/tex/a b.png".into())));
        assert_eq!(file("x/../b.png"), Ok(Location::File("models/b.png".into())));
        for bad in [
            "../a.png",
            "x/../../a.png",
            "/etc/passwd",
            "%2Fetc/passwd",
            "%2e%2e/a.png",
            "..\\a.png",
            "http://host/a.png",
            "file:///a.png",
            "C:/a.png",
            "//host/a.png",
            "",
            "a%00b",
        ] {
            assert!(file(bad).is_err(), "{bad}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_only_inside_of_the_folder() {
        let root = tempfile::tempdir().unwrap();
        let models = root.path().join("models");
        std::fs::create_dir(&models).unwrap();
        std::fs::write(models.join("a.png"), "a").unwrap();
        std::fs::write(root.path().join("secret"), "s").unwrap();
        let link = |from: &str, to: &str| std::os::unix::fs::symlink(to, models.join(from)).unwrap();
        link("inside.png", "a.png");
        link("outside.png", "../secret");
        link("up", "..");
        assert!(beside("inside.png", &models).is_ok());
        for bad in ["outside.png", "up/secret"] {
            assert!(beside(bad, &models).unwrap_err().contains("link"), "{bad}");
        }
        // A file that is not there is somebody else's fault.
        assert!(beside("absent.png", &models).is_ok());
    }
}
