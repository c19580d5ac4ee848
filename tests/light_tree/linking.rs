//! Lights that do not light everything: what is picked for whom, and how often that is told.

use crate::city::city;
use crate::support::{
    AnyViewer, Tree, any_viewer, beside, emitters, for_viewer, receiver, splitting,
};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{
    FrameTree, LightList, LightLook, LightSummary, LightTree, LightTreeWriter, Link, Linked, LitBy,
    Moments, Picked, Receiver, ReceiverClass, Scratch, Splitting, TreeKind, Viewer,
};
use candelabra::store::StoreError;
use glam::Vec3;
use proptest::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// Any numbers as the format has them: in the order of the first lights; 0 stays 0.
pub fn numbered(links: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut known = HashMap::from([(0, 0)]);
    let number = |link| {
        let next = known.len() as u32;
        *known.entry(link).or_insert(next)
    };
    links.map(number).collect()
}

/// A tree over some bounds, each a light of its own with a link number.
fn linked_tree(bounds: &[LightBounds], links: &[u32]) -> Tree {
    let mut writer = LightTreeWriter::default();
    writer.add_tree(TreeKind::Still, bounds, |i| Link::Emitter(i as u32));
    let light = |(i, (bounds, &link)): (usize, (&LightBounds, &u32))| LightSummary {
        path: format!("/light_{i:05}"),
        fingerprint: [1; 32],
        emitter_count: 1,
        energy: bounds.energy,
        class: 0,
        look: LightLook::default(),
        link,
    };
    let lights: Vec<_> = bounds.iter().zip(links).enumerate().map(light).collect();
    LightTree::open(writer.finish(&LightList::new(&lights), "{}", [2; 32])).unwrap()
}

/// Of one class, which is lit by number 0 and by those of some numbers.
fn lit_by(numbers: u32, lit: impl Fn(u32) -> bool) -> Arc<LitBy> {
    Arc::new(LitBy::new(numbers as usize, [(0..numbers).map(lit).collect()]))
}

const CLASS: ReceiverClass = ReceiverClass(0);

/// Bounds with link numbers: few numbers or many, each mostly together or mixed.
fn linked(most: usize) -> impl Strategy<Value = (Vec<LightBounds>, Vec<u32>, u64)> {
    let links = prop::collection::vec(prop_oneof![2 => 0u32..4, 1 => 0u32..64], most);
    (emitters(most), links, any::<u64>()).prop_map(|(bounds, links, lit)| {
        let links = numbered(links.into_iter().take(bounds.len()));
        (bounds, links, lit)
    })
}

fn is_lit(lit: u64, number: u32) -> bool {
    number == 0 || lit >> (number % 64) & 1 == 1
}

