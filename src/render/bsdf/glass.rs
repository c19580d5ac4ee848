//! Glass that is rough or solid: a lobe beyond the surface.
//!
//! A *thin* wall is as rough as its reflection and does not bend light (`KHR_materials_transmission`): the lobe is
//! that of the reflection, mirrored by the wall. Its albedo is what the specular lobe leaves, so nothing is lost.
//!
//! *Solid* glass reflects and refracts at each microfacet (Walter et al. 2007, "Microfacet Models for Refraction
//! through Rough Surfaces"), and reflects all where nothing can leave. Fresnel's term is Schlick's, at the larger of
//! the angles on either side. What bounces between microfacets is lost: nothing where it is smooth, at a roughness of
//! 0.5 and straight on 1 % from outside and 7 % from inside, much more where it is rougher or at grazing angles.
//! Radiance that enters a medium of the relative index `eta` is `eta^2` times as high there; the BSDF is that of paths
//! from the eye, so it divides by `eta^2` where such a path enters.

use super::ggx;
use crate::math::color::Rgb;
use glam::{Vec2, Vec3};

/// How light passes a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Passage {
    /// Straight: the caller lets the ray go on, see [`SurfaceSample::tint`](super::SurfaceSample::tint).
    #[default]
    Straight,
    /// Through a wall without thickness.
    Thin,
    /// Into another medium. The index of refraction there, over that on the side of `wo`.
    Solid(f32),
}

/// The lobe, seen from one side. Directions are in the shading frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Glass {
    pub passage: Passage,
    pub alpha: f32,
    /// Of choosing it; 0 if it is not there.
    pub probability: f32,
    /// Of a thin wall: the lobe's colour, of which its albedo is the [`whole`](Self::whole). Of solid glass: what is
    /// multiplied by what is refracted.
    pub color: Rgb,
    /// The share of white light that it passes on; of solid glass approximately, and without `eta^2`.
    pub whole: Rgb,
    /// Of solid glass: what is multiplied by what is reflected.
    pub mirrors: f32,
    /// Of solid glass: the reflectance straight on and at grazing incidence.
    pub f0: Rgb,
    pub f90: f32,
}

impl Glass {
    /// What solid glass reflects at a microfacet, and the cosine of the refracted light, if any is.
    pub fn fresnel(&self, eta: f32, cosine: f32) -> (Rgb, Option<f32>) {
        let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
        if sin2 >= 1.0 {
            return (Rgb::ONE, None);
        }
        let beyond = (1.0 - sin2).sqrt();
        let schlick = (1.0 - cosine.min(beyond)).clamp(0.0, 1.0).powi(5);
        (self.f0 + (Rgb::splat(self.f90) - self.f0) * schlick, Some(beyond))
    }

    /// The share of samples that are reflected.
    fn reflected(&self, fresnel: Rgb) -> f32 {
        let mirrored = self.mirrors * fresnel.element_sum();
        let all = mirrored + (self.color * (Rgb::ONE - fresnel)).element_sum();
        if all > 0.0 { mirrored / all } else { 1.0 }
    }

    /// The value of the lobe with the cosine, and the density if it is chosen, 1/sr.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let (cos_o, cos_i) = (wo.z, wi.z.abs());
        match self.passage {
            Passage::Thin if wi.z < 0.0 => {
                let h = (wo + Vec3::new(wi.x, wi.y, -wi.z)).normalize_or(Vec3::Z);
                let density = ggx::distribution(h, self.alpha);
                let shape = density * ggx::visibility_cos(cos_o, cos_i, self.alpha);
                (self.color * shape, ggx::reflection_pdf(cos_o, h, self.alpha))
            }
            Passage::Solid(eta) if wi.z < 0.0 => {
                let h = (wo + eta * wi).normalize_or(Vec3::Z);
                let h = if h.z < 0.0 { -h } else { h };
                let (along_o, along_i) = (wo.dot(h), wi.dot(h));
                if along_o <= 0.0 || along_i >= 0.0 {
                    return (Rgb::ZERO, 0.0);
                }
                let (fresnel, _) = self.fresnel(eta, along_o);
                // Density of directions over that of microfacets.
                let stretch = -along_i / (along_i + along_o / eta).powi(2);
                let seen = 4.0 * along_o * ggx::reflection_pdf(cos_o, h, self.alpha) * stretch;
                let shadowed = ggx::masking(cos_i, self.alpha);
                let value = self.color * (Rgb::ONE - fresnel) * (seen * shadowed / (eta * eta));
                (value, (1.0 - self.reflected(fresnel)) * seen)
            }
            Passage::Solid(eta) if wi.z > 0.0 => {
                let h = (wo + wi).normalize_or(Vec3::Z);
                let (fresnel, _) = self.fresnel(eta, wo.dot(h));
                let density = ggx::distribution(h, self.alpha);
                let shape = density * ggx::visibility_cos(cos_o, cos_i, self.alpha);
                let pdf = self.reflected(fresnel) * ggx::reflection_pdf(cos_o, h, self.alpha);
                (self.mirrors * fresnel * shape, pdf)
            }
            _ => (Rgb::ZERO, 0.0),
        }
    }

    /// A direction with that density; zero if there is none. `u_side` decides the side.
    pub fn sample(&self, wo: Vec3, u_side: f32, u: Vec2) -> Vec3 {
        let h = ggx::sample_normal(wo, self.alpha, u);
        let mirrored = (2.0 * wo.dot(h) * h - wo).normalize();
        let mirrored = if mirrored.z > 0.0 { mirrored } else { Vec3::ZERO };
        let Passage::Solid(eta) = self.passage else {
            return Vec3::new(mirrored.x, mirrored.y, -mirrored.z);
        };
        let cosine = wo.dot(h);
        let (fresnel, beyond) = self.fresnel(eta, cosine);
        match beyond.filter(|_| u_side >= self.reflected(fresnel)) {
            None => mirrored,
            Some(beyond) => {
                let wi = ((cosine / eta - beyond) * h - wo / eta).normalize();
                if wi.z < 0.0 { wi } else { Vec3::ZERO }
            }
        }
    }
}
