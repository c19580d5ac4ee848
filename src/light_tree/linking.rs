//! Linking: lights that do not light everything.
//!
//! Lights that light the same have one *link number*; number 0 lights everything. The file has the number of each
//! light and nothing more. Receivers come in *classes*: all receivers of a class are lit by the same numbers
//! ([`LitBy`]). A lane of a group leads to lights of some numbers, its *lane set*. For a receiver of a class, the
//! importance of a lane is 0 if none of these numbers light the class, else what it is without linking. So it is 0
//! only where no light below is linked, and picks, cuts, probabilities and moments agree, because all of them weigh
//! groups by one function (`place`).
//!
//! Lane sets follow from the links of the tree, so they cannot be wrong where the numbers are right. They are found
//! once for an open file, and only if somebody asks for a frame [with links](LightTree::at_frame_linked). A set that
//! holds number 0 is that of number 0, for a lane with such a light is dark to nobody. All lights of a placed tree
//! are of one number; below the leaf that stands for it, nothing is masked.

use super::group::WIDTH;
use super::importance::{Cluster, Factors, Sight};
use super::node::Link;
use super::records::{TreeKind, TreeRow};
use super::sampling::FrameTree;
use super::tree::{LightTree, NoSuchFrame};
use super::veil::Cell;
use super::viewer::Viewer;
use crate::math::Similarity;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// A class of receivers, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ReceiverClass(pub u32);

impl ReceiverClass {
    /// Receivers that are lit by every light.
    pub const ALL: ReceiverClass = ReceiverClass(u32::MAX);
}

/// Which link numbers light each class of receivers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LitBy {
    rows: BitRows,
}

impl LitBy {
    /// Of classes in the order of their numbers; each tells of every link number from 0 on whether it lights the
    /// class. Number 0 lights all.
    pub fn new(numbers: usize, classes: impl IntoIterator<Item = Vec<bool>>) -> LitBy {
        let mut rows = BitRows::new(numbers);
        for class in classes {
            rows.push(
                class.into_iter().take(numbers).enumerate().map(|(number, lit)| number == 0 || lit),
            );
        }
        LitBy { rows }
    }

    /// How many classes there are.
    pub fn classes(&self) -> usize {
        self.rows.count()
    }

    /// Whether a link number lights a class. A class or a number that is not there is lit, and lights: what is
    /// unknown is no reason to lose light.
    #[inline]
    pub fn holds(&self, class: ReceiverClass, number: u32) -> bool {
        self.rows.get(class.0, number)
    }
}

/// Bits in rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct BitRows {
    columns: usize,
    words: Vec<u64>,
}

impl BitRows {
    fn new(columns: usize) -> BitRows {
        BitRows { columns, words: Vec::new() }
    }

    fn words_of_row(&self) -> usize {
        self.columns.div_ceil(64)
    }

    fn push(&mut self, bits: impl Iterator<Item = bool>) {
        let start = self.words.len();
        self.words.resize(start + self.words_of_row(), 0);
        for (column, _) in bits.enumerate().filter(|(_, bit)| *bit) {
            self.words[start + column / 64] |= 1 << (column % 64);
        }
    }

    fn count(&self) -> usize {
        self.words.len() / self.words_of_row().max(1)
    }

    /// A bit; set where there is none.
    #[inline]
    fn get(&self, row: u32, column: u32) -> bool {
        let (row, column) = (row as usize, column as usize);
        if column >= self.columns {
            return true;
        }
        let word =
            row.checked_mul(self.words_of_row()).and_then(|at| self.words.get(at + column / 64));
        word.is_none_or(|word| word >> (column % 64) & 1 == 1)
    }
}

/// The lane sets of a tree.
#[derive(Clone, Debug, Default)]
pub(super) struct LaneSets {
    /// The groups of the tree.
    groups: Range<u32>,
    /// Of each of them the sets of its lanes.
    of_lanes: Vec<[u32; WIDTH]>,
    /// How many link numbers there are. A set of one is numbered by it.
    numbers: u32,
    /// The sets of several, from set `numbers` on. Each ascends.
    several: Vec<Box<[u32]>>,
    /// The set of all that the tree holds.
    whole: u32,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// The link number of a row of [`lights`](LightTree::lights). A number that no writer gives counts as 0.
    pub fn link_of(&self, row: usize) -> u32 {
        let links = self.light_links();
        links.get(row).copied().filter(|&number| number as usize <= links.len()).unwrap_or(0)
    }

