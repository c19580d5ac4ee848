//! The binary hierarchy underneath the wide one, built top-down.
//!
//! Each node is divided where the surface area heuristic says (Goldsmith and Salmon 1987; binned as
//! in Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies"), along any of the
//! three axes. Small nodes are not binned but swept: every division is tried.
//!
//! The time is `O(n log n)` for every input. A division by cost alone may take off one box a level,
//! as it does where sizes grow like a geometric sequence. So a node that has used up its levels is
//! halved instead, and no tree has more than [`most_levels`]. Bottom-up builders lack such a bound:
//! where all costs are equal, PLOC merges one pair in each pass over all boxes.
//!
//! The result depends on the boxes and their order alone, not on the number of threads.

use crate::bounds::Aabb;
use glam::{Vec3, Vec3A};
use rayon::prelude::*;
use std::cmp::Ordering;

/// Bins along an axis.
const BINS: usize = 32;
/// Nodes of no more boxes are swept.
const SWEPT: usize = 24;
/// Nodes of more boxes are shared out among threads.
const PARALLEL: usize = 1 << 12;

/// A node.
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// Around everything below.
    pub bounds: Aabb,
    /// The first of its two children, which stand side by side; of a leaf the number of its box.
    pub first: u32,
    /// Boxes below; a leaf has one.
    pub count: u32,
}

/// Levels that a tree over so many boxes has at most.
pub fn most_levels(count: usize) -> u32 {
    3 * halvings(count) + 8
}

/// How often a number of boxes is halved, rounding up, until one is left.
fn halvings(count: usize) -> u32 {
    count.next_power_of_two().trailing_zeros()
}

/// Builds over finite boxes. The root comes first; without boxes there is none.
pub fn build(boxes: &[Aabb]) -> Vec<BinaryNode> {
    if boxes.is_empty() {
        return Vec::new();
    }
    let item = |(number, bounds): (usize, &Aabb)| Item {
        bounds: Extent { low: bounds.min.into(), high: bounds.max.into() },
        number: number as u32,
    };
    let mut items: Vec<Item> = boxes.par_iter().enumerate().map(item).collect();
    let unset = BinaryNode { bounds: Aabb::EMPTY, first: 0, count: 0 };
    let mut nodes = vec![unset; 2 * boxes.len() - 1];
    let (root, below) = nodes.split_at_mut(1);
    divide(&mut items, &mut root[0], below, 1, most_levels(boxes.len()));
    nodes
}

/// Fills in a node and all nodes below it. `first` is the number of the first of those; `levels` is
/// how many levels there may be, this node's included.
fn divide(
    items: &mut [Item],
    node: &mut BinaryNode,
    below: &mut [BinaryNode],
    first: u32,
    levels: u32,
) {
    if let [item] = items {
        *node = BinaryNode { bounds: item.bounds.aabb(), first: item.number, count: 1 };
        return;
    }
    let around = Around::all(items);
    *node = BinaryNode { bounds: around.bounds.aabb(), first, count: items.len() as u32 };
    let left = if levels - 1 <= halvings(items.len()) {
        halve(items, &around)
    } else if items.len() <= SWEPT {
        sweep(items)
    } else {
        bin(items, &around)
    };
    let is_large = items.len() > PARALLEL;
    let (left, right) = items.split_at_mut(left);
    let (children, below) = below.split_at_mut(2);
    let (child_a, child_b) = children.split_at_mut(1);
    let (below_a, below_b) = below.split_at_mut(2 * left.len() - 2);
    let (first_a, first_b) = (first + 2, first + 2 * left.len() as u32);
    let mut a = || divide(left, &mut child_a[0], below_a, first_a, levels - 1);
    let mut b = || divide(right, &mut child_b[0], below_b, first_b, levels - 1);
    if is_large {
        rayon::join(a, b);
    } else {
        a();
        b();
    }
}

