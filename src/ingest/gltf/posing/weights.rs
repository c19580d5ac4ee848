//! How far morph targets are applied, where an animation says it.

use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::animation::Track;
use crate::scene::{Keys, Timeline};
use glam::Vec3;

/// How far weights may be apart to be one.
const TOLERANCE: f64 = 1e-6;

/// The weights of a node's morph targets.
pub(in crate::ingest::gltf) struct Weights {
    /// At the first frame.
    pub first: Vec<f32>,
    /// Whether they are ever others.
    pub varies: bool,
}

impl Weights {
    /// Evaluates a track, each of whose values is the weights of all targets, one after the other.
    pub(in crate::ingest::gltf) fn of(
        track: &Track,
        values: &Accessor,
        timeline: Timeline,
    ) -> Weights {
        let mut weights = Weights { first: Vec::with_capacity(track.width), varies: false };
        // Keys are of three numbers each.
        for target in (0..track.width).step_by(3) {
            let number = |row: usize, target: usize| match target < track.width {
                true => values.vector::<1>(row * track.width + target, 0.0)[0],
                false => 0.0,
            };
            let vector =
                |&row: &usize| Vec3::from_array([0, 1, 2].map(|i| number(row, target + i)));
            let keys = Keys {
                times_s: track.times_s.clone(),
                values: track.rows.iter().map(vector).collect(),
                interpolation: track.interpolation,
            };
            let first = keys.at(timeline.seconds_at(timeline.first_frame), timeline).as_vec3();
            weights.first.extend(first.to_array());
            weights.varies |= !keys.is_steady(TOLERANCE);
        }
        weights.first.truncate(track.width);
        weights
    }
}
