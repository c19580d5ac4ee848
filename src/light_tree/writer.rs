//! Gathers the trees of a shot and lays them out as a file.

use super::builder::{Groups, build_tree};
use super::node::{Link, Node};
use super::records::{self, FrameRow, LightRow, NO_TREE, TreeRow};
use crate::bounds::LightBounds;
use crate::store::{AlignedBytes, ContainerWriter};

/// What a tree file says of one light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSummary {
    /// Prim path.
    pub path: String,
    /// BLAKE3 over everything of the light that the tree depends on.
    pub fingerprint: [u8; 32],
    /// How many emitters it has.
    pub emitter_count: u32,
    /// Their energy, summed.
    pub energy: f32,
    /// Whether it moves within the shot.
    pub moves: bool,
}

/// Builds the trees of a shot, one after the other, and writes them down.
#[derive(Default)]
pub struct LightTreeWriter {
    trees: Vec<TreeRow>,
    groups: Groups,
    frames: Vec<FrameRow>,
    lights: Vec<LightRow>,
    paths: Vec<u8>,
    emitter_count: u32,
}

impl LightTreeWriter {
    /// Builds a tree over some bounds and returns its row; `stands_for` tells what each of them is:
    /// an emitter or a tree added earlier. No bounds give no tree.
    pub fn add_tree(
        &mut self,
        bounds: &[LightBounds],
        stands_for: impl Fn(usize) -> Link + Sync,
    ) -> Option<u32> {
        let first_group = self.groups.groups.len();
        let root = build_tree(bounds, &stands_for, &mut self.groups)?;
        self.trees.push(TreeRow {
            first_group: first_group as u32,
            group_count: (self.groups.groups.len() - first_group) as u32,
            leaf_count: bounds.len() as u32,
            reserved: 0,
            root: Node::encode(&root, Link::Nothing),
        });
        Some(self.trees.len() as u32 - 1)
    }

    /// The bounds of a whole tree, as a leaf of another has them.
    pub fn bounds_of(&self, tree: u32) -> LightBounds {
        self.trees[tree as usize].root.bounds()
    }

    /// Says which tree a frame samples. Frames must be added in ascending order. Without any, every
    /// frame samples tree 0.
    pub fn add_frame(&mut self, frame: i32, tree: Option<u32>) {
        self.frames.push(FrameRow { frame, tree: tree.unwrap_or(NO_TREE) });
    }

    /// Adds a light; its emitters are numbered after those of the lights before it.
    pub fn add_light(&mut self, light: &LightSummary) {
        self.lights.push(LightRow {
            fingerprint: light.fingerprint,
            first_emitter: self.emitter_count,
            emitter_count: light.emitter_count,
            path_offset: self.paths.len() as u32,
            path_length: light.path.len() as u32,
            energy: light.energy,
            moves: light.moves.into(),
            reserved: [0; 2],
        });
        self.emitter_count += light.emitter_count;
        self.paths.extend_from_slice(light.path.as_bytes());
    }

    /// The bytes of the file.
    pub fn finish(self, meta: &str, fingerprint: [u8; 32]) -> AlignedBytes {
        let mut file = ContainerWriter::default();
        file.section(records::META, false, meta.as_bytes());
        file.section(records::TREES, true, &self.trees);
        file.section(records::GROUPS, true, &self.groups.groups);
        file.section(records::PARENTS, true, &self.groups.parents);
        if !self.frames.is_empty() {
            file.section(records::FRAMES, true, &self.frames);
        }
        file.section(records::LIGHTS, true, &self.lights);
        file.section(records::PATHS, true, &self.paths);
        file.finish(fingerprint)
    }
}
