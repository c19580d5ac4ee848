//! Axis-aligned boxes.

use glam::{Affine3A, Vec3};

/// An axis-aligned box. Empty when `min > max`; a point or a flat box is not empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner, metres.
    pub min: Vec3,
    /// Largest corner, metres.
    pub max: Vec3,
}

impl Aabb {
    /// Contains nothing; the identity of [`union`](Aabb::union).
    pub const EMPTY: Aabb = Aabb { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around some points.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Aabb {
        points
            .into_iter()
            .fold(Aabb::EMPTY, |aabb, p| Aabb { min: aabb.min.min(p), max: aabb.max.max(p) })
    }

    /// The smallest box around both.
    #[inline]
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether nothing is inside.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// The middle. Halves before it adds, so that huge boxes do not overflow.
    #[inline]
    pub fn center(&self) -> Vec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// Edge lengths, metres.
    #[inline]
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }

    /// Surface of the box plus a share of its squared diagonal, square metres: the `M_A` by which the
    /// build weighs it. Scales like an area and still tells a short line of points from a long one, and
    /// points on a line from a single point.
    pub fn measure(&self) -> f64 {
        const DIAGONAL_SHARE: f64 = 0.25;
        let e = self.extent().as_dvec3();
        2.0 * (e.x * e.y + e.y * e.z + e.z * e.x) + DIAGONAL_SHARE * e.length_squared()
    }

    /// Whether a point is inside or on the surface.
    pub fn contains(&self, p: Vec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Whether a whole box is inside.
    pub fn contains_box(&self, other: &Aabb) -> bool {
        self.min.cmple(other.min).all() && other.max.cmple(self.max).all()
    }

    /// The box around this box after a transform.
    pub fn transformed(&self, transform: &Affine3A) -> Aabb {
        Aabb::around((0..8).map(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { self.min } else { self.max };
            transform.transform_point3(Vec3::new(pick(0).x, pick(1).y, pick(2).z))
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_contains_what_it_is_around() {
        let points = [Vec3::new(1.0, -2.0, 3.0), Vec3::new(-1.0, 5.0, 0.5)];
        let aabb = Aabb::around(points);
        assert!(points.iter().all(|&p| aabb.contains(p)) && aabb.contains(aabb.center()));
        assert!(aabb.union(&Aabb::EMPTY) == aabb && Aabb::EMPTY.is_empty() && !aabb.is_empty());
    }

    #[test]
    fn a_transformed_box_contains_its_transformed_points() {
        let aabb = Aabb { min: Vec3::NEG_ONE, max: Vec3::new(2.0, 1.0, 3.0) };
        let turn = Affine3A::from_rotation_y(0.7) * Affine3A::from_translation(Vec3::X);
        let turned = aabb.transformed(&turn);
        for p in [aabb.min, aabb.max, aabb.center()] {
            assert!(turned.contains(turn.transform_point3(p)));
        }
    }
}
