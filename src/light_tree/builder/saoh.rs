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
use glam::Vec3A;
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
    /// The boxes around the centres of the items of each half.
    pub centers: [Aabb; 2],
}

impl Halves {
    /// A cut by count, of items that cannot be told apart, or need not be any more.
    pub fn even(count: usize, centers: Aabb) -> Halves {
        Halves { left_count: count / 2, cost: [0.0; 2], centers: [centers; 2] }
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
/// all its items coincide, so that no cut is better than another. `centers` is the box around them.
pub fn partition(items: &[Item], cluster: &mut [u32], centers: &Aabb) -> Option<Halves> {
    if let [left, right] = *cluster {
        let halves = [left, right].map(|at| &items[at as usize]);
        return Some(Halves {
            left_count: 1,
            cost: halves.map(|item| Bin::of(item).cost()),
            centers: halves.map(|item| Aabb::around([item.center().into()])),
        });
    }
    if cluster.len() <= EXACT_UP_TO {
        partition_exactly(items, cluster, centers)
    } else {
        partition_binned(items, cluster, centers)
    }
}

/// The box around the centres of items.
pub fn center_box(items: &[Item]) -> Aabb {
    let around = |part: &[Item]| {
        let mut centers = Centers::NONE;
        part.iter().for_each(|item| centers.add(item.center()));
        centers
    };
    items.par_chunks(CHUNK).map(around).reduce(|| Centers::NONE, Centers::and).aabb()
}

/// A box around some centres.
#[derive(Clone, Copy)]
struct Centers {
    min: Vec3A,
    max: Vec3A,
}

impl Centers {
    const NONE: Centers = Centers { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    #[inline]
    fn add(&mut self, center: Vec3A) {
        (self.min, self.max) = (self.min.min(center), self.max.max(center));
    }

    fn and(self, other: Centers) -> Centers {
        Centers { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    fn aabb(&self) -> Aabb {
        Aabb { min: self.min.into(), max: self.max.into() }
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
    let mut entries = [(Vec3A::ZERO, Bin::EMPTY); EXACT_UP_TO];
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
    let around = |part: &[u8]| {
        let mut centers = Centers::NONE;
        part.iter().for_each(|&i| centers.add(entries[usize::from(i)].0));
        centers.aabb()
    };
    let centers = [around(&order[..left_count]), around(&order[left_count..count])];
    Some(Halves { left_count, cost: cut.cost, centers })
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
    let is_left = |center: Vec3A| slabs.along(axis, center) <= after;
    let (left_count, centers) = move_to_front(items, cluster, is_left);
    Some(Halves { left_count, cost, centers: centers.map(|centers| centers.aabb()) })
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
    min: Vec3A,
    per_metre: Vec3A,
}

impl Slabs {
    fn new(centers: &Aabb) -> Slabs {
        let extent = centers.extent();
        let per_metre = extent.to_array().map(|e| if e > 0.0 { BINS as f32 / e } else { 0.0 });
        Slabs { min: centers.min.into(), per_metre: Vec3A::from_array(per_metre) }
    }

    #[inline]
    fn of(&self, p: Vec3A) -> [usize; 3] {
        ((p - self.min) * self.per_metre).to_array().map(whole)
    }

    /// The same along one axis.
    #[inline]
    fn along(&self, axis: usize, p: Vec3A) -> usize {
        whole((p[axis] - self.min[axis]) * self.per_metre[axis])
    }
}

/// A slab's number, from where in the slabs a point is.
#[inline]
fn whole(slab: f32) -> usize {
    // By way of `i32`, which is one instruction.
    (slab as i32 as usize).min(BINS - 1)
}

/// Brings the items whose centres fulfil a condition to the front and counts them; both parts keep
/// their order. Returns the boxes around the centres of both, too.
fn move_to_front(
    items: &[Item],
    cluster: &mut [u32],
    wanted: impl Fn(Vec3A) -> bool + Sync,
) -> (usize, [Centers; 2]) {
    let move_part = |part: &mut [u32]| move_part_to_front(items, part, &wanted);
    if cluster.len() <= CHUNK {
        return move_part(cluster);
    }
    let parts: Vec<_> = cluster.par_chunks_mut(CHUNK).map(move_part).collect();
    let (mut front, mut others) = (0, Vec::with_capacity(cluster.len()));
    let mut centers = [Centers::NONE; 2];
    for (i, (count, [left, right])) in parts.into_iter().enumerate() {
        let (start, end) = (i * CHUNK, cluster.len().min((i + 1) * CHUNK));
        others.extend_from_slice(&cluster[start + count..end]);
        cluster.copy_within(start..start + count, front);
        front += count;
        centers = [centers[0].and(left), centers[1].and(right)];
    }
    cluster[front..].copy_from_slice(&others);
    (front, centers)
}

fn move_part_to_front(
    items: &[Item],
    part: &mut [u32],
    wanted: impl Fn(Vec3A) -> bool,
) -> (usize, [Centers; 2]) {
    let mut centers = [Centers::NONE; 2];
    let (mut front, mut behind, mut others) = (0, 0, vec![0; part.len()]);
    // Without branches, which nothing could foretell.
    for at in 0..part.len() {
        let place = part[at];
        let center = items[place as usize].center();
        let is_left = wanted(center);
        (part[front], others[behind]) = (place, place);
        front += usize::from(is_left);
        behind += usize::from(!is_left);
        centers[usize::from(!is_left)].add(center);
    }
    part[front..].copy_from_slice(&others[..behind]);
    (front, centers)
}
