//! Panes: thin, smooth glass that light passes straight.

use crate::linking::{Kept, Lamp, link};
use crate::rooms::{self, Room};
use crate::stage::{Stage, aimed, at, direct, facing, filter, glow, lambert, pane, scaled};
use crate::statistics::{assert_even, pixels};
use crate::strategies::{Way, assert_agreement, every_way};
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{Aov, LightStrategy, RenderSettings};
use candelabra::scene::{
    AlphaMode, Channel, FogBox, Interpolation, Keys, LightKind, Material, Medium, Visibility,
};
use glam::{DVec3, Vec3};

/// A plaster floor and a plate of metal below lamps of every kind, seen from near the floor.
fn lit_floor(scale: f64) -> Stage {
    let mut stage = Stage::default();
    let s = scale as f32;
    let metal = Material { metallic: 1.0, roughness: 0.4, ..Default::default() };
    let up = DVec3::Y;
    stage.quad([4.0 * s; 2], lambert(Vec3::splat(0.6)), facing(DVec3::ZERO, up));
    let place = DVec3::new(0.1, 0.05, -0.1) * scale;
    stage.quad([0.6 * s; 2], metal, facing(place, place + up));
    let lamp = glow(Vec3::new(6.0, 5.0, 4.0));
    stage.quad([0.6 * s; 2], lamp, facing(DVec3::new(-0.4, 1.0, 0.2) * scale, DVec3::ZERO));
    let radiance_nits = Vec3::splat(9.0);
    let sphere = LightKind::Sphere { radiance_nits, radius: 0.2 * s, shaping: None };
    stage.light(sphere, at(DVec3::new(0.5, 0.9, -0.3) * scale));
    let point = LightKind::Point { intensity_cd: Vec3::splat(s * s) };
    stage.light(point, at(DVec3::new(0.3, 0.8, 0.5) * scale));
    for angle_rad in [0.0, 0.2] {
        let sun = LightKind::Distant { irradiance_lux: Vec3::splat(0.5), angle_rad };
        stage.light(sun, aimed(DVec3::ZERO, DVec3::new(0.3, -1.0, 0.2)));
    }
    stage
        .light(LightKind::Dome { radiance_nits: Vec3::splat(0.3), texture: None }, at(DVec3::ZERO));
    stage.look(DVec3::new(0.0, 0.3, 0.5) * scale, DVec3::ZERO, 0.5);
    stage
}

/// Where a pane lies between the floor and all of its lamps.
fn lid(scale: f64) -> candelabra::scene::Trs {
    facing(DVec3::Y * 0.45 * scale, DVec3::Y * scale)
}

/// Asserts that a picture is another one times a colour.
#[track_caller]
fn assert_tinted(what: &str, seen: &RenderBuffers, clear: &RenderBuffers, tint: Vec3) {
    let (mut off, mut sum) = (0.0_f32, Vec3::ZERO);
    for (seen, clear) in seen.beauty().zip(clear.beauty()) {
        off = off.max(((seen - clear * tint) / clear.max(Vec3::splat(1e-3))).abs().max_element());
        sum += clear;
    }
    assert!(sum.min_element() > 0.0, "{what}: there is nothing to see");
    assert!(off < 1e-4, "{what}: off by {off}");
}

/// Picked and met, lamps behind a pane are as bright as its tint says, sample by sample: no pane adds noise.
#[test]
fn lamps_behind_a_pane_are_tinted_and_nothing_else() {
    let tint = Vec3::new(0.5, 0.25, 0.75);
    for scale in [1e-3, 1.0, 1e3] {
        let clear = lit_floor(scale);
        let mut covered = lit_floor(scale);
        covered.quad([1e5 * scale as f32; 2], filter(tint), lid(scale));
        let mut twice = lit_floor(scale);
        // Mirrored and stretched; one of the two has both faces of a sheet.
        let place = scaled(lid(scale), DVec3::new(-3e3, 2e3, 1.0));
        twice.quad([50.0 * scale as f32; 2], filter(tint), place);
        twice.quad(
            [1e5 * scale as f32; 2],
            filter(tint),
            facing(DVec3::Y * 0.4 * scale, DVec3::ZERO),
        );
        for (way, mis) in every_way() {
            // All ways at one scale, some at the others.
            if scale != 1.0 && way.strategy != LightStrategy::Tree {
                continue;
            }
            let settings = way.settings(mis, &direct(8, 8));
            let [clear, covered, twice] =
                [&clear, &covered, &twice].map(|stage| stage.render(&settings));
            let what = format!("{way:?}, mis {mis}, scale {scale}");
            assert_tinted(&what, &covered, &clear, tint);
            assert_tinted(&format!("{what}, two"), &twice, &clear, tint * tint);
        }
    }
}

