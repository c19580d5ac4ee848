//! Angles and transforms at their ends, in pictures with a known mean; and size and brightness, which do
//! not show: what is a room in metres is a room in micrometres.

use crate::closed_forms::{assert_dark, assert_irradiance, of_polygon, of_sphere, panel, receiver};
use crate::rooms;
use crate::stage::{Stage, aimed, at, by, direct, facing, glow, picture, scaled};
use crate::statistics::assert_even;
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{LightStrategy, RenderSettings};
use candelabra::scene::{LightKind, Medium, Shaping, Trs};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

fn everything() -> Stage {
    let mut stage = rooms::lambert_room();
    rooms::all_lights(&mut stage);
    stage
}

/// Everything is so many times as large, and so many times as bright; the picture of it should be
/// that many times as bright.
fn blown_up(size: f64, brightness: f32) -> Stage {
    let mut stage = everything();
    for node in &mut stage.scene.nodes {
        node.local = scaled(node.local, DVec3::splat(size));
        let Trs::Parts { translation, .. } = &mut node.local else { unreachable!() };
        *translation *= size;
    }
    let area = (size * size) as f32;
    for light in &mut stage.scene.lights {
        light.range_m = light.range_m.map(|range| range * size as f32);
        match &mut light.kind {
            LightKind::Point { intensity_cd } | LightKind::Spot { intensity_cd, .. } => {
                *intensity_cd *= area * brightness;
            }
            LightKind::Sphere { radiance_nits, .. } | LightKind::Dome { radiance_nits, .. } => {
                *radiance_nits *= brightness;
            }
            LightKind::Distant { irradiance_lux, .. } => *irradiance_lux *= brightness,
        }
    }
    for material in &mut stage.scene.materials {
        material.emission_nits *= brightness;
    }
    stage
}

fn render(stage: &Stage, strategy: LightStrategy) -> RenderBuffers {
    let settings = RenderSettings { width: 24, height: 24, samples: 16, ..Default::default() };
    stage.render(&by(strategy, true, &settings))
}

/// Powers of two change no digit of a number. What is left is the last bits of the random numbers
/// that pick lights, which come from coordinates: they may turn a pixel's sample here and there.
fn assert_same(what: &str, expected: &RenderBuffers, seen: &RenderBuffers, brightness: f32) {
    let sum = |buffers: &RenderBuffers| {
        buffers.beauty().map(|beauty| beauty.as_dvec3().element_sum()).sum::<f64>()
    };
    let ratio = sum(seen) / sum(expected) / f64::from(brightness);
    assert!((ratio - 1.0).abs() < 2e-3, "{what}: {ratio}");
    let is_same = |a: Vec3, b: Vec3| (b / brightness).abs_diff_eq(a, 1e-4 * a.max_element());
    let same = expected.beauty().zip(seen.beauty()).filter(|(a, b)| is_same(*a, *b)).count();
    assert!(same * 20 > 19 * expected.beauty().count(), "{what}: only {same} pixels are the same");
}

#[test]
fn size_does_not_show() {
    for strategy in [LightStrategy::Tree, LightStrategy::Exhaustive, LightStrategy::Uniform] {
        let expected = render(&everything(), strategy);
        for exponent in [-20, -10, 10, 20] {
            let size = 2f64.powi(exponent);
            let seen = render(&blown_up(size, 1.0), strategy);
            assert_same(&format!("{strategy:?}, {size} times as large"), &expected, &seen, 1.0);
        }
    }
}

#[test]
fn brightness_does_not_show() {
    for strategy in [LightStrategy::Tree, LightStrategy::Exhaustive, LightStrategy::Power] {
        let expected = render(&everything(), strategy);
        for exponent in [-40, 40] {
            let brightness = 2f32.powi(exponent);
            let seen = render(&blown_up(1.0, brightness), strategy);
            let what = format!("{strategy:?}, {brightness} times as bright");
            assert_same(&what, &expected, &seen, brightness);
        }
    }
}

