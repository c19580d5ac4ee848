//! The pilot: a few paths of a shot that find out which knobs are best for it.
//!
//! It traces paths through pixels that are spread over the picture (`sketch`), and in some of them also picks lights
//! with other knobs at each point (`trial`). The error is that of [`noise`](crate::render::noise), and so is the grey floor:
//! above one of the mean luminance, which a bright lamp decides, the noise of everything else would not be seen. It depends
//! on scene, tree, frame and settings alone. A shot takes the knobs of one frame, the same in every process.

use super::choice::{Findings, Tried};
use super::prices::cost;
use super::sketch::{Aim, Expected, Sketch};
use super::trial::{Each, KNOBS, Trial};
use super::{Knobs, Split};
use crate::light_tree::{LightTree, NoSuchFrame};
use crate::render::noise::{Grey, Halves};
use crate::render::passes::ErrorGoal;
use crate::render::path::{Integrator, PathScratch, TraceStats};
use crate::render::{RenderDelegate, RenderSettings};
use rayon::prelude::*;
use std::ops::Range;

/// Paths through a pixel, in each of its two halves, at least and at most.
const PATHS: [u32; 2] = [4, 16];
/// One pilot path for so many paths of a frame. With all that is tried on it, and the sketch, it takes the
/// time of about twenty.
const FRAME_PATHS: u64 = 500;
/// Pixels that are enough.
const MOST_PIXELS: u64 = 512;
/// The noise of everything but picking is in few pixels, those of edges and small lamps. So it is told from so
/// many times as many pixels, on which no knobs are tried.
const PLAIN: u64 = 8;
/// With fewer nothing can be learnt.
const LEAST_PIXELS: u64 = 24;
/// One pixel of the first sketch for so many of the frame, which has at least as many samples in each. It tells how many it
/// will have.
const FRAME_PIXELS: u64 = 16;
/// No pixel is more than this share of the noise: one bright sample would decide alone.
const LARGEST_SHARE: f64 = 0.125;
/// The first of [`KNOBS`] that are tried only if the one before turns out to be the best: they cost most.
const FIRST_COSTLY: usize = 6;

/// The knobs for a shot with the delegate's settings, by a frame of it. Without [`Split::Auto`] they are
/// those that the settings tell. If an error is the aim, a frame has as many samples as that may take. A picture of few
/// paths gets the usual knobs, because to find out more would cost more than it gains.
///
/// Samples that go where the noise is make less of the noise of such places, and more of what is picked there. So each
/// pixel's noise counts by the samples that it gets, and so does what it costs.
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
    aim: Aim,
) -> Result<Knobs, NoSuchFrame> {
    let scale = f64::from(delegate.exposure_scale(frame));
    delegate.at_frame(tree, frame, |integrator| knobs_for(integrator, aim, scale))
}

/// Whether a pilot has anything to find out for these settings.
pub fn pilot_pays(settings: &RenderSettings) -> bool {
    pixels_for(settings, settings.samples).is_some()
}

/// How many pixels a pilot takes for a frame of so many samples a pixel, if it pays.
fn pixels_for(settings: &RenderSettings, samples: u32) -> Option<u64> {
    let paths = [settings.width, settings.height, samples].map(u64::from);
    let pixels =
        (paths.iter().product::<u64>() / FRAME_PATHS / u64::from(2 * PATHS[0])).min(MOST_PIXELS);
    let is_asked = settings.split == Split::Auto && settings.strategy.splits();
    (is_asked && settings.depth > 0 && pixels >= LEAST_PIXELS).then_some(pixels)
}

fn knobs_for(integrator: &Integrator, aim: Aim, scale: f64) -> Knobs {
    let settings = integrator.settings;
    let usual = settings.split.knobs();
    if !pilot_pays(settings) {
        return usual;
    }
    let (sketch, expected) = sketch(integrator, aim, scale);
    let Some(pixels) = pixels_for(settings, expected.samples as u32) else { return usual };
    let cells = sketch.some(pixels as u32);
    let tried = |kind: usize, range: Range<usize>| {
        if kind < settings.depth as usize { range } else { 0..0 }
    };
    let traced = |tried| {
        let pixel =
            |&cell: &u32| (pixel(integrator, &sketch, cell, tried), expected.shares[cell as usize]);
        let pixels: Vec<(Pixel, f64)> = cells.par_iter().map(pixel).collect();
        findings(&pixels, &sketch, tried)
    };
    let handicap = MOST_PIXELS as f64 / pixels as f64;
    let cheap = std::array::from_fn(|kind| tried(kind, 0..FIRST_COSTLY));
    let errors = sketch.squared_errors();
    let left = errors.iter().zip(&expected.shares).map(|(error, share)| error / share);
    let mut findings = Findings { variance: steady_mean(left.collect()), ..traced(&cheap) };
    let best = findings.best(handicap);
    let costly: [Range<usize>; Knobs::KINDS] = std::array::from_fn(|kind| {
        let is_last = best.by_bounce[kind] >= KNOBS[FIRST_COSTLY - 1];
        tried(kind, if is_last { FIRST_COSTLY..KNOBS.len() } else { 0..0 })
    });
    if costly.iter().all(Range::is_empty) {
        return best;
    }
    let more = traced(&costly);
    let known = findings.picking.as_flattened_mut().iter_mut();
    known.zip(more.picking.as_flattened()).for_each(|(own, new)| *own = own.or(*new));
    findings.best(handicap)
}

