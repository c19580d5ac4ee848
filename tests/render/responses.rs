//! Lights of which surfaces reflect more or less than they give.

use crate::closed_forms::{assert_dark, assert_irradiance, receiver};
use crate::linking::{KINDS, Lamp, hide_no_light, lamp};
use crate::rooms::{self, Room};
use crate::stage::{Stage, at, direct, facing, glow, lambert, milk, pane};
use crate::strategies::{assert_agreement, every_way};
use candelabra::render::RenderSettings;
use candelabra::scene::{LightKind, LightResponses, Material, Medium, Response, Scene};
use glam::{DVec3, Vec3};

/// Gives lights multipliers of what is reflected diffusely, and of the rest.
fn multiply(scene: &mut Scene, lamps: &[(Lamp, [f32; 2])]) {
    let rows = |of: fn(&Lamp) -> Option<u32>| {
        let own = |(lamp, [diffuse, specular]): &(Lamp, [f32; 2])| {
            Some((of(lamp)?, Response { diffuse: *diffuse, specular: *specular }))
        };
        lamps.iter().filter_map(own).collect()
    };
    scene.light_responses = LightResponses::new(
        rows(|lamp| if let Lamp::Light(row) = lamp { Some(*row) } else { None }),
        rows(|lamp| if let Lamp::Mesh(row) = lamp { Some(*row) } else { None }),
    );
}

/// Every lamp of a scene, with multipliers that differ from lamp to lamp.
fn multiply_all(scene: &mut Scene) {
    let shines = |row: &u32| scene.peak_rgb_of_instance(*row).max_element() > 0.0;
    let meshes = (0..scene.instances.len() as u32).filter(shines).map(Lamp::Mesh);
    let all = meshes.chain((0..scene.lights.len() as u32).map(Lamp::Light));
    let own = [[0.25, 1.0], [1.0, 0.0], [2.0, 0.5], [0.0, 1.5], [1.0, 1.0]];
    let lamps: Vec<_> = all.zip(own.into_iter().cycle()).collect();
    multiply(scene, &lamps);
}

/// A matt floor below any lamp, beside another that is reflected as it is. The specular multiplier is nothing to it.
#[test]
fn a_matt_floor_reflects_by_the_diffuse_multiplier() {
    for kind in 0..KINDS {
        for own in [[0.25, 1.0], [2.0, 0.0], [0.0, 1.0]] {
            let mut stage = receiver(DVec3::Y);
            let (first, lux) = lamp(&mut stage, kind);
            let (_, other_lux) = lamp(&mut stage, (kind + 1) % KINDS);
            hide_no_light(&mut stage, 1);
            multiply(&mut stage.scene, &[(first, own)]);
            let what = format!("lamp {kind} times {own:?}");
            assert_irradiance(&what, &stage, f64::from(own[0]) * lux + other_lux);
        }
        let mut stage = receiver(DVec3::Y);
        let (first, _) = lamp(&mut stage, kind);
        multiply(&mut stage.scene, &[(first, [0.0, 5.0])]);
        assert_dark(&format!("a matt floor below lamp {kind}"), &stage);
        multiply(&mut stage.scene, &[(first, [0.0, 0.0])]);
        assert_dark(&format!("a floor that nothing lights, lamp {kind}"), &stage);
    }
}

