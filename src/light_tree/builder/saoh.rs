//! The surface area orientation heuristic: where a cluster is cut in two.
//!
//! Cost of a cut (HPG 2018, section 4.4): the sum over both halves of energy times area times
//! orientation measure, times `Kr`, the longest extent of the cluster over its extent along the
//! axis, which keeps boxes from getting thin. All three axes are tried; small clusters exactly,
//! between every two neighbours, large ones between [bins](super::bins).
//!
//! A cluster is a list of the places of its items in the canonical order, ascending, and so are its
//! halves: what becomes of a cluster depends on its items, not on those that it was cut away from.

use super::bins::Bin;
use super::item::Item;
use crate::bounds::Aabb;
use glam::Vec3;
use rayon::prelude::*;

/// Slabs along each axis of a large cluster.
const BINS: usize = 16;
/// Clusters up to this size are cut between any two neighbours.
const EXACT_UP_TO: usize = BINS;
/// Items summed by one task, in a fixed grouping: sums must not depend on the thread count.
const CHUNK: usize = 1 << 13;

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

/// Reorders a cluster into two non-empty halves, each in canonical order; `None` if the centres of
/// all its items coincide, so that no cut is better than another.
pub fn partition(items: &[Item], cluster: &mut [u32]) -> Option<Halves> {
    if let [left, right] = *cluster {
        let cost = [left, right].map(|at| Bin::of(&items[at as usize]).cost());
        return Some(Halves { left_count: 1, cost });
    }
    let centers = center_box(items, cluster);
    if cluster.len() <= EXACT_UP_TO {
        partition_exactly(items, cluster, &centers)
    } else {
        partition_binned(items, cluster, &centers)
    }
}

/// The box around the items' centres.
fn center_box(items: &[Item], cluster: &[u32]) -> Aabb {
    let around = |part: &[u32]| Aabb::around(part.iter().map(|&at| items[at as usize].center()));
    if cluster.len() <= CHUNK {
        around(cluster)
    } else {
        cluster.par_chunks(CHUNK).map(around).reduce(|| Aabb::EMPTY, |a, b| a.union(&b))
    }
}

/// `Kr` for each axis; no cut along an axis without extent.
fn regularisation(centers: &Aabb) -> [Option<f64>; 3] {
    let extent = centers.extent().as_dvec3();
    extent.to_array().map(|along| (along > 0.0).then(|| extent.max_element() / along))
}

fn partition_exactly(items: &[Item], cluster: &mut [u32], centers: &Aabb) -> Option<Halves> {
    let count = cluster.len();
    let mut best: Option<Cut> = None;
    let mut entries = [(Vec3::ZERO, Bin::EMPTY); EXACT_UP_TO];
    for (entry, &at) in entries.iter_mut().zip(cluster.iter()) {
        let item = &items[at as usize];
        *entry = (item.center(), Bin::of(item));
    }
    // Which of the entries are how far along an axis; ties in canonical order.
    let sorted = |axis: usize| {
        let mut order: [u8; EXACT_UP_TO] = std::array::from_fn(|i| i as u8);
        let along = |i: &u8| entries[usize::from(*i)].0[axis];
        order[..count].sort_by(|a, b| along(a).total_cmp(&along(b)));
        order
    };
    let mut bins = [Bin::EMPTY; BINS];
    for (axis, kr) in regularisation(centers).into_iter().enumerate() {
        let Some(kr) = kr else { continue };
        for (bin, i) in bins[..count].iter_mut().zip(sorted(axis)) {
            *bin = entries[usize::from(i)].1;
        }
        cheapest_cut(&bins[..count], axis, kr, &mut best);
    }
    let cut = best?;
    let left_count = cut.after + 1;
    let mut order = sorted(cut.axis);
    order[..left_count].sort_unstable();
    order[left_count..count].sort_unstable();
    let mut places = [0; EXACT_UP_TO];
    places[..count].copy_from_slice(cluster);
    for (place, i) in cluster.iter_mut().zip(order) {
        *place = places[usize::from(i)];
    }
    Some(Halves { left_count, cost: cut.cost })
}

fn partition_binned(items: &[Item], cluster: &mut [u32], centers: &Aabb) -> Option<Halves> {
    let slabs = Slabs::new(centers);
    let fill = |part: &[u32]| {
        let mut bins = [[Bin::EMPTY; BINS]; 3];
        for &place in part {
            let item = &items[place as usize];
            let at = slabs.of(item.center());
            for axis in 0..3 {
                bins[axis][at[axis]].add(item);
            }
        }
        bins
    };
    let bins = if cluster.len() <= CHUNK {
        fill(cluster)
    } else {
        let parts: Vec<_> = cluster.par_chunks(CHUNK).map(fill).collect();
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
    let is_left = |place: u32| slabs.of(items[place as usize].center())[axis] <= after;
    Some(Halves { left_count: move_to_front(cluster, is_left), cost })
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

/// Brings what fulfils a condition to the front and counts it; both parts keep their order.
fn move_to_front(cluster: &mut [u32], wanted: impl Fn(u32) -> bool + Sync) -> usize {
    if cluster.len() <= CHUNK {
        return move_part_to_front(cluster, &wanted);
    }
    let parts = cluster.par_chunks_mut(CHUNK);
    let counts: Vec<usize> = parts.map(|part| move_part_to_front(part, &wanted)).collect();
    let (mut front, mut others) = (0, Vec::with_capacity(cluster.len()));
    for (i, count) in counts.into_iter().enumerate() {
        let (start, end) = (i * CHUNK, cluster.len().min((i + 1) * CHUNK));
        others.extend_from_slice(&cluster[start + count..end]);
        cluster.copy_within(start..start + count, front);
        front += count;
    }
    cluster[front..].copy_from_slice(&others);
    front
}

fn move_part_to_front(part: &mut [u32], wanted: impl Fn(u32) -> bool) -> usize {
    let (mut front, mut others) = (0, Vec::with_capacity(part.len()));
    for at in 0..part.len() {
        let place = part[at];
        if wanted(place) {
            part[front] = place;
            front += 1;
        } else {
            others.push(place);
        }
    }
    part[front..].copy_from_slice(&others);
    front
}
