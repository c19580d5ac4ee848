//! Where further samples go.
//!
//! A frame's squared error is the mean of `r / n` over its pixels: `r` is what one sample has, `n` are the
//! samples. For a given sum of samples it is least if they go in proportion to the root of `r` (Neyman
//! 1934). Noisy places are then noisier than others, but by far less than with as many samples
//! everywhere. No place may have more than twice the error that is asked of the frame.
//!
//! A pixel's neighbours decide, since its own samples must not. Where light is rare in single pixels, neighbours do not
//! predict a pixel's noise: they get the samples that it lacks. How well they predict is told by leave-one-out
//! cross-validation over the frame: each pixel's own halves against the count that its neighbours give it. The share of
//! samples that leaves the least error by that is spread evenly, also over the places that may have no more than twice
//! the error.
//!
//! Counts are those at which scrambled nets are good, powers of two in each half and half-way between.
//! Which pixels have the one count or the next is decided by a fixed mask, so that no contour shows.

use super::estimate::Estimate;
use crate::math::random::hash;
use rayon::prelude::*;

/// Samples of each pixel.
pub type Counts = Vec<u32>;

/// How samples are allotted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allotment {
    /// Every pixel gets at least so many samples.
    pub least: u32,
    /// No pixel gets more.
    pub most: u32,
}

/// A place may have so many times the squared error of the frame.
const WORST2: f64 = 4.0;
/// In one pass a pixel's samples at most become so many times as many: its error is not known well
/// enough for more.
const GROWTH: f64 = 2.0;
/// Pixels that one thread sums.
const CHUNK: usize = 1 << 14;
/// So finely is the share chosen that is spread evenly.
const EVEN_STEPS: u32 = 8;

impl Allotment {
    /// The samples that an error needs in all, each pixel's, as real numbers; pixels that cannot be
    /// judged get the most. `error` is asked of the frame.
    pub fn needed(&self, estimate: &Estimate, error: f64) -> Vec<f64> {
        let wanted = error * error;
        let pixels = judged(estimate);
        let is_noisy = |pixel: &&Judged| pixel.is_noisy;
        let enough = wanted * pixels.iter().filter(is_noisy).count() as f64;
        let base = |r: f64, scale: f64| (scale * r.sqrt()).max(r / (WORST2 * wanted));
        let least_scale_of = |evenly: f64| {
            least_scale(|scale| {
                let mix = Mix::of(&pixels, evenly, |r| base(r, scale));
                let left = |pixel: &Judged| match pixel.is_noisy {
                    true => pixel.r / self.clamp(mix.count(base(pixel.r, scale))),
                    false => 0.0,
                };
                sum(&pixels, left) <= enough
            })
        };
        // The best share depends on the scale, and the scale on the share. What is left of the error is convex in the
        // share, so one that is at least the best is no worse than all evenly.
        let (mut evenly, mut scale) = (0.0, least_scale_of(0.0));
        loop {
            let best = self.even_share(&pixels, |r| base(r, scale));
            if best <= evenly {
                break;
            }
            (evenly, scale) = (best, least_scale_of(best));
        }
        let mix = Mix::of(&pixels, evenly, |r| base(r, scale));
        self.each(estimate, |_, r| self.clamp(mix.count(base(r, scale))))
    }

    /// The best use of so many samples in all, those that were taken counted.
    pub fn affordable(&self, estimate: &Estimate, samples: u64) -> Vec<f64> {
        let all = samples as f64;
        let judged = judged(estimate);
        let at = |scale: f64, evenly: f64| {
            let mix = Mix::of(&judged, evenly, |r| scale * r.sqrt());
            let pixels = self.each(estimate, |i, r| {
                self.clamp(mix.count(scale * r.sqrt())).max(estimate.samples(i))
            });
            (pixels.iter().sum::<f64>(), pixels)
        };
        let scale = least_scale(|scale| at(scale, 0.0).0 >= all);
        let evenly = self.even_share(&judged, |r| scale * r.sqrt());
        let scale = match evenly > 0.0 {
            true => least_scale(|scale| at(scale, evenly).0 >= all),
            false => scale,
        };
        at(scale, evenly).1
    }

