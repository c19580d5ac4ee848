//! Splitting: as many lights as the viewer is worth, each as often as is told.

use crate::city::city;
use crate::support::{
    AnyViewer, any_viewer, beside, direction, emitters, for_viewer, position, splitting, with_tree,
};
use candelabra::bounds::{Cone, LightBounds};
use candelabra::light_tree::{
    FrameTree, Pick, Picked, Receiver, Scratch, SplitTest, Splitting, Viewer,
};
use candelabra::math::random::hash;
use glam::Vec3;
use proptest::prelude::*;
use std::collections::HashMap;

fn picks<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    beside: &[f64],
    how: &Splitting,
    random: (f64, u32),
) -> Vec<Pick> {
    let mut found = Vec::new();
    tree.for_each_pick(viewer, beside, how, random, &mut Scratch::default(), |pick| {
        found.push(pick);
    });
    found
}

fn expected<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    beside: &[f64],
    how: &Splitting,
    light: Picked,
) -> f64 {
    tree.expected(viewer, beside, how, light, &mut Scratch::default())
}

/// Everything that can be picked.
fn all_lights(tree: &FrameTree, beside: &[f64]) -> Vec<Picked> {
    let emitters = (0..tree.unforced_count()).map(Picked::Emitter);
    emitters.chain((0..beside.len() as u32).map(Picked::Beside)).collect()
}

/// What an even comb of random numbers found of one light.
#[derive(Clone, Copy, Default)]
struct Found {
    count: u32,
    /// Stretches of the random number that find it, as far as the comb tells them apart.
    runs: u32,
    last: u32,
    /// The sum of one over the probability.
    inverse: f64,
}

impl Found {
    /// By how many teeth a count may be off. The numbers that find a light are stretches, each of
    /// which a comb measures to less than one tooth; half as many again may fall between teeth.
    fn teeth(&self) -> f64 {
        4.0 + 1.5 * f64::from(self.runs)
    }
}

fn comb<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    beside: &[f64],
    how: &Splitting,
    (teeth, salt): (u32, u32),
) -> HashMap<Picked, Found> {
    let mut found: HashMap<Picked, Found> = HashMap::new();
    let mut scratch = Scratch::default();
    for tooth in 1..=teeth {
        let u = (f64::from(tooth) - 0.5) / f64::from(teeth);
        tree.for_each_pick(viewer, beside, how, (u, salt), &mut scratch, |pick| {
            let entry = found.entry(pick.light).or_default();
            entry.count += 1;
            entry.runs += u32::from(entry.last == 0 || entry.last + 1 != tooth);
            entry.last = tooth;
            entry.inverse += 1.0 / pick.probability;
        });
    }
    found
}

/// The laws of one set of picks: none twice, no more than allowed, and what each says of itself.
fn picks_are_sound<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    beside: &[f64],
    how: &Splitting,
) -> Result<(), TestCaseError> {
    for i in 0..48u32 {
        let u = match i {
            0 => 0.0,
            1 => 1.0 - f64::EPSILON / 2.0,
            _ => f64::from(hash(i, 7)) / 4_294_967_296.0,
        };
        let found = picks(tree, viewer, beside, how, (u, hash(i / 4, 1)));
        prop_assert!(found.len() <= how.most as usize, "{} picks", found.len());
        let mut lights: Vec<_> = found.iter().map(|pick| format!("{:?}", pick.light)).collect();
        lights.sort();
        lights.dedup();
        prop_assert_eq!(lights.len(), found.len(), "a light was picked twice");
        for pick in found {
            let told = expected(tree, viewer, beside, how, pick.light);
            prop_assert!((pick.expected - told).abs() <= 1e-12 * told, "{pick:?} but {told}");
            prop_assert!(pick.probability > 0.0 && pick.probability <= 1.0 + 1e-12);
            prop_assert!((0.0..1.0).contains(&pick.leftover));
        }
    }
    Ok(())
}

/// An even comb finds each light as often as is expected, and one over its probability is 1 in the
/// mean: so the mean of `f / probability` is the sum of `f`, whatever `f` is.
fn counts_are_expected<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    beside: &[f64],
    how: &Splitting,
    salt: u32,
) -> Result<(), TestCaseError> {
    const TEETH: u32 = 4096;
    let found = comb(tree, viewer, beside, how, (TEETH, salt));
    for light in all_lights(tree, beside) {
        let mean = expected(tree, viewer, beside, how, light) * f64::from(TEETH);
        let seen = found.get(&light).copied().unwrap_or_default();
        let off = (f64::from(seen.count) - mean).abs();
        prop_assert!(off <= seen.teeth(), "{light:?}: {} for {mean}", seen.count);
        // Of the two counts that are drawn between, the lower is at least half the higher.
        let least = 0.5 * expected(tree, viewer, beside, how, light);
        if least > 0.0 {
            let mean = seen.inverse / f64::from(TEETH);
            let allowed = seen.teeth() / least / f64::from(TEETH);
            prop_assert!((mean - 1.0).abs() <= allowed, "{light:?}: {mean} {allowed}");
        }
    }
    Ok(())
}