/// A sketch as large as the frame's samples pay for. Few pixels tell how many those will be, unless that is known; and if
/// by them more are paid for, those are asked, too.
fn sketch(integrator: &Integrator, aim: Aim, scale: f64) -> (Sketch, Expected) {
    let settings = integrator.settings;
    let paid = |samples: f64| PLAIN * pixels_for(settings, samples as u32).unwrap_or(0);
    let grey = match aim {
        Aim::Even => None,
        Aim::Error(ErrorGoal { grey, .. }) | Aim::Time(grey) => Grey::new(grey.luminance() / scale),
    };
    let range = PLAIN * LEAST_PIXELS..=PLAIN * MOST_PIXELS;
    let wanted = match aim {
        Aim::Error(_) => u64::from(settings.width) * u64::from(settings.height) / FRAME_PIXELS,
        Aim::Even | Aim::Time(_) => paid(settings.samples.into()),
    };
    let mut cells = wanted.clamp(*range.start(), *range.end());
    loop {
        let sketch = Sketch::of(integrator, (cells as u32, PATHS[0]), grey);
        let expected = sketch.expects(aim, settings);
        // A little more tells nothing new.
        let wanted = paid(expected.samples);
        if 4 * wanted > 5 * cells && cells <= u64::from(sketch.cells()) {
            cells = wanted.min(4 * cells);
            continue;
        }
        let paths = paths_for(settings, expected.samples as u32);
        if paths == PATHS[0] {
            return (sketch, expected);
        }
        let sketch = sketch.with_paths(integrator, paths);
        let expected = sketch.expects(aim, settings);
        return (sketch, expected);
    }
}

/// How many paths there are in each half of a pixel. Stratified samples of some knobs gain more by their number than
/// those of others. So there are more if more are paid for than there are pixels, but not more than in the frame.
fn paths_for(settings: &RenderSettings, samples: u32) -> u32 {
    let frame: u64 = [settings.width, settings.height, samples].map(u64::from).iter().product();
    let paid = frame / FRAME_PATHS / MOST_PIXELS;
    let most = paid.min(samples.into()) as u32 / 2;
    let [least, most] = [PATHS[0], most.clamp(PATHS[0], PATHS[1])];
    least << (most / least).ilog2()
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

/// What the paths through some pixels say, each with its share of the frame's samples. The variance is not told.
fn findings(
    pixels: &[(Pixel, f64)],
    sketch: &Sketch,
    tried: &[Range<usize>; Knobs::KINDS],
) -> Findings {
    let error = |of: &dyn Fn(&Pixel) -> f64| {
        let own = |(pixel, share): &(Pixel, f64)| {
            // As halves that are so far apart tell it: picks may be farther apart than samples of a pixel ever are, so
            // the brightest of those says nothing here.
            let [whole, off] = [pixel.halves.luminance(), of(pixel).sqrt()];
            let [above, below] =
                [off, -off].map(|off| sketch.grey().squared_error(whole + off, whole));
            0.5 * (above + below) / share
        };
        steady_mean(pixels.iter().map(own).collect())
    };
    let paths = pixels.len() as f64 * f64::from(2 * sketch.paths());
    let spent = |of: &dyn Fn(&Pixel) -> TraceStats| {
        pixels.iter().map(|(pixel, share)| share * cost(&of(pixel))).sum::<f64>() / paths
    };
    let mut findings = Findings {
        cost: spent(&|pixel| TraceStats {
            rays: pixel.own.rays - pixel.own.shadow_rays,
            ..TraceStats::default()
        }),
        ..Findings::default()
    };
    for (kind, range) in tried.iter().enumerate() {
        for knob in range.clone() {
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

fn pixel(
    integrator: &Integrator,
    sketch: &Sketch,
    cell: u32,
    tried: &[Range<usize>; Knobs::KINDS],
) -> Pixel {
    let trial = Box::new(Trial::new(*integrator.picker.splitting(0), tried.clone()));
    let mut scratch = PathScratch::default();
    scratch.trial = Some(trial);
    let mut halves = Halves::default();
    let mut picking = Each::default();
    for half in 0..2 {
        let begin = |scratch: &mut PathScratch, (seed, index): (u32, u32)| {
            if let Some(trial) = &mut scratch.trial {
                if index == 0 {
                    trial.begin(seed);
                }
                trial.next_path(index);
            }
        };
        sketch.again(&mut halves, (cell, half), integrator, &mut scratch, begin);
        let found = scratch.trial.as_ref().map(|trial| trial.differences).unwrap_or_default();
        for (sum, difference) in picking.as_flattened_mut().iter_mut().zip(found.as_flattened()) {
            // Half a squared difference is the variance of a half's mean; a quarter of it that of both.
            let off = difference / f64::from(sketch.paths());
            *sum += if off.is_finite() { 0.125 * off * off } else { 0.0 };
        }
    }
    let spent = scratch.trial.map(|trial| trial.spent).unwrap_or_default();
    Pixel { halves, picking, spent, own: scratch.stats }
}
