//! Directions under transforms that need not be rotations.
//!
//! A node may scale unevenly, shear, mirror or flatten what is below it, and then no rotation
//! describes what it does. A direction goes through the matrix as it is and is made unit again. All
//! of this is in double precision, so that scales from 1e-38 to 1e38 neither overflow nor vanish.

use glam::{Affine3A, DMat3, DVec3};

/// Where a transform aims: the way local -Z goes, unit. -Z itself if the transform flattens it.
pub fn aim(transform: &Affine3A) -> DVec3 {
    (-transform.matrix3.as_dmat3().z_axis).try_normalize().unwrap_or(DVec3::NEG_Z)
}

/// The axes of a light that a transform places, orthonormal, world space: X, Y and Z as columns. Z is opposite to
/// where it [aims](aim), X is as near to the image of X as that allows. Sizes, even uneven ones, do not turn them; a
/// mirror turns Y around.
pub fn light_axes(transform: &Affine3A) -> DMat3 {
    let matrix = transform.matrix3.as_dmat3();
    let z = -aim(transform);
    let across = |axis: DVec3| {
        axis.try_normalize().and_then(|axis| axis.reject_from_normalized(z).try_normalize())
    };
    let x = across(matrix.x_axis).or_else(|| across(matrix.y_axis.cross(z)));
    let x = x.unwrap_or_else(|| z.any_orthonormal_vector());
    let y = z.cross(x) * if mirrors(transform) { -1.0 } else { 1.0 };
    DMat3::from_cols(x, y, z)
}

/// Whether a transform turns a left hand into a right one. A flat transform does not.
pub fn mirrors(transform: &Affine3A) -> bool {
    transform.matrix3.as_dmat3().determinant() < 0.0
}

/// The directions of a local space in the outer one, both ways, and how it stretches them.
#[derive(Clone, Copy, Debug)]
pub struct DirectionMap {
    to_outer: DMat3,
    to_local: DMat3,
    /// Absolute determinant of `to_outer`.
    volume: f64,
}

/// A matrix whose determinant is below this share of the product of its columns' lengths is flat: the
/// rest is rounding of 32-bit numbers.
const FLAT: f64 = 1e-6;

impl DirectionMap {
    /// The map of a transform. A flat transform has no inverse: the axes that it leaves, made
    /// orthonormal, stand for it.
    pub fn of(transform: &Affine3A) -> DirectionMap {
        let matrix = transform.matrix3.as_dmat3();
        let volume = matrix.x_axis.length() * matrix.y_axis.length() * matrix.z_axis.length();
        let is_sound = matrix.determinant().abs() > FLAT * volume;
        let to_outer = if is_sound { matrix } else { axes_left(matrix) };
        let volume = to_outer.determinant().abs();
        DirectionMap { to_outer, to_local: to_outer.inverse(), volume }
    }

    /// A local direction in the outer space, unit.
    #[inline]
    pub fn to_outer(&self, local: DVec3) -> DVec3 {
        (self.to_outer * local).normalize()
    }

    /// An outer direction in the local space, unit.
    #[inline]
    pub fn to_local(&self, outer: DVec3) -> DVec3 {
        (self.to_local * outer).normalize()
    }

    /// Outer solid angle over local solid angle about a unit local direction. For a linear map `A` and
    /// a direction `l` it is `|det A| / |A l|^3`.
    #[inline]
    pub fn stretch(&self, local: DVec3) -> f64 {
        self.volume / (self.to_outer * local).length().powi(3)
    }
}