/// A mirror shows lamps by the specular multiplier; the eye sees them as they are, also through a pane.
#[test]
fn a_mirror_shows_by_the_specular_multiplier_and_the_eye_sees_the_lamp() {
    let mirror =
        Material { metallic: 1.0, roughness: 0.0, base_color: Vec3::ONE, ..Default::default() };
    for is_dome in [false, true] {
        let seen = |own: [f32; 2]| {
            let mut stage = Stage::default();
            stage.quad([4.0; 2], mirror.clone(), facing(DVec3::ZERO, DVec3::Z));
            stage.quad(
                [1.0, 8.0],
                pane(Vec3::ONE),
                facing(DVec3::new(4.0, 0.0, 1.0), DVec3::Z * 9.0),
            );
            let lamp = match is_dome {
                true => {
                    let sky = LightKind::Dome { radiance_nits: Vec3::splat(2.0), texture: None };
                    stage.light(sky, at(DVec3::ZERO));
                    Lamp::Light(0)
                }
                false => {
                    // Behind the eye, and behind mirror and pane.
                    let wall = glow(Vec3::splat(2.0));
                    stage.quad([90.0; 2], wall.clone(), facing(DVec3::Z * 9.0, DVec3::ZERO));
                    stage.quad([90.0; 2], wall, facing(DVec3::Z * -9.0, DVec3::ZERO));
                    Lamp::Mesh(2)
                }
            };
            let lamps = match is_dome {
                true => vec![(lamp, own)],
                false => vec![(lamp, own), (Lamp::Mesh(3), own)],
            };
            multiply(&mut stage.scene, &lamps);
            stage.look(DVec3::new(0.0, 0.0, 6.0), DVec3::ZERO, 1.4);
            let settings = RenderSettings { depth: 2, ..direct(48, 64) };
            let seen = stage.render(&settings).beauty().map(|beauty| beauty.x).collect::<Vec<_>>();
            // In the mirror, beside it, and through the pane.
            [seen[24 * 48 + 24], seen[0], seen[24 * 48 + 46]]
        };
        let [mirrored, beside, through] = seen([1.0, 1.0]);
        assert!(
            (mirrored - 2.0).abs() < 0.05 && beside == 2.0 && through > 1.5,
            "{mirrored} {through}"
        );
        for (own, share) in
            [([1.0, 0.0], 0.0), ([1.0, 0.5], 0.5), ([0.0, 1.0], 1.0), ([7.0, 2.0], 2.0)]
        {
            let now = seen(own);
            assert!((now[0] - share * mirrored).abs() < 0.02, "{own:?}: {} {mirrored}", now[0]);
            assert_eq!(now[1], beside);
        }
    }
}

/// Of a glossy floor below a coat: the sum of what the two multipliers leave is all, and each is what the floor's albedo
/// says in the light of a dome.
#[test]
fn the_two_parts_of_a_glossy_floor_sum_up() {
    let floor = Material {
        base_color: Vec3::new(0.8, 0.5, 0.2),
        roughness: 0.5,
        coat: crate::stage::coat(0.6, 0.3),
        ..Default::default()
    };
    let seen = |own: Option<[f32; 2]>, mis: bool| {
        let mut stage = Stage::default();
        stage.quad([9.0; 2], floor.clone(), facing(DVec3::ZERO, DVec3::Y));
        let sky = LightKind::Dome { radiance_nits: Vec3::ONE, texture: None };
        stage.light(sky, at(DVec3::ZERO));
        if let Some(own) = own {
            multiply(&mut stage.scene, &[(Lamp::Light(0), own)]);
        }
        stage.look(DVec3::new(0.0, 2.0, 2.0), DVec3::ZERO, 0.1);
        let settings = RenderSettings { mis, depth: 1, ..direct(8, 4096) };
        stage.render(&settings).beauty().sum::<Vec3>() / 64.0
    };
    for mis in [true, false] {
        let whole = seen(None, mis);
        let [both, diffuse, specular, mixed] =
            [[1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.25, 2.0]].map(|own| seen(Some(own), mis));
        // What is reflected as it is keeps its bits.
        assert_eq!(both, whole);
        assert!(diffuse.min_element() > 0.05 && specular.min_element() > 0.05);
        let off = |a: Vec3, b: Vec3| ((a - b) / b).abs().max_element();
        assert!(off(diffuse + specular, whole) < 2e-4, "{diffuse} {specular} {whole}");
        assert!(off(0.25 * diffuse + 2.0 * specular, mixed) < 2e-4, "{mixed}");
        // What is diffuse has the colours of the base, what is not has none of its own.
        let hue = diffuse / diffuse.x;
        assert!(hue.y < 0.75 && hue.z < 0.4, "{diffuse}");
        assert!(specular.max_element() < 1.02 * specular.min_element(), "{specular}");
    }
}

