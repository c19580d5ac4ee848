//! Fog: light that scatters once against numerical quadrature, what is lost on the way against
//! Beer's law, and every way of picking lights against every other.

use crate::closed_forms::{ALBEDO, receiver};
use crate::rooms::{self, Room};
use crate::stage::{Set, Stage, aimed, at, by, direct, facing, glow, lambert, scaled};
use crate::statistics::{assert_even, pixels};
use crate::strategies::{WAYS, Way, assert_agreement, disagreement, render};
use candelabra::render::{LightStrategy, RenderSettings};
use candelabra::scene::{FogBox, LightKind, Medium, Projection, Shaping, Trs};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use std::f64::consts::PI;

/// The eye looks along this.
const AHEAD: DVec3 = DVec3::X;
/// Where every box of fog below ends at the latest, metres from the eye.
const FAR: f64 = 8.0;

fn medium(scattering: f64, absorption: f64, g: f64) -> Medium {
    Medium {
        scattering: Vec3::splat(scattering as f32),
        absorption: Vec3::splat(absorption as f32),
        anisotropy: g as f32,
        region: None,
    }
}

/// An eye at the origin that looks ahead into nothing but a box of fog, which is turned and of
/// uneven size and begins beyond the eye.
fn into_a_box(medium: Medium) -> (Stage, DAffine3) {
    let mut stage = Stage::default();
    stage.look(DVec3::ZERO, AHEAD, 1e-3);
    let (scale, rotation) = (DVec3::new(2.0, 0.5, -1.5), DQuat::from_rotation_z(0.4));
    let translation = DVec3::new(3.0, 0.3, 0.2);
    let node = stage.node(Trs::Parts { translation, rotation, scale });
    let (min, max) = (Vec3::new(-1.0, -1.5, -0.8), Vec3::new(0.9, 2.0, 1.0));
    stage.scene.medium = Some(Medium { region: Some(FogBox { node, min, max }), ..medium });
    (stage, DAffine3::from_scale_rotation_translation(scale, rotation, translation).inverse())
}

/// Whether a point is in the fog.
fn is_in_fog(stage: &Stage, to_box: &DAffine3, point: DVec3) -> bool {
    let region = stage.scene.medium.as_ref().unwrap().region.unwrap();
    let local = to_box.transform_point3(point);
    local.cmpge(region.min.as_dvec3()).all() && local.cmple(region.max.as_dvec3()).all()
}

/// Metres of fog on the way from a point in it to another: a box has no holes.
fn way_out(stage: &Stage, to_box: &DAffine3, from: DVec3, to: DVec3) -> f64 {
    let (mut inside, mut outside) = (0.0, 1.0);
    if is_in_fog(stage, to_box, to) {
        inside = 1.0;
    }
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        let is_inside = is_in_fog(stage, to_box, from.lerp(to, middle));
        *(if is_inside { &mut inside } else { &mut outside }) = middle;
    }
    inside * from.distance(to)
}

/// Where the fog begins and ends ahead of the eye.
fn fog_ahead(stage: &Stage, to_box: &DAffine3) -> (f64, f64) {
    let steps = (0..1000).map(|i| AHEAD * (FAR * f64::from(i) / 1000.0));
    let middle = steps.into_iter().find(|&p| is_in_fog(stage, to_box, p)).unwrap();
    let begin = middle.length() - way_out(stage, to_box, middle, DVec3::ZERO);
    (begin, middle.length() + way_out(stage, to_box, middle, FAR * AHEAD))
}

