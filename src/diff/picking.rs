//! How far the probabilities of picks moved.
//!
//! At a probe, each version picks one light, and every light has a probability. The distance between two
//! such distributions is their *total variation distance*, half the sum of all `|p_before - p_after|`:
//! the share of picks that go to another light. It is 0 if the distributions are equal and 1 if they
//! have no light in common. Lights are matched as in the rest of the comparison, so a light that was
//! only renamed is the same. The event that nothing is picked counts as one more light. Forced lights are
//! never picked and do not count. The probabilities are exact for a diffuse surface: both trees are
//! walked whole.

use super::scene_side::SceneSide;
use crate::emitter::InfiniteLight;
use crate::light_tree::{FrameTree, LightTree, Receiver};
use rayon::prelude::*;
use serde::Serialize;

/// How far the probabilities of picks moved, over some probes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PickingChange {
    /// Where the probes are.
    pub places: ProbePlaces,
    /// How many there are.
    pub probes: usize,
    /// Total variation distance in the mean over the probes, `[0, 1]`.
    pub mean: f64,
    /// The largest, `[0, 1]`.
    pub worst: f64,
    /// Where it is largest, world space, metres.
    pub worst_at_m: [f32; 3],
}

/// Where probes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ProbePlaces {
    /// On surfaces that camera paths of the version after visit (of the one before, if only that has
    /// a camera).
    CameraPaths,
    /// Spread evenly over the box around all emitters of both, half as large again to every side.
    BoxAroundLights,
}

/// What picks lights at a probe: a version's tree, and the infinite lights that compete with it.
pub(super) struct Picks<'a> {
    frame: FrameTree<'a>,
    /// For each emitter the number of its light.
    light_of_emitter: Vec<u32>,
    /// Lights at infinity that are not forced, with their numbers.
    infinite: Vec<(u32, InfiniteLight<'a>)>,
}

impl<'a> Picks<'a> {
    /// The picks of a version in its first frame. `numbers` are those of its lights. The infinite lights
    /// of `scene` compete with the tree, if a scene is given.
    pub fn new<D: AsRef<[u8]>>(
        tree: &'a LightTree<D>,
        scene: Option<&'a SceneSide>,
        numbers: &[u32],
    ) -> Picks<'a> {
        let frame = tree.frames().first().map_or(0, |row| row.frame);
        let near = tree.lights().iter().zip(numbers);
        let light_of_emitter = near
            .flat_map(|(light, &number)| std::iter::repeat_n(number, light.emitter_count as usize));
        Picks {
            frame: tree.at_frame(frame).expect("a file has its first frame"),
            light_of_emitter: light_of_emitter.collect(),
            infinite: scene.map_or_else(Vec::new, |scene| {
                scene.infinite_to_pick(&numbers[tree.lights().len()..])
            }),
        }
    }

    /// Calls `visit` with the number of each light and the probability of picking it, without splitting.
    /// The probability of one light may come in several calls. If they sum to less than 1, the rest is
    /// the probability that nothing is picked.
    fn for_each(&self, receiver: &Receiver, mut visit: impl FnMut(u32, f64)) {
        let importance = |light: &InfiniteLight| light.importance(receiver.normal);
        let of_tree = self.frame.total_importance(receiver);
        let beside: f64 = self.infinite.iter().map(|(_, light)| importance(light)).sum();
        let total = of_tree + beside;
        if !(total > 0.0 && total.is_finite()) {
            return;
        }
        for (number, light) in &self.infinite {
            visit(*number, importance(light) / total);
        }
        self.frame.for_each_probability(receiver, |emitter, probability| {
            visit(self.light_of_emitter[emitter as usize], probability * of_tree / total);
        });
    }
}

/// The probes are divided into this many runs. Each run goes through its probes in order, so that sums
/// do not depend on the number of threads.
const RUNS: usize = 8;

/// How far the probabilities moved at some probes. Also returns, for each of `lights` lights, the mean
/// of the absolute change of its probability.
pub(super) fn picking_change(
    [before, after]: [&Picks; 2],
    lights: usize,
    places: ProbePlaces,
    probes: &[Receiver],
) -> (PickingChange, Vec<f64>) {
    let each = probes.len().div_ceil(RUNS).max(1);
    let runs = probes.par_chunks(each).map(|probes| {
        let mut shares = [(); 2].map(|()| vec![0f64; lights]);
        let mut moved = vec![0f64; lights];
        let distance = |receiver: &Receiver| {
            let mut sums = [0f64; 2];
            for ((picks, shares), sum) in
                [before, after].into_iter().zip(&mut shares).zip(&mut sums)
            {
                shares.fill(0.0);
                picks.for_each(receiver, |light, probability| {
                    shares[light as usize] += probability;
                    *sum += probability;
                });
            }
            // One minus a sum is the probability that nothing is picked.
            let mut distance = (sums[1] - sums[0]).abs();
            let [before, after] = &shares;
            for (moved, (before, after)) in moved.iter_mut().zip(before.iter().zip(after)) {
                let apart = (after - before).abs();
                *moved += apart;
                distance += apart;
            }
            (0.5 * distance).min(1.0)
        };
        let distances: Vec<f64> = probes.iter().map(distance).collect();
        (distances, moved)
    });
    let runs: Vec<(Vec<f64>, Vec<f64>)> = runs.collect();
    let distances: Vec<f64> = runs.iter().flat_map(|(distances, _)| distances.clone()).collect();
    let mut moved = vec![0f64; lights];
    for (_, of_run) in &runs {
        moved.iter_mut().zip(of_run).for_each(|(sum, own)| *sum += own);
    }
    let count = probes.len().max(1) as f64;
    moved.iter_mut().for_each(|moved| *moved /= count);
    let worst = distances.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
    let change = PickingChange {
        places,
        probes: probes.len(),
        mean: distances.iter().sum::<f64>() / count,
        worst: worst.map_or(0.0, |(_, &distance)| distance),
        worst_at_m: worst.map_or([0.0; 3], |(at, _)| probes[at].point.to_array()),
    };
    (change, moved)
}
