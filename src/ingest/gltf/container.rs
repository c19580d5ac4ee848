//! The bytes of a `.gltf` or `.glb` file: where its JSON is, and its binary chunk.
//!
//! Crate `gltf`'s `Glb` finds them too, but it overflows on a length below 12, reads beyond the length
//! that the header says, and refuses unknown chunks, which should be skipped.

use crate::ingest::error::Fault;
use crate::ingest::notes::Notes;
use crate::scene::Category;
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
    pub(super) fn parse(
        bytes: Vec<u8>,
        must_be_glb: bool,
        notes: &mut Notes,
    ) -> Result<Container, Fault> {
        if bytes.starts_with(MAGIC) {
            return Container::parse_glb(bytes, notes);
        }
        if must_be_glb {
            if bytes.trim_ascii_start().first() != Some(&b'{') {
                return Err(Fault::new("header", "does not start with the bytes glTF")
                    .remedy("the file is not a GLB or is damaged; fetch or export it again"));
            }
            notes.add(Category::Other, "file", "is called .glb but holds JSON; read as .gltf");
        }
        let json = 0..bytes.len();
        Ok(Container { bytes, json, binary: None })
    }

    pub(super) fn json(&self) -> &[u8] {
        &self.bytes[self.json.clone()]
    }

    /// Without the JSON, once it is parsed, where that is all there is.
    pub(super) fn parsed(mut self) -> Container {
        if self.binary.is_none() {
            self.json = 0..0;
            self.bytes.truncate(MAGIC.len());
            self.bytes.shrink_to_fit();
        }
        self
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

    fn parse_glb(bytes: Vec<u8>, notes: &mut Notes) -> Result<Container, Fault> {
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
        let mut note = |object: &str, text: &str| notes.add(Category::Other, object, text);
        let mut end = length as usize;
        if end > bytes.len() || end < HEADER_BYTES + CHUNK_HEADER_BYTES {
            note("header", "says another length than the file has; the chunks are read to its end");
            end = bytes.len();
        }
        let (mut json, mut binary) = (None, None);
        let (mut at, mut number) = (HEADER_BYTES, 0);
        while at < end {
            let object = format!("chunk {number}");
            let start = at + CHUNK_HEADER_BYTES;
            let header = word(&bytes[..end], at).zip(word(&bytes[..end], at + 4));
            let Some((size, kind)) = header else {
                note(&object, "its header ends too early; left out");
                break;
            };
            let room = end - start;
            let size = size as usize;
            if size > room {
                // Whether anything is missing that is used is found out by what uses it.
                if kind != BIN {
                    return damaged(&object, format!("says {size} bytes, but {room} are left"));
                }
                note(&object, "says more bytes than are left");
            }
            let part = start..start + size.min(room);
            at = next_chunk(&bytes[..end], &part);
            if !size.is_multiple_of(4) {
                note(&object, "its length is not a multiple of 4");
            }
            match kind {
                JSON if json.is_none() => json = Some(part),
                BIN if binary.is_none() => binary = Some(part),
                JSON | BIN => note(&object, "repeats what an earlier chunk is for; left out"),
                _ => {}
            }
            number += 1;
        }
        match json {
            Some(json) => Ok(Container { bytes, json, binary }),
            None => damaged("header", "there is no JSON chunk".into()),
        }
    }
}

/// Where the chunk after one begins. Chunks are padded to four bytes, and their lengths should say so; some
/// writers leave the padding out of the length, others leave it out.
fn next_chunk(bytes: &[u8], part: &Range<usize>) -> usize {
    let padded = part.end.next_multiple_of(4);
    let is_header = |at: usize| {
        let fits = word(bytes, at).is_some_and(|size| size as usize <= bytes.len() - at);
        fits && matches!(word(bytes, at + 4), Some(JSON | BIN))
    };
    if padded == part.end || is_header(part.end) { part.end } else { padded }
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

    /// The parts, and how many notes there are.
    fn parse(bytes: Vec<u8>) -> Result<(Container, usize), Fault> {
        let mut notes = Notes::default();
        let file = Container::parse(bytes, true, &mut notes)?;
        Ok((file, notes.into_list().len()))
    }

    #[test]
    fn chunks_are_found() {
        let (file, notes) = parse(glb(&[(JSON, b"{}  "), (BIN, b"1234")])).unwrap();
        assert_eq!((file.json(), file.binary()), (&b"{}  "[..], Some(&b"1234"[..])));
        assert_eq!(notes, 0);
        let (file, notes) = parse(glb(&[(JSON, b"{}  "), (7, b""), (9, b"abcd")])).unwrap();
        assert_eq!((file.binary(), notes), (None, 0));
    }

    #[test]
    fn lengths_without_their_padding_are_taken() {
        // The padding is there, but not in the length; then it is not there at all.
        let mut padded = glb(&[(JSON, b"{}  "), (BIN, b"1234")]);
        padded[12] = 2;
        for bytes in [padded, glb(&[(JSON, b"{}"), (BIN, b"1234")])] {
            let (file, notes) = parse(bytes).unwrap();
            assert_eq!((file.json(), file.binary()), (&b"{}"[..], Some(&b"1234"[..])));
            assert_eq!(notes, 1);
        }
    }

    #[test]
    fn lying_lengths_do_no_harm() {
        let good = glb(&[(JSON, b"{}  "), (BIN, b"1234")]);
        for cut in 0..good.len() {
            // Whole JSON is all that there must be.
            assert_eq!(parse(good[..cut].to_vec()).is_ok(), cut >= 24, "cut at {cut}");
        }
        for at in [8, 12, 24] {
            for lie in [u32::MAX, 0, 1, 5, 11, 12, 19, 1 << 31] {
                let mut bad = good.clone();
                bad[at..at + 4].copy_from_slice(&lie.to_le_bytes());
                assert!(parse(bad).map_or(true, |(_, notes)| notes > 0), "{lie} at {at}");
            }
        }
        let (_, notes) = parse([good, b"more".to_vec()].concat()).unwrap();
        assert_eq!(notes, 0, "bytes after the end are no chunk");
    }

    #[test]
    fn the_first_chunk_of_a_kind_counts_wherever_it_is() {
        for (chunks, notes) in [
            (&[(BIN, &b"1234"[..]), (JSON, b"{}  ")][..], 0),
            (&[(JSON, b"{}  "), (JSON, b"[]  "), (BIN, b"1234")], 1),
            (&[(JSON, b"{}  "), (BIN, b"1234"), (BIN, b"5678")], 1),
            (&[(JSON, b"{}  "), (9, b""), (BIN, b"1234")], 0),
        ] {
            let (file, told) = parse(glb(chunks)).unwrap();
            assert_eq!((file.json(), file.binary()), (&b"{}  "[..], Some(&b"1234"[..])));
            assert_eq!(told, notes);
        }
        assert!(parse(glb(&[(BIN, b"1234")])).is_err() && parse(glb(&[])).is_err());
    }
}
