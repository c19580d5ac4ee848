//! The surface area orientation heuristic: where a cluster is cut in two.
//!
//! Cost of a cut (HPG 2018, section 4.4): the sum over both halves of energy times area times
//! orientation measure, times `Kr`, the longest extent of the cluster over its extent along the
//! axis, which keeps boxes from getting thin. All three axes are tried; small clusters exactly,
//! large ones between [bins](super::bins).
//!
//! A cut goes between centres that differ along its axis, and all sums are exact. So the halves, as
//! sets, depend only on the set that is cut, not on the order in which its items are listed.

use super::CHUNK;
use super::bins::Bin;
use super::item::Items;
use super::outline::Outline;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// Slabs along each axis of a large cluster.
const BINS: usize = 16;
/// Clusters up to this size are cut between any two neighbours.
const EXACT_UP_TO: usize = BINS;

/// A cluster, cut in two.
pub struct Halves {
    /// How many items are in the first half.
    pub left_count: usize,
    /// What each half costs.
    pub cost: [f64; 2],
    pub outlines: [Outline; 2],
}

/// The cheapest cut found: after bin (or item) `after` along `axis`.
struct Cut {
    /// The cost of both halves times `Kr`.
    total: f64,
    cost: [f64; 2],
    axis: usize,
    after: usize,
}

/// Reorders the places of a cluster's items into two non-empty halves; `None` if the centres of all
/// its items coincide, or nearly, so that no cut is better than another.
pub fn partition(items: &Items, cluster: &mut [u32], outline: &Outline) -> Option<Halves> {
    if cluster.len() <= EXACT_UP_TO {
        partition_exactly(items, cluster, outline)
    } else {
        partition_binned(items, cluster, outline)
    }
}

/// `Kr` for each axis; `None`, for no cut, where the extent along the axis is zero or overflows.
fn regularisation(outline: &Outline) -> [Option<f64>; 3] {
    let extent = outline.extent().as_dvec3().to_array();
    let can_be_cut = |along: &f64| *along > 0.0 && along.is_finite();
    let longest = extent.into_iter().filter(can_be_cut).fold(0.0, f64::max);
    extent.map(|along| can_be_cut(&along).then(|| longest / along))
}

fn partition_exactly(items: &Items, cluster: &mut [u32], outline: &Outline) -> Option<Halves> {
    let count = cluster.len();
    let steps = outline.steps();
    let mut entries = [(Vec4::ZERO, Bin::EMPTY); EXACT_UP_TO];
    for (entry, &place) in entries.iter_mut().zip(cluster.iter()) {
        let shape = &items.shapes[place as usize];
        *entry = (items.centers[place as usize], Bin::of(shape, steps.round(shape.directed)));
    }
    let along = |i: u8, axis: usize| entries[usize::from(i)].0[axis];
    // The entries in their order along an axis.
    let sorted = |axis: usize| {
        let mut order: [u8; EXACT_UP_TO] = std::array::from_fn(|i| i as u8);
        order[..count].sort_by(|&a, &b| along(a, axis).total_cmp(&along(b, axis)));
        order
    };
    let mut best = None;
    let mut bins = [Bin::EMPTY; EXACT_UP_TO];
    for (axis, kr) in regularisation(outline).into_iter().enumerate() {
        let Some(kr) = kr else { continue };
        let order = sorted(axis);
        for (bin, &i) in bins.iter_mut().zip(&order[..count]) {
            *bin = entries[usize::from(i)].1;
        }
        let divides = |after: usize| along(order[after], axis) < along(order[after + 1], axis);
        cheapest_cut(&bins[..count], divides, axis, kr, &mut best);
    }
    let cut: Cut = best?;
    let left_count = cut.after + 1;
    let mut places = [0; EXACT_UP_TO];
    places[..count].copy_from_slice(cluster);
    let mut outlines = [Outline::NONE; 2];
    for (at, (place, i)) in cluster.iter_mut().zip(sorted(cut.axis)).enumerate() {
        *place = places[usize::from(i)];
        outlines[usize::from(at >= left_count)].add(items.centers[*place as usize]);
    }
    Some(Halves { left_count, cost: cut.cost, outlines })
}

fn partition_binned(items: &Items, cluster: &mut [u32], outline: &Outline) -> Option<Halves> {
    let slabs = Slabs::new(outline);
    let steps = outline.steps();
    let fill = |part: &[u32]| {
        let mut bins = [[Bin::EMPTY; BINS]; 3];
        for &place in part {
            let shape = &items.shapes[place as usize];
            let directed = steps.round(shape.directed);
            let at = slabs.of(items.centers[place as usize]);
            for axis in 0..3 {
                bins[axis][at[axis]].add(shape, directed);
            }
        }
        bins
    };
    let bins = if cluster.len() <= CHUNK {
        fill(cluster)
    } else {
        let merge = |mut sums: [[Bin; BINS]; 3], bins: [[Bin; BINS]; 3]| {
            let both = sums.as_flattened_mut().iter_mut().zip(bins.as_flattened());
            both.for_each(|(sum, bin)| sum.merge(bin));
            sums
        };
        cluster.par_chunks(CHUNK).map(fill).reduce(|| [[Bin::EMPTY; BINS]; 3], merge)
    };
    let mut best = None;
    for (axis, kr) in regularisation(outline).into_iter().enumerate() {
        let Some(kr) = kr else { continue };
        let bins = &bins[axis];
        let Some(last) = bins.iter().rposition(|bin| !bin.is_empty()) else { continue };
        cheapest_cut(bins, |after| !bins[after].is_empty() && after < last, axis, kr, &mut best);
    }
    let Cut { axis, after, cost, .. } = best?;
    let (left_count, outlines) = move_to_front(items, cluster, slabs.beyond(axis, after));
    Some(Halves { left_count, cost, outlines })
}

