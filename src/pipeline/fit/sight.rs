//! Views that are tried.

use super::subject::Subject;
use glam::{DVec2, DVec3};

/// The picture's part, from the middle to the edge, that the subject fills.
const FILLED: f64 = 0.92;

/// A view, with +Y up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// World space, metres.
    pub from: DVec3,
    /// World space, metres; not where `from` is.
    pub at: DVec3,
    /// Full vertical field of view, radians.
    pub yfov_rad: f64,
    /// Slopes of the rays at the picture's right and upper edge.
    pub slope: DVec2,
    /// How much people like such a view, in (0, 1].
    pub liking: f64,
}

/// From the front is azimuth 0, from the right is 90; elevation is above the horizon. Degrees.
const AROUND: [(f64, f64, f64); 23] = [
    (30.0, 20.0, 1.0),
    (-30.0, 20.0, 0.97),
    (0.0, 15.0, 0.93),
    (0.0, 0.0, 0.9),
    (60.0, 20.0, 0.85),
    (-60.0, 20.0, 0.84),
    (30.0, 45.0, 0.8),
    (-30.0, 45.0, 0.79),
    (150.0, 20.0, 0.75),
    (-150.0, 20.0, 0.74),
    (90.0, 15.0, 0.72),
    (-90.0, 15.0, 0.71),
    (180.0, 15.0, 0.7),
    (90.0, 0.0, 0.7),
    (-90.0, 0.0, 0.69),
    (180.0, 0.0, 0.68),
    (150.0, 45.0, 0.65),
    (-150.0, 45.0, 0.64),
    (30.0, -20.0, 0.6),
    (-30.0, -20.0, 0.59),
    (150.0, -20.0, 0.55),
    (0.0, 89.0, 0.5),
    (0.0, -89.0, 0.4),
];

/// How much a view from inside is liked.
const INSIDE: f64 = 0.7;

/// Views from outside that have the whole subject in the picture, and no larger a view than that takes.
pub(super) fn around(subject: &Subject, yfov_rad: f64, aspect: f64) -> Vec<Sight> {
    let slope = slope_of(yfov_rad, aspect);
    let views = AROUND.iter().map(|&(azimuth, elevation, liking)| {
        // Nothing but a sky is looked at level.
        let elevation: f64 = if subject.is_nowhere() { 0.0 } else { elevation };
        let back = direction(azimuth.to_radians(), elevation.to_radians());
        let (from, at) = framing(subject, back, slope * FILLED);
        Sight { from, at, yfov_rad, slope, liking }
    });
    views.collect()
}

/// Views from inside: from the sides and corners of the subject's box across it.
pub(super) fn inside(subject: &Subject, yfov_rad: f64, aspect: f64) -> Vec<Sight> {
    let slope = slope_of(yfov_rad, aspect);
    let half = 0.5 * subject.bounds.extent().as_dvec3();
    if half.min_element() <= 0.0 {
        return Vec::new();
    }
    let views = (0..8).map(|eighth| {
        let toward = direction(f64::from(eighth) * 45f64.to_radians(), 0.0);
        // As far as the box goes that way, and a little less.
        let reach = (half.x / toward.x.abs()).min(half.z / toward.z.abs());
        let from = subject.middle() + toward * (0.9 * reach) + DVec3::Y * (0.1 * half.y);
        Sight { from, at: subject.middle(), yfov_rad, slope, liking: INSIDE }
    });
    views.collect()
}

fn slope_of(yfov_rad: f64, aspect: f64) -> DVec2 {
    let up = (0.5 * yfov_rad).tan();
    DVec2::new(up * aspect, up)
}

/// The unit vector to the eye.
fn direction(azimuth_rad: f64, elevation_rad: f64) -> DVec3 {
    let (sin, cos) = elevation_rad.sin_cos();
    DVec3::new(cos * azimuth_rad.sin(), sin, cos * azimuth_rad.cos())
}

/// Where the eye is nearest and sees all points, and the point that it looks at. Each edge of the
/// picture is a plane through the eye; that plane has all points on one side of it and, of two opposite
/// edges, the closer pair touches some.
fn framing(subject: &Subject, back: DVec3, slope: DVec2) -> (DVec3, DVec3) {
    let middle = subject.middle();
    let [right, up] = axes(back);
    // Largest of `z`, and of `s z + x` and `s z - x` for either edge.
    let mut front = f64::NEG_INFINITY;
    let (mut to_right, mut to_left) = (DVec2::NEG_INFINITY, DVec2::NEG_INFINITY);
    for point in &subject.points {
        let (across, depth) = (
            DVec2::new((*point - middle).dot(right), (*point - middle).dot(up)),
            (*point - middle).dot(back),
        );
        front = front.max(depth);
        to_right = to_right.max(slope * depth + across);
        to_left = to_left.max(slope * depth - across);
    }
    let place = 0.5 * (to_right - to_left);
    let away = (0.5 * (to_right + to_left) / slope).max_element();
    // Off the nearest point, if only by a little; from a single point, so far that its surroundings show.
    let room = if subject.is_point() { 1.0 } else { 0.01 };
    let away = away.max(front + room * subject.radius_m() / slope.min_element());
    let at = middle + right * place.x + up * place.y;
    (at + back * away, at)
}

/// The axes of a picture to the right and up.
pub(super) fn axes(back: DVec3) -> [DVec3; 2] {
    let right = DVec3::Y.cross(back).normalize_or(DVec3::X);
    [right, back.cross(right)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::Aabb;

    fn subject(points: Vec<DVec3>) -> Subject {
        let bounds = Aabb::around(points.iter().map(|point| point.as_vec3()));
        Subject { points, bounds, shown: Vec::new(), reaches: Vec::new() }
    }

    /// Whatever the shape, the size and the aspect: all is inside, and one edge is touched.
    #[test]
    fn all_is_in_the_picture_and_fills_it() {
        for scale in [1e-6, 1.0, 1e7] {
            let points: Vec<DVec3> =
                [[3.0, 0.1, -2.0], [-1.0, 2.0, 0.5], [0.0, -0.7, 4.0], [0.0; 3]]
                    .map(|point| DVec3::from(point) * scale + DVec3::new(0.0, 5.0, -3.0) * scale)
                    .into();
            let subject = subject(points);
            for aspect in [0.1, 1.0, 16.0 / 9.0, 10.0] {
                for sight in around(&subject, 0.7, aspect) {
                    let back = (sight.from - sight.at).normalize();
                    let [right, up] = axes(back);
                    let mut fullest: f64 = 0.0;
                    for &point in &subject.points {
                        let to = point - sight.from;
                        let depth = -to.dot(back);
                        let across = DVec2::new(to.dot(right), to.dot(up)) / (depth * sight.slope);
                        assert!(depth > 0.0, "{sight:?}");
                        fullest = fullest.max(across.abs().max_element());
                    }
                    assert!(fullest <= FILLED + 1e-6, "{fullest} of {sight:?}");
                    // Less only where the eye would be in the nearest point.
                    assert!(fullest >= FILLED - 0.1, "{fullest} of {sight:?}");
                }
            }
        }
    }

    #[test]
    fn a_point_and_nothing_have_views_too() {
        for points in [vec![DVec3::ZERO], vec![DVec3::new(1e6, -2.0, 3.0)]] {
            let subject = subject(points);
            for sight in around(&subject, 0.7, 1.5) {
                assert!(sight.from.is_finite() && sight.from.distance(sight.at) > 0.1, "{sight:?}");
            }
            assert!(inside(&subject, 1.0, 1.5).is_empty());
        }
    }
}