/// A rotation that agrees with the axes which a flat matrix leaves.
fn axes_left(matrix: DMat3) -> DMat3 {
    let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let longest = |vectors: [DVec3; 3]| {
        let lengths2 = vectors.map(|vector| vector.length_squared());
        (0..3).fold(0, |best, i| if lengths2[i] > lengths2[best] { i } else { best })
    };
    let across = [0, 1, 2].map(|i| axes[(i + 1) % 3].cross(axes[(i + 2) % 3]));
    let lost = longest(across);
    // Two axes are left, or one, or none.
    let (first, columns) = match (across[lost].try_normalize(), axes[longest(axes)].try_normalize())
    {
        (Some(normal), _) => {
            let next = axes[(lost + 1) % 3].normalize();
            (lost, [normal, next, normal.cross(next)])
        }
        (None, Some(axis)) => {
            let side = axis.any_orthonormal_vector();
            (longest(axes), [axis, side, axis.cross(side)])
        }
        (None, None) => return DMat3::IDENTITY,
    };
    let mut turned = columns;
    (0..3).for_each(|i| turned[(first + i) % 3] = columns[i]);
    DMat3::from_cols(turned[0], turned[1], turned[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DQuat};
    use proptest::prelude::*;

    fn placed(turn: DQuat, scale: DVec3, then: DQuat) -> Affine3A {
        (DAffine3::from_quat(then)
            * DAffine3::from_scale_rotation_translation(scale, turn, DVec3::ZERO))
        .as_affine3a()
    }

    fn turn() -> impl Strategy<Value = DQuat> {
        prop::array::uniform3(-3.0..3.0)
            .prop_map(|[a, b, c]| DQuat::from_euler(glam::EulerRot::XYZ, a, b, c))
    }

    /// Log-uniform, of either sign.
    fn scale(decades: f64) -> impl Strategy<Value = DVec3> {
        let one = (-decades..decades, any::<bool>())
            .prop_map(|(e, flip)| 10f64.powf(e) * if flip { -1.0 } else { 1.0 });
        prop::array::uniform3(one).prop_map(DVec3::from)
    }

    proptest! {
        #[test]
        fn both_ways_agree_and_the_stretch_is_the_change_of_solid_angle(
            a in turn(), b in turn(), uneven in scale(1.5), size in -30.0..30.0, at in turn()
        ) {
            // Scale between two rotations: sheared and mirrored too.
            let whole = DMat3::from_quat(a) * DMat3::from_diagonal(uneven) * DMat3::from_quat(b);
            let whole = whole * 10f64.powf(size);
            let map = DirectionMap::of(&Affine3A::from_mat3(whole.as_mat3()));
            let w = at * DVec3::Z;
            let l = map.to_local(w);
            prop_assert!((map.to_outer(l) - w).length() < 1e-9);
            // Two small steps span a small solid angle here and there.
            let step = 1e-6;
            let (u, v) = (at * DVec3::X * step, at * DVec3::Y * step);
            let [lu, lv] = [u, v].map(|d| map.to_local((w + d).normalize()) - l);
            let ratio = step * step / lu.cross(lv).length();
            prop_assert!((map.stretch(l) / ratio - 1.0).abs() < 1e-2, "{} {ratio}", map.stretch(l));
        }

        #[test]
        fn a_transform_aims_where_its_matrix_takes_minus_z(
            a in turn(), b in turn(), uneven in scale(18.0)
        ) {
            let transform = placed(a, uneven, b);
            let exact = -(b * (a * DVec3::Z * uneven.z)).normalize();
            prop_assert!((aim(&transform) - exact).length() < 1e-6);
            prop_assert_eq!(mirrors(&transform), uneven.x * uneven.y * uneven.z < 0.0);
        }
    }

    #[test]
    fn a_flat_transform_keeps_the_axes_it_leaves() {
        let a = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 1.9);
        for lost in 0..3 {
            let mut scale = DVec3::new(2.0, 5.0, 0.1);
            scale[lost] = 0.0;
            let map = DirectionMap::of(&placed(a, scale, DQuat::IDENTITY));
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                assert!((map.to_outer(axis) - a * axis).length() < 1e-6, "{lost} {axis}");
            }
            assert!((map.stretch(DVec3::X) - 1.0).abs() < 1e-12);
        }
        let line = DirectionMap::of(&placed(a, DVec3::new(0.0, 3.0, 0.0), DQuat::IDENTITY));
        assert!((line.to_outer(DVec3::Y) - a * DVec3::Y).length() < 1e-6);
        let point = DirectionMap::of(&placed(a, DVec3::ZERO, DQuat::IDENTITY));
        assert_eq!(point.to_outer(DVec3::Y), DVec3::Y);
        assert_eq!(aim(&placed(a, DVec3::ZERO, DQuat::IDENTITY)), DVec3::NEG_Z);
        // Flat, and turned on both sides: zero up to the rounding of 32 bits.
        let both = DMat3::from_quat(a)
            * DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0))
            * DMat3::from_quat(a);
        let map = DirectionMap::of(&Affine3A::from_mat3(both.as_mat3()));
        assert!((map.stretch(DVec3::X) - 1.0).abs() < 1e-12);
    }
}
