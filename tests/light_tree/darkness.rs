//! Importance 0 is a theorem: no light arrives. Here it is tested for every viewer, against double
//! precision, with all lengths and angles log-uniform over many decades.
//!
//! Each case is made backwards: an emitter of a cluster, a ray of light that leaves it within its
//! profile, and a viewer that this ray reaches, from just inside the profile's edge, just above the
//! viewer's horizon, just within range. A viewer that calls such a cluster dark loses light in a way
//! that no number of samples mends.

use crate::city::{City, Part, Placed};
use crate::support::{AnyViewer, direction, for_viewer};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{DistanceOnly, Glossy, Link, Lobes, Node, Receiver, Segment};
use candelabra::math::Similarity;
use glam::{Affine3A, DQuat, DVec3, Quat, Vec3};
use proptest::prelude::*;

/// A number whose logarithm to base 10 is uniform.
fn decades(from: f64, to: f64) -> impl Strategy<Value = f64> {
    (from..to).prop_map(|exponent| 10f64.powf(exponent))
}

/// Zero, or log-uniform.
fn zero_or_decades(from: f64, to: f64) -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 4 => decades(from, to)]
}

/// A cluster, one emitter in it, and the point that a ray of its light reaches.
#[derive(Clone, Debug)]
struct Lit {
    bounds: LightBounds,
    emitter: DVec3,
    normal: DVec3,
    /// Near this point the viewer stands.
    reached: DVec3,
}

/// Turns a unit vector by an angle about an axis across it.
fn tilted(from: DVec3, by: f64, about: f64) -> DVec3 {
    // Not a frame of its own for each vector: tilts about the same angle are in one plane.
    let (x, y) = (DVec3::X.reject_from(from), DVec3::Y.reject_from(from));
    let across = if x.length() > y.length() { x } else { y };
    let across = DQuat::from_axis_angle(from, about) * across.normalize();
    (from * by.cos() + across * by.sin()).normalize()
}

fn lit() -> impl Strategy<Value = Lit> {
    // Powers of two are boxes that the node keeps exactly: no rounding hides anything there.
    let exact = (-30i32..30).prop_map(|exponent| 2f64.powi(exponent));
    let half = prop::array::uniform3(prop_oneof![2 => zero_or_decades(-9.0, 9.0), 1 => exact]);
    let place = prop::array::uniform3(prop_oneof![Just(0f64), Just(1.0), 0f64..1.0]);
    let right = std::f64::consts::FRAC_PI_2;
    let center = prop::array::uniform3(prop_oneof![2 => Just(0f32), 1 => -1f32..1.0]);
    let theta_o = prop_oneof![2 => zero_or_decades(-6.0, 0.49), 1 => Just(std::f64::consts::PI)];
    let theta_e = prop_oneof![1 => Just(right), 1 => decades(-4.0, 0.19)];
    let within = prop::array::uniform2(prop_oneof![2 => decades(-9.0, 0.0), 1 => Just(0.0)]);
    // Tilts in one plane add up, to the very edge of the profile.
    let turns = prop_oneof![prop::array::uniform2(0f64..7.0), (0f64..7.0).prop_map(|t| [t, t])];
    let range = prop_oneof![2 => Just(f64::INFINITY), 1 => decades(-6.0, 3.0)];
    let cone = (direction(), theta_o, theta_e, any::<bool>());
    ((half, place, center), cone, within, turns, decades(-9.0, 9.0), range).prop_map(
        |(
            (half, place, center),
            (axis, theta_o, theta_e, two_sided),
            within,
            turns,
            distance,
            beyond,
        )| {
            let half = DVec3::from(half).as_vec3();
            let center = Vec3::from(center) * half.max_element();
            let aabb = Aabb { min: center - half, max: center + half };
            let emitter = aabb.min.as_dvec3().lerp(aabb.max.as_dvec3(), 0.5)
                + (DVec3::from(place) - 0.5) * aabb.extent().as_dvec3();
            let cone = Cone { axis, theta_o: theta_o as f32, theta_e: theta_e as f32, two_sided };
            let exact_axis = axis.as_dvec3().normalize();
            let normal = tilted(exact_axis, f64::from(cone.theta_o) * (1.0 - within[0]), turns[0]);
            let normal = if two_sided && turns[0] > 3.0 { -normal } else { normal };
            let leaving = tilted(normal, f64::from(cone.theta_e) * (1.0 - within[1]), turns[1]);
            let reached = emitter + distance * leaving;
            // As far as the viewer is, once its place is rounded.
            let rounded = (reached.as_vec3().as_dvec3() - emitter).length();
            let range_m = (rounded * (1.0 + beyond)) as f32;
            let bounds = LightBounds::of_emitter(aabb, cone, 1.0, range_m);
            Lit { bounds, emitter, normal, reached }
        },
    )
}

