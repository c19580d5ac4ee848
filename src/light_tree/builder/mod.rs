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
use crate::bounds::{Aabb, LightBounds};
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
pub(super) fn build_tree<'e>(
    bounds: &[LightBounds],
    link: &(impl Fn(usize) -> Link + Sync),
    earlier: impl FnOnce() -> Option<Earlier<'e>> + Send,
    out: &mut Vec<Group>,
) -> Option<(LightBounds, usize)> {
    assert!(bounds.len() < MOST, "a tree has fewer than 2^30 leaves");
    if bounds.is_empty() {
        return None;
    }
    let (items, earlier) = rayon::join(|| order::canonical(bounds), earlier);
    out.reserve(earlier.as_ref().map_or(0, |earlier| earlier.groups.len()));
    let reuse = || earlier.map(|earlier| Reuse::new(earlier, &items));
    let (centers, reuse) = rayon::join(|| saoh::center_box(&items), reuse);
    let builder = Builder { bounds, items, link, reuse };
    let mut places: Vec<u32> = (0..bounds.len() as u32).collect();
    let all = Cluster { places: &mut places, centers, cost: f64::INFINITY };
    let around = builder.build_cluster(all, 0, out);
    Some((around, builder.reuse.map_or(0, |reuse| reuse.reused())))
}

/// Some of the items.
struct Cluster<'a> {
    /// Their places in the canonical order, ascending.
    places: &'a mut [u32],
    /// The box around their centres.
    centers: Aabb,
    /// What it costs, as [`saoh`] counts.
    cost: f64,
}

impl Cluster<'_> {
    /// Leaves an empty one in its place.
    fn take(&mut self) -> Self {
        let empty = Cluster { places: &mut [], ..*self };
        std::mem::replace(self, empty)
    }
}

/// The groups of a part of a cluster.
struct Below {
    /// The first of them.
    first: usize,
    bounds: LightBounds,
}

/// What is the same for all clusters.
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
    fn build_cluster(&self, cluster: Cluster, depth: usize, out: &mut Vec<Group>) -> LightBounds {
        let own = out.len();
        if let Some(reuse) = &self.reuse
            && let Some(found) = reuse.find(cluster.places, depth)
        {
            reuse.copy(found, self.link, out);
            return bounds_of_lanes(&out[own]);
        }
        out.push(Group::zeroed());
        let go_parallel = cluster.places.len() > PARALLEL_ABOVE;
        let mut parts = self.divide(cluster, depth);
        let below = if go_parallel {
            self.build_side_by_side(&mut parts, depth + 1, out)
        } else {
            parts.iter_mut().map(|part| self.build_below(part, depth + 1, out)).collect()
        };
        for (lane, (part, below)) in parts.iter().zip(below).enumerate() {
            let node = match below {
                Some(Below { first, bounds }) => {
                    Node::encode(&bounds, Link::Inner((first - own) as u32))
                }
                None => {
                    let index = self.items[part.places[0] as usize].index as usize;
                    Node::encode(&self.bounds[index], (self.link)(index))
                }
            };
            out[own].set(lane, &node);
        }
        bounds_of_lanes(&out[own])
    }

    /// The groups of a part of a cluster; `None` if it is but one item.
    fn build_below(&self, part: &mut Cluster, depth: usize, out: &mut Vec<Group>) -> Option<Below> {
        (part.places.len() > 1).then(|| {
            let first = out.len();
            Below { first, bounds: self.build_cluster(part.take(), depth, out) }
        })
    }

    /// The same of all parts, each by a task.
    fn build_side_by_side(
        &self,
        parts: &mut [Cluster],
        depth: usize,
        out: &mut Vec<Group>,
    ) -> Vec<Option<Below>> {
        let build = |part: &mut Cluster| {
            let mut groups = Vec::new();
            (self.build_below(part, depth, &mut groups), groups)
        };
        let (mut below, apart): (Vec<_>, Vec<_>) = parts.par_iter_mut().map(build).unzip();
        // Behind the last group of each part, counted from the first of all.
        let mut ends = Vec::with_capacity(WIDTH);
        let mut end = 0;
        for (below, groups) in below.iter_mut().zip(&apart) {
            if let Some(below) = below {
                below.first = out.len() + end;
            }
            end += groups.len();
            ends.push(end);
        }
        let group = |at: usize| {
            let part = ends.partition_point(|&end| end <= at);
            apart[part][at + apart[part].len() - ends[part]]
        };
        out.par_extend((0..end).into_par_iter().map(group));
        below
    }

    /// Cuts a cluster into up to eight parts: the costliest first of those that fill a group of their
    /// own. Lanes that are left then take the leaves of the smallest parts, whose groups would be
    /// nearly empty.
    fn divide<'c>(&self, cluster: Cluster<'c>, depth: usize) -> Vec<Cluster<'c>> {
        let mut parts = Vec::with_capacity(WIDTH);
        parts.push(cluster);
        while let Some(at) = next_to_cut(&parts) {
            let lanes_left = WIDTH - parts.len();
            let Cluster { places, centers, .. } = parts[at].take();
            if places.len() - 1 <= lanes_left {
                let one = |places| Cluster { places, centers, cost: 0.0 };
                parts.splice(at..=at, places.chunks_mut(1).map(one));
                continue;
            }
            let by_cost = (depth < DEEPEST_BY_COST)
                .then(|| saoh::partition(&self.items, places, &centers))
                .flatten();
            let halves = by_cost.unwrap_or(Halves::even(places.len(), centers));
            let (left, right) = places.split_at_mut(halves.left_count);
            let half = |i: usize, places| {
                let (centers, cost) = (halves.centers[i], halves.cost[i]);
                Cluster { places, centers, cost }
            };
            parts.splice(at..=at, [half(0, left), half(1, right)]);
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
fn next_to_cut(parts: &[Cluster]) -> Option<usize> {
    if parts.len() == WIDTH {
        return None;
    }
    let size = |at: usize| parts[at].places.len();
    let cost = |a: usize, b: usize| parts[a].cost.total_cmp(&parts[b].cost);
    // Coincident lights cost nothing: then the largest.
    let by_cost = |&a: &usize, &b: &usize| cost(a, b).then(size(a).cmp(&size(b)));
    let by_size = |&a: &usize, &b: &usize| size(a).cmp(&size(b)).then(cost(a, b));
    let all = 0..parts.len();
    let large = all.clone().filter(|&at| size(at) > WIDTH).max_by(by_cost);
    large.or_else(|| all.filter(|&at| size(at) > 1).min_by(by_size))
}
