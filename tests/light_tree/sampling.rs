//! `sample` and `probability` tell the same story.

use crate::support::{dead_probability, emitters, probabilities, receiver, tree_over, with_tree};
use candelabra::bounds::{Aabb, LightBounds};
use candelabra::light_tree::Receiver;
use glam::{Quat, Vec3};
use proptest::prelude::*;

proptest! {
    #[test]
    fn probabilities_sum_to_one(bounds in emitters(100), receiver in receiver()) {
        let sum: f64 = probabilities(&bounds, &receiver).iter().sum();
        let dead = dead_probability(&tree_over(&bounds), &receiver);
        prop_assert!((sum + dead - 1.0).abs() < 1e-9, "{sum} + {dead}");
    }

    #[test]
    fn a_pick_has_the_probability_it_says(bounds in emitters(100), receiver in receiver()) {
        with_tree(&bounds, |tree| {
            for i in 0..64 {
                let u = (f64::from(i) + 0.5) / 64.0;
                if let Some(pick) = tree.sample(&receiver, u) {
                    let told = tree.probability(&receiver, pick.light.emitter().unwrap());
                    prop_assert!((pick.probability - told).abs() <= 1e-12 * told);
                    prop_assert!((0.0..1.0).contains(&pick.leftover));
                }
            }
            Ok(())
        })?;
    }

    #[test]
    fn shares_of_an_even_grid_are_the_probabilities(bounds in emitters(12), receiver in receiver()) {
        const PICKS: u32 = 4096;
        let expected = probabilities(&bounds, &receiver);
        let mut counts = vec![0u32; bounds.len()];
        with_tree(&bounds, |tree| {
            for i in 0..PICKS {
                let u = (f64::from(i) + 0.5) / f64::from(PICKS);
                if let Some(pick) = tree.sample(&receiver, u) {
                    counts[pick.light.emitter().unwrap() as usize] += 1;
                }
            }
        });
        // Each emitter owns an interval of the random number: an even grid misses by at most one.
        for (count, probability) in counts.iter().zip(expected) {
            prop_assert!((f64::from(*count) - probability * f64::from(PICKS)).abs() <= 1.0 + 1e-6);
        }
    }

    #[test]
    fn scale_and_energy_do_not_change_probabilities(
        bounds in emitters(60), receiver in receiver(), size in -20i32..20, energy in -60i32..60
    ) {
        let (s, e) = (2f32.powi(size), 2f32.powi(energy));
        let scaled: Vec<_> = bounds.iter().map(|b| LightBounds {
            aabb: Aabb { min: b.aabb.min * s, max: b.aabb.max * s },
            energy: b.energy * e,
            range_m: b.range_m * s,
            ..*b
        }).collect();
        let there = Receiver { point: receiver.point * s, ..receiver };
        for (a, b) in probabilities(&bounds, &receiver).iter().zip(probabilities(&scaled, &there)) {
            prop_assert!((a - b).abs() <= 1e-6 + 1e-4 * a, "{a} {b}");
        }
    }
}

/// A turn that permutes the axes maps boxes to boxes: probabilities follow.
#[test]
fn the_axes_are_equals() {
    let bounds: Vec<LightBounds> = (0..200)
        .map(|i| {
            let t = i as f32;
            let p = Vec3::new((t * 1.3).sin(), (t * 0.7).cos(), (t * 2.1).sin() * 0.5);
            let axis = Vec3::new((t * 0.9).cos(), (t * 1.7).sin(), 0.3).normalize();
            LightBounds::of_emitter(
                Aabb::around([p, p + Vec3::splat(0.01)]),
                candelabra::bounds::Cone::flat(axis, false),
                1.0 + t.sin().abs(),
                f32::INFINITY,
            )
        })
        .collect();
    let receiver = Receiver { point: Vec3::new(0.2, -1.5, 0.4), normal: Vec3::Y };
    let expected = probabilities(&bounds, &receiver);
    assert!((expected.iter().sum::<f64>() - 1.0).abs() < 0.2, "{expected:?}");
    for turn in [1, 2] {
        let permute = |v: Vec3| match turn {
            1 => Vec3::new(v.y, v.z, v.x),
            _ => Vec3::new(v.z, v.x, v.y),
        };
        let turned: Vec<_> = bounds
            .iter()
            .map(|b| {
                let aabb = Aabb { min: permute(b.aabb.min), max: permute(b.aabb.max) };
                let cone = candelabra::bounds::Cone { axis: permute(b.cone.axis), ..b.cone };
                LightBounds { aabb, cone, ..*b }
            })
            .collect();
        let there = Receiver { point: permute(receiver.point), normal: permute(receiver.normal) };
        for (a, b) in expected.iter().zip(probabilities(&turned, &there)) {
            assert!((a - b).abs() <= 1e-4 + 0.02 * a, "{a} {b}");
        }
    }
}

#[test]
fn the_ends_of_the_random_number_are_safe() {
    let bounds = vec![
        LightBounds::of_emitter(
            Aabb::around([Quat::from_rotation_y(0.3) * Vec3::X]),
            candelabra::bounds::Cone::ALL,
            1.0,
            f32::INFINITY
        );
        1000
    ];
    let receiver = Receiver { point: Vec3::ZERO, normal: Vec3::X };
    with_tree(&bounds, |tree| {
        for u in [0.0, f64::MIN_POSITIVE, 0.5, 1.0 - f64::EPSILON / 2.0] {
            let pick = tree.sample(&receiver, u).unwrap();
            assert!((pick.probability - 0.001).abs() < 1e-9 && pick.leftover < 1.0);
        }
    });
}

/// Thirty lights, each ten times farther and fainter than the last, make a deep tree in which the
/// faint ones are still found with the probability that is told.
#[test]
fn deep_trees_keep_their_probabilities() {
    let bounds: Vec<LightBounds> = (0..30)
        .map(|i| {
            LightBounds::of_emitter(
                Aabb::around([Vec3::X * 10f32.powi(i - 15)]),
                candelabra::bounds::Cone::ALL,
                10f32.powi(2 * (i - 15)),
                f32::INFINITY,
            )
        })
        .collect();
    let receiver = Receiver { point: Vec3::ZERO, normal: Vec3::X };
    let shares = probabilities(&bounds, &receiver);
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    assert!(shares.iter().all(|&share| share > 1e-4), "{shares:?}");
}
