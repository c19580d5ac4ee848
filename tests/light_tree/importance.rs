//! Importance 0 is a proof of darkness, and importance has no unit but the light's.

use crate::support::{can_light, emitters, receiver, tree_over};
use candelabra::bounds::{Cone, LightBounds};
use candelabra::light_tree::{Link, Node, Receiver};
use glam::Vec3;
use proptest::prelude::*;

proptest! {
    #[test]
    fn zero_importance_means_no_light(bounds in emitters(60), receiver in receiver()) {
        let tree = tree_over(&bounds);
        // Emitters that light the receiver, by leaf; then no cluster above one may be called dark.
        for bounds in &bounds {
            let node = Node::encode(bounds, Link::Emitter(0));
            prop_assert!(node.importance(&receiver) > 0.0 || !can_light(bounds, &receiver));
        }
        let row = &tree.trees()[0];
        let mut open = vec![(row.root, row.first_group, false)];
        while let Some((node, children, dark)) = open.pop() {
            let dark = dark || node.importance(&receiver) == 0.0;
            for child in tree.groups()[children as usize].nodes() {
                match child.link() {
                    Link::Inner(ahead) => open.push((child, children + ahead, dark)),
                    Link::Emitter(emitter) => {
                        prop_assert!(!dark || !can_light(&bounds[emitter as usize], &receiver));
                    }
                    Link::Instance(_) | Link::Nothing => unreachable!(),
                }
            }
        }
    }

    #[test]
    fn eight_lanes_weigh_what_eight_nodes_weigh(
        bounds in emitters(60), receiver in receiver(), round in any::<bool>()
    ) {
        // A group of lights that send light everywhere is weighed in a way of its own.
        let of_all = |own: LightBounds| LightBounds { cone: Cone::ALL, ..own };
        let round = |own| if round { of_all(own) } else { own };
        let bounds: Vec<_> = bounds.into_iter().map(round).collect();
        for group in tree_over(&bounds).groups() {
            let weights = group.importances(&receiver);
            for (lane, weight) in weights.into_iter().enumerate() {
                let alone = group.node(lane).map_or(0.0, |node| node.importance(&receiver));
                prop_assert_eq!(weight, alone);
            }
        }
    }

    #[test]
    fn importance_is_positive_finite_and_scales_like_irradiance(
        bounds in emitters(2), receiver in receiver(), exponent in -20i32..20
    ) {
        let scale = 2f32.powi(exponent);
        let scaled_bounds = LightBounds {
            aabb: candelabra::bounds::Aabb {
                min: bounds[0].aabb.min * scale,
                max: bounds[0].aabb.max * scale,
            },
            range_m: bounds[0].range_m * scale,
            ..bounds[0]
        };
        let at = Node::encode(&bounds[0], Link::Emitter(0)).importance(&receiver);
        let scaled = Node::encode(&scaled_bounds, Link::Emitter(0))
            .importance(&Receiver { point: receiver.point * scale, ..receiver });
        prop_assert!(at >= 0.0 && at.is_finite());
        // Right at a light without size there is no distance that could scale.
        let aabb = bounds[0].aabb;
        prop_assume!(aabb.min != aabb.max || aabb.min != receiver.point);
        let expected = at / f64::from(scale).powi(2);
        prop_assert!((scaled - expected).abs() <= 1e-5 * expected, "{scaled} {expected}");
    }
}

