//! What holds of every comparison.

use crate::street::{SPHERE, diff, node, only, put, street, tree_of, with_camera};
use candelabra::diff::{Change, Diff, DiffOptions, Difference, ProbePlaces, Side, Verb, compare};
use candelabra::scene::{Channel, Interpolation, Keys, Light, LightKind, Scene, Trs};
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use tempfile::TempDir;

/// An edit of a row of lights.
#[derive(Clone, Debug)]
enum Edit {
    Move(usize, f64),
    Strengthen(usize, f32),
    Tint(usize),
    Remove(usize),
    Add(f64),
}

fn edit() -> impl Strategy<Value = Edit> {
    prop_oneof![
        (0usize..12, -2f64..2.0).prop_map(|(row, by)| Edit::Move(row, by)),
        (0usize..12, 0.1f32..10.0).prop_map(|(row, by)| Edit::Strengthen(row, by)),
        (0usize..12).prop_map(Edit::Tint),
        (0usize..12).prop_map(Edit::Remove),
        (-9f64..9.0).prop_map(Edit::Add),
    ]
}

/// Twelve lamps in a row, edited.
fn row(edits: &[Edit]) -> Scene {
    let mut scene = Scene { source: "row.gltf".into(), ..Scene::default() };
    let add = |scene: &mut Scene, name: String, x: f64, strength: f32| {
        let node = put(scene, &name, [x, 3.0, 0.0]);
        let kind = LightKind::Point { intensity_cd: Vec3::splat(strength) };
        scene.lights.push(Light {
            node,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Default::default(),
        });
    };
    (0..12).for_each(|i| add(&mut scene, format!("lamp_{i}"), f64::from(i), 5.0 + i as f32));
    let intensity = |scene: &mut Scene, row: usize, change: &dyn Fn(Vec3) -> Vec3| {
        let LightKind::Point { intensity_cd } = &mut scene.lights[row].kind else { panic!() };
        *intensity_cd = change(*intensity_cd);
    };
    let mut removed = Vec::new();
    for (number, edit) in edits.iter().enumerate() {
        match *edit {
            Edit::Move(row, by) => {
                let lamp = node(&mut scene, &format!("lamp_{row}"));
                let candelabra::scene::Trs::Parts { translation, .. } = &mut lamp.local else {
                    panic!()
                };
                translation.z += by;
            }
            Edit::Strengthen(row, by) => intensity(&mut scene, row, &|rgb| rgb * by),
            Edit::Tint(row) => intensity(&mut scene, row, &|rgb| rgb * Vec3::new(1.0, 0.5, 0.2)),
            Edit::Remove(row) => removed.push(format!("/street/lamp_{row}")),
            Edit::Add(x) => add(&mut scene, format!("new_{number}"), x, 3.0),
        }
    }
    let nodes = scene.nodes.iter().map(|node| node.path.clone()).collect::<Vec<_>>();
    scene.lights.retain(|light| !removed.contains(&nodes[light.node as usize].to_string()));
    scene
}

/// The same lights in another order of tables.
fn reversed(mut scene: Scene) -> Scene {
    scene.lights.reverse();
    scene
}

/// A change seen from the other side.
fn mirrored(change: &Change) -> Change {
    let verb = match change.verb {
        Verb::Added => Verb::Removed,
        Verb::Removed => Verb::Added,
        verb => verb,
    };
    let differences = change.differences.iter().map(|difference| match *difference {
        Difference::Transform { moved_m, turned_deg, scaled } => {
            Difference::Transform { moved_m, turned_deg, scaled: 1.0 / scaled }
        }
        Difference::Energy { before, after, stops } => Difference::Energy {
            before: after,
            after: before,
            // Not the same ratio to the last bit.
            stops: stops.map(|stops| -(stops * 1e3).round() / 1e3),
        },
        Difference::Color { before, after } => Difference::Color { before: after, after: before },
        ref other => panic!("no edit does that: {other:?}"),
    });
    Change {
        verb,
        share: change.share,
        before: change.after.clone(),
        after: change.before.clone(),
        differences: differences.collect(),
    }
}

fn twice_mirrored(change: &Change) -> Change {
    mirrored(&mirrored(change))
}

