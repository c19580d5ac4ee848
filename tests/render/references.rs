//! Pictures that other renderers agree on (Mitsuba 3, pbrt-v4, Cycles 5), by the metric of the
//! folder's README.

use crate::shared;
use crate::stage::Set;
use crate::statistics::{blocks, pixels};
use candelabra::math::color::luminance;
use candelabra::pipeline;
use candelabra::render::RenderSettings;
use candelabra::render::buffers::RenderBuffers;
use candelabra::scene::Scene;
use exr::prelude::read_first_rgba_layer_from_file;
use glam::Vec3;
use std::path::Path;

/// How far apart the means may be.
const MEAN_OFF: f64 = 0.005;
/// The quadratic mean and the largest of the blocks' differences, in standard errors.
const RMS_SIGMAS: f64 = 1.3;
const MOST_SIGMAS: f64 = 8.0;
const BLOCK: u32 = 8;
/// What the reference itself may be off in a block, relative: its noise, and its ray epsilons. Of three pictures of the
/// ribbon with seeds of their own, blocks are off together by 2.8e-3.
const OFF_OF_REFERENCE: f64 = 2.8e-3;

/// Luminance, row after row.
fn read(path: &Path) -> (u32, u32, Vec<f64>) {
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![0.0; size.area()]),
        |(width, values): &mut (usize, Vec<f64>), at, (r, g, b, _): (f32, f32, f32, f32)| {
            values[at.y() * *width + at.x()] = f64::from(luminance(Vec3::new(r, g, b)));
        },
    );
    let image = image.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let (width, values) = image.layer_data.channel_data.pixels;
    (width as u32, (values.len() / width) as u32, values)
}

fn load(folder: &Path, scene: &str) -> Scene {
    pipeline::load_scene(&folder.join(scene)).unwrap_or_else(|error| panic!("{error}"))
}

/// Pixels in which the reference shows something and no emitter is seen, nor beside which: what a
/// few samples find of one may be in the next pixel too.
fn compared(set: &Set, settings: &RenderSettings, reference: &[f64]) -> Vec<bool> {
    let emitters = set.render(&RenderSettings { depth: 0, ..settings.clone() }, 1);
    let beauty: Vec<Vec3> = emitters.beauty().collect();
    let (width, height) = (settings.width, settings.height);
    let floor = 1e-6 * reference.iter().sum::<f64>() / reference.len() as f64;
    let shines = |x: u32, y: u32| beauty[(y * width + x) as usize] != Vec3::ZERO;
    let is_compared = |pixel: u32| {
        let (x, y) = (pixel % width, pixel / width);
        let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        let columns = || x.saturating_sub(1)..=(x + 1).min(width - 1);
        let near_emitter =
            rows.flat_map(|y| columns().map(move |x| (x, y))).any(|(x, y)| shines(x, y));
        reference[pixel as usize] > floor && !near_emitter
    };
    (0..width * height).map(is_compared).collect()
}

/// Luminance of a picture, and the variance of each pixel's mean. The channels of these scenes are
/// strongly correlated; the variance is that of fully correlated ones.
fn luminances(buffers: &RenderBuffers) -> Vec<(f64, f64)> {
    let deviation = |v: Vec3| f64::from(luminance(Vec3::from_array(v.to_array().map(f32::sqrt))));
    let pixels = pixels(buffers).into_iter();
    pixels.map(|p| (f64::from(luminance(p.beauty)), deviation(p.variance).powi(2))).collect()
}

fn assert_like(scene: &str, reference: &str, samples: u32, depth: u32) {
    let Some(folder) = shared::folder("reference") else { return };
    let scene_file = load(&folder, scene);
    let set = Set::of(&scene_file, &[1]);
    let (width, height, expected) = read(&folder.join(reference));
    let settings = RenderSettings { width, height, samples, depth, ..Default::default() };
    let kept = compared(&set, &settings, &expected);
    let buffers = set.render(&settings, 1);
    let seen = luminances(&buffers);

    let chosen = || (0..kept.len()).filter(|&pixel| kept[pixel]);
    let count = chosen().count() as f64;
    assert!(count > 0.3 * kept.len() as f64, "only {count} pixels of {reference} are compared");
    let mean = chosen().map(|pixel| expected[pixel]).sum::<f64>() / count;
    let ratio = chosen().map(|pixel| seen[pixel].0).sum::<f64>() / count / mean;
    let error = |pixel: usize| {
        let (x, r) = (seen[pixel].0, expected[pixel]);
        (x - r).powi(2) / (r * r + (0.01 * mean).powi(2))
    };
    let relative_mse = chosen().map(error).sum::<f64>() / count;
    let sigmas: Vec<f64> = blocks(&buffers, BLOCK)
        .filter_map(|block| {
            let (mut off, mut variance, mut sum) = (0.0, 0.0, 0.0);
            for pixel in block.into_iter().filter(|&pixel| kept[pixel]) {
                off += seen[pixel].0 - expected[pixel];
                variance += seen[pixel].1;
                sum += expected[pixel];
            }
            let own = (OFF_OF_REFERENCE * sum).powi(2);
            (variance > 0.0).then(|| off / (variance + own).sqrt())
        })
        .collect();
    let rms = (sigmas.iter().map(|z| z * z).sum::<f64>() / sigmas.len() as f64).sqrt();
    let most = sigmas.iter().fold(0.0, |most: f64, z| most.max(z.abs()));
    let told = format!(
        "{reference}, {samples} samples: mean ratio {ratio:.5}, relMSE {relative_mse:.5}, blocks \
         {rms:.2} sigma, {most:.2} at most"
    );
    println!("{told}");
    assert!((ratio - 1.0).abs() < MEAN_OFF, "{told}");
    assert!(rms < RMS_SIGMAS && most < MOST_SIGMAS, "{told}");
}

/// Seven in ten thousand are missing, all of it where stones touch: with the ray epsilons of the
/// renderer that made the reference a sum over all lights finds them there.
#[test]
fn ten_thousand_points() {
    assert_like("spiral10k.glb", "spiral10k_direct.exr", 64, 1);
}

#[test]
fn a_ribbon_of_twenty_thousand_triangles() {
    assert_like("spiralmesh.glb", "spiralmesh_direct.exr", 64, 1);
}

#[test]
fn the_ribbon_after_two_more_bounces() {
    assert_like("spiralmesh.glb", "spiralmesh_2bounces_64.exr", 256, 3);
}
