//! Picking one emitter for a receiver, and the probability of having picked it.
//!
//! From the root down, `P_L = I_L / (I_L + I_R)`, one random number stretched over all choices
//! (seed, "Method overview"). [`FrameTree::sample`] and [`FrameTree::probability`] take the same
//! choices by the same code, so they cannot disagree.

use super::importance::Receiver;
use super::node::{Link, Node, Pair};
use super::records::{LeafContent, TreeRow};
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

/// Where every emitter's leaf is: what [`FrameTree::probability`] needs to walk towards it.
/// Made once for a shot by [`LightTree::leaf_table`].
#[derive(Clone, Debug, Default)]
pub struct LeafTable {
    leaf_of: Vec<u32>,
}

const NO_LEAF: u32 = u32::MAX;

/// The tree of one frame, ready to be sampled.
#[derive(Clone)]
pub struct FrameTree<'a> {
    pairs: &'a [Pair],
    leaves: &'a [u32],
    trees: &'a [TreeRow],
    root: Option<u32>,
    /// The leaf of the frame's tree that stands for the tree of what stands still.
    below: Option<(u32, u32)>,
    static_leaves: &'a LeafTable,
    moving_leaves: Vec<u32>,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// Finds the leaves of all emitters that stand still.
    pub fn leaf_table(&self) -> LeafTable {
        let mut leaf_of = vec![NO_LEAF; self.static_emitter_count().min(self.leaves().len())];
        for tree in self.trees() {
            self.note_leaves(tree, 0, &mut leaf_of);
        }
        LeafTable { leaf_of }
    }

    fn note_leaves(&self, tree: &TreeRow, first_emitter: usize, leaf_of: &mut [u32]) {
        for (leaf, content) in self.contents(tree) {
            if let LeafContent::Emitter(emitter) = content
                && let Some(at) = (emitter as usize).checked_sub(first_emitter)
                && let Some(entry) = leaf_of.get_mut(at)
            {
                *entry = leaf;
            }
        }
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
        let root = self.tree_at(frame)?;
        let row = root.and_then(|root| self.trees().get(root as usize));
        let moving = self.emitter_count().saturating_sub(self.static_emitter_count());
        let mut moving_leaves = vec![NO_LEAF; moving.min(self.leaves().len())];
        let mut below = None;
        if let Some(row) = row {
            self.note_leaves(row, self.static_emitter_count(), &mut moving_leaves);
            below = self.contents(row).find_map(|(leaf, content)| match content {
                LeafContent::Tree(tree) => Some((leaf, tree)),
                LeafContent::Emitter(_) => None,
            });
        }
        Ok(FrameTree {
            pairs: self.pairs(),
            leaves: self.leaves(),
            trees: self.trees(),
            root: row.and(root),
            below,
            static_leaves,
            moving_leaves,
        })
    }
}

/// The two choices at a pair: the importances of both children.
#[inline]
fn importances(pair: &Pair, receiver: &Receiver) -> (f64, f64) {
    (pair[0].importance(receiver), pair[1].importance(receiver))
}

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

