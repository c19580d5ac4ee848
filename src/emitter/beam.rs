//! Where along a ray an emitter can shine at all. A point in fog is drawn from that part alone.

use super::posed::PosedEmitters;
use super::set::EmitterPlace;
use crate::math::directions::{aim, light_axes};
use crate::scene::LightKind;
use glam::{DVec3, Vec3};
use std::f64::consts::FRAC_PI_2;

/// A cone of light: what is seen from its apex further off its axis than its half angle is dark.
#[derive(Clone, Copy, Debug)]
struct Beam {
    apex: DVec3,
    /// Unit.
    axis: DVec3,
    /// At most a right angle, so that the lit part is convex.
    half_angle_rad: f64,
}

impl PosedEmitters<'_> {
    /// The part of a stretch of a ray that may have light from an emitter: within the cone of a spot,
    /// in front of a face. The stretch goes from 0 to a finite `length` along `direction`. `None` if
    /// no part has light.
    pub fn lit_part(
        &self,
        emitter: u32,
        origin: DVec3,
        direction: DVec3,
        length: f64,
    ) -> Option<(f64, f64)> {
        match self.beam(emitter) {
            Some(beam) => beam.lit_part(origin, direction, length),
            None => Some((0.0, length)),
        }
    }

    fn beam(&self, emitter: u32) -> Option<Beam> {
        match self.emitters.place_of(emitter) {
            EmitterPlace::Triangle { instance, triangle } => {
                let instance = &self.scene.instances[instance as usize];
                let triangle = self.triangle(instance, triangle);
                let normal = triangle.area_normal() * self.handedness(instance);
                let is_one_sided = !self.material(instance).double_sided;
                let axis = normal.try_normalize().filter(|_| is_one_sided)?;
                let apex = triangle.corners[0].as_dvec3();
                Some(Beam { apex, axis, half_angle_rad: FRAC_PI_2 })
            }
            EmitterPlace::Light(row) => {
                let light = &self.scene.lights[row as usize];
                let LightKind::Spot { shaping, .. } = &light.kind else { return None };
                let lit = shaping.lit(self.scene);
                // A hair wider, for what rounding loses.
                let half_angle_rad = lit.half_angle_rad * (1.0 + 1e-5);
                let world = self.pose.world(light.node);
                let apex = Vec3::from(world.translation).as_dvec3();
                let is_aimed = lit.axis == DVec3::NEG_Z;
                (half_angle_rad < FRAC_PI_2).then(|| Beam {
                    apex,
                    axis: if is_aimed { aim(&world) } else { light_axes(&world) * lit.axis },
                    half_angle_rad,
                })
            }
        }
    }
}

