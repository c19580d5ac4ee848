//! An eight-wide bounding hierarchy: its nodes, and how it is built and walked.
//!
//! The [binary tree](super::binary_bvh) underneath is collapsed so that one step tests eight boxes,
//! and small subtrees become leaves of up to four primitives, which one step tests together as well.
//! The box test never misses a box that the exact ray enters, at any scale. As in Ize 2013 ("Robust BVH Ray
//! Traversal"), a ray leaves boxes a little later than it is computed to. As the product of origin and inverse is
//! taken once for a ray, what that rounds away is added to both sides.

use super::binary_bvh::{self, BinaryNode};
use super::blas::LARGEST_COORDINATE;
use super::cover::{Costs, half_area};
use super::lanes::{LANES, Lanes, WithLanes, prefetch, scattered, with_widest};
use crate::bounds::Aabb;
use glam::Vec3;

/// Most primitives of a leaf.
pub const LEAF_SIZE: usize = 4;
/// Marks a child that is a leaf; the other bits are the leaf's number.
const LEAF: u32 = 1 << 31;
/// No child, no primitive.
pub const NONE: u32 = u32::MAX;
/// Stack entries that most walks clear, 384 bytes: enough for a tree 6 nodes deep.
const SHALLOW: usize = 48;
/// Stack entries kept out of the heap: enough for a tree 22 nodes deep.
const DEEP: usize = 160;
/// Rays that start beyond this start at it.
const FARTHEST: f32 = 1e30;
/// No product of a coordinate and an inverse is larger.
const MOST_PRODUCT: f32 = 1e37;
/// Four halves of an ulp: rounding the product of an origin and an inverse, and the sum with this, costs two.
const PRODUCT_SLACK: f32 = 2.0 * f32::EPSILON;
/// `1 + 2 gamma(3)`: what rounding can take from the distance at which a ray leaves a box.
const FAR_SLACK: f32 = 1.000_000_5;

/// The hierarchy. Leaves are numbers into whatever its owner keeps in their order.
#[derive(Debug, Default)]
pub struct WideBvh {
    nodes: Vec<Node>,
    /// Entries that a walk may need.
    stack: usize,
}

/// Four cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    /// Lower and upper planes of the children, by axis.
    planes: [[[f32; LANES]; 2]; 3],
    /// Node number, or leaf number with [`LEAF`].
    children: [u32; LANES],
}

/// What the box test needs of a ray. Its distance to a plane is the plane's place times `inverse`, plus a term.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    inverse: [f32; 3],
    /// The terms of planes that are met first, and of those that are met last.
    terms: [[f32; 3]; 2],
    /// Which of an axis' two planes is met first.
    near: [usize; 3],
}

impl BoxRay {
    /// A ray; the direction need not have unit length.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> BoxRay {
        // Bounded, so that products with coordinates stay finite: otherwise nothing could be said of empty slots.
        let origin = origin.clamp(Vec3::splat(-FARTHEST), Vec3::splat(FARTHEST));
        let most = MOST_PRODUCT / origin.abs().max_element().max(LARGEST_COORDINATE);
        let inverse = direction.recip().clamp(Vec3::splat(-most), Vec3::splat(most));
        let product = origin * inverse;
        let slack = product.abs() * PRODUCT_SLACK;
        let near = inverse.to_array().map(|i| usize::from(i < 0.0));
        let terms = [-product - slack, slack - product].map(|term| term.to_array());
        BoxRay { inverse: inverse.to_array(), terms, near }
    }
}

/// What is done at the leaves of a walk.
pub trait AtLeaf {
    /// Takes a leaf's number and returns the new `tmax`; a negative one ends the walk.
    fn visit(&mut self, leaf: u32) -> f32;

    /// Begins to fetch what [`visit`](Self::visit) will look at.
    #[inline(always)]
    fn prefetch(&self, _leaf: u32) {}
}

impl<F: FnMut(u32) -> f32> AtLeaf for F {
    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> f32 {
        self(leaf)
    }
}

