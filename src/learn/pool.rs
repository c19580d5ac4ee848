//! What cells learn from one another.
//!
//! A few rays tell little of a cluster. But cells are the leaves of a tree of planes, and what was counted
//! in all cells below a plane is known, too. From the top down, each node takes what is known above it
//! for likely, and corrects it by its own count. Where no ray has arrived anywhere below a node, no cell
//! below it needs to find that out again.
//!
//! How much a cell's own count is worth is told by the scene. Behind a wall, neighbouring cells see the same,
//! and cells on its two sides do not: own counts are right. Among stones, cells differ by chance, and what
//! is known above is right. So each ray is held against what is known without it (leave-one-out
//! cross-validation; Stone 1974).

use crate::light_tree::WIDTH;
use crate::light_tree::veil::{decode, encode};
use rayon::prelude::*;

/// For how many rays what is known above may count.
const RAYS_ABOVE: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
/// So many cells, from all over the tree, decide for how many it does.
const JUDGES: usize = 2048;

/// Something for each of [`RAYS_ABOVE`].
type Moments = [f64; RAYS_ABOVE.len()];

/// What was counted of a group.
#[derive(Clone, Copy, Debug)]
pub struct Tally {
    /// Its number.
    pub group: u32,
    /// Of each lane: rays sent, and rays that arrived.
    pub lanes: [[u32; 2]; WIDTH],
}

/// What is known of a group.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Its number.
    pub group: u32,
    /// Of each lane.
    pub lanes: [Share; WIDTH],
}

/// What is known of a lane.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// The share that is expected to be seen.
    pub seen: f64,
    /// No ray has arrived.
    hidden: bool,
}

/// What was counted in some cells, which are all below one node of the tree of planes.
pub struct Pool {
    /// Level by level, the cells last: node `i` has the children `2 i + 1` and `2 i + 2`.
    nodes: Vec<Vec<Tally>>,
}

/// A lane that rays of a cell were counted for, and how much light is expected from it there.
pub struct Lane {
    /// Its group.
    pub group: u32,
    /// Which of the group's it is.
    pub lane: usize,
    /// Importance.
    pub importance: f64,
}

impl Pool {
    /// `tallies` has those of each cell, by ascending group.
    pub fn new(tallies: Vec<Vec<Tally>>) -> Pool {
        let cells = tallies.len();
        let mut nodes: Vec<Vec<Tally>> = vec![Vec::new(); cells - 1];
        nodes.extend(tallies);
        for node in (0..cells - 1).rev() {
            nodes[node] = merged(&nodes[2 * node + 1], &nodes[2 * node + 2]);
        }
        Pool { nodes }
    }

    /// Hands what is known in each cell to `visit`, if what is known above counts for so many rays.
    pub fn for_each_cell(&self, rays_above: f64, visit: &(impl Fn(usize, Vec<Known>) + Sync)) {
        self.descend(rays_above, 0, &[], visit);
    }

    fn descend(
        &self,
        rays_above: f64,
        node: usize,
        above: &[Known],
        visit: &(impl Fn(usize, Vec<Known>) + Sync),
    ) {
        let known: Vec<Known> =
            self.nodes[node].iter().map(|tally| corrected(above, tally, rays_above)).collect();
        let first_cell = self.nodes.len() / 2;
        if node >= first_cell {
            return visit(node - first_cell, known);
        }
        rayon::join(
            || self.descend(rays_above, 2 * node + 1, &known, visit),
            || self.descend(rays_above, 2 * node + 2, &known, visit),
        );
    }

    /// For how many rays what is known above should count: the number with which one pick is least noisy,
    /// if nothing is known yet of the ray that it takes. `lanes` tells the lanes of a cell.
    pub fn rays_above(&self, lanes: impl Fn(usize) -> Vec<Lane> + Sync) -> f64 {
        let cells = self.nodes.len().div_ceil(2);
        let judges: Vec<usize> = (0..cells).step_by(cells.div_ceil(JUDGES)).collect();
        let of_cell = |&cell: &usize| self.second_moments(cell, &lanes(cell));
        let found: Vec<Moments> = judges.par_iter().map(of_cell).collect();
        let sum = |i: usize| found.iter().map(|moments| moments[i]).sum::<f64>();
        let sums: Moments = std::array::from_fn(sum);
        let best = (0..sums.len()).min_by(|&a, &b| sums[a].total_cmp(&sums[b]));
        best.map_or(RAYS_ABOVE[0], |best| RAYS_ABOVE[best])
    }

