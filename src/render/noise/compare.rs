//! How far off a picture is from a converged one.

use super::{Grey, Halves, pool};
use serde::Serialize;

/// A picture to compare with, in two halves whose noise is independent.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Columns.
    pub width: usize,
    /// Luminance of each pixel in each half, row after row.
    pub halves: Vec<[f64; 2]>,
}

/// What a comparison found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Compared {
    /// The root of the mean squared error of the pixels that have noise.
    pub error: f64,
    /// That in decibels.
    pub decibels: f64,
    /// The pooled error that 99 % of the noisy pixels do not exceed.
    pub worst_percent: f64,
    /// The mean luminance over that of the reference, less 1: what bias would show in.
    pub mean_off: f64,
    /// Pixels that have noise.
    pub noisy: usize,
}

impl Reference {
    /// Of the halves of a film.
    pub fn of(pixels: &[Halves], width: usize) -> Reference {
        Reference { width, halves: pixels.iter().map(|pixel| pixel.means).collect() }
    }

    /// Its luminance, row after row.
    pub fn luminance(&self) -> impl Iterator<Item = f64> + '_ {
        self.halves.iter().map(|[a, b]| 0.5 * (a + b))
    }

    /// Compares a picture, given by the luminance of its pixels. The reference's own noise is
    /// taken off.
    ///
    /// # Panics
    /// If the pictures differ in size.
    pub fn compare(&self, luminance: &[f64], grey: Grey) -> Compared {
        let squares = self.squared_errors(luminance, grey);
        let noisy: Vec<usize> = (0..luminance.len())
            .filter(|&i| self.halves[i].iter().any(|half| *half != luminance[i]))
            .collect();
        if noisy.is_empty() {
            return Compared { decibels: f64::INFINITY, ..Compared::default() };
        }
        let mean = noisy.iter().map(|&i| squares[i]).sum::<f64>() / noisy.len() as f64;
        let error = mean.max(0.0).sqrt();
        let around = pool(&squares, self.width);
        let mut pooled: Vec<f64> = noisy.iter().map(|&i| around[i].max(0.0)).collect();
        pooled.sort_unstable_by(f64::total_cmp);
        Compared {
            error,
            decibels: super::decibels(error),
            worst_percent: pooled[(pooled.len() - 1) * 99 / 100].sqrt(),
            mean_off: luminance.iter().sum::<f64>() / self.luminance().sum::<f64>() - 1.0,
            noisy: noisy.len(),
        }
    }

    /// Of each pixel, the squared error, less what the reference's noise adds to it: without bias, and
    /// so below 0 here and there.
    ///
    /// # Panics
    /// If the pictures differ in size.
    pub fn squared_errors(&self, luminance: &[f64], grey: Grey) -> Vec<f64> {
        assert_eq!(luminance.len(), self.halves.len(), "pictures of one size");
        let pixels = self.halves.iter().zip(luminance);
        pixels
            .map(|(&[a, b], &own)| {
                grey.squared_error(own, 0.5 * (a + b)) - 0.25 * grey.squared_error(a, b)
            })
            .collect()
    }
}
