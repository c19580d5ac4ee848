//! The rows of a tree file. Their layout is in the [format](crate::store).

use super::node::Node;
use crate::store::SectionId;
use bytemuck::{Pod, Zeroable};

pub const META: SectionId = SectionId(*b"META");
pub const TREES: SectionId = SectionId(*b"TREE");
pub const GROUPS: SectionId = SectionId(*b"GRUP");
pub const PARENTS: SectionId = SectionId(*b"PARE");
pub const FRAMES: SectionId = SectionId(*b"FRAM");
pub const LIGHTS: SectionId = SectionId(*b"LGHT");
pub const PATHS: SectionId = SectionId(*b"PATH");
pub const ALL: [SectionId; 7] = [META, TREES, GROUPS, PARENTS, FRAMES, LIGHTS, PATHS];

/// One tree of a file.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct TreeRow {
    /// Its first group, the root's children.
    pub first_group: u32,
    /// How many groups it has, at least 1.
    pub group_count: u32,
    /// How many leaves it has, at least 1.
    pub leaf_count: u32,
    /// Zero.
    pub reserved: u32,
    /// Bounds of everything in it. Its link is not used.
    pub root: Node,
}

/// The lane that leads to a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Parent(u32);

impl Parent {
    /// Of the first group of a tree.
    pub const NONE: Parent = Parent(0);

    /// Lane `lane` of the group so many groups `back`, at least 1.
    pub fn new(back: u32, lane: usize) -> Parent {
        Parent(back << 3 | lane as u32)
    }

    /// How many groups back, and which lane; `None` at the root.
    #[inline]
    pub fn get(self) -> Option<(u32, usize)> {
        (self.0 != 0).then_some((self.0 >> 3, (self.0 & 7) as usize))
    }
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
