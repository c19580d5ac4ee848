//! The sketch of a frame: few of its pixels, one in each cell of a grid. It tells how noisy the frame will be, and
//! how many samples each part of it will get.
//!
//! Noise is mostly in few pixels, those of edges and small lamps. So many pixels are looked at, and no knobs are
//! tried on them. The places of neighbours in the grid are neighbours in the picture, so samples are allotted as in the
//! frame itself.

use crate::math::color::luminance;
use crate::math::random::hash;
use crate::render::RenderSettings;
use crate::render::noise::{Allotment, Estimate, Grey, Halves};
use crate::render::passes::ErrorGoal;
use crate::render::path::{Integrator, PathScratch};
use rayon::prelude::*;

/// What decides how many samples a frame's pixels get.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// Every pixel gets those of the settings.
    Even,
    /// An error, in the unit of the picture.
    Error(ErrorGoal),
    /// As little error as a time allows, above this floor in the unit of the picture. Those of the settings are taken for its
    /// mean number of samples.
    Time(Grey),
}

/// The random numbers are not those of any frame.
const SEED: u32 = 0x6b6e_6f62;
/// The least share of the mean number of samples that a pixel gets where time decides.
const LEAST_IN_TIME: f64 = 0.125;
/// As if each pixel of the sketch got so many samples, which is many more than it has.
const MANY: u32 = 1 << 12;
/// Standard errors of a mean. If noise is rare the mean is above it more often than in a normal distribution: one time in six
/// where one pixel in fifty has all of it and 160 are looked at.
const SURE: f64 = 2.0;

/// Some pixels of a frame, one in each cell of a grid.
pub(super) struct Sketch {
    grid: Grid,
    paths: u32,
    pixels: Vec<Halves>,
    grey: Grey,
}

/// Cells of a picture, row after row.
struct Grid {
    /// Of the picture, pixels.
    size: [u32; 2],
    columns: u32,
    rows: u32,
}

/// How many samples a frame gets, by its sketch.
pub(super) struct Expected {
    /// Of a pixel in the mean.
    pub samples: f64,
    /// Of each pixel of the sketch, over the mean.
    pub shares: Vec<f64>,
}

impl Grid {
    /// Of at least so many cells, if the picture has as many pixels, about as long as wide.
    fn of(cells: u32, size: [u32; 2]) -> Grid {
        let [width, height] = size;
        let columns = f64::from(cells) * f64::from(width) / f64::from(height);
        let columns = (columns.sqrt().round() as u32).clamp(1, width);
        Grid { size, columns, rows: cells.div_ceil(columns).clamp(1, height) }
    }

    fn cells(&self) -> u32 {
        self.columns * self.rows
    }

    /// The pixel of a cell: anywhere in it, so that nothing regular in the picture meets the grid.
    fn place(&self, cell: u32) -> [u32; 2] {
        let at = |number: u32, cells: u32, length: u32, salt: u32| {
            let within = f64::from(hash(hash(SEED, salt), cell)) / 4_294_967_296.0;
            let place = (f64::from(number) + within) * f64::from(length) / f64::from(cells);
            (place as u32).min(length - 1)
        };
        let [width, height] = self.size;
        let (x, y) = (cell % self.columns, cell / self.columns);
        [at(x, self.columns, width, 1), at(y, self.rows, height, 2)]
    }

    /// Adds paths to one half of a cell's pixel until it has so many. `before` hears the seed and the number of each.
    fn expose(
        &self,
        halves: &mut Halves,
        (cell, half, paths): (u32, usize, u32),
        integrator: &Integrator,
        scratch: &mut PathScratch,
        mut before: impl FnMut(&mut PathScratch, (u32, u32)),
    ) {
        let [x, y] = self.place(cell);
        let seed = hash(hash(SEED, y * integrator.settings.width + x), half as u32);
        let taken = halves.counts[half];
        let mut sum = halves.means[half] * f64::from(taken);
        for index in taken..paths {
            before(scratch, (seed, index));
            let light = integrator.trace(x, y, seed, index, scratch).radiance;
            let or_none = |light: f64| if light.is_finite() { light } else { 0.0 };
            let light = or_none(luminance(light).into());
            sum += light;
            halves.brightest = halves.brightest.max(light);
            halves.blocked += or_none(scratch.blocked);
        }
        halves.counts[half] = paths;
        halves.means[half] = sum / f64::from(paths);
    }
}

impl Sketch {
    /// A sketch of at least so many pixels, if the picture has as many, with so many paths in each half of a pixel. The
    /// floor is that of the frame, in the unit of radiance; the geometric mean of the pixels decides if it is not known.
    pub fn of(integrator: &Integrator, (pixels, paths): (u32, u32), grey: Option<Grey>) -> Sketch {
        let RenderSettings { width, height, .. } = *integrator.settings;
        let grid = Grid::of(pixels, [width, height]);
        let mut pixels = vec![Halves::default(); grid.cells() as usize];
        trace(integrator, &grid, &mut pixels, paths);
        let grey = grey.unwrap_or_else(|| Grey::of(pixels.iter().map(Halves::luminance)));
        Sketch { grid, paths, pixels, grey }
    }

    /// The same with more paths in each half of a pixel, under the same floor.
    pub fn with_paths(mut self, integrator: &Integrator, paths: u32) -> Sketch {
        trace(integrator, &self.grid, &mut self.pixels, paths);
        Sketch { paths, ..self }
    }

