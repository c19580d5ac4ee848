//! Emission profiles: how light falls off the axis that it is aimed along.
//!
//! A narrow beam is decided by tiny differences of cosines. Nothing here subtracts cosines: profiles
//! are functions of the angle, in double precision, and hold from 1e-7 rad to pi.

use crate::math::angle::OffAxis;
use crate::math::color::Rgb;
use crate::scene::{IesProfile, LitCone, Scene, Shaping};
use glam::DVec3;
use std::f32::consts::PI;

impl Shaping {
    /// The factor on emission in a direction, but for a [photometric profile](Self::ies).
    ///
    /// `KHR_lights_punctual` ("Inner and Outer Cone Angles") and UsdLux's ShapingAPI (schema of
    /// usd-core 26.11: `focus`, `focusTint`, `cone:angle`, `cone:softness`).
    pub fn factor(&self, off: OffAxis) -> Rgb {
        let theta = off.angle_rad();
        match *self {
            Shaping::Khr { inner_rad, outer_rad } => {
                let (inner, outer) = (f64::from(inner_rad), f64::from(outer_rad));
                let ramp = if theta <= inner {
                    1.0
                } else if theta >= outer {
                    0.0
                } else {
                    cosine_difference(theta, outer) / cosine_difference(inner, outer)
                };
                Rgb::splat((ramp * ramp) as f32)
            }
            Shaping::Usd { cone_rad, softness, focus, focus_tint, .. } => {
                let (cone, softness) = (f64::from(cone_rad), f64::from(softness));
                if theta > cone {
                    return Rgb::ZERO;
                }
                let focused = match f64::from(focus) {
                    focus if focus > 0.0 => (focus * off.ln_abs_cosine()).exp(),
                    _ => 1.0,
                };
                let tint = Rgb::from(focus_tint).lerp(Rgb::ONE, focused as f32);
                let width = cone * softness;
                // Counted from the edge inwards, so that no wide cone hides a narrow ramp.
                let inward = if width > 0.0 { ((cone - theta) / width).min(1.0) } else { 1.0 };
                tint * (inward * inward * (3.0 - 2.0 * inward)) as f32
            }
        }
    }

    /// Its photometric profile, if it has one.
    pub fn ies<'a>(&self, scene: &'a Scene) -> Option<&'a IesProfile> {
        match *self {
            Shaping::Usd { profile: Some(profile), .. } => Some(&scene.profiles[profile as usize]),
            _ => None,
        }
    }

    /// A cone outside which it is dark, in the light's own space: its own, or that of its photometric profile.
    pub fn lit(&self, scene: &Scene) -> LitCone {
        let own = LitCone { axis: DVec3::NEG_Z, half_angle_rad: self.half_angle_rad().into() };
        let ies = self.ies(scene).map(IesProfile::lit);
        ies.filter(|ies| ies.half_angle_rad < own.half_angle_rad).unwrap_or(own)
    }

    /// The half angle beyond which it is dark whatever its photometric profile, radians.
    pub fn half_angle_rad(&self) -> f32 {
        match *self {
            Shaping::Khr { outer_rad, .. } => outer_rad,
            Shaping::Usd { cone_rad, .. } => cone_rad.min(PI),
        }
    }
}

