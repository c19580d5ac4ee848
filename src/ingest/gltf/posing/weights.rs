//! How far morph targets are applied, where an animation says it.

use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::animation::Track;
use crate::scene::{Interpolation, Keys, Timeline};
use glam::Vec3;
use std::sync::Arc;

/// How far weights may be apart to be one.
const TOLERANCE: f64 = 1e-6;

/// The weights of a node's morph targets.
pub(in crate::ingest::gltf) struct Weights {
    /// At the first frame.
    pub first: Vec<f32>,
    /// By threes; empty if they are the same at all times.
    pub keys: Arc<[Keys<Vec3>]>,
}

impl Weights {
    /// Evaluates a track, each of whose values is the weights of all targets, one after the other.
    pub(in crate::ingest::gltf) fn of(
        track: &Track,
        values: &Accessor,
        timeline: Timeline,
    ) -> Weights {
        let number = |row: usize, target: usize| match target < track.width {
            true => values.vector::<1>(row * track.width + target, 0.0)[0],
            false => 0.0,
        };
        // Keys are of three numbers each.
        let three = |target: usize| {
            let vector =
                |&row: &usize| Vec3::from_array([0, 1, 2].map(|i| number(row, target + i)));
            Keys {
                times_s: track.times_s.clone(),
                values: track.rows.iter().map(vector).collect(),
                interpolation: track.interpolation,
            }
        };
        let mut keys: Vec<Keys<Vec3>> = (0..track.width).step_by(3).map(three).collect();
        let first_s = timeline.seconds_at(timeline.first_frame);
        let first = keys.iter().flat_map(|keys| keys.at(first_s, timeline).as_vec3().to_array());
        let first = first.take(track.width).collect();
        if keys.iter().all(|keys| keys.is_steady(TOLERANCE)) {
            keys.clear();
        }
        Weights { first, keys: keys.into() }
    }
}

/// Weights that never change, by threes.
pub(super) fn constant(weights: &[f32]) -> Arc<[Keys<Vec3>]> {
    let keys = |three: &[f32]| {
        let number = |i: usize| three.get(i).copied().unwrap_or(0.0);
        let values = vec![Vec3::new(number(0), number(1), number(2))];
        Keys { times_s: vec![0.0], values, interpolation: Interpolation::Step }
    };
    weights.chunks(3).map(keys).collect()
}