/// All that is told of the picks of a linked viewer, against the tree without links.
fn laws_hold<V: Viewer>(
    tree: &FrameTree,
    plain: &FrameTree,
    viewer: V,
    beside: &[f64],
    how: &Splitting,
    lights: &impl Fn(u32) -> bool,
) -> Result<(), TestCaseError> {
    const TEETH: u32 = 2048;
    let linked = Linked { viewer, class: CLASS };
    let lit = |light: Picked| light.emitter().is_none_or(lights);
    let (mut scratch, mut fresh) = (Scratch::default(), Scratch::default());
    let mut found: HashMap<Picked, f64> = HashMap::new();
    for tooth in 0..TEETH {
        let u = (f64::from(tooth) + 0.5) / f64::from(TEETH);
        let mut picks = Vec::new();
        tree.for_each_pick(&linked, beside, how, (u, 7), &mut scratch, |pick| picks.push(pick));
        prop_assert!(picks.len() <= how.most as usize);
        for pick in picks {
            prop_assert!(lit(pick.light), "{pick:?} does not light it");
            *found.entry(pick.light).or_default() += 1.0 / f64::from(TEETH);
            if tooth % 64 == 0 {
                let told = tree.expected(&linked, beside, how, pick.light, &mut fresh);
                prop_assert!((pick.expected - told).abs() <= 1e-12 * told, "{pick:?} but {told}");
            }
        }
    }
    for emitter in 0..tree.unforced_count() {
        let light = Picked::Emitter(emitter);
        let told = tree.expected(&linked, beside, how, light, &mut fresh);
        let drawn = found.get(&light).copied().unwrap_or(0.0);
        prop_assert!((drawn - told).abs() < 0.02, "{light:?}: {drawn} for {told}");
        // Zero just where it is not linked, or is nothing to anybody.
        let one = tree.probability(&linked, emitter);
        let without = plain.probability(&viewer, emitter);
        prop_assert_eq!(one > 0.0, without > 0.0 && lights(emitter), "{} {}", one, without);
    }
    // What can be found is all light that is linked, and no more.
    let of = |light: Picked, _| match light {
        Picked::Emitter(emitter) => f64::from(emitter % 7 + 1),
        Picked::Beside(row) => f64::from(row + 1),
    };
    let of_linked = |light: Picked, n| if lit(light) { of(light, n) } else { 0.0 };
    let sum = |moments: Moments| moments.mean;
    let with = sum(tree.moments(&linked, beside, how, &of));
    let without = sum(plain.moments(&viewer, beside, how, &of_linked));
    prop_assert!((with - without).abs() <= 1e-9 * without, "{with} for {without}");
    Ok(())
}

