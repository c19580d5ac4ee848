//! A table of what is hidden: it changes noise, and nothing else.

use crate::stage::{Set, Stage, at, direct, facing, filter, lambert};
use crate::statistics::Estimate;
use crate::strategies::Way;
use candelabra::learn::{LearnOptions, Lesson, learn};
use candelabra::light_tree::NoSuchFrame;
use candelabra::light_tree::learned::{BESIDE, Plane, Table, ViewKeys};
use candelabra::light_tree::{Veil, WIDTH};
use candelabra::math::random::hash;
use candelabra::pipeline;
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{RenderDelegate, RenderSettings};
use candelabra::scene::{LightKind, Material};
use glam::{DVec3, Vec3};

/// A floor; a wall across it; lamps before the wall, and far stronger ones behind it.
fn walled() -> Stage {
    let mut stage = Stage::default();
    stage.quad([8.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    stage.quad([8.0, 6.0], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::X));
    for i in 0..12 {
        let (y, z) = (1.0 + 0.1 * f64::from(i % 3), f64::from(i) * 0.5 - 3.0);
        let before = LightKind::Point { intensity_cd: Vec3::splat(1.0) };
        let behind = LightKind::Point { intensity_cd: Vec3::splat(300.0) };
        stage.light(before, at((2.0, y, z)));
        stage.light(behind, at((-2.0, y, z)));
    }
    stage.look((3.9, 2.5, 0.0), (1.0, 0.0, 0.0), 0.8);
    stage
}

fn lesson(set: &Set, levels: u32, rays: u64) -> Lesson {
    let settings = RenderSettings { width: 64, height: 36, ..RenderSettings::default() };
    let camera = set.scene.cameras[0].clone();
    let delegate = RenderDelegate::new(set.scene, &set.emitters, camera, settings);
    let options = LearnOptions { levels, groups: 16, rays };
    let tree = set.tree.by_reference();
    learn::<NoSuchFrame>(&delegate, &[1], |_, work| work(&tree), &options, &mut |_| true)
        .unwrap()
        .unwrap()
}

fn render(set: &Set, table: &Table, settings: &RenderSettings) -> RenderBuffers {
    let camera = set.scene.cameras[0].clone();
    let mut delegate = RenderDelegate::new(set.scene, &set.emitters, camera, settings.clone());
    delegate.set_learned(table.view());
    delegate.render(&set.tree, 1, &()).unwrap().buffers
}

/// Cells along x with random weights for all groups.
fn random_table(set: &Set, planes: Vec<Plane>, seed: u32) -> Table {
    let groups = set.tree.groups().len() as u32;
    let of_cell = |cell: u32| {
        (0..groups).chain([BESIDE]).map(move |group| {
            let weight = |lane: usize| {
                (hash(hash(seed, cell), group.wrapping_mul(WIDTH as u32) + lane as u32) >> 24) as u8
            };
            Veil { group, weights: std::array::from_fn(weight) }
        })
    };
    let rows = (0..=planes.len() as u32).flat_map(of_cell).collect();
    Table { tree: set.tree.still_key(), planes, rows, ..Table::default() }
}

#[test]
fn walls_are_learned_and_pay() {
    let stage = walled();
    let set = stage.set();
    let Lesson { table, hidden, .. } = lesson(&set, 6, 1 << 17);
    // On the wall itself, what is behind it is below the horizon.
    assert!(hidden > 0.5, "{hidden} of the picks of a plain tree are hidden");
    for way in [Way::split(0.0), Way::split(0.5)] {
        let settings = way.settings(true, &direct(24, 256));
        let plain = Estimate::of_picture(&render(&set, &Table::default(), &settings));
        let learned = Estimate::of_picture(&render(&set, &table, &settings));
        let gain = (plain.relative_error() / learned.relative_error()).powi(2);
        println!("{way:?}: variance falls to 1 in {gain:.1}");
        assert!(plain.distance(&learned) < 5.0, "the means differ");
        assert!(gain > if way.split == 0.0 { 20.0 } else { 3.0 }, "{gain}");
    }
}

/// A tinted pane hides nothing; an opaque sheet in its place does.
#[test]
fn what_is_behind_a_pane_is_not_learned_to_be_hidden() {
    let hidden = |sheet: Material| {
        let mut stage = walled();
        stage.scene.materials[1] = sheet;
        lesson(&stage.set(), 4, 1 << 14).hidden
    };
    assert!(hidden(filter([0.1, 0.9, 0.2])) < 1e-2 && hidden(lambert([0.1, 0.9, 0.2])) > 0.3);
}

/// A table is out of date where a sheet of glass became opaque, but not where its tint changed.
#[test]
fn the_key_of_geometry_knows_panes() {
    let key = |sheet: Material| {
        let mut stage = walled();
        stage.scene.materials[1] = sheet;
        pipeline::view_keys(&stage.scene, &stage.scene.cameras[0]).geometry
    };
    let [red, blue, opaque] =
        [filter([0.9, 0.1, 0.2]), filter([0.1, 0.1, 0.9]), lambert([0.9, 0.1, 0.2])].map(key);
    assert!(red == blue && red != opaque);
}

#[test]
fn a_table_does_not_depend_on_threads() {
    let stage = walled();
    let set = stage.set();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| lesson(&set, 5, 1 << 15).table)
    };
    let one = with(1);
    assert_eq!(one, with(3));
    assert_eq!(
        one.to_bytes(ViewKeys::default(), "{}").as_ref(),
        with(2).to_bytes(ViewKeys::default(), "{}").as_ref()
    );
}

