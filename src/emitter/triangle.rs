//! Sampling a triangle as seen from a point.
//!
//! A triangle that spans a good part of the view is sampled by solid angle (Arvo 1995, "Stratified
//! Sampling of Spherical Triangles"), which removes the noise of a near area light. A small one is
//! sampled by area, which is cheaper and just as good there. The choice depends on the point and the
//! triangle alone, so the density of a direction that was found another way is known too.
//!
//! Products of edges are taken in double precision: those of a sliver cancel in 32 bits, and those of
//! a triangle of 1e-12 m vanish.

use crate::math::warp;
use glam::{DVec3, Vec2, Vec3};

/// Triangles whose edges all are below this share of the distance to a corner, squared, are small.
const SMALL2: f64 = 5e-4;
/// Solid angles in steradians that are sampled by solid angle where the triangle is not small. Needles
/// are below, and would cancel; above is a point in the triangle's plane.
const SPHERICAL_SR: std::ops::Range<f64> = 1e-5..6.283_185_2;

/// A triangle in world space.
#[derive(Clone, Copy, Debug)]
pub struct WorldTriangle {
    /// Corners, counter-clockwise from the front, metres.
    pub corners: [Vec3; 3],
}

/// A point of a triangle, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub struct TriangleSample {
    /// Barycentric coordinates of the second and third corner.
    pub barycentric: Vec2,
    /// Density over solid angle, 1/sr.
    pub pdf: f32,
}

impl WorldTriangle {
    /// Normal with twice the triangle's area as its length, m^2.
    pub fn area_normal(&self) -> DVec3 {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec3());
        (b - a).cross(c - a)
    }

    /// Unit normal; zero if the triangle has no area.
    pub fn normal(&self) -> Vec3 {
        self.area_normal().normalize_or_zero().as_vec3()
    }

    /// Area, m^2.
    pub fn area(&self) -> f32 {
        (0.5 * self.area_normal().length()) as f32
    }

    /// The largest coordinate of a corner, metres.
    pub fn magnitude_m(&self) -> f32 {
        self.corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f32::max)
    }

    /// The point with some barycentric coordinates.
    pub fn at(&self, barycentric: Vec2) -> Vec3 {
        let [a, b, c] = self.corners;
        a + (b - a) * barycentric.x + (c - a) * barycentric.y
    }

    /// A point of the triangle for a viewer; `None` where the triangle is seen edge-on.
    pub fn sample(&self, from: Vec3, u: Vec2) -> Option<TriangleSample> {
        if let Some(view) = SphericalTriangle::of(self, from) {
            let direction = view.direction(u);
            let barycentric = self.barycentric_along(from, direction)?;
            return Some(TriangleSample { barycentric, pdf: (1.0 / view.solid_angle) as f32 });
        }
        let barycentric = warp::triangle(u);
        let pdf = self.area_pdf(from, self.at(barycentric))?;
        Some(TriangleSample { barycentric, pdf })
    }

    /// The density over solid angle with which [`sample`](Self::sample) finds a point of the
    /// triangle; 0 if it never does.
    pub fn pdf(&self, from: Vec3, point: Vec3) -> f32 {
        match SphericalTriangle::of(self, from) {
            Some(view) => (1.0 / view.solid_angle) as f32,
            None => self.area_pdf(from, point).unwrap_or(0.0),
        }
    }

    /// Density over solid angle of a point taken evenly over the area: `d^2 / (cos A)`.
    fn area_pdf(&self, from: Vec3, point: Vec3) -> Option<f32> {
        let (normal, to_point) = (self.area_normal(), point.as_dvec3() - from.as_dvec3());
        let d2 = to_point.length_squared();
        let projected = 0.5 * normal.dot(to_point).abs();
        let pdf = (d2 * d2.sqrt() / projected) as f32;
        (pdf.is_finite() && pdf > 0.0).then_some(pdf)
    }

    /// Where a ray towards the triangle meets its plane, brought inside.
    fn barycentric_along(&self, from: Vec3, direction: DVec3) -> Option<Vec2> {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec3() - from.as_dvec3());
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        let x = -a.dot(p) / determinant;
        let y = -direction.dot(a.cross(ab)) / determinant;
        if !(x.is_finite() && y.is_finite()) {
            return None;
        }
        let (x, y) = (x.clamp(0.0, 1.0), y.clamp(0.0, 1.0));
        let excess = (x + y).max(1.0);
        Some(Vec2::new((x / excess) as f32, (y / excess) as f32))
    }
}

