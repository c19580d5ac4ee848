//! Links that changed.

use crate::street::{POINT, SPHERE, SUN, diff, only, put, street, tree_of};
use candelabra::diff::{
    DiffOptions, Difference, Relinked, RelinkedFilter, Side, Text, Verb, compare,
};
use candelabra::scene::{
    FilterKind, LightFilter, LightFilters, LinkRows, Linking, Links, Membership, Scene,
};
use glam::Vec3;
use tempfile::TempDir;

/// Rows of the street's instances.
const PANEL: u32 = 0;
const BULB: u32 = 1;
const WALL: u32 = 3;

/// The street, with a set that does not hold some instances for each of some lights.
fn linked(lights: &[(usize, bool, &[u32])]) -> Scene {
    let mut scene = street();
    let mut rows = LinkRows::default();
    let mut outside = vec![Vec::new(); scene.instances.len()];
    for (set, (light, is_light, from)) in (0..).zip(lights) {
        let links = rows.lights.entry(*light as u32).or_insert(Links::default());
        *(if *is_light { &mut links.light } else { &mut links.shadow }) = Some(set);
        from.iter().for_each(|&row| outside[row as usize].push(set));
    }
    for (row, sets) in (0..).zip(outside).filter(|(_, sets)| !sets.is_empty()) {
        let membership = Some(rows.memberships.len() as u32);
        rows.memberships.push(Membership::Outside(sets.into()));
        rows.instances.insert(row, Links { membership, ..Links::default() });
    }
    scene.linking = Linking::new(rows);
    scene
}

fn relinked(gained: &[&str], lost: &[&str]) -> Relinked {
    let named = |paths: &[&str]| paths.iter().map(|path| format!("/street/{path}")).collect();
    Relinked {
        gained: gained.len(),
        gained_named: named(gained),
        lost: lost.len(),
        lost_named: named(lost),
    }
}

#[test]
fn a_light_that_lights_others_is_told_with_them() {
    let free = || linked(&[]);
    let one = linked(&[(POINT, true, &[WALL, PANEL])]);
    let found = diff(free(), one);
    let change = only(&found);
    assert_eq!((change.verb, change.path()), (Verb::Dirtied, "/street/point"));
    let prims = Some(relinked(&[], &["panel", "wall"]));
    assert_eq!(change.differences, [Difference::LightLink { prims }]);
    // Of lights in the tree and beside it, of light and of shadows.
    for light in [POINT, SPHERE, SUN] {
        let before = linked(&[(light, true, &[WALL]), (light, false, &[WALL])]);
        let after = linked(&[(light, true, &[BULB]), (light, false, &[WALL, BULB])]);
        let found = diff(before, after);
        let links = [
            Difference::LightLink { prims: Some(relinked(&["wall"], &["bulb_1"])) },
            Difference::ShadowLink { prims: Some(relinked(&[], &["bulb_1"])) },
        ];
        assert_eq!(only(&found).differences, links);
    }
}

/// The street, whose point has a filter that leaves out some instances.
fn filtered(from: &[u32]) -> Scene {
    let mut scene = street();
    let node = put(&mut scene, "gel", [0.0, 2.0, 0.0]);
    let kind = FilterKind::Multiplier(Vec3::splat(0.5));
    let lights = [(POINT as u32, 0)].into();
    let filters = vec![LightFilter { node, kind }];
    scene.light_filters = LightFilters::new(filters, vec![[0].into()], lights, Default::default());
    let outside = Links { membership: Some(0), ..Links::default() };
    scene.linking = Linking::new(LinkRows {
        memberships: vec![Membership::Outside([0].into())],
        instances: from.iter().map(|&row| (row, outside)).collect(),
        filters: [(0, 0)].into(),
        ..LinkRows::default()
    });
    scene
}

#[test]
fn a_filter_that_filters_for_others_is_told_with_them() {
    let found = diff(filtered(&[WALL]), filtered(&[PANEL, BULB]));
    let change = only(&found);
    assert_eq!((change.verb, change.path()), (Verb::Dirtied, "/street/point"));
    let prims = relinked(&["wall"], &["bulb_1", "panel"]);
    let filters = vec![RelinkedFilter { path: "/street/gel".into(), prims }];
    assert_eq!(change.differences, [Difference::FilterLink { filters }]);
    let told = Text { of: &found, most: 9 }.to_string();
    assert!(told.contains("/street/gel filters for 1 more (/street/wall) and 2 fewer"), "{told}");
    assert!(diff(filtered(&[WALL]), filtered(&[WALL])).is_same());
    // Without a link before, everything was filtered.
    let found = diff(filtered(&[]), filtered(&[WALL]));
    let filters =
        vec![RelinkedFilter { path: "/street/gel".into(), prims: relinked(&[], &["wall"]) }];
    assert_eq!(only(&found).differences, [Difference::FilterLink { filters }]);
}

#[test]
fn the_same_links_are_no_change() {
    // Numbered otherwise, and with a set that nobody had before.
    let before = linked(&[(POINT, true, &[WALL]), (SPHERE, true, &[BULB])]);
    let mut after =
        linked(&[(SUN, true, &[PANEL]), (SPHERE, true, &[BULB]), (POINT, true, &[WALL])]);
    let found = diff(before, after);
    assert_eq!(only(&found).path(), "/street/sun");
    // A prim that is new is in a set or not: no light was linked otherwise.
    after = linked(&[(POINT, true, &[WALL])]);
    let node = put(&mut after, "chair", [1.0, 0.0, 0.0]);
    let chair = crate::street::instance(&after, node, 2);
    after.instances.push(chair);
    assert!(diff(linked(&[(POINT, true, &[WALL])]), after).is_same());
}

#[test]
fn trees_tell_that_lights_no_longer_light_the_same() {
    let folder = TempDir::new().unwrap();
    let side = |name: &str, scene: &Scene| tree_of(scene, &folder, name);
    let before = side("before.ltree", &linked(&[(POINT, true, &[WALL])]));
    let same = side("same.ltree", &linked(&[(POINT, true, &[BULB])]));
    let after = side("after.ltree", &linked(&[(POINT, true, &[WALL]), (SPHERE, true, &[BULB])]));
    let options = DiffOptions::default();
    assert!(compare(&before, &same, &options).unwrap().is_same());
    let found = compare(&before, &after, &options).unwrap();
    let change = only(&found);
    assert_eq!(change.path(), "/street/sphere");
    assert_eq!(change.differences, [Difference::LightLink { prims: None }]);
    // A tree that is up to date does not differ from its scene; one that is not, does.
    let scene = Side::of_scene(linked(&[(POINT, true, &[WALL])]));
    assert!(compare(&before, &scene, &options).unwrap().is_same());
    assert!(!compare(&after, &scene, &options).unwrap().is_same());
}
