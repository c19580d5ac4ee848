//! Linking: lights that do not light everything.
//!
//! Lights that light the same have one *link number*; number 0 lights everything. The file has the number of each
//! light and nothing more. Receivers come in *classes*: all receivers of a class are lit by the same numbers
//! ([`LitBy`]). A lane of a group leads to lights of some numbers, its *lane set*. For a receiver of a class, the
//! importance of a lane is 0 if none of these numbers light the class. Else it is multiplied by the share of the lane's
//! energy that does: a strong lamp that lights one figure alone must not draw the samples of all that is around it. So it
//! is 0 only where no light below is linked, and picks, cuts, probabilities and moments agree, because all of them
//! weigh groups by one function (`place`).
//!
//! Lane sets and shares follow from the tree, so they cannot be wrong where the numbers are right. They are found
//! once for an open file, and only if somebody asks for a frame [with links](LightTree::at_frame_linked). A set that
//! holds number 0 is that of number 0, for a lane with such a light is dark to nobody. All lights of a placed tree
//! are of one number; below the leaf that stands for it, nothing is masked.

use super::group::Group;
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
use std::sync::{Arc, PoisonError};

/// More shares of groups than this are not kept in a tree: 64 MB. For the classes that are left, a lane counts as a
/// whole or not at all.
const MOST_SHARES: usize = 1 << 21;
/// More numbers than this are not kept in sets of several. Further sets count as if they held number 0.
const MOST_MEMBERS: usize = 1 << 22;
/// More bits than this, of classes times sets, are not kept: 32 MB. Then every set of several counts as lit.
const MOST_BITS: usize = 1 << 28;

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
        let still = tree.still.filter(|_| is_whole);
        let still = still.map(|still| self.still_lanes(row(still), lit_by));
        let own = tree.root.filter(|root| Some(*root) != tree.still).map(|own| {
            let sets = self.find_lane_sets(row(own), still.as_ref().map(|still| &*still.sets));
            Arc::new(self.find_lit_lanes(row(own), Arc::new(sets), lit_by, still.as_deref()))
        });
        let forced = tree.forced.iter().map(|placed| self.link_of_emitter(placed.first_emitter));
        let parts = [still, own].into_iter().flatten();
        let parts = parts.collect();
        let links = FrameLinks { parts, forced: forced.collect(), lit_by: lit_by.clone() };
        tree.links = Some(Arc::new(links));
        Ok(tree)
    }

    /// What is known of the tree of what stands still. The last result is kept.
    fn still_lanes(&self, tree: &TreeRow, lit_by: &Arc<LitBy>) -> Arc<LitLanes> {
        let known = &self.known().lit_lanes;
        let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
        let sets = match &*known {
            Some((own, lanes)) if Arc::ptr_eq(own, lit_by) => return lanes.clone(),
            Some((_, lanes)) => lanes.sets.clone(),
            None => Arc::new(self.find_lane_sets(tree, None)),
        };
        let lanes = Arc::new(self.find_lit_lanes(tree, sets, lit_by, None));
        *known = Some((lit_by.clone(), lanes.clone()));
        lanes
    }

    /// What of the lanes of a tree lights each class. `still` is that of the tree that a leaf may stand for.
    fn find_lit_lanes(
        &self,
        tree: &TreeRow,
        sets: Arc<LaneSets>,
        lit_by: &LitBy,
        still: Option<&LitLanes>,
    ) -> LitLanes {
        let (groups, classes) = (self.groups_of(tree), lit_by.classes());
        let lit = sets.lit(lit_by);
        let (mut shares, mut whole) = (Vec::new(), vec![1.0; classes]);
        let kept = classes.min(MOST_SHARES / groups.len().max(1));
        shares.reserve(kept * groups.len());
        for (class, whole) in (0..).zip(&mut whole[..kept]) {
            let below = still.map_or(1.0, |still| still.whole[class as usize]);
            let start = shares.len();
            shares.resize(start + groups.len(), [1.0; WIDTH]);
            let is_lit = |set| lit.get(class, set);
            *whole = self.find_shares(groups, &sets, is_lit, below, &mut shares[start..]);
        }
        LitLanes { sets, lit, shares, whole }
    }

    /// Fills in the shares of the energies of lanes that light a class, and returns that of all. `below` is the share
    /// of the tree of what stands still. A share is 0 only if it is nothing.
    fn find_shares(
        &self,
        groups: &[Group],
        sets: &LaneSets,
        is_lit: impl Fn(u32) -> bool,
        below: f32,
        shares: &mut [[f32; WIDTH]],
    ) -> f32 {
        let mut of_groups = vec![1.0f32; groups.len()];
        for at in (0..groups.len()).rev() {
            let (mut lit, mut all, mut is_whole) = (0.0, 0.0, true);
            for (lane, own) in shares[at].iter_mut().enumerate() {
                let share = match groups[at].link(lane) {
                    Link::Nothing => continue,
                    Link::Inner(ahead) => {
                        of_groups.get(at + ahead as usize).copied().unwrap_or(1.0)
                    }
                    Link::Instance(row) if self.places_still(row) => below,
                    Link::Instance(_) | Link::Emitter(_) => 1.0,
                };
                *own = if is_lit(sets.of_lanes[at][lane]) { share } else { 0.0 };
                let energy = f64::from(groups[at].energy(lane));
                lit += energy * f64::from(*own);
                all += energy;
                is_whole &= *own == 1.0;
            }
            if !is_whole {
                // Of a file that nobody verified, it may be no number.
                let share = (lit / all) as f32;
                let is_some = share > f32::MIN_POSITIVE;
                of_groups[at] = if is_some { share.min(1.0) } else { f32::MIN_POSITIVE };
            }
        }
        of_groups.first().copied().unwrap_or(1.0)
    }

    /// Whether an instance is of the tree of what stands still.
    fn places_still(&self, row: u32) -> bool {
        let instance = self.instances().get(row as usize);
        let tree = instance.and_then(|instance| self.trees().get(instance.tree as usize));
        tree.and_then(TreeKind::of) == Some(TreeKind::Still)
    }

    /// The lane sets of a tree whose walks end. `still` are those of the tree that a leaf may stand for.
    fn find_lane_sets(&self, tree: &TreeRow, still: Option<&LaneSets>) -> LaneSets {
        let groups = self.groups_of(tree);
        let numbers = self.link_numbers();
        let mut sets = Unions { numbers, several: Vec::new(), known: HashMap::new(), members: 0 };
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
    /// Numbers in all of them.
    members: usize,
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
        if self.members + all.len() > MOST_MEMBERS {
            return self.known.get(all.as_slice()).copied().unwrap_or(0);
        }
        let next = self.numbers + self.several.len() as u32;
        let (several, members) = (&mut self.several, &mut self.members);
        *self.known.entry(all.into()).or_insert_with_key(|all| {
            *members += all.len();
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
        let sets = self.numbers as usize + self.several.len();
        let is_small = sets.saturating_mul(lit_by.classes()) <= MOST_BITS;
        let several = if is_small { self.several.as_slice() } else { &[] };
        let mut rows = BitRows::new(self.numbers as usize + several.len());
        for class in (0..lit_by.classes() as u32).map(ReceiverClass) {
            let of_one = (0..self.numbers).map(|number| lit_by.holds(class, number));
            let any = |set: &[u32]| set.iter().any(|&number| lit_by.holds(class, number));
            rows.push(of_one.chain(several.iter().map(|set| any(set))));
        }
        rows
    }
}

/// The links of a frame's lights, for some classes of receivers.
#[derive(Debug)]
pub(super) struct FrameLinks {
    /// The trees whose lanes lead to lights of several numbers: of what stands still, and of the frame.
    parts: Vec<Arc<LitLanes>>,
    /// Of each forced light its link number.
    forced: Vec<u32>,
    lit_by: Arc<LitBy>,
}

/// What of the lanes of a tree lights each class of receivers.
#[derive(Debug)]
pub(super) struct LitLanes {
    sets: Arc<LaneSets>,
    /// By class and set, whether any of it does.
    lit: BitRows,
    /// By class and group, of each lane the share of its energy that does; of as many classes as there is room for.
    shares: Vec<[f32; WIDTH]>,
    /// By class, that share of the whole tree.
    whole: Vec<f32>,
}

impl FrameLinks {
    /// Weighs the lanes of a group by what of them lights a class.
    #[inline]
    pub fn weigh(&self, class: ReceiverClass, group: u32, importances: &mut [f64; WIDTH]) {
        let part = self.parts.iter().find(|part| part.sets.groups.contains(&group));
        let Some(LitLanes { sets, lit, shares, .. }) = part.map(|part| &**part) else { return };
        let at = (group - sets.groups.start) as usize;
        let row = (class.0 as usize).checked_mul(sets.of_lanes.len());
        if let Some(shares) = row.and_then(|row| shares.get(row + at)) {
            for (importance, &share) in importances.iter_mut().zip(shares) {
                *importance *= f64::from(share);
            }
            return;
        }
        let of_lanes = &sets.of_lanes[at];
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
