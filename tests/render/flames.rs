//! Mesh lights that deform: at each time they light the scene with the shape that they are seen in.

use crate::deforming::{bar, bits, frozen, morph};
use crate::moving::FRAMES;
use crate::rooms;
use crate::stage::{
    Set, Stage, aimed, at, by, direct, facing, glow, lambert, picture, scaled, tree_bytes,
};
use crate::statistics::Estimate;
use crate::strategies::{SIZE, disagreement, render};
use candelabra::emitter::{Emitters, PosedEmitters};
use candelabra::light_tree::{LightRow, LightTree, Receiver, TreeKind};
use candelabra::pipeline::{self, ShotTrees, Standing, TreeFile};
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{LightStrategy, RenderSettings, Split};
use candelabra::scene::{Deformation, Keys, LightKind, Material, Mesh, Scene, Shaping, Shutter};
use candelabra::store::AlignedBytes;
use glam::{DVec3, Vec2, Vec3};
use std::path::Path;
use std::sync::Arc;

/// A ball that grows out of itself, and is bent aside.
fn flame(place: Vec3) -> Vec3 {
    Vec3::new(0.6 * place.y, 1.5 * place.y + 0.1, -0.5 * place.z)
}

fn last(stage: &mut Stage) -> &mut Mesh {
    stage.scene.meshes.last_mut().unwrap()
}

fn deformation(mesh: &mut Mesh) -> &mut Deformation {
    Arc::get_mut(mesh.deformation.as_mut().unwrap()).unwrap()
}

/// Lights that deform, of every sort, beside some that do not, above a floor, before a mirror.
fn flames() -> Stage {
    let mut stage = rooms::lambert_room();
    let place = facing(DVec3::new(0.2, 0.4, -1.3), DVec3::new(0.0, 0.4, 0.0));
    stage.quad([1.5, 0.8], Material { metallic: 1.0, roughness: 0.2, ..Default::default() }, place);
    // A crowd: as it is, small and turned about, mirrored, stretched, flat.
    stage.ball(0.15, 3, glow(Vec3::new(4.0, 2.0, 1.0)), at(DVec3::new(-0.7, 0.5, 0.3)));
    morph(last(&mut stage), flame);
    let mesh = stage.scene.meshes.len() as u32 - 1;
    for (x, scale) in [
        (-0.2, DVec3::splat(0.4)),
        (0.3, DVec3::new(-1.0, 1.0, 1.0)),
        (0.8, DVec3::new(0.5, 1.5, -0.7)),
        (1.2, DVec3::new(0.0, 1.0, 1.0)),
    ] {
        let node = stage.node(scaled(facing(DVec3::new(x, 0.7, 0.2), DVec3::Y), scale));
        stage.again(mesh, node);
    }
    // A picture that is bent, with a side that is dark.
    let checks = picture([2, 2], false, |x, y| [(x + y) as f32, 0.5 * x as f32, x as f32]);
    let emission_texture = stage.texture(checks);
    let textured = Material { emission_texture, ..glow(Vec3::new(9.0, 3.0, 6.0)) };
    stage.quad([0.6; 2], textured, facing(DVec3::new(0.9, 1.0, 0.6), DVec3::ZERO));
    morph(last(&mut stage), |place| Vec3::new(0.0, -place.y, 2.0 * place.x * place.y));
    // A beam whose lens turns over, with light from both sides; it is aimed as its node is.
    let two_sided = Material { double_sided: true, ..glow(Vec3::new(2.0, 9.0, 3.0)) };
    let beam = stage.quad([0.3; 2], two_sided, aimed(DVec3::new(-0.9, 1.1, 0.5), DVec3::ZERO));
    beam.shaping = Some(Shaping::Khr { inner_rad: 0.3, outer_rad: 1.2 });
    morph(last(&mut stage), |place| -2.2 * place + Vec3::Z * 0.2);
    // A bar with joints, forced.
    let place = scaled(facing(DVec3::new(-0.5, 1.0, -0.4), DVec3::ZERO), DVec3::splat(0.2));
    stage.mesh(bar(), glow(Vec3::new(1.0, 2.0, 8.0)), place).forced = true;
    // And one that varies.
    stage.ball(0.1, 2, glow(Vec3::ONE), at(DVec3::new(0.1, 0.9, 0.8)));
    morph(last(&mut stage), |place| 1.5 * Vec3::new(place.y, place.x, place.z));
    let values = [4.0, 0.0, 9.0].map(|nits| Vec3::new(nits, 1.0, nits)).into();
    let keys = Keys { times_s: vec![0.0, 0.5, 1.0], values, interpolation: Default::default() };
    stage.scene.instances.last_mut().unwrap().values = Some(keys.into());
    stage
}

