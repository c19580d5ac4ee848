//! A node of the wide hierarchy: the boxes of eight children in 96 bytes.
//!
//! A ray waits for memory more than it computes, so nodes are small: a node has an origin and a step for each
//! axis, and its children's planes are whole numbers of steps (after Ylitie, Karras and Laine 2017, "Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs"). A plane is decoded to single precision before
//! anything is done with it, and as decoded it is never inside the child's box. So what
//! is proven of boxes in single precision (Ize 2013, "Robust BVH Ray Traversal") holds here, too.

use crate::bounds::Aabb;
use glam::{Vec3, Vec4};

/// Most children of a node. Eight are 10 % faster than four.
pub const FAN: usize = 8;
/// No child.
pub const NONE: u32 = u32::MAX;
/// `1 + 2 gamma(3)`: what rounding can take from the distance at which a ray leaves a box.
const FAR_SLACK: f32 = 1.000_000_5;
/// The number of the last step.
const LAST: u8 = u8::MAX;

/// A node. Which children there are, [`used`](Self::used) says; the planes of others mean nothing.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct WideNode {
    origin: [f32; 3],
    /// Exponents of two of the steps.
    exponents: [i8; 3],
    /// A bit for each child.
    used: u8,
    /// Lower and upper planes of the children, by axis, in steps from the origin.
    planes: [[[u8; FAN]; 2]; 3],
    /// What its owner calls them.
    pub children: [u32; FAN],
}

/// What the box test needs of a ray.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    origin: [f32; 3],
    inverse: [f32; 3],
    /// Which of an axis' two planes is met first.
    near: [usize; 3],
}

impl BoxRay {
    /// A ray; the direction need not have unit length.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> BoxRay {
        // Bounded, so that no product with a finite distance is NaN.
        let inverse = direction.to_array().map(|d| (1.0 / d).clamp(-1e30, 1e30));
        BoxRay { origin: origin.to_array(), inverse, near: inverse.map(|i| usize::from(i < 0.0)) }
    }
}

impl WideNode {
    /// Around at most [`FAN`] boxes, which are finite; children are to be named yet.
    pub fn around(boxes: &[Aabb]) -> WideNode {
        let mut node = WideNode {
            origin: [0.0; 3],
            exponents: [0; 3],
            used: ((1_u32 << boxes.len()) - 1) as u8,
            planes: [[[0; FAN]; 2]; 3],
            children: [NONE; FAN],
        };
        let all = boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
        for axis in 0..3 {
            let (low, high) = (all.min[axis], all.max[axis]);
            node.origin[axis] = low;
            // The smallest step with which the last plane is not inside.
            let size = f64::from(high) - f64::from(low);
            let least = (size / f64::from(LAST)).log2().floor().clamp(-126.0, 120.0) as i8;
            node.exponents[axis] = least;
            while node.plane(axis, LAST) < high && node.exponents[axis] < 120 {
                node.exponents[axis] += 1;
            }
            for (slot, child) in boxes.iter().enumerate() {
                let steps = |to: f32| {
                    let steps = (f64::from(to) - f64::from(low)) / f64::from(node.step(axis));
                    steps.clamp(0.0, f64::from(LAST))
                };
                let mut lower = steps(child.min[axis]).floor() as u8;
                while lower > 0 && node.plane(axis, lower) > child.min[axis] {
                    lower -= 1;
                }
                let mut upper = steps(child.max[axis]).ceil() as u8;
                while upper < LAST && node.plane(axis, upper) < child.max[axis] {
                    upper += 1;
                }
                node.planes[axis][0][slot] = lower;
                node.planes[axis][1][slot] = upper;
            }
        }
        node
    }

    #[inline(always)]
    fn step(&self, axis: usize) -> f32 {
        f32::from_bits(((i32::from(self.exponents[axis]) + 127) as u32) << 23)
    }

    #[inline(always)]
    fn plane(&self, axis: usize, number: u8) -> f32 {
        self.origin[axis] + f32::from(number) * self.step(axis)
    }

