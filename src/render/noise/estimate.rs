//! How noisy a picture in the making is.

use super::Grey;
use super::tent::around;

/// What the two halves of a pixel's samples say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Halves {
    /// Samples in each.
    pub counts: [u32; 2],
    /// Mean luminance of each.
    pub means: [f64; 2],
    /// Luminance of the brightest sample of both.
    pub brightest: f64,
    /// The sum over all samples of the squared luminance of light that was picked and then found to be
    /// blocked: what would have come had it not been.
    pub blocked: f64,
    /// Whether a sample was left out because it was infinite or no number.
    pub is_spoilt: bool,
}

impl Halves {
    fn samples(&self) -> f64 {
        f64::from(self.counts[0]) + f64::from(self.counts[1])
    }

    /// Luminance of the pixel, each half by its count.
    pub fn luminance(&self) -> f64 {
        let [a, b] = self.counts.map(f64::from);
        (a * self.means[0] + b * self.means[1]) / (a + b).max(1.0)
    }

    /// The squared error of [`luminance`](Self::luminance). 0 if there is one sample.
    ///
    /// The difference of the halves tells the variance, however well the samples of each are stratified. What a large
    /// deviation is in the logarithm depends on how samples miss light. Where they are stratified, as at edges, the whole is off
    /// the converged picture as a half is off the whole. Where each meets a lamp by chance, it is off as it is from the pixel
    /// without its brightest sample (the jackknife; Efron and Stein 1981). Pictures have both, so this is the mean of
    /// the two. Where deviations are small they are the same: the variance over the square of light and floor.
    pub fn squared_error(&self, grey: Grey) -> f64 {
        let [a, b] = self.counts.map(f64::from);
        if a == 0.0 || b == 0.0 {
            return 0.0;
        }
        let whole = self.luminance().max(0.0);
        let [off_a, off_b] = self.means.map(|mean| grey.squared_error(mean, whole));
        let by_halves = 0.5 * (off_a * (a / b) + off_b * (b / a));

        let deviation = (self.means[0] - self.means[1]) * (a * b).sqrt() / (a + b);
        let step = ((self.brightest - whole) / (a + b - 1.0)).clamp(0.0, whole);
        let without = whole - step + grey.luminance();
        let rise = step / without;
        let slope = if rise > 0.0 { rise.ln_1p() / rise } else { 1.0 };
        let by_brightest = (deviation / without * slope).powi(2);

        0.5 * (by_halves + by_brightest)
    }
}

/// The noise of a picture, pixel by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    width: usize,
    /// Of each pixel: samples.
    samples: Vec<f64>,
    /// Of each pixel: the squared error that one sample would have, from the pixel's own halves.
    own: Vec<f64>,
    /// The same, pooled over the neighbours without the pixel itself.
    pooled: Vec<f64>,
    /// What blocked light may still add to that.
    hidden: Vec<f64>,
    spoilt: Vec<bool>,
}

/// The error of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameError {
    /// The root of the mean squared error of the pixels that have noise.
    pub error: f64,
    /// With 95 % certainty it is at most this.
    pub bound: f64,
    /// Standard error of the mean squared error.
    pub uncertainty: f64,
    /// Pixels that have noise.
    pub noisy: usize,
}

/// The frame is divided into so many interleaved lattices, whose spread tells how sure its error is.
const LATTICES: [usize; 2] = [8, 4];
/// Quantile of Student's t with 31 degrees of freedom: 97.5 %, so that two looks at a frame that is about to
/// be done are wrong once in twenty times.
const T: f64 = 2.040;