/// Frames at keys, between keys, and after the last one.
const SHOT: [i32; 4] = [1, 13, 25, 49];

fn settings(strategy: LightStrategy, seed: u32) -> RenderSettings {
    let small = RenderSettings { width: SIZE, height: SIZE, depth: 2, seed, ..Default::default() };
    by(strategy, true, &small)
}

#[test]
fn every_frame_is_lit_by_the_shapes_of_its_moment() {
    let stage = flames();
    let set = Set::of(&stage.scene, &SHOT);
    let deforming = set.emitters.lights().iter().filter(|light| light.deforms);
    assert_eq!(deforming.count(), 9);
    let mut pictures = Vec::new();
    for frame in SHOT {
        let tree = render(&set, settings(LightStrategy::Tree, 10), frame);
        let still = frozen(flames().scene, frame);
        // One varies still.
        let still = Set::of(&still, &SHOT);
        assert!(still.emitters.lights().iter().all(|light| !light.deforms));
        let alone = by(LightStrategy::Tree, false, &settings(LightStrategy::Tree, 60));
        let split = Split::Fixed(0.5);
        let several = RenderSettings { split, ..settings(LightStrategy::Tree, 70) };
        for (what, other) in [
            ("without reflected rays", render(&set, alone, frame)),
            ("by several lights", render(&set, several, frame)),
            ("uniformly", render(&set, settings(LightStrategy::Uniform, 20), frame)),
            ("exhaustively", render(&set, settings(LightStrategy::Exhaustive, 30), frame)),
            ("by power", render(&set, settings(LightStrategy::Power, 40), frame)),
            ("frozen", render(&still, settings(LightStrategy::Tree, 50), frame)),
        ] {
            let wrong = disagreement(&tree, &other);
            assert!(wrong.is_none(), "frame {frame} {what} {}", wrong.unwrap());
        }
        pictures.push(tree);
    }
    for pair in pictures.windows(2) {
        let apart = Estimate::of_picture(&pair[0]).distance(&Estimate::of_picture(&pair[1]));
        assert!(apart > 10.0, "{apart}");
    }
}

/// A floor below two disks that are bent; no triangle ever loses its area.
fn shells(size: f64) -> Stage {
    let mut stage = Stage::default();
    let floor = scaled(facing(DVec3::ZERO, DVec3::Y), DVec3::splat(size));
    stage.quad([5.0; 2], lambert(Vec3::splat(0.6)), floor);
    for x in [-0.5, 0.5] {
        let place = facing(DVec3::new(x, 0.6, 0.2) * size, DVec3::X * x * size);
        stage.disk(0.2, glow(Vec3::new(5.0, 3.0, 1.0)), scaled(place, DVec3::splat(size)));
        let bend = |place: Vec3| Vec3::new(0.3 * place.y, 0.2 * place.x, 4.0 * place.x * place.y);
        morph(last(&mut stage), bend);
    }
    stage.look(DVec3::new(0.0, 1.6, 2.2) * size, DVec3::Y * 0.2 * size, 0.9);
    stage
}

fn shot(scene: &Scene, settings: &RenderSettings, frame: i32) -> RenderBuffers {
    Set::of(scene, &SHOT).render(settings, frame)
}

