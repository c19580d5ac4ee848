//! The build: light bounds in, groups out.
//!
//! Top-down: a cluster is cut in two by the surface area orientation heuristic ([`saoh`]), then its
//! costliest part, and so on until there are eight, which become the lanes of its group. Bounds
//! are then gathered bottom-up.
//!
//! What the bytes depend on is the *set* of bounds: the items are first brought into a canonical
//! order, every sum runs in that order, and what tasks built side by side is put together in that
//! order. Neither the number of threads nor the order of the input shows. The same holds of every
//! cluster: its groups follow from its own items, wherever it stands in the tree.

mod bins;
mod item;
mod order;
mod reuse;
mod saoh;

pub(super) use reuse::{CHANGED, Earlier};

use super::group::{Group, WIDTH};
use super::node::{Link, MOST, Node};
use crate::bounds::LightBounds;
use bytemuck::Zeroable;
use item::Item;
use rayon::prelude::*;
use reuse::Reuse;
use saoh::Halves;

/// Changes whenever the same bounds would give other bytes: part of every fingerprint.
pub const ALGORITHM_VERSION: u32 = 3;

/// Below this depth clusters are cut by count: no input makes the recursion much deeper.
const DEEPEST_BY_COST: usize = 100;
/// The children of larger clusters are built side by side.
const PARALLEL_ABOVE: usize = 4096;

/// Builds a tree over some bounds, all of them [sound](LightBounds::is_sound), and appends its
/// groups to `out` in preorder, a group before those of its children; `link` tells what each of the
/// bounds is. Returns the bounds of everything and how many leaves were copied from the `earlier`
/// tree, which changes nothing but the time it takes; `None` if there are no bounds.
///
/// # Panics
/// If there are 2^30 bounds or more.
pub(super) fn build_tree(
    bounds: &[LightBounds],
    link: &(impl Fn(usize) -> Link + Sync),
    earlier: Option<Earlier>,
    out: &mut Vec<Group>,
) -> Option<(LightBounds, usize)> {
    assert!(bounds.len() < MOST, "a tree has fewer than 2^30 leaves");
    if bounds.is_empty() {
        return None;
    }
    let items = order::canonical(bounds);
    let reuse = earlier.map(|earlier| {
        out.reserve(earlier.groups.len());
        Reuse::new(earlier, &items, bounds)
    });
    let builder = Builder { bounds, items, link, reuse };
    let mut all: Vec<u32> = (0..bounds.len() as u32).collect();
    let around = builder.build_cluster(&mut all, 0, out);
    Some((around, builder.reuse.map_or(0, |reuse| reuse.reused())))
}

/// What is the same for all clusters. A cluster is a list of places in the canonical order,
/// ascending.
struct Builder<'a, L> {
    bounds: &'a [LightBounds],
    /// In canonical order.
    items: Vec<Item>,
    link: &'a L,
    reuse: Option<Reuse<'a>>,
}

impl<L: Fn(usize) -> Link + Sync> Builder<'_, L> {
    /// Builds the groups of a cluster and returns its bounds as its nodes have them: rounded outwards
    /// already, so that what a node says of itself contains what its children say.
    fn build_cluster(
        &self,
        cluster: &mut [u32],
        depth: usize,
        out: &mut Vec<Group>,
    ) -> LightBounds {
        let own = out.len();
        if let Some(reuse) = &self.reuse
            && let Some(found) = reuse.find(cluster, depth)
        {
            reuse.copy(found, self.link, out);
            return bounds_of_lanes(&out[own]);
        }
        out.push(Group::zeroed());
        let go_parallel = cluster.len() > PARALLEL_ABOVE;
        let mut parts = self.divide(cluster, depth);
        let build_apart = |part: &mut &mut [u32]| {
            let mut groups = Vec::new();
            let bounds = (part.len() > 1).then(|| self.build_cluster(part, depth + 1, &mut groups));
            (bounds, groups)
        };
        let mut apart: Vec<_> =
            if go_parallel { parts.par_iter_mut().map(build_apart).collect() } else { Vec::new() };
        let mut nodes = Vec::with_capacity(WIDTH);
        for (lane, part) in parts.into_iter().enumerate() {
            if let [place] = *part {
                let index = self.items[place as usize].index as usize;
                nodes.push(Node::encode(&self.bounds[index], (self.link)(index)));
                continue;
            }
            let first = out.len();
            let bounds = match apart.get_mut(lane).map(std::mem::take) {
                Some((Some(bounds), mut groups)) => {
                    out.append(&mut groups);
                    bounds
                }
                _ => self.build_cluster(part, depth + 1, out),
            };
            nodes.push(Node::encode(&bounds, Link::Inner((first - own) as u32)));
        }
        for (lane, node) in nodes.iter().enumerate() {
            out[own].set(lane, node);
        }
        bounds_of_lanes(&out[own])
    }

    /// Cuts a cluster into up to eight parts: the costliest first of those that fill a group of their
    /// own. Lanes that are left then take the leaves of the smallest parts, whose groups would be
    /// nearly empty.
    fn divide<'a>(&self, cluster: &'a mut [u32], depth: usize) -> Vec<&'a mut [u32]> {
        let mut parts: Vec<&mut [u32]> = Vec::with_capacity(WIDTH);
        parts.push(cluster);
        let mut costs = vec![f64::INFINITY];
        while let Some(at) = next_to_cut(&parts, &costs) {
            let lanes_left = WIDTH - parts.len();
            let part = std::mem::take(&mut parts[at]);
            if part.len() - 1 <= lanes_left {
                costs.splice(at..=at, part.iter().map(|_| 0.0));
                parts.splice(at..=at, part.chunks_mut(1));
                continue;
            }
            let by_cost =
                if depth < DEEPEST_BY_COST { saoh::partition(&self.items, part) } else { None };
            let Halves { left_count, cost } = by_cost.unwrap_or(Halves::even(part.len()));
            let (left, right) = part.split_at_mut(left_count);
            parts.splice(at..=at, [left, right]);
            costs.splice(at..=at, cost);
        }
        parts
    }
}

/// The bounds of a cluster as the nodes of its group have them.
fn bounds_of_lanes(group: &Group) -> LightBounds {
    let rounded: Vec<LightBounds> = group.nodes().map(|node| node.bounds()).collect();
    LightBounds::around(&rounded)
}

/// Which part to cut next; `None` if all lanes are used or none can be cut.
fn next_to_cut(parts: &[&mut [u32]], costs: &[f64]) -> Option<usize> {
    if parts.len() == WIDTH {
        return None;
    }
    // Coincident lights cost nothing: then the largest.
    let by_cost = |&a: &usize, &b: &usize| {
        costs[a].total_cmp(&costs[b]).then(parts[a].len().cmp(&parts[b].len()))
    };
    let all = 0..parts.len();
    let large = all.clone().filter(|&i| parts[i].len() > WIDTH).max_by(by_cost);
    large.or_else(|| {
        let small = all.filter(|&i| parts[i].len() > 1);
        let by_size = |&a: &usize, &b: &usize| {
            parts[a].len().cmp(&parts[b].len()).then(costs[a].total_cmp(&costs[b]))
        };
        small.min_by(by_size)
    })
}
