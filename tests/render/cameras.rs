//! Orthographic cameras, exposure and clipping planes, in pictures.

use crate::stage::{Stage, at, direct, facing, glow, lambert};
use crate::statistics::{Pixel, pixels};
use candelabra::render::RenderSettings;
use candelabra::scene::{Camera, LightKind};
use glam::{DVec3, Vec3};

/// A card that shines, off the middle of the view and turned out of it.
fn card() -> Stage {
    let mut stage = Stage::default();
    let place = facing(DVec3::new(0.5, 0.25, -7.0), DVec3::new(0.5, 0.25, 0.0));
    stage.quad([1.0, 0.5], glow(Vec3::ONE), place);
    stage.look(DVec3::ZERO, -DVec3::Z, 0.5);
    stage
}

/// Whatever the distance, a metre is as many pixels; half pixels are covered by half.
#[test]
fn without_perspective_a_size_is_the_same_at_every_distance() {
    for far in [0.0, 500.0] {
        let mut stage = card();
        stage.scene.nodes[0].local = at(DVec3::new(0.5, 0.25, -7.0 - far));
        stage.scene.cameras[0] = Camera::orthographic(stage.scene.cameras[0].node, 4.0);
        let settings = RenderSettings { width: 10, depth: 0, ..direct(5, 1024) };
        let buffers = stage.render(&settings);
        // Pixels of 0.8 m; the card is from 0 to 1 m to the right, from 0 to 0.5 m up.
        for (i, pixel) in pixels(&buffers).iter().enumerate() {
            let (x, y) = (i % 10, i / 10);
            let share = |low: f64, high: f64, from: f64, to: f64| {
                ((high.min(to) - low.max(from)) / (high - low)).max(0.0)
            };
            let left = 0.8 * (x as f64 - 5.0);
            let top = 2.0 - 0.8 * y as f64;
            let expected = share(left, left + 0.8, 0.0, 1.0) * share(top - 0.8, top, 0.0, 0.5);
            let value = f64::from(pixel.beauty.x);
            assert!((value - expected).abs() < 0.01, "{far} m, {x} {y}: {value} for {expected}");
            if pixel.alpha > 0.0 {
                assert!((f64::from(pixel.depth_m) - 7.0 - far).abs() < 1e-3, "{}", pixel.depth_m);
            }
        }
    }
}

/// A lit floor below a camera that looks down at it, with a card between them, half as high.
fn table() -> Stage {
    let mut stage = Stage::default();
    stage.quad([40.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    stage.quad([0.5; 2], lambert(Vec3::splat(0.8)), facing(DVec3::Y, 2.0 * DVec3::Y));
    stage.look(DVec3::new(0.0, 2.0, 1e-3), DVec3::ZERO, 1.0);
    let lamp = LightKind::Point { intensity_cd: Vec3::splat(9.0) };
    stage.light(lamp, at(DVec3::new(0.0, 2.0, 0.0)));
    stage
}

fn clipped(clip_m: [f32; 2], orthographic: bool) -> Vec<Pixel> {
    let mut stage = table();
    let node = stage.scene.cameras[0].node;
    let camera = match orthographic {
        true => Camera::orthographic(node, 2.0),
        false => stage.scene.cameras[0].clone(),
    };
    stage.scene.cameras[0] = Camera { clip_m, ..camera };
    pixels(&stage.render(&direct(9, 64)))
}

#[test]
fn what_is_clipped_casts_shadows_and_is_not_seen() {
    for orthographic in [false, true] {
        let whole = clipped([0.0, f32::INFINITY], orthographic);
        let (middle, corner) = (40, 0);
        assert!((whole[middle].depth_m - 1.0).abs() < 1e-3);
        assert!(whole[middle].beauty.x > 1.0);
        // The card is nearer than the near plane: behind it is its own shadow.
        let near = clipped([1.5, f32::INFINITY], orthographic);
        assert!((near[middle].depth_m - 2.0).abs() < 1e-3);
        assert_eq!((near[middle].beauty, near[middle].alpha), (Vec3::ZERO, 1.0));
        assert_eq!(near[corner].beauty, whole[corner].beauty);
        assert_eq!(near[corner].depth_m, whole[corner].depth_m);
        // The floor is farther than the far plane.
        let far = clipped([0.0, 1.5], orthographic);
        assert_eq!((far[corner].alpha, far[corner].beauty), (0.0, Vec3::ZERO));
        // The variance alone looks at what is around a pixel.
        assert_eq!(Pixel { variance: whole[middle].variance, ..far[middle] }, whole[middle]);
        // By planes: the corner is farther than 2.1 m in perspective, but not along the view axis.
        assert_eq!(clipped([1.9, 2.1], orthographic)[corner].alpha, 1.0);
    }
}

#[test]
fn exposure_scales_radiance_and_nothing_else() {
    let render = |exposure_scale: f32| {
        let mut stage = table();
        stage.scene.cameras[0].exposure_scale = exposure_scale;
        pixels(&stage.render(&direct(9, 64)))
    };
    let plain = render(1.0);
    assert!(plain.iter().any(|pixel| pixel.variance.x > 0.0));
    for scale in [0.0, 0.25, 8.0] {
        for (pixel, plain) in render(scale).into_iter().zip(&plain) {
            let expected = Pixel {
                beauty: plain.beauty * scale,
                variance: plain.variance * scale * scale,
                ..*plain
            };
            assert_eq!(pixel, expected);
        }
    }
}
