//! The pilot: a few paths of a shot that find out which knobs are best for it.
//!
//! It traces paths through pixels that are spread over the picture, and at each point also picks lights with
//! other knobs (`trial`). The error is that of [`noise`](crate::render::noise). It depends
//! on scene, tree, frame and settings alone. A shot takes the knobs of one frame, the same in every process.

use super::choice::{Findings, Tried};
use super::prices::cost;
use super::trial::{Each, KNOBS, Trial};
use super::{Knobs, Split};
use crate::light_tree::{LightTree, NoSuchFrame};
use crate::math::color::luminance;
use crate::math::random::hash;
use crate::render::noise::{Grey, Halves};
use crate::render::path::{Integrator, PathScratch, TraceStats};
use crate::render::{RenderDelegate, RenderSettings};
use rayon::prelude::*;
use std::ops::Range;

/// Paths through a pixel, in each of its two halves.
const PATHS: u32 = 4;
/// One pilot path for so many paths of a frame. With all that is tried on it, and the plain ones, it takes the
/// time of about twenty.
const FRAME_PATHS: u64 = 500;
/// Pixels that are enough.
const MOST_PIXELS: u64 = 512;
/// The noise of everything but picking is in few pixels, those of edges and small lamps. So it is told from so
/// many times as many pixels, on which no knobs are tried.
const PLAIN: u32 = 8;
/// With fewer nothing can be learnt.
const LEAST_PIXELS: u64 = 24;
/// No pixel is more than this share of the noise: one bright sample would decide alone.
const LARGEST_SHARE: f64 = 0.125;
/// Standard errors of a mean. If noise is rare the mean is above it more often than in a normal distribution: one time in six
/// where one pixel in fifty has all of it and 160 are looked at.
const SURE: f64 = 2.0;
/// The random numbers are not those of any frame.
const SEED: u32 = 0x6b6e_6f62;
/// The first of [`KNOBS`] that are tried only if the one before turns out to be the best: they cost most.
const FIRST_COSTLY: usize = 6;

/// The knobs for a shot with the delegate's settings, by a frame of it. Without [`Split::Auto`] they are
/// those that the settings tell. If an `error` is asked for, a frame has as many samples as that may take,
/// at most those of the settings. A picture of few paths gets the usual knobs, because to find out more
/// would cost more than it gains.
///
/// # Errors
/// If the tree lacks the frame.
///
/// # Panics
/// As [`RenderDelegate::at_frame`].
pub fn pilot(
    delegate: &RenderDelegate,
    tree: &LightTree<impl AsRef<[u8]>>,
    frame: i32,
    error: Option<f64>,
) -> Result<Knobs, NoSuchFrame> {
    delegate.at_frame(tree, frame, |integrator| knobs_for(integrator, error))
}

/// Whether a pilot has anything to find out for these settings.
pub fn pilot_pays(settings: &RenderSettings) -> bool {
    pixels_for(settings, settings.samples).is_some()
}

/// How many pixels a pilot takes for a frame of so many samples a pixel, if it pays.
fn pixels_for(settings: &RenderSettings, samples: u32) -> Option<u64> {
    let paths = [settings.width, settings.height, samples].map(u64::from);
    let pixels =
        (paths.iter().product::<u64>() / FRAME_PATHS / u64::from(2 * PATHS)).min(MOST_PIXELS);
    let is_asked = settings.split == Split::Auto && settings.strategy.splits();
    (is_asked && settings.depth > 0 && pixels >= LEAST_PIXELS).then_some(pixels)
}

fn knobs_for(integrator: &Integrator, error: Option<f64>) -> Knobs {
    let settings = integrator.settings;
    let mut plain = Plain::default();
    let samples = match error {
        Some(error) if pilot_pays(settings) => plain.samples_for(integrator, error),
        _ => settings.samples,
    };
    let Some(pixels) = pixels_for(settings, samples) else { return settings.split.knobs() };
    let tried = |kind: usize, range: Range<usize>| {
        if kind < settings.depth as usize { range } else { 0..0 }
    };
    let handicap = MOST_PIXELS as f64 / pixels as f64;
    let cheap = std::array::from_fn(|kind| tried(kind, 0..FIRST_COSTLY));
    let mut findings = Findings {
        variance: steady_mean(plain.squared_errors(integrator, PLAIN * pixels as u32)),
        ..traced(integrator, pixels as u32, cheap)
    };
    let best = findings.best(handicap);
    let costly: [Range<usize>; Knobs::KINDS] = std::array::from_fn(|kind| {
        let is_last = best.by_bounce[kind] >= KNOBS[FIRST_COSTLY - 1];
        tried(kind, if is_last { FIRST_COSTLY..KNOBS.len() } else { 0..0 })
    });
    if costly.iter().all(Range::is_empty) {
        return best;
    }
    let more = traced(integrator, pixels as u32, costly);
    let known = findings.picking.as_flattened_mut().iter_mut();
    known.zip(more.picking.as_flattened()).for_each(|(own, new)| *own = own.or(*new));
    findings.best(handicap)
}

