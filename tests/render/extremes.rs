//! Size and brightness do not show: what is a room in metres is a room in micrometres.

use crate::rooms;
use crate::stage::{Stage, by, scaled};
use candelabra::render::buffers::{Pixel, RenderBuffers};
use candelabra::render::{LightStrategy, RenderSettings};
use candelabra::scene::{LightKind, Trs};
use glam::DVec3;

fn everything() -> Stage {
    let mut stage = rooms::lambert_room();
    rooms::all_lights(&mut stage);
    stage
}

/// Everything is so many times as large, and so many times as bright; the picture of it should be
/// that many times as bright.
fn blown_up(size: f64, brightness: f32) -> Stage {
    let mut stage = everything();
    for node in &mut stage.scene.nodes {
        node.local = scaled(node.local, DVec3::splat(size));
        let Trs::Parts { translation, .. } = &mut node.local else { unreachable!() };
        *translation *= size;
    }
    let area = (size * size) as f32;
    for light in &mut stage.scene.lights {
        light.range_m = light.range_m.map(|range| range * size as f32);
        match &mut light.kind {
            LightKind::Point { intensity_cd } | LightKind::Spot { intensity_cd, .. } => {
                *intensity_cd *= area * brightness;
            }
            LightKind::Sphere { radiance_nits, .. } | LightKind::Dome { radiance_nits, .. } => {
                *radiance_nits *= brightness;
            }
            LightKind::Distant { irradiance_lux, .. } => *irradiance_lux *= brightness,
        }
    }
    for material in &mut stage.scene.materials {
        material.emission_nits *= brightness;
    }
    stage
}

fn render(stage: &Stage, strategy: LightStrategy) -> RenderBuffers {
    let settings = RenderSettings { width: 24, height: 24, samples: 16, ..Default::default() };
    stage.render(&by(strategy, true, &settings))
}

/// Powers of two change no digit of a number. What is left is the last bits of the random numbers
/// that pick lights, which come from coordinates: they may turn a pixel's sample here and there.
fn assert_same(what: &str, expected: &RenderBuffers, seen: &RenderBuffers, brightness: f32) {
    let sum = |buffers: &RenderBuffers| {
        buffers.pixels().iter().map(|pixel| pixel.beauty.as_dvec3().element_sum()).sum::<f64>()
    };
    let ratio = sum(seen) / sum(expected) / f64::from(brightness);
    assert!((ratio - 1.0).abs() < 2e-3, "{what}: {ratio}");
    let is_same = |a: &Pixel, b: &Pixel| {
        (b.beauty / brightness).abs_diff_eq(a.beauty, 1e-4 * a.beauty.max_element())
    };
    let pairs = expected.pixels().iter().zip(seen.pixels());
    let same = pairs.filter(|(a, b)| is_same(a, b)).count();
    assert!(same * 20 > 19 * expected.pixels().len(), "{what}: only {same} pixels are the same");
}

#[test]
fn size_does_not_show() {
    for strategy in [LightStrategy::Tree, LightStrategy::Exhaustive, LightStrategy::Uniform] {
        let expected = render(&everything(), strategy);
        for exponent in [-20, -10, 10, 20] {
            let size = 2f64.powi(exponent);
            let seen = render(&blown_up(size, 1.0), strategy);
            assert_same(&format!("{strategy:?}, {size} times as large"), &expected, &seen, 1.0);
        }
    }
}

#[test]
fn brightness_does_not_show() {
    for strategy in [LightStrategy::Tree, LightStrategy::Exhaustive, LightStrategy::Power] {
        let expected = render(&everything(), strategy);
        for exponent in [-40, 40] {
            let brightness = 2f32.powi(exponent);
            let seen = render(&blown_up(1.0, brightness), strategy);
            let what = format!("{strategy:?}, {brightness} times as bright");
            assert_same(&what, &expected, &seen, brightness);
        }
    }
}