fn phase(g: f64, cosine: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

/// Radiance that the fog ahead scatters towards the eye. `lights` tells for a point where its light
/// comes from and the irradiance of a surface there that faces it, without any fog.
fn quadrature(
    stage: &Stage,
    to_box: &DAffine3,
    steps: u32,
    lights: &dyn Fn(DVec3) -> Vec<(DVec3, f64)>,
) -> f64 {
    let medium = stage.scene.medium.as_ref().unwrap();
    let scattering = f64::from(medium.scattering.x);
    let extinction = scattering + f64::from(medium.absorption.x);
    let (begin, end) = fog_ahead(stage, to_box);
    let step = (end - begin) / f64::from(steps);
    let mut sum = 0.0;
    for i in 0..steps {
        let behind = (f64::from(i) + 0.5) * step;
        let point = AHEAD * (begin + behind);
        for (from, irradiance) in lights(point) {
            let way = behind + way_out(stage, to_box, point, from);
            let cosine = (from - point).normalize().dot(AHEAD);
            let turned = phase(f64::from(medium.anisotropy), cosine);
            sum += scattering * step * irradiance * turned * (-extinction * way).exp();
        }
    }
    sum
}

#[track_caller]
fn assert_scattered(what: &str, stage: &Stage, expected: f64) {
    for strategy in [LightStrategy::Tree, LightStrategy::All, LightStrategy::Uniform] {
        let buffers = stage.render(&by(strategy, true, &direct(8, 1024)));
        assert_even(&format!("{what}, {strategy:?}"), &buffers, expected, 0.004);
    }
}

/// What scatters how much, and where to.
const FOGS: [(f64, f64, f64); 4] =
    [(0.3, 0.2, 0.0), (0.8, 0.0, 0.6), (0.5, 0.1, -0.6), (1e-3, 0.0, 0.3)];

#[test]
fn a_point_is_scattered_as_quadrature_says() {
    for (scattering, absorption, g) in FOGS {
        // Inside the fog, beside the eye, far behind the fog; and straight ahead beyond it.
        for place in [
            DVec3::new(3.2, 0.6, 0.3),
            DVec3::new(0.1, 1.0, 0.0),
            DVec3::new(70.0, 3.0, 5.0),
            DVec3::new(7.0, 0.05, 0.0),
        ] {
            let (mut stage, to_box) = into_a_box(medium(scattering, absorption, g));
            stage.light(LightKind::Point { intensity_cd: Vec3::splat(9.0) }, at(place));
            let lit = |p: DVec3| vec![(place, 9.0 / place.distance_squared(p))];
            let expected = quadrature(&stage, &to_box, 2000, &lit);
            assert_scattered(&format!("a point at {place}, g {g}"), &stage, expected);
        }
    }
}

/// Where the fog is a hair's breadth to the light, angles must not be differences of large ones.
#[test]
fn a_light_almost_in_line_or_very_far_is_scattered_as_quadrature_says() {
    for (place, intensity) in [
        (DVec3::new(9.0, 2e-4, 0.0), 9f32),
        (DVec3::new(-5.0, 0.0, 4e-4), 9.0),
        (DVec3::new(4e5, 4e5, 0.0), 1e12),
        (DVec3::new(2e5, -3e5, 2e5), 1e12),
    ] {
        let (mut stage, to_box) = into_a_box(medium(0.4, 0.1, 0.2));
        stage.scene.cameras[0].projection = Projection::Perspective { yfov_rad: 1e-6 };
        stage.light(LightKind::Point { intensity_cd: Vec3::splat(intensity) }, at(place));
        let lit = |p: DVec3| vec![(place, f64::from(intensity) / place.distance_squared(p))];
        let expected = quadrature(&stage, &to_box, 2000, &lit);
        assert_scattered(&format!("a point at {place}"), &stage, expected);
    }
}

/// So far away, lights of a size are points.
#[test]
fn small_lights_of_every_kind_are_scattered_like_points() {
    let place = DVec3::new(3.5, 0.8, 1.5);
    let (scattering, absorption, g) = FOGS[1];
    let fog = || into_a_box(medium(scattering, absorption, g));
    let falloff = |p: DVec3| 1.0 / place.distance_squared(p);
    let aim = (DVec3::new(2.5, 0.0, 0.0) - place).normalize();
    let off_axis = |p: DVec3| (p - place).normalize().dot(aim).max(0.0);

    let (mut stage, to_box) = fog();
    let kind = LightKind::Sphere { radiance_nits: Vec3::splat(1e4), radius: 0.01, shaping: None };
    stage.light(kind, at(place));
    let lit = |p| vec![(place, 1e4 * PI * 1e-4 * falloff(p))];
    assert_scattered("a sphere", &stage, quadrature(&stage, &to_box, 2000, &lit));

    let (mut stage, to_box) = fog();
    stage.quad([0.02; 2], glow(Vec3::splat(1e4)), facing(place, place + aim));
    let lit = |p| vec![(place, 1e4 * 4e-4 * off_axis(p) * falloff(p))];
    assert_scattered("a panel", &stage, quadrature(&stage, &to_box, 2000, &lit));

    let (mut stage, to_box) = fog();
    let (inner, outer) = (0.3f64, 0.8f64);
    let shaping = Shaping::Khr { inner_rad: inner as f32, outer_rad: outer as f32 };
    let intensity_cd = Vec3::splat(9.0);
    stage.light(LightKind::Spot { intensity_cd, shaping }, aimed(place, place + aim));
    stage.scene.lights[0].range_m = Some(2.5);
    let lit = |p| {
        let ramp = (off_axis(p) - outer.cos()) / (inner.cos() - outer.cos());
        let window = (1.0 - (place.distance(p) / 2.5).powi(4)).max(0.0);
        vec![(place, 9.0 * ramp.clamp(0.0, 1.0).powi(2) * window * falloff(p))]
    };
    assert_scattered("a spot with a range", &stage, quadrature(&stage, &to_box, 2000, &lit));
}

/// Where on a wide light and where in the fog are drawn apart from each other.
#[test]
fn wide_lights_beside_the_ray_are_scattered_point_by_point() {
    const POINTS: u32 = 60;
    let (scattering, absorption, g) = FOGS[1];
    let (place, target) = (DVec3::new(2.0, -0.6, 0.4), DVec3::new(3.2, 0.5, 0.0));
    let normal = (target - place).normalize();
    let (mut stage, to_box) = into_a_box(medium(scattering, absorption, g));
    stage.quad([1.5, 0.5], glow(Vec3::splat(3.0)), facing(place, target));
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal);
    let lit = |p: DVec3| {
        let point = |i: u32| {
            let at = |k: u32| (f64::from(k) + 0.5) / f64::from(POINTS) - 0.5;
            let local = DVec3::new(1.5 * at(i % POINTS), 0.5 * at(i / POINTS), 0.0);
            let from = place + turn * local;
            let cosine = (p - from).normalize().dot(normal).max(0.0);
            let area = 1.5 * 0.5 / f64::from(POINTS * POINTS);
            (from, 3.0 * cosine * area / from.distance_squared(p))
        };
        (0..POINTS * POINTS).map(point).collect()
    };
    assert_scattered("a wide panel", &stage, quadrature(&stage, &to_box, 200, &lit));
}

