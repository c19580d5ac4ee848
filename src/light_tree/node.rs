//! A node of the tree: light bounds in 32 bytes, rounded outwards.
//!
//! Position is kept in full (`f32`), size and direction in few bits, so that a micrometre light and
//! a kilometre light fit one scene. Everything that decides "no light from here" is rounded to the
//! safe side: boxes and cones only ever grow. The layout is in the [format](crate::store).

use super::importance::{Cluster, importance};
use super::verify::rules;
use super::viewer::Viewer;
use crate::bounds::{Aabb, Cone, LightBounds};
use crate::math::angle::between;
use crate::store::Rule;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// One emitter or one cluster, on its own; a [group](super::group::Group) holds eight.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    pub(super) center: [f32; 3],
    pub(super) energy: f32,
    pub(super) half_extent: [u8; 3],
    pub(super) half_exponent: u8,
    pub(super) axis: [i16; 2],
    pub(super) theta_o: u16,
    pub(super) theta_e: u8,
    pub(super) range: u8,
    pub(super) link: u32,
}

/// Where a node leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Link {
    /// Nowhere: the lane is not used.
    Nothing,
    /// To the group that holds its children, which is this many groups further on.
    Inner(u32),
    /// It is an emitter, by number.
    Emitter(u32),
    /// It stands for an instance of a whole tree, by the instance's row.
    Instance(u32),
}

const LEAF_BIT: u32 = 1 << 31;
const INSTANCE_BIT: u32 = 1 << 30;
/// Emitters, instances and groups are numbered below this.
pub(super) const MOST: usize = 1 << 30;

impl Link {
    #[inline]
    pub(super) fn decode(code: u32) -> Link {
        match (code & LEAF_BIT, code & INSTANCE_BIT) {
            (0, _) if code == 0 => Link::Nothing,
            (0, _) => Link::Inner(code),
            (_, 0) => Link::Emitter(code & !LEAF_BIT),
            _ => Link::Instance(code & !(LEAF_BIT | INSTANCE_BIT)),
        }
    }

    pub(super) fn encode(self) -> u32 {
        match self {
            Link::Nothing => 0,
            Link::Inner(ahead) => ahead,
            Link::Emitter(emitter) => emitter | LEAF_BIT,
            Link::Instance(row) => row | LEAF_BIT | INSTANCE_BIT,
        }
    }
}

const TWO_SIDED_BIT: u16 = 1 << 15;
const AXIS_STEPS: f32 = 32767.0;
/// `sin(theta_o / 2)` in `[0, 1]` takes fifteen bits: nearly even steps in angle, 1e-4 rad.
const THETA_O_STEPS: f64 = 32767.0;
/// `sqrt(1 - cos theta_e)` in `[0, 1]` takes eight, likewise. Where normals point everywhere, `theta_e` has no meaning,
/// and the root of the share takes its place.
const THETA_E_STEPS: f64 = 255.0;
/// An angle is multiplied by this before it is rounded up. It makes up for what `f32` loses between
/// decoding and encoding again, which must not widen a cone. Far below the slack that importance allows.
const ANGLE_FORGIVEN: f64 = 1.0 - 4e-7;

impl Node {
    /// Rounds bounds outwards into a node.
    pub fn encode(bounds: &LightBounds, link: Link) -> Node {
        let center = bounds.aabb.center();
        let (half_extent, half_exponent) = encode_half_extent(&bounds.aabb, center);
        let axis = encode_axis(bounds.cone.axis);
        let tilt = between(Vec3::from_array(decode_axis(axis)).normalize(), bounds.cone.axis);
        // `between` of equal vectors is exactly 0, so an axis that is encoded exactly widens nothing.
        let theta_o = (sin_half(bounds.cone.theta_o + tilt) * THETA_O_STEPS).ceil();
        let theta_o = theta_o.min(THETA_O_STEPS);
        let theta_e = if theta_o == THETA_O_STEPS {
            // Never 0: very narrow beams are not certain.
            (f64::from(bounds.share).sqrt() * THETA_E_STEPS).round().max(1.0)
        } else {
            (2f64.sqrt() * sin_half(bounds.cone.theta_e) * THETA_E_STEPS).ceil()
        };
        let two_sided = if bounds.cone.two_sided { TWO_SIDED_BIT } else { 0 };
        Node {
            center: center.to_array(),
            energy: bounds.energy,
            half_extent,
            half_exponent,
            axis,
            theta_o: theta_o as u16 | two_sided,
            theta_e: theta_e.min(255.0) as u8,
            range: encode_range(bounds.range_m),
            link: link.encode(),
        }
    }

