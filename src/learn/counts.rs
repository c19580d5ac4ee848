//! Counts of what is seen, by cell and lane, and the weights that they give.

use crate::light_tree::veil::encode;
use crate::light_tree::{Cell, FrameTree, Front, Picked, Receiver, Veil, WIDTH};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Counts of a shot.
pub struct Counts {
    fronts: Vec<Front>,
    /// Groups in the front of a cell; a smaller front is followed by nothing.
    groups: usize,
    beside: usize,
    of_lanes: Vec<Count>,
    of_beside: Vec<Count>,
}

/// Rays to a cluster.
#[derive(Default)]
struct Count {
    sent: AtomicU32,
    seen: AtomicU32,
}

impl Counts {
    /// Nothing counted yet. `lookers` are receivers of each cell; `most` groups are looked into in each.
    pub fn new(
        tree: &FrameTree,
        lookers: &[Vec<Receiver>],
        most: usize,
        beside: usize,
    ) -> Counts {
        let fronts: Vec<Front> =
            lookers.par_iter().map(|lookers| tree.front(lookers, most)).collect();
        let groups = fronts.iter().map(|front| front.groups.len()).max().unwrap_or(0);
        let none = |count: usize| (0..count).map(|_| Count::default()).collect();
        let of_lanes = none(fronts.len() * groups * WIDTH);
        let of_beside = none(fronts.len() * beside);
        Counts { fronts, groups, beside, of_lanes, of_beside }
    }

    /// Counts a ray from a cell.
    pub fn count(&self, tree: &FrameTree, cell: Cell, light: Picked, seen: bool) {
        let cell = cell.0 as usize;
        match light {
            Picked::Beside(row) => self.of_beside[cell * self.beside + row as usize].add(seen),
            Picked::Emitter(emitter) => {
                let groups = &self.fronts[cell].groups;
                let mut last = None;
                tree.for_each_lane_toward(emitter, |group, lane| {
                    if let Ok(at) = groups.binary_search_by_key(&group, |row| row.group) {
                        last = Some((cell * self.groups + at) * WIDTH + lane);
                    }
                });
                if let Some(at) = last {
                    self.of_lanes[at].add(seen);
                }
            }
        }
    }

    /// What the counts say: veils, and weights beside the tree, cell after cell.
    pub fn weights(&self) -> (Vec<Veil>, Vec<u8>) {
        let of_cell = |cell: usize| {
            let groups = &self.fronts[cell].groups;
            let mut rows = vec![Veil { group: u32::MAX, weights: [255; WIDTH] }; self.groups];
            let mut shares = vec![1.0; groups.len()];
            // Children stand after their parents.
            for (at, group) in groups.iter().enumerate().rev() {
                let of_lane = |lane: usize| match group.inner[lane] {
                    Some(inner) => shares[inner],
                    None => self.of_lanes[(cell * self.groups + at) * WIDTH + lane].share(),
                };
                let own: [f64; WIDTH] = std::array::from_fn(of_lane);
                let sum: f64 = group.importances.iter().sum();
                let seen: f64 = own.iter().zip(group.importances).map(|(a, b)| a * b).sum();
                shares[at] = if sum > 0.0 { seen / sum } else { 1.0 };
                rows[at] = Veil { group: group.group, weights: own.map(|v| encode(v.sqrt())) };
            }
            rows
        };
        let rows = (0..self.fronts.len()).into_par_iter().flat_map_iter(of_cell);
        let beside = self.of_beside.iter().map(|count| encode(count.share().sqrt()));
        (rows.collect(), beside.collect())
    }
}

impl Count {
    fn add(&self, seen: bool) {
        self.sent.fetch_add(1, Ordering::Relaxed);
        self.seen.fetch_add(seen.into(), Ordering::Relaxed);
    }

    /// The share of a cluster that is expected to be seen. Most clusters are either in full view or
    /// hidden: it is taken for equally likely that all of it, none of it, and any share of it is seen.
    fn share(&self) -> f64 {
        let [sent, seen] =
            [&self.sent, &self.seen].map(|count| f64::from(count.load(Ordering::Relaxed)));
        let unsure = (sent + 2.0).powi(-2);
        match seen {
            _ if sent == 0.0 => 1.0,
            _ if seen == 0.0 => unsure,
            _ if seen == sent => 1.0 - unsure,
            _ => (seen + 1.0) / (sent + 2.0),
        }
    }
}
