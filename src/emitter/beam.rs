//! Where along a ray an emitter can shine at all: a point in fog is drawn from there alone.

use super::posed::PosedEmitters;
use super::set::EmitterPlace;
use crate::scene::LightKind;
use glam::Vec3;
use std::f32::consts::FRAC_PI_2;

/// A cone of light: what lies further off its axis than its half angle, seen from its apex, is dark.
#[derive(Clone, Copy, Debug)]
struct Beam {
    apex: Vec3,
    axis: Vec3,
    /// Of the half angle, at most a right one: so the lit part is convex.
    cosine: f32,
}

impl PosedEmitters<'_> {
    /// The part of a stretch of a ray, from 0 to a finite `length` along the unit `direction`, that may
    /// have light from an emitter: within the cone of a spot, in front of a face. `None` if none.
    pub fn lit_part(
        &self,
        emitter: u32,
        origin: Vec3,
        direction: Vec3,
        length: f32,
    ) -> Option<(f32, f32)> {
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
                let beam = Beam {
                    apex: triangle.corners[0],
                    axis: normal.normalize_or_zero(),
                    cosine: 0.0,
                };
                (is_one_sided && beam.axis != Vec3::ZERO).then_some(beam)
            }
            EmitterPlace::Light(row) => {
                let light = &self.scene.lights[row as usize];
                let LightKind::Spot { shaping, .. } = &light.kind else { return None };
                let half_angle = shaping.half_angle_rad();
                (half_angle < FRAC_PI_2).then(|| Beam {
                    apex: self.pose.world(light.node).translation.into(),
                    axis: self.aim(light.node),
                    // A hair wider, for what rounding loses.
                    cosine: (half_angle * (1.0 + 1e-5)).min(FRAC_PI_2).cos().max(0.0),
                })
            }
        }
    }
}

impl Beam {
    /// A convex set meets a line in one stretch; it ends where the quadric of the cone's surface has
    /// a root, or not at all.
    fn lit_part(&self, origin: Vec3, direction: Vec3, length: f32) -> Option<(f32, f32)> {
        let (w, d) = ((origin - self.apex).as_dvec3(), direction.as_dvec3());
        let (axis, cos2) = (self.axis.as_dvec3(), f64::from(self.cosine).powi(2));
        let (da, wa) = (d.dot(axis), w.dot(axis));
        let a = da * da - cos2 * d.length_squared();
        let b = da * wa - cos2 * w.dot(d);
        let c = wa * wa - cos2 * w.length_squared();
        let length = f64::from(length);
        let roots = if cos2 == 0.0 {
            [-wa / da, 0.0]
        } else if a.abs() < 1e-12 {
            [-0.5 * c / b, 0.0]
        } else if b * b > a * c {
            // Without cancellation (Press et al., "Numerical Recipes", section 5.6).
            let q = -(b + (b * b - a * c).sqrt().copysign(b));
            [q / a, c / q]
        } else {
            [0.0; 2]
        };
        let inside = roots.map(|t| if t > 0.0 && t < length { t } else { 0.0 });
        let mut ends = [0.0, inside[0], inside[1], length];
        ends.sort_unstable_by(f64::total_cmp);
        let is_lit = |t: f64| {
            let p = w + t * d;
            p.dot(axis) >= f64::from(self.cosine) * p.length()
        };
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for pair in ends.windows(2).filter(|pair| pair[0] < pair[1]) {
            if is_lit(0.5 * (pair[0] + pair[1])) {
                (from, to) = (from.min(pair[0]), to.max(pair[1]));
            }
        }
        (from < to).then_some((from as f32, to as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1f32..1.0).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn all_that_is_lit_is_in_the_part_and_nothing_else(
            apex in vector(), axis in vector(), angle in prop_oneof![Just(FRAC_PI_2), 0.02f32..1.57],
            origin in vector(), direction in vector(), length in 0.1f32..5.0
        ) {
            prop_assume!(axis.length() > 0.1 && direction.length() > 0.1);
            let (axis, direction) = (axis.normalize(), direction.normalize());
            let cosine = if angle == FRAC_PI_2 { 0.0 } else { angle.cos() };
            let beam = Beam { apex, axis, cosine };
            let part = beam.lit_part(origin, direction, length);
            for i in 0..=200 {
                let t = length * i as f32 / 200.0;
                let off = (origin + t * direction - apex).normalize_or_zero().dot(axis) - cosine;
                let is_in =
                    part.is_some_and(|(from, to)| from - 1e-5 <= t && t <= to + 1e-5);
                prop_assert!(off.abs() < 1e-4 || (off > 0.0) == is_in, "{t}: {off} {part:?}");
            }
        }
    }
}