impl WideBvh {
    /// Builds over boxes, with leaves of up to `leaf_size <= LEAF_SIZE` of them. Returns the box numbers of
    /// each leaf, in leaf order, padded with [`NONE`]. Every box must be finite.
    pub fn build(boxes: &[Aabb], leaf_size: u32) -> (WideBvh, Vec<[u32; LEAF_SIZE]>) {
        if boxes.is_empty() {
            return (WideBvh::default(), Vec::new());
        }
        Collapse::run(&binary_bvh::build(boxes), leaf_size)
    }

    /// Visits the leaves whose boxes the ray enters before `tmax`, near ones first if `ORDERED`; if not, large ones,
    /// which are more likely to be met.
    #[inline(always)]
    pub fn walk<const ORDERED: bool>(&self, ray: &BoxRay, tmax: f32, at_leaf: impl AtLeaf) {
        if !self.nodes.is_empty() {
            with_widest(Walk::<_, ORDERED> { tree: self, ray, tmax, at_leaf });
        }
    }
}

/// A walk that is to be made.
struct Walk<'a, A, const ORDERED: bool> {
    tree: &'a WideBvh,
    ray: &'a BoxRay,
    tmax: f32,
    at_leaf: A,
}

impl<A: AtLeaf, const ORDERED: bool> WithLanes for Walk<'_, A, ORDERED> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (mut shallow, mut deep, mut deeper);
        let stack: &mut [(u32, f32)] = if self.tree.stack <= SHALLOW {
            shallow = [(0, 0.0); SHALLOW];
            &mut shallow
        } else if self.tree.stack <= DEEP {
            deep = [(0, 0.0); DEEP];
            &mut deep
        } else {
            deeper = vec![(0, 0.0); self.tree.stack];
            &mut deeper
        };
        self.run_on::<L>(stack);
    }
}

impl<A: AtLeaf, const ORDERED: bool> Walk<'_, A, ORDERED> {
    #[inline(always)]
    fn prefetch(&self, child: u32) {
        match child & LEAF {
            0 => prefetch(&self.tree.nodes, child),
            _ => self.at_leaf.prefetch(child & !LEAF),
        }
    }

    #[inline(always)]
    fn run_on<L: Lanes>(mut self, stack: &mut [(u32, f32)]) {
        let ray = LaneRay::<L>::new(self.ray);
        let (mut depth, mut current) = (0, 0);
        loop {
            if current & LEAF != 0 {
                self.tmax = self.at_leaf.visit(current & !LEAF);
                if self.tmax < 0.0 {
                    return;
                }
            } else {
                let node = &self.tree.nodes[current as usize];
                let (distances, mut hits) = node.enter(&ray, self.tmax);
                if hits != 0 {
                    let child = take_lowest(&mut hits);
                    current = node.children[child];
                    if hits == 0 {
                        continue;
                    }
                    // The nearest is gone on with; the others wait, the farthest below.
                    let (mut nearest, base) = (distances[child], depth);
                    while hits != 0 {
                        let child =
                            if ORDERED { take_lowest(&mut hits) } else { take_highest(&mut hits) };
                        let mut waiting = (node.children[child], distances[child]);
                        if ORDERED && waiting.1 < nearest {
                            let nearer = waiting;
                            waiting = (current, nearest);
                            (current, nearest) = nearer;
                        }
                        let mut at = depth;
                        while ORDERED && at > base && stack[at - 1].1 < waiting.1 {
                            stack[at] = stack[at - 1];
                            at -= 1;
                        }
                        stack[at] = waiting;
                        depth += 1;
                        self.prefetch(waiting.0);
                    }
                    continue;
                }
            }
            loop {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                let (next, distance) = stack[depth];
                if distance <= self.tmax {
                    current = next;
                    break;
                }
            }
        }
    }
}

/// Takes the lowest bit out; its number.
#[inline(always)]
fn take_lowest(bits: &mut u32) -> usize {
    let lowest = bits.trailing_zeros() as usize % LANES;
    *bits &= *bits - 1;
    lowest
}

/// Takes the highest bit out; its number.
#[inline(always)]
fn take_highest(bits: &mut u32) -> usize {
    let highest = bits.ilog2() as usize % LANES;
    *bits ^= 1 << highest;
    highest
}

/// A [`BoxRay`] in all lanes.
struct LaneRay<L> {
    inverse: [L; 3],
    terms: [[L; 3]; 2],
    near: [usize; 3],
}

