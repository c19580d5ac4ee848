//! The surface area orientation heuristic: where a cluster is cut in two.
//!
//! Cost of a cut (HPG 2018, section 4.4): the sum over both halves of energy times area times
//! orientation measure, times `Kr`, the longest extent of the cluster over its extent along the
//! axis, which keeps boxes from getting thin. All three axes are tried; small clusters exactly,
//! between every two neighbours, large ones between [bins](super::bins).

use super::Item;
use super::bins::Bin;
use crate::bounds::Aabb;
use glam::Vec3;
use rayon::prelude::*;

/// Slabs along each axis of a large cluster.
const BINS: usize = 16;
/// Clusters up to this size are cut between any two neighbours.
const EXACT_UP_TO: usize = BINS;
/// Items summed by one task, in a fixed grouping: sums must not depend on the thread count.
const CHUNK: usize = 1 << 15;

/// A cluster, cut in two.
pub struct Halves {
    /// How many items are in the first half.
    pub left_count: usize,
    /// What each half costs.
    pub cost: [f64; 2],
}

impl Halves {
    /// A cut by count, of items that cannot be told apart.
    pub fn even(count: usize) -> Halves {
        Halves { left_count: count / 2, cost: [0.0; 2] }
    }
}

/// The cheapest cut found: after bin (or item) `after` along `axis`.
struct Cut {
    /// With `Kr`.
    total: f64,
    cost: [f64; 2],
    axis: usize,
    after: usize,
}

/// Reorders the items into two non-empty halves; `None` if all their centres coincide, so that no
/// cut is better than another.
pub fn partition(items: &mut [Item]) -> Option<Halves> {
    if let [left, right] = items {
        return Some(Halves { left_count: 1, cost: [Bin::of(left).cost(), Bin::of(right).cost()] });
    }
    let centers = center_box(items);
    if items.len() <= EXACT_UP_TO {
        partition_exactly(items, &centers)
    } else {
        partition_binned(items, &centers)
    }
}

/// The box around the items' centres.
fn center_box(items: &[Item]) -> Aabb {
    let around = |chunk: &[Item]| Aabb::around(chunk.iter().map(center));
    if items.len() <= CHUNK {
        around(items)
    } else {
        items.par_chunks(CHUNK).map(around).reduce(|| Aabb::EMPTY, |a, b| a.union(&b))
    }
}

fn center(item: &Item) -> Vec3 {
    item.bounds.aabb.center()
}

/// `Kr` for each axis; no cut along an axis without extent.
fn regularisation(centers: &Aabb) -> [Option<f64>; 3] {
    let extent = centers.extent().as_dvec3();
    extent.to_array().map(|along| (along > 0.0).then(|| extent.max_element() / along))
}

fn partition_exactly(items: &mut [Item], centers: &Aabb) -> Option<Halves> {
    let count = items.len();
    let mut best: Option<Cut> = None;
    let sort = |items: &mut [Item], axis: usize| {
        items.sort_by(|a, b| center(a)[axis].total_cmp(&center(b)[axis]));
    };
    let mut sorted = [items[0]; EXACT_UP_TO];
    let sorted = &mut sorted[..count];
    let mut bins = [Bin::EMPTY; BINS];
    for (axis, kr) in regularisation(centers).into_iter().enumerate() {
        let Some(kr) = kr else { continue };
        // Each axis sorts the canonical order anew, so that ties do not depend on other axes.
        sorted.copy_from_slice(items);
        sort(sorted, axis);
        for (bin, item) in bins.iter_mut().zip(sorted.iter()) {
            *bin = Bin::of(item);
        }
        cheapest_cut(&bins[..count], axis, kr, &mut best);
    }
    let cut = best?;
    sort(items, cut.axis);
    Some(Halves { left_count: cut.after + 1, cost: cut.cost })
}

fn partition_binned(items: &mut [Item], centers: &Aabb) -> Option<Halves> {
    let slabs = Slabs::new(centers);
    let fill = |chunk: &[Item]| {
        let mut bins = [[Bin::EMPTY; BINS]; 3];
        for item in chunk {
            let at = slabs.of(center(item));
            let entry = Bin::of(item);
            for axis in 0..3 {
                bins[axis][at[axis]].merge(&entry);
            }
        }
        bins
    };
    let bins = if items.len() <= CHUNK {
        fill(items)
    } else {
        let parts: Vec<_> = items.par_chunks(CHUNK).map(fill).collect();
        let mut total = [[Bin::EMPTY; BINS]; 3];
        for part in &parts {
            for (sum, bin) in total.as_flattened_mut().iter_mut().zip(part.as_flattened()) {
                sum.merge(bin);
            }
        }
        total
    };
    let mut best = None;
    for (axis, kr) in regularisation(centers).into_iter().enumerate() {
        if let Some(kr) = kr {
            cheapest_cut(&bins[axis], axis, kr, &mut best);
        }
    }
    let Cut { axis, after, cost, .. } = best?;
    let left_count = move_to_front(items, |item| slabs.of(center(item))[axis] <= after);
    Some(Halves { left_count, cost })
}

/// Tries every cut between bins; keeps the first of equals.
fn cheapest_cut(bins: &[Bin], axis: usize, kr: f64, best: &mut Option<Cut>) {
    let mut right_costs = [0.0; BINS];
    let mut right = Bin::EMPTY;
    for i in (1..bins.len()).rev() {
        right.merge(&bins[i]);
        right_costs[i] = right.cost();
    }
    let count = right.count + bins[0].count;
    let mut left = Bin::EMPTY;
    for after in 0..bins.len() - 1 {
        left.merge(&bins[after]);
        let divides = bins[after].count > 0 && left.count < count;
        let cost = [left.cost(), right_costs[after + 1]];
        let total = kr * (cost[0] + cost[1]);
        if divides && best.as_ref().is_none_or(|best| total < best.total) {
            *best = Some(Cut { total, cost, axis, after });
        }
    }
}

/// Which slab of each axis a point is in.
struct Slabs {
    min: Vec3,
    per_metre: Vec3,
}

impl Slabs {
    fn new(centers: &Aabb) -> Slabs {
        let extent = centers.extent();
        let per_metre = extent.to_array().map(|e| if e > 0.0 { BINS as f32 / e } else { 0.0 });
        Slabs { min: centers.min, per_metre: Vec3::from_array(per_metre) }
    }

    #[inline]
    fn of(&self, p: Vec3) -> [usize; 3] {
        let at = (p - self.min) * self.per_metre;
        at.to_array().map(|slab| (slab as usize).min(BINS - 1))
    }
}

/// Brings the items that fulfil a condition to the front, in place, and counts them.
fn move_to_front(items: &mut [Item], wanted: impl Fn(&Item) -> bool) -> usize {
    let (mut front, mut back) = (0, items.len());
    loop {
        while front < back && wanted(&items[front]) {
            front += 1;
        }
        while front < back && !wanted(&items[back - 1]) {
            back -= 1;
        }
        if front >= back {
            return front;
        }
        items.swap(front, back - 1);
    }
}
