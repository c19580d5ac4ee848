//! Importance on a stretch of a ray through a medium.
//!
//! The seed's "Extending to volume render": the nearest point of the stretch to the cluster's centre
//! and, independently, the largest cosine that any point of it has to the cluster's axis; both are
//! assumed to coincide, so light is never underestimated. Where the seed takes `1/d`, this takes
//! the integral of `1/r^2` over the stretch, `(theta_b - theta_a) / d` (HPG 2018, equation 4), which
//! also knows how long the stretch is.

use super::importance::{Cluster, Factors, SOFTENING, Sight, View, spread};
use super::viewer::Viewer;
use crate::math::Similarity;
use glam::Vec3;

/// A stretch of a ray, in a medium, that light is wanted for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Where it begins, world space, metres.
    pub origin: Vec3,
    /// Where it goes, unit, world space.
    pub direction: Vec3,
    /// How long it is, metres; may be infinite.
    pub length: f32,
}

/// Where a cluster stands to a segment.
struct Standing {
    /// From the centre to the segment's begin.
    to_origin: Vec3,
    /// The segment's begin and end, seen from the point of its line nearest to the centre, metres.
    begin: f32,
    end: f32,
    /// From the centre to the line, and to the nearest point of the segment, squared, m^2.
    line2: f32,
    nearest2: f32,
}

impl Segment {
    #[inline(always)]
    fn standing(&self, center: Vec3) -> Standing {
        let to_origin = self.origin - center;
        let begin = to_origin.dot(self.direction);
        let end = begin + self.length;
        // Not `d^2 - begin^2`, which cancels.
        let line2 = (to_origin - begin * self.direction).length_squared();
        let beyond = begin.max(0.0) + end.min(0.0);
        Standing { to_origin, begin, end, line2, nearest2: line2 + beyond * beyond }
    }

    /// The largest cosine between an axis and a direction from a point, relative to which the
    /// segment begins at `from`, to any point of the segment; of either sign if `two_sided`. The
    /// cosine along the line has a single extremum, at the zero of its derivative.
    #[inline(always)]
    fn largest_cosine(&self, from: Vec3, axis: Vec3, two_sided: bool) -> f32 {
        let (ad, aw) = (axis.dot(self.direction), axis.dot(from));
        let (ww, wd) = (from.length_squared(), from.dot(self.direction));
        let at = |t: f32| {
            let cosine = (from + t * self.direction).normalize_or_zero().dot(axis);
            if two_sided { cosine.abs() } else { cosine }
        };
        let last = if self.length.is_finite() {
            at(self.length)
        } else if two_sided {
            ad.abs()
        } else {
            ad
        };
        let extremum = (ad * ww - aw * wd) / (aw - ad * wd);
        let inside = extremum > 0.0 && extremum < self.length;
        let middle = if inside { at(extremum) } else { -1.0 };
        at(0.0).max(last).max(middle)
    }
}

impl Viewer for Segment {
    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        let [center, half, axis] =
            [cluster.center, cluster.half_extent, cluster.axis].map(Vec3::from_array);
        let standing = self.standing(center);
        let r2 = half.length_squared();

        // Emission, as from a point, but at the largest cosine and the widest sphere.
        let inside = standing.nearest2 <= r2;
        let (sin_u, cos_u) = if inside {
            (1.0, 0.0)
        } else {
            let d2 = standing.nearest2;
            ((r2 / d2).sqrt(), ((d2 - r2) / d2).sqrt())
        };
        let axis = axis.normalize_or(Vec3::Z);
        let cosine = self.largest_cosine(standing.to_origin, axis, cluster.two_sided);
        let (emission, cos_o) = cluster.emission(cosine, inside, sin_u, cos_u);
        let is_dark = emission == 0.0;

