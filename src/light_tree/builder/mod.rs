//! The build: light bounds in, groups out.
//!
//! Top-down: a cluster is cut in two by the surface area orientation heuristic ([`saoh`]), then its
//! costliest part, and so on until there are eight, which become the lanes of its group. Bounds
//! are then gathered bottom-up.
//!
//! The bytes depend on the *set* of bounds, not on the number of threads or the order of the input:
//! sums are exact in any order ([`outline::Steps`]), cuts go between items that differ, and [`order`]
//! decides between items that do not. The same holds for every cluster: its groups depend on its own
//! items, not on where it stands in the tree.

mod apart;
mod bins;
mod item;
mod order;
mod outline;
mod reuse;
mod saoh;

pub(super) use reuse::{CHANGED, Earlier};

use super::group::{Group, WIDTH};
use super::node::{Link, MOST, Node};
use crate::bounds::LightBounds;
use apart::Apart;
use bytemuck::Zeroable;
use item::Items;
use outline::Outline;
use rayon::prelude::*;
use reuse::{Found, Reuse};
use saoh::Halves;

/// Changes whenever the same bounds would give other bytes: part of every fingerprint.
pub const ALGORITHM_VERSION: u32 = 6;

/// Below this depth clusters are cut by count: no input makes the recursion much deeper.
const DEEPEST_BY_COST: usize = 100;
/// The children of clusters with more items are built in parallel.
const PARALLEL_ABOVE: usize = 4096;
/// Items summed or moved by one task.
const CHUNK: usize = 4096;
/// A cluster that has less than one in this many of the items gets its own copy of them, in which they
/// are neighbours in memory.
const SPARSE: usize = 4;
/// Up to this many items need no such copy: they fit a core's own cache.
const NEAR: usize = 4096;

/// Builds a tree over some bounds, all of them [sound](LightBounds::is_sound), and appends its
/// groups to `out` in preorder, a group before those of its children; `link` tells what each of the
/// bounds is. Returns the bounds of everything and how many leaves were copied from the `earlier`
/// tree; `None` if there are no bounds. Copying changes only the time that the build takes.
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
    let prepare = || {
        let items = Items::new(bounds);
        let outline = Outline::around(&items.centers);
        (items, outline)
    };
    let reuse = || earlier().map(|earlier| Reuse::new(earlier, bounds));
    let ((items, outline), reuse) = rayon::join(prepare, reuse);
    out.reserve(reuse.as_ref().map_or(0, Reuse::group_count));
    let builder = Builder { bounds, items: &items, link, reuse: reuse.as_ref() };
    let mut places = items.inputs.clone();
    let all = Cluster { places: &mut places, outline, cost: f64::INFINITY };
    let around = builder.build_cluster(all, 0, out);
    Some((around, reuse.map_or(0, |reuse| reuse.reused())))
}

/// Some of the items.
struct Cluster<'a> {
    /// Where they stand among the items of the builder.
    places: &'a mut [u32],
    outline: Outline,
    /// What it costs, as [`saoh`] counts.
    cost: f64,
}

impl Cluster<'_> {
    /// Takes it and leaves an empty one in its place.
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

/// What is the same for many clusters.
#[derive(Clone, Copy)]
struct Builder<'a, L> {
    bounds: &'a [LightBounds],
    /// All items, or those of a large cluster.
    items: &'a Items,
    link: &'a L,
    reuse: Option<&'a Reuse<'a>>,
}