/// A pane that slides along itself, blurred, is one that stands.
#[test]
fn a_moving_pane_tints_as_one_that_stands() {
    let tint = Vec3::new(0.5, 0.25, 0.75);
    let mut moving = lit_floor(1.0);
    let node = moving.quad([1e3; 2], filter(tint), lid(1.0)).node;
    let path = [0.0, 1.0].map(|x| Vec3::new(x, 0.45, 0.0)).to_vec();
    let times_s = vec![0.0, 1.0];
    let keys = Keys { times_s, values: path, interpolation: Interpolation::Linear };
    moving.scene.nodes[node as usize].channels = vec![Channel::Translation(keys)];
    for mis in [false, true] {
        let settings = RenderSettings { mis, ..direct(8, 8) };
        let clear = lit_floor(1.0).render(&settings);
        assert_tinted("a sliding pane", &moving.render(&settings), &clear, tint);
    }
}

/// A pane in the place of a lamp does not cover it, whichever way the lamp is found.
#[test]
fn a_pane_flush_with_a_lamp_does_not_tint_it() {
    for scale in [1e-3, 1.0, 1e3] {
        let picture = |is_covered: bool, mis: bool| {
            let mut stage = lit_floor(scale);
            stage.scene.lights.clear();
            if is_covered {
                let place = facing(DVec3::new(-0.4, 1.0, 0.2) * scale, DVec3::ZERO);
                stage.quad([0.9 * scale as f32; 2], filter(Vec3::splat(0.5)), place);
            }
            stage.render(&RenderSettings { mis, ..direct(8, 8) })
        };
        for mis in [false, true] {
            let what = format!("scale {scale}, mis {mis}");
            assert_tinted(&what, &picture(true, mis), &picture(false, mis), Vec3::ONE);
        }
    }
}

/// What the eye sees through panes: lamps, a sky, a floor below them, the fog on the way.
#[test]
fn the_eye_sees_through_panes() {
    let tint = Vec3::new(0.5, 0.25, 0.75);
    let fog = |scattering: f32| Medium {
        scattering: Vec3::splat(scattering),
        absorption: Vec3::splat(0.1),
        anisotropy: 0.3,
        region: None,
    };
    for (medium, depth) in [(None, 0), (None, 1), (Some(fog(0.3)), 1)] {
        let picture = |is_covered: bool| {
            let mut stage = lit_floor(1.0);
            stage.scene.cameras.clear();
            let (eye, target) = (DVec3::new(0.2, 2.0, 1.5), DVec3::new(0.0, 0.6, 0.0));
            stage.look(eye, target, 0.9);
            let front = eye + (target - eye).normalize() * 1e-4;
            let color = if is_covered { tint } else { Vec3::ONE };
            stage.quad([3e-4; 2], filter(color), facing(front, eye));
            // The fog begins beyond the pane.
            let (node, half) = (stage.node(at(DVec3::ZERO)), Vec3::new(3.0, 1.5, 1.2));
            let region = Some(FogBox { node, min: -half, max: half });
            stage.scene.medium = medium.clone().map(|medium| Medium { region, ..medium });
            stage.render(&RenderSettings { depth, ..direct(12, 16) })
        };
        let what = format!("depth {depth}, fog {}", medium.is_some());
        assert_tinted(&what, &picture(true), &picture(false), tint);
    }
}

/// A pane that is white and mirrors nothing is not there.
#[test]
fn a_clear_pane_changes_no_light() {
    let [clear, covered] = [false, true].map(|is_covered| {
        let mut stage = lit_floor(1.0);
        if is_covered {
            stage.quad([3.0; 2], filter(Vec3::ONE), lid(1.0));
        }
        stage.render(&direct(8, 16))
    });
    assert_tinted("a clear pane", &covered, &clear, Vec3::ONE);
}

/// What glass lets through falls with Fresnel's term, at every angle and whichever side is up.
#[test]
fn grazing_light_is_mirrored_away() {
    for cosine in [1.0_f64, 0.7, 0.4, 0.2, 0.08] {
        let toward = DVec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
        for side in [DVec3::Y, -DVec3::Y] {
            let picture = |is_covered: bool| {
                let mut stage = crate::closed_forms::receiver(toward);
                let point = LightKind::Point { intensity_cd: Vec3::splat(20.0) };
                stage.light(point, at(toward * 4.0));
                if is_covered {
                    let place = toward * 2.0;
                    stage.quad([0.5; 2], pane(Vec3::ONE), facing(place, place + side));
                }
                stage.render(&direct(4, 64))
            };
            let (clear, covered) = (picture(false), picture(true));
            let ratio = covered.beauty().next().unwrap() / clear.beauty().next().unwrap();
            let expected = 1.0 - (0.04 + 0.96 * (1.0 - cosine).powi(5));
            // The table of albedos is what the reflection has, too.
            assert!(
                (f64::from(ratio.x) - expected).abs() < 1.2e-2,
                "{ratio} {expected} at {cosine}"
            );
        }
    }
}

