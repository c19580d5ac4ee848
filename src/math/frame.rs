//! Orthonormal frames.

use glam::Vec3;

/// An orthonormal frame around a unit `normal`: local +Z is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local +X, in the outer space.
    pub tangent: Vec3,
    /// Local +Y, in the outer space.
    pub bitangent: Vec3,
    /// Local +Z, in the outer space.
    pub normal: Vec3,
}

impl Frame {
    /// Any frame around a unit normal (Duff et al. 2017, "Building an Orthonormal Basis,
    /// Revisited"): no branch, no bad direction.
    #[inline]
    pub fn around(normal: Vec3) -> Frame {
        let sign = 1.0_f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Frame {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// From the outer space to the frame's.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.tangent), v.dot(self.bitangent), v.dot(self.normal))
    }

    /// From the frame's space to the outer.
    #[inline]
    pub fn to_outer(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_orthonormal_and_right_handed() {
        let directions =
            [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(1e-8, 0.0, -1.0), Vec3::new(0.3, -0.5, 0.8)];
        for normal in directions.map(Vec3::normalize) {
            let frame = Frame::around(normal);
            assert!(frame.tangent.dot(frame.bitangent).abs() < 1e-6);
            assert!(frame.tangent.dot(normal).abs() < 1e-6);
            assert!((frame.tangent.cross(frame.bitangent) - normal).length() < 1e-6);
            let v = Vec3::new(0.1, 0.2, 0.3);
            assert!((frame.to_outer(frame.to_local(v)) - v).length() < 1e-6);
        }
    }
}
