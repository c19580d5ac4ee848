//! Nodes: what is encoded is contained, and decoded alike.

use super::*;
use proptest::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI};

fn any_bounds() -> impl Strategy<Value = LightBounds> {
    let point = prop::array::uniform3(-1f32..1.0).prop_map(Vec3::from);
    let scale = (-20i32..20).prop_map(|e| 2f32.powi(e));
    let extent = prop::array::uniform3(prop_oneof![Just(0f32), 0f32..1.0]).prop_map(Vec3::from);
    let axis = point.clone().prop_filter_map("no direction", Vec3::try_normalize);
    let theta_o = prop_oneof![Just(0f32), 0f32..PI, Just(PI)];
    let theta_e = prop_oneof![Just(FRAC_PI_2), 0.001f32..FRAC_PI_2];
    let cone = (axis, theta_o, theta_e, any::<bool>())
        .prop_map(|(axis, theta_o, theta_e, two_sided)| Cone { axis, theta_o, theta_e, two_sided });
    let range = prop_oneof![Just(f32::INFINITY), 1e-6f32..1e6];
    (point, scale.clone(), extent, scale, cone, 1e-30f32..1e30, range).prop_map(
        |(p, far, extent, size, cone, energy, range_m)| {
            let min = p * far;
            let aabb = Aabb { min, max: min + extent * size };
            LightBounds::of_emitter(aabb, cone, energy, range_m)
        },
    )
}

#[test]
fn of_every_direction_the_sine_is_one() {
    for code in 0..=u16::MAX {
        assert_eq!(is_round(code), decode_sin_half_theta_o(code) >= 1.0, "{code}");
    }
    let everywhere = Aabb::around([Vec3::ONE]);
    let everywhere = LightBounds::of_emitter(everywhere, Cone::ALL, 1.0, 1.0);
    assert!(is_round(Node::encode(&everywhere, Link::Emitter(0)).theta_o));
}

proptest! {
    #[test]
    fn a_node_contains_what_it_encodes(bounds in any_bounds()) {
        let decoded = Node::encode(&bounds, Link::Emitter(3)).bounds();
        prop_assert!(decoded.aabb.contains_box(&bounds.aabb), "{decoded:?}");
        let tilt = between(decoded.cone.axis, bounds.cone.axis);
        let needed = (tilt + bounds.cone.theta_o).min(PI);
        prop_assert!(decoded.cone.theta_o >= needed - 2e-6);
        prop_assert!(decoded.cone.theta_e >= bounds.cone.theta_e - 1e-6);
        // The share is kept to a step of its root where normals point everywhere; elsewhere it follows from theta_e.
        let of_all = decoded.cone.theta_o >= PI;
        let told = if of_all { bounds.share } else { Cone { theta_o: 0.0, ..bounds.cone }.share() };
        prop_assert!((decoded.share.sqrt() - told.sqrt()).abs() < 0.011, "{} {told}", decoded.share);
        prop_assert_eq!(decoded.energy, bounds.energy);
        prop_assert!(decoded.range_m >= bounds.range_m);
        let close = decoded.range_m <= bounds.range_m * 1.2;
        prop_assert!(close || !(1e-9..1e9).contains(&bounds.range_m));
    }

    #[test]
    fn encoding_twice_is_encoding_once(bounds in any_bounds()) {
        let once = Node::encode(&bounds, Link::Inner(5));
        let twice = Node::encode(&once.bounds(), Link::Inner(5));
        prop_assert_eq!(once.axis, twice.axis);
        prop_assert_eq!(once.theta_o, twice.theta_o);
        prop_assert_eq!(once.theta_e, twice.theta_e);
        prop_assert_eq!(once.range, twice.range);
    }
}

#[test]
fn what_is_exact_stays_exact() {
    let bounds = LightBounds::of_emitter(
        Aabb { min: Vec3::splat(1e7), max: Vec3::splat(1e7) },
        Cone::flat(Vec3::Y, true),
        2.0,
        f32::INFINITY,
    );
    assert_eq!(Node::encode(&bounds, Link::Emitter(0)).bounds(), bounds);
    let all = LightBounds { cone: Cone::ALL, ..bounds };
    assert_eq!(Node::encode(&all, Link::Emitter(0)).bounds().cone, Cone::ALL);
}

#[test]
fn a_node_takes_32_bytes_alone_and_in_a_group() {
    use crate::light_tree::group::{Group, WIDTH};
    assert_eq!((size_of::<Node>(), size_of::<Group>()), (32, 32 * WIDTH));
}

#[test]
fn links_survive() {
    for link in [Link::Nothing, Link::Inner(7), Link::Emitter(0), Link::Instance(0)] {
        assert_eq!(Link::decode(link.encode()), link);
    }
}