fn expected_counts<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    beside: &[f64],
    how: &Splitting,
) -> Vec<f64> {
    let lights = all_lights(tree, beside).into_iter();
    lights.map(|light| expected(tree, viewer, beside, how, light)).collect()
}

proptest! {
    #[test]
    fn no_light_is_picked_twice_nor_more_than_allowed_and_each_tells_the_truth(
        bounds in emitters(150), viewer in any_viewer(), beside in beside(), how in splitting()
    ) {
        with_tree(&bounds, |tree| {
            for_viewer!(viewer, |v| picks_are_sound(tree, &v, &beside, &how))
        })?;
    }

    /// Amid the lights every cluster wants more samples than it may have.
    #[test]
    fn the_cap_holds_where_every_cluster_wants_more(
        bounds in emitters(150), viewer in any_viewer(), knob in 0.05f32..0.95, most in 2u32..24,
        seed in any::<u32>()
    ) {
        let how = Splitting { knob, most, ..Splitting::NONE };
        with_tree(&without_edges(&bounds), |tree| for_viewer!(viewer, |v| {
            let mut scratch = Scratch::default();
            for i in 0..256 {
                let u = f64::from(hash(i, seed)) / 4_294_967_296.0;
                let mut count = 0;
                tree.for_each_pick(&v, &[], &how, (u, i), &mut scratch, |_| count += 1);
                prop_assert!(count <= most as usize, "{count} picks");
            }
            Ok(())
        }))?;
    }

    #[test]
    fn instances_keep_the_laws_of_splitting(
        city in city(), viewer in any_viewer(), beside in beside(), how in splitting()
    ) {
        let tree = city.tree();
        let frame = tree.at_frame(1).unwrap();
        for_viewer!(viewer, |v| picks_are_sound(&frame, &v, &beside, &how))?;
    }

    /// There is no more than one of anything, nor more than allowed; and none that may shine is lost.
    #[test]
    fn expected_counts_stay_between_none_and_the_cap(
        bounds in emitters(150), viewer in any_viewer(), beside in beside(), how in splitting()
    ) {
        with_tree(&bounds, |tree| for_viewer!(viewer, |v| {
            let counts = expected_counts(tree, &v, &beside, &how);
            let single = expected_counts(tree, &v, &beside, &Splitting::NONE);
            for (count, single) in counts.iter().zip(single) {
                prop_assert!((*count > 0.0) == (single > 0.0) && *count <= 1.0 + 1e-12);
            }
            prop_assert!(counts.iter().sum::<f64>() <= f64::from(how.most) * (1.0 + 1e-12));
            Ok(())
        }))?;
    }

    #[test]
    fn the_knob_at_zero_is_one_sample(
        bounds in emitters(100), viewer in any_viewer(), u in 0f64..1.0, salt in any::<u32>()
    ) {
        with_tree(&bounds, |tree| for_viewer!(viewer, |v| {
            let found = picks(tree, &v, &[], &Splitting::NONE, (u, salt));
            let sample = tree.sample(&v, u);
            prop_assert_eq!(found.first().copied(), sample);
            prop_assert!(found.len() <= 1);
            Ok(())
        }))?;
    }

    #[test]
    fn the_knob_at_one_takes_every_light_that_may_shine_once_for_sure(
        city in city(), viewer in any_viewer(), beside in beside(), u in 0f64..1.0
    ) {
        let tree = city.tree();
        let frame = tree.at_frame(1).unwrap();
        for_viewer!(viewer, |v| {
            let mut found = picks(&frame, &v, &beside, &Splitting::ALL, (u, 5));
            for pick in &found {
                prop_assert_eq!((pick.probability, pick.expected), (1.0, 1.0), "{:?}", pick);
            }
            let shines = |light: &Picked| match *light {
                Picked::Emitter(emitter) => frame.probability(&v, emitter) > 0.0,
                Picked::Beside(row) => beside[row as usize] > 0.0,
            };
            let order = |light: &Picked| match *light {
                Picked::Emitter(emitter) => (0, emitter),
                Picked::Beside(row) => (1, row),
            };
            found.sort_by_key(|pick| order(&pick.light));
            let found: Vec<_> = found.into_iter().map(|pick| pick.light).collect();
            let all = all_lights(&frame, &beside).into_iter().filter(shines);
            prop_assert_eq!(found, all.collect::<Vec<_>>());
        });
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn an_even_comb_finds_each_light_as_often_as_expected(
        bounds in emitters(40), viewer in any_viewer(), beside in beside(), how in splitting(),
        salt in any::<u32>()
    ) {
        with_tree(&bounds, |tree| {
            for_viewer!(viewer, |v| counts_are_expected(tree, &v, &beside, &how, salt))
        })?;
    }

    #[test]
    fn an_even_comb_finds_each_light_of_an_instance_as_often_as_expected(
        city in city(), viewer in any_viewer(), beside in beside(), how in splitting(),
        salt in any::<u32>()
    ) {
        let tree = city.tree();
        let frame = tree.at_frame(1).unwrap();
        for_viewer!(viewer, |v| counts_are_expected(&frame, &v, &beside, &how, salt))?;
    }

    /// With independent numbers and another salt for each, counts are binomial: no light is off by
    /// more than Bernstein's inequality allows with a chance of 1e-12.
    #[test]
    fn independent_numbers_find_each_light_as_often_as_expected(
        bounds in emitters(200), viewer in any_viewer(), beside in beside(), how in splitting(),
        seed in any::<u32>()
    ) {
        const DRAWS: u32 = 2048;
        const LOG: f64 = 28.3;
        with_tree(&bounds, |tree| for_viewer!(viewer, |v| {
            let mut counts: HashMap<Picked, u32> = HashMap::new();
            let mut scratch = Scratch::default();
            for i in 0..DRAWS {
                let u = f64::from(hash(i, seed)) / 4_294_967_296.0;
                let random = (u, hash(i, !seed));
                tree.for_each_pick(&v, &beside, &how, random, &mut scratch, |pick| {
                    *counts.entry(pick.light).or_default() += 1;
                });
            }
            for light in all_lights(tree, &beside) {
                let chance = expected(tree, &v, &beside, &how, light).min(1.0);
                let mean = chance * f64::from(DRAWS);
                let variance = mean * (1.0 - chance);
                let allowed = LOG / 3.0 + (LOG * LOG / 9.0 + 2.0 * LOG * variance).sqrt();
                let count = f64::from(counts.get(&light).copied().unwrap_or(0));
                prop_assert!((count - mean).abs() <= allowed, "{light:?}: {count} {mean}");
            }
            Ok(())
        }))?;
    }
}

/// The largest change of an expected count that is left on a way between two points when it is
/// halved again and again, always to the half that changes more: the height of a step, if there is
/// one, and next to nothing if there is none.
fn largest_step(bounds: &[LightBounds], from: Receiver, to: Vec3, how: &Splitting) -> f64 {
    with_tree(bounds, |tree| {
        let at = |t: f64| {
            let point = from.point.as_dvec3().lerp(to.as_dvec3(), t).as_vec3();
            expected_counts(tree, &Receiver { point, ..from }, &[], how)
        };
        let change =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let places: Vec<_> = (0..=64).map(|i| at(f64::from(i) / 64.0)).collect();
        let steepest = (0..64).max_by(|&a, &b| {
            let of = |i: usize| change(&places[i], &places[i + 1]);
            of(a).total_cmp(&of(b))
        });
        let start = steepest.unwrap();
        let (mut low, mut high) = (start as f64 / 64.0, (start + 1) as f64 / 64.0);
        let (mut at_low, mut at_high) = (places[start].clone(), places[start + 1].clone());
        for _ in 0..13 {
            let middle = 0.5 * (low + high);
            let at_middle = at(middle);
            if change(&at_low, &at_middle) > change(&at_middle, &at_high) {
                (high, at_high) = (middle, at_middle);
            } else {
                (low, at_low) = (middle, at_middle);
            }
        }
        change(&at_low, &at_high)
    })
}

/// Lights whose importance itself has no edge: they shine everywhere.
fn without_edges(bounds: &[LightBounds]) -> Vec<LightBounds> {
    let plain = |b: &LightBounds| LightBounds { cone: Cone::ALL, range_m: f32::INFINITY, ..*b };
    bounds.iter().map(plain).collect()
}

proptest! {
    /// A step is left only where a cluster that is sampled surely is opened, and its parts may then
    /// have more than one sample together: far from the whole samples that the seed's rule moves.
    #[test]
    fn a_graded_decision_leaves_hardly_a_seam(
        bounds in emitters(100), from in position(), toward in direction(), knob in 0.02f32..0.9
    ) {
        let how = Splitting { knob, ..Splitting::NONE };
        let from = Receiver { point: from, normal: Vec3::ZERO };
        let step = largest_step(&without_edges(&bounds), from, from.point + toward, &how);
        prop_assert!(step < 0.25, "{step}");
    }
}

/// The comparison that the seed makes does have seams, and this test's measure sees them.
#[test]
fn a_hard_decision_leaves_seams() {
    let bounds: Vec<LightBounds> = (0..64)
        .map(|i| {
            let p = Vec3::new((i % 8) as f32, (i / 8) as f32, 0.0) / 8.0;
            LightBounds::of_emitter(
                candelabra::bounds::Aabb::around([p]),
                Cone::ALL,
                1.0,
                f32::INFINITY,
            )
        })
        .collect();
    let from = Receiver { point: Vec3::new(0.3, 0.4, 0.1), normal: Vec3::ZERO };
    let to = Vec3::new(0.3, 0.4, 6.0);
    let graded = Splitting { knob: 0.3, ..Splitting::NONE };
    let hard = Splitting { test: SplitTest::SolidAngle, knob: 0.9, ..graded };
    assert!(largest_step(&bounds, from, to, &graded) < 1e-3);
    let step = largest_step(&bounds, from, to, &hard);
    assert!(step > 0.5, "{step}");
}