    /// Distances at which the ray enters the children, and a bit for each that it enters before
    /// `tmax`.
    #[inline(always)]
    pub fn enter(&self, ray: &BoxRay, tmax: f32) -> ([f32; FAN], u32) {
        let (mut near, mut far) = ([0.0_f32; FAN], [f32::MAX; FAN]);
        for axis in 0..3 {
            let planes = &self.planes[axis];
            let first = ray.near[axis] & 1;
            let (origin, inverse) = (ray.origin[axis], ray.inverse[axis]);
            for lane in 0..FAN {
                let enter = (self.plane(axis, planes[first][lane]) - origin) * inverse;
                near[lane] = if enter > near[lane] { enter } else { near[lane] };
                let leave = (self.plane(axis, planes[first ^ 1][lane]) - origin) * inverse;
                far[lane] = if leave < far[lane] { leave } else { far[lane] };
            }
        }
        for lane in 0..FAN {
            let leave = far[lane] * FAR_SLACK;
            far[lane] = if leave < tmax { leave } else { tmax };
        }
        let half = |lanes: &[f32; FAN], first: usize| {
            Vec4::new(lanes[first], lanes[first + 1], lanes[first + 2], lanes[first + 3])
        };
        let hits = |first: usize| half(&near, first).cmple(half(&far, first)).bitmask();
        (near, (hits(0) | hits(4) << 4) & u32::from(self.used))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Boxes of sizes and at places over many decades, flat ones among them.
    fn boxes() -> impl Strategy<Value = Vec<Aabb>> {
        let coordinate = (-12f32..12.0, any::<bool>());
        let number = coordinate.prop_map(|(e, sign)| 10f32.powf(e).copysign(f32::from(sign) - 0.5));
        let size = prop_oneof![1 => Just(0.0), 4 => (-12f32..12.0).prop_map(|e| 10f32.powf(e))];
        let one = (prop::array::uniform3(number), prop::array::uniform3(size));
        let one = one.prop_map(|(at, size)| {
            let min = Vec3::from(at);
            Aabb { min, max: min + Vec3::from(size) }
        });
        prop::collection::vec(one, 1..=FAN)
    }

    proptest! {
        #[test]
        fn a_decoded_box_holds_the_box(boxes in boxes()) {
            let node = WideNode::around(&boxes);
            for (slot, child) in boxes.iter().enumerate() {
                for axis in 0..3 {
                    let [lower, upper] = node.planes[axis].map(|side| side[slot]);
                    prop_assert!(node.plane(axis, lower) <= child.min[axis]);
                    prop_assert!(node.plane(axis, upper) >= child.max[axis]);
                }
            }
        }

        /// A box is at most two steps too large, and a step is at most a 127th of what the node is around.
        #[test]
        fn a_decoded_box_is_not_much_larger(boxes in boxes()) {
            let node = WideNode::around(&boxes);
            let all = boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
            for axis in 0..3 {
                let size = f64::from(all.max[axis]) - f64::from(all.min[axis]);
                let rounding = f64::from(f32::EPSILON) * f64::from(all.max.abs().max(all.min.abs())[axis]);
                let room = 2.0 * (size / 127.0 + rounding) + 1e-37;
                for (slot, child) in boxes.iter().enumerate() {
                    let [lower, upper] = node.planes[axis].map(|side| f64::from(node.plane(axis, side[slot])));
                    prop_assert!(f64::from(child.min[axis]) - lower <= room);
                    prop_assert!(upper - f64::from(child.max[axis]) <= room);
                }
            }
        }

        #[test]
        fn a_ray_to_a_point_of_a_box_enters_it(
            boxes in boxes(), which in any::<prop::sample::Index>(), at in prop::array::uniform3(0f32..=1.0),
            from in prop::array::uniform3(-1f32..1.0), reach in -6f32..6.0
        ) {
            let node = WideNode::around(&boxes);
            let slot = which.index(boxes.len());
            let child = boxes[slot];
            let target = (child.min + (child.max - child.min) * Vec3::from(at)).clamp(child.min, child.max);
            let origin = target + Vec3::from(from) * 10f32.powf(reach) * target.abs().max_element();
            let direction = target - origin;
            prop_assume!(direction.is_finite() && direction != Vec3::ZERO);
            // Both are rounded: whether the ray enters the box is for double precision to say.
            let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
            for axis in 0..3 {
                let along = |plane: f32| {
                    (f64::from(plane) - f64::from(origin[axis])) / f64::from(direction[axis])
                };
                let (a, b) = (along(child.min[axis]), along(child.max[axis]));
                (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
            }
            if enter > leave {
                return Ok(());
            }
            let (near, hits) = node.enter(&BoxRay::new(origin, direction), f32::INFINITY);
            prop_assert!(hits >> slot & 1 == 1, "{near:?}");
            prop_assert!(f64::from(near[slot]) <= enter + 1e-5 * leave);
        }
    }
}
