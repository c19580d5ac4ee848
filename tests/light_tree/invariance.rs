//! What must not show: the unit of lengths and of energies, where the origin is, which axis is which,
//! and in what order the lights come; in probabilities and in expected counts of split picks.

use crate::support::{AnyViewer, any_viewer, beside, emitters, for_viewer, receiver, with_tree};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{Picked, Receiver, Scratch, Splitting, Viewer};
use candelabra::math::Similarity;
use candelabra::math::random::hash;
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

const GRADED: Splitting = Splitting { knob: 0.4, ..Splitting::NONE };

/// Probabilities, and expected counts with splitting. (By the seed's test clusters are split whole or
/// not at all: there the smallest rounding may move whole samples.)
fn shares(bounds: &[LightBounds], viewer: &impl Viewer) -> [Vec<f64>; 2] {
    with_tree(bounds, |tree| {
        [Splitting::NONE, GRADED].map(|how| {
            let all = 0..bounds.len() as u32;
            let mut scratch = Scratch::default();
            all.map(|e| tree.expected(viewer, &[], &how, Picked::Emitter(e), &mut scratch))
                .collect()
        })
    })
}

/// How many samples go elsewhere, as a part of all: half the sum of all differences over the sum of
/// all counts. The worst of both.
pub fn moved(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> f64 {
    let of = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
        let all: f64 = a.iter().sum::<f64>().max(b.iter().sum());
        if all > 0.0 { 0.5 * apart / all } else { 0.0 }
    };
    a.iter().zip(b).map(of).fold(0.0, f64::max)
}

/// The lights and a receiver after a map of points and one of directions.
fn mapped(
    bounds: &[LightBounds],
    receiver: &Receiver,
    scale: f32,
    point: impl Fn(Vec3) -> Vec3,
    direction: impl Fn(Vec3) -> Vec3,
) -> (Vec<LightBounds>, Receiver) {
    let map = |b: &LightBounds| LightBounds {
        aabb: Aabb::around([point(b.aabb.min), point(b.aabb.max)]),
        cone: Cone { axis: direction(b.cone.axis), ..b.cone },
        range_m: b.range_m * scale,
        ..*b
    };
    let there = Receiver { point: point(receiver.point), normal: direction(receiver.normal) };
    (bounds.iter().map(map).collect(), there)
}

/// Lights in general position: nothing coincides, so that rounding has no ties to break. A quarter
/// shines everywhere, an eighth may be of two sides, the others are of one.
pub fn scattered(count: u32, seed: u32, two_sided: bool) -> Vec<LightBounds> {
    let light = |i: u32| {
        let random = |n: u32| hash(hash(i, seed), n) as f32 / u32::MAX as f32;
        let vector = |n: u32| Vec3::new(random(n), random(n + 1), random(n + 2)) * 2.0 - 1.0;
        let place = vector(0) * Vec3::new(1.0, 0.6, 0.35);
        let size = vector(3).abs() * 0.02;
        LightBounds::of_emitter(
            Aabb { min: place - size, max: place + size },
            match i % 8 {
                0 | 4 => Cone::ALL,
                1 => Cone::flat(vector(6).normalize(), two_sided),
                _ => Cone::flat(vector(6).normalize(), false),
            },
            0.5 + random(9),
            f32::INFINITY,
        )
    };
    (0..count).map(light).collect()
}

/// Receivers around, among and far from the lights.
pub fn receivers() -> Vec<Receiver> {
    let of = |i: u32| {
        let random = |n: u32| hash(hash(i, 77), n) as f32 / u32::MAX as f32 * 2.0 - 1.0;
        let normal = Vec3::new(random(3), random(4), random(5)).normalize();
        let far = [0.5, 1.5, 10.0][i as usize % 3];
        let normal = if i.is_multiple_of(5) { Vec3::ZERO } else { normal };
        Receiver { point: far * Vec3::new(random(0), random(1), random(2)), normal }
    };
    (0..24).map(of).collect()
}

/// The largest part of the samples that a map moves, over lights in general position.
fn worst_of(
    two_sided: bool,
    change: impl Fn(&[LightBounds], &Receiver) -> (Vec<LightBounds>, Receiver),
) -> f64 {
    let mut worst = 0f64;
    for seed in 0..3 {
        let bounds = scattered(150, seed, two_sided);
        for receiver in receivers() {
            let (there, receiver_there) = change(&bounds, &receiver);
            let seen = moved(&shares(&bounds, &receiver), &shares(&there, &receiver_there));
            worst = worst.max(seen);
        }
    }
    worst
}

/// By which part of the samples a scale moves them.
pub fn worst_by_scale(scale: f32) -> f64 {
    worst_of(true, |bounds, receiver| mapped(bounds, receiver, scale, |p| p * scale, |d| d))
}

/// By which part of the samples a shift moves them; if `exact`, beyond what it does to the digits of
/// the input: coordinates are then brought to steps that the shifted ones have too.
pub fn worst_by_shift(shift: f32, exact: bool) -> f64 {
    let step = if exact { (shift.log2().ceil() - 23.0).exp2() } else { 1e-7 };
    // Adding zero leaves no -0.0, which would be another number than what it is shifted to.
    let snap = |p: Vec3| (p / step).round() * step + Vec3::ZERO;
    let snapped = |b: &LightBounds| LightBounds {
        aabb: Aabb { min: snap(b.aabb.min), max: snap(b.aabb.max) },
        ..*b
    };
    let to = Vec3::new(shift, -0.75 * shift, 0.5 * shift);
    let mut worst = 0f64;
    for seed in 0..3 {
        let bounds: Vec<_> = scattered(150, seed, true).iter().map(snapped).collect();
        for receiver in receivers() {
            let receiver = Receiver { point: snap(receiver.point), ..receiver };
            let (there, receiver_there) = mapped(&bounds, &receiver, 1.0, |p| p + to, |d| d);
            worst = worst.max(moved(&shares(&bounds, &receiver), &shares(&there, &receiver_there)));
        }
    }
    worst
}

