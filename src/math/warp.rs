//! Maps of the unit square onto the shapes that lights and lobes are sampled from.
//!
//! Each map keeps area up to a constant. Its density stands beside it.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, TAU};

/// The unit disk, concentric (Shirley and Chiu 1997). Density 1/pi.
#[inline]
pub fn disk(u: Vec2) -> Vec2 {
    let offset = 2.0 * u - Vec2::ONE;
    if offset == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if offset.x.abs() > offset.y.abs() {
        (offset.x, FRAC_PI_4 * (offset.y / offset.x))
    } else {
        (offset.y, FRAC_PI_2 - FRAC_PI_4 * (offset.x / offset.y))
    };
    radius * Vec2::new(angle.cos(), angle.sin())
}

/// The hemisphere about +Z by the cosine. Density [`cosine_hemisphere_pdf`].
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] over solid angle, 1/sr.
#[inline]
pub fn cosine_hemisphere_pdf(cosine: f32) -> f32 {
    cosine.max(0.0) * FRAC_1_PI
}

/// The whole sphere, evenly. Density 1/(4 pi).
#[inline]
pub fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    // Not `1 - z^2`, which cancels near the poles.
    let radius = 2.0 * (u.x * (1.0 - u.x)).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(radius * cos, radius * sin, z)
}

/// The cap of directions about +Z whose `1 - cos` is at most `one_minus_cos_max`, evenly. Density
/// [`cone_pdf`]. `1 - cos` keeps its digits in caps of 1e-4 rad and less, where `cos` is 1.
#[inline]
pub fn cone(u: Vec2, one_minus_cos_max: f32) -> Vec3 {
    let one_minus_cos = u.x * one_minus_cos_max;
    let sine = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(sine * cos, sine * sin, 1.0 - one_minus_cos)
}

/// Density of [`cone`] over solid angle, 1/sr.
#[inline]
pub fn cone_pdf(one_minus_cos_max: f32) -> f32 {
    1.0 / (TAU * one_minus_cos_max)
}

/// Barycentric coordinates of the second and third corner of a triangle, evenly over its area
/// (Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
#[inline]
pub fn triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let x = 0.5 * u.x;
        Vec2::new(x, u.y - x)
    } else {
        let y = 0.5 * u.y;
        Vec2::new(u.x - y, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of `f` over a grid of the unit square.
    fn mean(f: impl Fn(Vec2) -> f32) -> f32 {
        let n = 256;
        let cell = |i: usize| (i as f32 + 0.5) / n as f32;
        let sum: f64 = (0..n * n).map(|i| f64::from(f(Vec2::new(cell(i % n), cell(i / n))))).sum();
        (sum / (n * n) as f64) as f32
    }

    #[test]
    fn moments_match_their_closed_forms() {
        assert!((mean(|u| disk(u).length_squared()) - 0.5).abs() < 1e-3);
        assert!((mean(|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 1e-3);
        assert!(mean(|u| sphere(u).z).abs() < 1e-5);
        assert!((mean(|u| sphere(u).z.powi(2)) - 1.0 / 3.0).abs() < 1e-3);
        assert!((mean(|u| cone(u, 0.5).z) - 0.75).abs() < 1e-4);
        assert!((mean(|u| triangle(u).x) - 1.0 / 3.0).abs() < 1e-3);
        assert!((mean(|u| triangle(u).x * triangle(u).y) - 1.0 / 12.0).abs() < 1e-3);
    }

    #[test]
    fn cones_of_every_width_stay_inside_themselves_and_are_even() {
        for decade in -18..=0 {
            let angle = 3.0 * 10f64.powi(decade);
            let cap = (2.0 * (angle / 2.0).sin().powi(2)) as f32;
            for i in 0..=100 {
                let direction = cone(Vec2::new(i as f32 / 100.0, 0.3), cap).as_dvec3();
                let off = direction.truncate().length().atan2(direction.z);
                // Even: `1 - cos` grows with the first number.
                let expected = (f64::from(i) / 100.0).sqrt() * (angle / 2.0).sin();
                assert!(((off / 2.0).sin() / expected - 1.0).abs() < 1e-4 || i == 0, "{off}");
            }
        }
    }

    #[test]
    fn directions_keep_their_angle_to_the_pole() {
        for decade in 0..24 {
            let u = 0.9 * 0.5f32.powi(decade);
            for (direction, side) in
                [(sphere(Vec2::new(u, 0.3)), 1.0), (sphere(Vec2::new(1.0 - u, 0.3)), -1.0)]
            {
                let share = if side > 0.0 { f64::from(u) } else { f64::from(1.0 - (1.0 - u)) };
                let across = direction.truncate().as_dvec2().length();
                let expected = 2.0 * (share * (1.0 - share)).sqrt();
                assert!((across / expected - 1.0).abs() < 1e-6, "{u} {across} {expected}");
                assert!((direction.length() - 1.0).abs() < 1e-6);
            }
        }
    }
}