    /// The second moment of one pick in a cell, for each of [`RAYS_ABOVE`], over that of a pick where nothing
    /// is hidden. A lane of importance `I` and weight `w` is picked with chance `w I / sum (w I)`, and gives
    /// `I` if it is seen.
    fn second_moments(&self, cell: usize, lanes: &[Lane]) -> Moments {
        let leaf = cell + self.nodes.len() / 2;
        let mut path: Vec<usize> =
            std::iter::successors(Some(leaf), |&node| node.checked_sub(1).map(|at| at / 2))
                .collect();
        path.reverse();
        let (mut given, mut weights) = (Moments::default(), Moments::default());
        let mut all = 0.0;
        for &Lane { group, lane, importance } in lanes {
            let count = |&node: &usize| {
                let tallies = &self.nodes[node];
                let at = tallies.binary_search_by_key(&group, |tally| tally.group);
                at.map_or([0, 0], |at| tallies[at].lanes[lane])
            };
            let counts: Vec<[u32; 2]> = path.iter().map(count).collect();
            let Some(&[sent, seen]) = counts.last().filter(|[sent, _]| *sent > 0) else { continue };
            all += importance;
            let share = f64::from(seen) / f64::from(sent);
            for (i, rays_above) in RAYS_ABOVE.into_iter().enumerate() {
                // The weight by all rays but one of those that were seen, or were not.
                let without = |one: u32| {
                    let correct = |above: Share, &[sent, seen]: &[u32; 2]| {
                        above.corrected([sent - 1, seen - one], rays_above)
                    };
                    f64::from(decode(counts.iter().fold(Share::UNKNOWN, correct).weight()))
                };
                if seen > 0 {
                    let weight = without(1);
                    given[i] += importance * share / weight;
                    weights[i] += importance * share * weight;
                }
                if seen < sent {
                    weights[i] += importance * (1.0 - share) * without(0);
                }
            }
        }
        std::array::from_fn(|i| if all > 0.0 { given[i] * weights[i] / (all * all) } else { 0.0 })
    }
}

impl Share {
    const UNKNOWN: Share = Share { seen: 1.0, hidden: false };

    /// What is known after some rays were sent and some of them seen. What is known above, which is `self`,
    /// counts for so many.
    fn corrected(self, [sent, seen]: [u32; 2], rays_above: f64) -> Share {
        let [sent, seen] = [sent, seen].map(f64::from);
        let share = (seen + rays_above * self.seen) / (sent + rays_above);
        Share {
            seen: if sent == 0.0 || self.hidden { self.seen } else { share },
            hidden: if sent > 0.0 { seen == 0.0 } else { self.hidden },
        }
    }

    /// The weight of a lane of which so much is seen, as a table keeps it.
    pub fn weight(self) -> u8 {
        encode(self.seen.sqrt())
    }
}

/// What is known of a group, after what is known above.
fn corrected(above: &[Known], tally: &Tally, rays_above: f64) -> Known {
    let group = tally.group;
    let above = above.binary_search_by_key(&group, |known| known.group).ok().map(|at| &above[at]);
    let lanes = above.map_or([Share::UNKNOWN; WIDTH], |above| above.lanes);
    let lane = |lane: usize| lanes[lane].corrected(tally.lanes[lane], rays_above);
    Known { group, lanes: std::array::from_fn(lane) }
}

/// The sums of two lists, by ascending group.
fn merged(a: &[Tally], b: &[Tally]) -> Vec<Tally> {
    let mut sums = Vec::with_capacity(a.len().max(b.len()));
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    loop {
        let next = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) if x.group == y.group => {
                let add = |lane: usize| [0, 1].map(|i| x.lanes[lane][i] + y.lanes[lane][i]);
                let sum = Tally { group: x.group, lanes: std::array::from_fn(add) };
                a.next();
                b.next();
                Some(sum)
            }
            (Some(x), Some(y)) if x.group < y.group => a.next().copied(),
            (Some(_), None) => a.next().copied(),
            (_, Some(_)) => b.next().copied(),
            (None, None) => None,
        };
        match next {
            Some(sum) => sums.push(sum),
            None => return sums,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::hash;

    const CELLS: usize = 1024;

    /// What is best if a cell sees `share` of each lane and 12 rays look.
    fn best(share: impl Fn(usize, usize) -> f64) -> f64 {
        let tally = |cell: usize| {
            let lane = |lane: usize| {
                let is_seen = |ray: &u32| uniform(cell, lane, *ray) < share(cell, lane);
                [12, (0..12).filter(is_seen).count() as u32]
            };
            vec![Tally { group: 0, lanes: std::array::from_fn(lane) }]
        };
        let lanes = |_| (0..WIDTH).map(|lane| Lane { group: 0, lane, importance: 1.0 }).collect();
        Pool::new((0..CELLS).map(tally).collect()).rays_above(lanes)
    }

    fn uniform(cell: usize, lane: usize, n: u32) -> f64 {
        f64::from(hash(hash(cell as u32, lane as u32), n)) / 4_294_967_296.0
    }

    #[test]
    fn cells_that_differ_by_chance_believe_their_neighbours() {
        // All see half of everything, and chance alone tells them apart.
        assert_eq!(best(|_, _| 0.5), 64.0);
        // Some lanes are hidden more than others, but from all cells alike.
        assert_eq!(best(|_, lane| 0.1 + 0.1 * lane as f64), 64.0);
        // Each sees what its neighbours do not: after a uniform prior own rays count from the second on.
        let own = best(|cell, lane| uniform(cell, lane, 12));
        assert!(own <= 4.0, "{own}");
    }
}