/// By which part of the samples a change of the axes moves them: the worst of all 48.
pub fn worst_by_axes(two_sided: bool) -> f64 {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut worst = 0f64;
    for order in orders {
        for signs in 0..8u32 {
            let turn = |v: Vec3| {
                let sign = |n: u32| if signs >> n & 1 == 0 { 1.0 } else { -1.0 };
                Vec3::new(v[order[0]] * sign(0), v[order[1]] * sign(1), v[order[2]] * sign(2))
            };
            worst =
                worst.max(worst_of(two_sided, |bounds, at| mapped(bounds, at, 1.0, turn, turn)));
        }
    }
    worst
}

/// By which part of the samples a factor on all energies moves them.
pub fn worst_by_energy(factor: f32) -> f64 {
    worst_of(true, |bounds, receiver| {
        let brighter = |b: &LightBounds| LightBounds { energy: b.energy * factor, ..*b };
        (bounds.iter().map(brighter).collect(), *receiver)
    })
}

proptest! {
    /// Powers of two change no digit, whoever looks.
    #[test]
    fn powers_of_two_do_not_show_in_expected_counts(
        bounds in emitters(60), viewer in any_viewer(), size in -20i32..20, energy in -60i32..60
    ) {
        let (s, e) = (2f32.powi(size), 2f32.powi(energy));
        let nowhere = Receiver { point: Vec3::ZERO, normal: Vec3::ZERO };
        let (mut scaled, _) = mapped(&bounds, &nowhere, s, |p| p * s, |d| d);
        scaled.iter_mut().for_each(|b| b.energy *= e);
        let larger = Similarity::undoing(&Affine3A::from_scale(Vec3::splat(1.0 / s))).unwrap();
        let apart = for_viewer!(viewer, |viewer| {
            moved(&shares(&bounds, &viewer), &shares(&scaled, &viewer.within(&larger)))
        });
        prop_assert!(apart < 1e-4, "{apart}");
    }

    #[test]
    fn the_order_of_the_input_does_not_show_in_expected_counts(
        bounds in emitters(60), receiver in receiver(), seed in any::<u32>()
    ) {
        let mut order: Vec<usize> = (0..bounds.len()).collect();
        order.sort_by_key(|&i| hash(i as u32, seed));
        let shuffled: Vec<_> = order.iter().map(|&i| bounds[i]).collect();
        let (expected, seen) = (shares(&bounds, &receiver), shares(&shuffled, &receiver));
        for (expected, seen) in expected.iter().zip(&seen) {
            for (&was, seen) in order.iter().zip(seen) {
                // Lights that are alike may swap.
                let mut alike = bounds.iter().zip(expected).filter(|(b, _)| **b == bounds[was]);
                prop_assert!(alike.any(|(_, expected)| expected == seen));
            }
        }
    }

    /// What competes with the tree is weighed against it, whatever the unit of both.
    #[test]
    fn the_unit_of_energies_does_not_show_beside_the_tree(
        bounds in emitters(30), receiver in receiver(), beside in beside(), energy in -60i32..60
    ) {
        let e = 2f32.powi(energy);
        let brighter: Vec<_> =
            bounds.iter().map(|b| LightBounds { energy: b.energy * e, ..*b }).collect();
        let beside_brighter: Vec<_> = beside.iter().map(|i| i * f64::from(e)).collect();
        let counts = |bounds: &[LightBounds], beside: &[f64]| with_tree(bounds, |tree| {
            let emitters = (0..bounds.len() as u32).map(Picked::Emitter);
            let all = emitters.chain((0..beside.len() as u32).map(Picked::Beside));
            let mut scratch = Scratch::default();
            all.map(|light| tree.expected(&receiver, beside, &GRADED, light, &mut scratch))
                .collect::<Vec<_>>()
        });
        let (a, b) = (counts(&bounds, &beside), counts(&brighter, &beside_brighter));
        prop_assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= 1e-6), "{a:?} {b:?}");
    }
}

/// Other factors than powers of two round boxes to other steps: a box is up to 1/128 larger than what
/// is in it.
#[test]
fn the_unit_of_lengths_hardly_shows() {
    for exponent in [-6, -3, -1, 1, 3, 6] {
        let apart = worst_by_scale(10f32.powi(exponent));
        assert!(apart < 0.04, "1e{exponent}: {apart}");
    }
}

#[test]
fn the_unit_of_energies_does_not_show() {
    for exponent in [-30, -15, 15, 30] {
        let apart = worst_by_energy(10f32.powi(exponent));
        assert!(apart < 1e-4, "1e{exponent}: {apart}");
    }
}

#[test]
fn the_place_of_the_origin_hardly_shows() {
    for (shift, exact, allowed) in
        [(1e3, true, 2e-3), (1e3, false, 5e-3), (1e4, true, 2e-3), (1e5, true, 2e-3)]
    {
        let apart = worst_by_shift(shift, exact);
        assert!(apart < allowed, "{shift}, {exact}: {apart}");
    }
}

#[test]
fn the_names_and_signs_of_the_axes_hardly_show() {
    let [one_sided, two_sided] = [false, true].map(worst_by_axes);
    assert!(one_sided < 1e-3, "{one_sided}");
    // The build's estimate of how two-sided lights face takes a side for each: mirrors show there.
    assert!(two_sided < 0.1, "{two_sided}");
}
