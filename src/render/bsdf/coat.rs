//! The clear coat: a GGX lobe above everything else, perhaps about a normal of its own.

use super::albedo::Albedo;
use super::ggx;
use crate::math::Frame;
use glam::{Vec2, Vec3};

/// What a coat reflects at normal incidence: its index is 1.5.
pub(super) const COAT_F0: f32 = 0.04;

/// The coat's lobe. Its colour is `strength * (F0 + (1 - F0) * (1 - cos_h)^5)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    /// 0 is no coat.
    pub strength: f32,
    pub alpha: f32,
    /// Of choosing it.
    pub probability: f32,
    /// In the shading frame; +Z if it is the same.
    pub normal: Vec3,
}

impl Coat {
    pub const NONE: Coat = Coat { strength: 0.0, alpha: 0.0, probability: 0.0, normal: Vec3::Z };

    /// Whether it has another normal than what is below.
    pub fn is_bent(&self) -> bool {
        self.normal != Vec3::Z
    }

    /// `f |cos wi|` and its density, 1/sr, of a coat with a normal of its own.
    pub fn eval_bent(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let own = Frame::around(self.normal);
        let (wo, wi) = (own.to_local(wo), own.to_local(wi));
        if self.strength == 0.0 || wo.z <= 0.0 || wi.z <= 0.0 {
            return (0.0, 0.0);
        }
        let h = (wo + wi).normalize_or(Vec3::Z);
        let schlick = (1.0 - wo.dot(h)).clamp(0.0, 1.0).powi(5);
        let shape = ggx::distribution(h, self.alpha) * ggx::visibility_cos(wo.z, wi.z, self.alpha);
        let value = self.strength * (COAT_F0 + (1.0 - COAT_F0) * schlick) * shape;
        (value, self.probability * ggx::reflection_pdf(wo.z, h, self.alpha))
    }

    /// A direction in the shading frame; `None` below its own horizon, where it has no density.
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<Vec3> {
        if !self.is_bent() {
            return reflected(wo, ggx::sample_normal(wo, self.alpha, u));
        }
        let own = Frame::around(self.normal);
        let wo = own.to_local(wo);
        let wi = reflected(wo, ggx::sample_normal(wo, self.alpha, u))?;
        Some(own.to_outer(wi).normalize())
    }

    /// Its reflectance toward a direction, and the lobe with the probability still open.
    pub fn toward(cos_o: f32, strength: f32, alpha: f32) -> (f32, Coat) {
        let part = Albedo::of_ggx(cos_o, alpha);
        let lost = (1.0 - part.a - part.b).max(0.0) / (part.a + part.b);
        let coat = Coat { strength: strength * (1.0 + COAT_F0 * lost), alpha, ..Coat::NONE };
        (coat.albedo(part).min(1.0), coat)
    }

    pub fn albedo(&self, part: Albedo) -> f32 {
        self.strength * (COAT_F0 * part.a + part.b)
    }
}

/// The mirror direction of `wo` at a microfacet; `None` below the horizon: another lobe may have a density there, but this
/// one has none.
pub(super) fn reflected(wo: Vec3, h: Vec3) -> Option<Vec3> {
    let wi = (2.0 * wo.dot(h) * h - wo).normalize();
    (wi.z > 0.0).then_some(wi)
}
