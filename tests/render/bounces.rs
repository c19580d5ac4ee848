//! Many bounces: furnaces, where a white thing cannot be told from its surroundings, and closed
//! rooms, whose light is a geometric series.

use crate::stage::{Stage, at, coat, direct, facing, glow, lambert};
use crate::statistics::{Estimate, assert_even, pixels};
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{RenderDelegate, RenderSettings};
use candelabra::scene::{AlphaMode, LightKind, Material, Transmission};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// The six walls of a cube of half width 1, facing inwards.
fn room(stage: &mut Stage, material: &Material) {
    for axis in DVec3::AXES {
        for wall in [axis, -axis] {
            stage.quad([2.0; 2], material.clone(), facing(wall, DVec3::ZERO));
        }
    }
}

/// Everything that reflects all that arrives: name, material, and how far off the table of GGX's
/// albedo may be (the mean of a picture, and any pixel of it).
fn white_things() -> Vec<(String, Material, [f64; 2])> {
    let mut things = vec![("Lambert".to_owned(), lambert(Vec3::ONE), [1e-3, 5e-3])];
    for roughness in [0.05, 0.2, 0.5, 1.0] {
        for (kind, metallic) in [("dielectric", 0.0), ("half metal", 0.5), ("metal", 1.0)] {
            let thing = Material { metallic, roughness, ..Default::default() };
            things.push((format!("{kind} of roughness {roughness}"), thing, [4e-3, 3e-2]));
        }
    }
    let glass = Material { ior: 2.4, roughness: 0.3, ..Default::default() };
    things.push(("diamond".into(), glass, [4e-3, 3e-2]));
    for (metallic, factor, roughness) in [(0.0, 1.0, 0.1), (1.0, 0.7, 0.5)] {
        let thing = Material { metallic, coat: coat(factor, roughness), ..Default::default() };
        things.push((format!("coat of roughness {roughness}"), thing, [4e-3, 3e-2]));
    }
    for factor in [1.0, 0.5] {
        let transmission = Some(Transmission { factor, factor_texture: None, volume: None });
        let glass = Material { roughness: 0.0, transmission, ..Default::default() };
        things.push((format!("a pane of {factor}"), glass.clone(), [4e-3, 3e-2]));
        let coated = Material { coat: coat(1.0, 0.2), ..glass };
        things.push((format!("a coated pane of {factor}"), coated, [4e-3, 3e-2]));
    }
    things
}

/// Asserts that all pixels read 1: in the mean, and each within its own noise.
fn assert_white(what: &str, buffers: &RenderBuffers, [mean_off, pixel_off]: [f64; 2]) {
    let estimate = Estimate::of_picture(buffers);
    let Estimate { mean, error } = estimate;
    assert!(error.max_element() < 3.5e-3, "{what}: {estimate} is too noisy to tell");
    assert!((mean.x - 1.0).abs() < mean_off + 4.0 * error.x, "{what}: {estimate}");
    for (i, pixel) in pixels(buffers).iter().enumerate() {
        let (value, noise) = (f64::from(pixel.beauty.x), f64::from(pixel.variance.x).sqrt());
        assert!((value - 1.0).abs() < pixel_off + 6.0 * noise, "{what}, pixel {i}: {value}");
    }
}

/// A ball that fills most of the picture.
fn ball(material: Material) -> Stage {
    let mut stage = Stage::default();
    stage.ball(0.5, 12, material, at(DVec3::ZERO));
    stage.look(DVec3::new(0.3, 0.5, 0.8), DVec3::ZERO, 1.2);
    stage
}

#[test]
fn nothing_white_is_seen_in_a_white_dome() {
    for (what, material, off) in white_things() {
        let mut stage = ball(material);
        stage.light(LightKind::Dome { radiance_nits: Vec3::ONE, texture: None }, at(DVec3::ZERO));
        // One bounce is enough outside of a ball; more must not add to it.
        let buffers = stage.render(&RenderSettings { depth: 9, ..direct(12, 1024) });
        assert_white(&format!("{what} under a dome"), &buffers, off);
    }
}

#[test]
fn nothing_white_is_seen_in_a_room_of_light() {
    for (what, material, off) in white_things() {
        let mut stage = ball(material);
        room(&mut stage, &glow(Vec3::ONE));
        // Light may be mirrored to and fro in glass.
        let buffers = stage.render(&RenderSettings { depth: 9, ..direct(12, 1024) });
        assert_white(&format!("{what} between shining walls"), &buffers, off);
    }
}

/// A thing that is half there lets half of the light through, also of the light inside it.
#[test]
fn nothing_white_is_seen_where_it_is_half_there() {
    let blended = Material { opacity: 0.5, alpha_mode: AlphaMode::Blend, ..lambert(Vec3::ONE) };
    let mut stage = ball(blended);
    stage.light(LightKind::Dome { radiance_nits: Vec3::ONE, texture: None }, at(DVec3::ZERO));
    let buffers = stage.render(&RenderSettings { depth: 60, ..direct(12, 512) });
    assert_white("a half ball", &buffers, [1e-3, 5e-3]);
}

