//! The rows of a tree file. Their layout is in the [format](crate::store).

use super::node::Node;
use crate::store::SectionId;
use bytemuck::{Pod, Zeroable};

pub const META: SectionId = SectionId(*b"META");
pub const TREES: SectionId = SectionId(*b"TREE");
pub const NODES: SectionId = SectionId(*b"NODE");
pub const LEAVES: SectionId = SectionId(*b"LEAF");
pub const FRAMES: SectionId = SectionId(*b"FRAM");
pub const LIGHTS: SectionId = SectionId(*b"LGHT");
pub const PATHS: SectionId = SectionId(*b"PATH");
pub const ALL: [SectionId; 7] = [META, TREES, NODES, LEAVES, FRAMES, LIGHTS, PATHS];

/// One tree of a file.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct TreeRow {
    /// Its first pair; a tree of n leaves has n - 1.
    pub first_pair: u32,
    /// Its first leaf.
    pub first_leaf: u32,
    /// How many leaves it has, at least 1.
    pub leaf_count: u32,
    /// Zero.
    pub reserved: u32,
    /// Bounds of everything in it, and where it begins.
    pub root: Node,
}

/// Which tree a frame samples.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct FrameRow {
    /// The frame's number.
    pub frame: i32,
    /// Row of its tree; `u32::MAX` if nothing shines.
    pub tree: u32,
}

/// The tree of a frame in which nothing shines.
pub const NO_TREE: u32 = u32::MAX;

/// One light: a run of emitters.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct LightRow {
    /// BLAKE3 over everything of the light that the tree depends on.
    pub fingerprint: [u8; 32],
    /// Its first emitter.
    pub first_emitter: u32,
    /// How many emitters it has.
    pub emitter_count: u32,
    /// Where its path begins in `PATH`.
    pub path_offset: u32,
    /// Length of its path in bytes.
    pub path_length: u32,
    /// Energy of its emitters, summed (of a moving light at its first frame).
    pub energy: f32,
    /// 1 if it moves, else 0.
    pub moves: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

const TREE_BIT: u32 = 1 << 31;

/// What a leaf stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafContent {
    /// An emitter, by number.
    Emitter(u32),
    /// A whole tree, by row.
    Tree(u32),
}

impl LeafContent {
    /// As the file has it.
    #[inline]
    pub fn encode(self) -> u32 {
        match self {
            LeafContent::Emitter(emitter) => emitter,
            LeafContent::Tree(row) => row | TREE_BIT,
        }
    }

    /// From the file.
    #[inline]
    pub fn decode(code: u32) -> LeafContent {
        if code & TREE_BIT == 0 {
            LeafContent::Emitter(code)
        } else {
            LeafContent::Tree(code & !TREE_BIT)
        }
    }
}