/// `cos a - cos b`, half of it, as a product.
fn cosine_difference(a: f64, b: f64) -> f64 {
    (0.5 * (b + a)).sin() * (0.5 * (b - a)).sin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn off(angle: f64) -> OffAxis {
        OffAxis::between(DVec3::Z, DVec3::new(angle.sin(), 0.0, angle.cos()))
    }

    #[test]
    fn profiles_are_full_on_the_axis_and_dark_outside() {
        let khr = Shaping::Khr { inner_rad: 0.3, outer_rad: 0.6 };
        let usd = Shaping::Usd {
            cone_rad: 0.6,
            softness: 0.5,
            focus: 2.0,
            focus_tint: [0.0; 3],
            profile: None,
        };
        for shaping in [khr, usd] {
            assert!((shaping.factor(off(0.0)) - Rgb::ONE).length() < 1e-6);
            assert_eq!(shaping.factor(off(0.61)), Rgb::ZERO);
            let mut last = 1.0;
            for step in 1..60 {
                let value = shaping.factor(off(f64::from(step) * 0.01)).x;
                assert!(value <= last + 1e-6 && value >= 0.0);
                last = value;
            }
        }
    }

    #[test]
    fn the_khr_ramp_is_the_squared_line_in_the_cosine() {
        let (inner, outer) = (0.2f64, 0.7f64);
        let middle = (0.5 * (inner.cos() + outer.cos())).acos();
        let khr = Shaping::Khr { inner_rad: inner as f32, outer_rad: outer as f32 };
        assert!((khr.factor(off(middle)).x - 0.25).abs() < 1e-5);
    }

    proptest! {
        /// Of small angles the cosine is a parabola, so the ramp is known in closed form.
        #[test]
        fn narrow_spots_keep_their_profile(
            decade in -7f64..-3.0, share in 0f64..1.0, inner_share in 0f64..0.999,
            [a, b, c] in prop::array::uniform3(-3.0..3.0)
        ) {
            let outer = 10f64.powf(decade);
            let (inner_rad, outer_rad) = ((inner_share * outer) as f32, outer as f32);
            let (inner, outer) = (f64::from(inner_rad), f64::from(outer_rad));
            let theta: f64 = inner + share * (outer - inner);
            // As it is met: a beam that points anywhere, a receiver far away.
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, a, b, c);
            let at = turn * DVec3::new(theta.sin(), 0.0, theta.cos()) * 300.0;
            let off = OffAxis::between(turn * DVec3::Z, at);
            let square = |x: f64| x * x;
            let ramp = (square(outer) - square(theta)) / (square(outer) - square(inner));
            let khr = Shaping::Khr { inner_rad, outer_rad }.factor(off).x;
            prop_assert!((f64::from(khr) - square(ramp)).abs() < 1e-5, "{khr} {}", square(ramp));
            let softness = ((outer - inner) / outer) as f32;
            let usd = Shaping::Usd { cone_rad: outer_rad, softness, focus: 0.0, focus_tint: [0.0; 3], profile: None };
            let smooth = 1.0 - share * share * (3.0 - 2.0 * share);
            let usd = usd.factor(off).x;
            prop_assert!((f64::from(usd) - smooth).abs() < 1e-5, "{usd} {smooth}");
        }

        /// A focus that leaves a share of the light at some angle, however small the angle.
        #[test]
        fn a_huge_focus_is_a_narrow_beam(decade in -7.0..0.0, left in 0.01..0.99) {
            let theta = 10f64.powf(decade);
            let ln_cosine = if theta < 1e-3 { -0.5 * theta * theta } else { theta.cos().ln() };
            let focus = (f64::ln(left) / ln_cosine) as f32;
            let usd = Shaping::Usd { cone_rad: PI, softness: 0.0, focus, focus_tint: [0.0; 3], profile: None };
            let value = usd.factor(off(theta)).x;
            prop_assert!((f64::from(value) - left).abs() < 1e-5, "{value} {left}");
        }
    }

    #[test]
    fn a_hard_cone_has_no_penumbra() {
        for angle in [1e-7f32, 1e-4, 0.5, FRAC_PI_2 as f32] {
            let usd = Shaping::Usd {
                cone_rad: angle,
                softness: 0.0,
                focus: 0.0,
                focus_tint: [0.0; 3],
                profile: None,
            };
            // Equal angles are what is left of some files' after rounding.
            let khr = Shaping::Khr { inner_rad: angle, outer_rad: angle };
            for hard in [usd, khr] {
                assert_eq!(hard.factor(off(0.0)), Rgb::ONE);
                assert_eq!(hard.factor(off(f64::from(angle) * (1.0 - 1e-6))), Rgb::ONE);
                assert_eq!(hard.factor(off(f64::from(angle) * (1.0 + 1e-6))), Rgb::ZERO);
            }
        }
        let none = Shaping::Usd {
            cone_rad: 0.0,
            softness: 0.5,
            focus: 0.0,
            focus_tint: [0.0; 3],
            profile: None,
        };
        assert_eq!(none.factor(off(1e-9)), Rgb::ZERO);
        assert!(none.factor(off(0.0)).is_finite());
    }

    #[test]
    fn the_focus_tint_colours_what_focus_dims() {
        let tint = [1.0, 0.0, 0.0];
        let red = |focus| Shaping::Usd {
            cone_rad: PI,
            softness: 0.0,
            focus,
            focus_tint: tint,
            profile: None,
        };
        let off_axis = red(1.0).factor(off(0.25f64.acos()));
        assert!((off_axis - Rgb::new(1.0, 0.25, 0.25)).length() < 1e-6);
        assert_eq!(red(1e9).factor(off(FRAC_PI_2)), Rgb::X);
        assert_eq!(red(0.0).factor(off(FRAC_PI_2)), Rgb::ONE);
    }
}
