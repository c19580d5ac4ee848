//! Lights that are sampled at every point, in trees of their own.

use crate::closed_forms::{assert_irradiance, of_sphere, receiver};
use crate::moving::carousel;
use crate::rooms;
use crate::stage::{Set, Stage, aimed, at, by, direct, facing, glow, lambert};
use crate::statistics::pixels;
use crate::strategies::{Way, disagreement, render};
use candelabra::light_tree::{Picked, Receiver, Scratch, Splitting, TreeKind};
use candelabra::pipeline::{NoLightThere, force_lights};
use candelabra::render::{LightStrategy, RenderDelegate, RenderSettings, Split};
use candelabra::scene::{LightKind, Node, Scene};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

const FRAME: i32 = 13;

/// A room with a light of every kind, some of which move, and their paths.
fn full_room() -> (Stage, Vec<(&'static str, String)>) {
    let mut stage = carousel();
    let path_of_mesh = |stage: &Stage| stage.scene.instances.last().unwrap().path.to_string();
    let path_of_light =
        |stage: &Stage| stage.scene.light_path(stage.scene.lights.len() - 1).to_owned();
    let moving = stage.scene.moving_nodes();
    let moves = |node: u32| moving[node as usize];
    let turning = stage.scene.instances.iter().find(|i| moves(i.node)).unwrap().path.to_string();
    let sinking = stage.scene.lights.iter().position(|light| moves(light.node)).unwrap();
    let mut paths = vec![
        ("a moving mesh", turning),
        ("a moving point", stage.scene.light_path(sinking).into()),
    ];
    let place = facing(DVec3::new(0.9, 1.2, 0.4), DVec3::ZERO);
    stage.quad([0.5; 2], glow(Vec3::new(6.0, 9.0, 3.0)), place);
    paths.push(("a mesh", path_of_mesh(&stage)));
    stage.ball(0.15, 3, glow(Vec3::new(9.0, 3.0, 6.0)), at(DVec3::new(-0.9, 0.7, 0.5)));
    paths.push(("a mesh of many triangles", path_of_mesh(&stage)));
    let radiance_nits = Vec3::new(20.0, 30.0, 9.0);
    for (what, kind) in [
        ("a point", LightKind::Point { intensity_cd: Vec3::new(1.0, 0.5, 2.0) }),
        ("a sphere", LightKind::Sphere { radiance_nits, radius: 0.1, shaping: None }),
        ("a sun", LightKind::Distant { irradiance_lux: Vec3::splat(2.0), angle_rad: 0.1 }),
        ("a dome", LightKind::Dome { radiance_nits: 0.02 * radiance_nits, texture: None }),
    ] {
        stage.light(kind, aimed(DVec3::new(0.4, 0.9, 0.5), DVec3::new(0.1, 0.0, -0.1)));
        paths.push((what, path_of_light(&stage)));
    }
    (stage, paths)
}

fn settings(seed: u32) -> RenderSettings {
    RenderSettings { seed, ..direct(16, 64) }
}

#[test]
fn a_forced_light_shines_as_it_did() {
    let (mut stage, paths) = full_room();
    let oracle = {
        let set = Set::of(&stage.scene, &[FRAME]);
        render(&set, by(LightStrategy::Uniform, false, &settings(0)), FRAME)
    };
    let ways = [
        (Way::of(LightStrategy::Tree), true),
        (Way::of(LightStrategy::Power), true),
        (Way::split(0.5), true),
        (Way::of(LightStrategy::Uniform), false),
        (Way::of(LightStrategy::Exhaustive), true),
        (Way::of(LightStrategy::All), true),
        (Way::split(1.0), false),
        (Way::of(LightStrategy::Distance), true),
    ];
    let mut seed = 0;
    // One after the other, and in the end all of them together.
    let alone = paths.iter().map(|(what, path)| (*what, vec![path.clone()]));
    let together = ("all of these", paths.iter().map(|(_, path)| path.clone()).collect());
    for (number, (what, forced)) in alone.chain([together]).enumerate() {
        unforce(&mut stage.scene);
        force_lights(&mut stage.scene, &forced).unwrap();
        let set = Set::of(&stage.scene, &[FRAME]);
        let all = forced.len() > 1;
        for i in 0..if all { ways.len() } else { 1 } {
            let (way, mis) = ways[(i + number) % ways.len()];
            seed += 10;
            let buffers = render(&set, way.settings(mis, &settings(seed)), FRAME);
            let wrong = disagreement(&oracle, &buffers);
            assert!(wrong.is_none(), "{what} forced, {way:?}, mis {mis} {}", wrong.unwrap());
        }
    }
}

/// Reflected rays that find the light are weighed by how often each part of it is picked.
#[test]
fn a_forced_light_that_fills_the_view_is_lamberts() {
    for (radius, height) in [(0.5f64, 1.0f64), (2.0, 0.3)] {
        let mut stage = receiver(DVec3::Y);
        let place = facing(DVec3::Y * height, DVec3::ZERO);
        stage.disk(radius as f32, glow(Vec3::splat(3.0)), place).forced = true;
        let expected = 3.0 * PI * radius * radius / (radius * radius + height * height);
        assert_irradiance("a forced disk", &stage, expected);
        let mut stage = receiver(DVec3::Y);
        let (center, local) = (DVec3::Y * (radius + height), radius as f32);
        let radiance_nits = Vec3::splat(3.0);
        let kind = LightKind::Sphere { radiance_nits, radius: local, shaping: None };
        stage.light(kind, at(center)).forced = true;
        let expected = 3.0 * of_sphere(center, radius, DVec3::Y);
        assert_irradiance("a forced sphere", &stage, expected);
    }
    let mut stage = receiver(DVec3::Y);
    let radiance_nits = Vec3::splat(2.0);
    stage.light(LightKind::Dome { radiance_nits, texture: None }, at(DVec3::ZERO)).forced = true;
    let sun = LightKind::Distant { irradiance_lux: Vec3::splat(3.0), angle_rad: 0.8 };
    stage.light(sun, aimed(DVec3::ZERO, -DVec3::Y)).forced = true;
    assert_irradiance("a forced dome and sun", &stage, 2.0 * PI + 3.0);
}

fn unforce(scene: &mut Scene) {
    scene.instances.iter_mut().for_each(|instance| instance.forced = false);
    scene.lights.iter_mut().for_each(|light| light.forced = false);
}

#[test]
fn a_forced_light_is_never_among_the_picks_and_always_beside_them() {
    let (mut stage, paths) = full_room();
    let paths: Vec<String> = paths.into_iter().map(|(_, path)| path).collect();
    force_lights(&mut stage.scene, &paths).unwrap();
    let set = Set::of(&stage.scene, &[FRAME]);
    let is_forced = |emitter: u32| paths.contains(&set.emitters.light_of(emitter).path.to_string());
    let tree = set.tree.at_frame(FRAME).unwrap();
    // A sun and a dome are in no tree.
    assert_eq!(tree.forced_count(), paths.len() - 2);
    let forced = (0..set.emitters.len() as u32).filter(|&emitter| is_forced(emitter));
    assert_eq!(forced.clone().count() as u32, set.emitters.len() as u32 - tree.unforced_count());
    assert!(forced.clone().all(|emitter| emitter >= tree.unforced_count()));
    let how = Splitting { knob: 0.5, ..Splitting::ALL };
    let mut scratch = Scratch::default();
    for i in 0..500 {
        let t = i as f32;
        let point = Vec3::new((1.7 * t).sin(), 0.6 + 0.6 * (0.9 * t).cos(), (2.3 * t).cos());
        let receiver = Receiver { point, normal: Vec3::ZERO };
        let u = f64::from(0.618_034 * t).fract();
        let mut picked: Vec<_> = tree.sample(&receiver, u).into_iter().collect();
        tree.for_each_pick(&receiver, &[], &how, (u, i), &mut scratch, |pick| picked.push(pick));
        for pick in picked {
            let Picked::Emitter(emitter) = pick.light else { panic!("nothing is beside") };
            assert!(!is_forced(emitter), "{emitter}");
        }
        for light in 0..tree.forced_count() {
            let Some(pick) = tree.sample_forced(light, &receiver, u) else { continue };
            let emitter = pick.light.emitter().unwrap();
            assert!(is_forced(emitter));
            let told = tree.probability(&receiver, emitter);
            assert!((pick.probability / told - 1.0).abs() < 1e-9, "{told}");
            assert_eq!(tree.expected(&receiver, &[], &how, pick.light, &mut scratch), told);
        }
        // Each forced light has one sample: its emitters' probabilities add up to it, where all of
        // them can be told to shine.
        let sum: f64 = forced.clone().map(|emitter| tree.probability(&receiver, emitter)).sum();
        assert!(sum <= tree.forced_count() as f64 + 1e-9 && sum > 2.0, "{sum}");
    }
}

#[test]
fn a_forced_sun_is_sampled_beside_the_pick() {
    let mut stage = rooms::lambert_room();
    stage.scene.lights.retain(|light| matches!(light.kind, LightKind::Point { .. }));
    stage.scene.instances.truncate(1);
    let irradiance_lux = Vec3::splat(3.0);
    let sun = LightKind::Distant { irradiance_lux, angle_rad: 0.0 };
    stage.light(sun, aimed(DVec3::ZERO, -DVec3::Y));
    for (forced, picks) in [(false, 1), (true, 2)] {
        stage.scene.lights[1].forced = forced;
        let set = stage.set();
        let settings = RenderSettings { split: Split::Fixed(0.0), ..direct(4, 16) };
        let camera = stage.scene.cameras[0].clone();
        let delegate = RenderDelegate::new(set.scene, &set.emitters, camera, settings);
        let seen = delegate.render(&set.tree, 1, &()).unwrap();
        let covered: f32 = pixels(&seen.buffers).iter().map(|pixel| pixel.alpha * 16.0).sum();
        assert!(covered > 200.0);
        assert_eq!(seen.stats.trace.light_picks, picks * covered as u64, "forced: {forced}");
    }
}

#[test]
fn lights_are_forced_by_path_or_by_what_they_are_below() {
    let mut stage = Stage::default();
    let paths = ["/hall", "/hall/lamp", "/hall/lamp2", "/hallway", "/hall/chair"];
    for (number, path) in paths.into_iter().enumerate() {
        let node = stage.node(at(DVec3::X * number as f64));
        stage.scene.nodes[node as usize] = Node::fixed(path, None, at(DVec3::X));
        let kind = LightKind::Point { intensity_cd: Vec3::ONE };
        if number != 4 {
            stage.light(kind, at(DVec3::ZERO)).node = node;
        }
    }
    stage.quad([1.0; 2], lambert(Vec3::ONE), at(DVec3::ZERO)).path = "/hall/chair".into();
    stage.quad([1.0; 2], glow(Vec3::ONE), at(DVec3::ZERO)).path = "/hall/panel[1]".into();
    let mut forced_by = |asked: &[&str]| -> Result<Vec<String>, NoLightThere> {
        unforce(&mut stage.scene);
        let asked: Vec<String> = asked.iter().map(|path| path.to_string()).collect();
        force_lights(&mut stage.scene, &asked)?;
        let scene = &stage.scene;
        let lights = (0..scene.lights.len()).filter(|&row| scene.lights[row].forced);
        let lights = lights.map(|row| scene.light_path(row).to_owned());
        let meshes = scene.instances.iter().filter(|instance| instance.forced);
        Ok(lights.chain(meshes.map(|instance| instance.path.to_string())).collect())
    };
    assert_eq!(forced_by(&[]).unwrap(), [""; 0]);
    assert_eq!(forced_by(&["/hall/lamp"]).unwrap(), ["/hall/lamp"]);
    assert_eq!(forced_by(&["/hall/panel"]).unwrap(), ["/hall/panel[1]"]);
    assert_eq!(forced_by(&["/hall/panel[1]"]).unwrap(), ["/hall/panel[1]"]);
    let below = ["/hall", "/hall/lamp", "/hall/lamp2", "/hall/panel[1]"];
    assert_eq!(forced_by(&["/hall"]).unwrap(), below);
    assert_eq!(forced_by(&["/hall/"]).unwrap(), below);
    assert_eq!(forced_by(&["/hallway", "/hall/lamp2"]).unwrap(), ["/hall/lamp2", "/hallway"]);
    assert_eq!(forced_by(&["/"]).unwrap().len(), 5);
    for nothing in ["/attic", "/hall/chair", "/hal", "/hall/lamp/bulb", "hall"] {
        let error = forced_by(&["/hallway", nothing]).unwrap_err();
        assert!(error.path == nothing && error.to_string().contains(&format!("'{nothing}'")));
    }
}

/// The seed's use: a strong light that a wall hides takes most samples, and gives nothing for them.
#[test]
fn forcing_a_strong_light_behind_a_wall_quiets_the_picture() {
    let mut stage = rooms::lambert_room();
    let wall = DVec3::new(0.0, 1.65, 0.0);
    stage.quad([9.0; 2], lambert(Vec3::ZERO), facing(wall, DVec3::ZERO));
    let intensity_cd = Vec3::splat(300.0);
    stage.light(LightKind::Point { intensity_cd }, at(DVec3::new(0.1, 1.9, 0.1)));
    // A dome does not get in.
    stage.scene.lights.retain(|light| !light.kind.is_infinite());
    let strong = stage.scene.lights.len() - 1;
    let mut seen = Vec::new();
    for forced in [false, true] {
        stage.scene.lights[strong].forced = forced;
        let set = stage.set();
        let shared = set.tree.trees().iter().filter(|r| TreeKind::of(r) == Some(TreeKind::Shared));
        assert_eq!(shared.count(), usize::from(forced));
        let own = settings(forced.into());
        let buffers =
            set.render(&RenderSettings { samples: 4096, split: Split::Fixed(0.0), ..own }, 1);
        let noise: f64 = pixels(&buffers).iter().map(|p| p.variance.as_dvec3().y).sum();
        seen.push((noise, buffers));
    }
    assert_eq!(disagreement(&seen[0].1, &seen[1].1), None);
    assert!(seen[1].0 < 0.4 * seen[0].0, "{} {}", seen[0].0, seen[1].0);
}
