//! Gathers the trees of a shot and lays them out as a file.

use super::base::{Base, Leaf};
use super::builder::build_tree;
use super::group::Group;
use super::node::{Link, Node};
use super::records::{
    self, FrameRow, InstanceRow, LightLook, LightRow, MeanRow, NO_TREE, TextureRow, TreeKind,
    TreeRow,
};
use super::tree::LightTree;
use crate::bounds::LightBounds;
use crate::math::Similarity;
use crate::store::{AlignedBytes, ContainerWriter};
use rayon::prelude::*;

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
    /// Sum of [`LightRow::CHANGES`], [`LightRow::PLACED`] and [`LightRow::FORCED`].
    pub class: u32,
    /// What it looks like.
    pub look: LightLook,
    /// Its [link number](LightTree::light_links): 0 if it lights everything.
    pub link: u32,
}

/// The lights of a file, in their order, and where each begins.
pub struct LightList<'a> {
    pub(super) lights: &'a [LightSummary],
    /// For each light its first emitter, and where its path begins among all paths, bytes.
    pub(super) starts: Vec<(u32, u32)>,
    /// The link number of each; empty if all are 0.
    links: Vec<u32>,
    /// Length of all paths together, bytes.
    path_length: usize,
}

impl<'a> LightList<'a> {
    /// The list of some lights. Emitters are numbered in their order.
    pub fn new(lights: &'a [LightSummary]) -> LightList<'a> {
        let size = |light: &LightSummary| (light.emitter_count, light.path.len() as u32);
        // Summaries are large: their sizes are read in parallel, then summed one by one.
        let mut starts: Vec<_> = lights.par_iter().map(size).collect();
        let (mut next_emitter, mut path_length) = (0, 0_usize);
        for start in &mut starts {
            // Paths of 4 GiB in all would wrap here: such a file is refused before it is written.
            let (emitters, length) = std::mem::replace(start, (next_emitter, path_length as u32));
            next_emitter += emitters;
            path_length += length as usize;
        }
        let is_linked = lights.par_iter().any(|light| light.link != 0);
        let links =
            if is_linked { lights.iter().map(|light| light.link).collect() } else { Vec::new() };
        LightList { lights, starts, links, path_length }
    }

    /// A row of the section of lights.
    pub fn row(&self, at: usize) -> LightRow {
        let light = &self.lights[at];
        let (first_emitter, path_offset) = self.starts[at];
        LightRow {
            fingerprint: light.fingerprint,
            first_emitter,
            emitter_count: light.emitter_count,
            path_offset,
            path_length: light.path.len() as u32,
            energy: light.energy,
            class: light.class,
            look: light.look,
        }
    }

    /// Writes the section of paths.
    fn write_paths(&self, mut place: &mut [u8]) {
        for path in self.lights.iter().map(|light| light.path.as_bytes()) {
            let (own, behind) = place.split_at_mut(path.len());
            own.copy_from_slice(path);
            place = behind;
        }
    }
}

/// Builds the trees of a shot, one after the other, and writes them down.
#[derive(Default)]
pub struct LightTreeWriter<'a> {
    base: Option<Base<'a>>,
    reused: usize,
    trees: Vec<TreeRow>,
    groups: Vec<Group>,
    instances: Vec<InstanceRow>,
    frames: Vec<FrameRow>,
    fingerprints: Vec<[u8; 32]>,
    forced: Vec<u32>,
    textures: Vec<TextureRow>,
    means: Vec<MeanRow>,
}