/// A triangle projected onto the unit sphere around a viewer.
struct SphericalTriangle {
    a: DVec3,
    b: DVec3,
    c: DVec3,
    /// The angle at `a`.
    cos_alpha: f64,
    sin_alpha: f64,
    solid_angle: f64,
}

impl SphericalTriangle {
    /// The view of a triangle, if it is one that is sampled by solid angle.
    fn of(triangle: &WorldTriangle, from: Vec3) -> Option<SphericalTriangle> {
        let corners = triangle.corners.map(|corner| corner.as_dvec3() - from.as_dvec3());
        // A cheap bound first: most triangles of a mesh light are far too small.
        let nearest2 = corners.iter().map(|c| c.length_squared()).fold(f64::INFINITY, f64::min);
        let longest2 = (corners[1] - corners[0])
            .length_squared()
            .max((corners[2] - corners[0]).length_squared())
            .max((corners[2] - corners[1]).length_squared());
        if longest2 < SMALL2 * nearest2 {
            return None;
        }
        let [a, b, c] = corners.map(DVec3::try_normalize);
        let (a, b, c) = (a?, b?, c?);
        // Van Oosterom and Strackee 1983.
        let volume = a.dot(b.cross(c)).abs();
        let solid_angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        if !SPHERICAL_SR.contains(&solid_angle) {
            return None;
        }
        let normal_ab = a.cross(b).try_normalize()?;
        let normal_ac = a.cross(c).try_normalize()?;
        let cos_alpha = normal_ab.dot(normal_ac).clamp(-1.0, 1.0);
        let sin_alpha = normal_ab.cross(normal_ac).length();
        (sin_alpha > 1e-9).then_some(SphericalTriangle {
            a,
            b,
            c,
            cos_alpha,
            sin_alpha,
            solid_angle,
        })
    }

    /// A direction inside, evenly over the solid angle.
    fn direction(&self, u: Vec2) -> DVec3 {
        let (sin_alpha, cos_alpha) = (self.sin_alpha, self.cos_alpha);
        let alpha = sin_alpha.atan2(cos_alpha);
        let (s, t) = (f64::from(u.x) * self.solid_angle - alpha).sin_cos();
        let (p, q) = (t - cos_alpha, s + sin_alpha * self.a.dot(self.b));
        let numerator = (q * t - p * s) * cos_alpha - q;
        let denominator = (q * s + p * t) * sin_alpha;
        // Both vanish only where `a` and `b` coincide; then any corner will do.
        let cosine = if denominator.abs() < 1e-300 { 1.0 } else { numerator / denominator };
        let corner = on_arc(self.a, self.c, cosine.clamp(-1.0, 1.0));
        let height = 1.0 - f64::from(u.y) * (1.0 - corner.dot(self.b));
        on_arc(self.b, corner, height.clamp(-1.0, 1.0))
    }
}

