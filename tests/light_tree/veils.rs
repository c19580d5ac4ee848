//! Weights of what is hidden: whatever they are, no law of picking is broken.

use crate::city::city;
use crate::support::{
    AnyViewer, any_viewer, beside, emitters, for_viewer, receiver, splitting, tree_over,
};
use candelabra::light_tree::learned::{BESIDE, Cells, Plane, Table, coordinates, divide};
use candelabra::light_tree::veil::{decode, encode};
use candelabra::light_tree::{
    Cell, FrameTree, Moments, Picked, Receiver, Scratch, Splitting, Veil, Veiled, Veils, Viewer,
    WIDTH,
};
use glam::Vec3;
use proptest::prelude::*;
use std::collections::HashMap;

/// Rows of random bytes for groups of a file and lights beside it; some groups are not there.
fn rows() -> impl Strategy<Value = Vec<Veil>> {
    let group = prop_oneof![4 => 0u32..30, 1 => Just(BESIDE)];
    let weight = prop_oneof![1 => Just(0u8), 1 => Just(255), 3 => any::<u8>()];
    prop::collection::vec((group, prop::array::uniform8(weight)), 1..20).prop_map(|rows| {
        let mut rows: Vec<Veil> =
            rows.into_iter().map(|(group, weights)| Veil { group, weights }).collect();
        rows.sort_by_key(|row| row.group);
        rows.dedup_by_key(|row| row.group);
        rows
    })
}

/// What an even comb of random numbers finds: of each light how often, and the sum of one over its
/// probability.
fn found<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    beside: &[f64],
    how: &Splitting,
) -> HashMap<Picked, (f64, f64)> {
    const TEETH: u32 = 4096;
    let mut found: HashMap<Picked, (f64, f64)> = HashMap::new();
    let mut scratch = Scratch::default();
    for tooth in 0..TEETH {
        let u = (f64::from(tooth) + 0.5) / f64::from(TEETH);
        tree.for_each_pick(viewer, beside, how, (u, 7), &mut scratch, |pick| {
            let (count, inverse) = found.entry(pick.light).or_default();
            *count += 1.0 / f64::from(TEETH);
            *inverse += 1.0 / pick.probability / f64::from(TEETH);
        });
    }
    found
}

/// Picks tell what they are, and their mean is the sum over all lights that would be picked without
/// weights.
fn laws_hold<V: Viewer>(
    plain: &FrameTree,
    veils: Veils,
    viewer: V,
    beside: &[f64],
    how: &Splitting,
) -> Result<(), TestCaseError> {
    let tree = plain.clone().veiled(veils);
    let veiled = Veiled { viewer, cell: Cell(0) };
    let mut scratch = Scratch::default();
    let mut fresh = Scratch::default();
    for i in 0..32 {
        let u = (f64::from(i) + 0.5) / 32.0;
        let mut picks = Vec::new();
        tree.for_each_pick(&veiled, beside, how, (u, i), &mut scratch, |pick| picks.push(pick));
        prop_assert!(picks.len() <= how.most as usize, "{} picks", picks.len());
        for pick in picks {
            let told = tree.expected(&veiled, beside, how, pick.light, &mut fresh);
            prop_assert!((pick.expected - told).abs() <= 1e-12 * told, "{pick:?} but {told}");
        }
    }
    for (light, (count, _)) in found(&tree, &veiled, beside, how) {
        let told = tree.expected(&veiled, beside, how, light, &mut fresh);
        prop_assert!((count - told).abs() < 0.02, "{light:?}: {count} for {told}");
    }
    let of = |light: Picked, _| match light {
        Picked::Emitter(emitter) => f64::from(emitter % 7 + 1),
        Picked::Beside(row) => f64::from(row + 1),
    };
    let sum = |moments: Moments| moments.mean;
    let with = sum(tree.moments(&veiled, beside, how, &of));
    let without = sum(plain.moments(&viewer, beside, how, &of));
    prop_assert!((with - without).abs() <= 1e-9 * without, "{with} for {without}");
    Ok(())
}

