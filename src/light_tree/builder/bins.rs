//! Bins: what a slab of a cluster holds, summed so that the cost of a partition is cheap to compute.

use super::item::Shape;
use crate::bounds::{Aabb, Cone};
use glam::{DVec4, Vec3, Vec4};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Box, energy and spread of orientations of some items, for costs only.
///
/// The cone here is not the bound that nodes get but an estimate from the mean direction (see
/// [`Shape::directed`]). Sums need no trigonometry and favour no axis of the scene. Successive unions of
/// cones would depend on their order.
#[derive(Clone, Copy)]
pub struct Bin {
    /// Sum over the items of energy times mean direction, and of energy, in whole steps: exact.
    directed: DVec4,
    /// As in [`Shape`].
    min: Vec4,
    max: Vec4,
}

impl Bin {
    pub const EMPTY: Bin =
        Bin { directed: DVec4::ZERO, min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    /// One item; `directed` is its own in [steps](super::outline::Steps).
    pub fn of(shape: &Shape, directed: DVec4) -> Bin {
        let mut bin = Bin::EMPTY;
        bin.add(shape, directed);
        bin
    }

    /// Adds an item; `directed` is its own in [steps](super::outline::Steps).
    #[inline]
    pub fn add(&mut self, shape: &Shape, directed: DVec4) {
        self.min = self.min.min(shape.min);
        self.max = self.max.max(shape.max);
        self.directed += directed;
    }

    #[inline]
    pub fn merge(&mut self, other: &Bin) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.directed += other.directed;
    }

    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    /// Energy times area times orientation measure: an estimate, up to a factor, of how likely a point
    /// somewhere is to sample this cluster.
    pub fn cost(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let aabb = Aabb { min: self.min.truncate(), max: self.max.truncate() };
        self.directed.w * aabb.measure() * f64::from(self.orientation_measure())
    }

    /// [`Cone::measure`] of the estimated cone.
    fn orientation_measure(&self) -> f32 {
        let (directed, energy) = (self.directed.truncate(), self.directed.w);
        let cos_o = (2.0 * (directed.length() / energy).min(1.0) - 1.0) as f32;
        let (theta_e, two_sided) = (self.max.w, self.min.w < 0.0);
        if theta_e == FRAC_PI_2 {
            return measure_of_faces(cos_o, two_sided);
        }
        Cone { axis: Vec3::Z, theta_o: cos_o.acos(), theta_e, two_sided }.measure()
    }
}

/// [`Cone::measure`] for `theta_e = pi/2`, which all lights but spots have, without trigonometry:
/// `2 pi - pi c + pi^2/2 s` up to a right angle, `2 pi (1 - c) + pi (pi - theta_o) s` beyond.
fn measure_of_faces(cos_o: f32, two_sided: bool) -> f32 {
    let sin_o = (1.0 - cos_o * cos_o).max(0.0).sqrt();
    let one_side = if cos_o >= 0.0 {
        TAU - PI * cos_o + 0.5 * PI * PI * sin_o
    } else {
        TAU * (1.0 - cos_o) + PI * acos_of_positive(-cos_o) * sin_o
    };
    if two_sided { (2.0 * one_side).min(2.0 * TAU) } else { one_side }
}

/// `acos` of a number in `[0, 1]` to 7e-5 (Abramowitz and Stegun 4.4.45): costs need no more.
fn acos_of_positive(x: f32) -> f32 {
    (1.0 - x).max(0.0).sqrt()
        * (1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - 0.018_729_3 * x)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_measure_of_faces_is_the_measure() {
        for step in 0..=100 {
            let theta_o = PI * step as f32 / 100.0;
            for two_sided in [false, true] {
                let cone = Cone { axis: Vec3::Y, theta_o, theta_e: FRAC_PI_2, two_sided };
                let quick = measure_of_faces(theta_o.cos(), two_sided);
                assert!((quick - cone.measure()).abs() < 1e-3, "{theta_o}");
            }
        }
    }
}
