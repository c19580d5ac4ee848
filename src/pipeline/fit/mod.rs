//! A view of a whole scene, for scenes without a camera.
//!
//! The view is a function of the scene and of the picture's aspect alone. It does not depend on the
//! frames that a process renders, so every chunk of a shot sees the same: what moves is framed
//! wherever it is throughout the scene's own frames.
//!
//! Three steps. [`Subject`] finds what the picture should show: it leaves out stray vertices, things
//! far from all others, and what surrounds the rest, such as a ground or a sky. [`Sketch`] samples the
//! surfaces and finds which sides of them light reaches. Then views are tried ([`sight`]): three
//! quarters from the front and a little above, as viewers do, and others around, above and, for closed
//! rooms, inside. Each is tried by how much of the lit surface it sees, times how much people like such
//! a view.

mod sight;
mod sketch;
mod subject;

use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use sight::Sight;
use sketch::Sketch;
use std::fmt;
use subject::Subject;

/// The vertical field of view of a view from outside, and of one that the user places, degrees.
pub(super) const YFOV_DEG: f64 = 40.0;
/// That of a view from inside a room.
const YFOV_INSIDE_DEG: f64 = 60.0;

/// A view of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitted {
    /// Where the eye is, in the file's world, metres.
    pub from: DVec3,
    /// What is in the middle of the picture, in the file's world, metres.
    pub at: DVec3,
    /// Full vertical field of view, radians.
    pub yfov_rad: f64,
}

/// As the options that mean this view, with digits enough for a pixel.
impl fmt::Display for Fitted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let decimals =
            (4.0 - self.from.distance(self.at).log10().floor()).clamp(0.0, 24.0) as usize;
        let point = |p: DVec3| p.to_array().map(|x| format!("{x:.decimals$}")).join(",");
        let fov = format!("{:.3}", self.yfov_rad.to_degrees());
        let fov = fov.trim_end_matches('0').trim_end_matches('.');
        let (from, at) = (point(self.from), point(self.at));
        write!(f, "--look-from {from} --look-at {at} --fov {fov}")
    }
}

/// The view that shows most of a scene, in a picture of some aspect. A field of view that is given
/// is kept, and only views from outside are tried with it.
pub(super) fn fit(scene: &Scene, aspect: f64, yfov_rad: Option<f64>) -> Fitted {
    let subject = Subject::of(scene);
    let sketch = Sketch::of(scene, &subject);
    let outside = yfov_rad.unwrap_or(YFOV_DEG.to_radians());
    let mut sights = sight::around(&subject, outside, aspect);
    // What no light reaches anywhere looks more like a thing from outside than like a room.
    if yfov_rad.is_none() && sketch.has_light() {
        sights.extend(sight::inside(&subject, YFOV_INSIDE_DEG.to_radians(), aspect));
    }
    let score = |sight: &Sight| sight.liking * sketch.seen_from(sight);
    let scores: Vec<f64> = sights.par_iter().map(score).collect();
    // Of equals the first, which is liked most.
    let mut best = 0;
    for (number, score) in scores.iter().enumerate() {
        if *score > scores[best] {
            best = number;
        }
    }
    let Sight { from, at, yfov_rad, .. } = sights[best];
    Fitted { from: from + scene.origin, at: at + scene.origin, yfov_rad }
}

/// The middle of what a picture of the scene should show, in the file's world, metres.
pub(super) fn middle(scene: &Scene) -> DVec3 {
    Subject::of(scene).middle() + scene.origin
}