#[test]
fn a_sun_and_a_sky_are_scattered_as_quadrature_says() {
    for (scattering, absorption, g) in FOGS {
        let toward = DVec3::new(-0.4, 1.0, 0.3).normalize();
        for angle_rad in [0.0, 0.01] {
            let (mut stage, to_box) = into_a_box(medium(scattering, absorption, g));
            let sun = LightKind::Distant { irradiance_lux: Vec3::splat(5.0), angle_rad };
            stage.light(sun, aimed(DVec3::ZERO, -toward));
            let lit = |p| vec![(p + FAR * toward, 5.0)];
            let expected = quadrature(&stage, &to_box, 2000, &lit);
            assert_scattered(&format!("a sun, g {g}"), &stage, expected);
        }

        let (mut stage, to_box) = into_a_box(medium(scattering, absorption, g));
        let radiance_nits = Vec3::splat(3.0);
        stage.light(LightKind::Dome { radiance_nits, texture: None }, at(DVec3::ZERO));
        // Directions all around, evenly.
        const DIRECTIONS: u32 = 4000;
        let direction = |i: u32| {
            let height = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(DIRECTIONS);
            let turn = f64::from(i) * PI * (3.0 - 5f64.sqrt());
            let out = (1.0 - height * height).sqrt();
            DVec3::new(height, out * turn.cos(), out * turn.sin())
        };
        let share = 3.0 * 4.0 * PI / f64::from(DIRECTIONS);
        let lit = |p| (0..DIRECTIONS).map(|i| (p + FAR * direction(i), share)).collect();
        let scattered = quadrature(&stage, &to_box, 100, &lit);
        let (begin, end) = fog_ahead(&stage, &to_box);
        let seen = 3.0 * (-(scattering + absorption) * (end - begin)).exp();
        assert_scattered(&format!("a sky, g {g}"), &stage, scattered + seen);
    }
}

