//! How much light a cluster is likely to send to a receiver: an unnormalised weight.
//!
//! HPG 2018, equation 3: `E cos'(theta - theta_o - theta_u) cos'(theta_i - theta_u) / d^2`, with
//! `theta_u` the half angle under which the receiver sees the box's bounding *sphere* (its corners
//! underestimate). Three departures from the paper:
//!
//! - The paper's cosines are the largest that any emitter of the cluster can have. They decide what is
//!   dark, and weigh what lights a stretch of a ray. Otherwise a cluster is weighed by the cosines that
//!   are [expected](clipped_moments) of emitters spread over the box and of normals spread over the cone: most of a wide
//!   cone faces away, whatever its edge does. Where normals point everywhere, a node tells the mean itself.
//! - The distance is `d^2 + r^2/10` with `r` the sphere's radius: no kink and no pole where the
//!   receiver is inside, and in units of length squared, so that the scale of the scene cancels.
//! - Importance 0 means that no light can arrive, so it is returned only beyond a [slack](EDGE_SLACK)
//!   that covers all rounding. Factors that are merely small are raised to a [floor](FLOOR).
//!
//! A light with a range is dark beyond it. A cluster is dark where its whole box is beyond the longest
//! range in it. Nearer, the estimate takes glTF's window `1 - (d / range)^4` (`KHR_lights_punctual`)
//! at the nearest point of the box.
//!
//! The formula is written once, for one lane, without a branch, so that the compiler computes the
//! eight lanes of a group together.

use super::viewer::Receiver;
use glam::Vec3;

/// A box is called below the horizon only if it is lower by more than this share of its distance and
/// size: many times the rounding error of the sums.
const HORIZON_SLACK: f32 = 1e-5;
/// A direction is called dark only this far beyond the cone's edge, radians. Just outside the sphere the
/// cosine of `theta_u` is off by up to 3.5e-4, and the angle with it.
const EDGE_SLACK: f32 = 1e-3;
/// The least value of a largest cosine that is not provably zero.
const FLOOR: f32 = 1e-4;
/// The least share of the largest cosine that is expected: emitters are not spread evenly.
const LEAST_EXPECTED: f32 = 0.02;
/// The mean square of a cosine over its mean, for faces on all sides, whose backs are dark: 1/6 over 1/4.
const FACES: f32 = 2.0 / 3.0;
/// The largest squared relative deviation of a cosine that is reckoned with.
const MOST_DEVIATION: f32 = 8.0;
/// How much of the deviation of the cosine at a surface counts as uncertain. That of distances has a part in it, and
/// measured variances are least with about this.
const AT_SURFACE: f32 = 0.4;
/// The mean of a square coordinate over a box, as a share of the square of its half edge.
const MEAN_SQUARE: f32 = 1.0 / 3.0;
/// The share of the sphere's squared radius that softens the squared distance.
pub(super) const SOFTENING: f32 = 0.1;
/// Allowance for the relative rounding error of squared distances and ranges.
const RANGE_SLACK: f32 = 1e-5;
/// Allowance for the relative rounding error of a difference of coordinates, from which the distance to
/// a face of the box is computed.
const FACE_SLACK: f32 = 4.0 * f32::EPSILON;

/// What the formula needs of a cluster, decoded. Vectors are arrays of components, as lanes have them.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    pub center: [f32; 3],
    pub half_extent: [f32; 3],
    /// Not of unit length.
    pub axis: [f32; 3],
    pub sin_half_theta_o: f32,
    /// Where normals point everywhere, 1 less the share.
    pub cos_theta_e: f32,
    pub two_sided: bool,
    /// `1 / range^2` of the longest range in it, 1/m^2; 0 if any light in it has no range.
    pub inverse_range2: f32,
}

/// A cluster as a viewer sees it: the radius of its sphere and the distance to its centre.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub radius: f64,
    pub distance: f64,
}

