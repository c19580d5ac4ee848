//! Picking one emitter for a receiver, and the probability of having picked it.
//!
//! From the root down, a child is chosen with the probability `I / sum of I` of its group, one
//! random number stretched over all choices (seed, "Method overview"). [`FrameTree::sample`] walks
//! down; [`FrameTree::probability`] walks up from the emitter's leaf, by the lane that leads to each
//! group. Both weigh a group by the same code, and there is no limit to the depth.

use super::group::{Group, WIDTH};
use super::importance::Receiver;
use super::node::{Link, Node};
use super::records::{Parent, TreeRow};
use super::tree::{LightTree, NoSuchFrame};

/// One emitter, picked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Its number.
    pub emitter: u32,
    /// The probability of picking it for this receiver; positive.
    pub probability: f64,
    /// What is left of the random number: uniform in `[0, 1)` and fresh.
    pub leftover: f64,
}

/// A lane of a group: the group's number times [`WIDTH`] plus the lane's.
type Slot = u32;
const NO_SLOT: Slot = u32::MAX;

/// Where the leaf of every emitter that stands still is: what [`FrameTree::probability`] starts
/// from. Made once for a shot by [`LightTree::leaf_table`].
#[derive(Clone, Debug, Default)]
pub struct LeafTable {
    slot_of: Vec<Slot>,
}

/// The tree of one frame, ready to be sampled.
#[derive(Clone)]
pub struct FrameTree<'a> {
    groups: &'a [Group],
    parents: &'a [Parent],
    trees: &'a [TreeRow],
    root: Option<u32>,
    /// The lane of the frame's tree that stands for the tree of what stands still.
    below: Option<Slot>,
    static_leaves: &'a LeafTable,
    moving_slots: Vec<Slot>,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// Finds the leaves of all emitters that stand still.
    pub fn leaf_table(&self) -> LeafTable {
        let most = self.groups().len() * WIDTH;
        let mut slot_of = vec![NO_SLOT; self.static_emitter_count().min(most)];
        // The first tree holds what stands still, if anything does.
        for (slot, link) in self.trees().first().into_iter().flat_map(|tree| self.links(tree)) {
            if let Link::Emitter(emitter) = link
                && let Some(entry) = slot_of.get_mut(emitter as usize)
            {
                *entry = slot;
            }
        }
        LeafTable { slot_of }
    }

    /// Every used lane of a tree and where it leads.
    fn links(&self, tree: &TreeRow) -> impl Iterator<Item = (Slot, Link)> + '_ {
        let first = tree.first_group.wrapping_mul(WIDTH as u32);
        let lanes = self.groups_of(tree).iter().flat_map(|g| (0..WIDTH).map(|lane| g.link(lane)));
        lanes.enumerate().map(move |(i, link)| (first.wrapping_add(i as u32), link))
    }

    /// The tree of a frame.
    ///
    /// # Errors
    /// [`NoSuchFrame`] if lights move and the file was built without this frame.
    pub fn at_frame<'a>(
        &'a self,
        frame: i32,
        static_leaves: &'a LeafTable,
    ) -> Result<FrameTree<'a>, NoSuchFrame> {
        let root = self.tree_at(frame)?.filter(|&row| (row as usize) < self.trees().len());
        let fixed = self.static_emitter_count();
        let moving = self.emitter_count().saturating_sub(fixed);
        let mut moving_slots = vec![NO_SLOT; moving.min(self.groups().len() * WIDTH)];
        let mut below = None;
        if let Some(row) = root {
            for (slot, link) in self.links(&self.trees()[row as usize]) {
                match link {
                    Link::Tree(_) => below = Some(slot),
                    Link::Emitter(emitter) => {
                        let at = (emitter as usize).checked_sub(fixed);
                        if let Some(entry) = at.and_then(|at| moving_slots.get_mut(at)) {
                            *entry = slot;
                        }
                    }
                    Link::Inner(_) | Link::Nothing => {}
                }
            }
        }
        Ok(FrameTree {
            groups: self.groups(),
            parents: self.parents(),
            trees: self.trees(),
            root,
            below,
            static_leaves,
            moving_slots,
        })
    }
}

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

