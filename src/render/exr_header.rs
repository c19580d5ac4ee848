//! The header of an OpenEXR file, its attributes in a fixed order.
//!
//! Crate `exr` keeps custom attributes in a hash map and writes them in a random order. The format allows
//! any order, so the finished header is sorted: the same picture gives the same bytes. Sizes stay, and
//! with them all offsets in the file.

use std::io::{self, Read, Seek, SeekFrom, Write};

/// Magic number and version.
const PREAMBLE: u64 = 8;

/// Sorts the attributes of a file of one part by name.
pub fn sort_attributes(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    file.seek(SeekFrom::Start(PREAMBLE))?;
    let mut attributes = Vec::new();
    while let Some(attribute) = read_attribute(file)? {
        attributes.push(attribute);
    }
    // They begin with their names, which end with a zero.
    attributes.sort_unstable();
    file.seek(SeekFrom::Start(PREAMBLE))?;
    file.write_all(&attributes.concat())
}

/// Name, type, size and value as they are in the file; `None` at the end of the header.
fn read_attribute(file: &mut impl Read) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    read_text(file, &mut bytes)?;
    if bytes.len() == 1 {
        return Ok(None);
    }
    read_text(file, &mut bytes)?;
    let mut size = [0; 4];
    file.read_exact(&mut size)?;
    bytes.extend(size);
    let size = u32::from_le_bytes(size).into();
    if file.take(size).read_to_end(&mut bytes)? as u64 != size {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(Some(bytes))
}

/// A text with the zero at its end.
fn read_text(file: &mut impl Read, bytes: &mut Vec<u8>) -> io::Result<()> {
    let mut byte = [1];
    while byte != [0] {
        file.read_exact(&mut byte)?;
        bytes.push(byte[0]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn attribute(name: &str, value: &[u8]) -> Vec<u8> {
        [name.as_bytes(), b"\0string\0", &(value.len() as u32).to_le_bytes(), value].concat()
    }

    #[test]
    fn attributes_are_sorted_and_the_rest_stays() {
        let parts = [attribute("b", b"\0\0"), attribute("ab", b"x"), attribute("a", b"yz")];
        let file = |order: [usize; 3]| {
            let header = order.map(|i| parts[i].clone()).concat();
            [b"12345678", &header[..], b"\0pixels"].concat()
        };
        for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
            let mut given = Cursor::new(file(order));
            sort_attributes(&mut given).unwrap();
            assert_eq!(given.into_inner(), file([2, 1, 0]));
        }
    }

    #[test]
    fn a_cut_header_is_an_error() {
        let whole = [b"12345678", &attribute("a", b"value")[..], b"\0"].concat();
        for length in 0..whole.len() {
            assert!(sort_attributes(&mut Cursor::new(whole[..length].to_vec())).is_err());
        }
    }
}