        // The integral of 1 / (line^2 + t^2), softened like the square of a distance elsewhere.
        let line = (standing.line2 + SOFTENING * r2).sqrt();
        let angle = if self.length.is_finite() {
            let across = line * self.length;
            across.atan2(line * line + standing.begin * standing.end)
        } else {
            std::f32::consts::FRAC_PI_2 - standing.begin.atan2(line)
        };
        let reach = (standing.nearest2.sqrt() - r2.sqrt()).max(0.0);
        let product = emission * cluster.window(reach * reach) * angle.max(f32::MIN_POSITIVE);
        Factors {
            product: if is_dark { 0.0 } else { product },
            decay: line,
            spread: spread(r2, standing.nearest2, cos_o, cluster.cos_theta_e),
            sight: Sight::default(),
        }
    }

    fn glare(&self, cluster: &Cluster) -> f64 {
        let standing = self.standing(Vec3::from_array(cluster.center));
        let radius = Vec3::from_array(cluster.half_extent).length();
        let view =
            View { radius: f64::from(radius), distance: f64::from(standing.nearest2).sqrt() };
        // A phase function has no peak to speak of.
        view.solid_angle() * 0.25 * std::f64::consts::FRAC_1_PI
    }

    /// It is an irradiance times a length.
    fn unit_of_importance(&self, scale: f64) -> f64 {
        1.0 / scale
    }

    fn within(&self, space: &Similarity) -> Segment {
        Segment {
            origin: space.point(self.origin),
            direction: space.direction(self.direction),
            length: self.length * space.scale(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::{Aabb, Cone, LightBounds};
    use crate::light_tree::node::{Link, Node};
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1f32..1.0).prop_map(Vec3::from)
    }

    fn segment() -> impl Strategy<Value = Segment> {
        let length = prop_oneof![4 => 0.001f32..10.0, 1 => Just(f32::INFINITY)];
        (point(), point(), length).prop_filter_map("no direction", |(origin, to, length)| {
            Some(Segment { origin, direction: to.try_normalize()?, length })
        })
    }

    proptest! {
        #[test]
        fn no_point_of_the_segment_has_a_larger_cosine(
            segment in segment(), from in point(), axis in point(), two_sided in any::<bool>()
        ) {
            prop_assume!(axis.length() > 0.1 && from.length() > 1e-3);
            let axis = axis.normalize();
            let largest = segment.largest_cosine(from, axis, two_sided);
            for i in 0..=200 {
                let t = segment.length.min(100.0) * i as f32 / 200.0;
                let cosine = (from + t * segment.direction).normalize_or_zero().dot(axis);
                let cosine = if two_sided { cosine.abs() } else { cosine };
                prop_assert!(cosine <= largest + 1e-4, "{cosine} {largest}");
            }
        }

        /// A point light's importance is the integral over the segment of `I / d^2`.
        #[test]
        fn a_point_is_integrated_exactly(segment in segment(), place in point()) {
            let to = segment.standing(place);
            prop_assume!(segment.length.is_finite() && to.nearest2 > 1e-2);
            let bounds = LightBounds {
                aabb: Aabb::around([place]), cone: Cone::ALL, energy: 2.0, range_m: f32::INFINITY,
            };
            let importance = Node::encode(&bounds, Link::Emitter(0)).importance(&segment);
            const STEPS: u32 = 4000;
            let step = f64::from(segment.length) / f64::from(STEPS);
            let sum: f64 = (0..STEPS).map(|i| {
                let t = (f64::from(i) + 0.5) * step;
                let p = segment.origin.as_dvec3() + t * segment.direction.as_dvec3();
                2.0 * step / (p - place.as_dvec3()).length_squared()
            }).sum();
            prop_assert!((importance / sum - 1.0).abs() < 1e-3, "{importance} {sum}");
        }

        /// Dark means dark at every point of the segment.
        #[test]
        fn a_dark_segment_has_no_lit_point(
            segment in segment(), place in point(), axis in point(), size in 0f32..0.5,
            theta_e in 0.1f32..1.57, range_m in prop_oneof![Just(f32::INFINITY), 0.01f32..2.0]
        ) {
            prop_assume!(axis.length() > 0.1);
            let cone = Cone::spot(axis.normalize(), theta_e);
            let aabb = Aabb { min: place - size, max: place + size };
            let node = Node::encode(&LightBounds { aabb, cone, energy: 1.0, range_m }, Link::Emitter(0));
            if node.importance(&segment) > 0.0 {
                return Ok(());
            }
            for i in 0..=100 {
                let t = segment.length.min(100.0) * i as f32 / 100.0;
                let p = segment.origin + t * segment.direction;
                for corner in 0..27 {
                    let at = |n: i32| (corner / 3i32.pow(n as u32) % 3 - 1) as f32 * size;
                    let light = place + Vec3::new(at(0), at(1), at(2));
                    let lit = (p - light).normalize_or_zero().dot(cone.axis) > theta_e.cos() + 1e-4;
                    prop_assert!(!lit || (p - light).length() > range_m);
                }
            }
        }
    }
}
