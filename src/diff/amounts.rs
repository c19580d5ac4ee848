//! In what two versions of a light differ, and by how much.

use super::change::{Apart, Difference};
use super::light::Described;
use crate::math::angle;
use crate::scene::Response;
use glam::{DMat3, DVec3, Vec3};

/// A smaller difference between half angles of cones is rounding of their axes, degrees.
const LEAST_CONE_DEG: f32 = 0.05;
/// A smaller turn of an axis is rounding where only bounds are known, degrees.
const LEAST_TURN_DEG: f32 = 0.02;
/// A smaller relative change of size is rounding: boxes in a tree have steps of 1 in 255.
const LEAST_SCALE: f32 = 0.02;
/// A shorter move is rounding; relative to the largest coordinate.
const LEAST_MOVE: f32 = 4.0 * f32::EPSILON;
/// A smaller relative difference of energy is rounding if the energies were summed in different trees.
const LEAST_ENERGY: f32 = 1e-4;

/// All that differs between two versions of a light that are known to differ; `links` is what differs in those. Empty if only their
/// representation differs: a mesh that gains another instance gets a tree of its own.
pub(super) fn differences(
    before: &Described,
    after: &Described,
    links: &[Difference],
    apart: Option<Apart>,
) -> Vec<Difference> {
    let (a, b) = (&before.card, &after.card);
    let in_other_form = before.placed != after.placed;
    // Of a light that is off, only the prim is known.
    let both_lit = a.energy > 0.0 && b.energy > 0.0;
    let looks_told = a.kind.is_some() && b.kind.is_some();
    let mut found = Vec::new();
    if a.kind != b.kind && looks_told {
        found.push(Difference::Kind { before: a.kind, after: b.kind });
    }
    let tells_place = !in_other_form || before.shape.is_some();
    found.extend(transform(before, after).filter(|_| tells_place));
    let reshaped =
        both_lit && before.shape.is_some() && after.shape.is_some() && before.shape != after.shape;
    if a.emitters != b.emitters || reshaped {
        found.push(Difference::Topology { before: a.emitters, after: b.emitters });
    }
    let least_energy = if in_other_form { LEAST_ENERGY } else { 0.0 };
    if (a.energy - b.energy).abs() > least_energy * a.energy.max(b.energy) {
        let stops = both_lit.then(|| (b.energy / a.energy).log2());
        found.push(Difference::Energy { before: a.energy, after: b.energy, stops });
    }
    if a.color != b.color && looks_told && both_lit {
        found.push(Difference::Color { before: a.color, after: b.color });
    }
    if tells_place && both_lit && (a.half_angle_deg - b.half_angle_deg).abs() > LEAST_CONE_DEG {
        let (before_deg, after_deg) = (a.half_angle_deg, b.half_angle_deg);
        found.push(Difference::Cone { before_deg, after_deg });
    }
    if a.range_m != b.range_m && both_lit && !in_other_form {
        found.push(Difference::Range { before_m: a.range_m, after_m: b.range_m });
    }
    if a.forced != b.forced {
        found.push(Difference::Forced { before: a.forced, after: b.forced });
    }
    let [before_own, after_own] = [before, after].map(|version| version.profile.response);
    if before_own != after_own {
        let both = |response: Response| [response.diffuse, response.specular];
        found.push(Difference::Response { before: both(before_own), after: both(after_own) });
    }
    found.extend_from_slice(links);
    let goes_on = apart.is_some_and(|apart| exceeds(&apart, &found));
    if (both_lit && a.changes != b.changes) || (a.changes && found.is_empty()) || goes_on {
        found.push(Difference::OverTime { before: a.changes, after: b.changes, apart });
    }
    // A light of another kind always has another profile, so that is not reported.
    let respread = both_lit && a.kind == b.kind && before.profile.pattern != after.profile.pattern;
    if respread || (found.is_empty() && !in_other_form) {
        found.push(Difference::Pattern);
    }
    found
}

/// Whether two versions differ clearly more in some frame than in the first.
fn exceeds(apart: &Apart, at_first: &[Difference]) -> bool {
    let (mut moved, mut in_stops, mut is_reshaped) = (0.0, 0.0, false);
    for difference in at_first {
        match *difference {
            Difference::Transform { moved_m, .. } => moved = moved_m,
            Difference::Topology { .. } => is_reshaped = true,
            Difference::Energy { stops, .. } => in_stops = stops.unwrap_or(f32::INFINITY).abs(),
            _ => {}
        }
    }
    apart.most_moved_m > 1.01 * moved + 1e-4
        || apart.most_stops > 1.01 * in_stops + 1e-2
        || (apart.reshaped > 0 && !is_reshaped)
}

