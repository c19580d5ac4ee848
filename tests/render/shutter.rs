//! What moves while the shutter is open: motion blur.

use crate::moving::{carousel, flicker};
use crate::rooms;
use crate::stage::{Set, Stage, at, by, direct, facing, glow, lambert};
use crate::statistics::Estimate;
use crate::strategies::{SIZE, disagreement, render};
use candelabra::emitter::PosedEmitters;
use candelabra::light_tree::Receiver;
use candelabra::pipeline;
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{Aov, LightStrategy, RenderDelegate, RenderSettings, Window};
use candelabra::scene::{
    Camera, Channel, Interpolation, Keys, LightKind, Material, Scene, Shutter, Trs,
};
use glam::{DVec3, Vec2, Vec3};

/// The only frame; it is second 0.
const FRAME: i32 = 1;

/// A straight way in one second.
fn drift(from: Vec3, to: Vec3) -> Vec<Channel> {
    let (times_s, values) = (vec![0.0, 1.0], vec![from, to]);
    vec![Channel::Translation(Keys { times_s, values, interpolation: Interpolation::Linear })]
}

/// The scene, seen through a shutter that is open for a second: 24 frames.
fn open(mut stage: Stage) -> Stage {
    stage.scene.cameras[0].shutter = Shutter::new(0.0, 24.0);
    stage
}

fn settings(strategy: LightStrategy, seed: u32) -> RenderSettings {
    let small = RenderSettings { width: SIZE, height: SIZE, depth: 2, seed, ..Default::default() };
    by(strategy, true, &small)
}

fn luminances(picture: &RenderBuffers) -> Vec<f64> {
    picture.beauty().map(|rgb| f64::from(rgb.element_sum())).collect()
}

/// A bright card, one unit wide, before a camera that sees four units; column by column the light that it
/// gives while it, or the camera, moves by two.
fn columns(card_moves: bool) -> Vec<f64> {
    let mut stage = Stage::default();
    stage.quad([1.0, 8.0], glow(Vec3::ONE), Trs::default());
    stage.look(DVec3::Z * 3.0, DVec3::ZERO, 1.0);
    let camera = &mut stage.scene.cameras[0];
    *camera = Camera { shutter: Shutter::new(0.0, 24.0), ..Camera::orthographic(camera.node, 4.0) };
    let nodes = &mut stage.scene.nodes;
    match card_moves {
        true => nodes[0].channels = drift(Vec3::NEG_X, Vec3::X),
        false => nodes[1].channels = drift(Vec3::new(1.0, 0.0, 3.0), Vec3::new(-1.0, 0.0, 3.0)),
    }
    let settings = RenderSettings { depth: 0, ..direct(16, 1024) };
    let picture = stage.render(&settings);
    let rows = luminances(&picture);
    (0..16).map(|x| (0..16).map(|y| rows[16 * y + x] / 48.0).sum()).collect()
}

#[test]
fn what_passes_is_seen_for_its_share_of_the_time() {
    for card_moves in [true, false] {
        for (x, seen) in columns(card_moves).into_iter().enumerate() {
            // The card covers a place while its middle is within half a unit of it.
            let share = |at: f64| 0.5 * (at + 0.5).min(1.0) - 0.5 * (at - 0.5).max(-1.0);
            let at = -2.0 + (x as f64 + 0.5) / 4.0;
            assert!((seen - share(at).max(0.0)).abs() < 0.01, "column {x}: {seen} {}", share(at));
        }
    }
}

/// The mean of the pictures of all times of the frame.
fn mean_of_instants(stage: &Stage, settings: &RenderSettings) -> Vec<f64> {
    let camera = &stage.scene.cameras[0];
    let times = stage.scene.times_of(camera, FRAME);
    let mut sum = vec![0.0; (SIZE * SIZE) as usize];
    for (seed, time) in (0..).zip(&times) {
        let mut instant = carousel();
        instant.scene.timeline.zero_frame += f64::from(FRAME) - time;
        let settings = RenderSettings { seed, ..settings.clone() };
        let picture = Set::of(&instant.scene, &[FRAME]).render(&settings, FRAME);
        sum.iter_mut().zip(luminances(&picture)).for_each(|(sum, own)| *sum += own);
    }
    sum.into_iter().map(|sum| sum / times.len() as f64).collect()
}

#[test]
fn a_blurred_frame_is_the_mean_of_its_instants() {
    let stage = open(carousel());
    let blurred = Set::of(&stage.scene, &[FRAME]);
    let blurred = luminances(&render(&blurred, settings(LightStrategy::Tree, 1), FRAME));
    let one = RenderSettings { samples: 64, ..settings(LightStrategy::Tree, 0) };
    let mean = mean_of_instants(&stage, &one);
    let all = |picture: &[f64]| picture.iter().sum::<f64>();
    assert!((all(&blurred) / all(&mean) - 1.0).abs() < 0.01, "{}", all(&blurred) / all(&mean));
    for (block, (own, mean)) in blurred.chunks(64).zip(mean.chunks(64)).enumerate() {
        let ratio = all(own) / all(mean);
        assert!((ratio - 1.0).abs() < 0.03, "rows {block}: {ratio}");
    }
}