    /// The share of all samples that is best spread evenly, if the rest is as `base` says of the squared error of a
    /// sample: with it the pixels' own halves expect the least error.
    fn even_share(&self, pixels: &[Judged], base: impl Fn(f64) -> f64 + Sync) -> f64 {
        let shares = (0..=EVEN_STEPS).map(|step| f64::from(step) / f64::from(EVEN_STEPS));
        let expected = |evenly: f64| {
            let mix = Mix::of(pixels, evenly, &base);
            let left = |pixel: &Judged| pixel.own / self.clamp(mix.count(base(pixel.r)));
            sum(pixels, left)
        };
        let none = (0.0, f64::INFINITY);
        let better = |best: (f64, f64), share: f64| {
            let sum = expected(share);
            if sum < best.1 { (share, sum) } else { best }
        };
        shares.fold(none, better).0
    }

    /// A count for each pixel, from the squared error of one sample; those without one get the most.
    fn each(&self, estimate: &Estimate, count: impl Fn(usize, f64) -> f64 + Sync) -> Vec<f64> {
        let of = |i: usize| match estimate.of_one_sample(i) {
            r if r.is_finite() && !estimate.is_spoilt(i) => count(i, r),
            _ => self.most.into(),
        };
        (0..estimate.pixels()).into_par_iter().map(of).collect()
    }

    fn clamp(&self, count: f64) -> f64 {
        count.clamp(self.least.into(), self.most.into())
    }

    /// The counts of the next pass towards what is needed: never fewer than there are, and not many more
    /// at once.
    pub fn next(&self, estimate: &Estimate, needed: &[f64]) -> Counts {
        let count = |(i, &needed): (usize, &f64)| {
            let now = estimate.samples(i);
            let wanted = needed.min(GROWTH * now).clamp(self.least.into(), self.most.into());
            let next = dithered(wanted, mask(i, estimate.width())).min(self.most);
            next.max(now as u32)
        };
        needed.iter().enumerate().map(count).collect()
    }
}

/// A pixel whose error can be judged.
struct Judged {
    /// The squared error that one sample would have, by the neighbours.
    r: f64,
    /// The same by the pixel's own halves.
    own: f64,
    /// It counts in the frame's error.
    is_noisy: bool,
}

/// The pixels that can be judged.
fn judged(estimate: &Estimate) -> Vec<Judged> {
    let of = |i: usize| Judged {
        r: estimate.of_one_sample(i),
        own: estimate.own_of_one_sample(i),
        is_noisy: estimate.is_noisy(i),
    };
    let sound = (0..estimate.pixels()).filter(|&i| !estimate.is_spoilt(i));
    sound.map(of).filter(|pixel| pixel.r.is_finite() && pixel.own.is_finite()).collect()
}

/// A sum over pixels in parallel, in an order that threads do not change.
fn sum(pixels: &[Judged], of: impl Fn(&Judged) -> f64 + Sync) -> f64 {
    let parts = pixels.par_chunks(CHUNK).map(|part| part.iter().map(&of).sum::<f64>());
    parts.collect::<Vec<_>>().iter().sum()
}

/// Counts of which a share is spread evenly.
struct Mix {
    evenly: f64,
    /// The mean of all counts.
    mean: f64,
}

impl Mix {
    fn of(pixels: &[Judged], evenly: f64, base: impl Fn(f64) -> f64 + Sync) -> Mix {
        let mean = match evenly > 0.0 {
            true => sum(pixels, |pixel| base(pixel.r)) / pixels.len() as f64,
            false => 0.0,
        };
        Mix { evenly, mean }
    }

    fn count(&self, base: f64) -> f64 {
        base + self.evenly * (self.mean - base)
    }
}

