//! Lights that some rays do not meet: they light what they light, and every strategy agrees on it.

use crate::stage::{Set, Stage, at, by, direct, facing, glow, lambert, scaled};
use crate::statistics::{Estimate, pixels};
use crate::strategies::{SIZE, disagreement, render};
use candelabra::render::LightStrategy;
use candelabra::scene::{LightKind, Material, Scene, Visibility};
use glam::Vec3;

/// A floor with a shiny strip below a lamp, a wall behind that lamp, another lamp behind both and a
/// dome around.
fn room(visibility: Visibility) -> Scene {
    let mut stage = Stage::default();
    stage.look([0.0, 2.0, 5.0], [0.0, 0.7, 0.0], 0.8);
    let up = |y: f64, z: f64| facing([0.0, y, z], [0.0, y + 1.0, z]);
    stage.quad([6.0, 6.0], lambert(Vec3::splat(0.6)), up(0.0, 0.0));
    let shiny =
        Material { metallic: 1.0, roughness: 0.2, base_color: Vec3::ONE, ..lambert(Vec3::ONE) };
    stage.quad([2.0, 1.0], shiny, up(0.01, 1.0));
    stage.quad([6.0, 3.0], lambert(Vec3::splat(0.4)), at([0.0, 1.5, -2.0]));
    stage.quad([1.0, 0.7], glow(Vec3::splat(3.0)), at([0.0, 1.3, -1.0])).visibility = visibility;
    stage.quad([1.5, 0.7], glow(Vec3::new(1.0, 2.0, 4.0)), at([0.4, 1.5, -1.5])).visibility =
        visibility;
    let ball = LightKind::Sphere { radiance_nits: Vec3::splat(6.0), radius: 0.2, shaping: None };
    stage.light(ball, at([-1.2, 0.6, 0.5])).visibility = visibility;
    let sky = LightKind::Dome { radiance_nits: Vec3::splat(0.2), texture: None };
    stage.light(sky, scaled(at([0.0; 3]), [1.0; 3])).visibility =
        Visibility { shadows: true, ..visibility };
    stage.scene
}

fn every() -> impl Iterator<Item = Visibility> {
    (0..8).map(|bits| Visibility {
        camera: bits & 1 != 0,
        reflections: bits & 2 != 0,
        shadows: bits & 4 != 0,
    })
}

#[test]
fn every_strategy_agrees_whoever_meets_a_light() {
    for visibility in every().filter(|v| v.camera != v.shadows || v.reflections) {
        let scene = room(visibility);
        let set = Set::of(&scene, &[1]);
        let settings = direct(SIZE, 64);
        let picture = |strategy, mis| render(&set, by(strategy, mis, &settings), 1);
        let oracle = picture(LightStrategy::Uniform, false);
        for (strategy, mis) in [
            (LightStrategy::Uniform, true),
            (LightStrategy::Tree, true),
            (LightStrategy::All, false),
            (LightStrategy::All, true),
        ] {
            if let Some(problem) = disagreement(&oracle, &picture(strategy, mis)) {
                panic!("{visibility:?}, {strategy:?}, MIS {mis}: {problem}");
            }
        }
    }
}

/// A floor under a sun, perhaps with something between.
fn under_the_sun(between: impl FnOnce(&mut Stage)) -> Stage {
    let mut stage = Stage::default();
    stage.look([0.0, 3.0, 7.0], [0.0, 0.0, 0.0], 0.7);
    stage.quad([4.0, 4.0], lambert(Vec3::splat(0.5)), facing([0.0; 3], [0.0, 1.0, 0.0]));
    let sun = LightKind::Distant { irradiance_lux: Vec3::splat(10.0), angle_rad: 0.01 };
    stage.light(sun, facing([0.0; 3], [0.0, 1.0, 0.0]));
    between(&mut stage);
    stage
}

