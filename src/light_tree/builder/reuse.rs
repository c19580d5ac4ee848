//! What a build takes over from an earlier tree.
//!
//! The groups of a cluster follow from its items alone. So where all items of a cluster are the
//! leaves of one subtree of the earlier tree, unchanged, and there are no others, that subtree is
//! what a build would give: it is copied, and its leaves are told their new numbers.

use super::DEEPEST_BY_COST;
use super::item::Item;
use crate::light_tree::group::{Group, WIDTH};
use crate::light_tree::node::Link;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// An earlier tree, and where in it the bounds of a new one are that have not changed.
pub struct Earlier<'a> {
    /// Its groups.
    pub groups: &'a [Group],
    /// For each of the new bounds its leaf: the number of the group in the tree times [`WIDTH`] plus
    /// the lane; [`CHANGED`] if there is none.
    pub slots: Vec<u32>,
}

/// The slot of what is not in the earlier tree.
pub const CHANGED: u32 = u32::MAX;

/// An earlier tree, made ready to be searched for clusters.
pub struct Reuse<'a> {
    groups: &'a [Group],
    subtrees: Vec<Subtree>,
    /// For each item, in canonical order, the slot of its leaf.
    slots: Vec<u32>,
    /// For each slot where the item of its leaf stood in the input.
    inputs: Vec<u32>,
    height: usize,
    reused: AtomicU32,
}

/// The groups below a group, with itself.
#[derive(Clone, Copy, Default)]
struct Subtree {
    parent: u32,
    /// Behind its last group.
    end: u32,
    leaves: u32,
}

impl<'a> Reuse<'a> {
    pub fn new(earlier: Earlier<'a>, items: &[Item]) -> Reuse<'a> {
        let Earlier { groups, slots } = earlier;
        let slot = |item: &Item| slots[item.index as usize];
        let ((subtrees, height), mut slots) =
            rayon::join(|| measure(groups), || items.par_iter().map(slot).collect::<Vec<u32>>());
        forget_swapped(&mut slots, groups, items);
        let mut inputs = vec![CHANGED; groups.len() * WIDTH];
        for (&slot, item) in slots.iter().zip(items).filter(|(slot, _)| **slot != CHANGED) {
            inputs[slot as usize] = item.index;
        }
        Reuse { groups, subtrees, slots, inputs, height, reused: AtomicU32::new(0) }
    }

    /// The groups that a build of a cluster would give, if the earlier tree has them.
    pub fn find(&self, cluster: &[u32], depth: usize) -> Option<Range<usize>> {
        // Deeper down, clusters are cut otherwise.
        if depth + self.height > DEEPEST_BY_COST {
            return None;
        }
        let (mut first, mut last) = (u32::MAX, 0);
        for &place in cluster {
            let slot = self.slots[place as usize];
            if slot == CHANGED {
                return None;
            }
            (first, last) = (first.min(slot), last.max(slot));
        }
        let mut root = first as usize / WIDTH;
        while (self.subtrees[root].leaves as usize) < cluster.len() && root > 0 {
            root = self.subtrees[root].parent as usize;
        }
        let Subtree { end, leaves, .. } = self.subtrees[root];
        // As many leaves, all of them inside: then they are the same.
        let is_same = leaves as usize == cluster.len() && last as usize / WIDTH < end as usize;
        is_same.then_some(root..end as usize)
    }

    /// Appends groups that were found.
    pub fn copy(&self, found: Range<usize>, link: impl Fn(usize) -> Link, out: &mut Vec<Group>) {
        let first = out.len();
        out.extend_from_slice(&self.groups[found.clone()]);
        for (number, group) in found.clone().zip(&mut out[first..]) {
            for lane in 0..WIDTH {
                let old = group.link(lane);
                if !is_leaf(old) {
                    continue;
                }
                let new = link(self.inputs[number * WIDTH + lane] as usize);
                if new != old {
                    let node = group.node(lane).expect("a leaf").with_link(new);
                    group.set(lane, &node);
                }
            }
        }
        self.reused.fetch_add(self.subtrees[found.start].leaves, Ordering::Relaxed);
    }

    /// How many leaves were copied.
    pub fn reused(&self) -> usize {
        self.reused.load(Ordering::Relaxed) as usize
    }
}

fn is_leaf(link: Link) -> bool {
    matches!(link, Link::Emitter(_) | Link::Instance(_))
}

/// The subtrees of all groups of a tree, and on how many levels the groups stand.
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

/// Items with the same bounds follow each other by their numbers. Where they followed each other
/// otherwise in the earlier tree, a build would swap them: then none of them counts as unchanged.
fn forget_swapped(slots: &mut [u32], groups: &[Group], items: &[Item]) {
    let old = |slot: u32| groups[slot as usize / WIDTH].link(slot as usize % WIDTH);
    let is_twin = |at: &usize| items[at - 1].looks_like(&items[*at]);
    let twins: Vec<usize> = (1..items.len()).into_par_iter().filter(is_twin).collect();
    for run in twins.chunk_by(|a, b| a + 1 == *b) {
        let slots = &mut slots[run[0] - 1..run[0] + run.len()];
        let known = slots.iter().copied().filter(|&slot| slot != CHANGED);
        if !known.is_sorted_by(|&a, &b| old(a) < old(b)) {
            slots.fill(CHANGED);
        }
    }
}