/// The least scale at which something is enough that grows with it; bisected over many decades.
fn least_scale(is_enough: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (-60.0_f64, 60.0_f64);
    while high - low > 1e-3 {
        let middle = 0.5 * (low + high);
        *(if is_enough(middle.exp2()) { &mut high } else { &mut low }) = middle;
    }
    high.exp2()
}

/// A fixed number in `[0, 1)` for each pixel, by its place in a picture of a width.
pub fn mask(pixel: usize, width: usize) -> f64 {
    let word = hash((pixel % width) as u32, !((pixel / width) as u32));
    f64::from(word) / 4_294_967_296.0
}

/// One of the two counts around a real number of samples, such that the mean variance is that of the
/// real number.
fn dithered(wanted: f64, mask: f64) -> u32 {
    let (low, high) = levels_around(wanted);
    let [l, w, h] = [f64::from(low), wanted, f64::from(high)].map(f64::recip);
    let share_of_low = if l > h { (w - h) / (l - h) } else { 1.0 };
    if mask < share_of_low { low } else { high }
}

/// The counts 2, 4, 6, 8, 12, 16, 24, ... on both sides of a number.
fn levels_around(wanted: f64) -> (u32, u32) {
    let mut low = 2_u32;
    loop {
        let high = if low.is_power_of_two() && low > 2 { low / 2 * 3 } else { next_power(low) };
        if f64::from(high) >= wanted || high >= 1 << 30 {
            return if f64::from(low) >= wanted { (low, low) } else { (low, high) };
        }
        low = high;
    }
}

