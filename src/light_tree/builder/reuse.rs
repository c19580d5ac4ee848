//! What a build takes over from an earlier tree.
//!
//! The groups of a cluster depend on its items alone. If the items are exactly the leaves of one subtree
//! of the earlier tree, all unchanged, then a build would give that subtree again. So the subtree is
//! copied, and its leaves get their new numbers.

use super::DEEPEST_BY_COST;
use super::order;
use crate::bounds::LightBounds;
use crate::light_tree::group::{Group, WIDTH};
use crate::light_tree::node::Link;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// An earlier tree, and where in it the unchanged bounds of a new tree are.
pub struct Earlier<'a> {
    /// Its groups.
    pub groups: &'a [Group],
    /// For each of the new bounds its leaf: the number of the group in the tree times [`WIDTH`] plus
    /// the lane; [`CHANGED`] if there is none.
    pub slots: Vec<u32>,
    /// Whether the unchanged bounds are in the same order as they were.
    pub in_order: bool,
}

/// The slot of bounds that are not in the earlier tree.
pub const CHANGED: u32 = u32::MAX;

/// An earlier tree, made ready to be searched for clusters.
pub struct Reuse<'a> {
    groups: &'a [Group],
    subtrees: Vec<Subtree>,
    /// As in [`Earlier`].
    slots: Vec<u32>,
    /// For each slot the place of its leaf among the new bounds.
    places: Vec<u32>,
    height: usize,
    reused: AtomicU32,
}

/// The groups below a group, with itself.
#[derive(Clone, Copy, Default)]
struct Subtree {
    parent: u32,
    /// One past its last group.
    end: u32,
    leaves: u32,
}

impl<'a> Reuse<'a> {
    pub fn new(earlier: Earlier<'a>, bounds: &[LightBounds]) -> Reuse<'a> {
        let Earlier { groups, mut slots, in_order } = earlier;
        if !in_order {
            forget_swapped(&mut slots, groups, bounds);
        }
        let place = || {
            let mut places = vec![CHANGED; groups.len() * WIDTH];
            for (&slot, place) in slots.iter().zip(0..).filter(|(slot, _)| **slot != CHANGED) {
                places[slot as usize] = place;
            }
            places
        };
        let ((subtrees, height), places) = rayon::join(|| measure(groups), place);
        Reuse { groups, subtrees, slots, places, height, reused: AtomicU32::new(0) }
    }

    /// How many groups the earlier tree has.
    pub fn group_count(&self) -> usize {
        self.groups.len()
    }

    /// The groups that a build of a cluster would give, if the earlier tree has them. `cluster` are the
    /// places of its bounds.
    pub fn find(
        &self,
        cluster: impl ExactSizeIterator<Item = u32>,
        depth: usize,
    ) -> Option<Found<'_>> {
        // Deeper down, clusters are cut by count: there the groups depend on the depth, too.
        if depth + self.height > DEEPEST_BY_COST {
            return None;
        }
        let (count, mut first, mut last) = (cluster.len() as u32, u32::MAX, 0);
        for place in cluster {
            let slot = self.slots[place as usize];
            if slot == CHANGED {
                return None;
            }
            (first, last) = (first.min(slot), last.max(slot));
        }
        let mut root = first as usize / WIDTH;
        while self.subtrees[root].leaves < count && root > 0 {
            root = self.subtrees[root].parent as usize;
        }
        let Subtree { end, leaves, .. } = self.subtrees[root];
        // The subtree contains all items and has no more leaves than these: they are the same.
        let is_same = leaves == count && last as usize / WIDTH < end as usize;
        is_same.then(|| {
            self.reused.fetch_add(leaves, Ordering::Relaxed);
            Found { reuse: self, groups: root..end as usize }
        })
    }

    /// How many leaves were found.
    pub fn reused(&self) -> usize {
        self.reused.load(Ordering::Relaxed) as usize
    }
}

/// A subtree of the earlier tree that a build would give again.
pub struct Found<'a> {
    reuse: &'a Reuse<'a>,
    groups: Range<usize>,
}

impl Found<'_> {
    /// How many groups it has.
    pub fn group_count(&self) -> usize {
        self.groups.len()
    }

    /// One of its groups. Its leaves are linked to the bounds of the new tree.
    pub fn group(&self, at: usize, link: impl Fn(usize) -> Link) -> Group {
        let number = self.groups.start + at;
        let mut group = self.reuse.groups[number];
        for lane in 0..WIDTH {
            if is_leaf(group.link(lane)) {
                let place = self.reuse.places[number * WIDTH + lane];
                group.set_link(lane, link(place as usize));
            }
        }
        group
    }
}

fn is_leaf(link: Link) -> bool {
    matches!(link, Link::Emitter(_) | Link::Instance(_))
}

/// The subtrees of all groups of a tree, and how many levels of groups the tree has.
fn measure(groups: &[Group]) -> (Vec<Subtree>, usize) {
    let mut subtrees = vec![Subtree::default(); groups.len()];
    let mut heights = vec![1; groups.len()];
    for own in (0..groups.len()).rev() {
        let mut found = Subtree { parent: 0, end: own as u32 + 1, leaves: 0 };
        for link in (0..WIDTH).map(|lane| groups[own].link(lane)) {
            if let Link::Inner(ahead) = link {
                let child = own + ahead as usize;
                subtrees[child].parent = own as u32;
                found.end = found.end.max(subtrees[child].end);
                found.leaves += subtrees[child].leaves;
                heights[own] = heights[own].max(heights[child] + 1);
            }
            found.leaves += u32::from(is_leaf(link));
        }
        subtrees[own] = found;
    }
    (subtrees, heights.first().copied().unwrap_or(0))
}

/// Equal bounds are ordered by their places in the input. If the earlier tree has them in another order,
/// a build would swap them, so none of them counts as unchanged.
fn forget_swapped(slots: &mut [u32], groups: &[Group], bounds: &[LightBounds]) {
    let old = |slot: u32| groups[slot as usize / WIDTH].link(slot as usize % WIDTH);
    let compare = order::of(bounds);
    let is_twin =
        |a: &u32, b: &u32| order::by_numbers(&bounds[*a as usize], &bounds[*b as usize]).is_eq();
    let mut sorted: Vec<u32> = (0..bounds.len() as u32).collect();
    sorted.par_sort_unstable_by(|&a, &b| compare(a, b));
    for twins in sorted.chunk_by(is_twin).filter(|run| run.len() > 1) {
        let known = twins.iter().map(|&at| slots[at as usize]).filter(|&slot| slot != CHANGED);
        if !known.is_sorted_by(|&a, &b| old(a) < old(b)) {
            twins.iter().for_each(|&at| slots[at as usize] = CHANGED);
        }
    }
}
