//! Light filters: what of a light gets to what it lights.

use crate::closed_forms::{assert_dark, assert_irradiance, receiver};
use crate::linking::{KINDS, Lamp, hide_no_light, lamp};
use crate::rooms::{self, Room};
use crate::stage::{Set, Stage, at, direct, facing, glow, lambert, scaled};
use crate::strategies::{assert_agreement, every_way};
use candelabra::render::RenderSettings;
use candelabra::scene::{
    BlockerShape, Channel, FilterKind, Interpolation, Keys, LightFilter, LightFilters, LightKind,
    Material, Medium, Rod, Scene, Shutter, Trs,
};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// A ball, soft across a shell.
pub fn ball(radius: f32, edge: f32, inside: f32, outside: f32) -> FilterKind {
    FilterKind::Rod(Rod {
        min: Vec3::ZERO,
        max: Vec3::ZERO,
        radius,
        edge,
        ramp: vec![[0.0, 0.0], [1.0, 1.0]],
        inside: Vec3::splat(inside),
        outside: Vec3::splat(outside),
    })
}

/// Puts filters at new nodes in front of some lights.
fn filter(stage: &mut Stage, lamps: &[Lamp], filters: Vec<(FilterKind, Trs)>) {
    let all =
        filters.into_iter().map(|(kind, place)| LightFilter { node: stage.node(place), kind });
    let all: Vec<LightFilter> = all.collect();
    let set: Box<[u32]> = (0..all.len() as u32).collect();
    let rows =
        |of: fn(&Lamp) -> Option<u32>| lamps.iter().filter_map(of).map(|row| (row, 0)).collect();
    let lights = rows(|lamp| if let Lamp::Light(row) = lamp { Some(*row) } else { None });
    let instances = rows(|lamp| if let Lamp::Mesh(row) = lamp { Some(*row) } else { None });
    stage.scene.light_filters = LightFilters::new(all, vec![set], lights, instances);
}

/// Inside of a rod, outside of it, and of one that is turned inside out, of any lamp; another lamp has none.
#[test]
fn a_rod_dims_what_is_inside_it() {
    for kind in 0..KINDS {
        for (place, outside, share) in [(0.5, 1.0, 0.25), (3.0, 1.0, 1.0), (3.0, 0.0, 0.0)] {
            let mut stage = receiver(DVec3::Y);
            let (own, lux) = lamp(&mut stage, kind);
            let (_, other_lux) = lamp(&mut stage, (kind + 1) % KINDS);
            hide_no_light(&mut stage, 1);
            let filters = vec![(ball(1.0, 0.0, 0.25, outside), at(DVec3::X * place))];
            filter(&mut stage, &[own], filters);
            let what = format!("a rod at {place} for lamp {kind}, {outside} outside");
            assert_irradiance(&what, &stage, share * lux + other_lux);
        }
    }
}

/// Across the shell of a rod that its node stretches, and two filters after each other.
#[test]
fn filters_multiply_and_rods_are_in_the_space_of_their_nodes() {
    let mut stage = receiver(DVec3::Y);
    let (own, lux) = lamp(&mut stage, 0);
    // Four metres away, in units of two: 2 from the middle, so a fourth across the shell.
    let place = scaled(at(DVec3::X * 4.0), DVec3::splat(2.0));
    let soft = (ball(1.5, 2.0, 0.0, 1.0), place);
    let whole = (ball(1.0, 0.0, 0.4, 1.0), at(DVec3::ZERO));
    filter(&mut stage, &[own], vec![soft, whole]);
    assert_irradiance("two rods", &stage, 0.4 * 0.25 * lux);
}