impl FrameTree<'_> {
    /// Picks an emitter with a random number in `[0, 1)`; `None` where nothing can arrive (which a
    /// descent may learn only below a cluster whose bounds were too wide to know).
    pub fn sample(&self, receiver: &Receiver, u: f64) -> Option<Pick> {
        let mut row = self.root?;
        let (mut u, mut probability, mut at) = (u, 1.0, self.trees[row as usize].first_group);
        // Ends whatever the bytes: links lead onwards within a tree, and to earlier trees.
        loop {
            let group = self.groups.get(at as usize)?;
            let choice = choose(group, receiver, u)?;
            u = choice.leftover;
            probability *= choice.probability;
            match group.link(choice.lane) {
                Link::Emitter(emitter) if self.knows(emitter) => {
                    return Some(Pick { emitter, probability, leftover: u });
                }
                Link::Inner(ahead) => at = at.checked_add(ahead)?,
                Link::Tree(below) if below < row => {
                    row = below;
                    at = self.trees.get(row as usize)?.first_group;
                }
                Link::Emitter(_) | Link::Tree(_) | Link::Nothing => return None,
            }
        }
    }

    /// Whether there is an emitter of this number. In a sound tree there always is.
    #[inline]
    fn knows(&self, emitter: u32) -> bool {
        (emitter as usize) < self.static_leaves.slot_of.len() + self.moving_slots.len()
    }

    /// The probability with which [`sample`](FrameTree::sample) picks an emitter for a receiver; 0
    /// for one that it never picks.
    pub fn probability(&self, receiver: &Receiver, emitter: u32) -> f64 {
        self.try_probability(receiver, emitter).unwrap_or(0.0)
    }

    fn try_probability(&self, receiver: &Receiver, emitter: u32) -> Option<f64> {
        self.root?;
        let fixed = self.static_leaves.slot_of.len();
        match (emitter as usize).checked_sub(fixed) {
            Some(moving) => self.chance_of(*self.moving_slots.get(moving)?, receiver),
            None => {
                let above = match self.below {
                    Some(slot) => self.chance_of(slot, receiver)?,
                    None => 1.0,
                };
                Some(
                    above
                        * self.chance_of(self.static_leaves.slot_of[emitter as usize], receiver)?,
                )
            }
        }
    }

    /// The product of the choices that lead from the root of its tree to a lane.
    fn chance_of(&self, slot: Slot, receiver: &Receiver) -> Option<f64> {
        let (mut at, mut lane) = (slot / WIDTH as u32, (slot % WIDTH as u32) as usize);
        let mut probability = 1.0;
        loop {
            let weights = self.groups.get(at as usize)?.importances(receiver);
            let total = sum(&weights);
            if total <= 0.0 || !total.is_finite() {
                return None;
            }
            probability *= weights[lane] / total;
            match self.parents.get(at as usize)?.get() {
                None => return Some(probability),
                Some((back, parent_lane)) => {
                    at = at.checked_sub(back.max(1))?;
                    lane = parent_lane;
                }
            }
        }
    }

    /// The node of everything; `None` if nothing shines.
    pub fn root(&self) -> Option<&Node> {
        self.root.map(|row| &self.trees[row as usize].root)
    }

    /// The importance of everything at a receiver; 0 if nothing shines.
    pub fn total_importance(&self, receiver: &Receiver) -> f64 {
        self.root().map_or(0.0, |root| root.importance(receiver))
    }

    /// Calls `visit` with every emitter and its leaf's node: what a perfect traversal would weigh.
    pub fn for_each_leaf(&self, mut visit: impl FnMut(u32, &Node)) {
        let mut next = self.root;
        while let Some(row) = next {
            next = None;
            let Some(tree) = self.trees.get(row as usize) else { return };
            let rest = self.groups.get(tree.first_group as usize..).unwrap_or_default();
            let groups = &rest[..rest.len().min(tree.group_count as usize)];
            for node in groups.iter().flat_map(Group::nodes) {
                match node.link() {
                    Link::Emitter(emitter) if self.knows(emitter) => visit(emitter, &node),
                    Link::Tree(below) if below < row => next = Some(below),
                    _ => {}
                }
            }
        }
    }
}

/// A child, chosen.
struct Choice {
    lane: usize,
    probability: f64,
    leftover: f64,
}

/// Chooses a child of a group by its share of the importance; `None` if all have none.
#[inline]
fn choose(group: &Group, receiver: &Receiver, u: f64) -> Option<Choice> {
    let weights = group.importances(receiver);
    let total = sum(&weights);
    if total <= 0.0 || !total.is_finite() {
        return None;
    }
    let target = u * total;
    let (mut lane, mut before, mut running) = (0, 0.0, 0.0);
    for (i, weight) in weights.iter().enumerate() {
        // The last lane with a weight whose stretch begins at or before the target.
        let begins = *weight > 0.0 && running <= target;
        lane = if begins { i } else { lane };
        before = if begins { running } else { before };
        running += weight;
    }
    let weight = weights[lane];
    let leftover = ((target - before) / weight).clamp(0.0, BELOW_ONE);
    Some(Choice { lane, probability: weight / total, leftover })
}

/// The sum of a group's weights, in the order in which they are walked through.
#[inline]
fn sum(weights: &[f64; WIDTH]) -> f64 {
    weights.iter().sum()
}