/// Tries the cuts after all bins for which `divides` holds. Of equally cheap cuts it keeps the first.
fn cheapest_cut(
    bins: &[Bin],
    divides: impl Fn(usize) -> bool,
    axis: usize,
    kr: f64,
    best: &mut Option<Cut>,
) {
    let mut right_costs = [0.0; BINS];
    let mut right = Bin::EMPTY;
    for i in (1..bins.len()).rev() {
        right.merge(&bins[i]);
        right_costs[i] = right.cost();
    }
    let mut left = Bin::EMPTY;
    for after in 0..bins.len() - 1 {
        left.merge(&bins[after]);
        if !divides(after) {
            continue;
        }
        let cost = [left.cost(), right_costs[after + 1]];
        let total = kr * (cost[0] + cost[1]);
        if best.as_ref().is_none_or(|best| total < best.total) {
            *best = Some(Cut { total, cost, axis, after });
        }
    }
}

/// The slabs of a cluster along each axis.
struct Slabs {
    min: Vec4,
    per_metre: Vec4,
}

impl Slabs {
    /// 2^23: from here on single precision has whole numbers only.
    const WHOLE: f32 = 8_388_608.0;

    fn new(outline: &Outline) -> Slabs {
        // Finite, so that it can be multiplied by zero.
        let per_metre = |extent: f32| (BINS as f32 / extent).min(f32::MAX);
        let per_metre = Vec3::from_array(outline.extent().to_array().map(per_metre));
        Slabs { min: outline.min().extend(0.0), per_metre: per_metre.extend(0.0) }
    }

    /// The slab of each axis that a centre is in, plus [`WHOLE`](Slabs::WHOLE).
    #[inline]
    fn rounded(&self, center: Vec4) -> Vec4 {
        let middle = (center - self.min) * self.per_metre - 0.5;
        middle.min(Vec4::splat((BINS - 1) as f32)).max(Vec4::ZERO) + Slabs::WHOLE
    }

    #[inline]
    fn of(&self, center: Vec4) -> [usize; 3] {
        let slabs = self.rounded(center).truncate();
        slabs.to_array().map(|slab| slab.to_bits() as usize % BINS)
    }

    /// Tells whether centres are beyond a slab of an axis.
    fn beyond(&self, axis: usize, slab: usize) -> impl Fn(Vec4) -> bool {
        let mut most = Vec4::INFINITY;
        most[axis] = Slabs::WHOLE + slab as f32;
        move |center| self.rounded(center).cmpgt(most).any()
    }
}

/// Moves the items of the left half to the front. Both halves keep their order, so that memory is read
/// in order. Returns the number of items on the left and the outlines of both halves.
fn move_to_front(
    items: &Items,
    cluster: &mut [u32],
    is_right: impl Fn(Vec4) -> bool + Sync,
) -> (usize, [Outline; 2]) {
    let move_part = |part: &mut [u32]| move_part_to_front(items, part, &is_right);
    if cluster.len() <= CHUNK {
        return move_part(cluster);
    }
    let parts: Vec<_> = cluster.par_chunks_mut(CHUNK).map(move_part).collect();
    let (mut front, mut others) = (0, Vec::with_capacity(cluster.len()));
    let mut outlines = [Outline::NONE; 2];
    for (i, (count, [left, right])) in parts.into_iter().enumerate() {
        let (start, end) = (i * CHUNK, cluster.len().min((i + 1) * CHUNK));
        others.extend_from_slice(&cluster[start + count..end]);
        cluster.copy_within(start..start + count, front);
        front += count;
        outlines = [outlines[0].and(left), outlines[1].and(right)];
    }
    cluster[front..].copy_from_slice(&others);
    (front, outlines)
}

fn move_part_to_front(
    items: &Items,
    part: &mut [u32],
    is_right: impl Fn(Vec4) -> bool,
) -> (usize, [Outline; 2]) {
    let mut outlines = [Outline::NONE; 2];
    let (mut front, mut behind, mut others) = (0, 0, vec![0; part.len()]);
    // Without branches, which the processor could not predict.
    for at in 0..part.len() {
        let place = part[at];
        let center = items.centers[place as usize];
        let half = usize::from(is_right(center));
        (part[front], others[behind]) = (place, place);
        front += 1 - half;
        behind += half;
        outlines[half].add(center);
    }
    part[front..].copy_from_slice(&others[..behind]);
    (front, outlines)
}
