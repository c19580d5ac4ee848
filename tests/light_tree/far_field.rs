//! Lights that tell their intensity by direction: what is picked, and how often that is told.

use crate::support::{
    AnyViewer, any_viewer, beside, emitters, for_viewer, receiver, splitting, tree_over,
};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::far_field::FarField;
use candelabra::light_tree::{FrameTree, Moments, Picked, Receiver, Scratch, Splitting, Viewer};
use glam::Vec3;
use proptest::prelude::*;
use std::collections::HashMap;
use std::f32::consts::PI;

/// Beams of some sharpness about the axes of bounds, turned; of some lights.
#[derive(Debug)]
struct Beams {
    bounds: Vec<LightBounds>,
    known: u64,
    sharpness: f32,
    turn: f32,
}

impl Beams {
    fn is_known(&self, emitter: u32) -> bool {
        self.known >> (emitter % 64) & 1 == 1
    }
}

impl FarField for Beams {
    fn is_known(&self, emitter: u32) -> bool {
        Beams::is_known(self, emitter)
    }

    fn intensity(&self, emitter: u32, direction: Vec3) -> f32 {
        let LightBounds { cone, energy, .. } = self.bounds[emitter as usize];
        let (sin, cos) = self.turn.sin_cos();
        let axis = Vec3::new(
            cos * cone.axis.x - sin * cone.axis.y,
            sin * cone.axis.x + cos * cone.axis.y,
            cone.axis.z,
        );
        energy * (self.sharpness * (axis.dot(direction) - 1.0)).exp() * (1.0 + self.sharpness)
    }
}

fn beams() -> impl Strategy<Value = Beams> {
    let sharpness = (-2f32..3.0).prop_map(|e| 10f32.powf(e));
    (emitters(120), any::<u64>(), sharpness, 0f32..2.0 * PI)
        .prop_map(|(bounds, known, sharpness, turn)| Beams { bounds, known, sharpness, turn })
}

fn laws_hold<V: Viewer>(
    tree: &FrameTree,
    plain: &FrameTree,
    viewer: V,
    beside: &[f64],
    how: &Splitting,
) -> Result<(), TestCaseError> {
    const TEETH: u32 = 2048;
    let (mut scratch, mut fresh) = (Scratch::default(), Scratch::default());
    let mut found: HashMap<Picked, f64> = HashMap::new();
    for tooth in 0..TEETH {
        let u = (f64::from(tooth) + 0.5) / f64::from(TEETH);
        let mut picks = Vec::new();
        tree.for_each_pick(&viewer, beside, how, (u, 7), &mut scratch, |pick| picks.push(pick));
        prop_assert!(picks.len() <= how.most as usize);
        for pick in picks {
            *found.entry(pick.light).or_default() += 1.0 / f64::from(TEETH);
            if tooth % 64 == 0 {
                let told = tree.expected(&viewer, beside, how, pick.light, &mut fresh);
                prop_assert!((pick.expected - told).abs() <= 1e-12 * told, "{pick:?} but {told}");
            }
        }
    }
    let (mut whole, mut some) = (0.0, false);
    for emitter in 0..tree.unforced_count() {
        let light = Picked::Emitter(emitter);
        let told = tree.expected(&viewer, beside, how, light, &mut fresh);
        let drawn = found.get(&light).copied().unwrap_or(0.0);
        prop_assert!((drawn - told).abs() < 0.02, "{light:?}: {drawn} for {told}");
        // Cones alone decide what is dark.
        let (one, without) =
            (tree.probability(&viewer, emitter), plain.probability(&viewer, emitter));
        prop_assert_eq!(one > 0.0, without > 0.0, "{} {}", one, without);
        whole += one;
        some |= one > 0.0;
    }
    // A descent may end in the dark.
    prop_assert!(whole <= 1.0 + 1e-9 && (whole > 0.0) == some);
    let of = |light: Picked, _| match light {
        Picked::Emitter(emitter) => f64::from(emitter % 7 + 1),
        Picked::Beside(row) => f64::from(row + 1),
    };
    let sum = |moments: Moments| moments.mean;
    let (with, without) = (
        sum(tree.moments(&viewer, beside, how, &of)),
        sum(plain.moments(&viewer, beside, how, &of)),
    );
    prop_assert!((with - without).abs() <= 1e-9 * without, "{with} for {without}");
    Ok(())
}