impl<'a> LightTreeWriter<'a> {
    /// A writer that copies whatever has not changed from an earlier file. It writes the same bytes as
    /// it would without that file.
    pub fn upon(base: Base<'a>) -> LightTreeWriter<'a> {
        LightTreeWriter { base: Some(base), ..LightTreeWriter::default() }
    }

    /// Whether the base was found to [contradict](Base::contradicts) the bounds so far. If so, what was
    /// built upon it must not be used.
    pub fn base_contradicts(&self) -> bool {
        self.base.as_ref().is_some_and(Base::contradicts)
    }

    /// How many leaves the trees have so far.
    pub fn leaf_count(&self) -> usize {
        self.trees.iter().map(|tree| tree.leaf_count as usize).sum()
    }

    /// How many leaves were taken over from the base so far.
    pub fn reused_leaf_count(&self) -> usize {
        self.reused
    }

    /// Builds a tree over some bounds and returns its row; `stands_for` tells what each of them is:
    /// an emitter or an instance of a tree added earlier. No bounds give no tree. Trees must be added
    /// in the order of their kinds.
    pub fn add_tree(
        &mut self,
        kind: TreeKind,
        bounds: &[LightBounds],
        stands_for: impl Fn(usize) -> Link + Sync,
    ) -> Option<u32> {
        let first_group = self.groups.len();
        let mut groups = std::mem::take(&mut self.groups);
        let leaf = |i| self.leaf(stands_for(i));
        let earlier = || match kind {
            TreeKind::Shared => None,
            TreeKind::Still => self.base.as_ref()?.still(bounds, leaf),
            TreeKind::Frame => self.base.as_ref()?.frame(self.frames.len(), bounds, leaf),
        };
        let built = build_tree(bounds, &stands_for, earlier, &mut groups);
        self.groups = groups;
        let (root, reused) = built?;
        self.reused += reused;
        self.trees.push(TreeRow {
            first_group: first_group as u32,
            group_count: (self.groups.len() - first_group) as u32,
            leaf_count: bounds.len() as u32,
            kind: kind as u32,
            root: Node::encode(&root, Link::Nothing),
        });
        Some(self.trees.len() as u32 - 1)
    }

    /// Copies the `nth` tree that a light has for itself in the base, and returns its row; `None` if the
    /// light has changed. `light` is the light's place among those of the new file, `bounds` are its
    /// bounds now.
    pub fn add_tree_of_base(
        &mut self,
        light: usize,
        nth: usize,
        bounds: &[LightBounds],
    ) -> Option<u32> {
        let (row, groups) = self.base.as_ref()?.own_tree(light, nth, bounds)?;
        self.reused += row.leaf_count as usize;
        self.trees.push(TreeRow { first_group: self.groups.len() as u32, ..*row });
        self.groups.extend_from_slice(groups);
        Some(self.trees.len() as u32 - 1)
    }

    /// Adds a tree of another file as it is, and returns its row. Instances that its leaves stand for must
    /// have the same rows in both files.
    pub fn add_copy<D: AsRef<[u8]>>(&mut self, file: &LightTree<D>, row: u32) -> u32 {
        let tree = &file.trees()[row as usize];
        self.trees.push(TreeRow { first_group: self.groups.len() as u32, ..*tree });
        self.groups.extend_from_slice(file.groups_of(tree));
        self.trees.len() as u32 - 1
    }

    fn leaf(&self, link: Link) -> Leaf {
        match link {
            Link::Instance(row) => {
                let InstanceRow { tree, first_emitter, .. } = self.instances[row as usize];
                let tree = self.trees[tree as usize];
                match TreeKind::of(&tree) {
                    Some(TreeKind::Shared) => Leaf::Emitter(first_emitter),
                    _ => Leaf::Below(tree),
                }
            }
            Link::Emitter(emitter) => Leaf::Emitter(emitter),
            Link::Nothing | Link::Inner(_) => unreachable!("bounds stand for something"),
        }
    }

    /// The bounds of a whole tree in its own space. A leaf that stands for the tree needs them.
    pub fn bounds_of(&self, tree: u32) -> LightBounds {
        self.trees[tree as usize].root.bounds()
    }

    /// Places a tree, its emitters numbered from `first_emitter` on; returns the row of the
    /// instance. `to_local` leads from world space to the tree's own.
    pub fn add_instance(&mut self, tree: u32, to_local: Similarity, first_emitter: u32) -> u32 {
        self.instances.push(InstanceRow { to_local, tree, first_emitter, reserved: [0; 2] });
        self.instances.len() as u32 - 1
    }

    /// Says which tree a frame samples and which instances are of forced lights; `fingerprint` is BLAKE3 over
    /// what changes, as it is in this frame. Frames must be added in ascending order. Without any, every
    /// frame samples the tree of what stands still.
    pub fn add_frame(
        &mut self,
        frame: i32,
        fingerprint: [u8; 32],
        tree: Option<u32>,
        forced: &[u32],
    ) {
        let first_forced = self.forced.len() as u32;
        let forced_count = forced.len() as u32;
        self.forced.extend_from_slice(forced);
        let tree = tree.unwrap_or(NO_TREE);
        self.frames.push(FrameRow { frame, tree, first_forced, forced_count });
        self.fingerprints.push(fingerprint);
    }

    /// Says which instances are of forced lights where there are no frames.
    pub fn add_forced(&mut self, instances: &[u32]) {
        self.forced.extend_from_slice(instances);
    }

    /// Keeps the means of a texture over the triangles of a mesh, the triangles ascending. Textures
    /// must be added by ascending fingerprint.
    pub fn add_texture(&mut self, fingerprint: [u8; 32], means: impl Iterator<Item = MeanRow>) {
        let first = self.means.len() as u32;
        self.means.extend(means);
        let count = self.means.len() as u32 - first;
        self.textures.push(TextureRow { fingerprint, first, count });
    }

    /// The bytes of the file.
    pub fn finish(self, lights: &LightList, meta: &str, fingerprint: [u8; 32]) -> AlignedBytes {
        let mut file = ContainerWriter::default();
        file.section(records::META, false, meta.as_bytes());
        file.section(records::TREES, true, &self.trees);
        file.section(records::GROUPS, true, &self.groups);
        if !self.instances.is_empty() {
            file.section(records::INSTANCES, true, &self.instances);
        }
        if !self.frames.is_empty() {
            file.section(records::FRAMES, true, &self.frames);
            // Sampling the trees does not need them.
            file.section(records::FINGERPRINTS, false, &self.fingerprints);
        }
        if !self.forced.is_empty() {
            file.section(records::FORCED, true, &self.forced);
        }
        let count = lights.lights.len();
        file.section_with(records::LIGHTS, true, count, |rows: &mut [LightRow]| {
            rows.par_iter_mut().enumerate().for_each(|(at, row)| *row = lights.row(at));
        });
        file.section_with(records::PATHS, true, lights.path_length, |place: &mut [u8]| {
            lights.write_paths(place);
        });
        // Nor these.
        if !self.textures.is_empty() {
            file.section(records::TEXTURES, false, &self.textures);
            file.section(records::MEANS, false, &self.means);
        }
        // A file whose lights light everything has no links.
        if !lights.links.is_empty() {
            file.section(records::LINKS, false, &lights.links);
        }
        file.finish(fingerprint)
    }
}
