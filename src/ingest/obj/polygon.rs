//! Faces of more than three corners, cut into triangles.
//!
//! A face that is convex, or at least seen whole from its least corner, becomes a fan. Any other is cut by
//! ear clipping (crate `earcut`) in the plane that fits it best, whose normal is Newell's: half the sum of
//! `p_i x p_(i+1)` (Sutherland, Sproull and Schumacker 1974). The triangles cover the face once and face
//! the side that the order of its corners says.

use earcut::Earcut;
use glam::{DVec2, DVec3, Vec3};

/// A triangle of a fan that turns the other way by this share of the face's area is rounding.
const ROUNDING: f64 = 1e-7;

/// By this share may the area of all triangles differ from that of a face that does not cross itself.
const SLACK: f64 = 1e-6;

/// A face that crosses itself takes time like the square of its corners. A file may have so many squares (one
/// face of 16,384 corners), and more for every corner of a face: what is beyond is not cut by ears.
const MOST_SQUARES: u64 = 1 << 28;
const SQUARES_A_CORNER: u64 = 1 << 7;

/// Cuts faces, and keeps its memory for the next.
pub(super) struct Cutter {
    earcut: Earcut<f64>,
    ears: Vec<u32>,
    squares_left: u64,
}

/// Whether the triangles are what the face is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cut {
    Whole,
    /// The face crosses itself, or is too long: its triangles overlap or leave gaps.
    Approximate,
}

impl Cutter {
    pub(super) fn new() -> Cutter {
        Cutter { earcut: Earcut::new(), ears: Vec::new(), squares_left: MOST_SQUARES }
    }

    fn has_time_for(&mut self, corners: u64) -> bool {
        self.squares_left = self.squares_left.saturating_add(SQUARES_A_CORNER * corners);
        let left = corners.checked_mul(corners).and_then(|sq| self.squares_left.checked_sub(sq));
        self.squares_left = left.unwrap_or(self.squares_left);
        left.is_some()
    }

    /// Calls back with the triangles of a face whose corners are finite, as numbers of its corners.
    pub(super) fn cut(&mut self, corners: &[Vec3], mut triangle: impl FnMut([u32; 3])) -> Cut {
        let count = corners.len() as u32;
        if count <= 3 {
            triangle([0, 1, 2]);
            return Cut::Whole;
        }
        // Which corner the file lists first should not show in the triangles: the least comes first.
        let key = |i: &u32| corners[*i as usize].to_array();
        let least = (0..count).min_by(|a, b| {
            let mut order = key(a).into_iter().zip(key(b)).map(|(a, b)| a.total_cmp(&b));
            order.find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        });
        let first = least.unwrap_or(0);
        let at = |i: u32| ((u64::from(first) + u64::from(i)) % u64::from(count)) as u32;
        let corner = |i: u32| corners[at(i) as usize].as_dvec3();
        // From that corner, so that a small face far away keeps its digits.
        let own = |i: u32| corner(i) - corner(0);
        let fan = || (1..count - 1).map(|i| own(i).cross(own(i + 1)));
        let twice_area: DVec3 = fan().sum();
        let whole = twice_area.length();
        let normal = twice_area / whole;
        let is_fan = whole > 0.0 && fan().all(|part| part.dot(normal) >= -ROUNDING * whole);
        let has_area = fan().any(|part| part != DVec3::ZERO);
        if is_fan || !has_area || whole == 0.0 || !self.has_time_for(corners.len() as u64) {
            (1..count - 1).for_each(|i| triangle([0, i, i + 1].map(at)));
            return if is_fan || !has_area { Cut::Whole } else { Cut::Approximate };
        }
        let (right, up) = normal.any_orthonormal_pair();
        let in_plane = |i: u32| DVec2::new(own(i).dot(right), own(i).dot(up));
        let turn =
            |[a, b, c]: [u32; 3]| (in_plane(b) - in_plane(a)).perp_dot(in_plane(c) - in_plane(a));
        self.ears.clear();
        self.earcut.earcut((0..count).map(|i| in_plane(i).to_array()), &[], &mut self.ears);
        let mut covered = 0.0;
        for ear in self.ears.chunks_exact(3) {
            let [a, b, c] = [ear[0], ear[1], ear[2]];
            let area = turn([a, b, c]);
            covered += area.abs();
            triangle(if area < 0.0 { [a, c, b] } else { [a, b, c] }.map(at));
        }
        match (covered / whole - 1.0).abs() <= SLACK {
            true => Cut::Whole,
            false => Cut::Approximate,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn triangles_of(corners: &[Vec3]) -> (Vec<[u32; 3]>, Cut) {
        let mut found = Vec::new();
        let cut = Cutter::new().cut(corners, |triangle| found.push(triangle));
        (found, cut)
    }

    /// The sum of the triangles' areas, and the length of their sum as vectors.
    fn areas(corners: &[Vec3], triangles: &[[u32; 3]]) -> (f64, f64) {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| corners[i as usize].as_dvec3());
            0.5 * (b - a).cross(c - a)
        };
        let sum: DVec3 = triangles.iter().map(area).sum();
        (triangles.iter().map(|t| area(t).length()).sum(), sum.length())
    }