proptest! {
    #[test]
    fn picks_are_linked_and_told(
        (bounds, links, lit) in linked(120), viewer in any_viewer(), beside in beside(), how in splitting()
    ) {
        let tree = linked_tree(&bounds, &links);
        if !tree.light_links().is_empty() {
            prop_assert!(tree.verify().is_ok());
        }
        let plain = tree.at_frame(0).unwrap();
        let frame = tree.at_frame_linked(0, &lit_by(tree.link_numbers(), |n| is_lit(lit, n))).unwrap();
        let lights = |emitter: u32| is_lit(lit, links[emitter as usize]);
        for_viewer!(viewer, |v| laws_hold(&frame, &plain, v, &beside, &how, &lights))?;
    }

    /// Where trees are placed in trees, some of a frame, and some are forced.
    #[test]
    fn so_they_are_with_instances(
        city in city(), links in prop::collection::vec(0u32..5, 40), lit in any::<u64>(),
        viewer in any_viewer(), beside in beside(), how in splitting()
    ) {
        let tree = city.tree_linked(|row| links[row % links.len()]);
        let plain = tree.at_frame(1).unwrap();
        let frame = tree.at_frame_linked(1, &lit_by(tree.link_numbers(), |n| is_lit(lit, n))).unwrap();
        let lights = |emitter: u32| {
            let rows = tree.lights();
            let row = rows.partition_point(|light| light.first_emitter <= emitter) - 1;
            is_lit(lit, tree.link_of(row))
        };
        for_viewer!(viewer, |v| laws_hold(&frame, &plain, v, &beside, &how, &lights))?;
        let first = |emitter: &u32| lights(*emitter);
        let count = tree.emitter_count() as u32;
        let AnyViewer::Receiver(viewer) = viewer else { return Ok(()) };
        let linked = Linked { viewer, class: CLASS };
        for light in 0..frame.forced_count() {
            let (own, free) =
                (frame.sample_forced(light, &linked, 0.3), plain.sample_forced(light, &viewer, 0.3));
            let shines = free.and_then(|pick| pick.light.emitter()).filter(first);
            prop_assert_eq!(own.and_then(|pick| pick.light.emitter()), shines);
        }
        for emitter in frame.unforced_count()..count {
            let own = frame.probability(&linked, emitter);
            let free = if lights(emitter) { plain.probability(&viewer, emitter) } else { 0.0 };
            prop_assert_eq!(own, free);
        }
    }

    /// The probabilities of what lights a point in a medium add up to one: no light turns out to be dark.
    #[test]
    fn probabilities_sum_to_one(
        places in prop::collection::vec((-1f32..1.0, -1f32..1.0, -1f32..1.0, -6f32..6.0), 1..200),
        links in prop::collection::vec(0u32..9, 200), lit in any::<u64>()
    ) {
        let point = |&(x, y, z, exponent): &(f32, f32, f32, f32)| {
            let at = Aabb::around([Vec3::new(x, y, z)]);
            LightBounds::of_emitter(at, Cone::ALL, 10f32.powf(exponent), f32::INFINITY)
        };
        let bounds: Vec<_> = places.iter().map(point).collect();
        let links = numbered(links.into_iter().take(bounds.len()));
        let tree = linked_tree(&bounds, &links);
        let frame = tree.at_frame_linked(0, &lit_by(tree.link_numbers(), |n| is_lit(lit, n))).unwrap();
        let viewer = Receiver { point: Vec3::splat(0.1), normal: Vec3::ZERO };
        let linked = Linked { viewer, class: CLASS };
        let of = |emitter| frame.probability(&linked, emitter);
        let sum: f64 = (0..bounds.len() as u32).map(of).sum();
        let any = links.iter().any(|&number| is_lit(lit, number));
        prop_assert!((sum - f64::from(u8::from(any))).abs() < 1e-9, "{sum}");
        // One walk over all finds the same.
        let mut walked = 0.0;
        frame.for_each_probability(&linked, |emitter, probability| {
            walked += (probability - of(emitter)).abs();
        });
        prop_assert!(walked < 1e-12);
    }

    /// A class that everything lights is the tree as it is, to the last bit; so is a viewer without a class.
    #[test]
    fn whom_all_light_sees_no_links(
        (bounds, links, _) in linked(100), viewer in receiver(), beside in beside(), how in splitting()
    ) {
        let tree = linked_tree(&bounds, &links);
        let plain = tree.at_frame(0).unwrap();
        let frame = tree.at_frame_linked(0, &lit_by(tree.link_numbers(), |_| true)).unwrap();
        fn picks<V: Viewer>(tree: &FrameTree, viewer: &V, beside: &[f64], how: &Splitting) -> Vec<(Picked, f64, f64)> {
            let mut picks = Vec::new();
            for i in 0..16 {
                let random = ((f64::from(i) + 0.5) / 16.0, i);
                tree.for_each_pick(viewer, beside, how, random, &mut Scratch::default(), |pick| {
                    picks.push((pick.light, pick.probability, pick.expected));
                });
            }
            picks
        }
        let expected = picks(&plain, &viewer, &beside, &how);
        prop_assert_eq!(&picks(&frame, &viewer, &beside, &how), &expected);
        // With one sample the tree's importance is that of its root's children instead of its root's.
        if !how.is_off() {
            for class in [CLASS, ReceiverClass::ALL] {
                prop_assert_eq!(&picks(&frame, &Linked { viewer, class }, &beside, &how), &expected);
            }
        }
    }

    /// Neither the scale of lengths and energies nor the order of lights matters.
    #[test]
    fn scale_and_order_do_not_change_probabilities(
        (bounds, links, lit) in linked(60), viewer in receiver(), size in -20i32..20, energy in -60i32..60
    ) {
        let (s, e) = (2f32.powi(size), 2f32.powi(energy));
        let scaled: Vec<_> = bounds.iter().rev().map(|b| LightBounds {
            aabb: Aabb { min: b.aabb.min * s, max: b.aabb.max * s },
            energy: b.energy * e,
            range_m: b.range_m * s,
            ..*b
        }).collect();
        let there = Receiver { point: viewer.point * s, ..viewer };
        let of = |bounds: &[LightBounds], lit: &dyn Fn(usize) -> bool, viewer: Receiver| -> Vec<f64> {
            let links: Vec<u32> = (0..bounds.len()).map(|i| if lit(i) { 1 } else { 2 }).collect();
            let links = numbered(links.into_iter());
            let tree = linked_tree(bounds, &links);
            let one = links.iter().zip(0..).find(|(_, i)| lit(*i)).map(|(&number, _)| number);
            let frame = tree.at_frame_linked(0, &lit_by(tree.link_numbers(), |n| Some(n) == one)).unwrap();
            let linked = Linked { viewer, class: CLASS };
            (0..bounds.len() as u32).map(|emitter| frame.probability(&linked, emitter)).collect()
        };
        let count = bounds.len();
        let is_lit = |i: usize| is_lit(lit, links[i]);
        let here = of(&bounds, &is_lit, viewer);
        let there = of(&scaled, &|i| is_lit(count - 1 - i), there);
        // Lights in one place are taken in any order.
        let mut sorted = [here, there];
        sorted.iter_mut().for_each(|all| all.sort_by(f64::total_cmp));
        for (a, b) in sorted[0].iter().zip(&sorted[1]) {
            prop_assert!((a - b).abs() <= 1e-6 + 1e-4 * a, "{a} {b}");
        }
    }

    /// Whatever a file says of links, sampling it ends and does not panic.
    #[test]
    fn any_numbers_can_be_sampled(
        (bounds, _, lit) in linked(40), links in prop::collection::vec(any::<u32>(), 40), viewer in receiver()
    ) {
        let tree = linked_tree(&bounds, &links);
        let frame = tree.at_frame_linked(0, &lit_by(5, |n| is_lit(lit, n))).unwrap();
        for u in [0.0, 0.5, 0.99] {
            let _ = frame.sample(&Linked { viewer, class: CLASS }, u);
            let _ = frame.sample(&Linked { viewer, class: ReceiverClass(77) }, u);
        }
    }
}