#[test]
fn every_strategy_sees_the_same_blur() {
    for stage in [open(carousel()), open(flicker())] {
        let set = Set::of(&stage.scene, &[FRAME]);
        let tree = render(&set, settings(LightStrategy::Tree, 10), FRAME);
        for (seed, strategy) in [
            (20, LightStrategy::Uniform),
            (30, LightStrategy::Exhaustive),
            (40, LightStrategy::Power),
        ] {
            let other = render(&set, settings(strategy, seed), FRAME);
            assert_eq!(disagreement(&tree, &other), None, "{strategy:?}");
        }
        // And it is a blur.
        let sharp = RenderSettings { motion_blur: false, ..settings(LightStrategy::Tree, 10) };
        let sharp = render(&set, sharp, FRAME);
        let apart = Estimate::of_picture(&tree).distance(&Estimate::of_picture(&sharp));
        assert!(apart > 10.0, "{apart}");
    }
}

/// A tree must not call dark what shines at any of the times.
#[test]
fn what_shines_at_some_time_may_be_picked() {
    for stage in [open(carousel()), open(flicker())] {
        let set = Set::of(&stage.scene, &[FRAME]);
        let tree = set.tree.at_frame(FRAME).unwrap();
        let mut lit = 0;
        for time in stage.scene.times_of_all(FRAME).into_iter().step_by(5) {
            let pose = stage.scene.pose_at(stage.scene.timeline.seconds_at(time));
            let posed = PosedEmitters { scene: set.scene, emitters: &set.emitters, pose: &pose };
            for i in 0..20 {
                let t = i as f32;
                let point =
                    Vec3::new((1.7 * t).sin(), 0.6 + 0.6 * (0.9 * t).cos(), (2.3 * t).cos());
                let normal = Vec3::new((0.7 * t).cos(), (1.1 * t).sin(), (1.9 * t).sin());
                let receiver = Receiver { point, normal: normal.normalize() };
                for emitter in 0..set.emitters.len() as u32 {
                    let shines = |u| {
                        let sample = posed.sample(emitter, point, Vec2::new(u, 1.0 - u));
                        sample.is_some_and(|own| own.direction.dot(receiver.normal) > 1e-4)
                    };
                    if [0.1, 0.5, 0.9].into_iter().any(shines) {
                        lit += 1;
                        assert!(tree.probability(&receiver, emitter) > 0.0, "{emitter} at {time}");
                    }
                }
            }
        }
        assert!(lit > 1000, "{lit}");
    }
}

#[test]
fn where_nothing_moves_a_shutter_changes_nothing() {
    let settings = RenderSettings { samples: 8, ..settings(LightStrategy::Tree, 3) };
    let plain = rooms::lambert_room().render(&settings);
    assert!(open(rooms::lambert_room()).render(&settings) == plain);
    // Nor does one that opens when all is over.
    let mut stage = carousel();
    stage.scene.cameras[0].shutter = Shutter::new(0.0, 1.0);
    stage.scene.timeline.zero_frame -= 100.0;
    let set = Set::of(&stage.scene, &[FRAME]);
    let instant = RenderSettings { motion_blur: false, ..settings.clone() };
    assert!(set.render(&settings, FRAME) == set.render(&instant, FRAME));
}

/// The strengths of the panel and of the bulb of a still room, step by step.
fn lit(values: [f32; 2]) -> Option<Box<Keys<Vec3>>> {
    let values = values.map(Vec3::splat).into();
    Some(Box::new(Keys { times_s: vec![0.0, 0.5], values, interpolation: Interpolation::Step }))
}

/// Rays must find a lamp that is dark at first, and lose one that goes out, though nothing moves: it is all as if
/// something moved far away.
#[test]
fn a_lamp_that_is_lit_for_half_the_time_gives_half_its_light() {
    for values in [[0.0, 4.0], [4.0, 0.0]] {
        for moves in [false, true] {
            let mut stage = Stage::default();
            stage.quad([1.0, 1.0], glow(Vec3::ONE), Trs::default()).values = lit(values);
            let radiance_nits = Vec3::ONE;
            let ball = LightKind::Sphere { radiance_nits, radius: 0.6, shaping: None };
            stage.light(ball, at(DVec3::X * 1.2)).values = lit(values);
            stage.quad([0.1, 0.1], lambert(Vec3::ONE), at(DVec3::Z * 90.0));
            let mirror = Material { metallic: 1.0, roughness: 0.1, ..Material::default() };
            stage.quad([9.0, 9.0], mirror, facing(DVec3::NEG_Y * 0.7, DVec3::ZERO));
            if moves {
                let far = drift(Vec3::Z * 90.0, Vec3::new(1.0, 0.0, 90.0));
                stage.scene.nodes[2].channels = far;
            }
            stage.look(DVec3::new(0.6, 0.2, 3.0), DVec3::new(0.6, -0.2, 0.0), 1.0);
            let stage = open(stage);
            let settings = RenderSettings { samples: 256, ..settings(LightStrategy::Tree, 3) };
            let blurred = luminances(&stage.render(&settings));
            let mut always = Stage { scene: stage.scene };
            always.scene.instances[0].values = lit([2.0, 2.0]);
            always.scene.lights[0].values = lit([2.0, 2.0]);
            let expected = luminances(&always.render(&settings));
            let all = |picture: &[f64]| picture.iter().sum::<f64>();
            let ratio = all(&blurred) / all(&expected);
            assert!((ratio - 1.0).abs() < 0.02, "{values:?} {moves}: {ratio}");
        }
    }
}

