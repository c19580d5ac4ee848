//! What cells learn from one another.
//!
//! A few rays tell little of a cluster. But cells are the leaves of a tree of planes, and what was counted
//! in all cells below a plane is known, too. From the top down, each node takes what is known above it
//! for likely, and corrects it by its own count. Where no ray has arrived anywhere below a node, no cell
//! below it needs to find that out again.

use crate::light_tree::WIDTH;

/// What is known above counts for so many rays.
const RAYS_ABOVE: f64 = 4.0;

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
    /// Of each lane the share that is expected to be seen.
    pub shares: [f64; WIDTH],
    /// Of each lane whether no ray has arrived.
    hidden: [bool; WIDTH],
}

/// What is known in each of some cells, which are all below one node. `tallies` has those of each cell, by
/// ascending group; `visit` gets a cell's number and what is known there.
pub fn pool(tallies: Vec<Vec<Tally>>, visit: &(impl Fn(usize, Vec<Known>) + Sync)) {
    // Level by level, the cells last: node `i` has the children `2 i + 1` and `2 i + 2`.
    let cells = tallies.len();
    let mut nodes: Vec<Vec<Tally>> = vec![Vec::new(); cells - 1];
    nodes.extend(tallies);
    for node in (0..cells - 1).rev() {
        nodes[node] = merged(&nodes[2 * node + 1], &nodes[2 * node + 2]);
    }
    descend(&nodes, 0, &[], visit);
}

fn descend(
    nodes: &[Vec<Tally>],
    node: usize,
    above: &[Known],
    visit: &(impl Fn(usize, Vec<Known>) + Sync),
) {
    let known: Vec<Known> = nodes[node].iter().map(|tally| corrected(above, tally)).collect();
    let first_cell = nodes.len() / 2;
    if node >= first_cell {
        return visit(node - first_cell, known);
    }
    rayon::join(
        || descend(nodes, 2 * node + 1, &known, visit),
        || descend(nodes, 2 * node + 2, &known, visit),
    );
}

/// What is known of a group, after what is known above.
fn corrected(above: &[Known], tally: &Tally) -> Known {
    let group = tally.group;
    let above = above.binary_search_by_key(&group, |known| known.group).ok().map(|at| &above[at]);
    let mut known = Known { group, shares: [1.0; WIDTH], hidden: [false; WIDTH] };
    for lane in 0..WIDTH {
        let likely = above.map_or(1.0, |above| above.shares[lane]);
        let is_hidden = above.is_some_and(|above| above.hidden[lane]);
        let [sent, seen] = tally.lanes[lane].map(f64::from);
        known.hidden[lane] = sent > 0.0 && seen == 0.0 || sent == 0.0 && is_hidden;
        known.shares[lane] = match seen {
            _ if sent == 0.0 || is_hidden => likely,
            _ => (seen + RAYS_ABOVE * likely) / (sent + RAYS_ABOVE),
        };
    }
    known
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