#[test]
fn what_is_seen_through_fog_is_dimmed_by_beers_law() {
    let extinction = Vec3::new(0.1, 0.7, 2.0);
    for distance in [0.5, 3.0] {
        let mut stage = Stage::default();
        stage.quad([9.0; 2], glow(Vec3::splat(5.0)), facing(AHEAD * distance, DVec3::ZERO));
        stage.look(DVec3::ZERO, AHEAD, 1e-3);
        let scattering = 0.25 * extinction;
        let absorption = extinction - scattering;
        stage.scene.medium = Some(Medium { scattering, absorption, anisotropy: 0.0, region: None });
        let buffers = stage.render(&RenderSettings { depth: 0, ..direct(2, 4) });
        let expected = 5.0 * (-extinction * distance as f32).exp();
        for pixel in pixels(&buffers) {
            let off = (pixel.beauty / expected - 1.0).abs().max_element();
            assert!(off < 1e-5, "{} {expected}", pixel.beauty);
        }
    }
}

#[test]
fn light_is_dimmed_on_its_way_to_a_surface_and_on_from_there() {
    let (place, absorption) = (DVec3::new(0.5, 2.0, -1.0), 0.6);
    let mut stage = receiver(DVec3::Y);
    stage.light(LightKind::Point { intensity_cd: Vec3::splat(90.0) }, at(place));
    stage.scene.medium = Some(medium(0.0, absorption, 0.0));
    let clear = 90.0 * place.normalize().y / place.length_squared();
    let eye = 0.1 * (DVec3::Y + 0.8 * DVec3::Y.any_orthonormal_vector());
    let way = place.length() + eye.length();
    let expected = clear * ALBEDO / PI * (-absorption * way).exp();
    for strategy in [LightStrategy::Tree, LightStrategy::All] {
        let buffers = stage.render(&by(strategy, true, &direct(8, 256)));
        assert_even("a point in fog", &buffers, expected, 0.001);
    }
    // A sun shines through fog that is everywhere: all the way that the fog's box is high.
    let mut stage = receiver(DVec3::Y);
    stage.quad([0.1; 2], lambert(Vec3::ZERO), facing(DVec3::new(9.0, 3.0, 0.0), DVec3::ZERO));
    let irradiance_lux = Vec3::splat(4.0);
    let sun = LightKind::Distant { irradiance_lux, angle_rad: 0.0 };
    stage.light(sun, aimed(DVec3::ZERO, -DVec3::Y));
    stage.scene.medium = Some(medium(0.0, absorption, 0.0));
    // The panel leans: its upper edge stands above its middle.
    let up = stage.scene.pose_at(0.0).world(stage.scene.instances[1].node);
    let corners = stage.scene.meshes[1].positions.iter();
    let top = corners.map(|&p| up.transform_point3(p).y).fold(0.0, f32::max);
    let expected = 4.0 * ALBEDO / PI * (-absorption * (f64::from(top) + eye.length())).exp();
    let buffers = stage.render(&direct(8, 256));
    assert_even("a sun in fog", &buffers, expected, 0.001);
}

#[test]
fn fog_without_extinction_changes_nothing() {
    let mut stage = rooms::lambert_room();
    let settings = RenderSettings { depth: 3, ..direct(16, 8) };
    let clear = stage.render(&settings);
    stage.scene.medium = Some(medium(0.0, 0.0, 0.5));
    let foggy = stage.render(&settings);
    for (a, b) in pixels(&clear).iter().zip(&pixels(&foggy)) {
        assert_eq!(a.beauty.to_array().map(f32::to_bits), b.beauty.to_array().map(f32::to_bits));
        assert_eq!(a.variance, b.variance);
    }
    stage.scene.medium = Some(medium(1e-3, 0.0, 0.5));
    let thin = stage.render(&settings);
    assert!(clear.beauty().zip(thin.beauty()).any(|(a, b)| a != b));
}

