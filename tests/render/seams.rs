//! No seams in the noise: where the decision to split changes, variance does not jump.

use crate::stage::{Set, Stage, at, direct, facing, lambert};
use crate::strategies::Way;
use candelabra::light_tree::Veil;
use candelabra::light_tree::learned::{Plane, Table};
use candelabra::render::{LightStrategy, RenderDelegate, RenderSettings, SplitBy};
use candelabra::scene::LightKind;
use glam::{DVec3, Vec3};

const SAMPLES: u32 = 1 << 13;

/// Splitting by some knob. Clusters are weighed by distance alone: by what is expected of them, these lights would be
/// picked so well that no decision could be seen.
fn split(knob: f32) -> Way {
    Way { strategy: LightStrategy::Distance, ..Way::split(knob) }
}

/// The relative variance of one sample of each pixel of a row across a floor, away from a cluster of lights
/// above its one end.
fn profile(way: Way, table: impl Fn(&Set) -> Table) -> Vec<f64> {
    const PIXELS: u32 = 96;
    let mut stage = Stage::default();
    stage.quad([12.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    for i in 0..256 {
        let (x, z) = (f64::from(i % 16) / 16.0 - 3.5, f64::from(i / 16) / 16.0 - 0.5);
        let bump = 0.1 * f64::from(i * 7 % 5);
        let intensity_cd = Vec3::splat(0.02);
        stage.light(LightKind::Point { intensity_cd }, at(DVec3::new(x, 0.6 + bump, z)));
    }
    // Far away, so that the row is a straight line of even steps.
    stage.look(DVec3::new(0.0, 400.0, 1e-3), DVec3::ZERO, 6.0 / 400.0 / PIXELS as f32);
    let mut settings = way.settings(true, &direct(PIXELS, 1));
    settings.height = 1;
    // Pictures of one sample each: those of one picture are not independent.
    let set = stage.set();
    let (emitters, tree) = (&set.emitters, &set.tree);
    let table = table(&set);
    let camera = stage.scene.cameras[0].clone();
    let mut delegate = RenderDelegate::new(&stage.scene, emitters, camera, settings.clone());
    delegate.set_learned(table.view());
    let mut sums = [[0.0; 2]; PIXELS as usize];
    for seed in 0..SAMPLES {
        delegate.set_settings(RenderSettings { seed, ..settings.clone() });
        let frame = delegate.render(tree, 1, &()).unwrap();
        for (sum, light) in sums.iter_mut().zip(frame.buffers.beauty()) {
            let light = f64::from(light.y);
            *sum = [sum[0] + light, sum[1] + light * light];
        }
    }
    let relative_variance = |[sum, squares]: &[f64; 2]| {
        let mean = sum / f64::from(SAMPLES);
        (squares / f64::from(SAMPLES) - mean * mean) / (mean * mean)
    };
    // From beside the cluster on: below it, each light is a hill of its own.
    sums[24..].iter().map(relative_variance).collect()
}

/// The largest factor between neighbours.
fn largest_jump(profile: &[f64]) -> f64 {
    let steps: Vec<f64> = profile.windows(2).map(|pair| (pair[1] / pair[0]).ln().abs()).collect();
    steps.iter().fold(0.0, |most: f64, &step| most.max(step)).exp()
}

#[test]
fn variance_changes_smoothly_where_the_seed_has_seams() {
    let most = u32::MAX;
    let none = |_: &Set| Table::default();
    let hard = profile(Way { split_by: SplitBy::SolidAngle, most, ..split(0.99) }, none);
    let graded = profile(Way { most, ..split(0.1) }, none);
    let print = |name: &str, profile: &[f64]| {
        let row: Vec<String> = profile.iter().step_by(3).map(|v| format!("{v:.4}")).collect();
        println!("{name}: {} (largest step {:.2})", row.join(" "), largest_jump(profile));
    };
    print("whole or not at all", &hard);
    print("graded", &graded);
    // Of each, about 0.07 is how well the variance can be told.
    assert!(largest_jump(&hard) - 1.0 > 2.0 * (largest_jump(&graded) - 1.0));
    assert!(largest_jump(&graded) < 1.15);
}

/// Two cells, one of which takes half of the lights for half hidden. The band is that of cells which are a
/// metre and a half wide.
#[test]
fn cells_have_no_seams() {
    let table = |width: f32| {
        move |set: &Set| {
            let row =
                |byte| Veil { group: 0, weights: [255, byte, 255, byte, 255, byte, 255, byte] };
            let planes = vec![Plane { at: 0.8, width, axis: 0 }];
            Table {
                tree: set.tree.still_key(),
                planes,
                rows: vec![row(255), row(215)],
                ..Table::default()
            }
        }
    };
    let [sharp, soft] = [0.0, 0.75].map(|width| largest_jump(&profile(split(0.1), table(width))));
    println!("sharp {sharp:.2}, soft {soft:.2}");
    assert!(sharp > 1.2, "the cells do not differ: {sharp:.2}");
    assert!(soft - 1.0 < 0.5 * (sharp - 1.0), "{soft:.2} of {sharp:.2}");
}