/// Pixels with the usual knobs, on which none are tried.
#[derive(Default)]
struct Plain(Vec<Halves>);

impl Plain {
    /// The squared errors of so many pixels. Those that are known are not traced again.
    fn squared_errors(&mut self, integrator: &Integrator, pixels: u32) -> Vec<f64> {
        let row = |number| pixel(integrator, number, &Default::default()).halves;
        self.0.par_extend((self.0.len() as u32..pixels).into_par_iter().map(row));
        let grey = grey(self.0.iter());
        self.0.iter().map(|halves| halves.squared_error(grey)).collect()
    }

    /// How many samples a pixel takes in the mean, to an error and at most those of the settings. Where few pixels hold
    /// most of the noise, few pixels of a pilot tell little of it, and a frame takes more samples to be sure. So
    /// this is the upper end of what the pixels tell; and if by that the pilot takes more pixels, those are asked, too.
    fn samples_for(&mut self, integrator: &Integrator, error: f64) -> u32 {
        let settings = integrator.settings;
        let frame = u64::from(settings.width) * u64::from(settings.height);
        let first = LEAST_PIXELS..=LEAST_PIXELS * u64::from(PLAIN);
        let mut pixels = (frame / u64::from(2 * PATHS)).clamp(*first.start(), *first.end());
        loop {
            let errors = self.squared_errors(integrator, pixels as u32);
            let samples = (f64::from(2 * PATHS) * surely_below(&errors, frame as f64)
                / (error * error))
                .clamp(1.0, f64::from(settings.samples)) as u32;
            let wanted = u64::from(PLAIN) * pixels_for(settings, samples).unwrap_or(0);
            if wanted <= pixels {
                return samples;
            }
            pixels = wanted.min(2 * pixels);
        }
    }
}

/// The mean squared error that a frame of so many pixels proves to be below, by the squared errors of some of them.
/// Pixels without noise do not count. The first factor is what the few pixels may have missed, the second what the
/// frame takes to be sure of its own mean.
fn surely_below(errors: &[f64], frame: f64) -> f64 {
    let noisy: Vec<f64> = errors.iter().copied().filter(|&own| own > 0.0).collect();
    let count = noisy.len().max(1) as f64;
    let mean = noisy.iter().sum::<f64>() / count;
    if mean == 0.0 {
        return 0.0;
    }
    let spread = noisy.iter().map(|own| (own / mean - 1.0).powi(2)).sum::<f64>() / count;
    let noisy_of_frame = frame * count / errors.len() as f64;
    let margin = |pixels: f64| 1.0 + SURE * (spread / pixels).sqrt();
    mean * margin(count) * margin(noisy_of_frame)
}

/// What the paths through one pixel showed.
struct Pixel {
    halves: Halves,
    /// Variance of the pixel's mean that is from picking.
    picking: Each<f64>,
    /// What picking cost.
    spent: Each<TraceStats>,
    /// What the paths themselves cost.
    own: TraceStats,
}

/// The grey floor for some pixels.
fn grey<'a>(pixels: impl ExactSizeIterator<Item = &'a Halves>) -> Grey {
    let count = pixels.len() as f64;
    Grey::below(pixels.map(Halves::luminance).sum::<f64>() / count)
}

/// Traces the paths and tries some knobs at their points. The variance is not told.
fn traced(integrator: &Integrator, pixels: u32, tried: [Range<usize>; Knobs::KINDS]) -> Findings {
    let row = |number| pixel(integrator, number, &tried);
    let pixels: Vec<Pixel> = (0..pixels).into_par_iter().map(row).collect();
    let count = pixels.len() as f64;
    let grey = grey(pixels.iter().map(|pixel| &pixel.halves));
    let error = |of: &dyn Fn(&Pixel) -> f64| {
        let own = |pixel: &Pixel| grey.of_deviation(of(pixel), pixel.halves.luminance());
        steady_mean(pixels.iter().map(own).collect())
    };
    let paths = count * f64::from(2 * PATHS);
    let spent = |of: &dyn Fn(&Pixel) -> TraceStats| {
        cost(&pixels.iter().map(of).fold(TraceStats::default(), TraceStats::plus)) / paths
    };
    let mut findings = Findings {
        cost: spent(&|pixel| TraceStats {
            rays: pixel.own.rays - pixel.own.shadow_rays,
            ..TraceStats::default()
        }),
        ..Findings::default()
    };
    for (kind, range) in tried.into_iter().enumerate() {
        for knob in range {
            findings.picking[kind][knob] = Some(Tried {
                variance: error(&|pixel| pixel.picking[kind][knob]),
                // Two estimates were made.
                cost: 0.5 * spent(&|pixel| pixel.spent[kind][knob]),
            });
        }
    }
    findings
}

