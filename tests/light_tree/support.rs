//! Random and adversarial sets of light bounds, and trees over them.

use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{
    DistanceOnly, FrameTree, Glossy, LightList, LightLook, LightSummary, LightTree,
    LightTreeWriter, Link, Lobes, Node, Receiver, Segment, Splitting, TreeKind, Viewer,
};
use candelabra::store::AlignedBytes;
use glam::Vec3;
use proptest::prelude::*;
use std::f32::consts::{FRAC_PI_2, TAU};

pub type Tree = LightTree<AlignedBytes>;

/// A tree file over some bounds, all of one light.
pub fn tree_over(bounds: &[LightBounds]) -> Tree {
    let mut writer = LightTreeWriter::default();
    writer.add_tree(TreeKind::Still, bounds, |i| Link::Emitter(i as u32));
    let light = LightSummary {
        path: "/lights".into(),
        fingerprint: [1; 32],
        emitter_count: bounds.len() as u32,
        energy: bounds.iter().map(|b| b.energy).sum(),
        class: 0,
        look: LightLook::default(),
        link: 0,
    };
    LightTree::open(writer.finish(&LightList::new(&[light]), "{}", [2; 32]))
        .expect("a tree just written opens")
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
    let range = prop_oneof![4 => Just(f32::INFINITY), 1 => 0.05f32..5.0];
    (prop_oneof![3 => triangle, 1 => point, 1 => spot, 1 => sphere], energy, range).prop_map(
        |((aabb, cone), energy, range_m)| LightBounds::of_emitter(aabb, cone, energy, range_m),
    )
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

/// The probability that `sample` gives to nothing at all in the tree of a row: descents that end
/// where all children turn out to be dark.
pub fn dead_probability_in(tree: &Tree, row: u32, receiver: &Receiver) -> f64 {
    let mut dead = 0.0;
    let mut open = vec![(row, tree.trees()[row as usize].first_group, *receiver, 1.0)];
    while let Some((row, at, receiver, probability)) = open.pop() {
        let group = &tree.groups()[at as usize];
        let total: f64 = group.nodes().map(|node| node.importance(&receiver)).sum();
        if total == 0.0 {
            dead += probability;
            continue;
        }
        for node in group.nodes() {
            let probability = probability * node.importance(&receiver) / total;
            match node.link() {
                Link::Inner(ahead) => open.push((row, at + ahead, receiver, probability)),
                Link::Instance(below) => {
                    let instance = &tree.instances()[below as usize];
                    let below = &tree.trees()[instance.tree as usize];
                    let there = receiver.within(&instance.to_local);
                    open.push((instance.tree, below.first_group, there, probability));
                }
                Link::Emitter(_) | Link::Nothing => {}
            }
        }
    }
    dead
}

/// The same of a file that has one tree.
pub fn dead_probability(tree: &Tree, receiver: &Receiver) -> f64 {
    dead_probability_in(tree, 0, receiver)
}

/// Runs `check` on the tree of the only frame.
pub fn with_tree<T>(bounds: &[LightBounds], check: impl FnOnce(&FrameTree) -> T) -> T {
    let tree = tree_over(bounds);
    check(&tree.at_frame(0).unwrap())
}

/// The probability of each emitter.
pub fn probabilities(bounds: &[LightBounds], receiver: &Receiver) -> Vec<f64> {
    with_tree(bounds, |tree| {
        (0..bounds.len() as u32).map(|emitter| tree.probability(receiver, emitter)).collect()
    })
}

/// A viewer of any kind.
#[derive(Clone, Copy, Debug)]
pub enum AnyViewer {
    Receiver(Receiver),
    Segment(Segment),
    Glossy(Glossy),
    DistanceOnly(DistanceOnly<Receiver>),
}

/// Evaluates the body with the viewer as the type that it is.
macro_rules! for_viewer {
    ($any:expr, |$viewer:ident| $body:expr) => {
        match $any {
            AnyViewer::Receiver($viewer) => $body,
            AnyViewer::Segment($viewer) => $body,
            AnyViewer::Glossy($viewer) => $body,
            AnyViewer::DistanceOnly($viewer) => $body,
        }
    };
}
pub(crate) use for_viewer;

pub fn any_viewer() -> impl Strategy<Value = AnyViewer> {
    let length = prop_oneof![4 => 0.01f32..10.0, 1 => Just(f32::INFINITY)];
    let segment = (position(), direction(), length).prop_map(|(origin, direction, length)| {
        AnyViewer::Segment(Segment { origin, direction, length })
    });
    let glossy = glossy().prop_map(AnyViewer::Glossy);
    prop_oneof![
        3 => receiver().prop_map(AnyViewer::Receiver),
        1 => segment,
        1 => glossy,
        1 => receiver().prop_map(|receiver| AnyViewer::DistanceOnly(DistanceOnly(receiver))),
    ]
}

/// A receiver that reflects: anything from paper to a mirror, seen from anywhere.
pub fn glossy() -> impl Strategy<Value = Glossy> {
    let alpha = prop_oneof![1 => Just(1e-3f32), 3 => 0.01f32..1.0];
    let lobes = (0f32..0.8, 0f32..1.0, 0f32..1.0, alpha).prop_map(
        |(diffuse, at_normal, toward_grazing, alpha)| Lobes {
            diffuse,
            at_normal,
            toward_grazing,
            alpha,
        },
    );
    // A coat may have a normal of its own.
    let about = (any::<bool>(), direction());
    (receiver(), direction(), about, direction(), direction(), lobes).prop_map(
        |(receiver, normal, (is_own, about), to_eye, toward, lobes)| {
            let to_eye = to_eye * 1f32.copysign(to_eye.dot(normal));
            let about = if is_own { about * 1f32.copysign(about.dot(to_eye)) } else { normal };
            Glossy { receiver: Receiver { normal, ..receiver }, about, to_eye, lobes, toward }
        },
    )
}

/// The knob at its ends and between, with a cap or without, by either test.
pub fn splitting() -> impl Strategy<Value = Splitting> {
    use candelabra::light_tree::SplitTest::{SolidAngle, Variance};
    let knob = prop_oneof![Just(0f32), Just(0.1), Just(0.5), 0f32..1.0, Just(1.0)];
    let most = prop_oneof![2 => Just(u32::MAX), 1 => 1u32..6, 1 => 6u32..40];
    let test = prop_oneof![2 => Just(Variance), 1 => Just(SolidAngle)];
    (knob, most, test).prop_map(|(knob, most, test)| Splitting { knob, most, test })
}

/// Importances of lights beside the tree; mostly none.
pub fn beside() -> impl Strategy<Value = Vec<f64>> {
    let one = prop_oneof![1 => Just(0.0), 3 => 1e-3..1e3];
    prop_oneof![1 => Just(vec![]), 1 => prop::collection::vec(one, 1..6)]
}

/// Whether anything inside the bounds could light the receiver: tried at points of the box and for
/// normals of the cone, in double precision.
pub fn can_light(bounds: &LightBounds, receiver: &Receiver) -> bool {
    let steps = [0.0, 0.25, 0.5, 0.75, 1.0];
    let (min, extent) = (bounds.aabb.min.as_dvec3(), bounds.aabb.extent().as_dvec3());
    let (axis, normal) = (bounds.cone.axis.as_dvec3(), receiver.normal.as_dvec3());
    let reach = f64::from(bounds.cone.theta_o + bounds.cone.theta_e);
    steps.iter().any(|x| {
        steps.iter().any(|y| {
            steps.iter().any(|z| {
                let p = min + extent * glam::DVec3::new(*x, *y, *z);
                let Some(to_light) = (p - receiver.point.as_dvec3()).try_normalize() else {
                    return true;
                };
                let received = receiver.normal == Vec3::ZERO || normal.dot(to_light) > 1e-6;
                let cosine = axis.normalize().dot(-to_light);
                let cosine = if bounds.cone.two_sided { cosine.abs() } else { cosine };
                let near = (p - receiver.point.as_dvec3()).length() < f64::from(bounds.range_m);
                received && near && cosine.clamp(-1.0, 1.0).acos() < reach - 1e-6
            })
        })
    })
}
