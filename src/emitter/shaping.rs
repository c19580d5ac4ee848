//! Emission profiles: how light falls off the axis it is aimed along.

use crate::math::color::Rgb;
use crate::scene::Shaping;
use std::f32::consts::PI;

impl Shaping {
    /// The factor on emission in a direction, by the cosine of its angle off the axis.
    ///
    /// `KHR_lights_punctual` ("Inner and Outer Cone Angles") and UsdLux's ShapingAPI (schema of
    /// usd-core 26.11: `focus`, `focusTint`, `cone:angle`, `cone:softness`).
    pub fn factor(&self, cosine: f32) -> Rgb {
        match *self {
            Shaping::Khr { inner_rad, outer_rad } => {
                let (inner, outer) = (inner_rad.cos(), outer_rad.cos());
                let ramp = ((cosine - outer) / (inner - outer).max(1e-3)).clamp(0.0, 1.0);
                Rgb::splat(ramp * ramp)
            }
            Shaping::Usd { cone_rad, softness, focus, focus_tint } => {
                let theta = cosine.clamp(-1.0, 1.0).acos();
                if theta > cone_rad {
                    return Rgb::ZERO;
                }
                let focused = cosine.abs().powf(focus.max(0.0));
                let tint = Rgb::from(focus_tint).lerp(Rgb::ONE, focused);
                tint * (1.0 - smoothstep(cone_rad * (1.0 - softness), cone_rad, theta))
            }
        }
    }

    /// The half angle beyond which it is dark, radians.
    pub fn half_angle_rad(&self) -> f32 {
        match *self {
            Shaping::Khr { outer_rad, .. } => outer_rad,
            Shaping::Usd { cone_rad, .. } => cone_rad.min(PI),
        }
    }
}

fn smoothstep(start: f32, end: f32, x: f32) -> f32 {
    if start >= end {
        return 0.0;
    }
    let t = ((x - start) / (end - start)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_full_on_the_axis_and_dark_outside() {
        let khr = Shaping::Khr { inner_rad: 0.3, outer_rad: 0.6 };
        let usd = Shaping::Usd { cone_rad: 0.6, softness: 0.5, focus: 2.0, focus_tint: [0.0; 3] };
        for shaping in [khr, usd] {
            assert!((shaping.factor(1.0) - Rgb::ONE).length() < 1e-6);
            assert_eq!(shaping.factor(0.61f32.cos()), Rgb::ZERO);
            let mut last = 1.0;
            for step in 1..60 {
                let value = shaping.factor((step as f32 * 0.01).cos()).x;
                assert!(value <= last + 1e-6 && value >= 0.0);
                last = value;
            }
        }
    }

    #[test]
    fn the_khr_ramp_is_the_squared_line_in_the_cosine() {
        let (inner, outer) = (0.2f32, 0.7f32);
        let middle = 0.5 * (inner.cos() + outer.cos());
        let value = Shaping::Khr { inner_rad: inner, outer_rad: outer }.factor(middle).x;
        assert!((value - 0.25).abs() < 1e-5);
    }

    #[test]
    fn a_hard_usd_cone_has_no_penumbra() {
        let hard = Shaping::Usd { cone_rad: 0.5, softness: 0.0, focus: 0.0, focus_tint: [0.0; 3] };
        assert_eq!(hard.factor(0.499f32.cos()), Rgb::ONE);
    }

    #[test]
    fn the_focus_tint_colours_what_focus_dims() {
        let tint = [1.0, 0.0, 0.0];
        let red = Shaping::Usd { cone_rad: PI, softness: 0.0, focus: 1.0, focus_tint: tint };
        let off_axis = red.factor(0.25);
        assert!((off_axis - Rgb::new(1.0, 0.25, 0.25)).length() < 1e-6);
    }
}
