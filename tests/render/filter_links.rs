//! Filter links: for what a light filter filters.

use crate::closed_forms::{ALBEDO, assert_dark, assert_irradiance, receiver};
use crate::filters::{ball, card_in_fog};
use crate::linking::{KINDS, Lamp, hide_no_light, lamp};
use crate::rooms::{self, Room};
use crate::stage::{Set, Stage, at, direct, facing, glow, lambert, scaled, tree_bytes};
use crate::statistics::pixels;
use crate::strategies::{assert_agreement, every_way};
use candelabra::render::RenderSettings;
use candelabra::scene::{
    BlockerShape, FilterKind, LightFilter, LightFilters, LightKind, LinkRows, Linking, Links,
    Material, Membership, Scene, Trs,
};
use glam::{DVec3, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A filter, its place, and what it leaves out, by rows of instances; `None` is the fog.
pub type Kept = (FilterKind, Trs, Vec<Option<u32>>);

/// Puts filters, each linked to everything but what it leaves out, in front of some lights.
pub fn filter(stage: &mut Stage, lamps: &[Lamp], kept: Vec<Kept>) {
    let (mut filters, mut rows) = (Vec::new(), LinkRows::default());
    let mut outside: BTreeMap<Option<u32>, Vec<u32>> = BTreeMap::new();
    for (row, (kind, place, from)) in (0..).zip(kept) {
        filters.push(LightFilter { node: stage.node(place), kind });
        rows.filters.insert(row, row);
        from.into_iter().for_each(|prim| outside.entry(prim).or_default().push(row));
    }
    for (prim, sets) in outside {
        let membership = Some(rows.memberships.len() as u32);
        rows.memberships.push(Membership::Outside(sets.into()));
        match prim {
            Some(row) => drop(rows.instances.insert(row, Links { membership, ..Links::default() })),
            None => rows.medium = membership,
        }
    }
    let set = (0..filters.len() as u32).collect();
    let of =
        |of: fn(&Lamp) -> Option<u32>| lamps.iter().filter_map(of).map(|row| (row, 0)).collect();
    let lights = of(|lamp| if let Lamp::Light(row) = lamp { Some(*row) } else { None });
    let instances = of(|lamp| if let Lamp::Mesh(row) = lamp { Some(*row) } else { None });
    stage.scene.light_filters = LightFilters::new(filters, vec![set], lights, instances);
    stage.scene.linking = Linking::new(rows);
}

/// A filter of each kind that leaves a fourth of the light of a lamp above the floor.
fn fourths() -> [(FilterKind, Trs); 3] {
    let (rod, through) = (ball(1.0, 0.0, 0.25, 1.0), Vec3::splat(0.25));
    let slab = FilterKind::Blocker { shape: BlockerShape::Box, through };
    let low = scaled(at(DVec3::Y), DVec3::new(4000.0, 0.1, 4000.0));
    [(rod, at(DVec3::ZERO)), (slab, low), (FilterKind::Multiplier(through), at(DVec3::X))]
}

/// One floor in two halves below any lamp: the filter's factor on the half that it is linked to, and just 1 on the other.
/// The means are closed forms; of the other half the pixels are those of a scene without filters.
#[test]
fn one_half_of_a_floor_is_filtered_and_the_other_is_not() {
    let halves = |kind: usize| {
        let mut stage = Stage::default();
        for side in [-0.005, 0.005] {
            let place = facing(DVec3::X * side, DVec3::X * side + DVec3::Y);
            stage.quad([0.01; 2], lambert(Vec3::splat(ALBEDO as f32)), place);
        }
        let (own, lux) = lamp(&mut stage, kind);
        hide_no_light(&mut stage, 2);
        stage.look(DVec3::new(0.0, 0.1, 1e-4), DVec3::ZERO, 0.08);
        (stage, own, lux)
    };
    for kind in 0..KINDS {
        for mis in [true, false] {
            let settings = RenderSettings { mis, ..direct(8, 256) };
            let seen = |stage: &Stage| -> Vec<f32> {
                stage.render(&settings).beauty().map(|beauty| beauty.x).collect()
            };
            let free = seen(&halves(kind).0);
            for (number, (filtering, place)) in fourths().into_iter().enumerate() {
                let (mut stage, own, lux) = halves(kind);
                filter(&mut stage, &[own], vec![(filtering.clone(), place, vec![Some(1)])]);
                let linked = seen(&stage);
                let half = |seen: &[f32], right: bool| -> Vec<f32> {
                    let row = |y: usize| seen[8 * y + 4 * usize::from(right)..][..4].to_vec();
                    (0..8).flat_map(row).collect()
                };
                let what = format!("filter {number} of lamp {kind}, mis {mis}");
                // Which half is on which side of the picture is told by what did not change.
                let kept = half(&linked, true) == half(&free, true);
                assert_eq!(half(&linked, kept), half(&free, kept), "{what}");
                let mean = half(&linked, !kept).iter().map(|&x| f64::from(x)).sum::<f64>() / 32.0;
                let expected = 0.25 * lux * ALBEDO / PI;
                assert!((mean / expected - 1.0).abs() < 0.01, "{what}: {mean}, not {expected}");
            }
        }
    }
}

/// Two filters of one lamp, of which the floor is in one set; a filter of nothing; light linking beside it.
#[test]
fn each_filter_has_a_set_of_its_own() {
    let mut stage = receiver(DVec3::Y);
    let (own, lux) = lamp(&mut stage, 5);
    let [rod, slab, multiplier] = fourths();
    let with = |(kind, place): &(FilterKind, Trs), from| (kind.clone(), *place, from);
    let off = vec![Some(0)];
    filter(&mut stage, &[own], vec![with(&rod, off.clone()), with(&slab, vec![])]);
    assert_irradiance("the second of two", &stage, 0.25 * lux);
    filter(&mut stage, &[own], vec![with(&rod, off.clone()), with(&multiplier, off.clone())]);
    assert_irradiance("neither of two", &stage, lux);
    filter(&mut stage, &[own], vec![with(&rod, vec![]), with(&multiplier, vec![])]);
    assert!(stage.scene.linking.is_empty());
    assert_irradiance("both of two", &stage, 0.0625 * lux);
    let none = (FilterKind::Multiplier(Vec3::ZERO), at(DVec3::ZERO), vec![]);
    filter(&mut stage, &[own], vec![none]);
    assert_dark("a floor of which all is filtered", &stage);
}

/// A mirror shows a lamp by the filters that are linked to the mirror; the eye sees it as it is.
#[test]
fn a_mirror_shows_lamps_by_its_own_filters() {
    let mirror =
        Material { metallic: 1.0, roughness: 0.0, base_color: Vec3::ONE, ..Default::default() };
    let seen = |share: f32, from: Vec<Option<u32>>| {
        let mut stage = Stage::default();
        stage.quad([4.0; 2], mirror.clone(), facing(DVec3::ZERO, DVec3::Z));
        stage.disk(0.4, glow(Vec3::splat(2.0)), facing(DVec3::new(1.0, 0.0, 1.9), DVec3::X));
        let sky = LightKind::Dome { radiance_nits: Vec3::splat(0.5), texture: None };
        stage.light(sky, at(DVec3::ZERO));
        stage.look(DVec3::new(0.0, 0.0, 6.0), DVec3::ZERO, 1.2);
        let kept = (FilterKind::Multiplier(Vec3::splat(share)), at(DVec3::ZERO), from);
        filter(&mut stage, &[Lamp::Mesh(1), Lamp::Light(0)], vec![kept]);
        let settings = RenderSettings { depth: 2, ..direct(48, 16) };
        stage.render(&settings).beauty().map(|beauty| beauty.x).collect::<Vec<f32>>()
    };
    let (whole, half) = (seen(1.0, vec![]), seen(0.5, vec![]));
    let (mirror_left_out, lamp_left_out) = (seen(0.5, vec![Some(0)]), seen(0.5, vec![Some(1)]));
    let middle = 24 * 48 + 24;
    assert_eq!((whole[0], half[0]), (0.5, 0.5));
    assert!((half[middle] - 0.5 * whole[middle]).abs() < 1e-4);
    assert!(mirror_left_out == whole && lamp_left_out[..12 * 48] == half[..12 * 48]);
    assert_eq!(lamp_left_out[middle], half[middle]);
}

/// Fog is filtered as its prim is linked, and the card in it as its own is.
#[test]
fn fog_is_filtered_as_it_is_linked() {
    let seen = |from: Vec<Option<u32>>| {
        let mut stage = card_in_fog();
        let dark = (FilterKind::Multiplier(Vec3::ZERO), at(DVec3::ZERO), from);
        filter(&mut stage, &[Lamp::Light(0)], vec![dark]);
        stage.render(&direct(12, 64)).beauty().map(|beauty| beauty.x).collect::<Vec<f32>>()
    };
    let (corner, middle) = (0, 6 * 12 + 6);
    let free = seen(vec![None, Some(0)]);
    let (fog_left_out, card_left_out) = (seen(vec![None]), seen(vec![Some(0)]));
    assert!(seen(vec![]).iter().all(|&x| x == 0.0));
    assert!(free[corner] > 0.0 && fog_left_out[corner] == free[corner]);
    assert!(fog_left_out[middle] < 0.9 * free[middle]);
    assert_eq!(card_left_out[corner], 0.0);
    assert!(card_left_out[middle] > 0.0);
}

fn all_lamps(scene: &Scene) -> Vec<Lamp> {
    let shines = |row: &u32| scene.peak_rgb_of_instance(*row).max_element() > 0.0;
    let meshes = (0..scene.instances.len() as u32).filter(shines).map(Lamp::Mesh);
    meshes.chain((0..scene.lights.len() as u32).map(Lamp::Light)).collect()
}

/// The same picture from every way of picking lights, on a dull surface and on a shining one.
#[test]
fn every_way_gives_the_same_picture() {
    let varnish = rooms::of_every_material().into_iter().find(|room| room.name == "varnish");
    let mut shining = varnish.unwrap().stage;
    rooms::all_lights(&mut shining);
    for (name, mut stage) in [("a dull room", rooms::lambert_room()), ("a shining room", shining)] {
        let through = Vec3::new(0.2, 0.5, 0.9);
        let cube = FilterKind::Blocker { shape: BlockerShape::Box, through };
        let kept = vec![
            (ball(0.6, 0.7, 0.2, 1.0), at(DVec3::new(0.4, 0.2, 0.3)), vec![Some(0)]),
            (cube, scaled(at(DVec3::new(-0.5, 0.6, 0.0)), DVec3::splat(0.9)), vec![Some(1)]),
            (FilterKind::Multiplier(through), at(DVec3::ZERO), vec![Some(0), Some(2)]),
        ];
        let lamps = all_lamps(&stage.scene);
        filter(&mut stage, &lamps, kept);
        assert!(!stage.scene.linking.is_empty());
        let room = Room { name: format!("{name} with linked filters"), stage, depth: 2 };
        let ways: Vec<_> = every_way().into_iter().step_by(3).collect();
        assert_agreement(&room, &ways);
    }
}

/// A tree knows nothing of filter links, and links of everything change no byte of a picture.
#[test]
fn a_filter_of_everything_is_as_one_without_a_link() {
    let mut stage = rooms::lambert_room();
    let lamps = all_lamps(&stage.scene);
    let bare = tree_bytes(&stage.scene, &[1]).as_ref().to_vec();
    let settings = RenderSettings { depth: 2, ..direct(16, 4) };
    let picture = |stage: &Stage| pixels(&Set::of(&stage.scene, &[1]).render(&settings, 1));
    let kept = |from| vec![(ball(0.6, 0.7, 0.2, 1.0), at(DVec3::ZERO), from)];
    filter(&mut stage, &lamps, kept(vec![]));
    let whole = picture(&stage);
    stage.scene.linking = Linking::default();
    assert!(picture(&stage) == whole);
    filter(&mut stage, &lamps, kept(vec![Some(0)]));
    assert!(picture(&stage) != whole);
    assert!(tree_bytes(&stage.scene, &[1]).as_ref() == bare);
}
