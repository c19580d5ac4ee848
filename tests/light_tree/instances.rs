//! Trees below trees: shared ones that are turned, mirrored and scaled, the one of what stands still
//! below the one of a frame, and forced lights.

use crate::city::{City, Part, Placed, city};
use crate::support::{
    AnyViewer, Tree, any_viewer, can_light, dead_probability_in, for_viewer, receiver, tree_over,
};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{
    DistanceOnly, FrameTree, Picked, Receiver, Scratch, Splitting, TreeKind,
};
use candelabra::math::random::hash;
use glam::{Affine3A, Vec3};
use proptest::prelude::*;

fn with_frame<T>(tree: &Tree, frame: i32, check: impl FnOnce(&FrameTree) -> T) -> T {
    check(&tree.at_frame(frame).unwrap())
}

/// The row of the tree that frame 1 samples.
fn row_of_frame(tree: &Tree) -> Option<u32> {
    match tree.frames() {
        [frame, ..] => Some(frame.tree),
        [] => {
            let is_still = |row: &_| TreeKind::of(row) == Some(TreeKind::Still);
            tree.trees().iter().position(is_still).map(|row| row as u32)
        }
    }
}

/// The city with points instead of boxes, spots that are not too narrow, and no ranges: what the tree
/// is told of them is exact but for the rounding of directions.
fn sharpened(city: &City) -> City {
    let point = |b: &LightBounds| LightBounds {
        aabb: Aabb::around([b.aabb.center()]),
        cone: Cone { theta_e: b.cone.theta_e.max(0.3), ..b.cone },
        range_m: f32::INFINITY,
        ..*b
    };
    let all = |bounds: &Vec<LightBounds>| bounds.iter().map(point).collect();
    let part = |part: &Part| Part { flat: all(&part.flat), placed: part.placed.clone() };
    City {
        shared: city.shared.iter().map(all).collect(),
        still: part(&city.still),
        changing: part(&city.changing),
        forced: city.forced.clone(),
    }
}

/// Whether a light without size is right where a viewer is.
fn is_at(viewer: &AnyViewer, bounds: &LightBounds) -> bool {
    let point = match viewer {
        AnyViewer::Receiver(receiver) | AnyViewer::DistanceOnly(DistanceOnly(receiver)) => {
            receiver.point
        }
        AnyViewer::Glossy(glossy) => glossy.receiver.point,
        AnyViewer::Segment(_) => return false,
    };
    let apart = (point - bounds.aabb.center()).length();
    apart <= 1e-5 * (1.0 + point.length()) && bounds.aabb.extent().length() <= apart
}

/// The same city with its shared lights stored otherwise: lengths in a unit that is `size` times as
/// small, and energies `brighter` times as high as those at which the instances shine.
fn stored_otherwise(city: &City, size: f32, brighter: f32) -> City {
    let stored = |own: &LightBounds| LightBounds {
        aabb: Aabb { min: own.aabb.min * size, max: own.aabb.max * size },
        energy: own.energy * brighter,
        range_m: own.range_m * size,
        ..*own
    };
    let put = |placed: &Placed| Placed {
        to_world: placed.to_world * Affine3A::from_scale(Vec3::splat(1.0 / size)),
        brightness: placed.brightness / brighter,
        ..*placed
    };
    let part = |part: &Part| Part {
        flat: part.flat.clone(),
        placed: part.placed.iter().map(put).collect(),
    };
    City {
        shared: city.shared.iter().map(|all| all.iter().map(stored).collect()).collect(),
        still: part(&city.still),
        changing: part(&city.changing),
        forced: city.forced.iter().map(put).collect(),
    }
}

