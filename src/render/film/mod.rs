//! The film: what the samples of a frame in the making have come to.
//!
//! A pixel has two halves. Its even samples are of one scrambled sequence, its odd ones of another,
//! independent one; the difference of their means tells the noise ([`noise`](super::noise)). A film
//! can be exposed further at any time: a pixel depends on how many samples it has, not on the passes that
//! they came in. It keeps sums in double precision, of what the layers need and no more.
//!
//! A sample whose radiance is not finite is left out of all means and counted: it would spoil the pixel,
//! and what is filtered over it later.

mod develop;
mod saved;
mod sums;

pub(super) use sums::Shown;

use super::cryptomatte::Coverage;
use super::noise::{Estimate, Grey, Halves};
use super::path::{PathSample, TraceStats};
use super::plan::Plan;
use super::{FrameStats, Window};
use crate::math::color::{LUMINANCE_WEIGHTS, Rgb};
use rayon::prelude::*;
use sums::Layout;

/// The samples of a frame so far, pixel by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: [u32; 2],
    window: Window,
    /// Factor on radiance.
    exposure_scale: f64,
    /// What the layer of errors is relative to.
    grey: Option<Grey>,
    layout: Layout,
    /// Of each pixel: samples taken.
    taken: Vec<u32>,
    /// Of each pixel: samples to be taken in the pass that has begun.
    targets: Vec<u32>,
    sums: Vec<f64>,
    /// Empty unless Cryptomatte is asked for.
    coverage: Vec<Coverage>,
    trace: TraceStats,
}

/// A row of a film.
pub(super) struct FilmRow<'a> {
    layout: &'a Layout,
    taken: &'a mut [u32],
    targets: &'a [u32],
    sums: &'a mut [f64],
    coverage: &'a mut [Coverage],
}

impl Film {
    pub(super) fn new(size: [u32; 2], plan: &Plan, exposure_scale: f32) -> Film {
        let groups = plan.groups.as_ref().map_or(0, |groups| groups.names().len());
        let layout = Layout::new(&plan.layers, groups);
        let window = plan.window;
        let pixels = window.width() as usize * window.height() as usize;
        let coverage = if plan.ids.is_some() { pixels } else { 0 };
        Film {
            size,
            window,
            exposure_scale: exposure_scale.into(),
            grey: None,
            sums: vec![0.0; pixels * layout.stride()],
            layout,
            taken: vec![0; pixels],
            targets: vec![0; pixels],
            coverage: std::iter::repeat_with(Coverage::default).take(coverage).collect(),
            trace: TraceStats::default(),
        }
    }

    /// Makes the layer of errors relative to a floor. Without one, the floor is that of the picture.
    pub fn set_grey(&mut self, grey: Option<Grey>) {
        self.grey = grey;
    }

    /// Which part of the picture this is.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Samples of each pixel, row after row.
    pub fn taken(&self) -> &[u32] {
        &self.taken
    }

    /// All samples together.
    pub fn samples(&self) -> u64 {
        self.taken.iter().map(|&count| u64::from(count)).sum()
    }

    /// Samples that the pass that has begun is still to take.
    pub fn missing(&self) -> u64 {
        let pairs = self.targets.iter().zip(&self.taken);
        pairs.map(|(&target, &taken)| u64::from(target.saturating_sub(taken))).sum()
    }

    /// Begins a pass: each pixel is to have so many samples.
    ///
    /// # Panics
    /// If there is not one number for each pixel.
    pub fn begin_pass(&mut self, targets: Vec<u32>) {
        assert_eq!(targets.len(), self.taken.len(), "one count a pixel");
        self.targets = targets;
    }

    /// What tracing has cost so far.
    pub fn trace(&self) -> TraceStats {
        self.trace
    }

    pub(super) fn add_trace(&mut self, trace: TraceStats) {
        self.trace = self.trace.plus(trace);
    }

    /// What the halves of each pixel say, in the unit of the picture.
    pub fn halves(&self) -> Vec<Halves> {
        let stride = self.layout.stride();
        let pixels = self.sums.par_chunks(stride).zip(&self.taken);
        pixels.map(|(sums, &taken)| halves(sums, taken, self.exposure_scale)).collect()
    }

