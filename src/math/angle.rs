//! Angles that stay accurate at their ends.

use glam::Vec3;

/// The angle between two unit vectors, in `[0, pi]`, accurate near both ends, where `acos` of a
/// dot product loses half the digits (Kahan, "How Futile are Mindless Assessments of Roundoff").
#[inline]
pub fn between(a: Vec3, b: Vec3) -> f32 {
    2.0 * (a - b).length().atan2((a + b).length())
}

/// `acos` of a number that rounding may have carried past +-1.
#[inline]
pub fn acos_clamped(cosine: f32) -> f32 {
    cosine.clamp(-1.0, 1.0).acos()
}

/// `sqrt` that takes the tiny negative numbers rounding leaves for zero.
#[inline]
pub fn sqrt_clamped(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_angles_keep_their_digits() {
        let tiny = 1e-4_f32;
        let tilted = Vec3::new(tiny.sin(), 0.0, tiny.cos());
        assert!((between(Vec3::Z, tilted) / tiny - 1.0).abs() < 1e-3);
        assert!((between(Vec3::Z, -tilted) - (std::f32::consts::PI - tiny)).abs() < 1e-6);
        assert_eq!(between(Vec3::X, Vec3::X), 0.0);
    }
}
