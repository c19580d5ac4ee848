//! How much light a cluster may send to a receiver: an unnormalised weight.
//!
//! HPG 2018, equation 3: `E cos'(theta - theta_o - theta_u) cos'(theta_i - theta_u) / d^2`, with
//! `theta_u` the half angle under which the receiver sees the box's bounding *sphere* (its corners
//! underestimate). Two departures from the paper:
//!
//! - The distance is `d^2 + r^2/10` with `r` the sphere's radius: no kink and no pole where the
//!   receiver is inside, and in units of length squared, so that the scale of the scene cancels.
//! - Importance 0 is a proof of darkness, so it is granted only beyond a [slack](SLACK) that covers
//!   all rounding; whatever else is small stays above a [floor](FLOOR).

use super::node::Node;
use glam::Vec3;

/// Where light is wanted: the one description that sampling and its probability share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// World space, metres.
    pub point: Vec3,
    /// Unit shading normal on the side that is lit, world space; zero if light from every
    /// direction counts (a point in a medium).
    pub normal: Vec3,
}

/// Cosines within this of "no light" are not yet called dark: several times the rounding of the
/// expressions below.
const SLACK: f32 = 1e-5;
/// The least value of a cosine factor that is not provably zero.
const FLOOR: f32 = 1e-4;
/// The share of the sphere's squared radius that softens the squared distance.
const SOFTENING: f32 = 0.1;

impl Node {
    /// Importance of this cluster to a receiver, W/m^2 in the scene's units; 0 only where none of
    /// its light can arrive.
    #[inline]
    pub fn importance(&self, receiver: &Receiver) -> f64 {
        let to_receiver = receiver.point - self.center();
        let half = self.half_extent();
        let (d2, r2) = (to_receiver.length_squared(), half.length_squared());
        let d = d2.sqrt();

        let horizon = receiver.normal.dot(to_receiver);
        let reach = receiver.normal.abs().dot(half);
        if horizon - reach > SLACK * (d + reach) {
            return 0.0;
        }

        let distance2 = f64::from(d2 + SOFTENING * r2).max(f64::MIN_POSITIVE.sqrt());
        let unshaded = f64::from(self.energy()) / distance2;
        if d2 <= r2 {
            return unshaded;
        }
        let sin2_u = r2 / d2;
        let seen = Seen { sin_u: sin2_u.sqrt(), cos_u: (1.0 - sin2_u).sqrt() };

        let emission = self.emission_cosine(to_receiver, d, &seen);
        if emission == 0.0 {
            return 0.0;
        }
        let reception = if receiver.normal == Vec3::ZERO {
            1.0
        } else {
            seen.largest_cosine((-horizon / d).clamp(-1.0, 1.0)).max(FLOOR)
        };
        unshaded * f64::from(emission * reception)
    }

    /// Upper bound on the emission's cosine: 1 inside the cone, falling to its edge, 0 beyond.
    #[inline]
    fn emission_cosine(&self, to_receiver: Vec3, d: f32, seen: &Seen) -> f32 {
        let axis = self.axis_unnormalised();
        let cosine = axis.dot(to_receiver) / (d * axis.length());
        let cosine = if self.is_two_sided() { cosine.abs() } else { cosine }.clamp(-1.0, 1.0);
        let cos_o = self.cos_theta_o();
        let sin_o = (1.0 - cos_o * cos_o).max(0.0).sqrt();
        // theta_o + theta_u; its sine is negative beyond pi.
        let sin_sum = sin_o * seen.cos_u + cos_o * seen.sin_u;
        let cos_sum = cos_o * seen.cos_u - sin_o * seen.sin_u;
        if sin_sum < 0.0 || cosine >= cos_sum {
            return 1.0;
        }
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let cos_off = cosine * cos_sum + sine * sin_sum;
        if cos_off < self.cos_theta_e() - SLACK { 0.0 } else { cos_off.max(FLOOR) }
    }
}

/// Under which half angle the receiver sees the bounding sphere; below pi/2.
struct Seen {
    sin_u: f32,
    cos_u: f32,
}

impl Seen {
    /// `cos(max(0, theta - theta_u))` from `cos(theta)`.
    #[inline]
    fn largest_cosine(&self, cosine: f32) -> f32 {
        if cosine >= self.cos_u {
            return 1.0;
        }
        cosine * self.cos_u + (1.0 - cosine * cosine).max(0.0).sqrt() * self.sin_u
    }
}