fn transform(before: &Described, after: &Described) -> Option<Difference> {
    match (before.to_world, after.to_world) {
        (Some(a), Some(b)) if a != b => Some(by_matrices(before, [a, b].map(|m| m.into()))),
        _ if before.card.energy > 0.0 && after.card.energy > 0.0 => by_bounds(before, after),
        _ => None,
    }
}

/// From its own space to the world's, in double precision.
struct Placing {
    linear: DMat3,
    origin: DVec3,
}

impl From<glam::Affine3A> for Placing {
    fn from(to_world: glam::Affine3A) -> Placing {
        Placing {
            linear: to_world.matrix3.as_dmat3(),
            origin: Vec3::from(to_world.translation).as_dvec3(),
        }
    }
}

impl Placing {
    /// Its rotation, without scale and reflection.
    fn rotation(&self) -> DMat3 {
        let mirrored = self.linear.determinant() < 0.0;
        let linear = if mirrored { -self.linear } else { self.linear };
        let x = linear.x_axis.normalize_or(DVec3::X);
        let y = (linear.y_axis - x * x.dot(linear.y_axis)).normalize_or(x.any_orthonormal_vector());
        DMat3::from_cols(x, y, x.cross(y))
    }
}

/// The difference where both transforms are known. The move is that of the point that was the light's
/// middle before.
fn by_matrices(before: &Described, [a, b]: [Placing; 2]) -> Difference {
    let is_near = before.card.place.is_some();
    let middle = before.card.place.map_or(DVec3::ZERO, |p| Vec3::from(p.center_m).as_dvec3());
    let inverse = a.linear.inverse();
    let own = if inverse.is_finite() { inverse * (middle - a.origin) } else { DVec3::ZERO };
    let there = [&a, &b].map(|placing| placing.linear * own + placing.origin);
    let turn = b.rotation() * a.rotation().transpose();
    // The chord: accurate for small turns, where the cosine is not.
    let chord2 =
        (0..3).map(|i| (turn.col(i) - DMat3::IDENTITY.col(i)).length_squared()).sum::<f64>();
    let turned = 2.0 * (0.125 * chord2).sqrt().min(1.0).asin();
    let grown = (b.linear.determinant() / a.linear.determinant()).abs().cbrt();
    let turned_deg = turned.to_degrees() as f32;
    let scaled = if grown.is_finite() { grown as f32 } else { 1.0 };
    let least = |value: f32, still: f32, least: f32| {
        if (value - still).abs() <= least { still } else { value }
    };
    Difference::Transform {
        moved_m: if is_near { moved(there[0].as_vec3(), there[1].as_vec3()) } else { 0.0 },
        turned_deg: least(turned_deg, 0.0, 1e-4),
        scaled: least(scaled, 1.0, 1e-6),
    }
}

/// The difference where only bounds are known, or where the shape changed and the transform did not.
fn by_bounds(before: &Described, after: &Described) -> Option<Difference> {
    let (a, b) = (before.card.place?, after.card.place?);
    let moved_m = moved(a.center_m.into(), b.center_m.into());
    let turned_deg = match (before.card.axis, after.card.axis) {
        (Some(a), Some(b)) => {
            let (a, b) = (Vec3::from(a), Vec3::from(b));
            let flips = (before.two_sided || after.two_sided) && a.dot(b) < 0.0;
            angle::between(a, if flips { -b } else { b }).to_degrees()
        }
        _ => 0.0,
    };
    let turned_deg = if turned_deg < LEAST_TURN_DEG { 0.0 } else { turned_deg };
    // A turn changes the size of the box, so scale is only told without one.
    let [size_a, size_b] = [a, b].map(|place| Vec3::from(place.size_m).length());
    let scaled = if turned_deg == 0.0 && size_a > 0.0 { size_b / size_a } else { 1.0 };
    let scaled = if (scaled - 1.0).abs() < LEAST_SCALE { 1.0 } else { scaled };
    let differs = moved_m != 0.0 || turned_deg != 0.0 || scaled != 1.0;
    differs.then_some(Difference::Transform { moved_m, turned_deg, scaled })
}

/// A distance, 0 if it is rounding.
fn moved(from: Vec3, to: Vec3) -> f32 {
    let distance = (to - from).length();
    let largest = from.abs().max(to.abs()).max_element();
    if distance <= LEAST_MOVE * largest { 0.0 } else { distance }
}