/// The point of the great arc from `from` towards `to` whose cosine to `from` is given.
fn on_arc(from: DVec3, to: DVec3, cosine: f64) -> DVec3 {
    let across = (to - from * from.dot(to)).normalize_or_zero();
    from * cosine + across * (1.0 - cosine * cosine).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(size: f32) -> WorldTriangle {
        let corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.2], [0.2, 1.0, 0.9]];
        WorldTriangle { corners: corners.map(|c| Vec3::from(c) * Vec3::new(size, size, 1.0)) }
    }

    /// Mean over a grid of `f(point) / pdf`, the estimate of its integral over solid angle.
    fn integrate(triangle: &WorldTriangle, from: Vec3, f: impl Fn(Vec3) -> f64) -> f64 {
        let n = 200;
        let cell = |i: usize| (i as f32 + 0.5) / n as f32;
        (0..n * n)
            .filter_map(|i| triangle.sample(from, Vec2::new(cell(i % n), cell(i / n))))
            .map(|s| f(triangle.at(s.barycentric)) / f64::from(s.pdf))
            .sum::<f64>()
            / (n * n) as f64
    }

    /// Irradiance from a polygon of radiance 1 on a surface that faces +Z (Lambert's formula).
    fn irradiance(triangle: &WorldTriangle) -> f64 {
        let c = triangle.corners.map(|corner| corner.as_dvec3().normalize());
        let edge = |a: DVec3, b: DVec3| {
            let across = a.cross(b);
            across.normalize().z * across.length().atan2(a.dot(b))
        };
        (0..3).map(|i| edge(c[i], c[(i + 1) % 3])).sum::<f64>().abs() / 2.0
    }

    #[test]
    fn near_and_far_triangles_give_lamberts_irradiance() {
        for size in [30.0, 3.0, 1.0, 0.1, 0.01, 1e-3] {
            let triangle = triangle(size);
            let cosine = |p: Vec3| f64::from(p.normalize().z);
            let (got, exact) = (integrate(&triangle, Vec3::ZERO, cosine), irradiance(&triangle));
            assert!((got / exact - 1.0).abs() < 3e-3, "{size}: {got} {exact}");
        }
    }

    /// Slivers, overhead and aside, 1e-9 to 1 as wide as long, in scenes of 1e-9 to 1e9 metres.
    #[test]
    fn slivers_of_any_width_and_size_give_lamberts_irradiance() {
        for step in 0..=18 {
            let width = 10f32.powf(-0.5 * step as f32);
            for scale in [1e-9f32, 1.0, 1e9] {
                for [x, z] in [[0.0, 0.5], [0.3, 0.1], [2.0, 1.0]] {
                    // From zero, so that no width is lost in a coordinate.
                    let corners = [[-1.0 + x, 0.0, z], [1.0 + x, 0.0, z], [x, width, z]];
                    let corners = corners.map(|c| Vec3::from(c) * scale);
                    let triangle = WorldTriangle { corners };
                    let cosine = |p: Vec3| p.as_dvec3().normalize().z;
                    let got = integrate(&triangle, Vec3::ZERO, cosine);
                    let exact = irradiance(&triangle);
                    let what = format!("{width} wide at {x} {z}, times {scale}");
                    assert!((got / exact - 1.0).abs() < 5e-3, "{what}: {got} {exact}");
                }
            }
        }
    }

    /// A viewer just below a triangle sees half the sphere filled: no direction may be missed.
    #[test]
    fn a_touching_triangle_fills_the_sky() {
        for step in 0..=24 {
            let height = 10f32.powf(-0.25 * step as f32);
            let corners = [[-1.0, -1.0, height], [2.0, -1.0, height], [-1.0, 2.0, height]];
            let triangle = WorldTriangle { corners: corners.map(Vec3::from) };
            let cosine = |p: Vec3| p.as_dvec3().normalize().z;
            let (got, exact) = (integrate(&triangle, Vec3::ZERO, cosine), irradiance(&triangle));
            assert!((got / exact - 1.0).abs() < 5e-3, "{height}: {got} {exact}");
        }
    }

    #[test]
    fn the_density_is_told_for_any_point() {
        for size in [3.0, 1.0, 0.1, 0.01] {
            let triangle = triangle(size);
            for i in 0..100 {
                let u = Vec2::new((i as f32 * 0.37).fract(), (i as f32 * 0.71).fract());
                let sample = triangle.sample(Vec3::ZERO, u).unwrap();
                let told = triangle.pdf(Vec3::ZERO, triangle.at(sample.barycentric));
                assert!((sample.pdf / told - 1.0).abs() < 1e-4, "{size}");
            }
        }
    }

    #[test]
    fn hard_views_stay_finite() {
        let flat = WorldTriangle { corners: [Vec3::X, Vec3::Y, -Vec3::X] };
        let sliver =
            WorldTriangle { corners: [Vec3::X, Vec3::X * 1.0001, Vec3::new(1.0, 1e-6, 0.0)] };
        let point = WorldTriangle { corners: [Vec3::Z; 3] };
        let viewers = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 0.1, 0.0), Vec3::new(0.2, 0.1, 1e-6)];
        for triangle in [flat, sliver, point] {
            for from in viewers {
                for u in [Vec2::ZERO, Vec2::splat(0.5), Vec2::splat(1.0 - f32::EPSILON / 2.0)] {
                    if let Some(sample) = triangle.sample(from, u) {
                        assert!(sample.pdf > 0.0 && sample.pdf.is_finite());
                        assert!(sample.barycentric.min_element() >= 0.0);
                        assert!(sample.barycentric.element_sum() <= 1.0 + 1e-6);
                    }
                }
            }
        }
    }
}
