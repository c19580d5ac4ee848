//! Lights with a range are dark beyond it, and the tree knows.

use crate::stage::{Stage, at, direct, facing, lambert};
use crate::statistics::{Pixel, pixels};
use candelabra::emitter::EmitterPlace;
use candelabra::light_tree::{Receiver, Segment};
use candelabra::scene::LightKind;
use glam::{DVec3, IVec3, Vec3};

/// Metres between neighbours of a lattice of lights, and how far each of them shines.
const APART: i32 = 4;
const RANGE: f32 = 0.7;
/// Along each edge of the lattice.
const EDGE: i32 = 8;

/// Points everywhere that light their own surroundings only; and some far away, so strong that the
/// lattice is nothing to them.
fn lattice() -> Stage {
    let mut stage = Stage::default();
    let mut point = |place: IVec3, intensity_cd| {
        let kind = LightKind::Point { intensity_cd: Vec3::splat(intensity_cd) };
        stage.light(kind, at(place.as_dvec3())).range_m = Some(RANGE);
    };
    for i in 0..EDGE.pow(3) {
        point(APART * IVec3::new(i % EDGE, i / EDGE % EDGE, i / EDGE.pow(2)), 1.0);
    }
    for i in 0..10 {
        point(IVec3::new(-500, 40 * i, 300), 1e6);
    }
    stage
}

/// Where in the lattice the light nearest to a place stands.
fn nearest(place: Vec3) -> Vec3 {
    (place / APART as f32).round() * APART as f32
}

#[test]
fn the_tree_finds_the_only_light_in_reach() {
    let stage = lattice();
    let set = stage.set();
    let tree = set.tree.at_frame(1).unwrap();
    let place_of = |emitter: u32| {
        let EmitterPlace::Light(row) = set.emitters.place_of(emitter) else {
            panic!("{emitter} is no light")
        };
        let pose = stage.scene.pose_at(0.0);
        Vec3::from(pose.world(stage.scene.lights[row as usize].node).translation)
    };
    let (mut lit, mut dark, mut passed) = (0, 0, 0);
    for i in 0..2000 {
        let t = i as f32;
        let around = Vec3::new((1.3 * t).sin(), (0.9 * t).cos(), (2.1 * t).sin());
        let lamp = Vec3::from([0, 3, 5].map(|salt| ((i * 7 + salt * i / 2) % EDGE * APART) as f32));
        let point = lamp + around.normalize() * 1.5 * RANGE * (0.01 + (0.37 * t).fract());
        assert_eq!(nearest(point), lamp);
        let receiver = Receiver { point, normal: Vec3::ZERO };
        let distance = point.distance(lamp);
        let pick = tree.sample(&receiver, f64::from(0.618_034 * t).fract());
        if distance < RANGE {
            let pick = pick.expect("one light reaches it");
            assert!((pick.probability - 1.0).abs() < 1e-9, "{}", pick.probability);
            let found = pick.light.emitter().unwrap();
            assert_eq!(place_of(found), lamp);
            assert!((tree.probability(&receiver, found) - 1.0).abs() < 1e-9);
            lit += 1;
        // Ranges are rounded up in the tree, by less than a fifth.
        } else if distance > 1.2 * RANGE {
            assert!(pick.is_none(), "{pick:?}");
            dark += 1;
        }
        // A stretch that passes by one light and ends before the next. It sees clusters as spheres,
        // so it may take one for near that is not, but finds no light in there.
        let direction = (lamp - point).normalize();
        let along = Segment { origin: point, direction, length: 2.0 };
        if let Some(pick) = tree.sample(&along, f64::from(0.618_034 * t).fract()) {
            assert_eq!(place_of(pick.light.emitter().unwrap()), lamp);
            passed += 1;
        }
    }
    assert!(lit > 500 && dark > 300 && passed > 1500, "{lit} {dark} {passed}");
}

#[test]
fn between_the_ranges_of_all_lights_it_is_black() {
    let mut stage = lattice();
    let middle = DVec3::splat(1.5 * f64::from(APART));
    let floor = facing(middle, middle + DVec3::Y);
    stage.quad([1.0; 2], lambert(Vec3::ONE), floor);
    stage.look(middle + DVec3::Y, middle, 0.5);
    let buffers = stage.render(&direct(4, 16));
    let black = |p: &Pixel| p.alpha == 1.0 && p.beauty == Vec3::ZERO;
    assert!(pixels(&buffers).iter().all(black));
}