/// A cut-out pane tints as often as it is there.
#[test]
fn half_a_pane_tints_half_of_the_light() {
    let half = Material { opacity: 0.5, alpha_mode: AlphaMode::Blend, ..filter(Vec3::splat(0.2)) };
    let mut stage = crate::closed_forms::receiver(DVec3::Y);
    stage.light(LightKind::Point { intensity_cd: Vec3::splat(10.0) }, at(DVec3::Y * 2.0));
    stage.quad([1.0; 2], half, facing(DVec3::Y, DVec3::ZERO));
    let expected = 10.0 / 4.0 * 0.6 * crate::closed_forms::ALBEDO / std::f64::consts::PI;
    assert_even("half a pane", &stage.render(&direct(8, 1024)), expected, 0.01);
}

/// A pane that some rays do not meet: it tints what it shades, or is not there.
#[test]
fn hidden_panes_tint_where_they_cast_shadows() {
    for number in 0..8 {
        let [camera, reflections, shadows] = [1, 2, 4].map(|bit| number & bit != 0);
        let tint = Vec3::splat(0.5);
        for mis in [false, true] {
            let mut covered = lit_floor(1.0);
            covered.quad([1e5; 2], filter(tint), lid(1.0)).visibility =
                Visibility { camera, reflections, shadows };
            let settings = Way::split(0.0).settings(mis, &direct(8, 8));
            let expected = if shadows { tint } else { Vec3::ONE };
            let clear = lit_floor(1.0).render(&settings);
            let what = format!("{camera} {reflections} {shadows}, mis {mis}");
            assert_tinted(&what, &covered.render(&settings), &clear, expected);
        }
    }
}

/// A lamp in whose shadow set a pane is not shines past it.
#[test]
fn a_pane_that_casts_no_shadow_of_a_lamp_does_not_tint_it() {
    let tint = Vec3::new(0.5, 0.25, 0.75);
    let picture = |is_kept: bool| {
        let mut stage = lit_floor(1.0);
        let all = stage.scene.lights.len() as u32;
        stage.quad([1e5; 2], filter(tint), lid(1.0));
        let row = stage.scene.instances.len() as u32 - 1;
        if is_kept {
            let lights = (0..all).map(Lamp::Light).chain([Lamp::Mesh(2)]);
            let kept: Vec<Kept> = lights.map(|lamp| Kept::Shadows(lamp, vec![Some(row)])).collect();
            link(&mut stage.scene, &kept);
        }
        stage.render(&RenderSettings { mis: false, ..direct(8, 8) })
    };
    let clear = lit_floor(1.0).render(&RenderSettings { mis: false, ..direct(8, 8) });
    assert_tinted("linked", &picture(true), &clear, Vec3::ONE);
    assert_tinted("not linked", &picture(false), &clear, tint);
}

/// In fog, behind panes that mirror and overlap, all ways agree.
#[test]
fn ways_agree_in_fog_between_panes() {
    let mut room =
        rooms::of_every_material().into_iter().find(|room| room.name == "panes").unwrap();
    let (scattering, absorption) = (Vec3::splat(0.15), Vec3::new(0.05, 0.1, 0.2));
    room.stage.scene.medium =
        Some(Medium { scattering, absorption, anisotropy: 0.4, region: None });
    let ways =
        [(Way::of(LightStrategy::All), false), (Way::split(0.5), true), (Way::split(1.0), true)];
    assert_agreement(&Room { name: "foggy panes".into(), ..room }, &ways);
}

/// A pane shows in all layers as a surface does; the albedo is that of both.
#[test]
fn layers_show_the_pane_and_the_albedo_what_is_seen_through_it() {
    let picture = |glass: Option<Material>| {
        let mut stage = Stage::default();
        stage.quad([9.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Z));
        if let Some(glass) = glass {
            let node =
                stage.quad([9.0; 2], glass, facing(DVec3::Z, DVec3::new(0.5, 0.0, 2.0))).node;
            assert_eq!(&*stage.scene.nodes[node as usize].path, "/node_1");
        }
        stage.look(DVec3::Z * 3.0, DVec3::ZERO, 0.2);
        let aovs = vec![
            Aov::Variance,
            Aov::Depth,
            Aov::Normal,
            Aov::Albedo,
            Aov::Cryptomatte,
            Aov::Position,
        ];
        stage.render(&RenderSettings { aovs, ..direct(3, 32) })
    };
    let middle = |buffers: &RenderBuffers, name: &str| {
        buffers.channel(name).unwrap_or_else(|| panic!("{name}")).nth(4).unwrap()
    };
    let behind = picture(None);
    let seen = picture(Some(filter(Vec3::splat(0.5))));
    let like = picture(Some(lambert(Vec3::splat(0.5))));
    for name in ["Z", "N.X", "N.Z", "P.Z", "CryptoObject00.R", "CryptoObject00.G", "A"] {
        assert_eq!(middle(&seen, name), middle(&like, name), "{name}");
    }
    assert_ne!(middle(&seen, "Z"), middle(&behind, "Z"));
    assert!((middle(&seen, "albedo.R") - 0.25).abs() < 1e-3);
    let mirrors = middle(&picture(Some(pane(Vec3::ONE))), "albedo.R");
    assert!(mirrors > 0.5 && mirrors < 0.6, "{mirrors}");
    assert!(pixels(&seen).iter().all(|pixel| pixel.alpha == 1.0));
}
