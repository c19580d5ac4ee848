//! Viewers: what light is wanted for. A point of a surface, a point in a medium, or a stretch of a ray.
//!
//! A [`Viewer`] tells how much light a cluster may send to it, and how uncertain that is. Sampling and
//! its probability share this one description, so they cannot disagree. When a walk enters the tree of
//! an instance, it takes the viewer along into that tree's space.

use super::importance::{Cluster, Factors, Sight, factors};
use super::linking::ReceiverClass;
use super::veil::Cell;
use crate::math::Similarity;
use glam::Vec3;

/// Something that light is wanted for. `Cluster` is private to this room, so only this room implements
/// viewers.
pub trait Viewer: Copy {
    /// The factors of the importance of a cluster, and how uncertain it is.
    fn factors(&self, cluster: &Cluster) -> Factors;

    /// A further factor of the importance, where [`factors`](Viewer::factors) leaves it open what
    /// becomes of the light; and what it adds to the spread.
    #[inline(always)]
    fn reflect(&self, _sight: &Sight) -> (f32, f32) {
        (1.0, 0.0)
    }

    /// The seed's measure for splitting: the solid angle of a cluster times the peak of the BSDF towards
    /// it.
    fn glare(&self, cluster: &Cluster) -> f64;

    /// The factor from importances in another space to importances in this one, where lengths there
    /// are `scale` times as long and energies `scale^2` times as high. An irradiance is the same in
    /// both.
    fn unit_of_importance(&self, _scale: f64) -> f64 {
        1.0
    }

    /// The same viewer in another space.
    fn within(&self, space: &Similarity) -> Self;

    /// The cell that tells what is [hidden](super::veil) from it.
    #[inline(always)]
    fn cell(&self) -> Cell {
        Cell::NONE
    }

    /// Whether it heeds where lights send their light. If not, [far fields](super::far_field) are not asked.
    const IS_ORIENTED: bool = true;

    /// Whether only some lights may light it. If not, nothing is spent on links.
    const IS_LINKED: bool = false;

    /// The class that tells which [lights](super::linking) light it.
    #[inline(always)]
    fn class(&self) -> ReceiverClass {
        ReceiverClass::ALL
    }
}

/// What a viewer that knows more than another one sees: what the other one does.
macro_rules! sees_as {
    ($viewer:ident: $kind:ident) => {
        const IS_ORIENTED: bool = $kind::IS_ORIENTED;

        #[inline(always)]
        fn factors(&self, cluster: &Cluster) -> Factors {
            self.$viewer.factors(cluster)
        }

        #[inline(always)]
        fn reflect(&self, sight: &Sight) -> (f32, f32) {
            self.$viewer.reflect(sight)
        }

        fn glare(&self, cluster: &Cluster) -> f64 {
            self.$viewer.glare(cluster)
        }

        fn unit_of_importance(&self, scale: f64) -> f64 {
            self.$viewer.unit_of_importance(scale)
        }
    };
}
pub(super) use sees_as;

/// A point where light is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// World space, metres.
    pub point: Vec3,
    /// Unit shading normal, on the side that is lit, world space. Zero for a point in a medium or
    /// of glass, where light from every direction counts.
    pub normal: Vec3,
}

/// A viewer that ignores how lights are oriented. With a receiver that has no normal it gives the middle
/// picture of the seed's "Results", for comparison.
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
    const IS_ORIENTED: bool = false;

    #[inline(always)]
    fn factors(&self, cluster: &Cluster) -> Factors {
        self.0.factors(&Cluster { sin_half_theta_o: 1.0, cos_theta_e: 0.0, ..*cluster })
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
