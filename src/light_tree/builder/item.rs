//! What the partition needs to know of one of the bounds that a tree is built over.

use crate::bounds::{Aabb, LightBounds};
use glam::Vec3;

/// One of the bounds, prepared for costs.
#[derive(Clone, Copy)]
pub struct Item {
    pub aabb: Aabb,
    /// Energy times mean direction. Normals spread evenly over a cap of half angle `theta_o` have a
    /// mean of length `(1 + cos theta_o) / 2`.
    pub directed: Vec3,
    pub energy: f32,
    pub theta_e: f32,
    pub two_sided: bool,
    /// Where it stood in the input.
    pub index: u32,
}

impl Item {
    pub fn new(bounds: &LightBounds, index: u32) -> Item {
        let LightBounds { aabb, cone, energy, .. } = *bounds;
        let mean = if cone.theta_o == 0.0 { 1.0 } else { 0.5 + 0.5 * cone.theta_o.cos() };
        let axis = if cone.two_sided { upwards(cone.axis) } else { cone.axis };
        Item {
            aabb,
            directed: axis * (energy * mean),
            energy,
            theta_e: cone.theta_e,
            two_sided: cone.two_sided,
            index,
        }
    }

    #[inline]
    pub fn center(&self) -> Vec3 {
        self.aabb.center()
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