proptest! {
    #[test]
    fn picks_are_told_and_nothing_is_lost(
        beams in beams(), viewer in any_viewer(), beside in beside(), how in splitting()
    ) {
        let tree = tree_over(&beams.bounds);
        let plain = tree.at_frame(0).unwrap();
        let (frame, _) = plain.clone().with_far_fields(&beams, None);
        for_viewer!(viewer, |v| laws_hold(&frame, &plain, v, &beside, &how))?;
    }

    /// The scale of lengths and energies does not matter.
    #[test]
    fn scale_does_not_change_probabilities(
        beams in beams(), viewer in receiver(), size in -20i32..20, energy in -10i32..10
    ) {
        let (s, e) = (2f32.powi(size), 2f32.powi(energy));
        let scale = |b: &LightBounds| LightBounds {
            aabb: Aabb { min: b.aabb.min * s, max: b.aabb.max * s },
            energy: b.energy * e,
            range_m: b.range_m * s,
            ..*b
        };
        let Beams { known, sharpness, turn, .. } = beams;
        let scaled = Beams { bounds: beams.bounds.iter().map(scale).collect(), known, sharpness, turn };
        let of = |beams: &Beams, viewer: Receiver| -> Vec<f64> {
            let tree = tree_over(&beams.bounds);
            let (frame, _) = tree.at_frame(0).unwrap().with_far_fields(beams, None);
            (0..beams.bounds.len() as u32).map(|emitter| frame.probability(&viewer, emitter)).collect()
        };
        let mut sorted = [of(&beams, viewer), of(&scaled, Receiver { point: viewer.point * s, ..viewer })];
        // Lights in one place are taken in any order.
        sorted.iter_mut().for_each(|all| all.sort_by(f64::total_cmp));
        for (a, b) in sorted[0].iter().zip(&sorted[1]) {
            prop_assert!((a - b).abs() <= 1e-6 + 1e-4 * a, "{a} {b}");
        }
    }

    /// Where nothing is known, nothing is another.
    #[test]
    fn without_far_fields_nothing_changes(bounds in emitters(60), viewer in any_viewer()) {
        let tree = tree_over(&bounds);
        let none = Beams { bounds: bounds.clone(), known: 0, sharpness: 1.0, turn: 0.0 };
        let plain = tree.at_frame(0).unwrap();
        let (frame, _) = plain.clone().with_far_fields(&none, None);
        for emitter in 0..bounds.len() as u32 {
            let of = |tree: &FrameTree| for_viewer!(viewer, |v| tree.probability(&v, emitter));
            prop_assert_eq!(of(&frame).to_bits(), of(&plain).to_bits());
        }
    }
}

/// Two lamps in one place that point apart: who stands in one's beam picks that one.
#[test]
fn a_beam_is_found_by_who_stands_in_it() {
    let lamp = |axis: Vec3| {
        LightBounds::of_emitter(
            Aabb { min: Vec3::ZERO, max: Vec3::ZERO },
            Cone { axis, ..Cone::ALL },
            1.0,
            f32::INFINITY,
        )
    };
    let bounds = vec![lamp(Vec3::X), lamp(Vec3::Z)];
    let beams = Beams { bounds: bounds.clone(), known: 3, sharpness: 30.0, turn: 0.0 };
    let tree = tree_over(&bounds);
    let (frame, kept) = tree.at_frame(0).unwrap().with_far_fields(&beams, None);
    let again = tree.at_frame(0).unwrap().with_far_fields(&beams, kept).0;
    for frame in [frame, again] {
        let receiver = Receiver { point: 3.0 * Vec3::Z, normal: -Vec3::Z };
        assert!(frame.probability(&receiver, 1) > 0.99);
        assert!(frame.probability(&receiver, 0) > 0.0);
    }
}