/// Where all lights deform, the tree of a frame is that of the frozen scene: the picture has its bits.
#[test]
fn a_frame_has_the_bits_of_the_frozen_scene() {
    for exponent in [-6, -3, 0, 3, 6] {
        let size = 10_f64.powi(exponent);
        let settings = RenderSettings { depth: 2, ..direct(SIZE, 4) };
        let mut first = None;
        for frame in SHOT {
            let moving = bits(&shot(&shells(size).scene, &settings, frame));
            let still = frozen(shells(size).scene, frame);
            let still = bits(&shot(&still, &settings, frame));
            assert!(moving == still, "1e{exponent}, frame {frame}");
            assert!(moving.iter().any(|pixel| f32::from_bits(pixel[0]) > 0.0));
            assert!(first.replace(moving.clone()).is_none_or(|last| last != moving));
        }
    }
}

/// Receivers all over the room.
fn receivers() -> impl Iterator<Item = Receiver> {
    (0..30).map(|i| {
        let t = i as f32;
        let point = Vec3::new((1.7 * t).sin(), 0.6 + 0.6 * (0.9 * t).cos(), (2.3 * t).cos());
        let normal = Vec3::new((0.7 * t).cos(), (1.1 * t).sin(), (1.9 * t).sin()).normalize();
        Receiver { point, normal: if i % 8 == 7 { Vec3::ZERO } else { normal } }
    })
}

#[test]
fn what_is_picked_has_the_probability_that_is_told() {
    const PICKS: u32 = 1 << 14;
    let stage = flames();
    let set = Set::of(&stage.scene, &SHOT);
    // The forced ones come last, and are not among what is picked.
    let is_forced = |emitter: &u32| set.emitters.light_of(*emitter).forced;
    let count = (0..set.emitters.len() as u32).find(is_forced).unwrap();
    let mut all = Vec::new();
    for frame in SHOT {
        let tree = set.tree.at_frame(frame).unwrap();
        for receiver in receivers() {
            let told: Vec<f64> =
                (0..count).map(|emitter| tree.probability(&receiver, emitter)).collect();
            let mut picked = vec![0u32; count as usize];
            let mut nothing = 0;
            for i in 0..PICKS {
                let u = (f64::from(i) + 0.5) / f64::from(PICKS);
                match tree.sample(&receiver, u) {
                    Some(pick) => {
                        let emitter = pick.light.emitter().unwrap() as usize;
                        let share = told[emitter];
                        assert!((pick.probability - share).abs() <= 1e-12 * share);
                        picked[emitter] += 1;
                    }
                    None => nothing += 1,
                }
            }
            for (picks, share) in picked.into_iter().zip(&told) {
                let off = f64::from(picks) - share * f64::from(PICKS);
                assert!(off.abs() <= 1.0 + 1e-6, "{picks} picks, {share}");
            }
            let sum = told.iter().sum::<f64>() + f64::from(nothing) / f64::from(PICKS);
            assert!((sum - 1.0).abs() <= 40.0 / f64::from(PICKS), "{sum}");
            all.push(told);
        }
    }
    // They are those of the frame.
    let each = all.len() / SHOT.len();
    assert!((0..each).any(|at| all[at] != all[at + each]));
}

