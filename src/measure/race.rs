//! Compares settings by the time that each takes to reach the same error.
//!
//! Every entrant renders the same frame several times with different seeds. All pictures have the same
//! expectation, so the variance between them is the error, and no reference is needed. The time to reach
//! another entrant's error follows, because error times time is constant as samples are added. Stratified
//! samples do better than that, so each entrant should get about as many samples as it needs.

use crate::light_tree::LightTree;
use crate::math::color::luminance;
use crate::render::{RenderDelegate, RenderError, RenderSettings};
use serde::Serialize;
use std::time::Instant;

/// Settings that take part in a race.
#[derive(Clone, Debug)]
pub struct Entrant {
    /// What it is called.
    pub name: String,
    /// How it renders.
    pub settings: RenderSettings,
}

/// How the race is run.
#[derive(Clone, Copy, Debug)]
pub struct RaceOptions {
    /// The frame.
    pub frame: i32,
    /// Pictures by each, at least 2.
    pub pictures: u32,
}

/// The result of one entrant.
#[derive(Clone, Debug, Serialize)]
pub struct Result {
    /// What it is called.
    pub name: String,
    /// Seconds for a picture, the median.
    pub seconds: f64,
    /// The variance of a pixel over its squared luminance, in the mean over the pixels. The square of a
    /// hundredth of the picture's mean luminance is added to the denominator.
    pub error: f64,
    /// Seconds that it would take to reach the error of the first entrant.
    pub seconds_to_error_of_first: f64,
    /// The picture's mean luminance. All entrants should agree in it.
    pub mean: f64,
    /// Lights sampled for a path, in the mean.
    pub lights: f64,
}

/// Runs a race. `done` is called after every picture.
///
/// # Errors
/// If the tree lacks the frame, or settings do not fit the scene.
pub fn race(
    delegate: &mut RenderDelegate,
    tree: &LightTree<impl AsRef<[u8]>>,
    entrants: &[Entrant],
    options: &RaceOptions,
    mut done: impl FnMut(),
) -> std::result::Result<Vec<Result>, RenderError> {
    let mut results: Vec<Result> = Vec::new();
    for entrant in entrants {
        let mut times = Vec::new();
        let mut sums: Vec<[f64; 2]> = Vec::new();
        let mut lights = 0;
        for picture in 0..options.pictures.max(2) {
            let seed = entrant.settings.seed.wrapping_add(picture);
            delegate.set_settings(RenderSettings { seed, ..entrant.settings.clone() });
            let started = Instant::now();
            let rendered = delegate.render(tree, options.frame, &())?;
            times.push(started.elapsed().as_secs_f64());
            lights += rendered.stats.trace.light_picks;
            sums.resize(rendered.buffers.beauty().count(), [0.0; 2]);
            for (sum, beauty) in sums.iter_mut().zip(rendered.buffers.beauty()) {
                let value = f64::from(luminance(beauty));
                sum[0] += value;
                sum[1] += value * value;
            }
            done();
        }
        times.sort_unstable_by(f64::total_cmp);
        let count = times.len() as f64;
        let mean = sums.iter().map(|sum| sum[0]).sum::<f64>() / (count * sums.len() as f64);
        let floor = (0.01 * mean).powi(2).max(f64::MIN_POSITIVE);
        let error = sums.iter().map(|[sum, squares]| {
            let own = sum / count;
            let variance = (squares - sum * own).max(0.0) / (count - 1.0);
            variance / (own * own + floor)
        });
        let error = error.sum::<f64>() / sums.len() as f64;
        let seconds = times[times.len() / 2];
        let settings = &entrant.settings;
        let paths = f64::from(settings.width) * f64::from(settings.height);
        let paths = paths * f64::from(settings.samples) * count;
        let goal = results.first().map_or(error, |first| first.error);
        results.push(Result {
            name: entrant.name.clone(),
            seconds,
            error,
            seconds_to_error_of_first: seconds * error / goal,
            mean,
            lights: lights as f64 / paths,
        });
    }
    Ok(results)
}
