//! How far off a picture is from a converged one.

use super::{Grey, pool};
use serde::Serialize;

/// A picture to compare with, and what its own noise is.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Columns.
    pub width: usize,
    /// Luminance of each pixel, row after row.
    pub luminance: Vec<f64>,
    /// Variance of each. It need not be smooth, but must be without bias: it is taken off.
    pub variance: Vec<f64>,
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
    /// Compares a picture, given by the luminance of its pixels. The reference's own noise is
    /// taken off, so it may be noisier than the picture; only the result is then less certain.
    ///
    /// # Panics
    /// If the pictures differ in size.
    pub fn compare(&self, luminance: &[f64], grey: Grey) -> Compared {
        let squares = self.squared_errors(luminance, grey);
        let noisy: Vec<usize> = (0..luminance.len())
            .filter(|&i| self.variance[i] > 0.0 || luminance[i] != self.luminance[i])
            .collect();
        if noisy.is_empty() {
            return Compared { decibels: f64::INFINITY, ..Compared::default() };
        }
        let mean = noisy.iter().map(|&i| squares[i]).sum::<f64>() / noisy.len() as f64;
        let error = mean.max(0.0).sqrt();
        let around = pool(&squares, self.width);
        let mut pooled: Vec<f64> = noisy.iter().map(|&i| around[i].max(0.0)).collect();
        pooled.sort_unstable_by(f64::total_cmp);
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        Compared {
            error,
            decibels: super::decibels(error),
            worst_percent: pooled[(pooled.len() - 1) * 99 / 100].sqrt(),
            mean_off: sum(luminance) / sum(&self.luminance) - 1.0,
            noisy: noisy.len(),
        }
    }

    /// Of each pixel, the squared error, less what the reference's noise adds to it: without bias, and
    /// so below 0 here and there.
    ///
    /// # Panics
    /// If the pictures differ in size.
    pub fn squared_errors(&self, luminance: &[f64], grey: Grey) -> Vec<f64> {
        assert_eq!(luminance.len(), self.luminance.len(), "pictures of one size");
        let pixels = self.luminance.iter().zip(&self.variance).zip(luminance);
        pixels
            .map(|((&light, &variance), &own)| {
                let off = own - light;
                grey.squared_error(off * off - variance, light)
            })
            .collect()
    }
}
