//! Tables of what is hidden where something moves: a door that opens over a shot, a wall that is gone. The mean
//! stays, and noise has a bound: a light is picked at least as often as without the table times its smallest
//! weight, so no second moment grows by more than one over that.

use crate::stage::{Set, Stage, at, direct, facing, lambert};
use crate::statistics::Estimate;
use candelabra::learn::{LearnOptions, learn};
use candelabra::light_tree::learned::Table;
use candelabra::light_tree::veil::decode;
use candelabra::light_tree::{NoSuchFrame, Veil};
use candelabra::measure::{ProbeOptions, Way, at_probes};
use candelabra::render::{LightStrategy, RenderDelegate, RenderSettings, Split, SplitBy};
use candelabra::scene::{Channel, Interpolation, Keys, LightKind};
use glam::{DVec3, Vec3};

/// A floor; lamps above it, and far stronger ones behind a wall across it. The wall slides away from frame 1 to
/// frame 25; with `gone` it never was there.
fn room(gone: bool) -> Stage {
    let mut stage = Stage::default();
    stage.quad([8.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    for i in 0..12 {
        let (y, z) = (1.0 + 0.1 * f64::from(i % 3), f64::from(i) * 0.5 - 3.0);
        let before = LightKind::Point { intensity_cd: Vec3::splat(1.0) };
        let behind = LightKind::Point { intensity_cd: Vec3::splat(100.0) };
        stage.light(before, at((2.0, y, z)));
        stage.light(behind, at((-2.0, y, z)));
    }
    stage.look((3.9, 2.5, 0.0), (1.0, 0.0, 0.0), 0.8);
    let wall = stage.quad([9.0, 6.0], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::X));
    let node = wall.node;
    let places = match gone {
        true => vec![Vec3::new(0.0, -50.0, 0.0); 2],
        false => vec![Vec3::ZERO, Vec3::new(0.0, 0.0, 9.0)],
    };
    let keys =
        Keys { times_s: vec![0.0, 1.0], values: places, interpolation: Interpolation::Linear };
    stage.scene.nodes[node as usize].channels = vec![Channel::Translation(keys)];
    stage
}

fn delegate<'a>(set: &'a Set, settings: &RenderSettings) -> RenderDelegate<'a> {
    let camera = set.scene.cameras[0].clone();
    RenderDelegate::new(set.scene, &set.emitters, camera, settings.clone())
}

fn learned(set: &Set, frames: &[i32]) -> Table {
    let settings = RenderSettings { width: 64, height: 36, ..RenderSettings::default() };
    let options = LearnOptions { levels: 6, groups: 16, rays: 1 << 17 };
    let tree = set.tree.by_reference();
    let go_on = &mut |_| true;
    learn::<NoSuchFrame>(&delegate(set, &settings), frames, |_, work| work(&tree), &options, go_on)
        .unwrap()
        .unwrap()
        .table
}

/// The smallest weight of a table.
fn smallest(table: &Table) -> f64 {
    let known = table.rows.iter().filter(|row| row.group != Veil::NONE.group);
    known.flat_map(|row| row.weights).map(|byte| f64::from(decode(byte))).fold(1.0, f64::min)
}

/// Exact relative variances in a frame, without the table and with it: of one light a point, then with knob 0.5.
fn variances(set: &Set, table: &Table, frame: i32) -> [[f64; 2]; 2] {
    let settings = RenderSettings { width: 64, height: 36, depth: 1, ..RenderSettings::default() };
    let mut delegate = delegate(set, &settings);
    delegate.set_learned(table.view());
    let way = |knob: f32| Way {
        strategy: LightStrategy::Tree,
        split: Split::Fixed(knob),
        split_by: SplitBy::Variance,
    };
    let options = ProbeOptions {
        probes: 400,
        visibility: true,
        ways: vec![way(0.0), way(0.5)],
        grey: None,
        seed: 3,
        oracles: Vec::new(),
    };
    let report = at_probes(&delegate, &set.tree, frame, &options).unwrap();
    let [a, b, with_a, with_b] = report.strategies.as_slice() else { panic!("{report:?}") };
    [[a.variance, with_a.variance], [b.variance, with_b.variance]]
}

/// The bound on a relative variance that the smallest weight gives: that on second moments, where the square of
/// the mean is at most 1.
fn bound(plain: f64, table: &Table) -> f64 {
    (plain + 1.0) / smallest(table)
}

#[test]
fn a_door_that_opens_has_graceful_weights() {
    let stage = room(false);
    let set = stage.set();
    let table = learned(&set, &[1, 9, 17, 25]);
    let middling = |row: &Veil| row.weights.iter().any(|&w| (0.3..0.95).contains(&decode(w)));
    let between = table.rows.iter().filter(|row| middling(row)).count();
    assert!(between > table.rows.len() / 4, "{between} of {} rows are graceful", table.rows.len());
    let mut sums = [[0.0; 2]; 2];
    for frame in [1, 5, 9, 13, 17, 21, 25] {
        let found = variances(&set, &table, frame);
        println!("frame {frame}: {found:.4?}");
        for (sum, [plain, with]) in sums.iter_mut().zip(found) {
            assert!(with <= bound(plain, &table), "frame {frame}: {with}, and {plain} without");
            *sum = [sum[0] + plain, sum[1] + with];
        }
        let settings = direct(24, 128);
        let plain = delegate(&set, &settings).render(&set.tree, frame, &()).unwrap();
        let other = RenderSettings { seed: 1, ..settings };
        let mut with = delegate(&set, &other);
        with.set_learned(table.view());
        let with = with.render(&set.tree, frame, &()).unwrap();
        let [plain, with] = [&plain, &with].map(|done| Estimate::of_picture(&done.buffers));
        let apart = plain.distance(&with);
        assert!(apart < 5.0, "frame {frame}: the means are {apart:.1} sigma apart");
    }
    println!("all frames: {sums:.4?}");
    for [plain, with] in sums {
        assert!(with < plain, "{with} over the whole shot, and {plain} without");
    }
}

/// The worst that can be: what was learned behind a wall, and the wall is gone.
#[test]
fn a_table_of_other_geometry_costs_no_more_than_its_smallest_weight_tells() {
    let (walled, open) = (room(false), room(true));
    let [walled, open] = [walled.set(), open.set()];
    let table = learned(&walled, &[1]);
    assert_eq!(table.tree, open.tree.still_key(), "the lights are the same");
    let smallest = smallest(&table);
    assert!(smallest < 0.1, "{smallest}: the wall has taught something");
    let found = variances(&open, &table, 1);
    println!("smallest weight {smallest:.5}: {found:.4?}");
    for [plain, with] in found {
        assert!(with > plain, "the table misleads: {with}, and {plain} without");
        assert!(with <= bound(plain, &table), "{with}, and {plain} without");
    }
}
