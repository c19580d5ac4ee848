//! Points that rays start from and end at.

use glam::{DVec3, Vec3};

/// Half an ulp, relative: what rounding to `f32` moves a coordinate by at most.
const HALF_ULP: f32 = f32::EPSILON / 2.0;

/// A point on a surface together with how far it may be off it, so that a ray can start from it
/// without meeting the surface again.
///
/// The offset is not a scene epsilon: it is the bound of the point's own rounding (as in Pharr,
/// Jakob and Humphreys, "Managing Rounding Error"), about 2e-7 of its coordinates, and it works
/// alike in scenes of a micrometre and of a thousand kilometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// World space, metres.
    pub position: Vec3,
    /// Geometric normal, unit, world space; zero for a point in free space.
    pub normal: Vec3,
    /// Bound of the distance from `position` to the surface along the normal, metres.
    pub error_m: f32,
}

impl Anchor {
    /// A point rounded from double precision. `noise_m` bounds the error before rounding.
    pub(super) fn rounded(position: DVec3, normal: Vec3, noise_m: f64) -> Anchor {
        let position = position.as_vec3();
        let error_m = HALF_ULP * position.abs().dot(normal.abs()) + noise_m as f32;
        Anchor { position, normal, error_m }
    }

    /// A point on a surface that the caller computed in `f32` from numbers as large as
    /// `magnitude_m` (its own coordinates and those of the corners it was interpolated from):
    /// sixteen roundings are allowed for.
    pub fn computed(position: Vec3, normal: Vec3, magnitude_m: f32) -> Anchor {
        let size = magnitude_m.max(position.abs().max_element());
        Anchor { position, normal, error_m: 16.0 * HALF_ULP * size }
    }

    /// A point in free space: a point light, a camera.
    pub fn free(position: Vec3) -> Anchor {
        Anchor { position, normal: Vec3::ZERO, error_m: 0.0 }
    }

    /// Where a ray that leaves toward `direction` starts: on that side of the surface for certain.
    #[inline]
    pub fn origin_toward(&self, direction: Vec3) -> Vec3 {
        // The point may be off by one error; rounding the sum may cost another.
        let offset =
            3.0 * f64::from(self.error_m) * f64::from(1.0_f32.copysign(self.normal.dot(direction)));
        (self.position.as_dvec3() + self.normal.as_dvec3() * offset).as_vec3()
    }
}
