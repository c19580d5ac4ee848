//! The bytes of a `.gltf` or `.glb` file: where its JSON is, and its binary chunk.
//!
//! Crate `gltf`'s `Glb` finds them too, but overflows on a length below 12, reads beyond the length
//! that the header says, refuses unknown chunks, which are to be skipped, and does not look at what
//! follows the second. Who checks all that has found the parts.

use crate::ingest::error::Fault;
use std::ops::Range;

const MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// A glTF file in memory. The parts are ranges, so that no byte is copied.
pub(super) struct Container {
    bytes: Vec<u8>,
    json: Range<usize>,
    binary: Option<Range<usize>>,
}

impl Container {
    /// Finds the parts. A file without GLB's magic is all JSON.
    pub(super) fn parse(bytes: Vec<u8>, must_be_glb: bool) -> Result<Container, Fault> {
        if bytes.starts_with(MAGIC) {
            return Container::parse_glb(bytes);
        }
        if must_be_glb {
            return Err(Fault::new("header", "does not start with the bytes glTF")
                .remedy("the file is not a GLB or is damaged; fetch or export it again"));
        }
        let json = 0..bytes.len();
        Ok(Container { bytes, json, binary: None })
    }

    pub(super) fn json(&self) -> &[u8] {
        &self.bytes[self.json.clone()]
    }

    pub(super) fn binary(&self) -> Option<&[u8]> {
        Some(&self.bytes[self.binary.clone()?])
    }

    pub(super) fn is_glb(&self) -> bool {
        self.bytes.starts_with(MAGIC)
    }

    pub(super) fn size(&self) -> usize {
        self.bytes.len()
    }

    fn parse_glb(bytes: Vec<u8>) -> Result<Container, Fault> {
        let damaged = |object: &str, problem: String| {
            Err(Fault::new(object, problem).remedy("the file is damaged; fetch or export it again"))
        };
        let (Some(version), Some(length)) = (word(&bytes, 4), word(&bytes, 8)) else {
            return damaged("header", "ends too early".into());
        };
        if version != 2 {
            return Err(Fault::new("header", format!("GLB version {version} is not supported"))
                .remedy("export glTF 2.0"));
        }
        let length = length as usize;
        if length > bytes.len() {
            let problem = format!("says {length} bytes, but the file has {}", bytes.len());
            return damaged("header", problem);
        }
        let (mut json, mut binary) = (None, None);
        let (mut at, mut number) = (HEADER_BYTES, 0);
        while at < length {
            let object = format!("chunk {number}");
            let start = at + CHUNK_HEADER_BYTES;
            if start > length {
                return damaged(&object, "its header ends too early".into());
            }
            // The header is inside the file, so both words are.
            let size = word(&bytes, at).unwrap_or(0) as usize;
            let kind = word(&bytes, at + 4).unwrap_or(0);
            if size > length - start {
                let room = length - start;
                return damaged(&object, format!("says {size} bytes, but {room} are left"));
            }
            if !size.is_multiple_of(4) {
                return damaged(&object, format!("its length {size} is not a multiple of 4"));
            }
            match (kind, number) {
                (JSON, 0) => json = Some(start..start + size),
                (BIN, 1) => binary = Some(start..start + size),
                (JSON | BIN, _) => return damaged(&object, "repeated or out of order".into()),
                (_, 0) => return damaged(&object, "the first chunk is not JSON".into()),
                _ => {}
            }
            (at, number) = (start + size, number + 1);
        }
        match json {
            Some(json) => Ok(Container { bytes, json, binary }),
            None => damaged("header", "there is no JSON chunk".into()),
        }
    }
}

/// The little-endian word at an offset.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, data) in chunks {
            bytes.extend((data.len() as u32).to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(*data);
        }
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        bytes
    }

    #[test]
    fn chunks_are_found() {
        let file = Container::parse(glb(&[(JSON, b"{}  "), (BIN, b"1234")]), true).unwrap();
        assert_eq!((file.json(), file.binary()), (&b"{}  "[..], Some(&b"1234"[..])));
        let file = Container::parse(glb(&[(JSON, b"{}  "), (7, b""), (9, b"abcd")]), true).unwrap();
        assert_eq!(file.binary(), None);
    }

    #[test]
    fn lying_lengths_are_refused() {
        let good = glb(&[(JSON, b"{}  "), (BIN, b"1234")]);
        for cut in 4..good.len() {
            assert!(Container::parse(good[..cut].to_vec(), true).is_err(), "cut at {cut}");
        }
        for at in [8, 12, 24] {
            for lie in [u32::MAX, 5, 1 << 31] {
                let mut bad = good.clone();
                bad[at..at + 4].copy_from_slice(&lie.to_le_bytes());
                assert!(Container::parse(bad, true).is_err(), "{lie} at {at}");
            }
        }
        let with_more = [good, b"more".to_vec()].concat();
        assert!(Container::parse(with_more, true).is_ok(), "bytes after the end are no chunk");
    }

    #[test]
    fn chunks_out_of_order_are_refused() {
        for chunks in [
            &[(BIN, &b"1234"[..])][..],
            &[(BIN, b"1234"), (JSON, b"{}  ")],
            &[(JSON, b"{}  "), (JSON, b"{}  ")],
            &[(JSON, b"{}  "), (BIN, b"1234"), (BIN, b"1234")],
            &[(JSON, b"{}  "), (9, b""), (BIN, b"1234")],
            &[],
        ] {
            assert!(Container::parse(glb(chunks), true).is_err());
        }
    }
}