#[test]
fn a_point_obeys_the_inverse_square_and_the_cosine() {
    let bounds = LightBounds::of_emitter(
        candelabra::bounds::Aabb::around([Vec3::new(0.0, 0.0, 2.0)]),
        candelabra::bounds::Cone::ALL,
        8.0,
        f32::INFINITY,
    );
    let node = Node::encode(&bounds, Link::Emitter(0));
    let facing = Receiver { point: Vec3::ZERO, normal: Vec3::Z };
    assert!((node.importance(&facing) - 2.0).abs() < 1e-6);
    let tilted = Receiver { normal: Vec3::new(0.6, 0.0, 0.8), ..facing };
    assert!((node.importance(&tilted) - 1.6).abs() < 1e-6);
    let away = Receiver { normal: -Vec3::Z, ..facing };
    assert_eq!(node.importance(&away), 0.0);
    let inside = Receiver { point: Vec3::new(0.0, 0.0, 2.0), normal: Vec3::Z };
    assert!(node.importance(&inside).is_finite() && node.importance(&inside) > 1e6);
}

/// A distance to a box is the difference of two large numbers where the box is large.
#[test]
fn a_lamp_within_reach_at_the_face_of_a_large_box_is_not_called_out_of_range() {
    use candelabra::bounds::{Aabb, Cone};
    for exponent in [-40, -20, 0, 20, 40] {
        let size = 2f32.powi(exponent);
        let aabb = Aabb { min: Vec3::new(-2.0 * size, 0.0, 0.0), max: Vec3::ZERO };
        let range_m = 0.8 * f32::EPSILON * size;
        let bounds = LightBounds::of_emitter(aabb, Cone::ALL, 1.0, range_m);
        let node = Node::encode(&bounds, Link::Emitter(0));
        let near = Vec3::X * 0.75 * f32::EPSILON * size;
        let reached = node.importance(&Receiver { point: near, normal: Vec3::ZERO });
        let beyond = node.importance(&Receiver { point: 1e3 * near, normal: Vec3::ZERO });
        // Ranges end at 2^-31.75 m.
        assert!(reached > 0.0 && (beyond == 0.0 || exponent < 0), "{exponent}: {reached} {beyond}");
    }
}

/// Receivers placed along the edge of what a cluster can light, where rounding decides: for each the
/// exact cosine beyond the cone is known, and light that is there is not called absent.
#[test]
fn light_at_the_very_edge_is_not_called_dark() {
    use candelabra::bounds::{Aabb, Cone};
    use glam::DVec3;
    let mut worst = 0f64;
    for step in 0..200_000u32 {
        let random =
            |n: u32| f64::from(candelabra::math::random::hash(step, n)) / f64::from(u32::MAX);
        let half = Vec3::splat(10f64.powf(-3.0 * random(0)) as f32);
        let theta_o = if step % 3 == 0 { 0.0 } else { 3.0 * random(1) };
        let cone = Cone { theta_o: theta_o as f32, ..Cone::flat(Vec3::Y, false) };
        let aabb = Aabb { min: -half, max: half };
        let bounds = LightBounds::of_emitter(aabb, cone, 1.0, f32::INFINITY);
        let node = Node::encode(&bounds, Link::Emitter(0));
        // What sampling sees, exactly.
        let bounds = node.bounds();
        let radius = node.half_extent().as_dvec3().length();
        let distance = radius * (1.0 + 10f64.powf(-6.0 + 8.0 * random(2)));
        let theta_u = (radius / distance).asin();
        let edge = f64::from(bounds.cone.theta_o) + theta_u + std::f64::consts::FRAC_PI_2;
        if edge >= std::f64::consts::PI {
            continue;
        }
        let inside = edge - 10f64.powf(-7.0 + 4.0 * random(3));
        let axis = bounds.cone.axis.as_dvec3().normalize();
        let across = axis.any_orthonormal_vector();
        let turn = glam::DQuat::from_axis_angle(axis, random(4) * std::f64::consts::TAU);
        let direction: DVec3 = axis * inside.cos() + turn * across * inside.sin();
        let center = node.center().as_dvec3();
        let receiver =
            Receiver { point: (center + direction * distance).as_vec3(), normal: Vec3::ZERO };
        if node.importance(&receiver) == 0.0 {
            worst = worst.max(edge - inside);
        }
    }
    // The receiver itself was rounded to f32.
    assert!(worst < 1e-6, "{worst}");
}