proptest! {
    /// A mesh light may be stored in any unit, and built at a brightness at which no instance of it
    /// ever shines: powers of two change no digit, so they change no decision, in no space.
    #[test]
    fn how_a_shared_light_is_stored_does_not_show_in_expected_counts(
        city in city(), viewer in any_viewer(), size in -20i32..20, brighter in -60i32..60,
        knob in prop_oneof![Just(0f32), Just(0.5), 0f32..1.0]
    ) {
        let other = stored_otherwise(&city, 2f32.powi(size), 2f32.powi(brighter));
        let how = Splitting { knob, ..Splitting::NONE };
        // Where a point light is at no distance at all, it has all of the light in any unit.
        prop_assume!(!city.flattened().iter().any(|b| is_at(&viewer, b)));
        let counts = |city: &City| {
            let tree = city.tree();
            with_frame(&tree, 1, |frame| {
                let all = (0..frame.unforced_count()).map(Picked::Emitter);
                for_viewer!(viewer, |viewer| {
                    let mut scratch = Scratch::default();
                    all.map(|light| frame.expected(&viewer, &[1.0], &how, light, &mut scratch))
                        .collect::<Vec<f64>>()
                })
            })
        };
        let (a, b) = (counts(&city), counts(&other));
        for (emitter, (a, b)) in a.iter().zip(&b).enumerate() {
            prop_assert!((a - b).abs() <= 1e-6 * a.max(*b) + 1e-9, "{emitter}: {a} {b}");
        }
    }

    #[test]
    fn trees_below_trees_verify(city in city()) {
        let tree = city.tree();
        // What one frame samples is proved by itself, too.
        prop_assert_eq!(tree.verify_frame(1), Ok(()));
        prop_assert_eq!(tree.verify(), Ok(()));
    }

    #[test]
    fn probabilities_sum_to_one_through_instances(city in city(), receiver in receiver()) {
        let tree = city.tree();
        let Some(row) = row_of_frame(&tree) else { return Ok(()) };
        let dead = dead_probability_in(&tree, row, &receiver);
        with_frame(&tree, 1, |frame| {
            let all = 0..frame.unforced_count();
            let sum: f64 = all.map(|emitter| frame.probability(&receiver, emitter)).sum();
            prop_assert!((sum + dead - 1.0).abs() < 1e-9, "{sum} + {dead}");
            Ok(())
        })?;
    }

    #[test]
    fn one_walk_tells_every_probability(city in city(), viewer in any_viewer()) {
        with_frame(&city.tree(), 1, |frame| for_viewer!(viewer, |v| {
            let mut told = vec![0.0; frame.unforced_count() as usize];
            frame.for_each_probability(&v, |emitter, probability| told[emitter as usize] += probability);
            for (emitter, told) in (0..).zip(told) {
                let probability = frame.probability(&v, emitter);
                prop_assert!((told - probability).abs() <= 1e-12 * probability, "{emitter}: {told}");
            }
            Ok(())
        }))?;
    }

    #[test]
    fn a_pick_has_the_probability_it_says_through_instances(
        city in city(), viewer in any_viewer()
    ) {
        with_frame(&city.tree(), 1, |frame| for_viewer!(viewer, |v| {
            for i in 0..64 {
                let u = (f64::from(i) + 0.5) / 64.0;
                if let Some(pick) = frame.sample(&v, u) {
                    let emitter = pick.light.emitter().unwrap();
                    let told = frame.probability(&v, emitter);
                    prop_assert!(emitter < frame.unforced_count(), "a forced light was picked");
                    prop_assert!((pick.probability - told).abs() <= 1e-12 * told);
                    prop_assert!((0.0..1.0).contains(&pick.leftover));
                }
            }
            Ok(())
        }))?;
    }

    #[test]
    fn what_lights_a_point_has_a_probability_through_instances(
        city in city(), receiver in receiver()
    ) {
        with_frame(&city.tree(), 1, |frame| {
            for (emitter, bounds) in (0..).zip(city.flattened()) {
                // The box of a turned box is wider than what is in it.
                let exact = LightBounds { aabb: Aabb::around([bounds.aabb.center()]), ..bounds };
                prop_assert!(
                    frame.probability(&receiver, emitter) > 0.0 || !can_light(&exact, &receiver),
                    "{emitter}"
                );
            }
            Ok(())
        })?;
    }

    /// Lights that are points are lit through an instance just where they are lit on their own; at the
    /// edges of cones and at the horizon, rounding decides.
    #[test]
    fn instances_light_what_their_lights_light_on_their_own(
        city in city(), receiver in receiver()
    ) {
        let city = sharpened(&city);
        let flat = city.flattened();
        let is_edge = |b: &LightBounds| {
            let with = |by: f32| {
                let theta_e = b.cone.theta_e + by;
                can_light(&LightBounds { cone: Cone { theta_e, ..b.cone }, ..*b }, &receiver)
            };
            let up = (b.aabb.center() - receiver.point).normalize_or_zero().dot(receiver.normal);
            with(0.03) != with(-0.03) || (up.abs() < 1e-3 && receiver.normal != Vec3::ZERO)
        };
        let alone = tree_over(&flat);
        with_frame(&city.tree(), 1, |placed| with_frame(&alone, 1, |alone| {
            for (emitter, bounds) in (0..).zip(&flat).filter(|(_, bounds)| !is_edge(bounds)) {
                let [a, b] = [placed, alone].map(|tree| tree.probability(&receiver, emitter) > 0.0);
                prop_assert_eq!(a, b, "{}", emitter);
                prop_assert_eq!(a, can_light(bounds, &receiver), "{}", emitter);
            }
            Ok(())
        }))?;
    }

    #[test]
    fn forced_lights_are_sampled_on_their_own_and_picked_by_no_one(
        city in city(), receiver in receiver()
    ) {
        let tree = city.tree();
        with_frame(&tree, 1, |frame| {
            prop_assert_eq!(frame.forced_count(), city.forced.len());
            let mut first = frame.unforced_count();
            for (light, placed) in city.forced.iter().enumerate() {
                let own = first..first + city.shared[placed.tree].len() as u32;
                first = own.end;
                let row = tree.forced()[light] as usize;
                let there = candelabra::light_tree::Viewer::within(
                    &receiver, &tree.instances()[row].to_local,
                );
                let dead = dead_probability_in(&tree, placed.tree as u32, &there);
                let sum: f64 = own.clone().map(|e| frame.probability(&receiver, e)).sum();
                prop_assert!((sum + dead - 1.0).abs() < 1e-9, "{sum} + {dead}");
                for i in 0..32u32 {
                    let u = f64::from(hash(i, 9)) / 4_294_967_296.0;
                    let Some(pick) = frame.sample_forced(light, &receiver, u) else { continue };
                    let emitter = pick.light.emitter().unwrap();
                    let told = frame.probability(&receiver, emitter);
                    prop_assert!(own.contains(&emitter));
                    prop_assert!((pick.probability - told).abs() <= 1e-12 * told);
                }
            }
            prop_assert!(frame.sample_forced(city.forced.len(), &receiver, 0.5).is_none());
            prop_assert_eq!(first as usize, tree.emitter_count());
            Ok(())
        })?;
    }

    #[test]
    fn a_frame_over_what_stands_still_samples_both(city in city()) {
        let tree = city.tree();
        let Some(row) = row_of_frame(&tree) else { return Ok(()) };
        let everywhere = Receiver { point: Vec3::splat(40.0), normal: Vec3::ZERO };
        with_frame(&tree, 1, |frame| {
            let root = frame.root().unwrap();
            prop_assert_eq!(root.energy(), tree.trees()[row as usize].root.energy());
            let mut counts = vec![0; frame.unforced_count() as usize];
            frame.for_each_leaf(&everywhere, |emitter, _, _| counts[emitter as usize] += 1);
            prop_assert!(counts.iter().all(|&count| count == 1), "{counts:?}");
            Ok(())
        })?;
    }
}