/// A row of points.
fn row(count: usize, energy: impl Fn(usize) -> f32) -> Vec<LightBounds> {
    let point = |i: usize| {
        LightBounds::of_emitter(
            Aabb::around([Vec3::new(i as f32, 1.0, 0.0)]),
            Cone::ALL,
            energy(i),
            f32::INFINITY,
        )
    };
    (0..count).map(point).collect()
}

/// Each of 600 receivers is lit by a light of its own, between lights of other receivers that are up to 24
/// decades stronger.
#[test]
fn hundreds_of_sets_are_told_apart() {
    const COUNT: usize = 600;
    let bounds = row(COUNT, |i| 10f32.powi((i * 7 % 25) as i32 - 12));
    let links: Vec<u32> = (1..=COUNT as u32).collect();
    let tree = linked_tree(&bounds, &links);
    tree.verify().unwrap();
    let classes = (0..COUNT).map(|class| (0..=COUNT).map(|number| number == class + 1).collect());
    let lit_by = Arc::new(LitBy::new(COUNT + 1, classes));
    let frame = tree.at_frame_linked(0, &lit_by).unwrap();
    let viewer = Receiver { point: Vec3::new(300.0, 0.0, 0.0), normal: Vec3::Y };
    for class in 0..COUNT as u32 {
        let linked = Linked { viewer, class: ReceiverClass(class) };
        for u in [0.0, 0.3, 0.999_999] {
            let pick = frame.sample(&linked, u).unwrap();
            assert_eq!((pick.light, pick.probability), (Picked::Emitter(class), 1.0));
        }
    }
}