    /// How noisy the picture is.
    pub fn estimate(&self, grey: Grey) -> Estimate {
        Estimate::of(&self.halves(), self.window.width() as usize, grey)
    }

    /// Rows to be exposed in parallel, with their numbers in the whole picture.
    pub(super) fn rows_mut(&mut self) -> impl IndexedParallelIterator<Item = (u32, FilmRow<'_>)> {
        let width = self.window.width() as usize;
        let Film { layout, taken, targets, sums, coverage, window, .. } = self;
        let layout = &*layout;
        let mut coverage: Vec<&mut [Coverage]> = match coverage.is_empty() {
            true => std::iter::repeat_with(|| &mut [][..]).take(window.height() as usize).collect(),
            false => coverage.chunks_mut(width).collect(),
        };
        coverage.reverse();
        let rows: Vec<(u32, FilmRow)> = (window.y0..window.y1)
            .zip(taken.chunks_mut(width))
            .zip(targets.chunks(width))
            .zip(sums.chunks_mut(width * layout.stride()))
            .zip(std::iter::from_fn(move || coverage.pop()))
            .map(|((((y, taken), targets), sums), coverage)| {
                (y, FilmRow { layout, taken, targets, sums, coverage })
            })
            .collect();
        rows.into_par_iter()
    }

    /// Samples that were left out, and the first pixel that has one, in the whole picture.
    fn left_out(&self) -> (u64, Option<(u32, u32)>) {
        let stride = self.layout.stride();
        let own = |i: usize| sums::left_out(&self.sums[i * stride..][..stride]).iter().sum::<u32>();
        let spoilt =
            (0..self.taken.len()).map(|i| (i, u64::from(own(i)))).filter(|&(_, own)| own > 0);
        let width = self.window.width() as usize;
        let place =
            |i: usize| (self.window.x0 + (i % width) as u32, self.window.y0 + (i / width) as u32);
        spoilt.fold((0, None), |(sum, first), (i, own)| (sum + own, first.or(Some(place(i)))))
    }

    /// What it cost, and what was left out.
    pub fn stats(&self) -> FrameStats {
        let (non_finite, first_non_finite) = self.left_out();
        FrameStats { trace: self.trace, non_finite, first_non_finite }
    }
}

impl FilmRow<'_> {
    /// The number of the next sample of a pixel, if its pass is not done.
    #[inline]
    pub fn next_sample(&self, pixel: usize) -> Option<u32> {
        Some(self.taken[pixel]).filter(|taken| *taken < self.targets[pixel])
    }

    /// Takes in the next sample of a pixel, with its light by group and the squared luminance of what was
    /// blocked.
    pub fn add(
        &mut self,
        pixel: usize,
        sample: &PathSample,
        by_group: &[Rgb],
        blocked: f64,
        shown: &Shown,
    ) {
        let half = half_of(self.taken[pixel]);
        self.taken[pixel] += 1;
        let stride = self.layout.stride();
        let sums = &mut self.sums[pixel * stride..][..stride];
        let is_kept = self.layout.add(sums, half, sample, by_group, blocked, shown);
        if let (true, Some(coverage), Some(ids), Some(hit)) =
            (is_kept, self.coverage.get_mut(pixel), shown.ids, &sample.hit)
        {
            coverage.add(ids.of(&hit.surface));
        }
    }
}

/// The half of a pixel that a sample belongs to. Samples alternate, so that any number of them is fairly
/// divided.
#[inline]
pub(super) fn half_of(sample: u32) -> usize {
    (sample % 2) as usize
}

/// Samples of each half that are in its means.
fn counts(sums: &[f64], taken: u32) -> [u32; 2] {
    let [a, b] = sums::left_out(sums);
    [taken.div_ceil(2) - a, taken / 2 - b]
}

/// What the halves of a pixel say.
fn halves(sums: &[f64], taken: u32, scale: f64) -> Halves {
    let counts = counts(sums, taken);
    let mean = |half: usize| {
        let light = sums::radiance(sums, half).dot(LUMINANCE_WEIGHTS.as_dvec3());
        light * (scale / f64::from(counts[half].max(1)))
    };
    Halves {
        counts,
        means: [mean(0), mean(1)],
        brightest: sums::brightest(sums) * scale,
        blocked: sums::blocked(sums) * scale * scale,
        is_spoilt: counts[0] + counts[1] < taken,
    }
}