/// A box on its way into the tree.
#[derive(Clone, Copy)]
struct Item {
    bounds: Extent,
    number: u32,
}

impl Item {
    /// Twice the middle.
    fn middle(&self) -> Vec3A {
        self.bounds.low + self.bounds.high
    }
}

/// A box, aligned for arithmetic.
#[derive(Clone, Copy)]
struct Extent {
    low: Vec3A,
    high: Vec3A,
}

impl Extent {
    const NOTHING: Extent = Extent { low: Vec3A::INFINITY, high: Vec3A::NEG_INFINITY };

    fn union(self, other: Extent) -> Extent {
        Extent { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half the surface. In double precision, so that boxes of a picometre have one.
    fn half_area(self) -> f64 {
        let size = (self.high - self.low).as_dvec3();
        if size.x < 0.0 { 0.0 } else { size.x * size.y + size.y * size.z + size.z * size.x }
    }

    fn aabb(self) -> Aabb {
        Aabb { min: Vec3::from(self.low), max: Vec3::from(self.high) }
    }
}

/// What some items fill.
#[derive(Clone, Copy)]
struct Around {
    bounds: Extent,
    /// Around twice their middles.
    middles: Extent,
}

impl Around {
    const NOTHING: Around = Around { bounds: Extent::NOTHING, middles: Extent::NOTHING };

    fn all(items: &[Item]) -> Around {
        let both = |a: Around, b: Around| Around {
            bounds: a.bounds.union(b.bounds),
            middles: a.middles.union(b.middles),
        };
        let one = |item: &Item| {
            let middle = item.middle();
            Around { bounds: item.bounds, middles: Extent { low: middle, high: middle } }
        };
        let of = |items: &[Item]| items.iter().map(one).fold(Around::NOTHING, both);
        if items.len() <= PARALLEL {
            return of(items);
        }
        items.par_chunks(PARALLEL).map(of).reduce(|| Around::NOTHING, both)
    }
}

fn by_middle(axis: usize) -> impl Fn(&Item, &Item) -> Ordering {
    move |a, b| {
        let order = a.middle()[axis].total_cmp(&b.middle()[axis]);
        order.then(a.number.cmp(&b.number))
    }
}

/// Puts the lower half along the longest axis of the middles first; returns its length.
fn halve(items: &mut [Item], around: &Around) -> usize {
    let size = around.middles.high - around.middles.low;
    let longest = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, by_middle(longest));
    half
}

/// Tries every division along every axis. Puts the lower part of the cheapest first, of equals the
/// most even; returns its length.
fn sweep(items: &mut [Item]) -> usize {
    let count = items.len();
    let mut best = (f64::INFINITY, count, 0, 0);
    let mut right = [0.0; SWEPT];
    for axis in 0..3 {
        items.sort_unstable_by(by_middle(axis));
        let mut bounds = Extent::NOTHING;
        for at in (1..count).rev() {
            bounds = bounds.union(items[at].bounds);
            right[at] = bounds.half_area() * (count - at) as f64;
        }
        let mut bounds = Extent::NOTHING;
        for at in 1..count {
            bounds = bounds.union(items[at - 1].bounds);
            let cost = bounds.half_area() * at as f64 + right[at];
            let uneven = count.abs_diff(2 * at);
            if (cost, uneven) < (best.0, best.1) {
                best = (cost, uneven, axis, at);
            }
        }
    }
    let (_, _, axis, left) = best;
    items.sort_unstable_by(by_middle(axis));
    left
}

/// Divides between the bins where it is cheapest, or in halves if all items fall into one bin.
/// Returns the length of the lower part, which it puts first.
fn bin(items: &mut [Item], around: &Around) -> usize {
    let grid = Grid::new(around);
    let bins = if items.len() <= PARALLEL {
        Bins::filled(items, &grid)
    } else {
        let parts = items.par_chunks(PARALLEL).map(|part| Bins::filled(part, &grid));
        parts.reduce(|| Bins::EMPTY, Bins::plus)
    };
    let mut best = (f64::INFINITY, 0, 0);
    for (axis, bins) in bins.0.iter().enumerate() {
        let mut right = [(0.0, 0); BINS];
        let mut upper = Bin::EMPTY;
        for at in (1..BINS).rev() {
            upper = upper.plus(bins[at]);
            right[at] = (upper.cost(), upper.count);
        }
        let mut lower = Bin::EMPTY;
        for at in 1..BINS {
            lower = lower.plus(bins[at - 1]);
            let cost = lower.cost() + right[at].0;
            if lower.count > 0 && right[at].1 > 0 && cost < best.0 {
                best = (cost, axis, at);
            }
        }
    }
    match best {
        (f64::INFINITY, ..) => halve(items, around),
        (_, axis, at) => put_first(items, |item| grid.bins_of(item)[axis] < at),
    }
}

/// Puts the items that are chosen first; returns how many there are.
fn put_first(items: &mut [Item], is_chosen: impl Fn(&Item) -> bool) -> usize {
    let mut chosen = 0;
    for at in 0..items.len() {
        if is_chosen(&items[at]) {
            items.swap(at, chosen);
            chosen += 1;
        }
    }
    chosen
}

/// The items whose middles are in one slab of an axis.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Extent,
    count: u32,
}