    /// What a pixel of the sketch shows when it is traced again. `before` hears the seed and the number of each path.
    pub fn again(
        &self,
        halves: &mut Halves,
        (cell, half): (u32, usize),
        integrator: &Integrator,
        scratch: &mut PathScratch,
        before: impl FnMut(&mut PathScratch, (u32, u32)),
    ) {
        self.grid.expose(halves, (cell, half, self.paths), integrator, scratch, before);
    }

    /// Its pixels.
    pub fn cells(&self) -> u32 {
        self.grid.cells()
    }

    /// The floor that its errors are relative to, in the unit of radiance.
    pub fn grey(&self) -> Grey {
        self.grey
    }

    /// Paths through a pixel, in each of its two halves.
    pub fn paths(&self) -> u32 {
        self.paths
    }

    /// About so many of its cells, or all, spread evenly.
    pub fn some(&self, pixels: u32) -> Vec<u32> {
        let every = (self.cells() / pixels.max(1)).max(1);
        let place = |cell: &u32| cell % self.grid.columns + 3 * (cell / self.grid.columns);
        (0..self.cells()).filter(|cell| place(cell).is_multiple_of(every)).collect()
    }

    /// The squared error of each pixel.
    pub fn squared_errors(&self) -> Vec<f64> {
        self.pixels.iter().map(|halves| halves.squared_error(self.grey)).collect()
    }

    /// The samples that a frame gets whose aim this is.
    pub fn expects(&self, aim: Aim, settings: &RenderSettings) -> Expected {
        let most = settings.samples;
        let counts = match aim {
            Aim::Even => vec![f64::from(most); self.pixels.len()],
            Aim::Time(_) => {
                let least = (LEAST_IN_TIME * f64::from(MANY)) as u32;
                let samples = u64::from(MANY) * self.pixels.len() as u64;
                Allotment { least, most: u32::MAX }.affordable(&self.estimate(), samples)
            }
            Aim::Error(goal) => self.needed(goal),
        };
        let mean = counts.iter().sum::<f64>() / counts.len() as f64;
        let shares = counts.iter().map(|count| count / mean).collect();
        let is_known = !matches!(aim, Aim::Error(_));
        Expected { samples: if is_known { most.into() } else { mean }, shares }
    }

    /// The samples that each pixel needs. Where few pixels hold most of the noise, few pixels of a sketch tell little of
    /// it, and a frame takes more samples to be sure. So these are for the upper end of what the pixels tell.
    fn needed(&self, goal: ErrorGoal) -> Vec<f64> {
        let (estimate, allotment) = (self.estimate(), goal.allotment());
        let needed = allotment.needed(&estimate, goal.error);
        let left = |(pixel, count): (usize, &f64)| estimate.own_of_one_sample(pixel) / count;
        let left: Vec<f64> = needed.iter().enumerate().map(left).collect();
        let [width, height] = self.grid.size.map(f64::from);
        let more = margin(&left, width * height);
        allotment.needed(&estimate, goal.error / more.sqrt())
    }

    fn estimate(&self) -> Estimate {
        Estimate::of(&self.pixels, self.grid.columns as usize, self.grey)
    }
}

/// Adds paths to the pixels of a grid until each half has so many.
fn trace(integrator: &Integrator, grid: &Grid, pixels: &mut [Halves], paths: u32) {
    pixels.par_iter_mut().enumerate().for_each(|(cell, halves)| {
        let scratch = &mut PathScratch::default();
        for half in 0..2 {
            grid.expose(halves, (cell as u32, half, paths), integrator, scratch, |_, _| {});
        }
    });
}

/// The factor on the mean of a frame of so many pixels that it proves to be below, by the squared errors of some of them.
/// Pixels without noise do not count. The first factor is what the few pixels may have missed, the second what the
/// frame takes to be sure of its own mean.
fn margin(errors: &[f64], frame: f64) -> f64 {
    let noisy: Vec<f64> = errors.iter().copied().filter(|&own| own > 0.0).collect();
    let count = noisy.len().max(1) as f64;
    let mean = noisy.iter().sum::<f64>() / count;
    if mean == 0.0 {
        return 1.0;
    }
    let spread = noisy.iter().map(|own| (own / mean - 1.0).powi(2)).sum::<f64>() / count;
    let noisy_of_frame = frame * count / errors.len() as f64;
    let margin = |pixels: f64| 1.0 + SURE * (spread / pixels).sqrt();
    margin(count) * margin(noisy_of_frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_noise_has_no_margin_and_sky_does_not_count() {
        let mut errors = vec![0.04; 100];
        assert!((margin(&errors, 1e4) - 1.0).abs() < 1e-12);
        errors.resize(400, 0.0);
        assert!((margin(&errors, 1e4) - 1.0).abs() < 1e-12);
        assert_eq!(margin(&[0.0; 9], 1e4), 1.0);
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
            let mean = errors.iter().sum::<f64>() / 160.0;
            naive += u32::from(mean < MEAN);
            short += u32::from(mean * margin(&errors, 1e9) < MEAN);
        }
        assert!(naive > DRAWS / 2, "the mean alone is too small {naive} times");
        assert!(short < DRAWS / 5, "too small {short} times");
        // A small frame has to prove more.
        let mut errors = vec![1e-3; 160];
        errors[0] = 1.0;
        assert!(margin(&errors, 400.0) > 1.5 * margin(&errors, 1e9));
    }
}
