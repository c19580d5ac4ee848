//! Random and adversarial sets of light bounds, and trees over them.

use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{LightSummary, LightTree, LightTreeWriter, Link, Node, Receiver};
use candelabra::store::AlignedBytes;
use glam::Vec3;
use proptest::prelude::*;
use std::f32::consts::{FRAC_PI_2, TAU};

pub type Tree = LightTree<AlignedBytes>;

/// A tree file over some bounds, all of one light.
pub fn tree_over(bounds: &[LightBounds]) -> Tree {
    let mut writer = LightTreeWriter::default();
    writer.add_tree(bounds, |i| Link::Emitter(i as u32));
    writer.add_light(&LightSummary {
        path: "/lights".into(),
        fingerprint: [1; 32],
        emitter_count: bounds.len() as u32,
        energy: bounds.iter().map(|b| b.energy).sum(),
        moves: false,
    });
    LightTree::open(writer.finish("{}", [2; 32])).expect("a tree just written opens")
}

pub fn direction() -> impl Strategy<Value = Vec3> {
    (-1f32..1.0, 0f32..TAU).prop_map(|(z, phi)| {
        let radius = (1.0 - z * z).sqrt();
        Vec3::new(radius * phi.cos(), radius * phi.sin(), z)
    })
}

/// A point of a cube, or one on its planes and axes, where cases are degenerate.
pub fn position() -> impl Strategy<Value = Vec3> {
    let coordinate = || prop_oneof![4 => -1f32..1.0, 1 => Just(0f32), 1 => Just(0.5f32)];
    (coordinate(), coordinate(), coordinate()).prop_map(Vec3::from)
}

/// The bounds of one emitter: a triangle (one- or two-sided), a point, a spot or a sphere.
pub fn emitter() -> impl Strategy<Value = LightBounds> {
    let energy = prop_oneof![4 => 0.1f32..10.0, 1 => 1e-6f32..1e6];
    let corners = [position(), position(), position()];
    let triangle = (corners, 0.001f32..0.3, any::<bool>()).prop_filter_map(
        "no area",
        |([a, b, c], size, two_sided)| {
            let [b, c] = [b, c].map(|corner| a + (corner - a) * size);
            let normal = (b - a).cross(c - a).try_normalize()?;
            Some((Aabb::around([a, b, c]), Cone::flat(normal, two_sided)))
        },
    );
    let point = position().prop_map(|p| (Aabb::around([p]), Cone::ALL));
    let spot = (position(), direction(), 0.02f32..FRAC_PI_2)
        .prop_map(|(p, axis, angle)| (Aabb::around([p]), Cone::spot(axis, angle)));
    let sphere =
        (position(), 0.001f32..0.2).prop_map(|(p, r)| (Aabb { min: p - r, max: p + r }, Cone::ALL));
    (prop_oneof![3 => triangle, 1 => point, 1 => spot, 1 => sphere], energy)
        .prop_map(|((aabb, cone), energy)| LightBounds { aabb, cone, energy })
}

pub fn emitters(most: usize) -> impl Strategy<Value = Vec<LightBounds>> {
    prop::collection::vec(emitter(), 1..most)
}

/// A receiver among the lights or away from them; sometimes in a medium.
pub fn receiver() -> impl Strategy<Value = Receiver> {
    let normal = prop_oneof![5 => direction(), 1 => Just(Vec3::ZERO)];
    (position(), prop_oneof![Just(1f32), Just(5.0), Just(100.0)], normal)
        .prop_map(|(p, far, normal)| Receiver { point: p * far, normal })
}

/// Every node of the first tree with the number of groups above it, from the root down.
pub fn nodes(tree: &Tree) -> Vec<(Node, usize)> {
    let row = &tree.trees()[0];
    let mut found = Vec::new();
    let mut open = vec![(row.first_group, 0)];
    while let Some((at, depth)) = open.pop() {
        for node in tree.groups()[at as usize].nodes() {
            found.push((node, depth));
            if let Link::Inner(ahead) = node.link() {
                open.push((at + ahead, depth + 1));
            }
        }
    }
    found
}

/// The probability that `sample` gives to nothing at all: descents that end where all children
/// turn out to be dark.
pub fn dead_probability(tree: &Tree, receiver: &Receiver) -> f64 {
    let row = &tree.trees()[0];
    let mut dead = 0.0;
    let mut open = vec![(row.first_group, 1.0)];
    while let Some((at, probability)) = open.pop() {
        let group = &tree.groups()[at as usize];
        let total: f64 = group.nodes().map(|node| node.importance(receiver)).sum();
        if total == 0.0 {
            dead += probability;
            continue;
        }
        for node in group.nodes() {
            if let Link::Inner(ahead) = node.link() {
                open.push((at + ahead, probability * node.importance(receiver) / total));
            }
        }
    }
    dead
}
