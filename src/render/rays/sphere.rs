//! Spheres, exactly.

use super::triangles::Ray;
use glam::DVec3;

/// A sphere light at one time. World space, metres.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// Index into [`Scene::lights`](crate::scene::Scene::lights).
    pub light: u32,
    /// World space.
    pub center: DVec3,
    /// Greater than 0.
    pub radius_m: f64,
}

impl Sphere {
    /// The nearest distance in `(0, tmax)` at which the ray goes through the surface, from
    /// outside or from inside. The discriminant is taken from the ray's nearest point to the
    /// centre (Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere
    /// Intersection"), which keeps its digits far away.
    pub fn distance(&self, ray: &Ray, tmax: f64) -> Option<f64> {
        let to_center = self.center - ray.origin;
        let length2 = ray.direction.length_squared();
        let nearest = to_center.dot(ray.direction) / length2;
        let miss = to_center - nearest * ray.direction;
        let inside2 = self.radius_m * self.radius_m - miss.length_squared();
        if inside2 <= 0.0 {
            return None;
        }
        let half_chord = (inside2 / length2).sqrt();
        [nearest - half_chord, nearest + half_chord].into_iter().find(|&t| t > 0.0 && t < tmax)
    }
}