/// What a shutter shows is what is there while it is open, and not what is there at its frame.
#[test]
fn a_shutter_may_be_open_away_from_its_frame() {
    let mut stage = Stage::default();
    stage.quad([8.0, 8.0], glow(Vec3::ONE), Trs::default());
    stage.look(DVec3::Z * 3.0, DVec3::ZERO, 1.0);
    let (times_s, values) = (vec![0.0, 0.5 / 24.0], vec![Vec3::ZERO, Vec3::X * 100.0]);
    let step = Keys { times_s, values, interpolation: Interpolation::Step };
    stage.scene.nodes[0].channels = vec![Channel::Translation(step)];
    let settings = RenderSettings { depth: 0, ..direct(8, 4) };
    for (shutter, seen) in [((0.0, 0.4), 1.0), ((0.6, 0.9), 0.0), ((-0.4, 0.0), 1.0)] {
        stage.scene.cameras[0].shutter = Shutter::new(shutter.0, shutter.1);
        let picture = Set::of(&stage.scene, &[FRAME]).render(&settings, FRAME);
        assert!(picture.beauty().all(|rgb| rgb.x == seen), "{shutter:?}");
    }
}

#[test]
fn a_part_of_a_blurred_frame_is_the_wholes() {
    let stage = open(carousel());
    let set = Set::of(&stage.scene, &[FRAME]);
    let whole = RenderSettings { samples: 12, ..settings(LightStrategy::Tree, 5) };
    let crop = Some(Window { x0: 3, y0: 5, x1: 9, y1: 12 });
    let part = set.render(&RenderSettings { crop, ..whole.clone() }, FRAME);
    let whole = set.render(&whole, FRAME);
    let expected = (5..12).flat_map(|y| (3..9).map(move |x| (SIZE * y + x) as usize));
    let whole: Vec<Vec3> = whole.beauty().collect();
    assert!(part.beauty().eq(expected.map(|at| whole[at])));
}

/// What moves evenly has one motion, whenever it is looked at.
#[test]
fn blur_leaves_the_motion_layer_what_it_is() {
    let mut stage = Stage::default();
    stage.quad([100.0, 100.0], glow(Vec3::ONE), Trs::default());
    stage.look(DVec3::Z * 3.0, DVec3::ZERO, 1.0);
    let node = stage.scene.cameras[0].node;
    stage.scene.cameras[0] =
        Camera { shutter: Shutter::new(-0.5, 0.5), ..Camera::orthographic(node, 4.0) };
    stage.scene.nodes[0].channels = drift(Vec3::ZERO, Vec3::X * 24.0);
    let settings =
        RenderSettings { depth: 0, aovs: vec![Aov::Beauty, Aov::Motion], ..direct(8, 16) };
    let set = Set::of(&stage.scene, &[13]);
    let delegate = |shutter: bool| {
        let settings = RenderSettings { motion_blur: shutter, ..settings.clone() };
        let camera = stage.scene.cameras[0].clone();
        let delegate = RenderDelegate::new(set.scene, &set.emitters, camera, settings);
        let picture = delegate.render(&set.tree, 13, &()).unwrap().buffers;
        picture.channel("forward.u").unwrap().collect::<Vec<f32>>()
    };
    // A unit a frame, two pixels a unit.
    for (blurred, sharp) in delegate(true).into_iter().zip(delegate(false)) {
        assert!((blurred - 2.0).abs() < 1e-3 && (sharp - 2.0).abs() < 1e-3, "{blurred} {sharp}");
    }
}

#[test]
fn a_tree_belongs_to_the_shutter_where_lights_move() {
    let print = |scene: &Scene| {
        let emitters = candelabra::emitter::Emitters::collect(scene);
        pipeline::survey(scene, &emitters, &[FRAME]).unwrap().fingerprint
    };
    let (moving, blurred) = (carousel(), open(carousel()));
    assert_ne!(print(&moving.scene), print(&blurred.scene));
    let (still, blurred) = (rooms::lambert_room(), open(rooms::lambert_room()));
    assert_eq!(print(&still.scene), print(&blurred.scene));
}