/// A room full of fog, or of fog in part. The point is put aside: near it, what is seen of the fog is
/// bright, and few samples would decide over the mean.
fn foggy(name: &str, lights: impl FnOnce(&mut Stage)) -> Room {
    let mut stage = rooms::lambert_room();
    let point = stage.scene.lights.iter().find(|l| matches!(l.kind, LightKind::Point { .. }));
    let node = point.unwrap().node as usize;
    stage.scene.nodes[node].local = at(DVec3::new(1.4, 0.8, 0.3));
    lights(&mut stage);
    stage.scene.medium = Some(Medium {
        scattering: Vec3::new(0.3, 0.4, 0.5),
        absorption: Vec3::new(0.1, 0.0, 0.1),
        anisotropy: 0.4,
        region: None,
    });
    Room { name: name.into(), stage, depth: 2 }
}

#[test]
fn every_way_of_picking_sees_the_same_fog() {
    let plain = foggy("a triangle, a sphere, a point, a dome in fog", |_| {});
    assert_agreement(&plain, &WAYS.map(|way| (way, true)));
    let mut balls = foggy("balls of triangles and a sun in a box of fog", |stage| {
        let shade = glow(Vec3::new(3.0, 5.0, 2.0));
        stage.ball(0.1, 3, shade, at(DVec3::new(-0.6, 0.5, 0.4)));
        let mesh = stage.scene.meshes.len() as u32 - 1;
        for i in 0..4 {
            let t = f64::from(i);
            let place = at(DVec3::new(t.sin(), 0.4 + 0.1 * t, 0.8 * t.cos()));
            let node = stage.node(scaled(place, DVec3::splat(0.6 + 0.2 * t)));
            stage.again(mesh, node);
        }
        let sun = LightKind::Distant { irradiance_lux: Vec3::splat(0.5), angle_rad: 0.02 };
        stage.light(sun, aimed(DVec3::ZERO, DVec3::new(0.4, -1.0, -0.3)));
    });
    let node = balls.stage.node(scaled(at(DVec3::Y * 0.5), DVec3::new(1.5, 0.7, 1.0)));
    let region = Some(FogBox { node, min: -Vec3::ONE, max: Vec3::ONE });
    balls.stage.scene.medium.as_mut().unwrap().region = region;
    balls.depth = 1;
    let strategies = [LightStrategy::Tree, LightStrategy::Exhaustive, LightStrategy::All];
    let ways = strategies.map(Way::of).into_iter().chain([0.2, 0.5, 1.0].map(Way::split));
    let ways: Vec<_> = std::iter::once(WAYS[0]).chain(ways).map(|way| (way, false)).collect();
    assert_agreement(&balls, &ways);
}

#[test]
fn shafts_of_shadow_are_where_they_are_whoever_is_asked() {
    let room = foggy("slats under spots and a sun", |stage| {
        for i in 0..5 {
            let place = DVec3::new(-0.8 + 0.4 * f64::from(i), 0.8, 0.0);
            stage.quad([0.2, 3.0], lambert(Vec3::splat(0.2)), facing(place, place + DVec3::Y));
        }
        for x in [-0.7, 0.5] {
            let shaping = Shaping::Khr { inner_rad: 0.3, outer_rad: 0.7 };
            let kind = LightKind::Spot { intensity_cd: Vec3::splat(6.0), shaping };
            stage.light(kind, aimed(DVec3::new(x, 1.4, 0.2), DVec3::new(-x, 0.0, 0.0)));
        }
        let sun = LightKind::Distant { irradiance_lux: Vec3::splat(3.0), angle_rad: 0.0 };
        stage.light(sun, aimed(DVec3::ZERO, DVec3::new(-0.4, -1.0, -0.2)));
    });
    let ways = [
        (WAYS[0], true),
        (Way::of(LightStrategy::Tree), true),
        (Way::of(LightStrategy::Tree), false),
        (Way::split(0.5), true),
    ];
    assert_agreement(&room, &ways);
    // And the slats do throw shadows.
    let mut open = foggy("no slats", |_| {}).stage;
    open.scene.lights = room.stage.scene.lights.clone();
    open.scene.nodes = room.stage.scene.nodes.clone();
    let settings = RenderSettings { width: 16, height: 16, depth: 2, ..Default::default() };
    let pictures = [&room.stage.scene, &open.scene]
        .map(|scene| render(&Set::of(scene, &[1]), settings.clone(), 1));
    assert!(disagreement(&pictures[0], &pictures[1]).is_some());
}