#[test]
fn where_nothing_is_hidden_nothing_is_learned() {
    let mut stage = Stage::default();
    stage.quad([8.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    for i in 0..9 {
        let kind = LightKind::Point { intensity_cd: Vec3::ONE };
        stage.light(kind, at((f64::from(i) - 4.0, 1.0, 0.0)));
    }
    stage.look((0.0, 3.0, 4.0), (0.0, 0.0, 0.0), 0.8);
    let set = stage.set();
    let Lesson { table, hidden, .. } = lesson(&set, 5, 1 << 15);
    assert!(table.view().is_none() && hidden == 0.0);
}

/// Reflected rays that find lights ask with the cell that picked: a weight that differs on the way
/// back would show as a mean that differs.
#[test]
fn random_tables_leave_the_mean() {
    let mut stage = walled();
    let glow = crate::stage::glow(Vec3::splat(4.0));
    stage.quad([1.0; 2], glow, facing((2.0, 2.0, 0.0), (2.0, 0.0, 0.0)));
    stage.light(
        LightKind::Distant { irradiance_lux: Vec3::splat(3.0), angle_rad: 0.3 },
        crate::stage::aimed((3.0, 4.0, 1.0), DVec3::ZERO),
    );
    let set = stage.set();
    let planes = vec![
        Plane { at: 1.5, width: 1.0, axis: 0 },
        Plane { at: 0.3, width: 0.5, axis: 2 },
        Plane { at: -0.2, width: 2.0, axis: 2 },
    ];
    for (seed, way) in [Way::split(0.0), Way::split(0.5), Way::split(0.9)].into_iter().enumerate() {
        let settings = way.settings(true, &direct(16, 1024));
        let settings = RenderSettings { depth: 2, ..settings };
        let plain = Estimate::of_picture(&render(&set, &Table::default(), &settings));
        let mut table = random_table(&set, planes.clone(), seed as u32);
        // A weight of next to nothing makes samples so rare and so bright that no picture tells its own error. What such
        // weights do is told without noise, in `light_tree/veils.rs`.
        table.rows.iter_mut().for_each(|row| row.weights = row.weights.map(|byte| byte.max(64)));
        let veiled =
            Estimate::of_picture(&render(&set, &table, &RenderSettings { seed: 1, ..settings }));
        let apart = plain.distance(&veiled);
        assert!(apart < 5.0, "{way:?}: {apart:.1} sigma apart");
    }
}

/// A table of another tree is not used at all.
#[test]
fn another_trees_table_changes_no_bit() {
    let stage = walled();
    let set = stage.set();
    let mut table = random_table(&set, Vec::new(), 3);
    let settings = Way::split(0.5).settings(true, &direct(8, 16));
    let plain = render(&set, &Table::default(), &settings);
    assert_ne!(
        plain.beauty().collect::<Vec<_>>(),
        render(&set, &table, &settings).beauty().collect::<Vec<_>>()
    );
    table.tree[0] ^= 1;
    assert_eq!(
        plain.beauty().collect::<Vec<_>>(),
        render(&set, &table, &settings).beauty().collect::<Vec<_>>()
    );
}