fn by_path(diff: &Diff, of: impl Fn(&Change) -> Change) -> Vec<Change> {
    let mut changes: Vec<Change> = diff.changes.iter().map(of).collect();
    changes.sort_by(|a, b| a.path().cmp(b.path()));
    changes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_version_differs_from_itself_in_nothing(edits in prop::collection::vec(edit(), 0..5)) {
        let same = diff(row(&edits), reversed(row(&edits)));
        prop_assert!(same.is_same() && same.changes.is_empty());
        prop_assert_eq!(same.totals.unchanged, same.totals.after.lights);
    }

    #[test]
    fn the_other_way_round_is_the_mirror_image(edits in prop::collection::vec(edit(), 1..6)) {
        let there = diff(row(&[]), row(&edits));
        let back = diff(row(&edits), row(&[]));
        prop_assert_eq!(by_path(&there, mirrored), by_path(&back, twice_mirrored));
        let moved = [&there, &back].map(|d| d.picking.as_ref().map_or(0.0, |p| p.mean));
        prop_assert!((moved[0] - moved[1]).abs() < 1e-12, "{:?}", moved);
        prop_assert_eq!((there.totals.added, there.totals.removed), (back.totals.removed, back.totals.added));
    }

    #[test]
    fn the_order_of_prims_does_not_matter(edits in prop::collection::vec(edit(), 0..6)) {
        let json = |diff: Diff| serde_json::to_string(&diff).unwrap();
        let one = json(diff(row(&[]), row(&edits)));
        prop_assert_eq!(json(diff(reversed(row(&[])), reversed(row(&edits)))), one);
    }

    #[test]
    fn what_matters_most_comes_first(edits in prop::collection::vec(edit(), 1..6)) {
        let found = diff(row(&[]), row(&edits));
        prop_assert!(found.changes.is_sorted_by(|a, b| a.share >= b.share));
        prop_assert!(found.changes.iter().all(|change| (0.0..=1.0).contains(&change.share)));
        let totals = &found.totals;
        let counted = totals.added + totals.removed + totals.dirtied + totals.renamed;
        prop_assert_eq!(counted, found.changes.len());
    }
}

#[test]
fn picks_of_disjoint_lights_have_nothing_in_common() {
    let (mut before, mut after) = (row(&[]), row(&[]));
    before.lights.truncate(4);
    after.lights.drain(..4);
    let picking = diff(before, after).picking.unwrap();
    assert!((picking.mean - 1.0).abs() < 1e-12 && (picking.worst - 1.0).abs() < 1e-12);
    assert_eq!(picking.places, ProbePlaces::BoxAroundLights);
}

#[test]
fn the_distance_between_picks_is_what_it_is_defined_to_be() {
    // Two lamps in one place, so that every probe sees them alike: 1 to 1 becomes 1 to 3.
    let lamps = |second: f32| {
        let mut scene = row(&[]);
        scene.lights.truncate(2);
        for (lamp, strength) in [("lamp_0", 10.0), ("lamp_1", second)] {
            let row = if lamp == "lamp_0" { 0 } else { 1 };
            node(&mut scene, lamp).local = crate::street::at([0.0; 3], Default::default(), 1.0);
            scene.lights[row].kind = LightKind::Point { intensity_cd: Vec3::splat(strength) };
        }
        scene
    };
    let found = diff(lamps(10.0), lamps(30.0));
    let picking = found.picking.unwrap();
    assert!((picking.mean - 0.25).abs() < 1e-6 && (picking.worst - 0.25).abs() < 1e-6);
    // Half of the energy after is new, which is more than the share of picks that moved.
    assert!((found.changes[0].share - 0.5).abs() < 1e-6, "{}", found.changes[0].share);
}

#[test]
fn no_lights_at_all_are_the_same() {
    let dark = || Scene { source: "dark.gltf".into(), ..Scene::default() };
    assert!(diff(dark(), dark()).is_same());
    let lit = diff(dark(), row(&[]));
    assert_eq!((lit.totals.added, lit.picking.as_ref().unwrap().worst), (12, 1.0));
    assert_eq!(diff(row(&[]), dark()).totals.removed, 12);
}

#[test]
fn probes_are_where_the_camera_sees_if_there_is_one() {
    let mut after = with_camera(street());
    let LightKind::Point { intensity_cd } = &mut after.lights[0].kind else { panic!() };
    *intensity_cd *= 3.0;
    let picking = diff(street(), after).picking.unwrap();
    assert_eq!(picking.places, ProbePlaces::CameraPaths);
    assert!(picking.mean > 0.0 && picking.worst >= picking.mean && picking.probes > 0);
}

#[test]
fn heat_is_where_light_changed() {
    let options = DiffOptions { unchanged: true, heat: true };
    let compare = |after| {
        let sides = [with_camera(street()), after].map(Side::of_scene);
        compare(&sides[0], &sides[1], &options).unwrap()
    };
    let same = compare(with_camera(street()));
    let heat = same.heat.unwrap();
    assert_eq!(heat.cells.len(), (heat.width * heat.height) as usize);
    assert_eq!((heat.width, heat.height, heat.shadows), (96, 64, true));
    let lit = heat.cells.iter().flatten().filter(|cell| cell.after_nits > 0.0).count();
    assert!(lit > 50 && heat.cells.iter().flatten().all(|cell| cell.stops() == 0.0));
    assert_eq!(same.unchanged.len(), 6, "all lights but the sun");

    // Everything twice as strong: one stop wherever there is light.
    let mut brighter = with_camera(street());
    brighter.materials.iter_mut().for_each(|material| material.emission_nits *= 2.0);
    for light in &mut brighter.lights {
        match &mut light.kind {
            LightKind::Point { intensity_cd: rgb }
            | LightKind::Spot { intensity_cd: rgb, .. }
            | LightKind::Sphere { radiance_nits: rgb, .. }
            | LightKind::Distant { irradiance_lux: rgb, .. }
            | LightKind::Dome { radiance_nits: rgb, .. } => *rgb *= 2.0,
        }
    }
    let brighter = compare(brighter);
    let cells = brighter.heat.unwrap().cells;
    let lit = cells.iter().flatten().filter(|cell| cell.before_nits > 0.0);
    assert!(lit.clone().all(|cell| (cell.stops() - 1.0).abs() < 1e-4) && lit.count() > 50);
    assert!(brighter.unchanged.is_empty());
}