impl FrameTree<'_> {
    /// Picks an emitter with a random number in `[0, 1)`; `None` where nothing can arrive (which a
    /// descent may learn only below a cluster whose bounds were too wide to know).
    pub fn sample(&self, receiver: &Receiver, u: f64) -> Option<Pick> {
        let (mut u, mut probability) = (u, 1.0);
        // A leaf may stand for a tree, which comes earlier in the file: this ends.
        let mut row = self.root?;
        loop {
            let leaf = self.descend(row, receiver, &mut u, &mut probability)?;
            match LeafContent::decode(*self.leaves.get(leaf as usize)?) {
                LeafContent::Emitter(emitter) => {
                    return Some(Pick { emitter, probability, leftover: u });
                }
                LeafContent::Tree(tree) if tree < row => row = tree,
                LeafContent::Tree(_) => return None,
            }
        }
    }

    /// Walks from a tree's root to one of its leaves.
    #[inline]
    fn descend(
        &self,
        row: u32,
        receiver: &Receiver,
        u: &mut f64,
        probability: &mut f64,
    ) -> Option<u32> {
        let root = &self.trees.get(row as usize)?.root;
        if root.importance(receiver) == 0.0 {
            return None;
        }
        let mut link = root.link();
        let mut last = None;
        loop {
            let at = match link {
                Link::Leaf(leaf) => return Some(leaf),
                // Children come after their parents: damaged bytes cannot make a loop.
                Link::Inner(pair) if Some(pair) > last => pair,
                Link::Inner(_) => return None,
            };
            last = Some(at);
            let pair = self.pairs.get(at as usize)?;
            let (left, right) = importances(pair, receiver);
            let total = left + right;
            if !(total > 0.0 && total < f64::INFINITY) {
                return None;
            }
            let p_left = left / total;
            if *u < p_left {
                *u = (*u / p_left).min(BELOW_ONE);
                *probability *= p_left;
                link = pair[0].link();
            } else {
                let p_right = right / total;
                *u = ((*u - p_left) / p_right).clamp(0.0, BELOW_ONE);
                *probability *= p_right;
                link = pair[1].link();
            }
        }
    }

    /// The probability with which [`sample`](FrameTree::sample) picks an emitter for a receiver; 0
    /// for one that it never picks.
    pub fn probability(&self, receiver: &Receiver, emitter: u32) -> f64 {
        self.try_probability(receiver, emitter).unwrap_or(0.0)
    }

    fn try_probability(&self, receiver: &Receiver, emitter: u32) -> Option<f64> {
        let root = self.root?;
        let static_count = self.static_leaves.leaf_of.len();
        let Some(moving) = (emitter as usize).checked_sub(static_count) else {
            let leaf = *self.static_leaves.leaf_of.get(emitter as usize)?;
            return match self.below {
                Some((through, tree)) => Some(
                    self.probability_of_leaf(root, receiver, through)?
                        * self.probability_of_leaf(tree, receiver, leaf)?,
                ),
                None => self.probability_of_leaf(root, receiver, leaf),
            };
        };
        self.probability_of_leaf(root, receiver, *self.moving_leaves.get(moving)?)
    }

    /// The product of the choices that lead to a leaf. Which side it is on follows from the
    /// numbering alone; see the [format](crate::store).
    fn probability_of_leaf(&self, row: u32, receiver: &Receiver, leaf: u32) -> Option<f64> {
        let tree = self.trees.get(row as usize)?;
        if tree.root.importance(receiver) == 0.0 {
            return None;
        }
        let mut probability = 1.0;
        let mut link = tree.root.link();
        let mut first_leaf = tree.first_leaf;
        let mut last = None;
        loop {
            let at = match link {
                Link::Leaf(found) => return (found == leaf).then_some(probability),
                Link::Inner(pair) if Some(pair) > last => pair,
                Link::Inner(_) => return None,
            };
            last = Some(at);
            let pair = self.pairs.get(at as usize)?;
            let (left, right) = importances(pair, receiver);
            let total = left + right;
            if !(total > 0.0 && total < f64::INFINITY) {
                return None;
            }
            let middle = first_leaf_of_right(pair, at, first_leaf);
            if leaf < middle {
                probability *= left / total;
                link = pair[0].link();
            } else {
                probability *= right / total;
                link = pair[1].link();
                first_leaf = middle;
            }
        }
    }

    /// The node of everything; `None` if nothing shines.
    pub fn root(&self) -> Option<&Node> {
        self.root.and_then(|row| self.trees.get(row as usize)).map(|tree| &tree.root)
    }

    /// The importance of everything at a receiver; 0 if nothing shines.
    pub fn total_importance(&self, receiver: &Receiver) -> f64 {
        self.root().map_or(0.0, |root| root.importance(receiver))
    }

    /// Calls `visit` with every emitter and its leaf's node: what a perfect traversal would weigh.
    pub fn for_each_leaf(&self, mut visit: impl FnMut(u32, &Node)) {
        let mut next = self.root;
        while let Some((row, tree)) =
            next.and_then(|row| self.trees.get(row as usize).map(|tree| (row, tree)))
        {
            next = None;
            let mut see = |node: &Node| {
                let Link::Leaf(leaf) = node.link() else { return };
                match self.leaves.get(leaf as usize).copied().map(LeafContent::decode) {
                    Some(LeafContent::Emitter(emitter)) => visit(emitter, node),
                    Some(LeafContent::Tree(below)) if below < row => next = Some(below),
                    _ => {}
                }
            };
            see(&tree.root);
            let pairs = self.pairs.get(tree.first_pair as usize..).unwrap_or_default();
            let count = (tree.leaf_count as usize).saturating_sub(1).min(pairs.len());
            pairs[..count].iter().flatten().for_each(&mut see);
        }
    }
}

/// The number of the first leaf of a pair's right child.
#[inline]
pub(super) fn first_leaf_of_right(pair: &Pair, at: u32, first_leaf: u32) -> u32 {
    match pair[1].link() {
        Link::Leaf(leaf) => leaf,
        Link::Inner(right) => first_leaf.wrapping_add(right.wrapping_sub(at)),
    }
}