    /// How many link numbers there are, number 0 included.
    pub fn link_numbers(&self) -> u32 {
        (0..self.light_links().len()).map(|row| self.link_of(row) + 1).max().unwrap_or(1)
    }

    /// The link number of an emitter's light.
    fn link_of_emitter(&self, emitter: u32) -> u32 {
        let behind = self.lights().partition_point(|light| light.first_emitter <= emitter);
        behind.checked_sub(1).map_or(0, |row| self.link_of(row))
    }

    /// The tree of a frame, which receivers of some classes pick from: [`Linked`] viewers. Others see all lights.
    ///
    /// # Errors
    /// [`NoSuchFrame`] if lights change and the file was built without this frame.
    pub fn at_frame_linked(
        &self,
        frame: i32,
        lit_by: &Arc<LitBy>,
    ) -> Result<FrameTree<'_>, NoSuchFrame> {
        let mut tree = self.at_frame(frame)?;
        if self.light_links().is_empty() {
            return Ok(tree);
        }
        let row = |row: u32| &self.trees()[row as usize];
        let is_whole = tree.root.is_some();
        let still = tree.still.filter(|_| is_whole).map(|still| {
            let sets = || Arc::new(self.find_lane_sets(row(still), None));
            self.known().lane_sets.get_or_init(sets).clone()
        });
        let own = tree.root.filter(|root| Some(*root) != tree.still);
        let own = own.map(|own| Arc::new(self.find_lane_sets(row(own), still.as_deref())));
        let forced = tree.forced.iter().map(|placed| self.link_of_emitter(placed.first_emitter));
        let parts = [still, own].into_iter().flatten();
        let parts = parts.map(|sets| LitLanes { lit: sets.lit(lit_by), sets }).collect();
        let links = FrameLinks { parts, forced: forced.collect(), lit_by: lit_by.clone() };
        tree.links = Some(Arc::new(links));
        Ok(tree)
    }

    /// The lane sets of a tree whose walks end. `still` are those of the tree that a leaf may stand for.
    fn find_lane_sets(&self, tree: &TreeRow, still: Option<&LaneSets>) -> LaneSets {
        let groups = self.groups_of(tree);
        let numbers = self.link_numbers();
        let mut sets = Unions { numbers, several: Vec::new(), known: HashMap::new() };
        let mut of_lanes: Vec<[u32; WIDTH]> = vec![[0; WIDTH]; groups.len()];
        let mut of_groups = vec![0; groups.len()];
        // What a group leads to stands behind it.
        for at in (0..groups.len()).rev() {
            let mut used = Vec::with_capacity(WIDTH);
            for (lane, own) in of_lanes[at].iter_mut().enumerate() {
                *own = match groups[at].link(lane) {
                    Link::Nothing => continue,
                    Link::Inner(ahead) => of_groups.get(at + ahead as usize).copied().unwrap_or(0),
                    Link::Emitter(emitter) => self.link_of_emitter(emitter),
                    Link::Instance(row) => self.set_of_placed(row, still, &mut sets),
                };
                used.push(*own);
            }
            of_groups[at] = sets.union(used);
        }
        let groups = tree.first_group..tree.first_group + groups.len() as u32;
        let whole = of_groups.first().copied().unwrap_or(0);
        LaneSets { groups, of_lanes, numbers, several: sets.several, whole }
    }

    /// The set of a leaf that stands for a placed tree.
    fn set_of_placed(&self, row: u32, still: Option<&LaneSets>, sets: &mut Unions) -> u32 {
        let Some(instance) = self.instances().get(row as usize) else { return 0 };
        let tree = self.trees().get(instance.tree as usize);
        match (tree.and_then(TreeKind::of), still) {
            (Some(TreeKind::Still), Some(still)) => {
                let own = still.numbers_of(still.whole).to_vec();
                sets.union(own)
            }
            (Some(TreeKind::Still), None) => 0,
            _ => self.link_of_emitter(instance.first_emitter),
        }
    }
}

/// Sets of link numbers, each once.
struct Unions {
    numbers: u32,
    several: Vec<Box<[u32]>>,
    known: HashMap<Box<[u32]>, u32>,
}

impl Unions {
    /// The set of all that some sets hold.
    fn union(&mut self, mut of: Vec<u32>) -> u32 {
        of.sort_unstable();
        of.dedup();
        match of.as_slice() {
            [] | [0, ..] => return 0,
            [one] => return *one,
            _ => {}
        }
        let mut all = Vec::new();
        for set in of {
            match set.checked_sub(self.numbers) {
                None => all.push(set),
                Some(at) => all.extend_from_slice(&self.several[at as usize]),
            }
        }
        all.sort_unstable();
        all.dedup();
        let next = self.numbers + self.several.len() as u32;
        let several = &mut self.several;
        *self.known.entry(all.into()).or_insert_with_key(|all| {
            several.push(all.clone());
            next
        })
    }
}