/// A shape in the way of any lamp, behind the lamp, and below the floor.
#[test]
fn a_blocker_stops_what_passes_it() {
    let slab = |height: f64| scaled(at(DVec3::Y * height), DVec3::new(4000.0, 0.1, 4000.0));
    let blocker = |shape, through| FilterKind::Blocker { shape, through: Vec3::splat(through) };
    for kind in 0..KINDS {
        let infinite = (2..=4).contains(&kind);
        for (height, meets) in [(1.0, true), (-1.0, false), (9.0, infinite)] {
            let mut stage = receiver(DVec3::Y);
            let (own, lux) = lamp(&mut stage, kind);
            filter(&mut stage, &[own], vec![(blocker(BlockerShape::Box, 0.25), slab(height))]);
            // Light of a dome that comes along the floor goes below the slab's edge: a share of 1e-5.
            let what = format!("a box at {height} for lamp {kind}");
            assert_irradiance(&what, &stage, if meets { 0.25 } else { 1.0 } * lux);
        }
        let mut stage = receiver(DVec3::Y);
        let (own, _) = lamp(&mut stage, kind);
        let plane = scaled(facing(DVec3::Y * 0.5, DVec3::ZERO), DVec3::new(1e9, 1e9, 1.0));
        filter(&mut stage, &[own], vec![(blocker(BlockerShape::Plane, 0.0), plane)]);
        if kind != 4 {
            assert_dark(&format!("what is below a plane, lamp {kind}"), &stage);
        }
    }
    // A ball as large as the floor's sight of a disk of lamp: it covers the middle and not the rim.
    let mut stage = receiver(DVec3::Y);
    let (own, lux) = lamp(&mut stage, 5);
    let radius: f64 = 0.3;
    let place = scaled(at(DVec3::Y), DVec3::splat(2.0 * radius));
    filter(&mut stage, &[own], vec![(blocker(BlockerShape::Sphere, 0.0), place)]);
    let covered = 3.0 * PI * radius * radius;
    assert_irradiance("a ball before a disk", &stage, lux - covered);
}

#[test]
fn decay_is_by_the_distance_to_the_lamp() {
    for (near_m, far_m, share) in [
        (Some([1.0, 2.0]), None, 1.0),
        (Some([1.0, 3.0]), None, 0.5),
        (Some([2.5, 3.0]), None, 0.0),
        (None, Some([0.0, 8.0]), 1.0 - 0.15625),
        (Some([1.0, 3.0]), Some([1.0, 3.0]), 0.25),
        (None, Some([1.0, 1.5]), 0.0),
    ] {
        let mut stage = receiver(DVec3::Y);
        let (own, lux) = lamp(&mut stage, 0);
        filter(&mut stage, &[own], vec![(FilterKind::Decay { near_m, far_m }, at(DVec3::ZERO))]);
        assert_irradiance(&format!("decay {near_m:?} {far_m:?}"), &stage, share * lux);
    }
}

/// The eye sees a filtered lamp as it is; so does no mirror.
#[test]
fn the_eye_sees_what_is_filtered_and_a_mirror_does_not() {
    let mirror =
        Material { metallic: 1.0, roughness: 0.0, base_color: Vec3::ONE, ..Default::default() };
    let seen = |share: f32| {
        let mut stage = Stage::default();
        stage.quad([4.0; 2], mirror.clone(), facing(DVec3::ZERO, DVec3::Z));
        stage.disk(0.4, glow(Vec3::splat(2.0)), facing(DVec3::new(1.0, 0.0, 1.9), DVec3::X));
        let sky = LightKind::Dome { radiance_nits: Vec3::splat(0.5), texture: None };
        stage.light(sky, at(DVec3::ZERO));
        stage.look(DVec3::new(0.0, 0.0, 6.0), DVec3::ZERO, 1.2);
        let rod = (ball(9.0, 0.0, share, 1.0), at(DVec3::ZERO));
        filter(&mut stage, &[Lamp::Mesh(1), Lamp::Light(0)], vec![rod]);
        let settings = RenderSettings { depth: 2, ..direct(48, 16) };
        stage.render(&settings).beauty().map(|beauty| beauty.x).collect::<Vec<f32>>()
    };
    let (whole, half, none) = (seen(1.0), seen(0.5), seen(0.0));
    // The sky itself is in the corner, the mirror in the middle.
    let middle = 24 * 48 + 24;
    assert_eq!([whole[0], half[0], none[0]], [0.5; 3]);
    assert!((whole[middle] - 0.5).abs() < 0.05, "{}", whole[middle]);
    assert!((half[middle] - 0.5 * whole[middle]).abs() < 1e-4, "{}", half[middle]);
    assert_eq!(none[middle], 0.0);
    // The disk is seen in the mirror, where nothing else is as bright.
    let brightest = |seen: &[f32]| {
        let row = |y: usize| &seen[y * 48 + 12..y * 48 + 36];
        (12..36).flat_map(row).fold(0.0f32, |most, &x| most.max(x))
    };
    assert!(brightest(&whole) > 1.9 && brightest(&half) < 1.1, "{}", brightest(&half));
}

