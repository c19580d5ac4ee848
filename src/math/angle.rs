//! Angles that are accurate near 0 and near pi.

use glam::{DVec3, Vec3};

/// The angle between two unit vectors, radians in `[0, pi]`. It keeps its digits near both ends, where
/// `acos` of a dot product loses half of them (Kahan, "How Futile are Mindless Assessments of
/// Roundoff").
#[inline]
pub fn between(a: Vec3, b: Vec3) -> f32 {
    2.0 * (a - b).length().atan2((a + b).length())
}

/// How far a direction is off an axis. The sine comes from the part of the direction across the axis
/// and not from the cosine, so that angles of 1e-7 keep their digits as well as right ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffAxis {
    /// Both times the same length.
    sine: f64,
    cosine: f64,
}

impl OffAxis {
    /// Between two vectors of any length but zero.
    #[inline]
    pub fn between(axis: DVec3, direction: DVec3) -> OffAxis {
        OffAxis { sine: axis.cross(direction).length(), cosine: axis.dot(direction) }
    }

    /// The angle, radians in `[0, pi]`.
    #[inline]
    pub fn angle_rad(self) -> f64 {
        self.sine.atan2(self.cosine)
    }

    /// The logarithm of the absolute cosine; without end at a right angle.
    #[inline]
    pub fn ln_abs_cosine(self) -> f64 {
        let (sine2, cosine2) = (self.sine * self.sine, self.cosine * self.cosine);
        let length2 = sine2 + cosine2;
        if sine2 < cosine2 {
            0.5 * (-sine2 / length2).ln_1p()
        } else {
            0.5 * (cosine2 / length2).ln()
        }
    }
}

/// `acos` of a number that rounding may have carried past +-1.
#[inline]
pub fn acos_clamped(cosine: f32) -> f32 {
    cosine.clamp(-1.0, 1.0).acos()
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

    #[test]
    fn angles_off_an_axis_of_any_length_are_exact_from_1e9th_of_a_radian_to_pi() {
        for i in 0..=400 {
            let small = 10f64.powf(-9.0 + 9.0 * f64::from(i) / 400.0);
            let length = 10f64.powf(-20.0 + f64::from(i) / 10.0);
            for (angle, ln) in [
                (small, small.cos().abs().ln()),
                (std::f64::consts::PI - small, small.cos().abs().ln()),
                (std::f64::consts::FRAC_PI_2 - small, small.sin().ln()),
            ] {
                let direction = DVec3::new(angle.sin(), 0.0, angle.cos()) * length;
                let off = OffAxis::between(DVec3::Z / length, direction);
                assert!((off.angle_rad() - angle).abs() <= 4e-16 * (1.0 + angle), "{angle}");
                // Of small angles, -angle^2 / 2.
                let ln = if angle < 1e-4 { -0.5 * angle * angle } else { ln };
                if angle < 1.57 {
                    assert!((off.ln_abs_cosine() / ln - 1.0).abs() < 1e-6, "{angle} {ln}");
                }
            }
        }
    }
}
