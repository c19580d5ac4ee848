//! References to other files: only inside the scene's folder, or in the reference itself.

use super::MOST_FILE_BYTES;
use super::error::Fault;
use crate::scene::SourceFile;
use crate::store::read_regular;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The folder that a scene may read from: the one its file stands in. Remembers what was read.
pub(super) struct Folder {
    path: PathBuf,
    files: Mutex<BTreeSet<SourceFile>>,
}

impl Folder {
    /// The folder of a scene file that exists.
    pub(super) fn of(scene: &Path) -> Result<Folder, Fault> {
        let parent = match scene.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        match fs::canonicalize(parent) {
            Ok(path) => Ok(Folder { path, files: Mutex::default() }),
            Err(error) => Err(Fault::new("folder", error).remedy("check the path")),
        }
    }

    /// The scene's file and all files that were read through this folder.
    pub(super) fn into_files(self, scene: SourceFile) -> Vec<SourceFile> {
        let read = self.files.into_inner().unwrap_or_else(PoisonError::into_inner);
        std::iter::once(scene).chain(read).collect()
    }

    /// The bytes of the file that a glTF URI names, or of the `data:` URI itself.
    pub(super) fn read_uri(&self, uri: &str, object: &str) -> Result<Vec<u8>, Fault> {
        match uri.get(..5) {
            Some(scheme) if scheme.eq_ignore_ascii_case("data:") => {
                decode_data_uri(&uri[5..]).map_err(|problem| Fault::new(object, problem))
            }
            _ => self.read(&self.resolve_uri(uri, object)?, object),
        }
    }

    /// The file that a relative URI names.
    pub(super) fn resolve_uri(&self, uri: &str, object: &str) -> Result<PathBuf, Fault> {
        let refuse = |problem: &str| {
            Fault::new(object, format!("URI {uri:?} {problem}"))
                .remedy("put the file beside the scene and refer to it by a relative URI")
        };
        if has_scheme(uri) {
            return Err(refuse("is absolute; only relative and data: URIs are read"));
        }
        let decoded = percent_decode(uri).and_then(|bytes| String::from_utf8(bytes).ok());
        let decoded = decoded.ok_or_else(|| refuse("is not percent-encoded UTF-8"))?;
        self.resolve(&decoded, object)
    }

    /// The file at a relative path. It must exist, inside the folder, symbolic links followed.
    pub(super) fn resolve(&self, relative: &str, object: &str) -> Result<PathBuf, Fault> {
        let refuse = |problem: String| {
            Fault::new(object, format!("file {relative:?} {problem}"))
                .remedy("put the file into the scene's folder and refer to it by a relative path")
        };
        // Backslashes too: a file must not mean something else on another system.
        let mut inside: Vec<&str> = Vec::new();
        for part in relative.split(['/', '\\']) {
            match part {
                "." => {}
                ".." if inside.pop().is_none() => {
                    return Err(refuse("is outside the scene's folder".into()));
                }
                ".." => {}
                "" if inside.is_empty() => return Err(refuse("is empty or absolute".into())),
                "" => {}
                part if part.contains('\0') || (inside.is_empty() && part.ends_with(':')) => {
                    return Err(refuse("is not a relative path".into()));
                }
                part => inside.push(part),
            }
        }
        let wanted = self.path.join(inside.iter().collect::<PathBuf>());
        let real = fs::canonicalize(&wanted).map_err(|e| refuse(format!("cannot be read: {e}")))?;
        if !real.starts_with(&self.path) {
            return Err(refuse("leads outside the scene's folder".into()));
        }
        if !real.is_file() {
            return Err(refuse("is not a file".into()));
        }
        Ok(real)
    }

    pub(super) fn read(&self, file: &Path, object: &str) -> Result<Vec<u8>, Fault> {
        let bytes = read_regular(file, MOST_FILE_BYTES).map_err(|error| {
            let problem = format!("{} cannot be read: {error}", file.display());
            Fault::new(object, problem).remedy("check the file and its permissions")
        })?;
        let read = SourceFile::new(file.to_path_buf(), &bytes);
        self.files.lock().unwrap_or_else(PoisonError::into_inner).insert(read);
        Ok(bytes)
    }
}

/// RFC 3986: a letter, then letters, digits, `+`, `-`, `.`, up to a colon.
fn has_scheme(uri: &str) -> bool {
    let Some((scheme, _)) = uri.split_once(':') else { return false };
    scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
}