impl<L: Fn(usize) -> Link + Sync> Builder<'_, L> {
    /// Appends the groups of a cluster, copied or built. Returns its bounds as its nodes store them,
    /// rounded outwards, so that a parent contains its children as they are stored.
    fn build_cluster(&self, cluster: Cluster, depth: usize, out: &mut Vec<Group>) -> LightBounds {
        let Some(found) = self.find(&cluster, depth) else {
            return self.build_anew(cluster, depth, out);
        };
        let own = out.len();
        out.extend((0..found.group_count()).map(|at| found.group(at, self.link)));
        out[own].bounds()
    }

    /// The groups of a cluster in the earlier tree.
    fn find(&self, cluster: &Cluster, depth: usize) -> Option<Found<'_>> {
        self.reuse?.find(cluster.places.iter().map(|&at| self.input(at)), depth)
    }

    /// Where an item stood in the input.
    fn input(&self, place: u32) -> u32 {
        self.items.inputs[place as usize]
    }

    fn build_anew(&self, cluster: Cluster, depth: usize, out: &mut Vec<Group>) -> LightBounds {
        let is_sparse = cluster.places.len() * SPARSE < self.items.len();
        if !is_sparse || self.items.len() <= NEAR {
            return self.build_group(cluster, depth, out);
        }
        let items = &self.items.gather(cluster.places);
        cluster.places.iter_mut().zip(0..).for_each(|(place, at)| *place = at);
        Builder { items, ..*self }.build_group(cluster, depth, out)
    }

    /// Appends the group of a cluster, and those below it.
    fn build_group(&self, cluster: Cluster, depth: usize, out: &mut Vec<Group>) -> LightBounds {
        let own = out.len();
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
                    let index = self.input(part.places[0]) as usize;
                    Node::encode(&self.bounds[index], (self.link)(index))
                }
            };
            out[own].set(lane, &node);
        }
        out[own].bounds()
    }

    /// Appends the groups of a part of a cluster; `None` if it is a single item.
    fn build_below(&self, part: &mut Cluster, depth: usize, out: &mut Vec<Group>) -> Option<Below> {
        (part.places.len() > 1).then(|| {
            let first = out.len();
            Below { first, bounds: self.build_cluster(part.take(), depth, out) }
        })
    }

    /// The same for all parts, each in a task of its own.
    fn build_side_by_side(
        &self,
        parts: &mut [Cluster],
        depth: usize,
        out: &mut Vec<Group>,
    ) -> Vec<Option<Below>> {
        let build = |part: &mut Cluster| {
            if part.places.len() == 1 {
                return Apart::Leaf;
            }
            if let Some(found) = self.find(part, depth) {
                return Apart::Found(found);
            }
            let mut groups = Vec::new();
            let bounds = self.build_anew(part.take(), depth, &mut groups);
            Apart::Built { groups, bounds }
        };
        let parts: Vec<Apart> = parts.par_iter_mut().map(build).collect();
        apart::append(&parts, self.link, out)
    }

    /// Cuts a cluster into up to eight parts. Of the parts with more items than a group has lanes, the
    /// costliest is cut first. Once there is none, the lanes that are left take the items of the smallest
    /// parts, whose own groups would be nearly empty.
    fn divide<'c>(&self, cluster: Cluster<'c>, depth: usize) -> Vec<Cluster<'c>> {
        let mut parts = Vec::with_capacity(WIDTH);
        parts.push(cluster);
        while let Some(at) = next_to_cut(&parts) {
            let lanes_left = WIDTH - parts.len();
            let Cluster { places, outline, .. } = parts[at].take();
            let part = |places, outline, cost| Cluster { places, outline, cost };
            if places.len() - 1 <= lanes_left {
                self.sort(places);
                parts.splice(at..=at, places.chunks_mut(1).map(|one| part(one, outline, 0.0)));
                continue;
            }
            let by_cost = (depth < DEEPEST_BY_COST)
                .then(|| saoh::partition(self.items, places, &outline))
                .flatten();
            let Halves { left_count, cost, outlines } = by_cost.unwrap_or_else(|| {
                self.sort(places);
                Halves { left_count: places.len() / 2, cost: [0.0; 2], outlines: [outline; 2] }
            });
            let (left, right) = places.split_at_mut(left_count);
            let halves = [part(left, outlines[0], cost[0]), part(right, outlines[1], cost[1])];
            parts.splice(at..=at, halves);
        }
        parts
    }

    /// Sorts items by their [order], where no cut does.
    fn sort(&self, places: &mut [u32]) {
        let compare = order::of(self.bounds);
        places.sort_unstable_by(|&a, &b| compare(self.input(a), self.input(b)));
    }
}

/// Which part to cut next; `None` if all lanes are used or none can be cut.
fn next_to_cut(parts: &[Cluster]) -> Option<usize> {
    if parts.len() == WIDTH {
        return None;
    }
    let size = |at: usize| parts[at].places.len();
    let cost = |a: usize, b: usize| parts[a].cost.total_cmp(&parts[b].cost);
    // Coincident lights cost nothing: of those, the largest part.
    let by_cost = |&a: &usize, &b: &usize| cost(a, b).then(size(a).cmp(&size(b)));
    let by_size = |&a: &usize, &b: &usize| size(a).cmp(&size(b)).then(cost(a, b));
    let all = 0..parts.len();
    let large = all.clone().filter(|&at| size(at) > WIDTH).max_by(by_cost);
    large.or_else(|| all.filter(|&at| size(at) > 1).min_by(by_size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::{Aabb, Cone};
    use glam::Vec3;

    /// On how many levels the groups of a tree stand.
    fn levels(groups: &[Group]) -> usize {
        let below = |lane| match groups[0].link(lane) {
            Link::Inner(ahead) => levels(&groups[ahead as usize..]),
            _ => 0,
        };
        1 + (0..WIDTH).map(below).max().unwrap_or(0)
    }

    #[test]
    fn below_the_deepest_clusters_are_cut_by_count() {
        // A cut by cost parts the last of these from all others.
        let light = |i: i32| {
            let aabb = Aabb::around([Vec3::X * 4f32.powi(i)]);
            LightBounds::of_emitter(aabb, Cone::ALL, 1.0, f32::INFINITY)
        };
        let bounds: Vec<_> = (-30..30).map(light).collect();
        let items = Items::new(&bounds);
        let link = |i| Link::Emitter(i as u32);
        let builder = Builder { bounds: &bounds, items: &items, link: &link, reuse: None };
        let height = |depth| {
            let mut groups = Vec::new();
            let outline = Outline::around(&items.centers);
            let places = &mut items.inputs.clone();
            builder.build_cluster(Cluster { places, outline, cost: 1.0 }, depth, &mut groups);
            let leaves = groups.iter().flat_map(|group| (0..WIDTH).map(|lane| group.link(lane)));
            assert_eq!(leaves.filter(|link| matches!(link, Link::Emitter(_))).count(), 60);
            levels(&groups)
        };
        assert!(height(0) > 3);
        assert_eq!(height(DEEPEST_BY_COST), 2);
    }
}
