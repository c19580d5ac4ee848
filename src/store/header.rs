//! What a file begins with: its kind, its version, its length.

use super::StoreError;
use bytemuck::{Pod, Zeroable};

/// The first eight bytes: one with the high bit set, a name, and the line ends that a transfer in
/// text mode would change (PNG's manner).
pub const MAGIC: [u8; 8] = *b"\x89LTR\r\n\x1a\n";
/// Readers refuse another major version and read every minor one.
pub const VERSION: (u16, u16) = (1, 4);

/// A kind of file: what it begins with, and its version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Form {
    /// The first bytes, after the manner of [`MAGIC`].
    pub magic: [u8; 8],
    /// Readers refuse another major version and read every minor one.
    pub version: (u16, u16),
}

/// Tree files.
pub const TREE_FILE: Form = Form { magic: MAGIC, version: VERSION };

pub(super) const BYTE_ORDER_MARK: u32 = 0x0102_0304;
/// What stands before the section table.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Header {
    pub magic: [u8; 8],
    pub major: u16,
    pub minor: u16,
    pub byte_order: u32,
    pub file_length: u64,
    pub section_count: u32,
    /// CRC-32 of header and table, with this field zero.
    pub checksum: u32,
    pub fingerprint: [u8; 32],
}

pub(super) const HEADER_SIZE: usize = size_of::<Header>();

/// The header of a file of a kind.
pub(super) fn read_header(form: &Form, bytes: &[u8]) -> Result<Header, StoreError> {
    let start = &bytes[..bytes.len().min(form.magic.len())];
    if start != form.magic {
        // What `\r\n` -> `\n`, `\n` -> `\r\n` and a cleared high bit leave of the magic.
        let [high, a, b, c, ..] = form.magic;
        let text_mode: [&[u8]; 3] = [
            &[high, a, b, c, b'\n', 0x1a, b'\n'],
            &[high, a, b, c, b'\r', b'\r', b'\n', 0x1a],
            &[high & 0x7f, a, b, c, b'\r', b'\n', 0x1a, b'\n'],
        ];
        let damaged = text_mode.iter().any(|form| bytes.starts_with(form));
        return Err(if damaged { StoreError::TextMode } else { StoreError::NotOurs });
    }
    if bytes.len() < HEADER_SIZE {
        return Err(StoreError::Length {
            promised: HEADER_SIZE as u64,
            actual: bytes.len() as u64,
        });
    }
    let header: Header = bytemuck::pod_read_unaligned(&bytes[..HEADER_SIZE]);
    if header.byte_order != BYTE_ORDER_MARK {
        return Err(StoreError::ByteOrder);
    }
    if header.major != form.version.0 {
        return Err(StoreError::Version { found: header.major, known: form.version.0 });
    }
    Ok(header)
}