proptest! {
    /// Any bytes.
    #[test]
    fn no_table_changes_what_is_picked_in_the_mean(
        bounds in emitters(150), viewer in any_viewer(), beside in beside(), how in splitting(),
        rows in rows()
    ) {
        let tree = tree_over(&bounds);
        let frame = tree.at_frame(0).unwrap();
        let veils = Veils::new(1, &rows);
        for_viewer!(viewer, |v| laws_hold(&frame, veils, v, &beside, &how))?;
    }

    /// Nor where trees are placed in trees.
    #[test]
    fn nor_with_instances(
        city in city(), viewer in any_viewer(), beside in beside(), how in splitting(), rows in rows()
    ) {
        let tree = city.tree();
        let frame = tree.at_frame(1).unwrap();
        let veils = Veils::new(1, &rows);
        for_viewer!(viewer, |v| laws_hold(&frame, veils, v, &beside, &how))?;
    }

    /// Full view is the tree as it is, to the last bit; and so is a cell that is not there.
    #[test]
    fn what_hides_nothing_changes_no_bit(
        bounds in emitters(150), viewer in receiver(), beside in beside(), how in splitting()
    ) {
        let tree = tree_over(&bounds);
        let plain = tree.at_frame(0).unwrap();
        let rows: Vec<Veil> = (0..40).map(|group| Veil { group, weights: [255; WIDTH] }).collect();
        let veiled = plain.clone().veiled(Veils::new(1, &rows));
        for cell in [Cell(0), Cell(1), Cell::NONE] {
            let viewer = Veiled { viewer, cell };
            let picks = |tree: &FrameTree| {
                let mut picks = Vec::new();
                for i in 0..16 {
                    let random = ((f64::from(i) + 0.5) / 16.0, i);
                    tree.for_each_pick(&viewer, &beside, &how, random, &mut Scratch::default(), |pick| {
                        picks.push((pick.light, pick.probability, pick.expected));
                    });
                }
                picks
            };
            // With one sample the tree's importance is that of its root's children instead of its root's.
            if !how.is_off() || cell == Cell::NONE {
                prop_assert_eq!(picks(&plain), picks(&veiled));
            }
        }
    }

    /// A table that knows nothing right, as of other geometry: on the way to a light, each group that it weighs
    /// makes the light at most so much less likely as the lane's weight is below the largest of the group. So
    /// no light is rarer than that, and no second moment is larger than by the worst of it.
    #[test]
    fn the_worst_table_costs_no_more_than_its_smallest_weight_tells(
        bounds in emitters(100), viewer in receiver(), rows in rows(),
        contributions in prop::collection::vec(-3.0..3f64, 100)
    ) {
        let tree = tree_over(&bounds);
        let plain = tree.at_frame(0).unwrap();
        let veiled = plain.clone().veiled(Veils::new(1, &rows));
        let there = Veiled { viewer, cell: Cell(0) };
        let mut worst = 1f64;
        for emitter in 0..bounds.len() as u32 {
            let mut least = 1f64;
            plain.for_each_lane_toward(emitter, |group, lane| {
                if let Some(row) = rows.iter().find(|row| row.group == group) {
                    let weights = row.weights.map(|byte| f64::from(decode(byte)));
                    least *= weights[lane] / weights.into_iter().fold(0.0, f64::max);
                }
            });
            let without = plain.probability(&viewer, emitter);
            let with = veiled.probability(&there, emitter);
            prop_assert!(with >= without * least * (1.0 - 1e-9), "{with} of {without}");
            worst = worst.min(least);
        }
        let of = |light: Picked, _| {
            light.emitter().map_or(0.0, |emitter| 10f64.powf(contributions[emitter as usize]))
        };
        let second = |m: Moments| m.variance + m.mean * m.mean;
        let without = second(plain.moments(&viewer, &[], &Splitting::NONE, &of));
        let with = second(veiled.moments(&there, &[], &Splitting::NONE, &of));
        prop_assert!(with <= without / worst * (1.0 + 1e-9), "{with} of {without}, {worst}");
    }

    /// Whatever planes are, each receiver has a cell; sharp planes divide receivers as they were divided.
    #[test]
    fn every_receiver_has_a_cell(
        planes in prop::collection::vec((any::<f32>(), any::<f32>(), any::<u32>()), 0..40),
        receiver in receiver(), u in 0f32..1.0
    ) {
        let planes: Vec<Plane> =
            planes.into_iter().map(|(at, width, axis)| Plane { at, width, axis }).collect();
        let cells = Cells(&planes);
        let Cell(cell) = cells.find(receiver.point, receiver.normal, u);
        prop_assert!((cell as usize) < cells.count());
    }

    #[test]
    fn receivers_are_divided_evenly(
        receivers in prop::collection::vec(receiver(), 64..300), levels in 1u32..5
    ) {
        let mut all: Vec<_> =
            receivers.iter().map(|r: &Receiver| coordinates(r.point, r.normal)).collect();
        let (mut planes, ranges) = divide(&mut all, levels);
        prop_assert_eq!((planes.len() + 1, ranges.len()), (1 << levels, 1 << levels));
        planes.iter_mut().for_each(|plane| plane.width = 0.0);
        for (cell, [begin, end]) in ranges.into_iter().enumerate() {
            for &[x, y, z, i, j, k] in &all[begin..end] {
                let found = Cells(&planes).find(Vec3::new(x, y, z), Vec3::new(i, j, k), 0.5);
                prop_assert_eq!(found, Cell(cell as u32));
            }
        }
        // The order in which they are given does not matter.
        let mut other: Vec<_> =
            receivers.iter().rev().map(|r: &Receiver| coordinates(r.point, r.normal)).collect();
        let (again, _) = divide(&mut other, levels);
        prop_assert!(again.iter().zip(&planes).all(|(a, b)| (a.at, a.axis) == (b.at, b.axis)));
    }

    #[test]
    fn a_byte_is_a_weight_and_a_weight_a_byte(byte in any::<u8>()) {
        prop_assert!(decode(byte) > 0.0 && decode(byte) <= 1.0);
        prop_assert_eq!(encode(decode(byte).into()), byte);
    }
}