/// Drawn by random numbers, picks are as frequent as they are told to be (chi-square).
#[test]
fn picks_are_as_frequent_as_they_are_told() {
    const DRAWS: u32 = 200_000;
    let bounds = row(40, |i| 1.0 + i as f32);
    let links = numbered((0..40).map(|i| i % 5));
    let tree = linked_tree(&bounds, &links);
    let frame = tree.at_frame_linked(0, &lit_by(5, |n| n == 2 || n == 4)).unwrap();
    let viewer = Receiver { point: Vec3::new(17.0, 0.0, 2.0), normal: Vec3::Y };
    let linked = Linked { viewer, class: CLASS };
    let beside = [2.0];
    for how in [Splitting::NONE, Splitting { knob: 0.4, ..Splitting::ALL }] {
        let mut counts: HashMap<Picked, u32> = HashMap::new();
        let mut scratch = Scratch::default();
        for i in 0..DRAWS {
            let words = [1, 2].map(|salt| candelabra::math::random::hash(i, salt));
            let u = (f64::from(words[0]) + 0.5) / 4_294_967_296.0;
            frame.for_each_pick(&linked, &beside, &how, (u, words[1]), &mut scratch, |pick| {
                *counts.entry(pick.light).or_default() += 1;
            });
        }
        let all = (0..40).map(Picked::Emitter).chain([Picked::Beside(0)]);
        let (mut chi2, mut cells) = (0.0, 0);
        for light in all {
            let told = frame.expected(&linked, &beside, &how, light, &mut scratch);
            let drawn = f64::from(counts.get(&light).copied().unwrap_or(0));
            let is_lit = light.emitter().is_none_or(|e| [0, 2, 4].contains(&links[e as usize]));
            assert_eq!(told > 0.0, is_lit);
            assert!(told > 0.0 || drawn == 0.0);
            if told > 0.0 {
                let mean = told * f64::from(DRAWS);
                // A light is taken once at most, so its count is binomial.
                let variance = (mean * (1.0 - told)).max(1e-9 * mean);
                chi2 += (drawn - mean).powi(2) / variance;
                cells += 1;
            }
        }
        // The mean of chi-square is the number of cells, its variance twice that; shares are not independent.
        let cells = f64::from(cells);
        assert!(chi2 < cells + 6.0 * (2.0 * cells).sqrt(), "{chi2} of {cells}");
    }
}

#[test]
fn nothing_is_picked_for_whom_nothing_lights() {
    let tree = linked_tree(&row(30, |_| 1.0), &[1; 30]);
    let frame = tree.at_frame_linked(0, &lit_by(2, |_| false)).unwrap();
    let viewer = Receiver { point: Vec3::ZERO, normal: Vec3::Y };
    let linked = Linked { viewer, class: CLASS };
    assert_eq!(frame.sample(&linked, 0.5), None);
    for how in [Splitting::NONE, Splitting { knob: 0.5, ..Splitting::ALL }, Splitting::ALL] {
        let mut scratch = Scratch::default();
        frame.for_each_pick(&linked, &[], &how, (0.5, 1), &mut scratch, |pick| panic!("{pick:?}"));
        assert_eq!(frame.moments(&linked, &[], &how, &|_, _| 1.0), Moments::default());
        // What is beside the tree is then all there is.
        let light = Picked::Beside(0);
        assert_eq!(frame.expected(&linked, &[3.0], &how, light, &mut scratch), 1.0);
    }
}

#[test]
fn links_are_in_the_file_only_if_there_are_any() {
    let bounds = row(5, |_| 1.0);
    let without = linked_tree(&bounds, &[0; 5]);
    let with = linked_tree(&bounds, &[0, 1, 1, 2, 0]);
    let has = |tree: &Tree| tree.sections().iter().any(|section| &section.id.0 == b"LINK");
    assert!(!has(&without) && has(&with));
    assert_eq!(with.light_links(), [0, 1, 1, 2, 0]);
    assert_eq!((without.link_numbers(), with.link_numbers()), (1, 3));
    assert_eq!(bytemuck::bytes_of(&without.trees()[0]), bytemuck::bytes_of(&with.trees()[0]));
    let groups = |tree: &Tree| bytemuck::cast_slice::<_, u8>(tree.groups()).to_vec();
    assert_eq!(groups(&without), groups(&with));
    assert_ne!(with.digest_at(0), without.digest_at(0));
    assert_ne!(with.digest_at(0), linked_tree(&bounds, &[0, 1, 1, 1, 0]).digest_at(0));
}

