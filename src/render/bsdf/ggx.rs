//! The GGX microfacet distribution: its density, its shadowing and how to draw from it.
//!
//! Not a BSDF: no Fresnel, no colour. All directions are unit vectors in the *shading frame*
//! (`z` along the normal) and above the horizon; `alpha` is roughness squared.
//!
//! | what | from |
//! |---|---|
//! | `D` | Walter et al. 2007, eq. 33, in Heitz's form that cancels nothing at small `alpha` |
//! | `G2`, `G1` | Smith, height-correlated: Heitz 2014, eq. 99 |
//! | [`sample_normal`] | visible normals by spherical caps: Dupuy and Benyoub 2023 |

use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Density of microfacet normals, 1/sr.
#[inline]
pub fn distribution(h: Vec3, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let k = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    1.0 / (PI * a2 * k * k)
}

/// `sqrt(alpha^2 sin^2 + cos^2)`: Smith's `cos * (1 + 2 Lambda)`.
#[inline]
fn smith(cosine: f32, alpha: f32) -> f32 {
    let c2 = cosine * cosine;
    (alpha * alpha * (1.0 - c2).max(0.0) + c2).sqrt()
}

/// Smith's `G1`, for one direction alone.
#[inline]
pub fn masking(cosine: f32, alpha: f32) -> f32 {
    2.0 * cosine / (cosine + smith(cosine, alpha)).max(f32::MIN_POSITIVE)
}

/// `cos_i * G2 / (4 cos_o cos_i)`: masking and shadowing with the microfacet model's denominator
/// and the receiver's cosine, finite at the horizon.
#[inline]
pub fn visibility_cos(cos_o: f32, cos_i: f32, alpha: f32) -> f32 {
    let denominator = cos_o * smith(cos_i, alpha) + cos_i * smith(cos_o, alpha);
    0.5 * cos_i / denominator.max(f32::MIN_POSITIVE)
}

/// Density over solid angle of `wi = reflect(wo, sample_normal(wo))`, 1/sr:
/// `G1(wo) D(h) / (4 cos_o)`. Integrates to 1 less what is reflected below the horizon.
#[inline]
pub fn reflection_pdf(cos_o: f32, h: Vec3, alpha: f32) -> f32 {
    0.5 * distribution(h, alpha) / (cos_o + smith(cos_o, alpha))
}

/// `G2 / G1(wo)`: the weight of a reflection drawn by [`sample_normal`], before Fresnel.
#[inline]
pub fn shadowing_of_sample(cos_o: f32, cos_i: f32, alpha: f32) -> f32 {
    let (so, si) = (smith(cos_o, alpha), smith(cos_i, alpha));
    cos_i * (cos_o + so) / (cos_o * si + cos_i * so)
}

/// A microfacet normal with the density of those that `wo` sees.
#[inline]
pub fn sample_normal(wo: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    let stretched = Vec3::new(wo.x * alpha, wo.y * alpha, wo.z).normalize();
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let sine = (1.0 - z * z).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u.x).sin_cos();
    let h = Vec3::new(sine * cos_phi, sine * sin_phi, z) + stretched;
    // At the very rim both terms can cancel; the normal itself is then the right limit.
    Vec3::new(h.x * alpha, h.y * alpha, h.z.max(0.0)).try_normalize().unwrap_or(Vec3::Z)
}