#[test]
fn full_view_is_a_weight_of_one() {
    assert_eq!((decode(255), encode(1.0), encode(0.0)), (1.0, 255, 0));
    assert!(Table::default().view().is_none());
}

/// A light of which next to nothing is seen keeps a chance, and what it takes is missing nowhere else: twenty lights
/// that are weighed exactly have no noise with it, as they have none without it.
#[test]
fn a_hidden_light_brings_no_noise_to_the_others() {
    let tree = tree_over(&[]);
    let hidden = 20;
    let mut rows: Vec<Veil> =
        (0..3).map(|row| Veil { group: BESIDE + row, weights: [255; WIDTH] }).collect();
    rows[hidden / WIDTH].weights[hidden % WIDTH] = 12;
    let frame = tree.at_frame(0).unwrap().veiled(Veils::new(1, &rows));
    let viewer = Veiled { viewer: Receiver { point: Vec3::ZERO, normal: Vec3::Y }, cell: Cell(0) };
    let variance = |brighter: f64, cell: Cell, knob: f32| {
        let mut beside = vec![1.0; hidden];
        let weight = frame.weight_beside(cell, hidden);
        beside.push(brighter * weight);
        let of = |light: Picked, _| f64::from(u8::from(light != Picked::Beside(hidden as u32)));
        let how = Splitting { knob, ..Splitting::NONE };
        let moments = frame.moments(&Veiled { cell, ..viewer }, &beside, &how, &of);
        assert!((moments.mean - hidden as f64).abs() < 1e-9, "{moments:?}");
        moments.variance / moments.mean.powi(2)
    };
    for knob in [0.2, 0.3, 0.5, 0.7] {
        for brighter in [1.0, 30.0, 1e3, 1e4, 1e6] {
            let told = variance(brighter, Cell(0), knob);
            assert!(told < 1e-12, "knob {knob}, {brighter} times as bright: {told}");
        }
        // Whether it is known that it is hidden does matter.
        assert!(variance(0.7, Cell::NONE, knob) > 1e-3, "knob {knob}");
    }
}