/// A box without a lid: paths leave it after some ten bounces.
#[test]
fn an_open_white_box_is_full_of_light() {
    let mut stage = Stage::default();
    for wall in [DVec3::X, -DVec3::X, DVec3::Z, -DVec3::Z, -DVec3::Y] {
        stage.quad([2.0; 2], lambert(Vec3::ONE), facing(wall, DVec3::ZERO));
    }
    stage.light(LightKind::Dome { radiance_nits: Vec3::ONE, texture: None }, at(DVec3::ZERO));
    stage.look(DVec3::new(0.5, 0.9, 0.0), DVec3::new(-0.5, -1.0, 0.0), 1.2);
    let buffers = stage.render(&RenderSettings { depth: 150, ..direct(12, 512) });
    assert_white("an open box", &buffers, [1e-3, 5e-3]);
}

/// `1 + rho + ... + rho^last`.
fn series(rho: f64, last: u32) -> f64 {
    (0..=last).map(|power| rho.powi(power as i32)).sum()
}

/// In a closed room whose walls shine alike, every bounce adds its power of the albedo. Depth 0
/// shows the emitters alone, depth 1 adds direct light, and so on.
#[test]
fn a_shining_room_is_a_geometric_series() {
    let rho = 0.6;
    let mut stage = Stage::default();
    let walls = Material { emission_nits: Vec3::splat(2.0), ..lambert(Vec3::splat(rho as f32)) };
    room(&mut stage, &walls);
    stage.look(DVec3::new(0.2, 0.3, 0.5), DVec3::new(-0.5, -0.4, -1.0), 1.5);
    for depth in [0, 1, 2, 3, 4, 6, 60] {
        for mis in [true, false] {
            // Picked lights are found where walls meet, too, with more noise.
            let samples = if mis { 512 } else { 2048 };
            let settings = RenderSettings { depth, mis, ..direct(8, samples) };
            let what = format!("{depth} bounces, mis {mis}");
            assert_even(&what, &stage.render(&settings), 2.0 * series(rho, depth), 0.005);
        }
    }
}

/// An integrating sphere: a point light in the middle of a grey ball, and the same with a sphere.
#[test]
fn an_integrating_sphere_is_a_geometric_series() {
    const FACETS: u32 = 64;
    let rho = 0.5;
    let point = LightKind::Point { intensity_cd: Vec3::splat(3.0) };
    // Small enough not to be in the way.
    let radiance = 3.0 / (PI * 0.02 * 0.02);
    let radiance_nits = Vec3::splat(radiance as f32);
    let sphere = LightKind::Sphere { radiance_nits, radius: 0.02, shaping: None };
    for (what, light) in [("a point", point), ("a sphere", sphere)] {
        let mut stage = Stage::default();
        stage.ball(1.0, FACETS, lambert(Vec3::splat(rho as f32)), at(DVec3::ZERO));
        stage.light(light, at(DVec3::ZERO));
        stage.look(DVec3::new(0.3, 0.2, 0.2), DVec3::new(1.0, 0.5, 0.3), 1.0);
        for depth in [1, 2, 3, 30] {
            let buffers = stage.render(&RenderSettings { depth, ..direct(8, 256) });
            let seen = Estimate::of_picture(&buffers);
            let expected = 3.0 * rho / PI * series(rho, depth - 1);
            assert!(seen.error.x < 5e-3 * expected, "{what}: {seen} is too noisy to tell");
            // Facets are nearer to the middle than the ball they approximate.
            let off = (seen.mean.x / expected - 1.0).abs();
            assert!(off < 4e-3, "{what}, {depth} bounces: {seen}, not {expected}");
        }
    }
}

/// A point cannot be hit, nor can a sun without a disk. Where only surfaces shine, the last reflected ray of a path is traced if
/// it goes towards one. Where light comes from infinity, it always is.
#[test]
fn the_last_reflected_ray_is_traced_only_where_it_may_find_light() {
    let (intensity_cd, radiance_nits) = (Vec3::ONE, Vec3::ONE);
    let sphere = |radius| LightKind::Sphere { radiance_nits, radius, shaping: None };
    let sun = |angle_rad| LightKind::Distant { irradiance_lux: Vec3::ONE, angle_rad };
    // The share of the paths.
    let lamps = [
        (LightKind::Point { intensity_cd }, 0.0..=0.0),
        (sphere(1e-4), 0.0..=0.0),
        (sphere(0.2), 0.02..=0.5),
        (LightKind::Dome { radiance_nits, texture: None }, 1.0..=1.0),
        (sun(0.1), 1.0..=1.0),
        (sun(0.0), 0.0..=0.0),
    ];
    for (kind, expected) in lamps {
        let what = format!("{kind:?}");
        let mut stage = Stage::default();
        room(&mut stage, &lambert(Vec3::splat(0.5)));
        stage.light(kind, at(DVec3::new(0.1, 0.7, 0.2)));
        stage.look(DVec3::new(0.0, 0.0, 0.9), DVec3::ZERO, 0.1);
        let set = stage.set();
        for depth in 1..=2 {
            let settings = RenderSettings { depth, ..direct(4, 16) };
            let delegate = RenderDelegate::new(
                set.scene,
                &set.emitters,
                set.scene.cameras[0].clone(),
                settings,
            );
            let stats = delegate.render(&set.tree, 1, &()).unwrap().stats.trace;
            let paths = 4 * 4 * 16;
            let last =
                (stats.rays - stats.shadow_rays) as f64 / f64::from(paths) - f64::from(depth);
            assert!(expected.contains(&last), "{what}, depth {depth}: {last}");
        }
    }
}
