//! Which descendants of a node of the [binary tree](super::binary_bvh) become the children of a wide node: those with
//! which rays cost least, by the surface area heuristic (Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray
//! Traversal on GPUs Through Compressed Wide BVHs", section 3.1).

use super::binary_bvh::BinaryNode;
use super::lanes::LANES;

/// What a leaf costs, where a wide node costs 1.
const LEAF_COST: f32 = 1.5;

/// For each binary node: the cost of covering it with at most so many children of a wide node, less one.
pub struct Costs(Vec<[f32; LANES - 1]>);

impl Costs {
    /// Of a tree whose nodes become leaves if they have no more primitives than `leaf_size`. Children stand behind their
    /// parents.
    pub fn of(binary: &[BinaryNode], leaf_size: u32) -> Costs {
        let mut costs = Costs(vec![[0.0; LANES - 1]; binary.len()]);
        for (number, node) in binary.iter().enumerate().rev() {
            let area = half_area(node);
            let mut least = if node.count <= leaf_size {
                area * LEAF_COST
            } else {
                area + costs.divided(node, LANES).0
            };
            for slots in 1..LANES {
                if slots > 1 && node.count > 1 {
                    least = least.min(costs.divided(node, slots).0);
                }
                costs.0[number][slots - 1] = least;
            }
        }
        costs
    }

    /// The children of the wide node that stands for `top`, which is no leaf.
    pub fn children_of(&self, binary: &[BinaryNode], top: usize) -> Vec<usize> {
        let mut children = Vec::with_capacity(LANES);
        self.cover_below(binary, top, LANES, &mut children);
        children
    }

    /// The least cost of the two children of a node in so many slots, and how many of those the first gets.
    fn divided(&self, node: &BinaryNode, slots: usize) -> (f32, usize) {
        let [a, b] = [0, 1].map(|side| &self.0[node.first as usize + side]);
        let all = (1..slots).map(|first| (a[first - 1] + b[slots - first - 1], first));
        all.fold((f32::INFINITY, 1), |best, next| if next.0 < best.0 { next } else { best })
    }

    /// Finds what covers the two children of a node in so many slots.
    fn cover_below(&self, binary: &[BinaryNode], top: usize, slots: usize, to: &mut Vec<usize>) {
        let node = &binary[top];
        let (_, first) = self.divided(node, slots);
        self.cover(binary, node.first as usize, first, to);
        self.cover(binary, node.first as usize + 1, slots - first, to);
    }

    /// Finds what covers a node in so many slots.
    fn cover(&self, binary: &[BinaryNode], top: usize, slots: usize, to: &mut Vec<usize>) {
        let costs = &self.0[top];
        let is_as_good = |&fewer: &usize| costs[fewer - 1] <= costs[slots - 1];
        match (1..slots).find(is_as_good).unwrap_or(slots) {
            1 => to.push(top),
            needed => self.cover_below(binary, top, needed, to),
        }
    }
}

/// Half the surface of a node's box.
pub fn half_area(node: &BinaryNode) -> f32 {
    let size = node.bounds.extent();
    size.x * size.y + size.y * size.z + size.z * size.x
}
