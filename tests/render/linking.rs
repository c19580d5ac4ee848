//! Which lights light a surface, and what casts shadows from them.

use crate::closed_forms::{assert_dark, assert_irradiance, of_sphere, receiver};
use crate::moving::{FRAMES, carousel};
use crate::rooms::{self, Room};
use crate::stage::{Set, Stage, aimed, at, direct, facing, glow, lambert, tree_bytes};
use crate::statistics::pixels;
use crate::strategies::{Way, assert_agreement, disagreement, every_way, render};
use candelabra::emitter::{Emitters, LightSource};
use candelabra::light_tree::{Picked, ReceiverClass};
use candelabra::pipeline::{self, force_lights};
use candelabra::render::links::{FrameLinks, ShotLinks};
use candelabra::render::{LightStrategy, RenderSettings};
use candelabra::scene::{LightKind, LinkRows, Linking, Links, Material, Medium, Membership, Scene};
use glam::{DVec3, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A light of a scene, by its row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lamp {
    Mesh(u32),
    Light(u32),
}

/// What a light is kept from, by rows of instances. `None` is the fog.
#[derive(Clone, Debug)]
pub enum Kept {
    Lighting(Lamp, Vec<Option<u32>>),
    Shadows(Lamp, Vec<Option<u32>>),
}

/// Links the lights of a scene to everything but what they are kept from.
pub fn link(scene: &mut Scene, kept: &[Kept]) {
    let mut rows = LinkRows::default();
    let mut outside: BTreeMap<Option<u32>, Vec<u32>> = BTreeMap::new();
    let mut links: BTreeMap<(bool, u32), Links> = BTreeMap::new();
    for (set, kept) in (0..).zip(kept) {
        let (lamp, from, is_light) = match kept {
            Kept::Lighting(lamp, from) => (lamp, from, true),
            Kept::Shadows(lamp, from) => (lamp, from, false),
        };
        let key = match *lamp {
            Lamp::Mesh(row) => (true, row),
            Lamp::Light(row) => (false, row),
        };
        let own = links.entry(key).or_default();
        *(if is_light { &mut own.light } else { &mut own.shadow }) = Some(set);
        from.iter().for_each(|&prim| outside.entry(prim).or_default().push(set));
    }
    for (prim, mut sets) in outside {
        sets.dedup();
        let row = Some(rows.memberships.len() as u32);
        rows.memberships.push(Membership::Outside(sets.into()));
        match prim {
            Some(instance) => links.entry((true, instance)).or_default().membership = row,
            None => rows.medium = row,
        }
    }
    for ((is_mesh, row), own) in links {
        let table = if is_mesh { &mut rows.instances } else { &mut rows.lights };
        table.insert(row, own);
    }
    scene.linking = Linking::new(rows);
}

const RADIANCE: f64 = 3.0;

/// A light of some kind that shines down on the origin, and the irradiance that it gives there.
pub fn lamp(stage: &mut Stage, kind: usize) -> (Lamp, f64) {
    let nits = Vec3::splat(RADIANCE as f32);
    let above = DVec3::new(0.0, 2.0, 0.0);
    let light = |stage: &Stage| Lamp::Light(stage.scene.lights.len() as u32 - 1);
    match kind {
        0 => {
            stage.light(LightKind::Point { intensity_cd: nits }, at(above));
            (light(stage), RADIANCE / 4.0)
        }
        1 => {
            let kind = LightKind::Sphere { radiance_nits: nits, radius: 0.7, shaping: None };
            stage.light(kind, at(above));
            (light(stage), RADIANCE * of_sphere(above, f64::from(0.7f32), DVec3::Y))
        }
        2 => {
            let kind = LightKind::Distant { irradiance_lux: nits, angle_rad: 0.3 };
            stage.light(kind, aimed(DVec3::ZERO, -DVec3::Y));
            (light(stage), RADIANCE)
        }
        3 => {
            let kind = LightKind::Distant { irradiance_lux: nits, angle_rad: 0.0 };
            stage.light(kind, aimed(DVec3::ZERO, -DVec3::Y));
            (light(stage), RADIANCE)
        }
        4 => {
            let kind = LightKind::Dome { radiance_nits: nits, texture: None };
            stage.light(kind, at(DVec3::ZERO));
            (light(stage), RADIANCE * PI)
        }
        _ => {
            stage.disk(1.5, glow(nits), facing(above, DVec3::ZERO));
            let row = stage.scene.instances.len() as u32 - 1;
            (Lamp::Mesh(row), RADIANCE * PI * 1.5 * 1.5 / (1.5 * 1.5 + 4.0))
        }
    }
}

pub const KINDS: usize = 6;

/// Lamps cast no shadows, mesh lights from a row on included.
pub fn hide_no_light(stage: &mut Stage, from: usize) {
    stage.scene.instances.iter_mut().skip(from).for_each(|lamp| lamp.visibility.shadows = false);
    stage.scene.lights.iter_mut().for_each(|lamp| lamp.visibility.shadows = false);
}

/// A floor lit by one of two lamps, whatever these are.
#[test]
fn a_floor_is_lit_by_one_of_two_lamps() {
    for kind in 0..KINDS {
        let other = (kind + 1) % KINDS;
        for linked in [false, true] {
            let mut stage = receiver(DVec3::Y);
            let (first, lux) = lamp(&mut stage, kind);
            let (_, other_lux) = lamp(&mut stage, other);
            hide_no_light(&mut stage, 1);
            if linked {
                link(&mut stage.scene, &[Kept::Lighting(first, vec![Some(0)])]);
            }
            let expected = if linked { other_lux } else { lux + other_lux };
            assert_irradiance(&format!("lamps {kind} and {other}, {linked}"), &stage, expected);
        }
    }
}

/// However lights are picked, and forced or not.
#[test]
fn what_nothing_lights_is_black() {
    for kind in 0..KINDS {
        for forced in [false, true] {
            let mut stage = receiver(DVec3::Y);
            let (lamp, _) = lamp(&mut stage, kind);
            stage.scene.instances.iter_mut().skip(1).for_each(|lamp| lamp.forced = forced);
            stage.scene.lights.iter_mut().for_each(|lamp| lamp.forced = forced);
            link(&mut stage.scene, &[Kept::Lighting(lamp, vec![Some(0)])]);
            assert_dark(&format!("what lamp {kind} does not light, forced {forced}"), &stage);
            for (way, mis) in every_way() {
                let buffers = stage.render(&way.settings(mis, &direct(2, 16)));
                assert!(
                    buffers.beauty().all(|beauty| beauty == Vec3::ZERO),
                    "{kind} {way:?} {mis}"
                );
            }
        }
    }
}

/// A card between lamp and floor casts no shadow for that lamp, and does for another.
#[test]
fn a_blocker_may_cast_no_shadow_from_one_lamp() {
    for kind in 0..KINDS {
        let mut stage = receiver(DVec3::Y);
        let (own, lux) = lamp(&mut stage, kind);
        let card = stage.scene.instances.len() as u32;
        stage.quad([400.0; 2], lambert(Vec3::ZERO), facing(DVec3::Y, DVec3::ZERO));
        assert_dark(&format!("what is below a card, lamp {kind}"), &stage);
        link(&mut stage.scene, &[Kept::Shadows(own, vec![Some(card)])]);
        assert_irradiance(&format!("below a card, lamp {kind}"), &stage, lux);
        // Another lamp, of any kind, is still behind the card.
        let (_, _) = lamp(&mut stage, (kind + 2) % KINDS);
        hide_no_light(&mut stage, card as usize + 1);
        assert_irradiance(&format!("below a card, lamp {kind} of two"), &stage, lux);
        // A second card, which does cast shadows.
        let place = DVec3::new(0.0, 0.9, 0.0);
        stage.quad([400.0; 2], lambert(Vec3::ZERO), facing(place, DVec3::ZERO));
        assert_dark(&format!("what is below two cards, lamp {kind}"), &stage);
    }
}

/// The shape of a lamp may be kept from casting another lamp's shadow.
#[test]
fn a_sphere_casts_shadows_as_it_is_linked() {
    let mut stage = receiver(DVec3::Y);
    let intensity_cd = Vec3::splat(3.0);
    stage.light(LightKind::Point { intensity_cd }, at(DVec3::Y * 2.0));
    let ball = LightKind::Sphere { radiance_nits: Vec3::splat(0.5), radius: 0.2, shaping: None };
    stage.light(ball, at(DVec3::Y));
    let own = 0.5 * of_sphere(DVec3::Y, f64::from(0.2f32), DVec3::Y);
    assert_irradiance("a point behind a sphere", &stage, own);
    let links = |membership, shadow| Links { membership, light: None, shadow };
    stage.scene.linking = Linking::new(LinkRows {
        memberships: vec![Membership::Outside([0].into())],
        lights: [(0, links(None, Some(0))), (1, links(Some(0), None))].into(),
        ..LinkRows::default()
    });
    assert_irradiance("a point that the sphere does not hide", &stage, own + 3.0 / 4.0);
}

/// The eye sees a lamp that lights nothing; so does no reflected ray.
#[test]
fn the_eye_sees_what_is_not_linked_and_a_mirror_does_not() {
    let mirror =
        Material { metallic: 1.0, roughness: 0.0, base_color: Vec3::ONE, ..Default::default() };
    let seen = |linked: bool| {
        let mut stage = Stage::default();
        stage.quad([4.0; 2], mirror.clone(), facing(DVec3::ZERO, DVec3::Z));
        stage.disk(0.4, glow(Vec3::splat(2.0)), at(DVec3::new(0.0, 0.0, 2.0)));
        // The disk faces away from the mirror: a second one faces it.
        let beside = DVec3::new(1.0, 0.0, 1.9);
        stage.disk(0.4, glow(Vec3::splat(2.0)), facing(beside, DVec3::X));
        stage.look(DVec3::new(0.0, 0.0, 6.0), DVec3::ZERO, 0.6);
        if linked {
            let kept = [1, 2].map(|row| Kept::Lighting(Lamp::Mesh(row), vec![Some(0)]));
            link(&mut stage.scene, &kept);
        }
        let settings = RenderSettings { depth: 2, ..direct(32, 64) };
        stage.render(&settings).beauty().map(|beauty| beauty.x).collect::<Vec<f32>>()
    };
    let (free, linked) = (seen(false), seen(true));
    let middle = 16 * 32 + 16;
    assert_eq!((free[middle], linked[middle]), (2.0, 2.0));
    let sum = |seen: &[f32]| seen.iter().sum::<f32>();
    let direct = linked.iter().filter(|&&x| x > 0.0);
    assert!(direct.clone().all(|&x| x <= 2.0 + 1e-5), "the mirror adds light");
    assert!(sum(&free) > 1.05 * sum(&linked), "the mirror never showed the lamp");
}

/// Every light of a room that has all kinds, kept from one thing or another.
fn kept_in(scene: &Scene, number: usize) -> Vec<Kept> {
    let things: Vec<Option<u32>> = (0..3).map(Some).collect();
    let some = |i: usize| -> Vec<Option<u32>> {
        things
            .iter()
            .enumerate()
            .filter(|(k, _)| (i * 5 + number) >> k & 1 == 1)
            .map(|(_, t)| *t)
            .collect()
    };
    let meshes = (0..scene.instances.len() as u32)
        .filter(|&row| scene.peak_rgb_of_instance(row).max_element() > 0.0)
        .map(Lamp::Mesh);
    let lamps = meshes.chain((0..scene.lights.len() as u32).map(Lamp::Light));
    let mut kept = Vec::new();
    for (i, lamp) in lamps.enumerate() {
        match (i + number) % 4 {
            0 => kept.push(Kept::Lighting(lamp, some(i + 1))),
            1 => kept.push(Kept::Shadows(lamp, some(i + 2))),
            2 => kept.extend([Kept::Lighting(lamp, some(i)), Kept::Shadows(lamp, some(i + 3))]),
            _ => {}
        }
    }
    kept
}

/// The same picture from every way of picking lights, on a dull surface and on a shining one.
#[test]
fn every_way_gives_the_same_picture() {
    let mut stage = rooms::lambert_room();
    let kept = kept_in(&stage.scene, 0);
    link(&mut stage.scene, &kept);
    assert!(stage.scene.linking.sets() > 3 && stage.scene.linking.memberships().len() >= 3);
    let room = Room { name: "a linked room".into(), stage, depth: 2 };
    assert_agreement(&room, &every_way());
    let varnish = rooms::of_every_material().into_iter().find(|room| room.name == "varnish");
    let mut stage = varnish.unwrap().stage;
    rooms::all_lights(&mut stage);
    let kept = kept_in(&stage.scene, 1);
    link(&mut stage.scene, &kept);
    let room = Room { name: "a linked room that shines".into(), stage, depth: 2 };
    let ways: Vec<_> = every_way().into_iter().step_by(3).collect();
    assert_agreement(&room, &ways);
}

/// Lights that move, and forced ones.
#[test]
fn moving_and_forced_lights_are_linked() {
    const FRAME: i32 = 13;
    let mut stage = carousel();
    rooms::all_lights(&mut stage);
    let kept = kept_in(&stage.scene, 2);
    link(&mut stage.scene, &kept);
    let picture = |scene: &Scene, way: Way, mis: bool, seed: u32| {
        let set = Set::of(scene, &FRAMES);
        let settings = RenderSettings { seed, ..direct(16, 64) };
        render(&set, way.settings(mis, &settings), FRAME)
    };
    let oracle = picture(&stage.scene, Way::of(LightStrategy::Uniform), false, 0);
    for (seed, strategy) in [(10, LightStrategy::Tree), (40, LightStrategy::Exhaustive)] {
        let linked = picture(&stage.scene, Way::of(strategy), true, seed);
        assert_eq!(disagreement(&oracle, &linked), None, "{strategy:?}");
    }
    let paths: Vec<String> = (0..stage.scene.lights.len())
        .step_by(2)
        .map(|row| stage.scene.light_path(row).to_owned())
        .collect();
    force_lights(&mut stage.scene, &paths).unwrap();
    for (seed, way) in [(20, Way::of(LightStrategy::Tree)), (30, Way::split(0.5))] {
        let forced = picture(&stage.scene, way, true, seed);
        assert_eq!(disagreement(&oracle, &forced), None, "{way:?}");
    }
}

/// Fog is lit as its prim is linked.
#[test]
fn fog_is_lit_as_it_is_linked() {
    let seen = |kept: &[Kept]| {
        let mut stage = Stage::default();
        let kind = LightKind::Point { intensity_cd: Vec3::splat(5.0) };
        stage.light(kind, at(DVec3::new(1.0, 0.5, 0.0)));
        stage.quad([0.1; 2], lambert(Vec3::ONE), at(DVec3::new(0.0, 0.0, -1.0)));
        stage.look(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.5);
        stage.scene.medium = Some(Medium {
            scattering: Vec3::splat(0.2),
            absorption: Vec3::ZERO,
            anisotropy: 0.0,
            region: None,
        });
        link(&mut stage.scene, kept);
        stage.render(&direct(12, 64)).beauty().collect::<Vec<Vec3>>()
    };
    let corner = |seen: &[Vec3]| seen[0].x;
    let free = seen(&[]);
    assert!(corner(&free) > 0.0);
    // The surface alone is kept from it.
    let card = seen(&[Kept::Lighting(Lamp::Light(0), vec![Some(0)])]);
    assert_eq!(corner(&card), corner(&free));
    let middle = 6 * 12 + 6;
    assert!(card[middle].x < 0.9 * free[middle].x);
    // The fog alone is.
    let fog = seen(&[Kept::Lighting(Lamp::Light(0), vec![None])]);
    assert_eq!(corner(&fog), 0.0);
    assert!(fog[middle].x > 0.0);
}

/// Links that say nothing change no byte, nor do those of lights that light what is there.
#[test]
fn a_scene_without_links_keeps_its_bytes() {
    let mut stage = carousel();
    rooms::all_lights(&mut stage);
    let settings = RenderSettings { depth: 2, ..direct(16, 4) };
    let bytes = |scene: &Scene| {
        let set = Set::of(scene, &FRAMES);
        let picture = set.render(&settings, 13);
        (tree_bytes(scene, &FRAMES).as_ref().to_vec(), pixels(&picture))
    };
    let before = bytes(&stage.scene);
    let lights = stage.scene.lights.len() as u32;
    let kept: Vec<Kept> = (0..lights).map(|row| Kept::Lighting(Lamp::Light(row), vec![])).collect();
    link(&mut stage.scene, &kept);
    assert!(stage.scene.linking.is_empty());
    let after = bytes(&stage.scene);
    assert!(before == after);
}

#[test]
fn threads_do_not_show_in_linked_pictures() {
    let mut stage = carousel();
    rooms::all_lights(&mut stage);
    let kept = kept_in(&stage.scene, 1);
    link(&mut stage.scene, &kept);
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let set = Set::of(&stage.scene, &FRAMES);
            let settings = RenderSettings { depth: 3, ..direct(24, 4) };
            (
                tree_bytes(&stage.scene, &FRAMES).as_ref().to_vec(),
                pixels(&set.render(&settings, 13)),
            )
        })
    };
    let alone = bytes(1);
    for threads in [2, 5] {
        assert!(bytes(threads) == alone, "{threads} threads");
    }
}