impl LaneSets {
    /// The numbers in a set.
    fn numbers_of(&self, set: u32) -> Vec<u32> {
        match set.checked_sub(self.numbers) {
            None => vec![set],
            Some(at) => self.several[at as usize].to_vec(),
        }
    }

    /// For each class, by set, whether any of it lights the class.
    fn lit(&self, lit_by: &LitBy) -> BitRows {
        let mut rows = BitRows::new(self.numbers as usize + self.several.len());
        for class in (0..lit_by.classes() as u32).map(ReceiverClass) {
            let of_one = (0..self.numbers).map(|number| lit_by.holds(class, number));
            let any = |set: &[u32]| set.iter().any(|&number| lit_by.holds(class, number));
            rows.push(of_one.chain(self.several.iter().map(|set| any(set))));
        }
        rows
    }
}

/// The links of a frame's lights, for some classes of receivers.
#[derive(Debug)]
pub(super) struct FrameLinks {
    /// The trees whose lanes lead to lights of several numbers: of what stands still, and of the frame.
    parts: Vec<LitLanes>,
    /// Of each forced light its link number.
    forced: Vec<u32>,
    lit_by: Arc<LitBy>,
}

#[derive(Debug)]
struct LitLanes {
    sets: Arc<LaneSets>,
    /// By class and set.
    lit: BitRows,
}

impl FrameLinks {
    /// Takes the weight of the lanes of a group that do not light a class.
    #[inline]
    pub fn mask(&self, class: ReceiverClass, group: u32, importances: &mut [f64; WIDTH]) {
        let part = self.parts.iter().find(|part| part.sets.groups.contains(&group));
        let Some(LitLanes { sets, lit }) = part else { return };
        let of_lanes = &sets.of_lanes[(group - sets.groups.start) as usize];
        for (importance, &set) in importances.iter_mut().zip(of_lanes) {
            if !lit.get(class.0, set) {
                *importance = 0.0;
            }
        }
    }

    /// Whether a forced light, by its number among them, lights a class.
    pub fn lights_from_forced(&self, class: ReceiverClass, light: usize) -> bool {
        self.forced.get(light).is_none_or(|&number| self.lit_by.holds(class, number))
    }
}

/// A viewer of a class.
#[derive(Clone, Copy, Debug)]
pub struct Linked<V> {
    /// Who looks.
    pub viewer: V,
    /// What lights it.
    pub class: ReceiverClass,
}

impl<V: Viewer> Viewer for Linked<V> {
    const IS_LINKED: bool = true;

    #[inline(always)]
    fn class(&self) -> ReceiverClass {
        self.class
    }

    #[inline(always)]
    fn cell(&self) -> Cell {
        self.viewer.cell()
    }

    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        self.viewer.factors(cluster)
    }

    #[inline(always)]
    fn reflect(&self, sight: &Sight) -> (f32, f32) {
        self.viewer.reflect(sight)
    }

    fn glare(&self, cluster: &Cluster) -> f64 {
        self.viewer.glare(cluster)
    }

    fn unit_of_importance(&self, scale: f64) -> f64 {
        self.viewer.unit_of_importance(scale)
    }

    fn within(&self, space: &Similarity) -> Linked<V> {
        Linked { viewer: self.viewer.within(space), class: self.class }
    }
}

/// Which link numbers of two versions stand for the same. They are counted in the order of the lights, so that one
/// light more may shift them all.
#[derive(Clone, Debug)]
pub struct SameLinks {
    after_of: HashMap<u32, u32>,
    before_of: HashMap<u32, u32>,
}

impl Default for SameLinks {
    fn default() -> Self {
        // A light that lights everything is never the same as one that does not.
        SameLinks { after_of: HashMap::from([(0, 0)]), before_of: HashMap::from([(0, 0)]) }
    }
}

impl SameLinks {
    /// Whether a light of both versions, with these numbers, lights the same as the lights that were asked about
    /// before it.
    pub fn agree(&mut self, before: u32, after: u32) -> bool {
        match (self.after_of.get(&before), self.before_of.get(&after)) {
            (None, None) => {
                self.after_of.insert(before, after);
                self.before_of.insert(after, before);
                true
            }
            (known, _) => known == Some(&after),
        }
    }
}
