//! Glass that is rough or solid.

use crate::linking::{Kept, Lamp, link};
use crate::stage::{Stage, aimed, at, direct, facing, glow, lambert, milk, solid};
use crate::statistics::{Estimate, assert_even};
use crate::strategies::{Way, render};
use candelabra::render::{LightStrategy, RenderSettings};
use candelabra::scene::{LightKind, Material, Visibility};
use glam::{DVec3, Vec3};

/// A camera that sees almost one ray.
fn ray(stage: &mut Stage, from: DVec3) {
    stage.look(from, DVec3::ZERO, 1e-4);
}

/// Clear glass of any roughness neither takes nor gives light; what bounces between microfacets may be lost.
#[test]
fn clear_solid_glass_is_not_seen_in_a_white_dome() {
    for (roughness, loss) in [(0.0, 5e-3), (0.3, 0.08)] {
        for (what, scale) in [("ball", DVec3::ONE), ("slab", DVec3::new(1.0, 0.1, 1.0))] {
            let mut stage = Stage::default();
            let glass = Material { roughness, ..solid(1.5, Vec3::ZERO) };
            let place = crate::stage::scaled(at(DVec3::ZERO), scale);
            stage.ball(0.5, 12, glass, place);
            let sky = LightKind::Dome { radiance_nits: Vec3::ONE, texture: None };
            stage.light(sky, at(DVec3::ZERO));
            stage.look(DVec3::new(0.3, 0.5, 0.8), DVec3::ZERO, 1.0);
            let seen = Estimate::of_picture(
                &stage.render(&RenderSettings { depth: 60, ..direct(8, 256) }),
            );
            let (mean, noise) = (seen.mean.x, 4.0 * seen.error.x);
            assert!(noise < 2e-2, "{what}, roughness {roughness}: {seen} is too noisy to tell");
            let fits = mean > 1.0 - loss - noise && mean < 1.0 + 5e-3 + noise;
            assert!(fits, "{what}, roughness {roughness}: {seen}");
        }
    }
}

/// A lamp in the middle of a ball of glass, seen straight on: what Fresnel and Beer let through of its radiance, which
/// is higher in the glass.
#[test]
fn a_lamp_with_area_inside_solid_glass_is_found() {
    let radiance = 5.0;
    for scale in [1e-3, 1.0, 1e3] {
        for absorption in [0.0, 0.7] {
            let mut stage = Stage::default();
            let s = scale as f32;
            let glass = solid(1.5, Vec3::splat(absorption / s));
            // Facets that face the eye.
            for axis in DVec3::AXES {
                for wall in [axis, -axis] {
                    stage.quad(
                        [2.0 * s; 2],
                        glass.clone(),
                        facing(wall * scale, 2.0 * wall * scale),
                    );
                }
            }
            let kind = LightKind::Sphere {
                radiance_nits: Vec3::splat(radiance),
                radius: 0.25 * s,
                shaping: None,
            };
            stage.light(kind, at(DVec3::ZERO));
            ray(&mut stage, DVec3::Z * 3.0 * scale);
            let through = 0.96 * (-0.75 * f64::from(absorption)).exp() / 2.25;
            for strategy in [LightStrategy::Tree, LightStrategy::Uniform] {
                let settings = RenderSettings { strategy, ..direct(4, 1024) };
                let what = format!("{strategy:?}, scale {scale}, absorption {absorption}");
                let expected = f64::from(radiance) * through;
                assert_even(&what, &stage.render(&settings), expected, 0.01);
            }
        }
    }
}

/// Glass that hardly bends is Beer's law and nothing else.
#[test]
fn glass_takes_light_by_beers_law() {
    let absorption = Vec3::new(0.2, 1.0, 3.0);
    let mut stage = Stage::default();
    let glass = Material { specular: 0.0, ..solid(1.0, absorption) };
    for z in [0.0, 0.8] {
        let front = if z > 0.0 { DVec3::Z } else { -DVec3::Z };
        let place = DVec3::Z * z;
        stage.quad([9.0; 2], glass.clone(), facing(place, place + front));
    }
    stage.quad([9.0; 2], glow(Vec3::ONE), facing(-DVec3::Z, DVec3::ZERO));
    let aside = DVec3::new(0.3, 0.1, 0.0);
    stage.look(aside + DVec3::Z * 2.0, aside, 1e-4);
    let buffers = stage.render(&RenderSettings { depth: 3, ..direct(2, 64) });
    for beauty in buffers.beauty() {
        let off = (beauty - (-0.8 * absorption).exp()).abs().max_element();
        assert!(off < 2e-3, "{beauty}");
    }
}