impl View {
    /// Solid angle of the sphere, sr; that of a hemisphere from inside.
    pub fn solid_angle(&self) -> f64 {
        if self.radius <= 0.0 {
            return 0.0;
        }
        // 1 - cos = sin^2 / (1 + cos), which does not cancel for a small sphere far away.
        let sin2_u = (self.radius / self.distance.max(self.radius)).powi(2);
        std::f64::consts::TAU * sin2_u / (1.0 + (1.0 - sin2_u).sqrt())
    }
}

impl Cluster {
    /// Its bounding sphere as seen from a point.
    pub fn view_from(&self, p: Vec3) -> View {
        let [center, half] =
            [self.center, self.half_extent].map(|v| Vec3::from_array(v).as_dvec3());
        View { radius: half.length(), distance: (center - p.as_dvec3()).length() }
    }

    /// Whether normals point everywhere.
    #[inline(always)]
    fn is_round(&self) -> bool {
        self.sin_half_theta_o >= 1.0
    }

    /// What leaves in the mean over all directions, over the largest, where normals point everywhere.
    #[inline(always)]
    fn share(&self) -> f32 {
        1.0 - self.cos_theta_e
    }

    /// The share of its light that leaves at some angle off its axis, for a cluster seen under the half
    /// angle `theta_u`: 1 inside the cone, falling to its edge, 0 only surely beyond. The angle is given
    /// by cosine and sine, because a cosine alone does not resolve small angles. Also returns the cosine
    /// of `theta_o`.
    #[inline(always)]
    pub fn emission(
        &self,
        (cosine, sine): (f32, f32),
        inside: bool,
        (sin_u, cos_u): (f32, f32),
    ) -> (f32, f32) {
        let sin_half = self.sin_half_theta_o;
        let cos_o = 1.0 - 2.0 * sin_half * sin_half;
        let sin_o = 2.0 * sin_half * (1.0 - sin_half * sin_half).max(0.0).sqrt();
        // The sine of theta_o + theta_u is negative where the sum is beyond pi.
        let sin_sum = sin_o * cos_u + cos_o * sin_u;
        let cos_sum = cos_o * cos_u - sin_o * sin_u;
        let within = inside | self.is_round() | (sin_sum < 0.0) | (cosine >= cos_sum);
        let off = cosine * cos_sum + sine * sin_sum;
        // A lower bound of the cosine of theta_e plus the slack.
        let cos_e = self.cos_theta_e;
        let sin_e = ((1.0 - cos_e) * (1.0 + cos_e)).max(0.0).sqrt();
        let edge = cos_e - EDGE_SLACK * (sin_e + EDGE_SLACK);
        let is_dark = !within & (off < edge);
        let emission = if within { 1.0 } else { off.max(FLOOR) };
        (if is_dark { 0.0 } else { emission }, cos_o)
    }

    /// The share that is expected to leave at some angle off the axis, given by its cosine, and its squared relative
    /// deviation from emitter to emitter; `emission` is the largest share. Normals are spread evenly over the cone.
    /// `offset2` is the mean square of the directions to emitters across that to the centre. Where normals point
    /// everywhere, the share of the node is expected: of a cluster of spheres all light, of faces a quarter.
    #[inline(always)]
    fn expected_emission(
        &self,
        emission: f32,
        cosine: f32,
        cos_o: f32,
        offset2: f32,
    ) -> (f32, f32) {
        // Mean and variance of the cosine between a direction and a unit vector spread over a cap.
        let mean = cosine * 0.5 * (1.0 + cos_o);
        let along = (1.0 + cos_o + cos_o * cos_o) * (1.0 / 3.0);
        let across = 0.5 * (1.0 - along);
        let square = along * cosine * cosine + across * (1.0 - cosine * cosine) + offset2;
        let half = (3.0 * (square - mean * mean).max(0.0)).sqrt();
        let (front, front2) = clipped_moments(mean, half);
        let (back, back2) = if self.two_sided { clipped_moments(-mean, half) } else { (0.0, 0.0) };
        // Of beams narrower than a hemisphere, fewer reach any one point.
        let beam = (2.0 * (1.0 - self.cos_theta_e) / (1.0 - cos_o).max(1e-9)).clamp(1e-9, 1.0);
        let of_cone = ((front + back) * beam, (front2 + back2) * beam);
        // Faces have a mean square of 1/6, or 1/3 if they emit from both sides, spheres 1; between them it is a line.
        let (of_faces, square) = if self.two_sided { (0.5, 1.0 / 3.0) } else { (0.25, 1.0 / 6.0) };
        let share = self.share();
        let square = 1.0 - (1.0 - share) * ((1.0 - square) / (1.0 - of_faces));
        let of_all = (share, square.max(share * FACES));
        let moments = if self.is_round() { of_all } else { of_cone };
        (moments.0.max(LEAST_EXPECTED * emission), deviation(moments))
    }