impl Lit {
    /// Whether light of the emitter reaches a point from above a horizon, beyond the rounding of
    /// double precision.
    fn reaches(&self, point: DVec3, horizon: Vec3) -> bool {
        let way = point - self.emitter;
        let distance = way.length();
        let normal = if self.bounds.cone.two_sided && way.dot(self.normal) < 0.0 {
            -self.normal
        } else {
            self.normal
        };
        let off = normal.cross(way).length().atan2(normal.dot(way));
        let received = -horizon.as_dvec3().dot(way) > 1e-12 * distance;
        distance > 0.0
            && off < f64::from(self.bounds.cone.theta_e) * (1.0 - 1e-9)
            && distance < f64::from(self.bounds.range_m)
            && (received || horizon == Vec3::ZERO)
    }
}

/// How a viewer is put where the light arrives.
#[derive(Clone, Copy, Debug)]
struct Standing {
    /// Which kind of viewer.
    kind: u32,
    /// How far above its horizon the light comes from, radians; and about where.
    above: f64,
    turn: f64,
    /// Of a segment: its direction, and how far it runs before and behind the point.
    along: Vec3,
    parallel: f64,
    before: f64,
    behind: f64,
}

fn standing() -> impl Strategy<Value = Standing> {
    let along = (direction(), zero_or_decades(-9.0, 0.5));
    let kinds = (0u32..8, decades(-9.0, 0.19), 0f64..7.0);
    (kinds, along, decades(-9.0, 9.0), zero_or_decades(-9.0, 9.0)).prop_map(
        |((kind, above, turn), (along, parallel), before, behind)| Standing {
            kind,
            above,
            turn,
            along,
            parallel,
            before,
            behind,
        },
    )
}

/// The viewer, and the points at which light of it counts: those that it may really draw.
fn viewer(lit: &Lit, standing: &Standing) -> (AnyViewer, Vec<(DVec3, Vec3)>) {
    let towards = (lit.emitter - lit.reached).normalize();
    let normal = match standing.kind {
        0 => Vec3::ZERO,
        _ => tilted(towards, std::f64::consts::FRAC_PI_2 - standing.above, standing.turn).as_vec3(),
    };
    let receiver = Receiver { point: lit.reached.as_vec3(), normal };
    let at = vec![(receiver.point.as_dvec3(), normal)];
    match standing.kind {
        0..=2 => (AnyViewer::Receiver(receiver), at),
        3 => {
            let lobes = Lobes { diffuse: 0.5, at_normal: 0.04, toward_grazing: 0.9, alpha: 0.01 };
            let glossy = Glossy { receiver, about: normal, to_eye: normal, lobes, toward: normal };
            (AnyViewer::Glossy(glossy), at)
        }
        4 => (AnyViewer::DistanceOnly(DistanceOnly(receiver)), at),
        _ => {
            // Any direction, or nearly the one of the light.
            let direction = tilted(towards, standing.parallel, standing.turn).as_vec3();
            let direction = if standing.kind == 5 { standing.along } else { direction };
            let direction = direction.normalize();
            let reach = (lit.reached - lit.emitter).length();
            let before = (standing.before * reach).min(1e9) as f32;
            let origin = (lit.reached - f64::from(before) * direction.as_dvec3()).as_vec3();
            let length = before + (standing.behind * reach) as f32;
            let segment = Segment { origin, direction, length };
            let drawn = origin + before * direction;
            let exact = origin.as_dvec3() + f64::from(before) * direction.as_dvec3();
            let points = vec![(drawn.as_dvec3(), Vec3::ZERO), (exact, Vec3::ZERO)];
            (AnyViewer::Segment(segment), points)
        }
    }
}

