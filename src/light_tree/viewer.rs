//! Who asks for light: a point of a surface, a point of a medium, or a stretch of a ray.
//!
//! A [`Viewer`] tells what a cluster may send to it and how uncertain that estimate is. The one
//! description is shared by sampling and by its probability, so that they cannot disagree about
//! where they stand. Viewers are copied into the space of a shared subtree when a walk enters it.

use super::importance::{Cluster, Factors, factors};
use crate::math::Similarity;
use glam::Vec3;

/// Something that light is wanted for. What a `Cluster` is stays inside this room, and so do the
/// implementations.
pub trait Viewer: Copy {
    /// What the importance of a cluster is made of, and how uncertain it is.
    fn factors(&self, cluster: &Cluster) -> Factors;

    /// The seed's test of splitting: the solid angle of a cluster times the peak of the BSDF towards
    /// it.
    fn glare(&self, cluster: &Cluster) -> f64;

    /// What an importance in a space whose lengths are `scale` times as long is worth in this one,
    /// if energies are scaled by its square: an irradiance is worth the same.
    fn unit_of_importance(&self, _scale: f64) -> f64 {
        1.0
    }

    /// The same viewer in another space.
    fn within(&self, space: &Similarity) -> Self;
}

/// A point where light is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// World space, metres.
    pub point: Vec3,
    /// Unit shading normal on the side that is lit, world space; zero if light from every
    /// direction counts (a point in a medium).
    pub normal: Vec3,
}

/// A viewer that knows nothing of the lights' orientations: with a receiver that has no normal, the
/// middle picture of the seed's "Results", for comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceOnly<V>(pub V);

/// A receiver that says where its surface reflects to, for the seed's test of splitting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glossy {
    /// Where it is.
    pub receiver: Receiver,
    /// A direction drawn from the BSDF, unit, world space: step 1 of the seed's "Split heuristic".
    pub toward: Vec3,
    /// GGX alpha of the surface.
    pub alpha: f32,
    /// Which part of what is reflected the specular lobe reflects, `[0, 1]`.
    pub specular: f32,
}

impl Viewer for Receiver {
    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        factors(cluster, self)
    }

    fn glare(&self, cluster: &Cluster) -> f64 {
        cluster.view_from(self.point).solid_angle() * std::f64::consts::FRAC_1_PI
    }

    fn within(&self, space: &Similarity) -> Receiver {
        Receiver { point: space.point(self.point), normal: space.direction(self.normal) }
    }
}

impl<V: Viewer> Viewer for DistanceOnly<V> {
    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        self.0.factors(&Cluster { sin_half_theta_o: 1.0, ..*cluster })
    }

    fn glare(&self, cluster: &Cluster) -> f64 {
        self.0.glare(cluster)
    }

    fn unit_of_importance(&self, scale: f64) -> f64 {
        self.0.unit_of_importance(scale)
    }

    fn within(&self, space: &Similarity) -> DistanceOnly<V> {
        DistanceOnly(self.0.within(space))
    }
}

impl Viewer for Glossy {
    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        factors(cluster, &self.receiver)
    }

    fn glare(&self, cluster: &Cluster) -> f64 {
        let view = cluster.view_from(self.receiver.point);
        view.solid_angle() * self.peak(cluster, view.radius, view.distance)
    }

    fn within(&self, space: &Similarity) -> Glossy {
        let receiver = self.receiver.within(space);
        Glossy { receiver, toward: space.direction(self.toward), ..*self }
    }
}

impl Glossy {
    /// Steps 2 and 3 of the seed's "Split heuristic": the largest cosine that any direction to the
    /// cluster has with the drawn one, and a GGX lobe of the surface's roughness there, 1/sr. The
    /// lobe is taken about the drawn direction: its half vector stands at half the angle, and the
    /// change to directions of light divides by four.
    fn peak(&self, cluster: &Cluster, radius: f64, distance: f64) -> f64 {
        let diffuse = (1.0 - f64::from(self.specular)) * std::f64::consts::FRAC_1_PI;
        let to_center = Vec3::from_array(cluster.center) - self.receiver.point;
        let off = to_center.as_dvec3().angle_between(self.toward.as_dvec3());
        let theta_u =
            if distance > radius { (radius / distance).asin() } else { std::f64::consts::PI };
        let cosine = (0.5 * (off - theta_u).max(0.0)).cos();
        let alpha2 = f64::from(self.alpha).powi(2);
        let shape = cosine * cosine * (alpha2 - 1.0) + 1.0;
        let ggx = alpha2 / (std::f64::consts::PI * shape * shape);
        diffuse + f64::from(self.specular) * 0.25 * ggx
    }
}
