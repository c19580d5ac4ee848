//! How deep, how full and how good trees are.

use crate::bounds::LightBounds;
use crate::light_tree::{Group, LightTree, Link, TreeKind, TreeRow, WIDTH};
use serde::Serialize;

/// The trees of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shape {
    /// `shared` (one light in its own space), `still` (all that stands still) or `frame` (all that
    /// changes, as it is in one frame).
    pub kind: &'static str,
    /// How many trees.
    pub trees: usize,
    /// Their groups of siblings: what a walk weighs at each step.
    pub groups: usize,
    /// Their leaves: emitters, and other trees.
    pub leaves: usize,
    /// The share of the lanes of their groups that are used, `(0, 1]`.
    pub fill: f64,
    /// Groups on the way to the deepest leaf.
    pub deepest: usize,
    /// Groups on the way to a leaf, in the mean over all leaves.
    pub mean_depth: f64,
    /// The mean over the trees of the cost that the build minimizes. The cost of a tree is the sum of
    /// `energy * M_A * M_omega` over the clusters that its groups open, divided by the root's value.
    /// Suppose that the probability that a cluster is opened is proportional to that measure (the
    /// seed's surface area and orientation heuristic). Then the cost is the expected number of groups
    /// that are opened if the root is. A tree of one group costs 1. Of two trees over the same emitters
    /// the one of lower cost is better.
    pub cost: f64,
}

/// The shapes of a file's trees, a row for each kind that it has.
pub fn shapes<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Vec<Shape> {
    let kinds =
        [(TreeKind::Shared, "shared"), (TreeKind::Still, "still"), (TreeKind::Frame, "frame")];
    let of_kind = |(kind, name)| {
        let rows = tree.trees().iter().filter(move |row| TreeKind::of(row) == Some(kind));
        let mut shape = Shape {
            kind: name,
            trees: 0,
            groups: 0,
            leaves: 0,
            fill: 0.0,
            deepest: 0,
            mean_depth: 0.0,
            cost: 0.0,
        };
        let (mut used, mut steps) = (0, 0);
        for row in rows {
            let groups = tree.groups_of(row);
            let depths = depths(groups);
            for (group, depth) in groups.iter().zip(&depths) {
                let links = (0..WIDTH).map(|lane| group.link(lane));
                let links = links.filter(|&link| link != Link::Nothing);
                let leaves = links.clone().filter(|link| !matches!(link, Link::Inner(_))).count();
                used += links.count();
                steps += leaves * depth;
                shape.leaves += leaves;
            }
            shape.trees += 1;
            shape.groups += groups.len();
            shape.deepest = depths.into_iter().fold(shape.deepest, usize::max);
            shape.cost += cost(row, groups);
        }
        shape.fill = used as f64 / (shape.groups * WIDTH) as f64;
        shape.mean_depth = steps as f64 / shape.leaves as f64;
        shape.cost /= shape.trees as f64;
        (shape.trees > 0).then_some(shape)
    };
    kinds.into_iter().filter_map(of_kind).collect()
}

/// For each group of a tree, the number of groups on the way to it, itself included.
fn depths(groups: &[Group]) -> Vec<usize> {
    let mut depths = vec![1; groups.len()];
    for (own, group) in groups.iter().enumerate() {
        for lane in 0..WIDTH {
            if let Link::Inner(ahead) = group.link(lane)
                && let Some(below) = depths.get(own + ahead as usize)
            {
                debug_assert!(*below == 1);
                depths[own + ahead as usize] = depths[own] + 1;
            }
        }
    }
    depths
}

/// [`Shape::cost`] of one tree.
fn cost(row: &TreeRow, groups: &[Group]) -> f64 {
    let root = measure(&row.root.bounds());
    if root == 0.0 {
        // All emitters are in one place: every cluster counts as much as the root.
        return groups.len() as f64;
    }
    let opened = groups.iter().flat_map(Group::nodes);
    let opened = opened.filter(|node| matches!(node.link(), Link::Inner(_)));
    1.0 + opened.map(|node| measure(&node.bounds())).sum::<f64>() / root
}

fn measure(bounds: &LightBounds) -> f64 {
    f64::from(bounds.energy) * bounds.aabb.measure() * f64::from(bounds.cone.measure())
}