#[test]
fn a_tree_and_its_scene_are_the_same_and_two_trees_as_two_scenes() {
    let folder = TempDir::new().unwrap();
    let (before, after) = (row(&[]), row(&[Edit::Move(3, 1.0), Edit::Remove(5), Edit::Add(2.0)]));
    let trees = [tree_of(&before, &folder, "a.ltree"), tree_of(&after, &folder, "b.ltree")];
    let compare = |a: &Side, b: &Side| compare(a, b, &DiffOptions::default()).unwrap();
    let scenes = [before, after].map(Side::of_scene);
    assert!(compare(&trees[0], &scenes[0]).is_same() && compare(&scenes[1], &trees[1]).is_same());
    let told = |diff: &Diff| {
        let told =
            diff.changes.iter().map(|c| (c.verb, c.path().to_owned(), c.differences.clone()));
        told.collect::<Vec<_>>()
    };
    let of_scenes = told(&compare(&scenes[0], &scenes[1]));
    assert_eq!(told(&compare(&trees[0], &trees[1])), of_scenes);
    assert_eq!(told(&compare(&trees[0], &scenes[1])), of_scenes);
    assert_eq!(told(&compare(&scenes[0], &trees[1])), of_scenes);

    // Of trees in trees, of frames, of forced lights too.
    let shot = |to: f32| {
        let mut scene = street();
        for name in ["panel", "bulb_1"] {
            let values = vec![Vec3::ZERO, Vec3::new(to, 2.0, 0.0)];
            let (times_s, interpolation) = (vec![0.0, 0.2], Interpolation::Linear);
            let keys = Keys { times_s, values, interpolation };
            node(&mut scene, name).channels.push(Channel::Translation(keys));
        }
        scene.lights[SPHERE].forced = true;
        scene
    };
    let tree = tree_of(&shot(3.0), &folder, "moving.ltree");
    assert!(compare(&tree, &Side::of_scene(shot(3.0))).is_same());
    let found = compare(&tree, &Side::of_scene(shot(4.0)));
    let aspects = found.changes.iter().map(|c| c.differences.iter().map(Difference::aspect));
    assert_eq!(aspects.flatten().collect::<Vec<_>>(), ["over_time"; 2], "{found:#?}");

    // A tree does not know that a prim is there and dark.
    let mut off = row(&[]);
    let LightKind::Point { intensity_cd } = &mut off.lights[0].kind else { panic!() };
    *intensity_cd = Vec3::ZERO;
    let found = compare(&trees[0], &Side::of_scene(off));
    assert_eq!(only(&found).verb, Verb::Removed);
}

#[test]
fn places_are_those_of_the_world_wherever_the_origin_is() {
    const FAR: f64 = 1_048_576.0;
    let far = |origin: f64, raised: f64| {
        let mut scene = street();
        for node in &mut scene.nodes {
            let Trs::Parts { translation, .. } = &mut node.local else { panic!() };
            translation.x += FAR;
            translation.y += if node.path.ends_with("point") { raised } else { 0.0 };
        }
        scene.origin = DVec3::X * origin;
        scene
    };
    let folder = TempDir::new().unwrap();
    for other in [FAR, FAR + 512.0] {
        let scenes = || [far(FAR, 0.0), far(other, 0.5)];
        let [before, after] = scenes();
        let trees =
            [tree_of(&before, &folder, "before.ltree"), tree_of(&after, &folder, "after.ltree")];
        let of_trees = compare(&trees[0], &trees[1], &DiffOptions::default()).unwrap();
        for found in [diff(before, after), of_trees] {
            let change = found.changes.iter().find(|c| c.path() == "/street/point").unwrap();
            if other == FAR {
                only(&found);
                assert_eq!(
                    (f64::from(found.picking.as_ref().unwrap().worst_at_m[0]) / FAR).round(),
                    1.0
                );
            }
            let moved = change.differences.iter().find_map(|difference| match difference {
                Difference::Transform { moved_m, .. } => Some(*moved_m),
                _ => None,
            });
            assert!((moved.unwrap() - 0.5).abs() < 1e-3, "{moved:?}");
            for card in [&change.before, &change.after].into_iter().flatten() {
                assert_eq!(card.place.unwrap().center_m[0], FAR as f32);
            }
        }
    }
}
