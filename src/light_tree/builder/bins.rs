//! Bins: what a slab of a cluster holds, summed so that the partition's cost comes cheap.

use super::item::Item;
use crate::bounds::{Aabb, Cone};
use glam::{DVec4, Vec3, Vec3A};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Box, energy and spread of orientations of some items, for costs only.
///
/// The cone here is not the bound that nodes get but an estimate from the mean direction (see
/// [`Item::directed`]). Sums need no trigonometry, and prefer none of the scene's axes, which unions
/// of cones, taken one after the other, cannot promise.
#[derive(Clone, Copy)]
pub struct Bin {
    /// Sum over the items of energy times mean direction, and of energy.
    directed: DVec4,
    min: Vec3A,
    max: Vec3A,
    pub count: u32,
    theta_e: f32,
    two_sided: bool,
}

impl Bin {
    pub const EMPTY: Bin = Bin {
        directed: DVec4::ZERO,
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
        count: 0,
        theta_e: 0.0,
        two_sided: false,
    };

    pub fn of(item: &Item) -> Bin {
        let mut bin = Bin::EMPTY;
        bin.add(item);
        bin
    }

    #[inline]
    pub fn add(&mut self, item: &Item) {
        self.count += 1;
        self.min = self.min.min(item.min);
        self.max = self.max.max(item.max);
        self.directed += item.directed.as_dvec4();
        self.two_sided |= item.two_sided;
        self.theta_e = larger(self.theta_e, item.theta_e);
    }

    #[inline]
    pub fn merge(&mut self, other: &Bin) {
        self.count += other.count;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.directed += other.directed;
        self.two_sided |= other.two_sided;
        self.theta_e = self.theta_e.max(other.theta_e);
    }

    /// Chance that a point somewhere samples this cluster: energy times area times solid angle.
    pub fn cost(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        let aabb = Aabb { min: self.min.into(), max: self.max.into() };
        self.directed.w * aabb.measure() * f64::from(self.orientation_measure())
    }

    /// [`Cone::measure`] of the estimated cone.
    fn orientation_measure(&self) -> f32 {
        let (directed, energy) = (self.directed.truncate(), self.directed.w);
        let cos_o = (2.0 * (directed.length() / energy).min(1.0) - 1.0) as f32;
        if self.theta_e == FRAC_PI_2 {
            return measure_of_faces(cos_o, self.two_sided);
        }
        let (theta_e, two_sided) = (self.theta_e, self.two_sided);
        Cone { axis: Vec3::Z, theta_o: cos_o.acos(), theta_e, two_sided }.measure()
    }
}

/// The larger of two numbers: `f32::max` is several instructions, for the sake of NaN.
#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// [`Cone::measure`] for `theta_e = pi/2`, which is all but spots, without trigonometry:
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