#[test]
fn an_unlit_lamp_blocks_neither_sun_nor_view() {
    let settings = direct(24, 16);
    let beauty = |stage: Stage| {
        let buffers = stage.render(&settings);
        pixels(&buffers).iter().map(|p| (p.beauty, p.depth_m.to_bits())).collect::<Vec<_>>()
    };
    let free = beauty(under_the_sun(|_| ()));
    for camera in [false, true] {
        let lamp = |stage: &mut Stage| {
            let down = facing([0.0, 1.0, 0.0], [0.0, 0.0, 0.0]);
            stage.quad([2.0, 2.0], glow(Vec3::ZERO), down).visibility =
                Visibility { camera, ..Visibility::LAMP };
        };
        assert!(beauty(under_the_sun(lamp)) == free);
    }
    let blocked = |stage: &mut Stage| {
        let down = facing([0.0, 1.0, 0.0], [0.0, 0.0, 0.0]);
        stage.quad([2.0, 2.0], glow(Vec3::ZERO), down);
    };
    assert!(beauty(under_the_sun(blocked)) != free, "an ordinary surface does block");
}

#[test]
fn a_lamp_hidden_from_the_camera_lights_as_before() {
    let lit = |visibility| {
        let mut stage = Stage::default();
        // The lamp is not in the picture.
        stage.look([0.0, 1.0, 3.0], [0.0, 0.0, 0.0], 0.3);
        stage.quad([4.0, 4.0], lambert(Vec3::splat(0.5)), facing([0.0; 3], [0.0, 1.0, 0.0]));
        let down = facing([0.0, 2.0, 0.0], [0.0, 0.0, 0.0]);
        stage.quad([1.0, 1.0], glow(Vec3::splat(5.0)), down).visibility = visibility;
        Estimate::of_picture(&stage.render(&direct(SIZE, 256)))
    };
    let seen = lit(Visibility::ALL);
    for visibility in every() {
        let hidden = lit(visibility);
        assert!((hidden.mean.x / seen.mean.x - 1.0).abs() < 0.01, "{visibility:?}");
    }
}

#[test]
fn lights_in_one_place_give_the_light_of_all() {
    let lit = |copies: usize| {
        let mut stage = Stage::default();
        stage.look([0.0, 1.0, 3.0], [0.0, 0.0, 0.0], 0.3);
        let shiny =
            Material { metallic: 1.0, roughness: 0.3, base_color: Vec3::ONE, ..lambert(Vec3::ONE) };
        stage.quad([4.0, 4.0], shiny, facing([0.0; 3], [0.0, 1.0, 0.0]));
        let toward = facing([0.0, 1.0, -3.0], [0.0, 0.0, 0.0]);
        for _ in 0..copies {
            stage.quad([2.0, 2.0], glow(Vec3::splat(5.0)), toward);
        }
        Estimate::of_picture(&stage.render(&direct(SIZE, 256))).mean.x
    };
    let one = lit(1);
    for copies in [2, 3] {
        assert!((lit(copies) / (copies as f64 * one) - 1.0).abs() < 0.01, "{copies}");
    }
}

#[test]
fn a_light_flush_with_a_ceiling_gives_its_light_whatever_comes_first() {
    let lit = |parts: &[(f32, Vec3)], tilt: f64| {
        let place = facing([0.0, 1.0, 0.0], [tilt, 0.0, 0.3 * tilt]);
        let mut stage = Stage::default();
        stage.look([0.0, 0.5, 1.0], [0.0, 0.0, 0.0], 0.5);
        let glossy = Material { metallic: 1.0, roughness: 0.4, ..lambert(Vec3::splat(0.9)) };
        stage.quad([6.0, 6.0], glossy, facing([0.0; 3], [0.0, 1.0, 0.0]));
        for &(size, nits) in parts {
            stage.quad([size, size], glow(nits), place);
        }
        Estimate::of_picture(&stage.render(&direct(SIZE, 512))).mean.x
    };
    let (ceiling, lamp) = ((6.0, Vec3::ZERO), (1.0, Vec3::ONE));
    for tilt in [0.0, 0.4] {
        let alone = lit(&[lamp], tilt);
        for parts in [[ceiling, lamp], [lamp, ceiling]] {
            let flush = lit(&parts, tilt);
            assert!((flush / alone - 1.0).abs() < 0.005, "{tilt}: {flush} {alone}");
        }
    }
}
