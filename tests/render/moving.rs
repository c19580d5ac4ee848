//! Lights that move or vary: one tree a frame over those, above one tree over all others.

use crate::rooms;
use crate::stage::{Set, Stage, aimed, at, by, facing, glow, picture};
use crate::statistics::Estimate;
use crate::strategies::{SIZE, disagreement, render};
use candelabra::light_tree::{FrameTree, Receiver};
use candelabra::render::{LightStrategy, RenderDelegate, RenderError, RenderSettings};
use candelabra::scene::{
    Channel, Interpolation, Keys, Light, LightKind, Material, Scene, Shaping, Trs,
};
use glam::{DAffine3, DMat3, DVec3, Quat, Vec3};

pub const FRAMES: [i32; 3] = [1, 13, 25];

/// A room in which a carousel of lights turns and drifts, one of them on an arm of its own; a card
/// without light moves too. The clock is the default one: frame 25 is one second.
pub fn carousel() -> Stage {
    let mut stage = rooms::lambert_room();
    let hub = stage.node(at(DVec3::new(-0.6, 0.8, 0.2)));
    let turn = |angle: f32| Quat::from_rotation_y(angle);
    let keys = |values: Vec<Quat>| Keys {
        times_s: vec![0.0, 0.5, 1.0],
        values,
        interpolation: Interpolation::Linear,
    };
    let drift = Keys {
        times_s: vec![0.0, 1.0],
        values: vec![Vec3::new(-0.6, 0.8, 0.2), Vec3::new(0.7, 0.5, 0.4)],
        interpolation: Interpolation::Linear,
    };
    stage.scene.nodes[hub as usize].channels = vec![
        Channel::Rotation(keys(vec![turn(0.0), turn(1.0), turn(2.5)])),
        Channel::Translation(drift),
    ];
    let first = stage.scene.nodes.len();
    stage.quad([0.3; 2], glow(Vec3::new(9.0, 6.0, 3.0)), at(DVec3::X * 0.4));
    stage.ball(0.15, 2, glow(Vec3::new(2.0, 4.0, 9.0)), at(DVec3::new(-0.3, -0.1, 0.3)));
    stage.light(LightKind::Point { intensity_cd: Vec3::splat(0.4) }, at(DVec3::Z * 0.4));
    let radiance_nits = Vec3::new(4.0, 9.0, 4.0);
    let sphere = LightKind::Sphere { radiance_nits, radius: 0.1, shaping: None };
    stage.light(sphere, at(DVec3::new(0.1, 0.3, -0.3)));
    stage.quad([0.3; 2], candelabra::scene::Material::default(), at(DVec3::Y * -0.3));
    for node in &mut stage.scene.nodes[first..] {
        node.parent = Some(hub);
    }
    stage
}

/// The same scene as it stands in a frame, for good.
fn frozen(stage: &mut Stage, frame: i32) {
    let scene = &mut stage.scene;
    let pose = scene.pose_at(scene.timeline.seconds_at(f64::from(frame)));
    for (number, node) in (0..).zip(&mut scene.nodes) {
        let world = pose.world(number);
        let matrix3 = DMat3::from_cols(
            Vec3::from(world.matrix3.x_axis).as_dvec3(),
            Vec3::from(world.matrix3.y_axis).as_dvec3(),
            Vec3::from(world.matrix3.z_axis).as_dvec3(),
        );
        let translation = Vec3::from(world.translation).as_dvec3();
        node.local = Trs::Matrix(DAffine3 { matrix3, translation });
        (node.parent, node.channels) = (None, Vec::new());
    }
    for number in 0..scene.instances.len() {
        let rgb = scene.rgb_of_instance(number as u32, &pose);
        let instance = &mut scene.instances[number];
        if instance.values.take().is_some() {
            // On a stage every mesh has its own material.
            let material = scene.meshes[instance.mesh as usize].material.unwrap();
            scene.materials[material as usize].emission_nits = rgb;
        }
    }
    for number in 0..scene.lights.len() {
        let rgb = scene.rgb_of_light(number as u32, &pose);
        scene.lights[number].values = None;
        match &mut scene.lights[number].kind {
            LightKind::Point { intensity_cd } | LightKind::Spot { intensity_cd, .. } => {
                *intensity_cd = rgb
            }
            LightKind::Sphere { radiance_nits, .. } | LightKind::Dome { radiance_nits, .. } => {
                *radiance_nits = rgb
            }
            LightKind::Distant { irradiance_lux, .. } => *irradiance_lux = rgb,
        }
    }
}

/// Strengths at 0, 0.5 and 1 seconds.
fn keys(values: [Vec3; 3]) -> Option<Box<Keys<Vec3>>> {
    let times_s = vec![0.0, 0.5, 1.0];
    Some(Box::new(Keys { times_s, values: values.into(), interpolation: Interpolation::Linear }))
}