impl Beam {
    /// A convex set meets a line in one stretch. The stretch ends where the line goes through the
    /// surface of the cone, at the roots of a quadratic, or not at all.
    ///
    /// Lengths across the axis are cross products and the discriminant comes from the line's moment
    /// `m` about the apex, `cos^2 (sin^2 |a x m|^2 - cos^2 (a . m)^2)`: nothing cancels in narrow
    /// cones or far away.
    fn lit_part(&self, origin: DVec3, direction: DVec3, length: f64) -> Option<(f64, f64)> {
        let (w, d, axis) = (origin - self.apex, direction, self.axis);
        let (sin, cos) = self.half_angle_rad.sin_cos();
        // A right angle has no cosine, though pi / 2 has one in 64 bits.
        let cos = if self.half_angle_rad < FRAC_PI_2 { cos } else { 0.0 };
        let (along_w, along_d) = (w.dot(axis), d.dot(axis));
        let (across_w, across_d) = (w.cross(axis), d.cross(axis));
        let inside =
            |across: DVec3, along: f64| along >= 0.0 && cos * across.length() <= sin * along;
        let roots = if cos == 0.0 {
            [-along_w / along_d, 0.0]
        } else {
            let (cos2, sin2) = (cos * cos, sin * sin);
            let a = cos2 * across_d.length_squared() - sin2 * along_d * along_d;
            let b = cos2 * across_w.dot(across_d) - sin2 * along_w * along_d;
            let c = cos2 * across_w.length_squared() - sin2 * along_w * along_w;
            let moment = w.cross(d);
            let discriminant = cos2
                * (sin2 * axis.cross(moment).length_squared() - cos2 * axis.dot(moment).powi(2));
            // The stable pair of roots (Press et al., "Numerical Recipes", section 5.6). Where `a` is
            // 0 the first is infinite and drops out. Without roots, the line is nearest the surface
            // there: an end more does no harm, and a line through the apex needs it, whose discriminant
            // is what rounding leaves.
            let q = -(b + discriminant.max(0.0).sqrt().copysign(b));
            [q / a, c / q]
        };
        let within = roots.map(|t| if t > 0.0 && t < length { t } else { 0.0 });
        let mut ends = [0.0, within[0], within[1], length];
        ends.sort_unstable_by(f64::total_cmp);
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for pair in ends.windows(2).filter(|pair| pair[0] < pair[1]) {
            let t = 0.5 * (pair[0] + pair[1]);
            if inside(across_w + t * across_d, along_w + t * along_d) {
                (from, to) = (from.min(pair[0]), to.max(pair[1]));
            }
        }
        (from < to).then_some((from, to))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A ray from far away through the apex of a beam, up to its rounding: lit up to there.
    #[test]
    fn a_ray_through_the_apex_is_lit_on_one_side_of_it() {
        let axis = DVec3::new(0.0, -0.184_972_068_724_901_02, -0.982_743_778_302_172_9);
        let direction = DVec3::new(0.0, 0.574_534_378_502_319_6, 0.818_480_450_541_705_7);
        for exponent in -12..10 {
            for behind in [10f64.powi(exponent), 3.3 * 10f64.powi(exponent)] {
                let beam = Beam { apex: -DVec3::Y, axis, half_angle_rad: 1.0 };
                let off = beam.apex + 2e-16 * DVec3::X - behind * direction;
                let (from, to) = beam.lit_part(off, direction, 3.0 * behind).unwrap();
                let tolerance = 1e-15 * (behind + 1.0);
                assert!(
                    from == 0.0 && (to - behind).abs() <= 1e3 * tolerance,
                    "{behind}: {from} {to}"
                );
            }
        }
    }

    fn unit() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0)
            .prop_map(DVec3::from)
            .prop_filter_map("no direction", |v| (v.length() > 0.1).then(|| v.normalize()))
    }

    proptest! {
        /// Narrow and wide beams, a ray that begins near by or far away and passes near by or far off.
        #[test]
        fn all_that_is_lit_is_in_the_part_and_nothing_else(
            apex in unit(), axis in unit(), toward in unit(), direction in unit(),
            half_angle_rad in prop_oneof![
                Just(FRAC_PI_2), (-7.0..0.19).prop_map(|e| 10f64.powf(e).min(1.57))
            ],
            (ahead, aside, behind) in (-9.0..9.0, -2.0..2.0, -9.0..9.0),
        ) {
            let beam = Beam { apex, axis, half_angle_rad };
            // The ray passes a point that is within the beam or not far outside.
            let ahead = 10f64.powf(ahead);
            let off = toward.reject_from(axis).normalize_or_zero() * aside * half_angle_rad.sin();
            let passed = apex + ahead * (axis + off);
            let behind = 10f64.powf(behind);
            let origin = passed - behind * direction;
            let length = 3.0 * behind;
            let part = beam.lit_part(origin, direction, length);
            for i in 0..=200 {
                // All along, and close about the point that is passed.
                let t = match i % 2 {
                    0 => length * f64::from(i) / 200.0,
                    _ => behind + ahead * half_angle_rad * 0.1 * f64::from(i - 100),
                };
                if !(0.0..=length).contains(&t) {
                    continue;
                }
                let p: DVec3 = passed - apex + (t - behind) * direction;
                let angle = p.cross(axis).length().atan2(p.dot(axis));
                // What the rounding of the origin alone may turn.
                let unsure = 1e-9 * half_angle_rad + 1e-14 * (behind + ahead + 1.0) / p.length();
                let is_in = part.is_some_and(|(from, to)| from <= t && t <= to);
                prop_assert!(
                    (angle - half_angle_rad).abs() <= unsure || (angle < half_angle_rad) == is_in,
                    "{t}: {angle} {part:?}"
                );
            }
        }
    }
}
