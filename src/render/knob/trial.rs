//! Trials: what picking with other knobs would cost at the points of a path, and how noisy it would be.
//!
//! At every point lights are picked twice with each knob, with independent random numbers. The two
//! estimates have the same expectation whatever the path is, so half of their squared difference is
//! the variance of picking alone, without bias. The numbers are dealt as a render deals them, so that
//! the mean difference over a pixel's samples tells what stratification leaves of that variance. All
//! knobs get the same numbers: that some are better than others shows through the noise.

use super::Knobs;
use crate::light_tree::Splitting;
use crate::math::color::{Rgb, luminance};
use crate::math::random::{Sampler, hash};
use crate::render::path::TraceStats;
use std::ops::Range;

/// Knobs that are tried. From one to the next, thresholds fall to a third.
pub const KNOBS: [f32; 8] = [0.0, 0.03, 0.1, 0.25, 0.5, 0.75, 0.9, 0.97];

/// One of a kind for each knob at each kind of point.
pub type Each<T> = [[T; KNOBS.len()]; Knobs::KINDS];

/// Tries knobs at the points of paths.
#[derive(Debug)]
pub struct Trial {
    splitting: Splitting,
    /// Which of [`KNOBS`] are tried, by kind of point.
    tried: [Range<usize>; Knobs::KINDS],
    seed: u32,
    index: u32,
    /// The difference between both estimates, summed over a pixel's paths.
    pub differences: Each<f64>,
    /// What both estimates together cost.
    pub spent: Each<TraceStats>,
}

impl Trial {
    /// Nothing tried yet. All but the knob of `splitting` counts.
    pub fn new(splitting: Splitting, tried: [Range<usize>; Knobs::KINDS]) -> Trial {
        let (differences, spent) = Default::default();
        Trial { splitting, tried, seed: 0, index: 0, differences, spent }
    }

    /// Begins with the paths of another seed.
    pub fn begin(&mut self, seed: u32) {
        self.seed = seed;
        self.differences = Default::default();
    }

    /// The path with this number comes next.
    pub fn next_path(&mut self, index: u32) {
        self.index = index;
    }

    /// Tries the knobs at a point or stretch that a path reaches after some bounces; `throughput` is the
    /// share of its light that gets to the eye. `estimate` picks lights by some splitting, with four random
    /// numbers and the salt of the place, and adds up what they give and what that costs.
    pub fn at(
        &mut self,
        bounce: u32,
        throughput: Rgb,
        mut estimate: impl FnMut(&Splitting, ([f32; 4], u32), &mut TraceStats) -> Rgb,
    ) {
        let kind = Knobs::kind(bounce);
        if self.tried[kind].is_empty() {
            return;
        }
        let numbers = [1, 2].map(|twin| {
            let seed = hash(self.seed, hash(twin, bounce));
            (Sampler::new(seed, self.index).next_4d(), seed)
        });
        for tried in self.tried[kind].clone() {
            let how = Splitting { knob: KNOBS[tried], ..self.splitting };
            let spent = &mut self.spent[kind][tried];
            let [one, other] =
                numbers.map(|numbers| luminance(throughput * estimate(&how, numbers, spent)));
            self.differences[kind][tried] += f64::from(one - other);
        }
    }
}