/// Two walls of glass that hardly bends, the front one at `z` and the other below it, over a floor at the origin.
fn over_a_floor(glass: Option<&Material>, [z, below]: [f64; 2]) -> Stage {
    let mut stage = Stage::default();
    stage.quad([9.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Z));
    for (place, front) in [(DVec3::Z * z, DVec3::Z), (DVec3::Z * below, -DVec3::Z)] {
        if let Some(glass) = glass {
            stage.quad([9.0; 2], glass.clone(), facing(place, place + front));
        }
    }
    let aside = DVec3::new(0.3, 0.1, 0.0);
    stage.look(aside + DVec3::Z * 2.0, aside, 1e-4);
    stage
}

#[track_caller]
fn assert_share(what: &str, seen: &Stage, clear: &Stage, expected: Vec3) {
    let mean = |stage: &Stage| {
        Estimate::of_picture(&stage.render(&RenderSettings { depth: 2, ..direct(2, 256) })).mean
    };
    let (seen, clear) = (mean(seen), mean(clear));
    let off = (seen / clear - expected.as_dvec3()).abs().max_element();
    assert!(clear.min_element() > 0.0 && off < 5e-3, "{what}: {seen} of {clear}, {expected}");
}

/// Light that glass does not block is absorbed as far as the glass goes.
#[test]
fn light_past_the_wall_of_glass_is_absorbed_inside_alone() {
    let absorption = Vec3::new(0.1, 0.4, 1.0);
    let glass = Material { specular: 0.0, ..solid(1.0, absorption) };
    let lamps = [
        LightKind::Distant { irradiance_lux: Vec3::ONE, angle_rad: 0.0 },
        LightKind::Point { intensity_cd: Vec3::ONE },
    ];
    for kind in lamps {
        let picture = |glass: Option<&Material>| {
            let mut stage = over_a_floor(glass, [0.8, -0.1]);
            let place = DVec3::new(0.3, 0.1, 5.0);
            stage.light(kind.clone(), aimed(place, place - DVec3::Z));
            if glass.is_some() {
                let kept = [Kept::Shadows(Lamp::Light(0), vec![Some(1), Some(2)])];
                link(&mut stage.scene, &kept);
            }
            stage
        };
        let expected = (-1.6 * absorption).exp();
        assert_share(&format!("{kind:?}"), &picture(Some(&glass)), &picture(None), expected);
    }
}

/// Who enters glass whose other wall is hidden from reflected rays leaves it all the same.
#[test]
fn a_path_leaves_glass_by_a_wall_that_it_does_not_meet() {
    let absorption = Vec3::new(0.2, 1.0, 3.0);
    let glass = Material { specular: 0.0, ..solid(1.0, absorption) };
    let picture = |glass: Option<&Material>| {
        let mut stage = over_a_floor(glass, [0.8, 0.4]);
        stage.light(LightKind::Point { intensity_cd: Vec3::ONE }, at(DVec3::new(-1.0, 0.1, 0.2)));
        for wall in stage.scene.instances.iter_mut().skip(1) {
            wall.visibility = Visibility { reflections: false, ..Visibility::ALL };
        }
        stage
    };
    let expected = (-0.4 * absorption).exp();
    assert_share("a hidden wall", &picture(Some(&glass)), &picture(None), expected);
}

/// A sheet of rough glass before a lamp lights a floor alike, however the lamp is picked.
#[test]
fn light_through_rough_glass_is_found_from_both_sides() {
    let picture = |sheet: Material, mis: bool, strategy| {
        let mut stage = Stage::default();
        stage.quad([6.0; 2], sheet, facing(DVec3::ZERO, DVec3::Y));
        for (y, color) in [(1.0, Vec3::new(1.0, 0.1, 0.1)), (-1.0, Vec3::new(0.1, 1.0, 0.1))] {
            stage.light(LightKind::Point { intensity_cd: color }, at(DVec3::new(0.3, y, 0.2)));
        }
        stage.look(DVec3::new(0.0, 2.0, 0.1), DVec3::ZERO, 0.3);
        let settings = Way::of(strategy).settings(mis, &direct(16, 64));
        Estimate::of_picture(&render(&stage.set(), settings, 1)).mean
    };
    let lambertian = picture(lambert(Vec3::ONE), true, LightStrategy::Tree);
    assert!(lambertian.x > 5.0 * lambertian.y, "an opaque floor sees the lamp above it");
    for sheet in [milk(0.8, 1.0), Material { roughness: 0.8, ..solid(1.5, Vec3::ZERO) }] {
        let seen = picture(sheet, true, LightStrategy::Tree);
        assert!(seen.y > 2.0 * seen.x, "{seen}: glass sees the lamp below it");
    }
}