fn percent_decode(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let [high, low, tail @ ..] = rest else { return None };
        let digit = |c: u8| char::from(c).to_digit(16);
        bytes.push((digit(*high)? * 16 + digit(*low)?) as u8);
        rest = tail;
    }
    Some(bytes)
}

/// Decodes what follows `data:`.
fn decode_data_uri(rest: &str) -> Result<Vec<u8>, &'static str> {
    let (kind, data) = rest.split_once(',').ok_or("the data: URI has no comma")?;
    let parameters = kind.split(';').skip(1);
    if parameters.clone().any(str::is_empty) {
        return Err("the data: URI has an empty parameter");
    }
    match parameters.last() {
        Some(encoding) if encoding.eq_ignore_ascii_case("base64") => {
            decode_base64(data.as_bytes()).ok_or("the data: URI is not valid base64")
        }
        _ => percent_decode(data).ok_or("the data: URI is not percent-encoded"),
    }
}

/// RFC 4648, with or without padding.
fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let padding = text.iter().rev().take_while(|&&c| c == b'=').count();
    let digits = &text[..text.len() - padding];
    if padding > 2 || (padding > 0 && !text.len().is_multiple_of(4)) || digits.len() % 4 == 1 {
        return None;
    }
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for group in digits.chunks(4) {
        let mut bits = 0u32;
        for &digit in group {
            bits = bits << 6 | base64_value(digit)?;
        }
        bits <<= 6 * (4 - group.len());
        let decoded = [(bits >> 16) as u8, (bits >> 8) as u8, bits as u8];
        bytes.extend_from_slice(&decoded[..group.len() - 1]);
    }
    Some(bytes)
}

fn base64_value(digit: u8) -> Option<u32> {
    let value = match digit {
        b'A'..=b'Z' => digit - b'A',
        b'a'..=b'z' => digit - b'a' + 26,
        b'0'..=b'9' => digit - b'0' + 52,
        b'+' | b'-' => 62,
        b'/' | b'_' => 63,
        _ => return None,
    };
    Some(value.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_decoded() {
        assert_eq!(decode_base64(b"Zm9vYmFy").unwrap(), b"foobar");
        assert_eq!(decode_base64(b"Zm9vYg==").unwrap(), b"foob");
        assert_eq!(decode_base64(b"Zm9vYg").unwrap(), b"foob");
        assert_eq!(decode_base64(b"").unwrap(), b"");
        for wrong in [&b"Z"[..], b"Zm9v=", b"Zm 9", b"Zm9vY===", b"===="] {
            assert!(decode_base64(wrong).is_none(), "{wrong:?}");
        }
    }

    #[test]
    fn only_what_is_inside_the_folder_is_read() {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("scene");
        fs::create_dir_all(inner.join("sub dir")).unwrap();
        fs::write(outer.path().join("secret"), "secret").unwrap();
        fs::write(inner.join("sub dir/a.bin"), "inside").unwrap();
        std::os::unix::fs::symlink(outer.path().join("secret"), inner.join("link")).unwrap();
        let folder = Folder::of(&inner.join("scene.gltf")).unwrap();
        for uri in ["sub%20dir/a.bin", "./sub dir/a.bin", "x/../sub%20dir/a.bin"] {
            assert_eq!(folder.read_uri(uri, "buffer 0").unwrap(), b"inside");
        }
        assert_eq!(folder.read_uri("data:;base64,AAE", "buffer 0").unwrap(), [0, 1]);
        assert_eq!(folder.read_uri("data:text/plain,a%00", "buffer 0").unwrap(), b"a\0");
        let absolute = outer.path().join("secret").display().to_string();
        for uri in [
            "../secret",
            "..%2Fsecret",
            "%2e%2e/secret",
            "a/../../secret",
            "..\\secret",
            "link",
            "",
            ".",
            "sub dir",
            "absent",
            "%zz",
            "%ff",
            "a%00b",
            "file:///etc/passwd",
            &absolute,
            "http://example.com/a.bin",
            "//host/a",
            "C:\\a.bin",
            "data:;base64",
            "data:;base64,?",
            "data:;;base64,AAE",
            "data:,%z",
        ] {
            assert!(folder.read_uri(uri, "buffer 0").is_err(), "{uri}");
        }
    }
}