    /// The squared relative deviation of narrow beams spread over a wide cone, of which most miss any one point. It is 0
    /// for faces and points, which reach half of all and every one.
    #[inline(always)]
    pub fn missed(&self, cos_o: f32) -> f32 {
        let missed = if self.is_round() {
            1.0 / self.share().max(1e-9) - 4.0
        } else {
            (1.0 - cos_o) / (1.0 - self.cos_theta_e).max(1e-9) - 2.0
        };
        missed.max(0.0)
    }

    /// The share of light that the range leaves at a squared distance, m^2; 0 only surely out of range.
    #[inline(always)]
    pub fn window(&self, nearest2: f32) -> f32 {
        let ratio2 = nearest2 * self.inverse_range2;
        let window = (1.0 - ratio2 * ratio2).max(FLOOR);
        let window = if ratio2 > 1.0 + RANGE_SLACK { 0.0 } else { window };
        // Where it is known while compiling that there is no range, nothing else is left of this.
        if self.inverse_range2 == 0.0 { 1.0 } else { window }
    }
}

/// What an importance is made of.
#[derive(Clone, Copy, Debug)]
pub struct Factors {
    /// The cosines and all other factors without a unit. 0 only where provably no light arrives.
    pub product: f32,
    /// What the importance is divided by: the squared distance, m^2; along a segment the distance, m.
    pub decay: f32,
    /// How uncertain it is: the squared relative deviation of what the cluster's emitters send.
    pub spread: f32,
    /// The directions from which the light comes.
    pub sight: Sight,
}

/// Lower bound of `d^2 - R^2` as a share of `R^2`: closer to the sphere or inside it, a cluster is as
/// uncertain as it can be, but the value stays finite.
const CLOSEST: f32 = 0.05;

/// The squared relative deviation of `1/d^2` for distances spread over a sphere of squared radius
/// `r2` at a squared distance `d2`: `(4/3) R^2 / (d^2 - R^2)`, which is HPG 2018's equations 8 and 9
/// without their cancellation.
#[inline(always)]
pub(super) fn spread_of_distance(r2: f32, d2: f32) -> f32 {
    4.0 / 3.0 * r2 / (d2 - r2).max(CLOSEST * r2).max(f32::MIN_POSITIVE)
}

/// The sphere of a cluster as a surface sees it: a cone of directions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sight {
    /// Unit, towards the centre.
    pub to: [f32; 3],
    /// The cosine with the normal that is expected of light from the cluster; above zero.
    pub cosine: f32,
    /// Cosine and sine of the cone's half angle, which is a right angle inside the sphere.
    pub cos_u: f32,
    pub sin_u: f32,
}

impl Sight {
    /// `1 - cos theta_u` without its cancellation.
    #[inline(always)]
    pub fn one_minus_cos_u(&self) -> f32 {
        self.sin_u * self.sin_u / (1.0 + self.cos_u)
    }
}

/// The mean, and the mean square, of a cosine that is spread evenly over a mean and `half` to either side, with 0 for
/// all that is below 0.
#[inline(always)]
fn clipped_moments(mean: f32, half: f32) -> (f32, f32) {
    let high = (mean + half).max(0.0);
    let inverse = 1.0 / half.max(f32::MIN_POSITIVE);
    let clipped = (high * high * 0.25 * inverse, high * high * high * (1.0 / 6.0) * inverse);
    if mean >= half { (mean, mean * mean + half * half * (1.0 / 3.0)) } else { clipped }
}