impl<L: Lanes> LaneRay<L> {
    #[inline(always)]
    fn new(ray: &BoxRay) -> LaneRay<L> {
        let splat = |[x, y, z]: [f32; 3]| [L::splat(x), L::splat(y), L::splat(z)];
        let [first, last] = ray.terms;
        LaneRay { inverse: splat(ray.inverse), terms: [splat(first), splat(last)], near: ray.near }
    }
}

impl Node {
    const EMPTY: Node =
        Node { planes: [[[f32::MAX; LANES], [f32::MIN; LANES]]; 3], children: [NONE; LANES] };

    /// Distances at which the ray enters the children, and a bit for each that it enters before
    /// `tmax`.
    #[inline(always)]
    fn enter<L: Lanes>(&self, ray: &LaneRay<L>, tmax: f32) -> ([f32; LANES], u32) {
        let [x, y, z] = ray.near;
        let plane = |axis: usize, side: usize, last: usize| {
            let planes = L::load(&self.planes[axis][side & 1]);
            planes.times_plus(ray.inverse[axis], ray.terms[last][axis])
        };
        let near = plane(0, x, 0).max(plane(1, y, 0)).max(plane(2, z, 0).max(L::splat(0.0)));
        let far = plane(0, x ^ 1, 1).min(plane(1, y ^ 1, 1)).min(plane(2, z ^ 1, 1));
        let far = far.mul(L::splat(FAR_SLACK)).min(L::splat(tmax));
        (near.store(), near.at_most(far))
    }
}

/// From the binary tree to the wide one.
struct Collapse<'a> {
    binary: &'a [BinaryNode],
    leaf_size: u32,
    costs: Costs,
    wide: WideBvh,
    leaves: Vec<[u32; LEAF_SIZE]>,
}