/// A room in which a light of every kind flickers beside one that does not. Their constants are not
/// what any frame shows; some are dark at first, some in the end, and one moves as well.
pub fn flicker() -> Stage {
    let mut stage = carousel();
    let (dark, dim, bright) = (Vec3::ZERO, Vec3::new(0.5, 1.0, 2.0), Vec3::new(9.0, 6.0, 3.0));
    let panel = stage.quad([0.4; 2], glow(dark), facing(DVec3::new(-1.0, 1.2, 0.5), DVec3::ZERO));
    panel.values = keys([dark, dim, bright]);
    let checks = picture([2, 2], false, |x, y| [(x + y) as f32, 0.5, x as f32]);
    let emission_texture = stage.texture(checks);
    let textured = Material { emission_texture, ..glow(Vec3::ONE) };
    let place = facing(DVec3::new(1.0, 1.0, 0.6), DVec3::ZERO);
    stage.quad([0.5; 2], textured, place).values = keys([bright, dark, dim]);
    let shaping = Shaping::Khr { inner_rad: 0.2, outer_rad: 0.7 };
    let spot = LightKind::Spot { intensity_cd: Vec3::splat(50.0), shaping };
    stage.light(spot, aimed(DVec3::new(0.2, 1.4, 0.9), DVec3::ZERO)).values =
        keys([dim, dim, dark]);
    let radiance_nits = Vec3::splat(100.0);
    let sphere = LightKind::Sphere { radiance_nits, radius: 0.1, shaping: None };
    stage.light(sphere, at(DVec3::new(-0.5, 0.4, 0.8))).values = keys([dim, bright, dark]);
    let sun = LightKind::Distant { irradiance_lux: Vec3::splat(9.0), angle_rad: 0.1 };
    let place = aimed(DVec3::new(1.0, 2.0, 1.0), DVec3::ZERO);
    stage.light(sun, place).values = keys([dark, 0.3 * dim, 0.1 * dim]);
    let dome = LightKind::Dome { radiance_nits: Vec3::splat(9.0), texture: None };
    stage.light(dome, at(DVec3::ZERO)).values = keys([0.02 * bright, dark, 0.1 * dim]);
    let turning = stage.scene.moving_nodes();
    let moved = |light: &&mut Light| turning[light.node as usize];
    let lamp = stage.scene.lights.iter_mut().find(moved).unwrap();
    lamp.values = keys([dim, bright, dark]);
    stage
}

fn settings(strategy: LightStrategy, seed: u32) -> RenderSettings {
    let small = RenderSettings { width: SIZE, height: SIZE, depth: 2, seed, ..Default::default() };
    by(strategy, true, &small)
}

#[test]
fn every_frame_is_the_picture_of_its_moment() {
    let stage = carousel();
    let set = Set::of(&stage.scene, &FRAMES);
    assert!((1..set.emitters.len()).contains(&set.emitters.changing_count()));
    let mut pictures = Vec::new();
    for frame in FRAMES {
        let tree = render(&set, settings(LightStrategy::Tree, 10), frame);
        let mut still = carousel();
        frozen(&mut still, frame);
        let still = Set::of(&still.scene, &[]);
        assert_eq!(still.emitters.changing_count(), 0);
        for (what, other) in [
            ("uniformly", render(&set, settings(LightStrategy::Uniform, 20), frame)),
            ("exhaustively", render(&set, settings(LightStrategy::Exhaustive, 30), frame)),
            ("by power", render(&set, settings(LightStrategy::Power, 40), frame)),
            ("standing still", render(&still, settings(LightStrategy::Tree, 50), 1)),
        ] {
            let wrong = disagreement(&tree, &other);
            assert!(
                wrong.is_none(),
                "frame {frame} through the tree and {what} {}",
                wrong.unwrap()
            );
        }
        pictures.push(tree);
    }
    // And it does move.
    for pair in pictures.windows(2) {
        let apart = Estimate::of_picture(&pair[0]).distance(&Estimate::of_picture(&pair[1]));
        assert!(apart > 10.0, "{apart}");
    }
}

#[test]
fn every_frame_of_a_flicker_is_the_picture_of_the_constant_lights_of_its_moment() {
    // One of them between two keys.
    const FRAMES: [i32; 3] = [1, 10, 25];
    let stage = flicker();
    let set = Set::of(&stage.scene, &FRAMES);
    let varying = set.emitters.lights().iter().filter(|light| light.varies);
    assert_eq!(varying.count(), 5, "a sun and a dome are no emitters");
    let mut pictures = Vec::new();
    for frame in FRAMES {
        let mut still = flicker();
        frozen(&mut still, frame);
        let still = Set::of(&still.scene, &[]);
        assert_eq!(still.emitters.changing_count(), 0);
        let constant = render(&still, settings(LightStrategy::Tree, 10), 1);
        for (strategy, seed) in [(LightStrategy::Tree, 20), (LightStrategy::Uniform, 30)] {
            let varying = render(&set, settings(strategy, seed), frame);
            let wrong = disagreement(&varying, &constant);
            assert!(wrong.is_none(), "frame {frame}, {strategy:?}: {}", wrong.unwrap());
        }
        pictures.push(constant);
    }
    for pair in pictures.windows(2) {
        let apart = Estimate::of_picture(&pair[0]).distance(&Estimate::of_picture(&pair[1]));
        assert!(apart > 10.0, "{apart}");
    }
}