    /// The decoded bounds, as sampling sees them. They contain those that were encoded.
    pub fn bounds(&self) -> LightBounds {
        let (center, half) = (self.center().as_dvec3(), self.half_extent().as_dvec3());
        let angle = |sin_half: f64| (2.0 * sin_half.min(1.0).asin()) as f32;
        let theta_o = f64::from(self.theta_o & !TWO_SIDED_BIT) / THETA_O_STEPS;
        let theta_e = f64::from(self.theta_e) / (2f64.sqrt() * THETA_E_STEPS);
        let is_round = is_round(self.theta_o);
        let cone = Cone {
            axis: Vec3::from_array(decode_axis(self.axis)).normalize(),
            theta_o: angle(theta_o),
            theta_e: if is_round { FRAC_PI_2 } else { angle(theta_e) },
            two_sided: is_two_sided(self.theta_o),
        };
        LightBounds {
            aabb: Aabb { min: round_down(center - half), max: -round_down(-center - half) },
            cone,
            energy: self.energy,
            // Spheres make a cluster round, so these are faces and spots. All count like the widest of them.
            share: if is_round {
                decode_share(self.theta_e)
            } else {
                Cone { theta_o: 0.0, ..cone }.share()
            },
            range_m: decode_range(self.range),
        }
    }

    /// Where it leads.
    #[inline]
    pub fn link(&self) -> Link {
        Link::decode(self.link)
    }

    /// Middle of the box, world space, metres.
    #[inline]
    pub fn center(&self) -> Vec3 {
        Vec3::from_array(self.center)
    }

    /// Half the edges of the box, metres.
    #[inline]
    pub fn half_extent(&self) -> Vec3 {
        Vec3::from_array(self.half_extent.map(f32::from)) * scale(self.half_exponent)
    }

    /// Peak radiant intensity, summed over the cluster.
    #[inline]
    pub fn energy(&self) -> f32 {
        self.energy
    }

    /// Decoded for the importance.
    pub(super) fn cluster(&self) -> Cluster {
        Cluster {
            center: self.center,
            half_extent: self.half_extent().to_array(),
            axis: decode_axis(self.axis),
            sin_half_theta_o: decode_sin_half_theta_o(self.theta_o),
            cos_theta_e: decode_cos_theta_e(self.theta_e),
            two_sided: is_two_sided(self.theta_o),
            inverse_range2: decode_inverse_range2(self.range),
        }
    }

    /// The first rule that the node breaks by itself, whatever the other nodes are.
    pub(super) fn broken_rule(&self) -> Option<Rule> {
        if !self.center().is_finite() || !self.half_extent().is_finite() {
            Some(rules::BOX_IS_FINITE)
        } else if !(self.energy.is_finite() && self.energy > 0.0) {
            Some(rules::ENERGY_IS_POSITIVE)
        } else if self.axis.contains(&i16::MIN) {
            Some(rules::AXIS_IS_IN_RANGE)
        } else {
            None
        }
    }
}

impl Node {
    /// Importance of this cluster to a viewer: an estimate of the irradiance from it, in the scene's
    /// units; 0 only where none of its light can arrive.
    pub fn importance(&self, viewer: &impl Viewer) -> f64 {
        let factors = viewer.factors(&self.cluster());
        let (reflected, _) = viewer.reflect(&factors.sight);
        importance(self.energy(), factors.product * reflected, factors.decay)
    }
}

/// Rounding error of a computed angle, radians.
const ANGLE_TOLERANCE: f64 = 5e-6;