impl Collapse<'_> {
    fn run(binary: &[BinaryNode], leaf_size: u32) -> (WideBvh, Vec<[u32; LEAF_SIZE]>) {
        let (wide, leaves) = (WideBvh::default(), Vec::new());
        let mut collapse =
            Collapse { binary, leaf_size, costs: Costs::of(binary, leaf_size), wide, leaves };
        // Nodes are numbered as they are reached depth first; each patches its parent.
        let mut open = vec![(0_usize, None::<(usize, usize)>, 1_usize)];
        let mut deepest = 0;
        while let Some((top, parent, level)) = open.pop() {
            deepest = deepest.max(level);
            let number = collapse.wide.nodes.len();
            if let Some((node, slot)) = parent {
                collapse.wide.nodes[node].children[slot] = number as u32;
            }
            collapse.wide.nodes.push(Node::EMPTY);
            for (slot, child) in collapse.children_of(top).into_iter().enumerate() {
                let bounds = binary[child].bounds;
                let is_leaf = collapse.is_leaf(child);
                let node = &mut collapse.wide.nodes[number];
                for axis in 0..3 {
                    node.planes[axis][0][slot] = bounds.min[axis];
                    node.planes[axis][1][slot] = bounds.max[axis];
                }
                if is_leaf {
                    node.children[slot] = LEAF | collapse.leaves.len() as u32;
                    let leaf = collapse.primitives_of(child);
                    collapse.leaves.push(leaf);
                } else {
                    open.push((child, Some((number, slot)), level + 1));
                }
            }
        }
        collapse.wide.stack = (LANES - 1) * deepest + 1;
        let mut nodes = scattered(collapse.wide.nodes.len());
        nodes.append(&mut collapse.wide.nodes);
        collapse.wide.nodes = nodes;
        (collapse.wide, collapse.leaves)
    }

    /// Up to eight descendants that cover `top`, the largest first.
    fn children_of(&self, top: usize) -> Vec<usize> {
        let mut children = match self.is_leaf(top) {
            true => vec![top],
            false => self.costs.children_of(self.binary, top),
        };
        let area = |&child: &usize| half_area(&self.binary[child]);
        children.sort_by(|a, b| area(b).total_cmp(&area(a)));
        children
    }

    fn is_leaf(&self, node: usize) -> bool {
        self.binary[node].count <= self.leaf_size
    }

    fn primitives_of(&self, top: usize) -> [u32; LEAF_SIZE] {
        let mut found = [NONE; LEAF_SIZE];
        let (mut filled, mut open) = (0, vec![top]);
        while let Some(node) = open.pop() {
            let BinaryNode { first, count, .. } = self.binary[node];
            if count == 1 {
                found[filled] = first;
                filled += 1;
            } else {
                open.extend([first as usize + 1, first as usize]);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanes::Two;
    use super::*;
    use crate::math::random::hash;

    #[test]
    fn no_box_that_the_exact_ray_enters_is_missed() {
        let number = |seed: u32, n: u32| (hash(seed, n) >> 8) as f32 / 8_388_608.0 - 1.0;
        let point = |seed, n| Vec3::new(number(seed, n), number(seed, n + 1), number(seed, n + 2));
        for seed in 0..20_000 {
            // Origins and directions of very different sizes, some along an axis, some almost.
            let decades = |n: u32, most: u32| {
                10_f32.powi((hash(seed, n) % (2 * most + 1)) as i32 - most as i32)
            };
            let mut direction = point(seed, 0) * decades(20, 9);
            direction[seed as usize % 3] *= [1.0, 0.0, -0.0, 1e-12][hash(seed, 21) as usize % 4];
            let origin = point(seed, 3) * decades(22, 9);
            let t = f64::from(number(seed, 6).abs() * decades(23, 6));
            let exact = origin.as_dvec3() + t * direction.as_dvec3();
            let rounded = exact.as_vec3();
            // The smallest box around a point of the ray; sums in 64 bits may be off in their last.
            let below = rounded.to_array().map(f32::next_down).into();
            let bounds = Aabb { min: below, max: rounded.to_array().map(f32::next_up).into() };
            let (tree, _) = WideBvh::build(&[bounds], 1);
            let ray = BoxRay::new(origin, direction);
            let tmax = t as f32 * 1.000_002;
            let (mut widest, mut narrow) = (0, 0);
            tree.walk::<true>(&ray, tmax, |_| {
                widest += 1;
                tmax
            });
            let at_leaf = |_| {
                narrow += 1;
                tmax
            };
            Walk::<_, false> { tree: &tree, ray: &ray, tmax, at_leaf }.run::<Two>();
            assert_eq!((widest, narrow), (1, 1), "{seed}: {origin} {direction} {t}");
        }
    }

    #[test]
    fn a_ray_from_beyond_all_bounds_meets_no_empty_slot() {
        let (tree, _) = WideBvh::build(&[Aabb { min: Vec3::ZERO, max: Vec3::ONE }], 1);
        let numbers = [0.0, -0.0, 1.0, -1e30, f32::MAX, f32::INFINITY, f32::NEG_INFINITY];
        for (origin, direction) in
            numbers.iter().flat_map(|a| numbers[..5].iter().map(move |b| (*a, *b)))
        {
            let ray =
                BoxRay::new(Vec3::new(origin, 1.0, origin), Vec3::new(1.0, direction, direction));
            tree.walk::<true>(&ray, f32::INFINITY, |leaf| {
                assert_eq!(leaf, 0);
                f32::INFINITY
            });
        }
    }

    #[test]
    fn a_deep_tree_is_walked_from_the_heap() {
        // Each box is a little larger than the one in it: a division by cost takes off few.
        let nested = |i: i32| {
            let size = 10_f32.powf((i - 30_000) as f32 / 1_000.0);
            Aabb { min: Vec3::ZERO, max: Vec3::splat(size) }
        };
        let boxes: Vec<_> = (0..60_000).map(nested).collect();
        let (tree, leaves) = WideBvh::build(&boxes, 1);
        assert!(tree.stack > DEEP, "only {} entries", tree.stack);
        let ray = BoxRay::new(Vec3::splat(-1.0), Vec3::ONE);
        let mut visited = vec![false; leaves.len()];
        tree.walk::<true>(&ray, f32::INFINITY, |leaf| {
            assert!(!std::mem::replace(&mut visited[leaf as usize], true));
            f32::INFINITY
        });
        assert!(visited.iter().all(|&seen| seen));
    }
}
