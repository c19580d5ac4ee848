//! How far the probabilities of picks moved.
//!
//! At a probe, either version picks one light: each has a probability. How far apart two such
//! distributions are is their *total variation distance*, half the sum of all `|p_before - p_after|`:
//! the share of picks that go to another light. 0 if they are equal, 1 if they have no light in
//! common. Lights are matched as everywhere, so a light that was only renamed is the same. That
//! nothing can be picked counts as a light of its own. Forced lights, which are never picked, do not
//! count. Exact: both trees are walked whole.

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
