//! Sampling a sphere as seen from a point outside: evenly over the cone that it fills.
//!
//! Distances may be 1e9 radii or a millionth of a radius: all of this is in double precision and no
//! step subtracts nearly equal numbers but the two positions.

use crate::math::warp;
use glam::{DVec3, Vec2, Vec3};

/// A sphere in world space. It emits outwards; from inside it is dark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldSphere {
    /// Metres.
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
}

/// A point of a sphere, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub struct SphereSample {
    /// Unit, from the viewer.
    pub direction: Vec3,
    /// On the surface, world space, metres.
    pub point: Vec3,
    /// Unit, outwards.
    pub normal: Vec3,
    /// Density over solid angle, 1/sr.
    pub pdf: f32,
}

/// A sphere as a viewer outside sees it.
struct View {
    to_center: DVec3,
    distance: f64,
    /// Squared length of a tangent from the viewer, m^2.
    tangent2: f64,
    /// `1 - cos` of the half angle that it fills.
    cap: f64,
}

impl WorldSphere {
    /// `None` from inside.
    fn view(&self, from: Vec3) -> Option<View> {
        let to_center = self.center.as_dvec3() - from.as_dvec3();
        let (distance, radius) = (to_center.length(), f64::from(self.radius));
        let tangent2 = (distance - radius) * (distance + radius);
        // 1 - cos = sin^2 / (1 + cos), which does not cancel for far spheres.
        let cosine = tangent2.max(0.0).sqrt() / distance;
        let cap = (radius / distance).powi(2) / (1.0 + cosine);
        (tangent2 > 0.0).then_some(View { to_center, distance, tangent2, cap })
    }

    /// A direction towards the sphere; `None` from inside.
    pub fn sample(&self, from: Vec3, u: Vec2) -> Option<SphereSample> {
        let View { to_center, distance, tangent2, cap } = self.view(from)?;
        let u = u.as_dvec2();
        let below = u.x * cap;
        let (cosine, sine) = (1.0 - below, (below * (2.0 - below)).sqrt());
        let (sin_phi, cos_phi) = (std::f64::consts::TAU * u.y).sin_cos();
        let axis = to_center / distance;
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        let direction = axis * cosine + (tangent * cos_phi + bitangent * sin_phi) * sine;
        // sin^2 of the rim less sin^2 of the direction, as a product.
        let half_chord = distance * (cap * (1.0 - u.x) * (2.0 - cap - below)).sqrt();
        let near = tangent2 / (distance * cosine + half_chord);
        let normal = (direction * near - to_center).try_normalize()?;
        let point = self.center.as_dvec3() + normal * f64::from(self.radius);
        let pdf = warp::cone_pdf(cap as f32);
        (pdf.is_finite() && near > 0.0).then_some(SphereSample {
            direction: direction.as_vec3(),
            point: point.as_vec3(),
            normal: normal.as_vec3(),
            pdf,
        })
    }

    /// The density over solid angle of any direction that hits the sphere; 0 from inside, and 0 where
    /// [`sample`](Self::sample) gives none.
    pub fn pdf(&self, from: Vec3) -> f32 {
        let pdf = self.view(from).map_or(0.0, |view| warp::cone_pdf(view.cap as f32));
        if pdf.is_finite() { pdf } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{PI, TAU};

    proptest! {
        /// From a millionth of a radius above the surface to 1e9 radii away, at any scale.
        #[test]
        fn it_gives_the_irradiance_of_a_sphere_from_near_and_far(
            above in -6.0..9.0, scale in -9.0..9.0, turn in prop::array::uniform3(-1f32..1.0)
        ) {
            prop_assume!(Vec3::from(turn).length() > 0.1);
            let radius = 10f64.powf(scale) as f32;
            let away = f64::from(radius) * (1.0 + 10f64.powf(above));
            let from = Vec3::from(turn).normalize() * away as f32;
            let sphere = WorldSphere { center: Vec3::ZERO, radius };
            // Where the viewer is after rounding.
            let (from64, r) = (from.as_dvec3(), f64::from(radius));
            let d = from64.length();
            prop_assume!(d > r);
            let n = 48;
            let cell = |i: usize| (i as f32 + 0.5) / n as f32;
            let mut irradiance = 0.0;
            for i in 0..n * n {
                let s = sphere.sample(from, Vec2::new(cell(i % n), cell(i / n))).unwrap();
                let off = (s.point.as_dvec3().length() / r - 1.0).abs();
                prop_assert!(off < 3e-7, "{off} off the surface");
                // Seen from outside, up to the rounding of a direction.
                prop_assert!(s.normal.dot(s.direction) < 1e-6);
                irradiance += -from64.dot(s.direction.as_dvec3()) / d / f64::from(s.pdf);
                prop_assert_eq!(s.pdf, sphere.pdf(from));
            }
            let mean = irradiance / (n * n) as f64;
            let exact = PI * (r / d).powi(2);
            prop_assert!((mean / exact - 1.0).abs() < 1e-5, "{mean} {exact}");
            // 1 - cos without cancellation: of half the angle, by its tangent.
            let angle = r.atan2(((d - r) * (d + r)).sqrt());
            let solid_angle = 2.0 * TAU * (0.5 * angle).sin().powi(2);
            let pdf = f64::from(sphere.pdf(from));
            prop_assert!((pdf * solid_angle - 1.0).abs() < 1e-5, "{pdf} {solid_angle}");
        }
    }

    #[test]
    fn from_inside_it_is_dark() {
        let sphere = WorldSphere { center: Vec3::ZERO, radius: 1.0 };
        for inside in [Vec3::X * 0.5, Vec3::X, Vec3::ZERO, Vec3::Y * 0.999_999_94] {
            assert!(sphere.sample(inside, Vec2::splat(0.5)).is_none());
            assert_eq!(sphere.pdf(inside), 0.0);
        }
    }
}
