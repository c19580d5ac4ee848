//! Counts of what is seen, by cell and lane.

use super::pool::{Known, Lane, Tally};
use crate::emitter::InfiniteLight;
use crate::light_tree::learned::BESIDE;
use crate::light_tree::{Cell, FrameTree, Front, FrontGroup, Picked, Receiver, WIDTH};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Counts of a shot.
pub struct Counts {
    fronts: Vec<Front>,
    /// Groups of each cell, those of lights beside the tree among them.
    pub groups: usize,
    lanes: Vec<Count>,
}

/// Rays to a cluster.
#[derive(Default)]
struct Count {
    sent: AtomicU32,
    seen: AtomicU32,
}

impl Counts {
    /// Nothing counted yet. `lookers` are receivers of each cell; `most` groups are looked into in each, and
    /// all lights beside the tree.
    pub fn new(
        tree: &FrameTree,
        lookers: &[Vec<Receiver>],
        most: usize,
        beside: &[InfiniteLight],
    ) -> Counts {
        let front = |lookers: &Vec<Receiver>| {
            let mut front = tree.front(lookers, most);
            // In the unit of the tree's. Forced lights are not picked.
            let mean = |light: &InfiniteLight| {
                let of_each = lookers.iter().map(|looker| light.importance(looker.normal));
                let sum: f64 = of_each.filter(|_| !light.forced).sum();
                sum / lookers.len().max(1) as f64
            };
            let rows = (0..).zip(beside.chunks(WIDTH)).map(|(row, lights)| FrontGroup {
                group: BESIDE + row,
                importances: std::array::from_fn(|lane| lights.get(lane).map_or(0.0, mean)),
                inner: [None; WIDTH],
            });
            front.groups.extend(rows);
            front
        };
        let fronts: Vec<Front> = lookers.par_iter().map(front).collect();
        let groups = fronts.iter().map(|front| front.groups.len()).max().unwrap_or(0);
        let lanes = (0..fronts.len() * groups * WIDTH).map(|_| Count::default()).collect();
        Counts { fronts, groups, lanes }
    }

    /// Counts a ray from a cell.
    pub fn count(&self, tree: &FrameTree, cell: Cell, light: Picked, is_seen: bool) {
        let cell = cell.0 as usize;
        let groups = &self.fronts[cell].groups;
        let mut last = None;
        let mut pass = |group: u32, lane: usize| {
            if let Ok(at) = groups.binary_search_by_key(&group, |row| row.group) {
                last = Some((cell * self.groups + at) * WIDTH + lane);
            }
        };
        match light {
            Picked::Beside(row) => pass(BESIDE + row / WIDTH as u32, row as usize % WIDTH),
            Picked::Emitter(emitter) => tree.for_each_lane_toward(emitter, pass),
        }
        if let Some(at) = last {
            self.lanes[at].sent.fetch_add(1, Ordering::Relaxed);
            self.lanes[at].seen.fetch_add(is_seen.into(), Ordering::Relaxed);
        }
    }

    /// How many rays were counted.
    pub fn sent(&self) -> u64 {
        self.lanes.iter().map(|count| u64::from(count.sent.load(Ordering::Relaxed))).sum()
    }

    /// The share of them that did not arrive; 0 if there are none.
    pub fn hidden(&self) -> f64 {
        if self.sent() == 0 {
            return 0.0;
        }
        let seen: u64 =
            self.lanes.iter().map(|count| u64::from(count.seen.load(Ordering::Relaxed))).sum();
        1.0 - seen as f64 / self.sent() as f64
    }

    /// What was counted in a cell, group by group. A ray to a lane counts for the lanes that lead there.
    pub fn tallies(&self, cell: usize) -> Vec<Tally> {
        let groups = &self.fronts[cell].groups;
        let mut tallies: Vec<Tally> =
            groups.iter().map(|row| Tally { group: row.group, lanes: [[0; 2]; WIDTH] }).collect();
        // Children stand after their parents.
        for (at, row) in groups.iter().enumerate().rev() {
            for lane in 0..WIDTH {
                let sum =
                    |of: &Tally| of.lanes.iter().fold([0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
                tallies[at].lanes[lane] = match row.inner[lane] {
                    Some(inner) => sum(&tallies[inner]),
                    None => {
                        let count = &self.lanes[(cell * self.groups + at) * WIDTH + lane];
                        [&count.sent, &count.seen].map(|count| count.load(Ordering::Relaxed))
                    }
                };
            }
        }
        tallies
    }

    /// The lanes of a cell that are not looked into.
    pub fn last_lanes(&self, cell: usize) -> Vec<Lane> {
        let of_row = |row: &FrontGroup| {
            let lane =
                |lane: usize| Lane { group: row.group, lane, importance: row.importances[lane] };
            let last = (0..WIDTH).filter(|&lane| row.inner[lane].is_none());
            last.map(lane).collect::<Vec<_>>()
        };
        self.fronts[cell].groups.iter().flat_map(of_row).collect()
    }

    /// The share of the light that is hidden in a cell, by importance, after what is known was summed up.
    pub fn hidden_in(&self, cell: usize, known: &[Known]) -> f64 {
        // The root stands first. What is below it is counted there.
        let tops = |at: usize, row: &FrontGroup| at == 0 || row.group >= BESIDE;
        let rows = self.fronts[cell].groups.iter().zip(known).enumerate();
        let lanes = rows
            .filter(|(at, (row, _))| tops(*at, row))
            .flat_map(|(_, (row, known))| row.importances.into_iter().zip(known.lanes));
        let [sum, seen] = lanes.fold([0.0; 2], |[sum, seen], (importance, share)| {
            [sum + importance, seen + importance * share.seen]
        });
        if sum > 0.0 { 1.0 - seen / sum } else { 0.0 }
    }

    /// Replaces what is known of lanes whose own group is known by the mean of its lanes.
    pub fn sum_up(&self, cell: usize, known: &mut [Known]) {
        let groups = &self.fronts[cell].groups;
        for (at, row) in groups.iter().enumerate().rev() {
            for lane in 0..WIDTH {
                if let Some(inner) = row.inner[lane] {
                    let importances = &groups[inner].importances;
                    let sum: f64 = importances.iter().sum();
                    let lanes = known[inner].lanes.iter().zip(importances);
                    let seen = lanes.map(|(lane, importance)| lane.seen * importance);
                    known[at].lanes[lane].seen =
                        if sum > 0.0 { seen.sum::<f64>() / sum } else { 1.0 };
                }
            }
        }
    }
}
