//! The choice of knobs: those whose variance times cost is least.
//!
//! Picks at different points of a path are independent, given the path: what they add to the variance
//! of a pixel and to its cost are sums over the kinds of points. Between two knobs that were tried both
//! are interpolated as power laws. A pilot is noisy. So variances are first made to fall as knobs rise,
//! as they do but for noise, and knobs far from the usual ones must be better by some margin.

use super::Knobs;
use super::trial::{Each, KNOBS};

/// What a pilot found. Variances are relative and in the mean over pixels; costs are those of a path.
#[derive(Clone, Copy, Debug, Default)]
pub struct Findings {
    /// Variance with the usual knobs.
    pub variance: f64,
    /// Cost of all but picking.
    pub cost: f64,
    /// Of it, the variance of picking with each knob that was tried.
    pub picking: Each<Option<Tried>>,
}

/// What one knob does at one kind of point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tried {
    /// Variance of picking.
    pub variance: f64,
    /// Cost of picking.
    pub cost: f64,
}

/// From one tried knob to the next in so many steps.
const STEPS: usize = 4;
/// A knob as far from the usual one as two tried ones are from each other must be better by this share;
/// twice as far, by four times that.
const MARGIN: f64 = 0.006;
/// At least this share of the variance is not from picking.
const LEAST_REST: f64 = 0.1;

/// A knob between those tried.
#[derive(Clone, Copy, Debug)]
struct Step {
    knob: f32,
    does: Tried,
    /// Factor on variance times cost, for its distance from the usual knob.
    handicap: f64,
}

impl Findings {
    /// The best knobs. `handicap` is a factor on the margin, the larger the smaller the pilot was.
    pub fn best(&self, handicap: f64) -> Knobs {
        let usual = Knobs::default();
        let steps: [Vec<Step>; Knobs::KINDS] = std::array::from_fn(|kind| {
            steps(&self.picking[kind], self.variance, usual.by_bounce[kind], handicap)
        });
        let of_usual = |(steps, knob): (&Vec<Step>, f32)| {
            let near = |step: &&Step| (ordinate(step.knob) - ordinate(knob)).abs();
            let nearest = steps.iter().min_by(|a, b| near(a).total_cmp(&near(b)));
            nearest.map_or(0.0, |step| step.does.variance)
        };
        let picking: f64 = steps.iter().zip(usual.by_bounce).map(of_usual).sum();
        let rest = (self.variance - picking).max(LEAST_REST * self.variance);
        let (mut best, mut least) = (usual, f64::INFINITY);
        for_each_way(&steps, |way| {
            let sum =
                |of: fn(&Tried) -> f64| way.iter().flatten().map(|s| of(&s.does)).sum::<f64>();
            let handicap: f64 = way.iter().flatten().map(|step| step.handicap).product();
            let product = (rest + sum(|t| t.variance)) * (self.cost + sum(|t| t.cost)) * handicap;
            if product < least {
                least = product;
                for (knob, step) in best.by_bounce.iter_mut().zip(way) {
                    *knob = step.map_or(*knob, |step| step.knob);
                }
            }
        });
        best
    }
}

/// Calls `visit` with every combination of steps, `None` where there are none.
fn for_each_way(steps: &[Vec<Step>; Knobs::KINDS], mut visit: impl FnMut([Option<&Step>; 3])) {
    let all = |kind: usize| {
        let none = steps[kind].is_empty().then_some(None);
        steps[kind].iter().map(Some).chain(none)
    };
    for first in all(0) {
        for second in all(1) {
            all(2).for_each(|later| visit([first, second, later]));
        }
    }
}

/// Where a knob stands on a scale on which the tried ones are 1 apart.
fn ordinate(knob: f32) -> f64 {
    let above = KNOBS.iter().position(|&tried| tried >= knob).unwrap_or(KNOBS.len() - 1);
    if above == 0 || KNOBS[above] == knob {
        return above as f64;
    }
    let [low, own, high] = [KNOBS[above - 1], knob, KNOBS[above]].map(readiness);
    above as f64 - 1.0 + if low > f64::MIN { (own - low) / (high - low) } else { 0.5 }
}

/// The logarithm of the factor by which a knob lowers thresholds.
fn readiness(knob: f32) -> f64 {
    let knob = f64::from(knob);
    (knob / (1.0 - knob)).ln().max(f64::MIN)
}

/// The tried knobs and those between them, with variances that fall.
fn steps(tried: &[Option<Tried>; KNOBS.len()], whole: f64, usual: f32, handicap: f64) -> Vec<Step> {
    let tried: Vec<(usize, Tried)> =
        tried.iter().enumerate().filter_map(|(at, tried)| Some((at, (*tried)?))).collect();
    let mut variances: Vec<f64> = tried.iter().map(|(_, tried)| tried.variance).collect();
    make_falling(&mut variances);
    // Powers of zero would be zero all the way.
    let floor = (1e-6 * whole).max(f64::MIN_POSITIVE);
    let known: Vec<(usize, f64, f64)> = tried
        .iter()
        .zip(&variances)
        .map(|(&(at, Tried { cost, .. }), variance)| (at, variance.max(floor), cost.max(1e-3)))
        .collect();
    let handicap = |ordinate: f64| {
        let off = ordinate - self::ordinate(usual);
        1.0 + MARGIN * handicap * off * off
    };
    let own = |&(at, variance, cost): &(usize, f64, f64)| Step {
        knob: KNOBS[at],
        does: Tried { variance, cost },
        handicap: handicap(at as f64),
    };
    let mut steps: Vec<Step> = known.first().map(own).into_iter().collect();
    for pair in known.windows(2) {
        let [(from, v0, c0), (to, v1, c1)] = [pair[0], pair[1]];
        // Between no splitting at all and a little, there is nothing.
        let between = if from == 0 { 0..0 } else { 1..STEPS };
        steps.extend(between.map(|step| {
            let t = step as f64 / STEPS as f64;
            let mixed = |a: f64, b: f64| a * (b / a).powf(t);
            let ease = readiness(KNOBS[from]) * (1.0 - t) + readiness(KNOBS[to]) * t;
            Step {
                knob: (1.0 / (1.0 + (-ease).exp())) as f32,
                does: Tried { variance: mixed(v0, v1), cost: mixed(c0, c1) },
                handicap: handicap(from as f64 + t),
            }
        }));
        steps.push(own(&pair[1]));
    }
    steps
}

/// Replaces numbers by the nearest ones, in the least squares of their logarithms, that never rise (pool
/// adjacent violators: Ayer et al. 1955).
fn make_falling(numbers: &mut [f64]) {
    let mut blocks: Vec<(f64, usize)> = Vec::with_capacity(numbers.len());
    for number in numbers.iter() {
        let mut block = (number.max(f64::MIN_POSITIVE).ln(), 1);
        while let Some(&(before, count)) = blocks.last() {
            if before >= block.0 {
                break;
            }
            let both = count + block.1;
            block = ((before * count as f64 + block.0 * block.1 as f64) / both as f64, both);
            blocks.pop();
        }
        blocks.push(block);
    }
    let flat = blocks.iter().flat_map(|&(value, count)| std::iter::repeat_n(value.exp(), count));
    numbers.iter_mut().zip(flat).for_each(|(number, value)| *number = value);
}
