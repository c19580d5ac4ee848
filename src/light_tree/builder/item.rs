//! What the partition needs to know of one of the bounds that a tree is built over.

use crate::bounds::LightBounds;
use glam::{Vec3, Vec3A, Vec4};
use std::f32::consts::PI;

/// One of the bounds, prepared for costs: what is summed stands as vector instructions want it, in one
/// cache line.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Item {
    pub min: Vec3A,
    pub max: Vec3A,
    /// Energy times mean direction, and energy. Normals spread evenly over a cap of half angle
    /// `theta_o` have a mean of length `(1 + cos theta_o) / 2`.
    pub directed: Vec4,
    pub theta_e: f32,
    pub two_sided: bool,
    /// Where it stood in the input.
    pub index: u32,
}

impl Item {
    pub fn new(bounds: &LightBounds, index: u32) -> Item {
        let LightBounds { aabb, cone, energy, .. } = *bounds;
        // Faces and points are most of all, and need no cosine.
        let mean = match cone.theta_o {
            0.0 => 1.0,
            PI => 0.0,
            theta_o => 0.5 + 0.5 * theta_o.cos(),
        };
        let axis = if cone.two_sided { upwards(cone.axis) } else { cone.axis };
        Item {
            min: aabb.min.into(),
            max: aabb.max.into(),
            directed: (axis * (energy * mean)).extend(energy),
            theta_e: cone.theta_e,
            two_sided: cone.two_sided,
            index,
        }
    }

    /// Whether two cannot be told apart by what is known here: so of all with the same bounds, and of
    /// few others.
    pub fn looks_like(&self, other: &Item) -> bool {
        // Bit by bit: the order of bounds tells 0 from -0.
        let bits = |item: &Item| {
            let corners = [item.min, item.max].map(|corner| corner.to_array().map(f32::to_bits));
            (corners, item.directed.to_array().map(f32::to_bits))
        };
        bits(self) == bits(other)
    }

    #[inline]
    pub fn center(&self) -> Vec3A {
        0.5 * self.min + 0.5 * self.max
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
