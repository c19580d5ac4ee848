//! Lenses over time: where things are on the film at each frame, how they are blurred, how they are exposed.

use crate::stage::{Set, Stage, at, direct, facing, glow, lambert};
use candelabra::pipeline;
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{Aov, RenderDelegate, RenderSettings};
use candelabra::scene::{Camera, Interpolation, Keys, LensKeys, LightKind, Projection, Shutter};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;

const COLUMNS: u32 = 64;
/// Where the card begins, metres to the right of the axis, and how far it is.
const EDGE_M: f64 = 0.4;
const FAR_M: f64 = 3.0;
/// Frames 1 to 25 are second 0 to 1.
const FRAMES: [i32; 5] = [-3, 1, 9, 25, 40];

/// Keys a second apart.
fn keys<T>(values: impl Into<Vec<T>>) -> Option<Keys<T>> {
    let values = values.into();
    let times_s = (0..values.len()).map(|i| i as f32).collect();
    Some(Keys { times_s, values, interpolation: Interpolation::Linear })
}

/// How far between the two keys a frame is, and what is there.
fn between(frame: f64, [from, to]: [f64; 2]) -> f64 {
    let share = ((frame - 1.0) / 24.0).clamp(0.0, 1.0);
    from + share * (to - from)
}

/// A card that shines, from some way right of the middle on, seen through a lens that varies.
fn card(lens: LensKeys) -> Stage {
    let mut stage = Stage::default();
    stage.quad([10.0; 2], glow(Vec3::ONE), at(DVec3::new(EDGE_M + 5.0, 0.0, -FAR_M)));
    let camera = stage.look(DVec3::ZERO, -DVec3::Z, 1.0);
    camera.over_time = Some(Arc::new(lens));
    stage
}

/// The share of each column that is lit.
fn columns(buffers: &RenderBuffers) -> Vec<f64> {
    let beauty: Vec<Vec3> = buffers.beauty().collect();
    let lit = |x: u32, y: u32| f64::from(beauty[(y * COLUMNS + x) as usize].x);
    let column = |x| (0..COLUMNS).map(|y| lit(x, y)).sum::<f64>() / f64::from(COLUMNS);
    (0..COLUMNS).map(column).collect()
}

fn lit(buffers: &RenderBuffers) -> f64 {
    columns(buffers).iter().sum()
}

fn looked(samples: u32) -> RenderSettings {
    RenderSettings { depth: 0, ..direct(COLUMNS, samples) }
}

/// How many columns of a picture whose middle column looks along a slope are right of the card's edge.
fn right_of_edge(yfov: f64, offset: f64) -> f64 {
    let half = 0.5 * f64::from(COLUMNS);
    let edge = half * (EDGE_M / FAR_M) / (0.5 * yfov).tan() - 2.0 * half * offset;
    (half - edge).clamp(0.0, 2.0 * half)
}

#[test]
fn things_are_where_the_lens_of_the_frame_has_them() {
    let stage = card(LensKeys {
        height: keys([0.4f32, 1.2]),
        film_offset: keys([Vec2::ZERO, Vec2::new(-0.25, 0.0)]),
        ..LensKeys::default()
    });
    let set = Set::of(&stage.scene, &FRAMES);
    for frame in FRAMES {
        let yfov = between(frame.into(), [0.4, 1.2]);
        let expected = right_of_edge(yfov, between(frame.into(), [0.0, -0.25]));
        let found = lit(&set.render(&looked(64), frame));
        assert!((found - expected).abs() < 0.02, "{frame}: {found} columns, {expected} expected");
    }
}

#[test]
fn without_perspective_the_height_is_metres() {
    let mut stage = card(LensKeys { height: keys([2.0f32, 6.0]), ..LensKeys::default() });
    let camera = &mut stage.scene.cameras[0];
    camera.projection = Projection::Orthographic { height_m: 2.0 };
    let set = Set::of(&stage.scene, &FRAMES);
    for frame in FRAMES {
        let height = between(frame.into(), [2.0, 6.0]);
        let expected = f64::from(COLUMNS) * (0.5 - EDGE_M / height);
        let found = lit(&set.render(&looked(64), frame));
        assert!((found - expected).abs() < 0.02, "{frame}: {found} columns, {expected} expected");
    }
}

/// The share of a unit disk left of `x`.
fn share_of_disk(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    0.5 + (x * (1.0 - x * x).sqrt() + x.asin()) / PI
}

