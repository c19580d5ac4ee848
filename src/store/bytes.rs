//! Bytes in memory with the alignment of a mapped file.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

/// Sections start at multiples of this, so that any plain-old-data type can be viewed in place and
/// no node straddles two cache lines.
pub const ALIGNMENT: usize = 64;

/// The fewest blocks that one task zeroes.
const TOGETHER: usize = 1 << 12;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Block([u8; ALIGNMENT]);

/// A growable byte buffer that starts at a multiple of [`ALIGNMENT`].
#[derive(Clone, Default)]
pub struct AlignedBytes {
    blocks: Vec<Block>,
    length: usize,
}

impl AlignedBytes {
    /// A zeroed buffer of `length` bytes.
    pub fn zeroed(length: usize) -> AlignedBytes {
        // Side by side: memory costs most when it is touched for the first time.
        let blocks = (0..length.div_ceil(ALIGNMENT)).into_par_iter().with_min_len(TOGETHER);
        AlignedBytes { blocks: blocks.map(|_| Block::zeroed()).collect(), length }
    }

    /// A copy of some bytes.
    pub fn copy_of(bytes: &[u8]) -> AlignedBytes {
        let mut copy = AlignedBytes::zeroed(bytes.len());
        copy.as_mut().copy_from_slice(bytes);
        copy
    }
}

impl AsRef<[u8]> for AlignedBytes {
    fn as_ref(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.blocks)[..self.length]
    }
}

impl AsMut<[u8]> for AlignedBytes {
    fn as_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.blocks)[..self.length]
    }
}
