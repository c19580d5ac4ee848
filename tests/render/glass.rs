//! Glass that is rough or solid.

use crate::stage::{Stage, at, direct, facing, glow, lambert, milk, solid};
use crate::statistics::{Estimate, assert_even};
use crate::strategies::{Way, render};
use candelabra::render::{LightStrategy, RenderSettings};
use candelabra::scene::{LightKind, Material};
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

/// A lamp in the middle of a ball of glass, seen straight on: what Fresnel and Beer let through of its radiance, which is
/// higher in the glass.
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