/// By the equation of the thin lens a point at `d` is a disk of radius `r |d / focus - 1|` in its own plane, where `r` is
/// the lens's.
#[test]
fn the_disk_of_confusion_is_that_of_the_frame() {
    let (radii, focus) = ([0.02, 0.12], [2.0, 4.5]);
    let stage = card(LensKeys {
        lens_radius_m: keys(radii.map(|radius| radius as f32)),
        focus_distance_m: keys(focus.map(|focus| focus as f32)),
        ..LensKeys::default()
    });
    let set = Set::of(&stage.scene, &FRAMES);
    let slope_of = |column: f64| 0.5f64.tan() * (2.0 * column / f64::from(COLUMNS) - 1.0);
    for frame in FRAMES {
        let frame_s = f64::from(frame);
        let reach = between(frame_s, radii) * (FAR_M / between(frame_s, focus) - 1.0).abs();
        for (x, value) in columns(&set.render(&looked(64), frame)).into_iter().enumerate() {
            let share = |part: u32| {
                let slope = slope_of(x as f64 + (f64::from(part) + 0.5) / 64.0);
                match reach > 1e-6 {
                    true => share_of_disk((slope * FAR_M - EDGE_M) / reach),
                    false => f64::from(u8::from(slope * FAR_M > EDGE_M)),
                }
            };
            let expected = (0..64).map(share).sum::<f64>() / 64.0;
            assert!((value - expected).abs() < 0.02, "{frame}, column {x}: {value} {expected}");
        }
    }
}

#[test]
fn a_zoom_is_blurred_while_the_shutter_is_open() {
    let yfovs = [0.4f32, 1.2];
    let mut stage = card(LensKeys { height: keys(yfovs), ..LensKeys::default() });
    stage.scene.cameras[0].shutter = Shutter::new(-6.0, 12.0);
    let set = Set::of(&stage.scene, &[7]);
    let found = lit(&set.render(&looked(512), 7));
    let at =
        |i: i32| right_of_edge(between(1.0 + 18.0 * (f64::from(i) + 0.5) / 1e4, [0.4, 1.2]), 0.0);
    let expected = (0..10_000).map(at).sum::<f64>() / 1e4;
    assert!((found - expected).abs() < 0.05, "{found} {expected}");
    let sharp = RenderSettings { motion_blur: false, ..looked(64) };
    let (sharp, instant) =
        (lit(&set.render(&sharp, 7)), right_of_edge(between(7.0, [0.4, 1.2]), 0.0));
    assert!(
        (sharp - instant).abs() < 0.02 && (instant - expected).abs() > 0.2,
        "{sharp} {instant}"
    );
}