/// The rounding of a viewer's place may have taken it out of the light.
fn is_lit(lit: &Lit, at: &[(DVec3, Vec3)]) -> bool {
    at.iter().any(|&(point, horizon)| lit.reaches(point, horizon))
}

/// So many cases in which light arrives.
fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, max_global_rejects: 20 * cases, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn no_viewer_calls_light_darkness(lit in lit(), standing in standing()) {
        let (viewer, at) = viewer(&lit, &standing);
        prop_assume!(is_lit(&lit, &at));
        let node = Node::encode(&lit.bounds, Link::Emitter(0));
        let importance = for_viewer!(viewer, |viewer| node.importance(&viewer));
        prop_assert!(importance > 0.0 && importance.is_finite(), "{viewer:?}: {importance}");
    }
}

/// The map back, in double precision.
fn to_world(placed: &Placed) -> (glam::DMat3, DVec3) {
    let Similarity { axes, origin } =
        Similarity::undoing(&placed.to_world).expect("it keeps shapes");
    let columns = axes.map(|axis| Vec3::from_array(axis).as_dvec3());
    (
        glam::DMat3::from_cols_array(&columns.map(|c| c.to_array()).concat().try_into().unwrap())
            .inverse(),
        Vec3::from_array(origin).as_dvec3(),
    )
}

proptest! {
    #![proptest_config(cases(4_000))]

    /// The same across the border of two spaces: the emitter belongs to an instance, turned, scaled
    /// and put elsewhere, the viewer stands in world space.
    #[test]
    fn nor_does_one_in_another_space(
        lit in lit(), standing in standing(), turn in direction(), angle in 0f32..7.0,
        scale in decades(-4.0, 4.0), far in zero_or_decades(-4.0, 5.0), to in direction()
    ) {
        // Ranges are rounded on their way into the instance's space.
        let bounds = LightBounds { range_m: f32::INFINITY, ..lit.bounds };
        let lit = Lit { bounds, ..lit };
        let size = lit.bounds.aabb.extent().length().max((lit.reached.length()) as f32);
        let placed = Placed {
            tree: 0,
            to_world: Affine3A::from_scale_rotation_translation(
                Vec3::splat(scale as f32),
                Quat::from_axis_angle(turn.normalize(), angle),
                to * (far * scale) as f32 * size,
            ),
            brightness: 1.0,
        };
        // Where everything is in world space, as exactly as the file says it.
        let (linear, origin) = to_world(&placed);
        let out = |p: DVec3| linear * (p - origin);
        let there = Lit {
            bounds: lit.bounds,
            emitter: out(lit.emitter),
            normal: (linear * lit.normal).normalize(),
            reached: out(lit.reached),
        };
        prop_assume!(there.reached.length() < 1e9 && lit.reached.length() < 1e9);
        let (viewer, at) = viewer(&there, &standing);
        prop_assume!(is_lit(&there, &at));
        let city = City {
            shared: vec![vec![lit.bounds]],
            still: Part { flat: Vec::new(), placed: vec![placed] },
            changing: Part::default(),
            forced: Vec::new(),
        };
        let tree = city.tree();
        let frame = tree.at_frame(1).unwrap();
        let probability = for_viewer!(viewer, |viewer| frame.probability(&viewer, 0));
        prop_assert!(probability == 1.0, "{viewer:?}: {probability}");
    }
}
