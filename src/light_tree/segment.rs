//! Importance on a stretch of a ray through a medium.
//!
//! The seed's "Extending to volume render": the nearest point of the stretch to the cluster's centre
//! and, independently, the largest cosine that any point of it has to the cluster's axis; both are
//! assumed to coincide, so light is never underestimated. Where the seed takes `1/d`, this takes
//! the integral of `1/r^2` over the stretch, `(theta_b - theta_a) / d` (HPG 2018, equation 4), which
//! also knows how long the stretch is.

use super::importance::{Cluster, Factors, SOFTENING, Sight, View, spread_of_distance};
use super::viewer::Viewer;
use crate::math::Similarity;
use glam::{DVec3, Vec3};

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

/// Where a segment runs, seen from the centre of a cluster. In double precision: beside a long
/// stretch that passes close by, single precision knows neither how close nor on which side.
struct Passage {
    /// From the centre to the nearest point of the segment's line.
    line: DVec3,
    /// Unit.
    direction: DVec3,
    /// Where the segment begins and ends, from that point on along the line, metres.
    begin: f64,
    end: f64,
    /// From the centre to the line, and to the nearest point of the segment, squared, m^2.
    line2: f64,
    nearest2: f64,
    /// By how much single precision may misplace a point of the segment that is near, metres.
    blur: f64,
}

impl Segment {
    #[inline(always)]
    fn passage(&self, center: Vec3) -> Passage {
        let direction = self.direction.as_dvec3().normalize();
        let to_origin = self.origin.as_dvec3() - center.as_dvec3();
        let begin = to_origin.dot(direction);
        let end = begin + f64::from(self.length);
        let line = to_origin - begin * direction;
        let line2 = line.length_squared();
        let beyond = begin.max(0.0) + end.min(0.0);
        // Who draws a point computes `origin + t * direction` with coordinates of this size.
        let size = f64::from(self.origin.abs().max_element()) + begin.abs();
        let blur = 2.0 * f64::from(f32::EPSILON) * size;
        Passage { line, direction, begin, end, line2, nearest2: line2 + beyond * beyond, blur }
    }
}

impl Passage {
    /// The largest cosine between an axis and a direction from the centre to any point of the
    /// segment; of either sign if `two_sided`. Along the line, at a distance `s` from its nearest
    /// point, the cosine is `(line.axis + s direction.axis) / sqrt(line^2 + s^2)`. Its one extremum,
    /// at `s = line^2 direction.axis / line.axis`, is a maximum if `line.axis` is positive.
    #[inline(always)]
    fn largest_cosine(&self, axis: DVec3, two_sided: bool) -> f64 {
        let (beside, along) = (self.line.dot(axis), self.direction.dot(axis));
        let at = |s: f64| {
            let cosine = if s.is_finite() {
                (beside + s * along) / (self.line2 + s * s).sqrt().max(f64::MIN_POSITIVE)
            } else {
                along
            };
            if two_sided { cosine.abs() } else { cosine }
        };
        let extremum = self.line2 * along / beside;
        let inside = extremum > self.begin && extremum < self.end;
        let middle = if inside { at(extremum) } else { -1.0 };
        at(self.begin).max(at(self.end)).max(middle).clamp(-1.0, 1.0)
    }

    /// The angle under which a point at a distance from the line sees the segment.
    #[inline(always)]
    fn angle(&self, distance: f64) -> f64 {
        if self.end.is_finite() {
            let across = distance * (self.end - self.begin);
            across.atan2(distance * distance + self.begin * self.end)
        } else {
            std::f64::consts::FRAC_PI_2 - self.begin.atan2(distance)
        }
    }
}

impl Viewer for Segment {
    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        let [center, half, axis] =
            [cluster.center, cluster.half_extent, cluster.axis].map(Vec3::from_array);
        let passage = self.passage(center);
        let radius = half.as_dvec3().length();
        let r2 = radius * radius;

        // Emission, as from a point, but at the largest cosine and the widest sphere.
        let reach = radius + passage.blur;
        let inside = passage.nearest2 <= reach * reach;
        let sin2_u = if inside { 1.0 } else { reach * reach / passage.nearest2 };
        let of_u = (sin2_u.sqrt() as f32, (1.0 - sin2_u).sqrt() as f32);
        let axis = axis.as_dvec3().normalize_or(DVec3::Z);
        let cosine = passage.largest_cosine(axis, cluster.two_sided);
        let sine = (1.0 - cosine * cosine).sqrt();
        let (emission, cos_o) = cluster.emission((cosine as f32, sine as f32), inside, of_u);
        let is_dark = emission == 0.0;

        // The integral of 1 / (line^2 + t^2), softened like the square of a distance elsewhere.
        let line = (passage.line2 + f64::from(SOFTENING) * r2).sqrt();
        let angle = passage.angle(line) as f32;
        let apart = (passage.nearest2.sqrt() - reach).max(0.0) as f32;
        let product = emission * cluster.window(apart * apart) * angle.max(f32::MIN_POSITIVE);
        Factors {
            product: if is_dark { 0.0 } else { product },
            decay: line as f32,
            spread: (spread_of_distance(r2 as f32, passage.nearest2 as f32)
                + cluster.missed(cos_o))
            .max(0.0),
            sight: Sight::default(),
        }
    }

    fn glare(&self, cluster: &Cluster) -> f64 {
        let passage = self.passage(Vec3::from_array(cluster.center));
        let radius = Vec3::from_array(cluster.half_extent).as_dvec3().length();
        let view = View { radius, distance: passage.nearest2.sqrt() };
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
            segment in segment(), center in point(), axis in point(), two_sided in any::<bool>()
        ) {
            prop_assume!(axis.length() > 0.1);
            let axis = axis.as_dvec3().normalize();
            let largest = segment.passage(center).largest_cosine(axis, two_sided);
            let cosine = |t: f64| {
                let p = segment.origin.as_dvec3() + t * segment.direction.as_dvec3().normalize();
                let cosine = (p - center.as_dvec3()).normalize_or_zero().dot(axis);
                if two_sided { cosine.abs() } else { cosine }
            };
            // Equal steps of a segment; steps that grow, out to 1000, of a ray without an end.
            let way = |i: u32| {
                let s = f64::from(i) / 1001.0;
                if segment.length.is_finite() { s * f64::from(segment.length) } else { s / (1.0 - s) }
            };
            let seen = (0..=1000).map(|i| cosine(way(i))).fold(-1.0, f64::max);
            prop_assert!(seen <= largest + 1e-12, "{seen} {largest}");
            // What is closer than some steps is passed too fast to be seen.
            let passage = segment.passage(center);
            let step = if segment.length.is_finite() { way(1) } else { 0.02 };
            prop_assert!(seen >= largest - 2e-2 || passage.nearest2 < (2.5 * step).powi(2));
        }

        /// A point light's importance is the integral over the segment of `I / d^2`.
        #[test]
        fn a_point_is_integrated_exactly(segment in segment(), place in point()) {
            let passage = segment.passage(place);
            prop_assume!(segment.length.is_finite() && passage.nearest2 > 1e-2);
            let bounds = LightBounds::of_emitter(Aabb::around([place]), Cone::ALL, 2.0, f32::INFINITY);
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
            let node = Node::encode(&LightBounds::of_emitter(aabb, cone, 1.0, range_m), Link::Emitter(0));
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