/// A lit floor, and everything about the lens keyed.
fn everything() -> Stage {
    let mut stage = Stage::default();
    stage.quad([40.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    stage.quad([0.5; 2], lambert(Vec3::splat(0.8)), facing(DVec3::Y, 2.0 * DVec3::Y));
    let lamp = LightKind::Point { intensity_cd: Vec3::splat(9.0) };
    stage.light(lamp, at(DVec3::new(0.0, 2.0, 0.0)));
    stage.look(DVec3::new(0.0, 2.0, 1e-3), DVec3::ZERO, 1.0);
    let lens = LensKeys {
        height: keys([1.0f32, 0.5, 1.5]),
        lens_radius_m: keys([0.0f32, 0.1, 0.02]),
        focus_distance_m: keys([1.0f32, 2.0, 1.5]),
        film_offset: keys([Vec2::ZERO, Vec2::splat(0.1), Vec2::NEG_X]),
        exposure_scale: keys([1.0f32, 8.0, 0.25]),
        clip_m: keys([Vec2::new(0.0, 9.0), Vec2::new(0.5, 1.9), Vec2::new(1.0, 3.0)]),
    };
    stage.scene.cameras[0].over_time = Some(Arc::new(lens));
    stage
}

/// Whatever else is rendered, in whatever order, a frame is what a still camera with its lens sees.
#[test]
fn a_frame_is_that_of_a_still_camera_with_its_lens() {
    let stage = everything();
    let aovs = vec![Aov::Beauty, Aov::Variance, Aov::Depth, Aov::Direct];
    let settings = RenderSettings { aovs, float_beauty: true, ..direct(16, 16) };
    let frames = [20, -5, 25, 1, 31, 49, 70];
    let set = Set::of(&stage.scene, &[-5, 1, 20, 25, 31, 49, 70]);
    let camera = &stage.scene.cameras[0];
    let delegate =
        RenderDelegate::new(&stage.scene, &set.emitters, camera.clone(), settings.clone());
    let mut seen = Vec::new();
    for frame in frames {
        let one_by_one = delegate.render(&set.tree, frame, &()).unwrap().buffers;
        let still = stage.scene.camera_at(camera, frame.into());
        assert_eq!(still.over_time, None);
        assert_eq!(one_by_one, set.seen_by(still, &settings, frame), "frame {frame}");
        // And alone, with a tree of its own.
        let alone = Set::of(&stage.scene, &[frame]).render(&settings, frame);
        assert_eq!(one_by_one, alone, "frame {frame}");
        seen.push(one_by_one);
    }
    for (i, one) in seen.iter().enumerate() {
        let same = seen[..i].iter().filter(|other| other.beauty().eq(one.beauty())).count();
        assert_eq!(same, 0, "each frame has a lens of its own");
    }
}

#[test]
fn a_zoom_moves_what_is_seen() {
    // The tangent of half the field of view: one for one metre a metre away.
    let yfovs = [2.0 * 0.5f32.atan(), 2.0 * 1f32.atan()];
    let mut stage = card(LensKeys { height: keys(yfovs), ..LensKeys::default() });
    stage.scene.timeline.frames_per_second = 1.0;
    stage.scene.nodes[0].local = at(DVec3::new(0.0, 0.0, -FAR_M));
    let settings = RenderSettings { aovs: vec![Aov::Motion], ..looked(16) };
    let set = Set::of(&stage.scene, &[1, 2]);
    let (first, second) = (set.render(&settings, 1), set.render(&settings, 2));
    let channel = |buffers: &RenderBuffers, name: &str| -> Vec<f32> {
        buffers.channel(name).unwrap().collect()
    };
    for x in [3, 20, 50] {
        // Pixels from the middle; zooming out halves them.
        let (pixel, off) = ((32 * COLUMNS + x) as usize, f64::from(x) + 0.5 - 32.0);
        let close = |found: f32, expected: f64| (f64::from(found) - expected).abs() < 0.1;
        assert!(close(channel(&first, "forward.u")[pixel], -0.5 * off), "{x}");
        assert!(close(channel(&second, "backward.u")[pixel], off), "{x}");
        // Before the first key and after the last one nothing changes.
        assert_eq!(channel(&first, "backward.u")[pixel], 0.0);
        assert_eq!(channel(&second, "forward.u")[pixel], 0.0);
    }
}

/// An offset of the film moves the whole picture the other way, what is infinitely far too.
#[test]
fn a_shift_of_the_film_moves_what_is_seen() {
    let film_offset = keys([Vec2::ZERO, Vec2::new(0.125, -0.0625)]);
    let mut stage = card(LensKeys { film_offset, ..LensKeys::default() });
    stage.scene.timeline.frames_per_second = 1.0;
    stage.scene.nodes[0].local = at(DVec3::new(0.0, 0.0, -FAR_M));
    let settings = RenderSettings { aovs: vec![Aov::Motion], ..looked(16) };
    let set = Set::of(&stage.scene, &[1, 2]);
    let (first, second) = (set.render(&settings, 1), set.render(&settings, 2));
    let size = COLUMNS as f32;
    for (buffers, way, sign) in [(&first, "forward", 1.0), (&second, "backward", -1.0)] {
        for (axis, expected) in [("u", -0.125 * size), ("v", 0.0625 * size)] {
            let found: Vec<f32> = buffers.channel(&format!("{way}.{axis}")).unwrap().collect();
            assert!(
                found.iter().all(|found| (found - sign * expected).abs() < 1e-3),
                "{way} {axis}: {found:?}"
            );
        }
    }
}

/// What is hidden from where is learned of what the camera sees.
#[test]
fn a_learned_table_knows_the_lens_over_time() {
    let stage = everything();
    let key = |change: &dyn Fn(&mut Camera, &mut LensKeys)| {
        let mut camera = stage.scene.cameras[0].clone();
        let mut lens = LensKeys::clone(camera.over_time.as_ref().unwrap());
        change(&mut camera, &mut lens);
        camera.over_time = (!lens.is_empty()).then(|| Arc::new(lens));
        pipeline::view_keys(&stage.scene, &camera).camera
    };
    let own = key(&|_, _| ());
    assert_eq!(own, key(&|_, _| ()));
    assert_eq!(own, key(&|camera, _| camera.exposure_scale = 7.0));
    assert_eq!(own, key(&|_, lens| lens.exposure_scale = None));
    assert_eq!(own, key(&|camera, _| camera.is_hidden = true));
    let others = [
        key(&|_, lens| lens.height = None),
        key(&|_, lens| lens.height.as_mut().unwrap().values[1] = 0.6),
        key(&|_, lens| lens.height.as_mut().unwrap().times_s[2] = 3.0),
        key(&|_, lens| lens.lens_radius_m.as_mut().unwrap().values[2] = 0.0),
        key(&|_, lens| lens.focus_distance_m = None),
        key(&|_, lens| lens.film_offset.as_mut().unwrap().values[0] = Vec2::X),
        key(&|_, lens| lens.clip_m = None),
        key(&|camera, lens| {
            *lens = LensKeys::default();
            camera.exposure_scale = 2.0;
        }),
    ];
    for (i, other) in others.iter().enumerate() {
        assert!(*other != own && !others[..i].contains(other), "change {i}");
    }
    // Exposure alone is nothing that is seen.
    let still = |keyed: bool| {
        key(&|_, lens| {
            let exposure_scale = keyed.then(|| keys([1.0f32, 2.0]).unwrap());
            *lens = LensKeys { exposure_scale, ..LensKeys::default() };
        })
    };
    assert_eq!(still(true), still(false));
    // The same keys are at other frames on another clock.
    let mut faster = everything();
    faster.scene.timeline.frames_per_second = 48.0;
    assert_ne!(pipeline::view_keys(&faster.scene, &faster.scene.cameras[0]).camera, own);
}