impl Bin {
    const EMPTY: Bin = Bin { bounds: Extent::NOTHING, count: 0 };

    fn plus(self, other: Bin) -> Bin {
        Bin { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }

    fn cost(self) -> f64 {
        self.bounds.half_area() * f64::from(self.count)
    }
}

/// The bins of each axis.
#[derive(Clone, Copy)]
struct Bins([[Bin; BINS]; 3]);

impl Bins {
    const EMPTY: Bins = Bins([[Bin::EMPTY; BINS]; 3]);

    fn filled(items: &[Item], grid: &Grid) -> Bins {
        let mut bins = Bins::EMPTY;
        for item in items {
            for (bins, at) in bins.0.iter_mut().zip(grid.bins_of(item)) {
                bins[at] = bins[at].plus(Bin { bounds: item.bounds, count: 1 });
            }
        }
        bins
    }

    fn plus(mut self, other: Bins) -> Bins {
        for (own, other) in self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()) {
            *own = own.plus(*other);
        }
        self
    }
}

/// Where the bins are.
struct Grid {
    low: Vec3A,
    bins_per_length: Vec3A,
}

impl Grid {
    fn new(around: &Around) -> Grid {
        let size = around.middles.high - around.middles.low;
        // Along an axis without extent all items fall into the first bin.
        let bins_per_length = BINS as f32 / size.max(Vec3A::splat(f32::MIN_POSITIVE));
        Grid {
            low: around.middles.low,
            bins_per_length: bins_per_length.min(Vec3A::splat(f32::MAX)),
        }
    }

