//! What a partition must know of a cluster before it looks at its items.

use super::CHUNK;
use glam::{DVec4, Vec3, Vec4};
use rayon::prelude::*;

/// The box around the centres of some items, and the largest of their energies.
#[derive(Clone, Copy)]
pub struct Outline {
    /// Smallest coordinates, and energy.
    min: Vec4,
    /// Largest.
    max: Vec4,
}

impl Outline {
    /// Of no items.
    pub const NONE: Outline = Outline { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    /// Around many items, given their centres and energies.
    pub fn around(centers: &[Vec4]) -> Outline {
        let around = |part: &[Vec4]| {
            let mut outline = Outline::NONE;
            part.iter().for_each(|&center| outline.add(center));
            outline
        };
        centers.par_chunks(CHUNK).map(around).reduce(|| Outline::NONE, Outline::and)
    }

    /// Takes in an item, given its centre and energy.
    #[inline]
    pub fn add(&mut self, center: Vec4) {
        (self.min, self.max) = (self.min.min(center), self.max.max(center));
    }

    /// Around both.
    pub fn and(self, other: Outline) -> Outline {
        Outline { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Smallest coordinates of the centres, metres.
    pub fn min(&self) -> Vec3 {
        self.min.truncate()
    }

    /// How far the centres reach along each axis, metres.
    pub fn extent(&self) -> Vec3 {
        (self.max - self.min).truncate()
    }

    /// The steps in which energies are summed.
    pub fn steps(&self) -> Steps {
        Steps::for_peak(self.max.w)
    }
}

/// Steps of energy, so coarse that sums over up to 2^30 items are exact and so the same in any order. A
/// step is at most 2^-22 of the largest energy, far below what matters to costs.
#[derive(Clone, Copy)]
pub struct Steps {
    /// A number so large that its neighbours in double precision are one step away.
    far: DVec4,
}

impl Steps {
    fn for_peak(peak: f32) -> Steps {
        /// All but the exponent is dropped.
        const EXPONENT: u64 = 0x7ff << 52;
        let power_of_two = f64::from_bits(f64::from(peak).to_bits() & EXPONENT);
        // The half on top keeps the sum with a negative number where the neighbours are as far apart.
        Steps { far: DVec4::splat(1.5 * f64::from(1u32 << 30) * power_of_two) }
    }

    /// Rounds what is summed of an item to whole steps.
    #[inline]
    pub fn round(&self, directed: Vec4) -> DVec4 {
        (directed.as_dvec4() + self.far) - self.far
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::hash;

    /// Many numbers of all sizes up to a peak.
    fn energies(peak: f32) -> Vec<Vec4> {
        let random = |i: u32, n: u32| hash(i, n) as f32 / u32::MAX as f32;
        let size = |i| (-40.0 * random(i, 0)).exp2();
        let part = |i: u32| Vec4::new(random(i, 1), -random(i, 2), random(i, 3) - 0.5, 1.0);
        (0..10_000).map(|i| part(i) * (size(i) * peak)).chain([Vec4::splat(peak)]).collect()
    }

    #[test]
    fn sums_are_exact_in_any_order() {
        for peak in [f32::MAX, 1.0, 3.0, f32::MIN_POSITIVE, 1e-42] {
            let steps = Steps::for_peak(peak);
            let mut rounded: Vec<_> = energies(peak).into_iter().map(|e| steps.round(e)).collect();
            let ahead: DVec4 = rounded.iter().sum();
            rounded.reverse();
            assert_eq!(ahead, rounded.iter().sum());
            rounded.sort_by(|a, b| a.x.total_cmp(&b.x));
            assert_eq!(ahead, rounded.iter().sum());
        }
    }

    #[test]
    fn steps_are_small_and_scale_with_the_peak() {
        let (one, small) = (Steps::for_peak(1.0), Steps::for_peak(2f32.powi(-60)));
        for energy in energies(1.0) {
            let rounded = one.round(energy);
            assert!((rounded - energy.as_dvec4()).abs().max_element() <= 2f64.powi(-23));
            let scaled = small.round(energy * 2f32.powi(-60));
            assert_eq!(scaled * 2f64.powi(60), rounded);
        }
        assert_eq!(Steps::for_peak(0.0).round(Vec4::ZERO), DVec4::ZERO);
    }
}