/// The beam is wide against the receiver, which is at its distance.
#[test]
fn spots_of_every_width_light_their_axis() {
    for decade in -6..=0 {
        let angle = 10f64.powi(decade);
        let distance = (0.5 / angle).max(2.0);
        let half_angle = angle as f32;
        let khr = |inner: f32| Shaping::Khr { inner_rad: inner, outer_rad: half_angle };
        let usd = |softness, focus| {
            let focus_tint = [0.0; 3];
            Shaping::Usd { cone_rad: half_angle, softness, focus, focus_tint, profile: None }
        };
        let square = (distance * distance) as f32;
        let profiles =
            [khr(0.0), khr(half_angle), usd(0.0, 0.0), usd(1.0, 0.0), usd(0.0, 0.01 / half_angle)];
        for shaping in profiles {
            let spot = |off: f64| {
                let mut stage = receiver(DVec3::Y);
                let kind = LightKind::Spot { intensity_cd: Vec3::splat(square), shaping };
                let place = DVec3::Y * distance;
                let to = DVec3::new(off.sin(), -off.cos(), 0.0);
                stage.light(kind, aimed(place, place + to));
                stage
            };
            assert_irradiance(&format!("{shaping:?} at {distance} m"), &spot(0.0), 1.0);
            // The axis itself is rounded to 32 bits.
            assert_dark("beside the beam", &spot(1.1 * angle + 1e-6));
        }
    }
}

#[test]
fn suns_of_every_size_bring_their_irradiance() {
    for decade in -10..=0 {
        let angle_rad = 10f32.powi(decade);
        let mut stage = receiver(DVec3::Y);
        let sun = LightKind::Distant { irradiance_lux: Vec3::splat(3.0), angle_rad };
        stage.light(sun, aimed(DVec3::ZERO, DVec3::new(0.3, -1.0, 0.4)));
        let cosine = 1.0 / (1.0f64 + 0.25).sqrt();
        assert_irradiance(&format!("a sun of {angle_rad} rad"), &stage, 3.0 * cosine);
    }
}

#[test]
fn spheres_far_away_are_what_they_are_near_by() {
    for decade in 1..=9 {
        let (distance, radius) = (30.0, 30.0 / 10f64.powi(decade));
        let center = DVec3::new(0.6, 0.8, 0.0) * distance;
        let mut stage = receiver(DVec3::Y);
        let radiance = 1.0 / (radius * radius);
        let radiance_nits = Vec3::splat(radiance as f32);
        let kind = LightKind::Sphere { radiance_nits, radius: radius as f32, shaping: None };
        stage.light(kind, at(center));
        let expected = radiance * of_sphere(center, radius, DVec3::Y);
        assert_irradiance(&format!("a sphere of {radius} m"), &stage, expected);
    }
}

/// Transforms that are no rotations: uneven, mirrored, sheared, tiny, and turned between.
fn matrices() -> Vec<DMat3> {
    let (a, b) = (DMat3::from_rotation_x(-0.7), DMat3::from_rotation_z(0.4));
    let scale = |x: f64, y: f64, z: f64| DMat3::from_diagonal(DVec3::new(x, y, z));
    vec![
        scale(1.0, 4.0, 1.0) * a,
        scale(-1.0, 1.0, 1.0) * a,
        a * scale(0.2, -3.0, 1.0) * b,
        a * scale(-2.0, -0.5, -1.0) * b * a,
        DMat3::from_cols(DVec3::X, DVec3::new(0.8, 1.0, 0.0), DVec3::new(0.0, -0.4, 1.0)) * a,
        scale(1e-6, 2e-6, 1e-6) * a,
    ]
}

fn by_matrix(matrix: DMat3, place: DVec3) -> Trs {
    Trs::Matrix(DAffine3 { matrix3: matrix, translation: place })
}

#[test]
fn directions_go_through_the_matrix() {
    for matrix in matrices() {
        let toward = -(matrix * DVec3::Z).normalize();
        let normal = (-toward + 0.3 * toward.any_orthonormal_vector()).normalize();
        let cosine = -toward.dot(normal);
        for angle_rad in [0.0, 1e-3] {
            let mut sun = receiver(normal);
            let kind = LightKind::Distant { irradiance_lux: Vec3::splat(5.0), angle_rad };
            sun.light(kind, by_matrix(matrix, DVec3::ZERO));
            assert_irradiance(&format!("a sun below {matrix}"), &sun, 5.0 * cosine);
        }
        let shaping = Shaping::Khr { inner_rad: 0.01, outer_rad: 0.02 };
        let mut spot = receiver(normal);
        let kind = LightKind::Spot { intensity_cd: Vec3::splat(20.0), shaping };
        spot.light(kind, by_matrix(matrix, -2.0 * toward));
        assert_irradiance(&format!("a spot below {matrix}"), &spot, 5.0 * cosine);
        // A sky that is white above its own horizon, a plane that goes along like a surface.
        let up = (matrix.inverse().transpose() * DVec3::Y).normalize();
        for tilt in [0.0f64, 1.0, 2.0] {
            let normal = tilt.cos() * up + tilt.sin() * up.any_orthonormal_vector();
            let mut dome = receiver(normal);
            let sky = picture([8, 64], false, |_, y| [f32::from(u8::from(y < 32)); 3]);
            let texture = dome.texture(sky).map(|used| used.texture);
            let kind = LightKind::Dome { radiance_nits: Vec3::splat(2.0), texture };
            dome.light(kind, by_matrix(matrix, DVec3::ZERO));
            let expected = PI * (1.0 + tilt.cos());
            assert_irradiance(&format!("a sky below {matrix} at {tilt}"), &dome, expected);
        }
    }
}

