//! A point of a surface with a diffuse and a glossy lobe.
//!
//! HPG 2018 leaves the BSDF out of the importance. On a wet street that omits what matters most: a
//! small light that the surface mirrors outshines all others, and if it is picked only as often as its
//! irradiance says, the picture has fireflies. So here the receiver's cosine is replaced by the sum of
//! a diffuse lobe and a GGX lobe at the half vector. For a point light this is exactly what the surface
//! reflects. For a cluster it is the lobe's peak within the cone of directions to the cluster, bounded
//! because a lobe reflects at most all light: over the cone's solid angle `omega`, a lobe with the peak
//! `L` has at most the mean `L / (1 + L omega)`. A lobe that is narrower than the cone leaves it unknown
//! whether the light lies in it. That is added to the cluster's spread, so that
//! [the cut](super::cut) opens the tree towards the reflection.

use super::importance::{Cluster, Factors, Sight, factors};
use super::viewer::{Receiver, Viewer};
use crate::math::Similarity;
use crate::math::angle::between;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// A receiver together with the lobes of its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glossy {
    /// Where it is; with a normal, above whose horizon is all light that it reflects.
    pub receiver: Receiver,
    /// The normal of the glossy lobe, unit, world space: mostly the receiver's.
    pub about: Vec3,
    /// Direction towards the eye: unit, world space, on the normal's side.
    pub to_eye: Vec3,
    /// What the surface reflects that way.
    pub lobes: Lobes,
    /// A direction drawn from the BSDF, unit, world space. Only the seed's "Split heuristic" (step 1)
    /// asks for it.
    pub toward: Vec3,
}

/// The lobes of a surface, as luminances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes {
    /// Albedo of the diffuse lobe, `[0, 1]`.
    pub diffuse: f32,
    /// Reflectance of the microfacets at normal incidence, `[0, 1]`.
    pub at_normal: f32,
    /// What Schlick's approximation adds to it at grazing incidence.
    pub toward_grazing: f32,
    /// GGX alpha, above zero.
    pub alpha: f32,
}

/// The least that a surface is taken to reflect of any light above its horizon.
const LEAST: f32 = 1e-6;

impl Viewer for Glossy {
    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        factors(cluster, &self.receiver)
    }

    #[inline(always)]
    fn reflect(&self, sight: &Sight) -> (f32, f32) {
        self.reflected(sight)
    }

    fn glare(&self, cluster: &Cluster) -> f64 {
        let view = cluster.view_from(self.receiver.point);
        view.solid_angle() * self.peak_about_drawn(cluster, view.radius, view.distance)
    }

    fn within(&self, space: &Similarity) -> Glossy {
        let receiver = self.receiver.within(space);
        let [to_eye, toward] = [self.to_eye, self.toward].map(|v| space.direction(v));
        let about = match self.about == self.receiver.normal {
            true => receiver.normal,
            false => space.direction(self.about),
        };
        Glossy { receiver, about, to_eye, toward, ..*self }
    }
}

impl Glossy {
    /// How much of the light from a small disk of directions is reflected, relative to a white
    /// Lambertian surface lit from its zenith. It takes the place of the cosine in an importance.
    pub fn reflects_from(&self, direction: Vec3, half_angle_rad: f32) -> f32 {
        let (sin_u, cos_u) = half_angle_rad.min(0.5 * PI).sin_cos();
        let theta = between(self.receiver.normal, direction);
        let cosine = (theta - half_angle_rad).max(0.0).cos().max(LEAST);
        self.reflected(&Sight { to: direction.to_array(), cosine, cos_u, sin_u }).0
    }

    /// The same for light from all directions.
    pub fn albedo(&self) -> f32 {
        let Lobes { diffuse, at_normal, toward_grazing, .. } = self.lobes;
        let cos_o = self.about.dot(self.to_eye).clamp(0.0, 1.0);
        (diffuse + at_normal + toward_grazing * (1.0 - cos_o).powi(5)).max(LEAST)
    }

