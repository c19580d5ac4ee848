//! How much GGX reflects: directional albedo, tabulated.
//!
//! With Schlick's Fresnel `F = F0 + (F90 - F0) (1 - cos)^5` the single-scattering albedo splits
//! into `F0 * a + F90 * b` (Karis 2013). `a + b` is the albedo `E` at full reflectance; what is
//! missing to 1 is the light that a second bounce between microfacets would return, which
//! [`super::Bsdf`] gives back after Turquin 2019.
//!
//! The table is integrated once a process, deterministically, in a few milliseconds.

use super::ggx;
use glam::{Vec2, Vec3};
use std::sync::LazyLock;

/// Entries along each axis.
const SIZE: usize = 48;
/// Points of the quadrature for one entry.
const POINTS: u32 = 256;

/// The two parts of the albedo: `reflectance = f0 * a + f90 * b`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Albedo {
    /// What multiplies `F0`.
    pub a: f32,
    /// What multiplies `F90`.
    pub b: f32,
}

impl Albedo {
    /// The albedo of GGX toward a direction whose cosine to the normal is `cos_o`, interpolated
    /// with an error below 1e-2 (grazing, smooth) and mostly below 2e-3.
    #[inline]
    pub fn of_ggx(cos_o: f32, alpha: f32) -> Albedo {
        let last = (SIZE - 1) as f32;
        // Both axes are dense where the albedo bends: grazing, and smooth.
        let x = cos_o.clamp(0.0, 1.0).sqrt() * last;
        let y = alpha.clamp(0.0, 1.0).sqrt() * last;
        let (column, row) = ((x as usize).min(SIZE - 2), (y as usize).min(SIZE - 2));
        let (fx, fy) = (x - column as f32, y - row as f32);
        let at = row * SIZE + column;
        let table = &*TABLE;
        let low = table[at].lerp(table[at + 1], fx);
        let high = table[at + SIZE].lerp(table[at + SIZE + 1], fx);
        let both = low.lerp(high, fy);
        Albedo { a: both.x, b: both.y }
    }
}

static TABLE: LazyLock<Vec<Vec2>> = LazyLock::new(|| {
    let step = 1.0 / (SIZE - 1) as f32;
    let entry = |i: usize| {
        let (x, y) = ((i % SIZE) as f32 * step, (i / SIZE) as f32 * step);
        integrate((x * x).max(1e-5), (y * y).max(super::ALPHA_MIN))
    };
    (0..SIZE * SIZE).map(entry).collect()
});

/// `(a, b)` by a Hammersley set of visible normals.
fn integrate(cos_o: f32, alpha: f32) -> Vec2 {
    let wo = Vec3::new((1.0 - cos_o * cos_o).max(0.0).sqrt(), 0.0, cos_o);
    let mut sum = Vec2::ZERO;
    for i in 0..POINTS {
        let radical_inverse = i.reverse_bits() as f32 / 2.0_f32.powi(32);
        let u = Vec2::new((i as f32 + 0.5) / POINTS as f32, radical_inverse);
        let h = ggx::sample_normal(wo, alpha, u);
        let wi = 2.0 * wo.dot(h) * h - wo;
        if wi.z > 0.0 {
            let schlick = (1.0 - wo.dot(h)).clamp(0.0, 1.0).powi(5);
            let weight = ggx::shadowing_of_sample(cos_o, wi.z, alpha);
            sum += Vec2::new(1.0 - schlick, schlick) * weight;
        }
    }
    sum / POINTS as f32
}
