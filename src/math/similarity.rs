//! Transforms that keep shapes: rotation, reflection, even scale, translation.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Mat3, Vec3};

/// How far the axes may be from equal lengths and right angles, relative.
const TOLERANCE: f64 = 1e-4;

/// A map from one space to another that keeps all shapes. Files store it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Similarity {
    /// Where the three axes go.
    pub axes: [[f32; 3]; 3],
    /// Where the origin goes.
    pub origin: [f32; 3],
}

impl Similarity {
    /// The map that changes nothing.
    pub const IDENTITY: Similarity =
        Similarity { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin: [0.0; 3] };

    /// The map that undoes a transform; `None` if the transform is flat or does not keep shapes.
    pub fn undoing(transform: &Affine3A) -> Option<Similarity> {
        let linear = transform.matrix3.as_dmat3();
        let inverse = linear.inverse();
        let origin = -(inverse * glam::Vec3::from(transform.translation).as_dvec3());
        let found = Similarity {
            axes: inverse.to_cols_array_2d().map(|axis| axis.map(|x| x as f32)),
            origin: origin.as_vec3().to_array(),
        };
        (keeps_shapes(transform) && found.is_sound()).then_some(found)
    }

    /// Whether every number is finite and shapes are kept.
    pub fn is_sound(&self) -> bool {
        let transform = self.transform();
        transform.is_finite() && keeps_shapes(&transform)
    }

    /// As a transform.
    pub fn transform(&self) -> Affine3A {
        Affine3A::from_mat3_translation(self.linear(), Vec3::from_array(self.origin))
    }

    /// By how much lengths grow.
    pub fn scale(&self) -> f32 {
        Vec3::from_array(self.axes[0]).length()
    }

    /// Where a point goes. In double precision until the end: far from the origin the two terms are
    /// large and nearly cancel.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        let there = self.linear().as_dmat3() * p.as_dvec3();
        (there + Vec3::from_array(self.origin).as_dvec3()).as_vec3()
    }

    /// Where a unit direction points to, unit again; zero stays zero.
    #[inline]
    pub fn direction(&self, d: Vec3) -> Vec3 {
        (self.linear() * d).normalize_or_zero()
    }

    fn linear(&self) -> Mat3 {
        Mat3::from_cols_array_2d(&self.axes)
    }
}

fn keeps_shapes(transform: &Affine3A) -> bool {
    let m = transform.matrix3.as_dmat3();
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    let lengths2 = [x, y, z].map(|axis| axis.length_squared());
    let longest2 = lengths2.iter().fold(0.0, |a, &b| f64::max(a, b));
    let even = lengths2.iter().all(|&length2| longest2 - length2 <= 2.0 * TOLERANCE * longest2);
    let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs());
    longest2 > 0.0 && longest2.is_finite() && even && skew <= TOLERANCE * longest2
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn undoing_a_similarity_brings_everything_back() {
        let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.3);
        for scale in [1e-4f32, 1.0, 1e4, -2.0] {
            let place = Affine3A::from_scale_rotation_translation(
                Vec3::splat(scale),
                turn,
                Vec3::new(3.0, -4.0, 5.0),
            );
            let back = Similarity::undoing(&place).unwrap();
            let p = Vec3::new(0.2, 0.5, -0.7);
            let there = place.transform_point3(p);
            assert!((back.point(there) - p).length() < 1e-5 * (1.0 + 5.0 / scale.abs()));
            let d = place.transform_vector3(Vec3::X).normalize();
            assert!((back.direction(d) - Vec3::X).length() < 1e-5);
            assert!((back.scale() * scale.abs() - 1.0).abs() < 1e-5);
        }
        assert_eq!(Similarity::IDENTITY.direction(Vec3::ZERO), Vec3::ZERO);
    }

    #[test]
    fn what_bends_shapes_is_none() {
        for scale in [Vec3::new(1.0, 1.0, 1.001), Vec3::new(1.0, 1.0, 0.0), Vec3::ZERO] {
            assert!(Similarity::undoing(&Affine3A::from_scale(scale)).is_none());
        }
        let mirrored = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        assert!(Similarity::undoing(&mirrored).is_some());
    }
}
