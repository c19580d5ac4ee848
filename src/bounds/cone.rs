//! Cones of orientations, and the measure by which the build weighs them.

use crate::math::{Frame, angle};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Bounds where emitters face and how far off their normals they shine.
///
/// Light leaves only in directions within `theta_o + theta_e` of the axis. Sphere and point: any
/// axis, `(pi, pi/2)`. Triangle: its normal, `(0, pi/2)`. Spot: its direction, `(0, outer angle)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Middle of the normals; unit length.
    pub axis: Vec3,
    /// Half angle that contains all normals, radians in `[0, pi]`.
    pub theta_o: f32,
    /// How far off a normal light leaves, radians in `[0, pi/2]`.
    pub theta_e: f32,
    /// Light leaves along `-axis` just as well: a triangle that emits from both sides.
    pub two_sided: bool,
}

impl Cone {
    /// All directions: points and spheres.
    pub const ALL: Cone = Cone { axis: Vec3::Z, theta_o: PI, theta_e: FRAC_PI_2, two_sided: false };

    /// One flat face that emits along its normal, and from its back too if `two_sided`.
    pub fn flat(normal: Vec3, two_sided: bool) -> Cone {
        Cone { axis: normal, theta_o: 0.0, theta_e: FRAC_PI_2, two_sided }
    }

    /// Directions within a half angle of an axis, radians in `[0, pi]`: spots and shaped lights.
    pub fn spot(axis: Vec3, half_angle: f32) -> Cone {
        let theta_e = half_angle.min(FRAC_PI_2);
        Cone { axis, theta_o: half_angle.min(PI) - theta_e, theta_e, two_sided: false }
    }

    /// The smallest cone around two (HPG 2018, Algorithm 1). If either is two-sided, so is the result,
    /// and the sign of an axis has no meaning.
    pub fn union(&self, other: &Cone) -> Cone {
        let (wide, narrow) =
            if self.theta_o >= other.theta_o { (self, other) } else { (other, self) };
        let two_sided = wide.two_sided || narrow.two_sided;
        let theta_e = wide.theta_e.max(narrow.theta_e);
        let flip = two_sided && wide.axis.dot(narrow.axis) < 0.0;
        let towards = if flip { -narrow.axis } else { narrow.axis };
        let theta_d = angle::between(wide.axis, towards);
        if (theta_d + narrow.theta_o).min(PI) <= wide.theta_o {
            return Cone { theta_e, two_sided, ..*wide };
        }
        let theta_o = 0.5 * (wide.theta_o + theta_d + narrow.theta_o);
        if theta_o >= PI {
            return Cone { axis: wide.axis, theta_o: PI, theta_e, two_sided };
        }
        let axis = turn_towards(wide.axis, towards, theta_o - wide.theta_o);
        Cone { axis, theta_o, theta_e, two_sided }
    }

    /// A cone around several, about the mean of their axes. Unlike successive unions, it does not depend
    /// on their order.
    ///
    /// # Panics
    /// If there are none.
    pub fn around(cones: &[Cone]) -> Cone {
        if let [a, b] = cones {
            return a.union(b);
        }
        let two_sided = cones.iter().any(|cone| cone.two_sided);
        let theta_e = cones.iter().map(|cone| cone.theta_e).fold(0.0, f32::max);
        // If they are two-sided, the widest decides which of two opposite axes is taken.
        let widest = cones.iter().max_by(|a, b| a.theta_o.total_cmp(&b.theta_o));
        let first = widest.expect("there is a cone").axis;
        let turned = |cone: &Cone| {
            if two_sided && cone.axis.dot(first) < 0.0 { -cone.axis } else { cone.axis }
        };
        let sum: Vec3 = cones.iter().map(turned).sum();
        let same = cones.iter().all(|cone| turned(cone) == first);
        let Some(axis) = (if same { Some(first) } else { sum.try_normalize() }) else {
            return Cone { axis: first, theta_o: PI, theta_e, two_sided };
        };
        let reach = |cone: &Cone| angle::between(axis, turned(cone)) + cone.theta_o;
        let theta_o = cones.iter().map(reach).fold(0.0, f32::max).min(PI);
        Cone { axis, theta_o, theta_e, two_sided }
    }

    /// What a single emitter sends in the mean over all directions, as a share of its peak: the
    /// [measure](Self::measure) over that of the whole sphere. 1/4 for a flat face, 1 for all directions.
    pub fn share(&self) -> f32 {
        (self.measure() * (0.5 / TAU)).clamp(0.0, 1.0)
    }

    /// How much of the sphere the cone lights, weighted by the cosine beyond `theta_o`: the seed's
    /// `M_omega` in closed form. `pi` for a flat face, `4 pi` for all directions.
    pub fn measure(&self) -> f32 {
        let (theta_o, theta_w) = (self.theta_o, (self.theta_o + self.theta_e).min(PI));
        let (sin_o, cos_o) = theta_o.sin_cos();
        let one_side = TAU * (1.0 - cos_o)
            + FRAC_PI_2
                * (2.0 * theta_w * sin_o - (theta_o - 2.0 * theta_w).cos() - 2.0 * theta_o * sin_o
                    + cos_o);
        if self.two_sided { (2.0 * one_side).min(2.0 * TAU) } else { one_side }
    }
}