/// A tree must not call dark what shines at any of the times.
#[test]
fn what_shines_at_some_time_may_be_picked() {
    let mut stage = flames();
    stage.scene.cameras[0].shutter = Shutter::new(0.0, 24.0);
    let set = Set::of(&stage.scene, &[1]);
    let tree = set.tree.at_frame(1).unwrap();
    let mut lit = 0;
    for time in stage.scene.times_of_all(1).into_iter().step_by(7) {
        let pose = stage.scene.pose_at(stage.scene.timeline.seconds_at(time));
        let posed = PosedEmitters { scene: set.scene, emitters: &set.emitters, pose: &pose };
        for receiver in receivers() {
            for emitter in 0..set.emitters.len() as u32 {
                if set.emitters.light_of(emitter).forced {
                    continue;
                }
                let shines = |u| {
                    let sample = posed.sample(emitter, receiver.point, Vec2::new(u, 1.0 - u));
                    let faces = |way: Vec3| {
                        receiver.normal == Vec3::ZERO || way.dot(receiver.normal) > 1e-4
                    };
                    sample.is_some_and(|own| faces(own.direction))
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

#[test]
fn every_strategy_sees_the_same_blur() {
    let mut stage = flames();
    stage.scene.cameras[0].shutter = Shutter::new(0.0, 24.0);
    let set = Set::of(&stage.scene, &[1]);
    let tree = render(&set, settings(LightStrategy::Tree, 10), 1);
    for (seed, strategy) in [(20, LightStrategy::Uniform), (30, LightStrategy::Exhaustive)] {
        let other = render(&set, settings(strategy, seed), 1);
        assert_eq!(disagreement(&tree, &other), None, "{strategy:?}");
    }
    let sharp = RenderSettings { motion_blur: false, ..settings(LightStrategy::Tree, 10) };
    let apart =
        Estimate::of_picture(&tree).distance(&Estimate::of_picture(&render(&set, sharp, 1)));
    assert!(apart > 10.0, "{apart}");
}

/// A panel that grows out of a point above a floor, or stays at its largest.
fn growing(grows: bool) -> Stage {
    let mut stage = Stage::default();
    stage.quad([0.2; 2], lambert(Vec3::ONE), facing(DVec3::ZERO, DVec3::Y));
    stage.quad([0.3; 2], glow(Vec3::splat(50.0)), facing(DVec3::Y * 8.0, DVec3::ZERO));
    if grows {
        let mesh = last(&mut stage);
        morph(mesh, |place| place);
        mesh.positions.fill(Vec3::ZERO);
        deformation(mesh).rest.positions.fill(Vec3::ZERO);
    }
    stage.look(DVec3::new(0.0, 1.0, 1.0), DVec3::ZERO, 0.1);
    stage.scene.cameras[0].shutter = Shutter::new(0.0, 24.0);
    stage
}

/// A light has the energy of the mean over the shutter: of what grows evenly in both directions, a third. It has
/// no area at all in the frame itself.
#[test]
fn a_shutter_over_a_growing_light_gives_the_mean() {
    for strategy in [LightStrategy::Tree, LightStrategy::Uniform, LightStrategy::Power] {
        let settings = RenderSettings { samples: 1024, depth: 1, ..settings(strategy, 3) };
        let mean = |stage: &Stage, settings: &RenderSettings| {
            let picture = Set::of(&stage.scene, &[1]).render(settings, 1);
            let all = picture.beauty().map(|rgb| f64::from(rgb.x)).sum::<f64>();
            all / f64::from(SIZE * SIZE)
        };
        let (grown, full) = (mean(&growing(true), &settings), mean(&growing(false), &settings));
        assert!((grown / full * 3.0 - 1.0).abs() < 0.02, "{strategy:?}: {grown} {full}");
        let sharp = RenderSettings { motion_blur: false, ..settings };
        assert_eq!(mean(&growing(true), &sharp), 0.0);
    }
}

/// Lamps that stand still, and a mesh light that deforms or does not.
fn street(lamps: u32, how: impl FnOnce(&mut Mesh)) -> Scene {
    let mut stage = Stage::default();
    for number in 0..lamps {
        let place = DVec3::new(f64::from(number % 40), 3.0, f64::from(number / 40));
        stage.light(LightKind::Point { intensity_cd: Vec3::ONE }, at(place));
    }
    stage.ball(0.2, 4, glow(Vec3::splat(3.0)), at(DVec3::ZERO));
    how(last(&mut stage));
    let node = stage.node(at(DVec3::X * 4.0));
    let mesh = stage.scene.meshes.len() as u32 - 1;
    stage.again(mesh, node);
    stage.scene
}

fn tree_of(scene: &Scene, frames: &[i32]) -> LightTree<AlignedBytes> {
    LightTree::open(tree_bytes(scene, frames)).unwrap()
}

/// What stands still has one tree, however many frames there are; what deforms has its leaves in each of theirs.
#[test]
fn what_deforms_is_in_the_trees_of_the_frames() {
    let scene = street(500, |mesh| morph(mesh, flame));
    // The triangles about a pole have no area at any time; those about the other one all but none.
    let own = 2 * (2 * 8 * 4 - 8);
    assert_eq!(Emitters::collect(&scene).changing_count(), own);
    let tree = tree_of(&scene, &SHOT);
    tree.verify().unwrap();
    let leaves = |kind: TreeKind| {
        let rows = tree.trees().iter().filter(|row| TreeKind::of(row) == Some(kind));
        rows.map(|row| row.leaf_count as usize).collect::<Vec<_>>()
    };
    assert_eq!(leaves(TreeKind::Still), [500]);
    // A leaf is the tree of what stands still. Two of the frames are half way between shapes.
    assert_eq!(leaves(TreeKind::Frame), [own + 1; 3]);
    assert_eq!(leaves(TreeKind::Shared), [0; 0]);
    for row in tree.lights().iter().filter(|row| tree.light_path(row).starts_with("/mesh")) {
        assert_eq!(row.class, LightRow::CHANGES);
    }
}

/// A mesh whose shapes are all alike is what it would be with that shape; so is one that gives no light.
#[test]
fn what_keeps_its_shape_costs_nothing() {
    let frames = [1, 2, 3];
    let plain = tree_bytes(&street(50, |_| ()), &frames);
    let same = street(50, |mesh| {
        morph(mesh, |_| Vec3::ZERO);
        let (times_s, values) = (vec![0.0], vec![Vec3::X]);
        let keys = Keys { times_s, values, interpolation: Default::default() };
        deformation(mesh).weights = [keys].into();
    });
    assert!(tree_bytes(&same, &frames).as_ref() == plain.as_ref());
    let mut dark = Stage { scene: street(50, |_| ()) };
    dark.ball(0.5, 4, lambert(Vec3::ONE), at(DVec3::Y));
    morph(last(&mut dark), flame);
    assert!(tree_bytes(&dark.scene, &frames).as_ref() == plain.as_ref());
}

/// A frame alone is what the shot has of it, from a file or built.
#[test]
fn a_frame_a_process_is_the_shot_in_one() {
    for scene in [flames().scene, street(30, |mesh| morph(mesh, flame)), {
        let mut stage = flames();
        stage.scene.cameras[0].shutter = Shutter::new(-0.5, 0.5);
        stage.scene
    }] {
        let emitters = Emitters::collect(&scene);
        let tree = tree_of(&scene, &SHOT);
        tree.verify().unwrap();
        let survey = pipeline::survey(&scene, &emitters, &SHOT).unwrap();
        assert_eq!(pipeline::standing(&tree, &survey), Standing::UpToDate);
        let whole = SHOT.map(|frame| tree.digest_at(frame).unwrap());
        assert!(whole.windows(2).all(|pair| pair[0] != pair[1]));
        for (frame, told) in SHOT.into_iter().zip(whole) {
            let file = TreeFile {
                tree: tree.by_reference(),
                path: Path::new("a.ltree"),
                options: &[],
                verify: true,
                mapped: None,
            };
            let mut of_file = ShotTrees::of_file(&scene, &emitters, file).unwrap();
            assert_eq!(of_file.for_frame(frame).unwrap().digest_at(frame), Ok(told));
            let mut built = ShotTrees::built(&scene, &emitters).unwrap();
            assert_eq!(built.for_frame(frame).unwrap().digest_at(frame), Ok(told));
        }
    }
}

/// A shape that changes at one key, and so in some frames, makes a tree stale, and dirties that light alone.
#[test]
fn another_shape_at_any_time_is_another_light() {
    let scene = |later: f32| street(20, |mesh| morph(mesh, |place| flame(place) * later));
    let survey = |scene: &Scene, frames: &[i32]| {
        pipeline::survey(scene, &Emitters::collect(scene), frames).unwrap()
    };
    let [one, other] = [1.0, 1.01].map(scene);
    assert_ne!(survey(&one, &FRAMES).fingerprint, survey(&other, &FRAMES).fingerprint);
    let print = |scene: &Scene, frames: &[i32]| {
        let lights = survey(scene, frames).lights;
        lights.into_iter().map(|light| (light.path, light.fingerprint)).collect::<Vec<_>>()
    };
    for (a, b) in print(&one, &FRAMES).into_iter().zip(print(&other, &FRAMES)) {
        assert_eq!(a.0, b.0);
        assert_eq!(a.1 == b.1, !a.0.starts_with("/mesh"), "{}", a.0);
    }
    // In its first frame it is what it was.
    assert_eq!(print(&one, &[1]), print(&other, &[1]));
}