/// The squared relative deviation of what has these moments; bounded.
#[inline(always)]
fn deviation((mean, square): (f32, f32)) -> f32 {
    (square / (mean * mean).max(f32::MIN_POSITIVE) - 1.0).clamp(0.0, MOST_DEVIATION)
}

/// The factors of the importance, which is energy times product over decay. They leave out what becomes
/// of the light at the receiver: the viewer computes that from the sight.
#[inline(always)]
pub(super) fn factors(cluster: &Cluster, receiver: &Receiver) -> Factors {
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
    let inverse_d = if d > 0.0 { 1.0 / d } else { 0.0 };
    let sin_u = if inside { 1.0 } else { r2.sqrt() * inverse_d };
    let cos_u = if inside { 0.0 } else { (d2 - r2).sqrt() * inverse_d };

    let inverse = inverse_d / (ax * ax + ay * ay + az * az).sqrt();
    let along = (ax * vx + ay * vy + az * vz) * inverse;
    let along = if cluster.two_sided { along.abs() } else { along };
    let (wx, wy, wz) = (ay * vz - az * vy, az * vx - ax * vz, ax * vy - ay * vx);
    let across = (wx * wx + wy * wy + wz * wz).sqrt() * inverse;
    let (emission, cos_o) = cluster.emission((along, across), inside, (sin_u, cos_u));
    let is_dark = emission == 0.0;
    // Points of the box are at this distance, in the quadratic mean.
    let mean_d2 = d2 + MEAN_SQUARE * r2;
    let inverse_mean = if mean_d2 > 0.0 { 1.0 / mean_d2.sqrt() } else { 0.0 };
    let offset2 = MEAN_SQUARE * MEAN_SQUARE * r2 * inverse_mean * inverse_mean;
    let near = sin_u * sin_u * sin_u * sin_u;
    let (emission, uneven) =
        cluster.expected_emission(emission, along * d * inverse_mean, cos_o, offset2);

    // Reception: the largest cosine that any point of the sphere can have, or from outside the one that is
    // expected of the box. Inside, what is near decides, wherever that is. Without a normal every direction
    // counts alike.
    let in_medium = (nx == 0.0) & (ny == 0.0) & (nz == 0.0);
    let cosine_i = (-below * inverse_d).clamp(-1.0, 1.0);
    let sine_i = (1.0 - cosine_i * cosine_i).sqrt();
    let best = if cosine_i >= cos_u { 1.0 } else { cosine_i * cos_u + sine_i * sin_u };
    let moments = clipped_moments(-below * inverse_mean, reach * inverse_mean);
    let unsure = if in_medium { 0.0 } else { AT_SURFACE * deviation(moments) };
    let expected = moments.0.max(LEAST_EXPECTED * best);
    let likely = (expected + near * (best - expected)).max(FLOOR);
    let cosine = if inside | in_medium { 1.0 } else { likely };
    let to = [-vx * inverse_d, -vy * inverse_d, -vz * inverse_d];

    // Range: at the point of the box that is nearest.
    let beyond = |v: f32, half: f32| (v.abs() * (1.0 - FACE_SLACK) - half).max(0.0);
    let [ox, oy, oz] = [beyond(vx, hx), beyond(vy, hy), beyond(vz, hz)];
    let window = cluster.window(ox * ox + oy * oy + oz * oz);

    let product = emission * window;
    Factors {
        product: if is_below | is_dark { 0.0 } else { product },
        decay: distance2,
        // No number where a square overflows; then nothing is known to be uncertain.
        spread: (spread_of_distance(r2, d2) + uneven + unsure).max(0.0),
        sight: Sight { to, cosine, cos_u, sin_u },
    }
}

/// Energy times cosines over squared distance, in double precision: energies and distances may
/// span more than `f32` does.
#[inline(always)]
pub(super) fn importance(energy: f32, product: f32, decay: f32) -> f64 {
    /// Below every squared distance that an `f32` can hold, yet above zero.
    const LEAST: f64 = 1e-60;
    let importance = f64::from(energy) * f64::from(product) / (f64::from(decay) + LEAST);
    // An unverified file may hold any energy: the importance is still neither negative nor NaN.
    importance.max(0.0)
}
