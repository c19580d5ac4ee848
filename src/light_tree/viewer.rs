//! Who asks for light: a point of a surface, a point of a medium, or a stretch of a ray.
//!
//! A [`Viewer`] tells what a cluster may send to it and how uncertain that estimate is. The one
//! description is shared by sampling and by its probability, so that they cannot disagree about
//! where they stand. Viewers are copied into the space of a shared subtree when a walk enters it.

use super::importance::{Cluster, Factors, Sight, factors};
use crate::math::Similarity;
use glam::Vec3;

/// Something that light is wanted for. What a `Cluster` is stays inside this room, and so do the
/// implementations.
pub trait Viewer: Copy {
    /// What the importance of a cluster is made of, and how uncertain it is.
    fn factors(&self, cluster: &Cluster) -> Factors;

    /// What becomes of light that comes from somewhere, if [`factors`](Viewer::factors) does not know:
    /// another factor of the importance, and how uncertain that one is.
    #[inline(always)]
    fn reflect(&self, _sight: &Sight) -> (f32, f32) {
        (1.0, 0.0)
    }

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

impl Viewer for Receiver {
    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        let factors = factors(cluster, self);
        Factors { product: factors.product * factors.sight.cosine, ..factors }
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

    #[inline(always)]
    fn reflect(&self, sight: &Sight) -> (f32, f32) {
        self.0.reflect(sight)
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