fn next_power(count: u32) -> u32 {
    (count + 1).next_power_of_two()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::noise::{Grey, Halves};
    use proptest::prelude::*;

    const WIDTH: usize = 24;

    /// A picture whose left half has a thousand times the variance of its right half.
    fn uneven(scale: f64, samples: u32) -> Estimate {
        let pixel = |i: usize| {
            let deviation = scale * if i % WIDTH < WIDTH / 2 { 0.1 * 1e3_f64.sqrt() } else { 0.1 };
            let off = deviation / f64::from(samples).sqrt();
            let means = [scale * 10.0 - off, scale * 10.0 + off];
            Halves { counts: [samples / 2; 2], means, ..Halves::default() }
        };
        let pixels: Vec<Halves> = (0..WIDTH * WIDTH).map(pixel).collect();
        Estimate::of(&pixels, WIDTH, Grey::below(scale * 10.0))
    }

    fn error_with(estimate: &Estimate, counts: &[f64]) -> f64 {
        let squares = counts.iter().enumerate().map(|(i, n)| estimate.of_one_sample(i) / n);
        (squares.sum::<f64>() / counts.len() as f64).sqrt()
    }

    #[test]
    fn counts_around_a_number_are_those_of_good_nets() {
        let low = [2, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128];
        for pair in low.windows(2) {
            let between = 0.5 * f64::from(pair[0] + pair[1]);
            assert_eq!(levels_around(between), (pair[0], pair[1]));
            assert_eq!(levels_around(pair[1].into()).1, pair[1]);
        }
        assert_eq!(levels_around(1.0), (2, 2));
    }

    #[test]
    fn dithered_counts_have_the_variance_of_what_is_wanted() {
        for wanted in [2.0, 5.5, 9.0, 17.0, 30.1, 1000.0] {
            let masks = (0..10_000).map(|i| (f64::from(i) + 0.5) / 1e4);
            let variance: f64 = masks.map(|mask| f64::from(dithered(wanted, mask)).recip()).sum();
            assert!((variance / 1e4 * wanted - 1.0).abs() < 1e-3, "{wanted}");
        }
    }

    proptest! {
        /// What is needed for an error reaches it, whatever the unit of light; nothing cheaper of the same
        /// shape does. Noisier pixels get more samples, and less than in proportion.
        #[test]
        fn what_is_needed_is_enough_and_no_more(
            log_scale in -30.0..30.0f64,
            log_error in -3.0..-0.5f64,
        ) {
            let estimate = uneven(10f64.powf(log_scale), 16);
            let error = 10f64.powf(log_error);
            let allotment = Allotment { least: 1, most: 1 << 28 };
            let needed = allotment.needed(&estimate, error);
            let reached = error_with(&estimate, &needed);
            prop_assert!(reached <= error * 1.001, "{reached} for {error}");
            if needed.iter().all(|&n| n > 1.0) {
                prop_assert!(reached >= error * 0.99, "{reached} for {error}");
                let ratio = needed[0] / needed[WIDTH - 1];
                prop_assert!((10.0..1000.0).contains(&ratio), "{ratio}");
            }
            // The same number of samples, spread evenly, does worse.
            let mean = needed.iter().sum::<f64>() / needed.len() as f64;
            let even = error_with(&estimate, &vec![mean; needed.len()]);
            prop_assert!(even >= reached * 0.999);
        }

        /// Wherever noise is, in places or in single pixels, whatever their ratio, and if a part of the picture has none:
        /// the pixels' own halves expect no more error than of as many samples everywhere.
        #[test]
        fn samples_are_never_worse_spent_than_evenly(
            log_noise in prop::collection::vec(-4.0..4.0f64, 36),
            log_spots in 0.0..6.0f64,
            apart in 2usize..12,
            log_error in -3.0..-0.5f64,
            (is_asked, sky) in (any::<bool>(), 0..WIDTH - 8),
        ) {
            let pixel = |i: usize| {
                let (x, y) = (i % WIDTH, i / WIDTH);
                if y < sky {
                    return Halves { counts: [8; 2], means: [10.0; 2], ..Halves::default() };
                }
                let is_spot = x % apart == 0 && y % apart == 0;
                let spot = if is_spot { log_spots } else { 0.0 };
                let off = 10f64.powf(0.2 * log_noise[y / 4 * 6 + x / 4] + 0.2 * spot - 2.0);
                Halves { counts: [8; 2], means: [10.0 * (-off).exp(), 10.0], ..Halves::default() }
            };
            let pixels: Vec<Halves> = (0..WIDTH * WIDTH).map(pixel).collect();
            let estimate = Estimate::of(&pixels, WIDTH, Grey::below(10.0));
            let allotment = Allotment { least: 1, most: 1 << 28 };
            let counts = match is_asked {
                true => allotment.needed(&estimate, 10f64.powf(log_error)),
                false => allotment.affordable(&estimate, 1 << 20),
            };
            let left = |count: &dyn Fn(usize) -> f64| {
                (0..estimate.pixels()).map(|i| estimate.own_of_one_sample(i) / count(i)).sum::<f64>()
            };
            let mean = counts.iter().sum::<f64>() / counts.len() as f64;
            let (own, even) = (left(&|i| counts[i]), left(&|_| mean));
            // Below the least count nothing can be taken off.
            if counts.iter().all(|&n| n > 1.0) {
                prop_assert!(own <= 1.001 * even, "{own} for {even}");
            }
        }

        #[test]
        fn what_can_be_afforded_is_spent(budget in 1_000u64..1_000_000) {
            let estimate = uneven(1.0, 2);
            let allotment = Allotment { least: 2, most: 1 << 20 };
            let spent: f64 = allotment.affordable(&estimate, budget).iter().sum();
            let floor = (2 * WIDTH * WIDTH) as f64;
            prop_assert!((spent / (budget as f64).max(floor) - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn a_pixel_with_a_sample_left_out_gets_all_it_may() {
        let mut pixels = vec![Halves { counts: [8; 2], means: [1.0; 2], ..Halves::default() }; 64];
        pixels[9].is_spoilt = true;
        let estimate = Estimate::of(&pixels, 8, Grey::below(1.0));
        let needed = Allotment { least: 8, most: 512 }.needed(&estimate, 0.1);
        assert_eq!((needed[9], needed[10]), (512.0, 8.0));
    }
}