impl Node {
    /// The rule that is broken if this node does not contain a child; `None` if it does.
    pub(super) fn uncontained(&self, child: &Node) -> Option<Rule> {
        let apart = (self.center().as_dvec3() - child.center().as_dvec3()).abs();
        let reach = apart + child.half_extent().as_dvec3();
        if reach.cmpgt(self.half_extent().as_dvec3()).any() {
            return Some(rules::BOX_IS_IN_PARENT);
        }
        if (child.theta_e > self.theta_e && !is_round(self.theta_o))
            || (is_two_sided(child.theta_o) && !is_two_sided(self.theta_o))
        {
            return Some(rules::EMISSION_IS_IN_PARENT);
        }
        if self.range != 0 && !(1..=self.range).contains(&child.range) {
            return Some(rules::RANGE_IS_IN_PARENT);
        }
        let code = |node: &Node| node.theta_o & !TWO_SIDED_BIT;
        if is_round(self.theta_o) || (self.axis == child.axis && code(child) <= code(self)) {
            return None;
        }
        // cos(theta_d + theta_c) >= cos(theta_p + tolerance), and the sum is not beyond pi.
        let unit = |node: &Node| Vec3::from_array(decode_axis(node.axis)).as_dvec3().normalize();
        let cos_of = |node: &Node| 1.0 - 2.0 * (f64::from(code(node)) / THETA_O_STEPS).powi(2);
        let dot = unit(self).dot(unit(child));
        let cos_d = if is_two_sided(self.theta_o) { dot.abs() } else { dot }.clamp(-1.0, 1.0);
        let (cos_c, cos_p) = (cos_of(child), cos_of(self));
        let sin = |cos: f64| (1.0 - cos * cos).max(0.0).sqrt();
        let cos_needed = cos_d * cos_c - sin(cos_d) * sin(cos_c);
        let least = cos_p - ANGLE_TOLERANCE * (sin(cos_p) + ANGLE_TOLERANCE);
        let beyond = cos_d < -cos_c;
        (beyond || cos_needed < least).then_some(rules::CONE_IS_IN_PARENT)
    }
}

impl Node {
    /// The first part, in words, in which the bits of another node differ; `None` if none does. Links
    /// are not compared.
    pub fn difference(&self, other: &Node) -> Option<&'static str> {
        let [own, other] = [self, other];
        let box_of =
            |node: &Node| (node.center.map(f32::to_bits), node.half_extent, node.half_exponent);
        let cone_of = |node: &Node| (node.axis, node.theta_o, node.theta_e);
        if box_of(own) != box_of(other) {
            Some("its box")
        } else if cone_of(own) != cone_of(other) {
            Some("its cone")
        } else if own.energy.to_bits() != other.energy.to_bits() {
            Some("its energy")
        } else if own.range != other.range {
            Some("its range")
        } else {
            None
        }
    }
}

/// Sine of half an angle in `[0, pi]`, a hair smaller than exact: see [`ANGLE_FORGIVEN`].
fn sin_half(angle_rad: f32) -> f64 {
    let angle = f64::from(angle_rad).min(std::f64::consts::PI) * ANGLE_FORGIVEN;
    (0.5 * angle).sin()
}

/// The smallest shared exponent and the mantissas, rounded up, that reach both faces of the box
/// from its rounded centre.
fn encode_half_extent(aabb: &Aabb, center: Vec3) -> ([u8; 3], u8) {
    let center = center.as_dvec3();
    let reach = (aabb.max.as_dvec3() - center).max(center - aabb.min.as_dvec3());
    let longest = reach.max_element();
    if longest <= 0.0 {
        return ([0; 3], 0);
    }
    let mut exponent = ((longest / 255.0).log2().ceil() as i32 + 127).clamp(1, 254);
    // `log2` may round across a power of two.
    while exponent < 254 && longest / 2f64.powi(exponent - 127) > 255.0 {
        exponent += 1;
    }
    let mantissa = (reach / 2f64.powi(exponent - 127)).ceil().min(DVec3::splat(255.0));
    (mantissa.to_array().map(|m| m as u8), exponent as u8)
}

