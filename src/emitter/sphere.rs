//! Sampling a sphere as seen from a point outside: evenly over the cone that it fills.

use crate::math::{Frame, warp};
use glam::{Vec2, Vec3};

/// A sphere in world space. It emits outwards; from inside it is dark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldSphere {
    /// Metres.
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
}

/// A direction towards a sphere.
#[derive(Clone, Copy, Debug)]
pub struct SphereSample {
    /// Unit, from the viewer.
    pub direction: Vec3,
    /// To the nearer surface, metres.
    pub distance: f32,
    /// Density over solid angle, 1/sr.
    pub pdf: f32,
}

impl WorldSphere {
    /// `1 - cos` of the half angle under which the sphere is seen; `None` from inside.
    fn one_minus_cos_max(&self, from: Vec3) -> Option<f32> {
        let d2 = (self.center - from).as_dvec3().length_squared();
        let sin2 = f64::from(self.radius).powi(2) / d2;
        // (1 - cos) = sin^2 / (1 + cos): no cancellation for far spheres.
        (sin2 < 1.0).then(|| (sin2 / (1.0 + (1.0 - sin2).sqrt())) as f32)
    }

    /// A direction towards the sphere; `None` from inside.
    pub fn sample(&self, from: Vec3, u: Vec2) -> Option<SphereSample> {
        let cap = self.one_minus_cos_max(from)?;
        let to_center = self.center - from;
        let d = to_center.length();
        let local = warp::cone(u, cap);
        let direction = Frame::around(to_center / d).to_outer(local);
        // Chord geometry; beyond the rim by rounding the ray grazes at the tangent's length.
        let sine2 = local.truncate().length_squared();
        let half_chord = (self.radius * self.radius - d * d * sine2).max(0.0).sqrt();
        let distance = d * local.z - half_chord;
        let pdf = warp::cone_pdf(cap);
        (pdf.is_finite() && distance > 0.0).then_some(SphereSample { direction, distance, pdf })
    }

    /// The density over solid angle of any direction that hits the sphere; 0 from inside.
    pub fn pdf(&self, from: Vec3) -> f32 {
        self.one_minus_cos_max(from).map_or(0.0, warp::cone_pdf)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    #[test]
    fn irradiance_is_that_of_a_sphere() {
        for (distance, radius) in [(2.0f32, 1.0f32), (1.01, 1.0), (100.0, 0.1), (1e4, 1e-3)] {
            let sphere = WorldSphere { center: Vec3::Z * distance, radius };
            let n = 64;
            let cell = |i: usize| (i as f32 + 0.5) / n as f32;
            let estimate = |i: usize| {
                let s = sphere.sample(Vec3::ZERO, Vec2::new(cell(i % n), cell(i / n))).unwrap();
                let hit = s.direction * s.distance;
                let off = ((hit - sphere.center).length() - radius).abs();
                assert!(off <= 1e-3 * radius + 1e-6 * distance, "{off}");
                s.direction.z / s.pdf
            };
            let mean = (0..n * n).map(estimate).sum::<f32>() / (n * n) as f32;
            let exact = PI * (radius / distance).powi(2);
            assert!((mean / exact - 1.0).abs() < 1e-3, "{mean} {exact}");
            assert_eq!(sphere.pdf(Vec3::ZERO), sphere.sample(Vec3::ZERO, Vec2::ZERO).unwrap().pdf);
        }
    }

    #[test]
    fn from_inside_it_is_dark() {
        let sphere = WorldSphere { center: Vec3::ZERO, radius: 1.0 };
        assert!(sphere.sample(Vec3::X * 0.5, Vec2::splat(0.5)).is_none());
        assert_eq!(sphere.pdf(Vec3::X * 0.5), 0.0);
    }
}