/// `from` turned by `by` radians in the plane that holds both; in any plane if they are opposite. In
/// double precision, because nearly opposite axes determine the plane to a few digits only.
fn turn_towards(from: Vec3, to: Vec3, by: f32) -> Vec3 {
    let (from, to) = (from.as_dvec3().normalize(), to.as_dvec3());
    let across = to - from * from.dot(to);
    let across = match across.try_normalize() {
        Some(direction) if across.length_squared() > 1e-12 => direction,
        _ => Frame::around(from.as_vec3()).tangent.as_dvec3(),
    };
    let (sin, cos) = f64::from(by).sin_cos();
    (from * cos + across * sin).normalize().as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_cone() -> impl Strategy<Value = Cone> {
        let unit = (-1.0f32..1.0, 0.0f32..TAU).prop_map(|(z, phi)| {
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * phi.cos(), r * phi.sin(), z)
        });
        let theta_o = prop_oneof![Just(0.0), 0.0f32..PI, Just(PI)];
        (unit, theta_o, 0.01f32..FRAC_PI_2, any::<bool>()).prop_map(
            |(axis, theta_o, theta_e, two_sided)| Cone { axis, theta_o, theta_e, two_sided },
        )
    }

    /// Whether `outer` contains the normals of `inner`, up to rounding.
    fn contains(outer: &Cone, inner: &Cone) -> bool {
        let off = |axis: Vec3| angle::between(outer.axis, axis) + inner.theta_o;
        let nearest =
            if outer.two_sided { off(inner.axis).min(off(-inner.axis)) } else { off(inner.axis) };
        outer.theta_o >= PI || nearest <= outer.theta_o + 2e-6
    }

    proptest! {
        #[test]
        fn a_union_contains_both(a in any_cone(), b in any_cone()) {
            let union = a.union(&b);
            prop_assert!(union.axis.is_normalized());
            prop_assert!(contains(&union, &a) && contains(&union, &b), "{union:?}");
            prop_assert!(union.theta_e >= a.theta_e.max(b.theta_e));
        }

        #[test]
        fn a_cone_around_some_contains_each(cones in prop::collection::vec(any_cone(), 1..9)) {
            let around = Cone::around(&cones);
            prop_assert!(cones.iter().all(|cone| contains(&around, cone)), "{around:?}");
        }

        #[test]
        fn a_measure_grows_with_the_cone_and_stays_below_the_sphere(a in any_cone(), b in any_cone()) {
            let union = a.union(&b);
            prop_assert!(union.measure() >= a.measure() * (1.0 - 1e-4));
            prop_assert!(union.measure() <= 4.0 * PI * (1.0 + 1e-5) && a.measure() > 0.0);
        }
    }

    #[test]
    fn the_measure_equals_the_seeds_integral() {
        assert!((Cone::flat(Vec3::Z, false).measure() - PI).abs() < 1e-5);
        assert!((Cone::ALL.measure() - 4.0 * PI).abs() < 1e-5);
        for (theta_o, theta_e) in [(0.3_f64, 0.4), (1.0, 1.5), (2.5, 1.5), (0.0, 0.2), (3.0, 0.1)] {
            let end = (theta_o + theta_e).min(std::f64::consts::PI);
            let steps = 100_000;
            let width = (end - theta_o) / f64::from(steps);
            let integral: f64 = (0..steps)
                .map(|i| theta_o + (f64::from(i) + 0.5) * width)
                .map(|omega| (omega - theta_o).cos() * omega.sin() * width)
                .sum();
            let expected = std::f64::consts::TAU * (1.0 - theta_o.cos() + integral);
            let cone = Cone { theta_o: theta_o as f32, theta_e: theta_e as f32, ..Cone::ALL };
            assert!((f64::from(cone.measure()) - expected).abs() < 1e-4, "{theta_o} {theta_e}");
        }
    }

    #[test]
    fn nearly_opposite_axes_have_a_union() {
        for i in 0..200 {
            let (tilt, turn) = (10f32.powf(-1.0 - i as f32 * 0.03), i as f32);
            let axis = Vec3::new(turn.cos(), 0.3, turn.sin()).normalize();
            let away = (-axis + tilt * Frame::around(axis).tangent).normalize();
            let (a, b) = (Cone::flat(axis, false), Cone::flat(away, false));
            let union = a.union(&b);
            assert!(contains(&union, &a) && contains(&union, &b), "{tilt}: {union:?}");
        }
    }

    #[test]
    fn opposite_and_equal_axes_have_a_union() {
        let (up, down) = (Cone::flat(Vec3::Z, false), Cone::flat(-Vec3::Z, false));
        let union = up.union(&down);
        assert!((union.theta_o - FRAC_PI_2).abs() < 1e-6 && union.axis.is_normalized());
        assert_eq!(up.union(&up), up);
        let sheet = Cone::flat(Vec3::Z, true).union(&Cone::flat(-Vec3::Z, true));
        assert_eq!(sheet.theta_o, 0.0);
    }
}