/// Geometry that the same lights light is one class, and what all lights light is none.
#[test]
fn equal_sets_share_one_mask() {
    let mut stage = Stage::default();
    for i in 0..300 {
        stage.quad([0.1; 2], lambert(Vec3::ONE), at(DVec3::X * f64::from(i)));
        let kind = LightKind::Point { intensity_cd: Vec3::ONE };
        stage.light(kind, at(DVec3::new(f64::from(i), 1.0, 0.0)));
    }
    // Light i is kept from all surfaces i, i + 3, ...: three sets. Its shadows are kept from one more surface each.
    let kept: Vec<Kept> = (0..300u32)
        .flat_map(|i| {
            let from = (i % 3..300).step_by(3).filter(|k| *k >= 3).map(Some).collect();
            let lamp = Lamp::Light(i);
            [Kept::Lighting(lamp, from), Kept::Shadows(lamp, vec![Some(i)])]
        })
        .collect();
    link(&mut stage.scene, &kept);
    assert_eq!(stage.scene.linking.sets(), 303);
    let set = stage.set();
    assert_eq!((set.emitters.link_sets().len(), set.tree.link_numbers()), (3, 4));
    let links = ShotLinks::new(&stage.scene, &set.emitters).unwrap();
    assert_eq!(links.lit_by().classes(), 3);
    let frame = FrameLinks { shot: &links, infinite: &[] };
    for instance in 0..300 {
        let (_, class) = frame.of_instance(instance);
        assert_eq!(class == ReceiverClass::ALL, instance < 3);
        for emitter in 0..300 {
            let LightSource::Light(row) = set.emitters.light_of(emitter).source else { panic!() };
            let lit = instance < 3 || row % 3 != instance % 3;
            assert_eq!(frame.lights(class, Picked::Emitter(emitter)), lit);
        }
    }
}