/// The same picture from every way of picking lights, on a dull surface and on a shining one.
#[test]
fn every_way_gives_the_same_picture() {
    let filters = || {
        let through = Vec3::new(0.2, 0.5, 0.9);
        let cube = FilterKind::Blocker { shape: BlockerShape::Box, through };
        vec![
            (ball(0.6, 0.7, 0.2, 1.0), at(DVec3::new(0.4, 0.2, 0.3))),
            (cube, scaled(at(DVec3::new(-0.5, 0.6, 0.0)), DVec3::splat(0.9))),
        ]
    };
    let lamps = |scene: &Scene| -> Vec<Lamp> {
        let shines = |row: &u32| scene.peak_rgb_of_instance(*row).max_element() > 0.0;
        let meshes = (0..scene.instances.len() as u32).filter(shines).map(Lamp::Mesh);
        meshes.chain((0..scene.lights.len() as u32).map(Lamp::Light)).collect()
    };
    let mut stage = rooms::lambert_room();
    let all = lamps(&stage.scene);
    filter(&mut stage, &all, filters());
    let room = Room { name: "a filtered room".into(), stage, depth: 2 };
    let ways: Vec<_> = every_way().into_iter().step_by(3).collect();
    assert_agreement(&room, &ways);
    let varnish = rooms::of_every_material().into_iter().find(|room| room.name == "varnish");
    let mut stage = varnish.unwrap().stage;
    rooms::all_lights(&mut stage);
    let all = lamps(&stage.scene);
    filter(&mut stage, &all, filters());
    let room = Room { name: "a filtered room that shines".into(), stage, depth: 2 };
    assert_agreement(&room, &ways);
}

/// A card in fog that fills the world, lit by a point.
pub fn card_in_fog() -> Stage {
    let mut stage = Stage::default();
    let kind = LightKind::Point { intensity_cd: Vec3::splat(5.0) };
    stage.light(kind, at(DVec3::new(1.0, 0.5, 0.0)));
    stage.quad([0.1; 2], lambert(Vec3::ONE), at(DVec3::new(0.0, 0.0, -1.0)));
    stage.look(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.5);
    let (scattering, absorption) = (Vec3::splat(0.2), Vec3::ZERO);
    stage.scene.medium = Some(Medium { scattering, absorption, anisotropy: 0.0, region: None });
    stage
}

/// Fog inside of a rod is dark.
#[test]
fn fog_is_filtered() {
    let seen = |radius: f32| {
        let mut stage = card_in_fog();
        filter(&mut stage, &[Lamp::Light(0)], vec![(ball(radius, 0.0, 0.0, 1.0), at(DVec3::ZERO))]);
        stage.render(&direct(12, 256)).beauty().map(|beauty| beauty.x).sum::<f32>()
    };
    let (free, part, none) = (seen(0.0), seen(0.5), seen(50.0));
    assert!(none == 0.0 && part < 0.9 * free && part > 0.1 * free, "{free} {part} {none}");
}

/// A rod that passes while the shutter is open.
#[test]
fn a_filter_that_moves_is_blurred() {
    let mut stage = receiver(DVec3::Y);
    let (own, lux) = lamp(&mut stage, 0);
    filter(&mut stage, &[own], vec![(ball(1.0, 0.0, 0.0, 1.0), at(DVec3::ZERO))]);
    // It covers the floor for the first quarter of a second.
    let node = stage.scene.light_filters.all()[0].node as usize;
    stage.scene.nodes[node].channels = vec![Channel::Translation(Keys {
        times_s: vec![0.0, 1.0],
        values: vec![Vec3::ZERO, Vec3::X * 4.0],
        interpolation: Interpolation::Linear,
    })];
    stage.scene.cameras[0].shutter = Shutter::new(0.0, 24.0);
    let set = Set::of(&stage.scene, &[1]);
    let buffers = set.render(&direct(8, 4096), 1);
    let seen = buffers.beauty().map(|beauty| f64::from(beauty.x)).sum::<f64>() / 64.0;
    let whole = set.render(&RenderSettings { motion_blur: false, ..direct(8, 64) }, 30);
    let whole = whole.beauty().map(|beauty| f64::from(beauty.x)).sum::<f64>() / 64.0;
    assert!(lux > 0.0 && (seen / whole - 0.75).abs() < 0.02, "{seen} of {whole}");
}