impl Estimate {
    /// Of pixels, row after row.
    ///
    /// # Panics
    /// If they are not whole rows.
    pub fn of(pixels: &[Halves], width: usize, grey: Grey) -> Estimate {
        let around = |values: &[f64]| around(values, width, 0.0);
        let samples: Vec<f64> = pixels.iter().map(Halves::samples).collect();
        let own: Vec<f64> =
            pixels.iter().map(|pixel| pixel.squared_error(grey) * pixel.samples()).collect();
        let blocked: Vec<f64> = pixels
            .iter()
            .map(|pixel| grey.of_deviation(pixel.blocked, pixel.luminance()))
            .collect();
        let weights = around(&vec![1.0; pixels.len()]);
        let pooled = around(&own).iter().zip(&weights).map(|(sum, all)| sum / all).collect();
        // The chance that a light is visible although none of N rays to it got there: 1 / (N + 2) for any
        // share of it that may be visible (Laplace), times the odds that it is visible at all.
        let hidden = around(&blocked)
            .iter()
            .zip(around(&samples))
            .zip(&weights)
            .map(|((blocked, samples), all)| {
                let rays = samples / all * NEIGHBOURS;
                let chance = 1.0 / (rays + 2.0) / (1.0 + rays / ODDS);
                if samples > 0.0 { blocked / samples * chance } else { 0.0 }
            })
            .collect();
        let spoilt = pixels.iter().map(|pixel| pixel.is_spoilt).collect();
        Estimate { width, samples, own, pooled, hidden, spoilt }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels.
    pub fn pixels(&self) -> usize {
        self.samples.len()
    }

    /// Samples of a pixel.
    pub fn samples(&self, pixel: usize) -> f64 {
        self.samples[pixel]
    }

    /// Whether a sample of a pixel was left out: its error cannot be told.
    pub fn is_spoilt(&self, pixel: usize) -> bool {
        self.spoilt[pixel]
    }

    /// The squared error that one sample of a pixel would have, by its neighbours: what decides about
    /// further samples. It does not depend on the pixel's own samples, so a picture whose counts
    /// follow it is not biased by them (Kirk and Arvo 1991). A pixel without neighbours has an infinite
    /// one.
    pub fn of_one_sample(&self, pixel: usize) -> f64 {
        let sum = self.pooled[pixel] + self.hidden[pixel];
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// The same by the pixel's own halves alone: a rough number, of which only sums over many pixels tell something.
    pub fn own_of_one_sample(&self, pixel: usize) -> f64 {
        self.own[pixel]
    }

    /// The error that the neighbours of a pixel tell, without what blocked light may still add.
    pub fn told(&self, pixel: usize) -> f64 {
        (self.pooled[pixel] / self.samples[pixel].max(1.0)).sqrt()
    }

    /// The pooled error of a pixel, with what blocked light may still add.
    pub fn error(&self, pixel: usize) -> f64 {
        (self.of_one_sample(pixel) / self.samples[pixel].max(1.0)).sqrt()
    }

    /// The error of the frame, from the pixels' own halves.
    pub fn of_frame(&self) -> FrameError {
        let mut sums = [[0.0; 2]; LATTICES[0] * LATTICES[1]];
        for (pixel, own) in self.own.iter().enumerate() {
            if self.is_noisy(pixel) {
                let (x, y) = (pixel % self.width, pixel / self.width);
                let sum = &mut sums[y % LATTICES[1] * LATTICES[0] + x % LATTICES[0]];
                sum[0] += own / self.samples[pixel].max(1.0);
                sum[1] += 1.0;
            }
        }
        let noisy: f64 = sums.iter().map(|sum| sum[1]).sum();
        if noisy == 0.0 {
            return FrameError::default();
        }
        let mean = sums.iter().map(|sum| sum[0]).sum::<f64>() / noisy;
        // The variance of a ratio of sums (Cochran 1977, section 6).
        let lattices = sums.len() as f64;
        let spread: f64 = sums.iter().map(|sum| (sum[0] - mean * sum[1]).powi(2)).sum();
        let uncertainty = (spread * lattices / (lattices - 1.0)).sqrt() / noisy;
        FrameError {
            error: mean.sqrt(),
            bound: (mean + T * uncertainty).sqrt(),
            uncertainty,
            noisy: noisy as usize,
        }
    }

    /// Whether a pixel or one beside it has noise.
    pub fn is_noisy(&self, pixel: usize) -> bool {
        self.pooled[pixel] > 0.0 || self.own[pixel] > 0.0
    }
}

/// After so many rays that were all blocked it is as likely as not that a light is hidden altogether.
const ODDS: f64 = 500.0;
/// Pixels in the tent, without its middle.
const NEIGHBOURS: f64 = 48.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::hash;

    /// The error that is told over the true one, of pixels of which so many samples are expected to meet a lamp, each by
    /// chance; all samples have the light `beside`, a pixel has 1 of the lamp's in the mean.
    fn told_over_true(samples: u32, hits: f64, beside: f64) -> f64 {
        const PIXELS: u32 = 40_000;
        let grey = Grey(0.1);
        let lamp = f64::from(samples) / hits;
        let is_hit = |number: u32| f64::from(hash(7, number)) < 4_294_967_296.0 / lamp;
        let (mut told, mut truth) = (0.0, 0.0);
        for pixel in 0..PIXELS {
            let mut halves = Halves { counts: [samples / 2; 2], ..Halves::default() };
            for sample in 0..samples {
                let light = if is_hit(pixel * samples + sample) { beside + lamp } else { beside };
                halves.means[sample as usize % 2] += light / f64::from(samples / 2);
                halves.brightest = halves.brightest.max(light);
            }
            told += halves.squared_error(grey);
            truth += grey.squared_error(halves.luminance(), beside + 1.0);
        }
        (told / truth).sqrt()
    }

    /// Whether a pixel expects one sample with light or many of them, and whether or not there is other light.
    #[test]
    fn the_error_of_rare_light_is_told() {
        for samples in [16, 64, 256] {
            for (hits, range) in [(1.0, 0.9..1.06), (3.0, 0.98..1.26), (10.0, 0.98..1.1)] {
                for beside in [0.0, 1.0] {
                    let ratio = told_over_true(samples, hits, beside);
                    assert!(range.contains(&ratio), "{samples} {hits} {beside}: {ratio}");
                }
            }
        }
    }

    /// Blocked light asks for samples; no noise is told of it.
    #[test]
    fn blocked_light_is_no_noise_yet() {
        let of = |blocked: f64| {
            let pixel = Halves {
                counts: [8; 2],
                means: [1.1, 0.9],
                brightest: 1.5,
                blocked,
                is_spoilt: false,
            };
            Estimate::of(&[pixel; 64], 8, Grey(0.1))
        };
        let (plain, shadowed) = (of(0.0), of(1e6));
        assert_eq!(plain.told(27), shadowed.told(27));
        assert_eq!(plain.told(27), plain.error(27));
        assert!(shadowed.error(27) > 1.5 * plain.error(27));
        assert!((plain.told(27) / plain.of_frame().error - 1.0).abs() < 1e-9);
    }

    #[test]
    fn one_sample_tells_nothing_and_alike_ones_their_variance() {
        let one = Halves { counts: [1, 0], means: [2.0, 0.0], brightest: 2.0, ..Halves::default() };
        assert_eq!(one.squared_error(Grey(0.1)), 0.0);
        let counts = [8_u32, 24];
        let halves =
            Halves { counts, means: [1.0002, 0.9998], brightest: 1.0, ..Halves::default() };
        let variance = 4e-4_f64.powi(2) * 8.0 * 24.0 / 32_f64.powi(2);
        let expected = variance / (halves.luminance() + 0.1).powi(2);
        assert!((halves.squared_error(Grey(0.1)) / expected - 1.0).abs() < 1e-3);
    }
}