#[test]
fn a_frame_that_the_tree_lacks_is_named() {
    let stage = carousel();
    let set = Set::of(&stage.scene, &FRAMES);
    let camera = stage.scene.cameras[0].clone();
    let settings = RenderSettings { samples: 1, ..settings(LightStrategy::Tree, 0) };
    let delegate = RenderDelegate::new(set.scene, &set.emitters, camera, settings);
    for frame in [0, 2, 26, i32::MIN] {
        match delegate.render(&set.tree, frame, &()) {
            Err(RenderError::NoSuchFrame(error)) => {
                assert_eq!((error.frame, error.first, error.last), (frame, 1, 25));
                assert!(error.to_string().contains("--frames"), "{error}");
            }
            other => panic!("frame {frame}: {:?}", other.err()),
        }
    }
    assert!(delegate.render(&set.tree, 13, &()).is_ok());
    // Where no light moves, every frame will do.
    let still = rooms::lambert_room();
    still.set().render(&self::settings(LightStrategy::Tree, 0), i32::MAX);
}

/// The share of picks that find nothing, by an even grid.
fn dead_share(tree: &FrameTree, receiver: &Receiver, picks: u32) -> f64 {
    let nothing =
        |i: &u32| tree.sample(receiver, (f64::from(*i) + 0.5) / f64::from(picks)).is_none();
    f64::from((0..picks).filter(nothing).count() as u32) / f64::from(picks)
}

/// Receivers all over the room, with normals all over the sphere.
fn receivers() -> impl Iterator<Item = Receiver> {
    (0..40).map(|i| {
        let t = i as f32;
        let point = Vec3::new((1.7 * t).sin(), 0.6 + 0.6 * (0.9 * t).cos(), (2.3 * t).cos());
        let normal = Vec3::new((0.7 * t).cos(), (1.1 * t).sin(), (1.9 * t).sin()).normalize();
        Receiver { point, normal: if i % 8 == 7 { Vec3::ZERO } else { normal } }
    })
}

#[test]
fn what_stands_still_and_what_moves_share_one_probability() {
    const PICKS: u32 = 1 << 14;
    let stage = carousel();
    let set = Set::of(&stage.scene, &FRAMES);
    let count = set.emitters.len();
    let split = count - set.emitters.changing_count();
    for frame in FRAMES {
        let tree = set.tree.at_frame(frame).unwrap();
        let (mut of_still, mut of_moving) = (0, 0);
        for receiver in receivers() {
            let told: Vec<f64> =
                (0..count as u32).map(|emitter| tree.probability(&receiver, emitter)).collect();
            let dead = dead_share(&tree, &receiver, PICKS);
            // Every run of picks that find nothing may be off by one.
            let sum = told.iter().sum::<f64>() + dead;
            assert!((sum - 1.0).abs() <= 20.0 / f64::from(PICKS), "{sum}");
            of_still += told[..split].iter().filter(|&&share| share > 0.0).count();
            of_moving += told[split..].iter().filter(|&&share| share > 0.0).count();
            let mut picked = vec![0u32; count];
            for i in 0..PICKS {
                let u = (f64::from(i) + 0.5) / f64::from(PICKS);
                if let Some(pick) = tree.sample(&receiver, u) {
                    let emitter = pick.light.emitter().unwrap() as usize;
                    let told = told[emitter];
                    assert!((pick.probability - told).abs() <= 1e-12 * told);
                    picked[emitter] += 1;
                }
            }
            for (picks, share) in picked.into_iter().zip(&told) {
                let off = f64::from(picks) - share * f64::from(PICKS);
                assert!(off.abs() <= 1.0 + 1e-6, "{picks} picks, {share}");
            }
        }
        assert!(of_still > split && of_moving > count - split, "{of_still} {of_moving}");
    }
}

#[test]
fn a_shot_of_nothing_but_moving_lights_has_no_tree_below() {
    let mut stage = carousel();
    let moving = stage.scene.moving_nodes();
    stage.scene.lights.retain(|light| moving[light.node as usize]);
    let scene = &mut stage.scene;
    let emits = |scene: &Scene, mesh| scene.material_of(mesh).is_some_and(|m| m.emits());
    let kept = scene.instances.clone().into_iter();
    scene.instances = kept.filter(|i| moving[i.node as usize] || !emits(scene, i.mesh)).collect();
    let set = Set::of(&stage.scene, &FRAMES);
    assert_eq!(set.emitters.changing_count(), set.emitters.len());
    let tree = render(&set, settings(LightStrategy::Tree, 60), 13);
    let uniform = render(&set, settings(LightStrategy::Uniform, 70), 13);
    assert_eq!(disagreement(&tree, &uniform), None);
}