/// What passes milk glass counts as specular.
#[test]
fn what_passes_glass_is_not_diffuse() {
    let seen = |own: [f32; 2]| {
        let mut stage = Stage::default();
        let glass = Material { specular: 0.0, ..milk(0.7, 1.0) };
        stage.quad([9.0; 2], glass, facing(DVec3::ZERO, DVec3::Y));
        stage.disk(1.0, glow(Vec3::splat(5.0)), facing(DVec3::Y * -2.0, DVec3::ZERO));
        multiply(&mut stage.scene, &[(Lamp::Mesh(1), own)]);
        stage.look(DVec3::new(0.0, 2.0, 0.5), DVec3::ZERO, 0.1);
        stage.render(&direct(8, 256)).beauty().map(|beauty| beauty.x).sum::<f32>()
    };
    let whole = seen([1.0, 1.0]);
    assert!(whole > 1.0);
    assert!((seen([0.0, 1.0]) / whole - 1.0).abs() < 1e-4);
    assert!((seen([3.0, 0.5]) / whole - 0.5).abs() < 1e-4);
    assert_eq!(seen([3.0, 0.0]), 0.0);
}

/// The same picture from every way of picking lights, on a dull surface, on shining ones and on glass.
#[test]
fn every_way_gives_the_same_picture() {
    let ways: Vec<_> = every_way().into_iter().step_by(3).collect();
    let names = ["varnish", "a coat on plaster", "a floor of milk glass"];
    let rooms = rooms::of_every_material().into_iter().filter(|room| names.contains(&&*room.name));
    let mut rooms: Vec<Room> = rooms.collect();
    assert_eq!(rooms.len(), names.len());
    rooms::all_lights(&mut rooms[0].stage);
    rooms.push(Room { name: "Lambert".into(), stage: rooms::lambert_room(), depth: 2 });
    for mut room in rooms {
        multiply_all(&mut room.stage.scene);
        assert_agreement(&room, &ways);
    }
}

/// Fog is lit by a light as it is, and what is in it by the multipliers.
#[test]
fn fog_is_lit_as_ever() {
    let seen = |own: Option<[f32; 2]>, albedo: f32| {
        let mut stage = Stage::default();
        let kind = LightKind::Point { intensity_cd: Vec3::splat(5.0) };
        stage.light(kind, at(DVec3::new(1.0, 0.5, 0.0)));
        stage.quad([9.0; 2], lambert(Vec3::splat(albedo)), facing(DVec3::Z * -1.0, DVec3::Z));
        stage.look(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.5);
        let (scattering, absorption) = (Vec3::splat(0.2), Vec3::ZERO);
        let medium = Medium { scattering, absorption, anisotropy: 0.0, region: None };
        stage.scene.medium = Some(medium);
        if let Some(own) = own {
            multiply(&mut stage.scene, &[(Lamp::Light(0), own)]);
        }
        stage.render(&direct(12, 256)).beauty().map(|beauty| beauty.x).sum::<f32>()
    };
    let (fog, all) = (seen(None, 0.0), seen(None, 0.8));
    assert!(fog > 0.0 && all > 1.2 * fog, "{fog} {all}");
    assert_eq!(seen(Some([0.0, 0.0]), 0.0), fog);
    assert!((seen(Some([0.0, 1.0]), 0.8) / fog - 1.0).abs() < 1e-4);
    let half = seen(Some([0.5, 1.0]), 0.8);
    assert!((half - 0.5 * (fog + all)).abs() < 1e-3 * all, "{half} {fog} {all}");
}