/// Octahedral encoding (Cigolle et al. 2014), rounded to the nearest.
fn encode_axis(axis: Vec3) -> [i16; 2] {
    let flat = axis / (axis.x.abs() + axis.y.abs() + axis.z.abs());
    let mut folded = flat.truncate();
    if flat.z < 0.0 {
        folded = (Vec2::ONE - Vec2::new(flat.y, flat.x).abs()) * sign(flat.truncate());
    }
    let [x, y] = (folded * AXIS_STEPS).round().to_array();
    // On the rim of the square two codes stand for one direction: take the positive one.
    let x = if y.abs() == AXIS_STEPS { x.abs() } else { x };
    let y = if x.abs() == AXIS_STEPS { y.abs() } else { y };
    [x as i16, y as i16]
}

/// The direction of an octahedral code, not of unit length.
#[inline(always)]
pub(super) fn decode_axis(code: [i16; 2]) -> [f32; 3] {
    let [x, y] = code.map(|step| f32::from(step) * (1.0 / AXIS_STEPS));
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    [x - fold.copysign(x), y - fold.copysign(y), z]
}

/// What the mantissas of a half extent are multiplied by.
#[inline(always)]
pub(super) fn scale(half_exponent: u8) -> f32 {
    f32::from_bits(u32::from(half_exponent) << 23)
}

#[inline(always)]
pub(super) fn decode_sin_half_theta_o(code: u16) -> f32 {
    f32::from(code & !TWO_SIDED_BIT) * (1.0 / THETA_O_STEPS as f32)
}

/// Whether normals point in every direction: then the decoded sine is 1.
#[inline(always)]
pub(super) fn is_round(code: u16) -> bool {
    code & !TWO_SIDED_BIT == THETA_O_STEPS as u16
}

#[inline(always)]
pub(super) fn decode_cos_theta_e(code: u8) -> f32 {
    1.0 - decode_share(code)
}

/// What the code of `theta_e` says where normals point everywhere.
#[inline(always)]
fn decode_share(code: u8) -> f32 {
    let root = f32::from(code) * (1.0 / THETA_E_STEPS as f32);
    root * root
}

/// Codes per octave of range.
const RANGE_STEPS: f32 = 4.0;
/// Base-2 logarithm of the range, in metres, of code 1.
const SHORTEST_RANGE: f32 = -31.75;

/// The smallest code whose range is at least this; 0 for a range that is infinite, or beyond that of
/// the largest code (3.6e9 m).
fn encode_range(range_m: f32) -> u8 {
    let estimate = ((range_m.log2() - SHORTEST_RANGE) * RANGE_STEPS).floor().clamp(0.0, 255.0);
    let mut code = (estimate as u8).max(1);
    while decode_range(code) < range_m && code != 0 {
        code = code.wrapping_add(1);
    }
    code
}

/// Metres.
fn decode_range(code: u8) -> f32 {
    match code {
        0 => f32::INFINITY,
        _ => ((f32::from(code) - 1.0) / RANGE_STEPS + SHORTEST_RANGE).exp2(),
    }
}

/// `1 / range^2` by code, 1/m^2.
static INVERSE_RANGE2: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| decode_range(code as u8).powi(-2)));

#[inline(always)]
pub(super) fn decode_inverse_range2(code: u8) -> f32 {
    // Most scenes have no ranges: then the table is not read.
    if code == 0 { 0.0 } else { INVERSE_RANGE2[code as usize] }
}

#[inline(always)]
pub(super) fn is_two_sided(code: u16) -> bool {
    code & TWO_SIDED_BIT != 0
}

/// +1 or -1, also of zero.
#[inline]
fn sign(v: Vec2) -> Vec2 {
    Vec2::new(1f32.copysign(v.x), 1f32.copysign(v.y))
}

/// For each component the largest `f32` that is not above it.
fn round_down(exact: DVec3) -> Vec3 {
    Vec3::from_array(exact.to_array().map(|exact| {
        let rounded = exact as f32;
        if f64::from(rounded) > exact { rounded.next_down() } else { rounded }
    }))
}

#[cfg(test)]
mod tests;
