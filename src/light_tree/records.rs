//! The rows of a tree file. Their layout is in the [format](crate::store).

use super::node::Node;
use crate::math::Similarity;
use crate::math::color::Rgb;
use crate::store::SectionId;
use bytemuck::{Pod, Zeroable};

pub const META: SectionId = SectionId(*b"META");
pub const TREES: SectionId = SectionId(*b"TREE");
pub const GROUPS: SectionId = SectionId(*b"GRUP");
pub const INSTANCES: SectionId = SectionId(*b"INST");
pub const FRAMES: SectionId = SectionId(*b"FRAM");
pub const FINGERPRINTS: SectionId = SectionId(*b"FPRT");
pub const FORCED: SectionId = SectionId(*b"FORC");
pub const LIGHTS: SectionId = SectionId(*b"LGHT");
pub const PATHS: SectionId = SectionId(*b"PATH");
pub const TEXTURES: SectionId = SectionId(*b"TXTR");
pub const MEANS: SectionId = SectionId(*b"MEAN");
pub const LINKS: SectionId = SectionId(*b"LINK");
pub const ALL: [SectionId; 12] = [
    META,
    TREES,
    GROUPS,
    INSTANCES,
    FRAMES,
    FINGERPRINTS,
    FORCED,
    LIGHTS,
    PATHS,
    TEXTURES,
    MEANS,
    LINKS,
];

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
    /// A [`TreeKind`].
    pub kind: u32,
    /// Bounds of everything in it. Its link is not used.
    pub root: Node,
}

/// What a tree is for. Trees stand in this order in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum TreeKind {
    /// One light, in its own space: shared by its instances, or carried along, or forced.
    Shared = 0,
    /// All lights that stand still. A file has at most one such tree.
    Still = 1,
    /// All lights that change, as they are in one frame. A leaf stands for the tree of what stands still,
    /// if there is one.
    Frame = 2,
}

impl TreeKind {
    /// The kind of a row, if it has one.
    pub fn of(row: &TreeRow) -> Option<TreeKind> {
        [TreeKind::Shared, TreeKind::Still, TreeKind::Frame]
            .into_iter()
            .find(|&kind| kind as u32 == row.kind)
    }
}

/// A tree placed in the scene. A leaf that is not an emitter stands for one.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct InstanceRow {
    /// From world space into the tree's own.
    pub to_local: Similarity,
    /// Row of the tree.
    pub tree: u32,
    /// The tree's emitters are numbered from here on.
    pub first_emitter: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

/// Which tree a frame samples.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct FrameRow {
    /// The frame's number.
    pub frame: i32,
    /// Row of its tree; `u32::MAX` if nothing shines.
    pub tree: u32,
    /// Its forced lights: entries of `FORC` from here on.
    pub first_forced: u32,
    /// How many forced lights it has.
    pub forced_count: u32,
}

/// Where the kinds of emitters begin, which are numbered one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Numbering {
    /// The first emitter of a light of class 1, 2, 3 and 4, or beyond.
    pub first_of_class: [u32; 4],
    /// How many emitters there are.
    pub count: u32,
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
    /// Energy of its emitters, summed; in its first frame if the light changes.
    pub energy: f32,
    /// Sum of [`CHANGES`](LightRow::CHANGES), [`PLACED`](LightRow::PLACED) and
    /// [`FORCED`](LightRow::FORCED).
    pub class: u32,
    /// What it looks like.
    pub look: LightLook,
}

/// What a light looks like, for people who compare files; in its first frame if the light changes. No
/// tree depends on it, so it is not in the fingerprint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LightLook {
    /// 0 if unknown; else one of [`MESH`](LightLook::MESH), [`POINT`](LightLook::POINT),
    /// [`SPOT`](LightLook::SPOT) and [`SPHERE`](LightLook::SPHERE).
    pub kind: u16,
    /// Its hue, linear Rec. 709 times 65535, the largest component 65535; zero if it is dark.
    pub color: [u16; 3],
}

impl LightLook {
    /// A mesh that emits.
    pub const MESH: u16 = 1;
    /// A point.
    pub const POINT: u16 = 2;
    /// A point that aims.
    pub const SPOT: u16 = 3;
    /// A sphere.
    pub const SPHERE: u16 = 4;

    /// A look, from a colour of any strength.
    pub fn new(kind: u16, color: Rgb) -> LightLook {
        let largest = color.max_element();
        let hue = if largest > 0.0 { color / largest } else { Rgb::ZERO };
        LightLook { kind, color: (hue * 65535.0).round().to_array().map(|c| c as u16) }
    }

    /// Its hue, linear Rec. 709, the largest component 1; `None` if it is dark or not told.
    pub fn hue(&self) -> Option<Rgb> {
        let hue = Rgb::from(self.color.map(|c| f32::from(c) / 65535.0));
        (hue != Rgb::ZERO).then_some(hue)
    }

    /// Whether its fields have values that a writer gives them.
    pub(super) fn is_sound(&self) -> bool {
        let largest = self.color.iter().max();
        self.kind <= LightLook::SPHERE && matches!(largest, Some(0 | 65535))
    }
}

impl LightRow {
    /// It moves, deforms or its brightness changes: frames have trees of their own for it.
    pub const CHANGES: u32 = 2;
    /// Its emitters are in a shared tree, which an instance places.
    pub const PLACED: u32 = 1;
    /// It is in no tree but its own and is always sampled.
    pub const FORCED: u32 = 4;

    /// Whether its class has a property.
    pub fn is(&self, property: u32) -> bool {
        self.class & property != 0
    }
}

/// A mesh with an emission texture: a run of [`MeanRow`]s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct TextureRow {
    /// BLAKE3 over everything that the means depend on.
    pub fingerprint: [u8; 32],
    /// Its first mean.
    pub first: u32,
    /// How many it has.
    pub count: u32,
}

/// The mean of a texture over a triangle that is not dark.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeanRow {
    /// The triangle's number in its mesh.
    pub triangle: u32,
    /// Linear Rec. 709.
    pub mean: [f32; 3],
}

impl MeanRow {
    /// Whether it is what a mean can be: finite, not negative, and not black.
    pub(super) fn is_sound(&self) -> bool {
        let is_light = |&part: &f32| part.is_finite() && part >= 0.0;
        self.mean.iter().all(is_light) && self.mean != [0.0; 3]
    }
}