    proptest! {
        /// Stars about a point, some of whose corners are at one place: simple, and mostly concave.
        #[test]
        fn a_simple_face_is_covered_once_whatever_corner_comes_first(
            radii in prop::collection::vec(0.01f32..1.0, 4..60),
            first in 0usize..60,
            size in -6i32..6,
            far in 0f32..1.0,
        ) {
            let count = radii.len();
            let size = 10f32.powi(size);
            let turned = glam::Quat::from_rotation_x(0.7) * glam::Quat::from_rotation_y(0.4);
            let mut corners: Vec<Vec3> = (0..count)
                .map(|i| {
                    let angle = std::f32::consts::TAU * i as f32 / count as f32;
                    let flat = Vec3::new(angle.cos(), angle.sin(), 0.0) * radii[i] * size;
                    turned * flat + Vec3::splat(far * size)
                })
                .collect();
            let unturned = triangles_of(&corners).0;
            corners.rotate_left(first % count);
            let (triangles, cut) = triangles_of(&corners);
            let named = |i: u32| (i as usize + first) as u32 % count as u32;
            let same: Vec<_> = triangles.iter().map(|triangle| triangle.map(named)).collect();
            prop_assert_eq!(unturned, same, "the first corner shows");
            let (covered, facing) = areas(&corners, &triangles);
            let newell = 0.5 * (0..count).map(|i| {
                let [a, b] = [i, (i + 1) % count].map(|i| (corners[i] - corners[0]).as_dvec3());
                a.cross(b)
            }).sum::<DVec3>().length();
            prop_assert_eq!(cut, Cut::Whole);
            prop_assert!((covered / newell - 1.0).abs() < 1e-4, "{covered} {newell}");
            prop_assert!((facing / newell - 1.0).abs() < 1e-4, "one of them faces backwards");
        }

        #[test]
        fn any_corners_do_no_harm(corners in prop::collection::vec(prop::array::uniform3(-3i8..3), 3..40)) {
            let corners: Vec<Vec3> =
                corners.iter().map(|c| Vec3::from(c.map(f32::from))).collect();
            let (triangles, _) = triangles_of(&corners);
            prop_assert!(triangles.len() <= corners.len());
            prop_assert!(triangles.as_flattened().iter().all(|&i| (i as usize) < corners.len()));
        }
    }

    #[test]
    fn a_face_that_crosses_itself_is_told() {
        let bow =
            [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 3.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        assert_eq!(triangles_of(&bow).1, Cut::Approximate);
        let line = [0.0, 1.0, 2.0, 3.0].map(|x| Vec3::new(x, 0.0, 0.0));
        assert_eq!(triangles_of(&line).1, Cut::Whole, "nothing of it is lost");
    }

    /// Without a bound, a tangle of a million corners takes hours.
    #[test]
    fn a_file_has_so_much_time_for_faces_and_no_more() {
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for (count, faces) in [(1u64 << 10, 300), (1_000_000, 1)] {
            let tangle: Vec<Vec3> =
                (0..count).map(|_| Vec3::new(random(), random(), 0.0)).collect();
            let comb: Vec<Vec3> = (0..count)
                .map(|i| Vec3::new(i as f32, if i % 2 == 0 { 0.0 } else { 1.0 }, 0.0))
                .chain([Vec3::new(count as f32, 2.0, 0.0), Vec3::new(0.0, 2.0, 0.0)])
                .collect();
            for face in [tangle, comb] {
                let mut cutter = Cutter::new();
                let mut triangles = 0;
                for _ in 0..faces {
                    cutter.cut(&face, |_| triangles += 1);
                }
                assert!(triangles >= faces * (count / 2) && triangles <= faces * (count + 2));
                assert!(
                    cutter.squares_left <= MOST_SQUARES + SQUARES_A_CORNER * faces * (count + 2)
                );
            }
        }
    }
}
