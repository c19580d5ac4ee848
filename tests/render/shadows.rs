//! Shadows end where the light is: not before it, and not behind it.

use crate::closed_forms::{ALBEDO, assert_dark, of_polygon, of_sphere, panel, receiver};
use crate::stage::{Stage, at, direct, facing, glow, lambert};
use crate::statistics::Estimate;
use candelabra::scene::{LightKind, Trs};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

fn ball(radius: f32) -> LightKind {
    LightKind::Sphere { radiance_nits: Vec3::splat(5.0), radius, shaping: None }
}

/// What stands close before a light hides it, however far away the receiver is.
#[test]
fn a_shade_close_to_a_far_lamp_hides_it() {
    let place = DVec3::Y * 200.0;
    let shade = |stage: &mut Stage, gap: f64| {
        let below = place - DVec3::Y * gap;
        stage.quad([0.5; 2], lambert(Vec3::ZERO), facing(below, DVec3::ZERO));
    };
    let mut panel = receiver(DVec3::Y);
    panel.quad([0.4; 2], glow(Vec3::splat(1e3)), facing(place, DVec3::ZERO));
    shade(&mut panel, 0.01);
    assert_dark("a panel behind its shade", &panel);
    let mut point = receiver(DVec3::Y);
    point.light(LightKind::Point { intensity_cd: Vec3::splat(1e3) }, at(place));
    shade(&mut point, 0.01);
    assert_dark("a point behind its shade", &point);
    let mut sphere = receiver(DVec3::Y);
    sphere.light(ball(0.1), at(place));
    shade(&mut sphere, 0.11);
    assert_dark("a sphere behind its shade", &sphere);
}

/// Moves everything far from the origin, where a coordinate is good to half a millimetre.
fn far_away(mut stage: Stage) -> Stage {
    let here = DVec3::new(8192.0, -4096.0, 8192.0);
    for node in &mut stage.scene.nodes {
        let Trs::Parts { translation, .. } = &mut node.local else { unreachable!() };
        *translation += here;
    }
    stage
}

/// A lamp that is closer than any fixed share of the way, or the rounding of places, could tell from
/// the receiver.
#[test]
fn a_near_lamp_far_from_the_origin_does_not_hide_itself() {
    let assert_lit = |stage: Stage, expected_lux: f64| {
        let buffers = far_away(stage).render(&direct(8, 256));
        let seen = Estimate::of_picture(&buffers).mean.x / (expected_lux * ALBEDO / PI);
        // Rounded places do not make a round number.
        assert!((seen - 1.0).abs() < 0.01, "{seen}");
    };
    let (place, size) = (DVec3::Y * 0.125, [0.25; 2]);
    let mut stage = receiver(DVec3::Y);
    stage.quad(size.map(|side| side as f32), glow(Vec3::ONE), facing(place, DVec3::ZERO));
    assert_lit(stage, of_polygon(&panel(size, place, DVec3::ZERO), DVec3::Y));
    let center = DVec3::Y * 0.25;
    let mut stage = receiver(DVec3::Y);
    stage.light(ball(0.125), at(center));
    assert_lit(stage, 5.0 * of_sphere(center, 0.125, DVec3::Y));
}

/// Ingest takes a scale that is uniform to one part in ten thousand for uniform: the sphere that is
/// sampled must then still be the one that rays hit.
#[test]
fn a_sphere_under_a_hardly_uniform_scale_does_not_hide_itself() {
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for off in [-9e-5, 9e-5] {
            let center = DVec3::Y * 2.0;
            let Trs::Parts { translation, rotation, .. } = at(center) else { unreachable!() };
            let place = Trs::Parts { translation, rotation, scale: DVec3::ONE + axis * off };
            let mut stage = receiver(DVec3::Y);
            stage.light(ball(0.5), place);
            let seen = Estimate::of_picture(&stage.render(&direct(8, 256))).mean.x;
            let expected = 5.0 * of_sphere(center, 0.5, DVec3::Y) * ALBEDO / PI;
            assert!((seen / expected - 1.0).abs() < 0.01, "{axis} {off}: {seen} {expected}");
        }
    }
}