/// The mean, in which none of the numbers counts for more than a share of all of them.
fn steady_mean(numbers: Vec<f64>) -> f64 {
    let most = LARGEST_SHARE * numbers.iter().sum::<f64>();
    numbers.iter().map(|number| number.min(most)).sum::<f64>() / numbers.len() as f64
}

fn pixel(integrator: &Integrator, number: u32, tried: &[Range<usize>; Knobs::KINDS]) -> Pixel {
    let settings = integrator.settings;
    // The additive sequence of the plastic number (Roberts 2018) spreads any number of pixels evenly.
    let along =
        |step: f64, length: u32| ((f64::from(number) * step).fract() * f64::from(length)) as u32;
    let (x, y) = (
        along(0.754_877_666_246_693, settings.width),
        along(0.569_840_290_998_053, settings.height),
    );
    let trial = Box::new(Trial::new(*integrator.picker.splitting(0), tried.clone()));
    let mut scratch = PathScratch::default();
    scratch.trial = Some(trial);
    let mut halves = Halves { counts: [PATHS; 2], ..Halves::default() };
    let mut picking = Each::default();
    for half in 0..2 {
        let seed = hash(hash(SEED, number), half);
        let mut sum = 0.0;
        for index in 0..PATHS {
            if let Some(trial) = &mut scratch.trial {
                if index == 0 {
                    trial.begin(seed);
                }
                trial.next_path(index);
            }
            let light =
                f64::from(luminance(integrator.trace(x, y, seed, index, &mut scratch).radiance));
            sum += if light.is_finite() { light } else { 0.0 };
        }
        halves.means[half as usize] = sum / f64::from(PATHS);
        let found = scratch.trial.as_ref().map(|trial| trial.differences).unwrap_or_default();
        for (sum, difference) in picking.as_flattened_mut().iter_mut().zip(found.as_flattened()) {
            // Half a squared difference is the variance of a half's mean; a quarter of it that of both.
            let off = difference / f64::from(PATHS);
            *sum += if off.is_finite() { 0.125 * off * off } else { 0.0 };
        }
    }
    let spent = scratch.trial.map(|trial| trial.spent).unwrap_or_default();
    Pixel { halves, picking, spent, own: scratch.stats }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_noise_has_no_margin_and_sky_does_not_count() {
        let mut errors = vec![0.04; 100];
        assert!((surely_below(&errors, 1e4) / 0.04 - 1.0).abs() < 1e-12);
        errors.resize(400, 0.0);
        assert!((surely_below(&errors, 1e4) / 0.04 - 1.0).abs() < 1e-12);
        assert_eq!(surely_below(&[0.0; 9], 1e4), 0.0);
    }

    /// Where one pixel in fifty holds nearly all noise, a few pixels have mostly seen too little of it.
    #[test]
    fn a_frame_seldom_has_more_noise_than_its_pilot_expects() {
        const DRAWS: u32 = 1000;
        const MEAN: f64 = 0.02 + 0.98 * 1e-3;
        let error = |number: u32| if hash(SEED, number).is_multiple_of(50) { 1.0 } else { 1e-3 };
        let pixels = |draw: u32| (160 * draw..160 * (draw + 1)).map(error).collect::<Vec<f64>>();
        let (mut naive, mut short) = (0, 0);
        for draw in 0..DRAWS {
            let errors = pixels(draw);
            naive += u32::from(errors.iter().sum::<f64>() / 160.0 < MEAN);
            short += u32::from(surely_below(&errors, 1e9) < MEAN);
        }
        assert!(naive > DRAWS / 2, "the mean alone is too small {naive} times");
        assert!(short < DRAWS / 5, "too small {short} times");
        // A small frame has to prove more.
        let mut errors = vec![1e-3; 160];
        errors[0] = 1.0;
        assert!(surely_below(&errors, 400.0) > 1.5 * surely_below(&errors, 1e9));
    }
}