    fn bins_of(&self, item: &Item) -> [usize; 3] {
        let at = (item.middle() - self.low) * self.bins_per_length;
        at.to_array().map(|at| (at as usize).min(BINS - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::hash;

    fn uniform(number: usize, salt: u32) -> f32 {
        (hash(number as u32, salt) >> 8) as f32 / 16_777_216.0
    }

    fn at(place: Vec3, size: f32) -> Aabb {
        Aabb { min: place, max: place + size }
    }

    /// Inputs at which builders by cost go wrong, and ordinary ones.
    fn inputs(count: usize) -> Vec<(&'static str, Vec<Aabb>)> {
        let side = (count as f64).sqrt().ceil() as usize;
        let decades = |i: usize| 10_f32.powf(-12.0 + 24.0 * i as f32 / count as f32);
        let all = |f: &dyn Fn(usize) -> Aabb| (0..count).map(f).collect::<Vec<_>>();
        let random = |i: usize| Vec3::new(uniform(i, 1), uniform(i, 2), uniform(i, 3));
        vec![
            ("a row", all(&|i| at(Vec3::X * i as f32, 0.5))),
            ("a row of touching boxes", all(&|i| at(Vec3::Y * i as f32, 1.0))),
            ("a grid", all(&|i| at(Vec3::new((i % side) as f32, 0.0, (i / side) as f32), 0.5))),
            ("one place", all(&|_| at(Vec3::ONE, 1.0))),
            ("one point", all(&|_| at(Vec3::ONE, 0.0))),
            ("nested boxes", all(&|i| at(Vec3::ZERO, decades(i)))),
            ("boxes around one middle", all(&|i| at(Vec3::splat(-decades(i)), 2.0 * decades(i)))),
            ("places like a geometric sequence", all(&|i| at(Vec3::X * decades(i), 0.0))),
            ("both", all(&|i| at(Vec3::Z * decades(i), 0.1 * decades(i)))),
            (
                "sizes over many decades",
                all(&|i| {
                    let size = 10_f32.powf(-12.0 + 24.0 * uniform(i, 4));
                    at(random(i) * size, size)
                }),
            ),
            (
                "one far away",
                all(&|i| if i == 0 { at(Vec3::splat(1e12), 1.0) } else { at(random(i), 0.01) }),
            ),
            (
                "large boxes among small ones",
                all(&|i| at(random(i), if i % 2 == 0 { 1.0 } else { 1e-3 })),
            ),
            ("random boxes", all(&|i| at(random(i), 0.01))),
        ]
    }

    /// Levels of a tree, after a look at every node of it.
    fn checked_levels(nodes: &[BinaryNode], boxes: &[Aabb]) -> u32 {
        let mut seen = vec![false; boxes.len()];
        let (mut deepest, mut visited) = (0, 0);
        let mut open = vec![(0, 1)];
        while let Some((number, level)) = open.pop() {
            visited += 1;
            deepest = deepest.max(level);
            let node = &nodes[number];
            if node.count == 1 {
                assert_eq!(node.bounds, boxes[node.first as usize]);
                assert!(!std::mem::replace(&mut seen[node.first as usize], true));
                continue;
            }
            let [a, b] = [0, 1].map(|side| node.first as usize + side);
            assert_eq!(node.count, nodes[a].count + nodes[b].count);
            assert_eq!(node.bounds, nodes[a].bounds.union(&nodes[b].bounds));
            open.extend([(a, level + 1), (b, level + 1)]);
        }
        assert!(visited == nodes.len() && seen.iter().all(|&seen| seen));
        deepest
    }

    #[test]
    fn no_input_makes_a_tree_deep() {
        // Every level costs linear time: to bound the levels is to bound the time.
        for count in [1, 2, 3, 24, 25, 1000, 30_000] {
            for (name, boxes) in inputs(count) {
                let levels = checked_levels(&build(&boxes), &boxes);
                assert!(levels <= most_levels(count), "{name}, {count}: {levels} levels");
            }
        }
    }

    #[test]
    fn even_rows_and_equal_boxes_are_balanced() {
        for (name, boxes) in inputs(30_000) {
            let is_even = ["a row", "a row of touching boxes", "a grid", "one place", "one point"];
            if is_even.contains(&name) {
                let levels = checked_levels(&build(&boxes), &boxes);
                assert!(levels <= 22, "{name}: {levels} levels");
            }
        }
    }

    #[test]
    fn the_tree_does_not_depend_on_the_number_of_threads() {
        let with = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (one, many) = (with(1), with(5));
        for (name, boxes) in inputs(30_000) {
            let code = |nodes: Vec<BinaryNode>| {
                nodes.into_iter().map(|node| (node.first, node.count)).collect::<Vec<_>>()
            };
            let [a, b] = [&one, &many].map(|pool| code(pool.install(|| build(&boxes))));
            assert!(a == b, "{name}");
        }
    }
}
