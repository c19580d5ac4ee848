//! How much light a cluster may send to a receiver: an unnormalised weight.
//!
//! HPG 2018, equation 3: `E cos'(theta - theta_o - theta_u) cos'(theta_i - theta_u) / d^2`, with
//! `theta_u` the half angle under which the receiver sees the box's bounding *sphere* (its corners
//! underestimate). Two departures from the paper:
//!
//! - The distance is `d^2 + r^2/10` with `r` the sphere's radius: no kink and no pole where the
//!   receiver is inside, and in units of length squared, so that the scale of the scene cancels.
//! - Importance 0 is a proof of darkness, so it is granted only beyond a [slack](EDGE_SLACK) that covers
//!   all rounding; whatever else is small stays above a [floor](FLOOR).
//!
//! The formula is written once, for one lane, without a branch, so that the compiler computes the
//! eight lanes of a group together.

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

/// A box this share of its distance above the horizon is not yet called below it: many times the
/// rounding of the sums.
const HORIZON_SLACK: f32 = 1e-5;
/// A cosine this much beyond the cone's edge is not yet called dark. Sines taken from cosines near 1
/// are off by up to 3.5e-4; the worst that a search along the edge found is 7.4e-4.
const EDGE_SLACK: f32 = 2e-3;
/// The least value of a cosine factor that is not provably zero.
const FLOOR: f32 = 1e-4;
/// The share of the sphere's squared radius that softens the squared distance.
const SOFTENING: f32 = 0.1;

/// What the formula needs of a cluster, decoded. Components apart, as lanes have them.
pub(super) struct Cluster {
    pub center: [f32; 3],
    pub half_extent: [f32; 3],
    /// Not of unit length.
    pub axis: [f32; 3],
    pub sin_half_theta_o: f32,
    pub cos_theta_e: f32,
    pub two_sided: bool,
}

/// The product of both cosine factors, and the squared distance, m^2. Importance is energy times
/// the first over the second.
#[inline(always)]
pub(super) fn factors(cluster: &Cluster, receiver: &Receiver) -> (f32, f32) {
    let [px, py, pz] = receiver.point.to_array();
    let [nx, ny, nz] = receiver.normal.to_array();
    let [cx, cy, cz] = cluster.center;
    let [hx, hy, hz] = cluster.half_extent;
    let [ax, ay, az] = cluster.axis;
    // From the cluster to the receiver.
    let (vx, vy, vz) = (px - cx, py - cy, pz - cz);
    let d2 = vx * vx + vy * vy + vz * vz;
    let r2 = hx * hx + hy * hy + hz * hz;
    let distance2 = d2 + SOFTENING * r2;

    // Provably below the receiver's horizon: the whole box is.
    let below = nx * vx + ny * vy + nz * vz;
    let reach = nx.abs() * hx + ny.abs() * hy + nz.abs() * hz;
    let d = d2.sqrt();
    let is_below = below - reach > HORIZON_SLACK * (d + reach);

    // The half angle of the sphere; inside it every direction is possible.
    let inside = d2 <= r2;
    let inverse_d = 1.0 / if inside { 1.0 } else { d };
    let sin_u = if inside { 1.0 } else { r2.sqrt() * inverse_d };
    let cos_u = if inside { 0.0 } else { (d2 - r2).sqrt() * inverse_d };

    // Emission: 1 inside the cone, falling to its edge, 0 beyond. The sine of theta_o + theta_u is
    // negative where the sum is beyond pi.
    let inverse_axis = 1.0 / (ax * ax + ay * ay + az * az).sqrt();
    let along = (ax * vx + ay * vy + az * vz) * inverse_d * inverse_axis;
    let along = if cluster.two_sided { along.abs() } else { along };
    let cosine = along.clamp(-1.0, 1.0);
    let sine = (1.0 - cosine * cosine).sqrt();
    let sin_half = cluster.sin_half_theta_o;
    let cos_o = 1.0 - 2.0 * sin_half * sin_half;
    let sin_o = 2.0 * sin_half * (1.0 - sin_half * sin_half).max(0.0).sqrt();
    let sin_sum = sin_o * cos_u + cos_o * sin_u;
    let cos_sum = cos_o * cos_u - sin_o * sin_u;
    let within = inside | (sin_sum < 0.0) | (cosine >= cos_sum);
    let off = cosine * cos_sum + sine * sin_sum;
    let is_dark = !within & (off < cluster.cos_theta_e - EDGE_SLACK);
    let emission = if within { 1.0 } else { off.max(FLOOR) };

    // Reception: the largest cosine that any point of the sphere can have. Without a normal every
    // direction counts alike.
    let in_medium = (nx == 0.0) & (ny == 0.0) & (nz == 0.0);
    let cosine_i = (-below * inverse_d).clamp(-1.0, 1.0);
    let sine_i = (1.0 - cosine_i * cosine_i).sqrt();
    let best = if cosine_i >= cos_u { 1.0 } else { cosine_i * cos_u + sine_i * sin_u };
    let reception = if inside | in_medium { 1.0 } else { best.max(FLOOR) };

    let product = emission * reception;
    (if is_below | is_dark { 0.0 } else { product }, distance2)
}

/// Energy times cosines over squared distance, in double precision: energies and distances may
/// span more than `f32` does.
#[inline(always)]
pub(super) fn importance(energy: f32, product: f32, distance2: f32) -> f64 {
    /// Below every distance that `f32` squares, above nothing at all.
    const LEAST: f64 = 1e-60;
    f64::from(energy) * f64::from(product) / (f64::from(distance2) + LEAST)
}
