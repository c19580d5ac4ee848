//! The build: light bounds in, nodes and an order of leaves out.
//!
//! Top-down partition by the surface area orientation heuristic ([`saoh`]), in parallel, and
//! bottom-up bounds. What the bytes depend on is the *set* of bounds: the items are first brought
//! into a canonical order, every sum runs in that order, and each task writes to a place that the
//! counts alone decide. Neither the number of threads nor the order of the input shows.

mod bins;
mod order;
mod saoh;

use super::node::{Link, Node, Pair};
use crate::bounds::LightBounds;
use bytemuck::Zeroable;

/// Changes whenever the same bounds would give other bytes: part of every fingerprint.
pub const ALGORITHM_VERSION: u32 = 1;

/// Beyond this depth clusters are halved by count: no input makes the recursion deeper than this
/// plus 31.
const DEEPEST_BY_COST: usize = 200;
/// Smaller clusters are built by the task that found them.
const PARALLEL_ABOVE: usize = 2048;

/// Bounds, and where they stood in the input.
#[derive(Clone, Copy)]
pub(super) struct Item {
    bounds: LightBounds,
    index: u32,
}

/// One tree within a file: its nodes are in the file's pairs.
#[derive(Clone, Debug)]
pub(super) struct BuiltTree {
    /// Bounds of everything.
    pub root: Node,
    /// For each leaf from left to right, which of the input bounds it is.
    pub order: Vec<u32>,
}

/// Builds a tree over some bounds, all of them [sound](LightBounds::is_sound), and appends its
/// pairs to `pairs` and numbers its leaves from `first_leaf`. No bounds give no tree.
///
/// # Panics
/// If a number would reach 2^31.
pub(super) fn build_tree(
    bounds: &[LightBounds],
    first_leaf: usize,
    pairs: &mut Vec<Pair>,
) -> Option<BuiltTree> {
    if bounds.is_empty() {
        return None;
    }
    let first_pair = pairs.len();
    let pair_count = bounds.len() - 1;
    assert!(first_leaf + bounds.len() <= 1 << 31, "a file has at most 2^31 leaves");
    let mut items = order::canonical(bounds);
    pairs.resize(first_pair + pair_count, Pair::zeroed());
    let place = Place { first_leaf: first_leaf as u32, first_pair: first_pair as u32, depth: 0 };
    let root = build_cluster(&mut items, &mut pairs[first_pair..], place);
    let root = Node::encode(&root, place.link(items.len()));
    Some(BuiltTree { root, order: items.iter().map(|item| item.index).collect() })
}

/// Where a cluster's nodes go.
#[derive(Clone, Copy)]
struct Place {
    first_leaf: u32,
    first_pair: u32,
    depth: usize,
}

impl Place {
    /// The places of two children, the left with `left_count` leaves (see the format: a cluster's
    /// own pair comes first, then the left's pairs, then the right's).
    fn children(self, left_count: usize) -> (Place, Place) {
        let depth = self.depth + 1;
        let left = Place { first_pair: self.first_pair + 1, depth, ..self };
        let right = Place {
            first_leaf: self.first_leaf + left_count as u32,
            first_pair: self.first_pair + left_count as u32,
            depth,
        };
        (left, right)
    }

    /// The link to a cluster of `count` leaves that is placed here.
    fn link(self, count: usize) -> Link {
        if count == 1 { Link::Leaf(self.first_leaf) } else { Link::Inner(self.first_pair) }
    }
}

/// Builds everything below a cluster and returns the cluster's bounds as its children's nodes
/// have them: rounded outwards already, so that what a node says of itself contains what its
/// children say.
fn build_cluster(items: &mut [Item], pairs: &mut [Pair], place: Place) -> LightBounds {
    if let [item] = items {
        return item.bounds;
    }
    let left_count = if place.depth < DEEPEST_BY_COST {
        saoh::partition(items).unwrap_or(items.len() / 2)
    } else {
        items.len() / 2
    };
    let (left_place, right_place) = place.children(left_count);
    let right_count = items.len() - left_count;
    let go_parallel = items.len() > PARALLEL_ABOVE;
    let (left_items, right_items) = items.split_at_mut(left_count);
    let (own, below) = pairs.split_first_mut().expect("n items have n - 1 pairs");
    let (left_pairs, right_pairs) = below.split_at_mut(left_count - 1);
    let mut build_left = || build_cluster(left_items, left_pairs, left_place);
    let mut build_right = || build_cluster(right_items, right_pairs, right_place);
    let (left, right) = if go_parallel {
        rayon::join(build_left, build_right)
    } else {
        (build_left(), build_right())
    };
    *own = [
        Node::encode(&left, left_place.link(left_count)),
        Node::encode(&right, right_place.link(right_count)),
    ];
    own[0].bounds().union(&own[1].bounds())
}
