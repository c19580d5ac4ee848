//! What the partition needs to know of the bounds that a tree is built over.

use crate::bounds::LightBounds;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Some of the bounds, prepared for computing costs. What is read together is stored together.
pub struct Items {
    /// Their centres, and their energies.
    pub centers: Vec<Vec4>,
    pub shapes: Vec<Shape>,
    /// Where they stood in the input.
    pub inputs: Vec<u32>,
}

/// What bins sum, laid out for vector instructions.
#[derive(Clone, Copy)]
pub struct Shape {
    /// Smallest corner, and -1 if it is two-sided: what bins keep the minimum of.
    pub min: Vec4,
    /// Largest corner, and `theta_e`: what bins keep the maximum of.
    pub max: Vec4,
    /// Energy times mean direction, and energy. Normals spread evenly over a cap of half angle
    /// `theta_o` have a mean of length `(1 + cos theta_o) / 2`.
    pub directed: Vec4,
}

impl Items {
    pub fn new(bounds: &[LightBounds]) -> Items {
        let center = |bounds: &LightBounds| bounds.aabb.center().extend(bounds.energy);
        let item = |bounds: &LightBounds| (center(bounds), Shape::new(bounds));
        let (centers, shapes) = bounds.par_iter().map(item).unzip();
        Items { centers, shapes, inputs: (0..bounds.len() as u32).collect() }
    }

    /// A copy of some, named by their places.
    pub fn gather(&self, places: &[u32]) -> Items {
        Items {
            centers: places.iter().map(|&at| self.centers[at as usize]).collect(),
            shapes: places.iter().map(|&at| self.shapes[at as usize]).collect(),
            inputs: places.iter().map(|&at| self.inputs[at as usize]).collect(),
        }
    }

    pub fn len(&self) -> usize {
        self.inputs.len()
    }
}

impl Shape {
    fn new(bounds: &LightBounds) -> Shape {
        let LightBounds { aabb, cone, energy, .. } = *bounds;
        // Most items are faces and points, which need no cosine.
        let mean = match cone.theta_o {
            0.0 => 1.0,
            PI => 0.0,
            theta_o => 0.5 + 0.5 * theta_o.cos(),
        };
        let axis = if cone.two_sided { upwards(cone.axis) } else { cone.axis };
        Shape {
            min: aabb.min.extend(if cone.two_sided { -1.0 } else { 0.0 }),
            max: aabb.max.extend(cone.theta_e),
            directed: (axis * (energy * mean)).extend(energy),
        }
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