#[test]
fn numbers_out_of_order_are_found_by_verify() {
    let bounds = row(4, |_| 1.0);
    for (links, rule) in [([0, 2, 1, 0], "LINK 2"), ([1, 1, 3, 0], "LINK 2"), ([9; 4], "LINK 2")] {
        let error = linked_tree(&bounds, &links).verify().unwrap_err();
        let StoreError::Broken(violation) = &error else { panic!("{error}") };
        assert_eq!(violation.rule.to_string(), rule, "{links:?}");
    }
    linked_tree(&bounds, &[1, 0, 2, 1]).verify().unwrap();
}

/// Strong lights that light something else draw no samples: one pick is nearly as good as from a tree without them.
#[test]
fn what_is_not_linked_draws_no_picks() {
    let place = |i: usize| {
        let t = i as f32;
        Vec3::new((1.7 * t).sin(), 0.3 + 0.2 * (2.9 * t).cos(), (0.6 * t).cos())
    };
    let bounds = |strong: bool| -> (Vec<LightBounds>, Vec<u32>) {
        let point = |i: usize| {
            LightBounds::of_emitter(
                Aabb::around([place(i)]),
                Cone::ALL,
                if i.is_multiple_of(10) { 1e6 } else { 1.0 + (i % 3) as f32 },
                f32::INFINITY,
            )
        };
        let all = (0..400usize).filter(|i| strong || !i.is_multiple_of(10));
        all.map(|i| (point(i), if i.is_multiple_of(10) { 1 } else { 2 })).unzip()
    };
    let variance = |strong: bool, x: f32| {
        let (bounds, links) = bounds(strong);
        let links = numbered(links.into_iter());
        let own = links[usize::from(strong)];
        let tree = linked_tree(&bounds, &links);
        let frame = tree.at_frame_linked(0, &lit_by(3, |n| n == own)).unwrap();
        let viewer = Receiver { point: Vec3::new(x, 0.0, 0.2), normal: Vec3::Y };
        let linked = Linked { viewer, class: CLASS };
        let mut given = vec![0.0; bounds.len()];
        frame.for_each_leaf(&linked, |emitter, importance, _| given[emitter as usize] = importance);
        let of = |light: Picked, _| given[light.emitter().unwrap() as usize];
        let moments = frame.moments(&linked, &[], &Splitting::NONE, &of);
        moments.variance / (moments.mean * moments.mean)
    };
    for x in [-0.9, -0.2, 0.5, 2.0] {
        let (with, without) = (variance(true, x), variance(false, x));
        assert!(with < 3.0 * without + 0.02, "{with} for {without} at {x}");
    }
}

/// Of more classes than shares are kept for, a lane counts as a whole or not at all: still just what is linked is picked.
#[test]
fn so_many_classes_are_told_apart_as_well() {
    const CLASSES: usize = 1 << 20;
    let bounds = row(40, |i| 10f32.powi((i % 7) as i32));
    let links = numbered((0..40).map(|i| i % 5));
    let tree = linked_tree(&bounds, &links);
    let classes = (0..CLASSES).map(|class| (0..5).map(|n| n > 0 && class % 5 == n).collect());
    let frame = tree.at_frame_linked(0, &Arc::new(LitBy::new(5, classes))).unwrap();
    let viewer = Receiver { point: Vec3::new(11.0, 0.0, 2.0), normal: Vec3::ZERO };
    for class in [0, 1, 7, CLASSES as u32 - 1] {
        let linked = Linked { viewer, class: ReceiverClass(class) };
        let lights = |emitter: u32| [0, class % 5].contains(&links[emitter as usize]);
        let of = |emitter| frame.probability(&linked, emitter);
        assert!((0..40).all(|emitter| (of(emitter) > 0.0) == lights(emitter)), "class {class}");
        let sum: f64 = (0..40).map(of).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    }
}
