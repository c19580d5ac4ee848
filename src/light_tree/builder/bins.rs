//! Bins: what a slab of a cluster holds, summed so that the partition's cost comes cheap.

use super::Item;
use crate::bounds::{Aabb, Cone, LightBounds};
use glam::{DVec3, Vec3};

/// Box, energy and spread of orientations of some items, for costs only.
///
/// The cone here is not the bound that nodes get but an estimate from the mean direction: normals
/// spread evenly over a cap of half angle `theta_o` have a mean of length `(1 + cos theta_o) / 2`.
/// Sums need no trigonometry and do not depend on the order of the items, so the axes of the scene
/// are equals, which unions of cones, taken one after the other, cannot promise.
#[derive(Clone, Copy)]
pub struct Bin {
    pub count: usize,
    aabb: Aabb,
    energy: f64,
    /// Sum over the items of energy times mean direction.
    directed: DVec3,
    theta_e: f32,
    two_sided: bool,
}

impl Bin {
    pub const EMPTY: Bin = Bin {
        count: 0,
        aabb: Aabb::EMPTY,
        energy: 0.0,
        directed: DVec3::ZERO,
        theta_e: 0.0,
        two_sided: false,
    };

    pub fn of(item: &Item) -> Bin {
        let LightBounds { aabb, cone, energy } = item.bounds;
        let energy = f64::from(energy);
        let mean =
            if cone.theta_o == 0.0 { 1.0 } else { 0.5 + 0.5 * f64::from(cone.theta_o.cos()) };
        let axis = if cone.two_sided { upwards(cone.axis) } else { cone.axis };
        Bin {
            count: 1,
            aabb,
            energy,
            directed: axis.as_dvec3() * (energy * mean),
            theta_e: cone.theta_e,
            two_sided: cone.two_sided,
        }
    }

    #[inline]
    pub fn merge(&mut self, other: &Bin) {
        self.count += other.count;
        self.aabb = self.aabb.union(&other.aabb);
        self.energy += other.energy;
        self.directed += other.directed;
        self.two_sided |= other.two_sided;
        self.theta_e = self.theta_e.max(other.theta_e);
    }

    /// Chance that a point somewhere samples this cluster: energy times area times solid angle.
    pub fn cost(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        self.energy * area_measure(&self.aabb) * f64::from(self.orientation_measure())
    }

    fn orientation_measure(&self) -> f32 {
        let mean = (self.directed.length() / self.energy).min(1.0);
        let theta_o = (2.0 * mean - 1.0).acos() as f32;
        let cone =
            Cone { axis: Vec3::Z, theta_o, theta_e: self.theta_e, two_sided: self.two_sided };
        cone.measure()
    }
}

/// Of an axis and its opposite, the one whose largest component is positive.
fn upwards(axis: Vec3) -> Vec3 {
    let size = axis.abs();
    let largest = if size.x >= size.y && size.x >= size.z {
        axis.x
    } else if size.y >= size.z {
        axis.y
    } else {
        axis.z
    };
    axis * 1f32.copysign(largest)
}

/// Surface of a box plus a share of its squared diagonal: a measure that scales like an area and
/// still tells a short line of points from a long one, and points on a line from a single point.
fn area_measure(aabb: &Aabb) -> f64 {
    let e = aabb.extent().as_dvec3();
    2.0 * (e.x * e.y + e.y * e.z + e.z * e.x) + DIAGONAL_SHARE * e.length_squared()
}

const DIAGONAL_SHARE: f64 = 0.25;