#[test]
fn panels_shine_from_their_front_below_any_matrix() {
    for matrix in matrices().into_iter().filter(|matrix| matrix.determinant().abs() > 0.01) {
        let local = panel([1.0, 1.0], DVec3::ZERO, DVec3::Z);
        let normal = (matrix.inverse().transpose() * DVec3::Z).normalize();
        let place = DVec3::new(0.3, 0.2, 0.1) - 3.0 * normal;
        let mut corners = local.map(|corner| matrix * corner + place);
        if matrix.determinant() < 0.0 {
            corners.reverse();
        }
        let toward = -place.normalize();
        for (front, expected) in [(true, of_polygon(&corners, -toward)), (false, 0.0)] {
            let mut stage = receiver(-toward);
            // Turned over in its own space, which no matrix mistakes for a mirror.
            let turn = if front { DMat3::IDENTITY } else { DMat3::from_rotation_x(PI) };
            let emission = glow(Vec3::splat(9.0));
            stage.quad([1.0; 2], emission, by_matrix(matrix * turn, place));
            match front {
                true => assert_irradiance(&format!("below {matrix}"), &stage, 9.0 * expected),
                false => assert_dark(&format!("from behind, below {matrix}"), &stage),
            }
        }
    }
}

/// In closed form: a cap of half angle `a` about a normal gives `pi sin^2 a`.
#[test]
fn a_dome_that_is_lit_at_its_pole_lights_what_faces_it() {
    for (rows, lit) in [(64u32, 1u32), (1024, 2), (4096, 1), (8192, 3)] {
        for tilt in [0.0, 70f64.to_radians(), FRAC_PI_2] {
            let pole = DVec3::new(0.0, tilt.cos(), tilt.sin());
            let mut stage = receiver(pole);
            let sky = picture([4, rows], false, |_, y| [f32::from(u8::from(y < lit)); 3]);
            let texture = stage.texture(sky).map(|used| used.texture);
            let cap = PI * (PI * f64::from(lit) / f64::from(rows)).sin().powi(2);
            let radiance_nits = Vec3::splat((1.0 / cap) as f32);
            let kind = LightKind::Dome { radiance_nits, texture };
            stage.light(kind, by_matrix(DMat3::from_rotation_x(tilt), DVec3::ZERO));
            let what = format!("{lit} of {rows} rows, tilted by {tilt}");
            assert_irradiance(&what, &stage, 1.0);
        }
    }
}

/// A ray crosses the axis of a beam at a right angle: it scatters over the chord.
#[test]
fn narrow_beams_are_seen_in_fog() {
    for decade in 2..=10 {
        let half_angle = 10f64.powf(-0.5 * f64::from(decade));
        let (height, scattering) = (2.0, 1e-3);
        let mut stage = Stage::default();
        let half_angle_rad = half_angle as f32;
        let shaping = Shaping::Khr { inner_rad: half_angle_rad, outer_rad: half_angle_rad };
        let intensity_cd = Vec3::splat((1.0 / half_angle) as f32);
        let kind = LightKind::Spot { intensity_cd, shaping };
        stage.light(kind, aimed(DVec3::Y * height, DVec3::ZERO));
        stage.look(DVec3::Z * 3.0, DVec3::ZERO, 1e-3 * half_angle_rad);
        let extinction = Vec3::splat(scattering as f32);
        let (absorption, anisotropy) = (Vec3::ZERO, 0.0);
        stage.scene.medium =
            Some(Medium { scattering: extinction, absorption, anisotropy, region: None });
        // Fog fills what is in the scene, which goes on behind the beam.
        stage.quad([1.0; 2], glow(Vec3::ZERO), facing(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO));
        // Blindly: what the tree says of fog is tested elsewhere.
        let settings = by(LightStrategy::Uniform, true, &direct(4, 256));
        // The integral of I / (h^2 + x^2) over the chord.
        let chord = 2.0 * half_angle / half_angle / height;
        let expected = scattering * chord / (4.0 * PI) * (-scattering * (3.0 + height)).exp();
        assert_even(
            &format!("a beam of {half_angle} rad"),
            &stage.render(&settings),
            expected,
            0.01,
        );
    }
}