    #[inline(always)]
    fn reflected(&self, sight: &Sight) -> (f32, f32) {
        let Lobes { diffuse, at_normal, toward_grazing, alpha } = self.lobes;
        let [nx, ny, nz] = self.about.to_array();
        let [ex, ey, ez] = self.to_eye.to_array();
        let [tx, ty, tz] = sight.to;
        let one_minus_cos_u = sight.one_minus_cos_u();

        // The half vector for the centre, not yet of unit length. A direction of the cone is at most a
        // chord away from the cone's axis, and moves the half vector by no more.
        let (hx, hy, hz) = (tx + ex, ty + ey, tz + ez);
        let length2 = (hx * hx + hy * hy + hz * hz).max(f32::MIN_POSITIVE);
        let inverse = 1.0 / length2.sqrt();
        let sin2_w = (2.0 * one_minus_cos_u / length2).min(1.0);
        let (sin_w, cos_w) = (sin2_w.sqrt(), (1.0 - sin2_w).sqrt());
        let cos_h = (nx * hx + ny * hy + nz * hz) * inverse;
        let (sx, sy, sz) = (ny * hz - nz * hy, nz * hx - nx * hz, nx * hy - ny * hx);
        let sin_h = (sx * sx + sy * sy + sz * sz).sqrt() * inverse;

        // GGX (Walter et al. 2007, equation 33) at the least angle off the normal; Smith's shadowing
        // (Heitz 2014, equation 99) at the cosine that is expected.
        let sine = (sin_h * cos_w - cos_h * sin_w).max(0.0);
        let alpha2 = alpha * alpha;
        let shape = sine * sine + (1.0 - sine * sine) * alpha2;
        let ggx = FRAC_1_PI * alpha2 / (shape * shape);
        let cos_o = (nx * ex + ny * ey + nz * ez).max(LEAST);
        let cos_i = sight.cosine;
        let smith = |cosine: f32| (alpha2 + (1.0 - alpha2) * cosine * cosine).sqrt();
        let visible = 0.5 * cos_i / (cos_o * smith(cos_i) + cos_i * smith(cos_o));
        let peak = ggx * visible;

        // Half the length is the cosine between the half vector and the eye.
        let off = (1.0 - 0.5 * length2 * inverse).max(0.0);
        let off2 = off * off;
        let fresnel = at_normal + toward_grazing * off2 * off2 * off;
        let in_cone = peak * TAU * one_minus_cos_u;
        let specular = PI * fresnel * peak / (1.0 + in_cone);
        let all = (diffuse * cos_i + specular).max(LEAST);
        let share = specular / all;
        (all, 0.5 * in_cone * share * share)
    }

    /// Steps 2 and 3 of the seed's "Split heuristic": the largest cosine that any direction to the
    /// cluster has with the drawn one, and a GGX lobe of the surface's roughness there, 1/sr. The
    /// lobe is taken about the drawn direction: its half vector stands at half the angle, and the
    /// change to directions of light divides by four.
    fn peak_about_drawn(&self, cluster: &Cluster, radius: f64, distance: f64) -> f64 {
        let specular = f64::from(1.0 - (self.lobes.diffuse / self.albedo()).min(1.0));
        let to_center = Vec3::from_array(cluster.center) - self.receiver.point;
        let off = to_center.as_dvec3().angle_between(self.toward.as_dvec3());
        let theta_u =
            if distance > radius { (radius / distance).asin() } else { std::f64::consts::PI };
        let cosine = (0.5 * (off - theta_u).max(0.0)).cos();
        let alpha2 = f64::from(self.lobes.alpha).powi(2);
        let shape = cosine * cosine * (alpha2 - 1.0) + 1.0;
        let ggx = alpha2 / (std::f64::consts::PI * shape * shape);
        (1.0 - specular) * std::f64::consts::FRAC_1_PI + specular * 0.25 * ggx
    }
}