/// A tree depends on which lights light the same, and not on what that is.
#[test]
fn a_tree_is_stale_if_a_light_is_linked_otherwise() {
    let mut stage = rooms::lambert_room();
    let lights = stage.scene.lights.len() as u32;
    let near = (0..lights).filter(|&row| !stage.scene.lights[row as usize].kind.is_infinite());
    let near: Vec<u32> = near.collect();
    let fingerprint = |scene: &mut Scene, kept: &[Kept]| {
        link(scene, kept);
        let emitters = Emitters::collect(scene);
        pipeline::survey(scene, &emitters, &[1]).unwrap().fingerprint
    };
    let lighting =
        |light: usize, from: u32| Kept::Lighting(Lamp::Light(near[light]), vec![Some(from)]);
    let free = fingerprint(&mut stage.scene, &[]);
    let one = fingerprint(&mut stage.scene, &[lighting(0, 0)]);
    assert_ne!(free, one);
    assert_eq!(one, fingerprint(&mut stage.scene, &[lighting(0, 1)]));
    assert_ne!(one, fingerprint(&mut stage.scene, &[lighting(1, 0)]));
    let both = fingerprint(&mut stage.scene, &[lighting(0, 0), lighting(1, 0)]);
    assert_ne!(both, fingerprint(&mut stage.scene, &[lighting(0, 0), lighting(1, 1)]));
    // Of shadows it knows nothing.
    let shadows = Kept::Shadows(Lamp::Light(near[0]), vec![Some(0)]);
    assert_eq!(free, fingerprint(&mut stage.scene, &[shadows]));
}
